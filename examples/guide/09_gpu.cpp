//! # On a GPU
//!
//! A simulation goes to a GPU in one line. Its steps run there, and its states are those of the CPU:
//!
//! ```cpp
//! #include <firn/webgpu/on_gpu.hpp>
//!
//! firn::Simulation simulation(domain, material, walls, firn::FixedPoint<>{.float_steps = true});
//! simulation.add(firn::sample_box<3>({0.2, 0.1, 0.2}, {0.6, 0.5, 0.6}, {.spacing = 0.01}), 1000);
//! auto gpu = firn::webgpu::on_gpu(simulation);             // a copy, on the first GPU that WebGPU finds
//! gpu.advance(0.02);                                       // step() and advance(), as on the CPU
//! firn::write_state("state.h5", firn::state_of(gpu));
//! gpu.edit().gravity = {0, -1.62, 0};                      // a change: of policies, particles, or all by restore()
//! gpu.advance(0.02);
//! firn::Simulation back = gpu.simulation();                // a copy, to go on with on the CPU
//! ```
//!
//! Link `firn::webgpu`, which needs a library with WebGPU's C interface: Dawn, or wgpu-native, which ends the program
//! where a device refuses a command.
//! `examples/23_on_gpu.cpp` is a whole program.
//!
//! - The GPU adds up integers: give the simulation `firn::FixedPoint<std::int32_t>`, so that the CPU does the same. Steps
//!   at their bound are chosen in float then (`float_steps`), or give a `fixed_time_step`.
//! - Where the device rounds as IEEE 754 says, and the program is compiled with `-ffp-contract=off`, the run has the
//!   CPU's bits, but for the sign of zeros. Software GPUs do so. Drivers of hardware round otherwise, so on hardware
//!   programs are exact (`firn::wgsl::Arithmetic`): products, quotients and roots are written so that a driver cannot.
//!   `webgpu::DeviceOptions` choose.
//! - There may be up to eight materials of any kind, any transfer, kernel and force form, walls and colliders that
//!   move, also of meshes, periodic axes, FBar and VolumeFilter. Sources, sinks and lifespans of bodies act on the
//!   CPU: a run waits for it where a burst is due, a body ends, or a particle may have met a sink. Loads are those of
//!   a `firn::UniformForce`, added in float (`float_steps`). Other loads, forces between particles, and passes of your
//!   own are refused in a sentence. The state of one of several materials is `gpu.state_of_set<firn::Snow<float>>()`.
//! - `gpu.step(field)` and `gpu.advance(0.02, field)` take an acceleration in place of gravity, as on the CPU: a vector,
//!   firn's Attraction and Damped, or one of your own that lists its `parameters()`. These may change from call to call.
//!   A field of another type needs another program: the particles then go to the CPU and back.
//! - `gpu.reactions()` gives the impulses of the boundary and of loads, as `simulation.reactions` does on the CPU, from
//!   run to run the same and within 1e-6 of the CPU's.
//! - The device has the blocks of nodes that particles reach, as the CPU does, and finds them itself: a domain may have
//!   4096³ cells. It has all nodes of the domain if those are at most twice as many, and for particle shifting, which a
//!   periodic domain cannot have there. Particles that do not fit into one buffer are kept in several.
//! - Particles come back only where they are asked for: by `state_of`, `totals`, `simulation` or `edit`.
//! - An error names the step, a particle and the likely cause, as on the CPU. It comes at the latest 256 steps later.
//!
//! ## The program
//!
//! firn writes a complete WGSL program from the same policies, without a change of their code. Your own material works,
//! too. To write the program, firn calls the policies with a scalar that records its operations. So no formula is
//! written twice.
#include <firn/boundary/walls.hpp>
#include <firn/force/mls.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/transfer/apic.hpp>
#include <firn/wgsl/program.hpp>

#include "../own_material.hpp"

#include <fstream>
#include <iostream>

