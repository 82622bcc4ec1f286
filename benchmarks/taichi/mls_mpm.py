"""MLS-MPM of the two cubes in Taichi, on the CPU: APIC, quadratic B-splines, fixed corotated elasticity, as Taichi's
own examples write it. Started by compare.py: `mls_mpm.py SCENE STEPS THREADS` steps as often as the scene's reference,
says how far it is from it, and then, for every number of steps that it reads, how many seconds they took.
"""
import sys
import time

import numpy as np
import taichi as ti

scene = np.fromfile(sys.argv[1], dtype=np.float32)
reference_steps, threads = int(sys.argv[2]), int(sys.argv[3])
ti.init(arch=ti.cpu, cpu_max_num_threads=threads, fast_math=True, default_fp=ti.f32, log_level=ti.ERROR)

cells = int(scene[0])
dt, young, poisson, volume = (float(number) for number in scene[1:5])
particles = scene[5:].reshape(-1, 18)
h = 1 / cells
mass = volume  # 1 kg/m³
mu = young / (2 * (1 + poisson))
lam = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
gravity = 9.81

x = ti.Vector.field(3, ti.f32, shape=len(particles))
v = ti.Vector.field(3, ti.f32, shape=len(particles))
C = ti.Matrix.field(3, 3, ti.f32, shape=len(particles))
F = ti.Matrix.field(3, 3, ti.f32, shape=len(particles))
x.from_numpy(particles[:, 0:3].copy())
v.from_numpy(particles[:, 3:6].copy())
C.from_numpy(particles[:, 6:15].reshape(-1, 3, 3).copy())
F.from_numpy(np.tile(np.eye(3, dtype=np.float32), (len(particles), 1, 1)))

# Momentum (then velocity) and mass of a node lie side by side: faster here than two fields, blocks, or a sparse grid.
grid_v = ti.Vector.field(3, ti.f32)
grid_m = ti.field(ti.f32)
ti.root.dense(ti.ijk, cells + 3).place(grid_v, grid_m, offset=(-1, -1, -1))


@ti.func
def weights(fx):
    return [0.5 * (1.5 - fx) ** 2, 0.75 - (fx - 1) ** 2, 0.5 * (fx - 0.5) ** 2]


@ti.kernel
def clear_grid():
    for node in ti.grouped(grid_m):
        grid_v[node] = ti.zero(grid_v[node])
        grid_m[node] = 0


@ti.kernel
def particles_to_grid():
    for p in x:
        base = ti.floor(x[p] / h - 0.5).cast(int)
        fx = x[p] / h - base.cast(float)
        w = weights(fx)
        U, sigma, V = ti.svd(F[p])
        R = U @ V.transpose()
        J = F[p].determinant()
        stress = 2 * mu * (F[p] - R) @ F[p].transpose() + ti.Matrix.identity(float, 3) * lam * J * (J - 1)
        affine = mass * C[p] - dt * volume * 4 / h**2 * stress
        for i, j, k in ti.static(ti.ndrange(3, 3, 3)):
            offset = ti.Vector([i, j, k])
            weight = w[i].x * w[j].y * w[k].z
            grid_v[base + offset] += weight * (mass * v[p] + affine @ ((offset - fx) * h))
            grid_m[base + offset] += weight * mass


@ti.kernel
def update_grid():
    for node in ti.grouped(grid_m):
        if grid_m[node] > 0:
            velocity = grid_v[node] / grid_m[node]
            velocity.y -= dt * gravity
            for a in ti.static(range(3)):
                if node[a] <= 0:
                    velocity[a] = max(velocity[a], 0)
                if node[a] >= cells:
                    velocity[a] = min(velocity[a], 0)
            grid_v[node] = velocity


@ti.kernel
def grid_to_particles():
    for p in x:
        base = ti.floor(x[p] / h - 0.5).cast(int)
        fx = x[p] / h - base.cast(float)
        w = weights(fx)
        new_v = ti.Vector.zero(float, 3)
        new_C = ti.Matrix.zero(float, 3, 3)
        for i, j, k in ti.static(ti.ndrange(3, 3, 3)):
            offset = ti.Vector([i, j, k])
            weighted = w[i].x * w[j].y * w[k].z * grid_v[base + offset]
            new_v += weighted
            new_C += 4 / h * weighted.outer_product(offset - fx)
        v[p], C[p] = new_v, new_C
        F[p] = (ti.Matrix.identity(float, 3) + dt * new_C) @ F[p]
        x[p] = ti.math.clamp(x[p] + dt * new_v, 0.0, 1.0)


def run(steps):
    begin = time.perf_counter()
    for _ in range(steps):
        clear_grid()
        particles_to_grid()
        update_grid()
        grid_to_particles()
    ti.sync()
    return time.perf_counter() - begin


run(reference_steps)
print(np.abs(x.to_numpy() - particles[:, 15:18]).max(), flush=True)
for line in sys.stdin:
    print(run(int(line)), flush=True)