int main() {
    const SoftTissue<float> tissue{.mu = 2e4F, .lambda = 3e4F};
    const auto walls = firn::Walls<float, 3>::all({0, 0, 0}, {1, 1, 1}, {firn::Contact::separate, 0});
    const auto program = firn::wgsl::make_program<firn::QuadraticBSpline, firn::Apic, firn::MlsForce, 3>(tissue, walls);

    //! `program.code` is WGSL. The manifest is JSON. It lists what a host needs to know: uniforms with their units and
    //! offsets, buffers, entry points, and the order in which a step calls the entry points.
    std::ofstream("program.wgsl") << program.code;
    std::ofstream("manifest.json") << firn::wgsl::manifest(program);
    std::cout << program.name << ": " << program.code.size() << " bytes of WGSL\n";

    //! ## Run it
    //!
    //! `examples/web/firn.mjs` runs programs in a browser, in node or in Deno, also those of several materials on one
    //! grid; `examples/web/sources.mjs` adds sources. `examples/web/run.sh` serves a web page that runs scenes.
    //!
    //! In C++, a webgpu::Host runs a program, of which it knows nothing but the manifest:
    //!
    //! ```cpp
    //! #include <firn/webgpu/host.hpp>
    //!
    //! const firn::webgpu::Device device;
    //! firn::webgpu::Host host(
    //!     device, program, firn::wgsl::make_inputs<3>(program, domain, cpu.particles(), 1e-4, device.limits()));
    //! host.initialise();
    //! host.step(100);
    //! host.check();                                 // throws if a particle has left the domain, …
    //! const auto velocity = host.read("velocity");  // m/s, three numbers for each particle
    //! ```
    //!
    //! ## What to know
    //!
    //! - P2G adds integers with atomics. So the sums do not depend on their order: they have the same bits as on the
    //!   CPU (firn::FixedPoint). The scale of the integers comes from a bound, so that no sum overflows.
    //! - If an integer would overflow, or a particle leaves the domain, the program stops with an error in the buffer
    //!   `status`.
    //! - WebGPU's default limits (eight storage buffers a stage, 128 MiB a buffer) allow 3.7 million particles in 3D
    //!   and a grid of up to 200³ nodes. With a device of higher limits, both may be larger. More particles need several
    //!   Hosts on one grid, as `on_gpu` makes them.
    //! - A program has all nodes of its domain, or those of blocks that particles reach
    //!   (`firn::wgsl::GridStorage::sparse`, one of the `firn::wgsl::ProgramOptions` of `make_program`).
    //! - Programs support all transfers, and float; periodic axes with a sparse grid
    //!   (`ProgramOptions::periodic`). Each has one material; programs of several share the buffers of the grid.
    //! - A mesh, or a function that is sampled, is a firn::DistanceGrid. `make_inputs` returns its distances for the
    //!   buffer `distances`, and uniforms tell where they lie: another mesh of the same type needs no other program, but
    //!   other inputs. If distances are capped (`exact_up_to`), the cap is a fixed part of the program.
    //! - A program has positions in metres, in float. Far from 0 they have few digits; `on_gpu` measures them from the
    //!   domain's lower corner, as the CPU does (firn::measured_from moves a boundary).
    //! - Mirrored walls must lie on planes of nodes also where a host moves them; a step reports an error otherwise.
    //! - For FBar or VolumeFilter, give the acceleration field and the policy: `make_program<…>(tissue, walls, gravity,
    //!   firn::FBar{})`. The parameters of VolumeFilter become fixed parts of the program. It counts its steps from 0.
    //!   Where VolumeFilter shifts particles, and the host moves walls, it sets room_lower and room_upper anew.
    //!
    //! `06_emit_wgsl --list` lists the programs that it writes: every kernel, transfer and force form with one material,
    //! every material with one of these, and two with an obstacle: a box, and a mesh, whose distances it writes beside
    //! the program. `--all FOLDER` writes them. firn::wgsl makes a program of any other combination.
    //!
    //! If the uniform `bound_time_step` is 1, no step is longer than the stable time step, as on the CPU.
    //! `host.advance(duration)` takes such steps until the time has passed, on the GPU alone. They are those of the
    //! CPU, to the bit, with `firn::FixedPoint<>{.float_steps = true}`.
    //!
    //! ![A snowball breaks on a wall in the browser: examples/web](../images/web.png)
    return program.code.size() > 1000 ? 0 : 1;
}
