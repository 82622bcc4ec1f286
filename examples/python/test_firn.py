"""Tests of the Python module; test.sh installs the module and runs them. FIRN_SCENE names the program 27_scene, the
simulation in C++ whose bits are compared."""

import os
import pathlib
import signal
import subprocess
import threading
import time
import warnings

import numpy as np
import pytest

import firn

EXAMPLES = pathlib.Path(__file__).resolve().parent.parent


def jelly(**more):
    choice = {
        "domain": {"lower": [0, 0, 0], "upper": [1, 1, 1], "cell_size": 0.05},
        "materials": [{"name": "fixed_corotated", "properties": {"young": 5e4, "poisson": 0.3}}],
    }
    choice.update(more)
    return choice


def ball(choice=None, velocity=None):
    simulation = firn.Simulation(choice or jelly())
    simulation.add(0, firn.sample_sphere([0.5, 0.4, 0.5], 0.15, spacing=0.025), 1000, velocity)
    return simulation


def bunnies():
    """The scene of examples/data/scenes/two_bunnies.json."""
    simulation = firn.Simulation(
        {
            "domain": {"lower": [0, 0, 0], "upper": [1, 1, 1], "cell_size": 0.01},
            "materials": [{"name": "fixed_corotated", "properties": {"young": 5e4, "poisson": 0.3}}],
            "boundary": [{"shape": "walls", "contact": "separate", "friction": 0.3}],
        }
    )
    bunny = firn.read_obj(EXAMPLES / "data/bunny.obj")
    filling = {"spacing": 0.005, "pattern": "jittered"}
    lower = firn.fitted(*bunny, centre=[0.47, 0.16, 0.5], size=0.3)
    upper = firn.fitted(*firn.rotated(*bunny, axis=[0, 1, 0], degrees=126), centre=[0.56, 0.62, 0.53], size=0.3)
    simulation.add(0, firn.sample_mesh(*lower, **filling), 1000)
    simulation.add(0, firn.sample_mesh(*upper, **filling), 1000, [0, -1, 0])
    return simulation


def test_bits_of_the_example(tmp_path):
    scene = os.environ.get("FIRN_SCENE")
    if not scene:
        pytest.skip("FIRN_SCENE does not name the program 27_scene")
    steps = 20
    subprocess.run(
        [scene, "--steps", str(steps), "--frames", "1", "--output", str(tmp_path)], check=True, capture_output=True
    )
    files = sorted(tmp_path.glob("*.hdf"))
    theirs = firn.read_state(str(files[-1]))
    assert theirs.step == steps
    simulation = bunnies()
    for _ in range(steps):
        simulation.step()
    mine = simulation.state(0)
    assert theirs.time == mine.time
    assert set(theirs) == set(mine)
    for name in mine:
        assert theirs[name].tobytes() == mine[name].tobytes(), name
    # With own.hpp, the state names a further kind of solids, of which there are none.
    if not mine.attributes["boundary"].endswith("_collider_rounded_box_list"):
        assert theirs.digest() == mine.digest()


def test_read_and_write():
    simulation = ball(velocity=[1, 0, 0])
    n = simulation.particles(0)
    positions = simulation.read("fixed_corotated", "position")
    assert positions.shape == (n, 3) and positions.dtype == np.float32
    assert simulation.read(0, "mass").shape == (n,)
    gradients = simulation.read(0, "deformation_gradient")
    assert np.array_equal(gradients, np.broadcast_to(np.eye(3, dtype=np.float32), (n, 3, 3)))
    assert np.array_equal(simulation.ids(0), np.arange(n))
    velocities = np.random.default_rng(1).normal(size=(n, 3)).astype(np.float32)
    simulation.write(0, "velocity", velocities)
    assert np.array_equal(simulation.read(0, "velocity"), velocities)
    simulation.write(0, "velocity", (2 * velocities).tolist())
    assert np.array_equal(simulation.read(0, "velocity", np.float64), 2 * velocities.astype(np.float64))
    out = np.empty((n, 3), np.float32)
    assert simulation.read(0, "velocity", out=out) is out
    assert np.array_equal(out, 2 * velocities)
    momentum = (simulation.read(0, "mass", float)[:, None] * simulation.read(0, "velocity", float)).sum(axis=0)
    assert np.allclose(simulation.totals(0)["momentum"], momentum, rtol=1e-12)
    with pytest.raises(TypeError):
        simulation.read(0, "velocity", out=np.empty((n, 6), np.float32)[:, ::2])
    with pytest.raises(firn.ParameterError):
        simulation.write(0, "velocity", velocities[1:])


def test_samples_are_views():
    samples = firn.sample_box([0.4, 0.4], [0.6, 0.6], spacing=0.02)
    assert len(samples) == 100 and samples.volume == pytest.approx(4e-4)
    samples.positions[:, 0] += 0.1
    assert samples.positions[:, 0].min() == pytest.approx(0.51)
    positions = samples.positions
    del samples
    assert positions.shape == (100, 2) and positions[:, 1].max() == pytest.approx(0.59)
    own = firn.Samples(positions, 4e-4)
    simulation = firn.Simulation({"domain": {"upper": [1, 1], "cell_size": 0.04}, "precision": "double"})
    assert simulation.add(0, own, 1000) == range(0, 100)
    assert simulation.add(0, own, 1000) == range(100, 200)
    assert np.allclose(simulation.read(0, "position")[:100], positions, rtol=0, atol=1e-15)
    assert simulation.read(0, "position").dtype == np.float64
    assert simulation.remove(0, np.arange(200) >= 100) == 100
    simulation.step()
    with pytest.raises(firn.ParameterError, match="3 dimensions, the samples have 2"):
        ball().add(0, own, 1000)


def test_run_is_advance():
    one, other = ball(), ball()
    one.advance(0.02)
    calls = []
    other.run(0.02, lambda now: calls.append((now.steps, now.time)), progress=True)
    assert one.steps == other.steps and one.time == other.time
    assert calls[-1] == (one.steps, one.time) and [steps for steps, _ in calls] == list(range(1, one.steps + 1))
    assert one.read(0, "position").tobytes() == other.read(0, "position").tobytes()
    times = []
    other.run(0.03, lambda now: times.append(now.time), every=0.01)
    assert np.allclose(times, [0.03, 0.04, 0.05], rtol=0, atol=1e-15)
    steps = other.steps
    other.run(1, lambda now: False)
    assert other.steps == steps + 1
    with pytest.raises(ZeroDivisionError):
        other.run(1, lambda now: 1 / 0)
    with pytest.raises(firn.ParameterError):
        other.run(-1)


def test_interrupt():
    simulation = ball()
    threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        simulation.run(1e6)
    simulation.step()


def test_states(tmp_path):
    simulation = ball(velocity=[0, -1, 0])
    simulation.advance(0.01)
    file = tmp_path / "ball.hdf"
    simulation.write_state(file)
    simulation.advance(0.01)
    other = firn.Simulation(jelly())
    other.restore(0, file)
    assert other.time == 0.01
    other.advance(0.01)
    mine, theirs = simulation.state(0), other.state(0)
    assert mine.digest() == theirs.digest()
    arrays = dict(mine)
    assert arrays["deformation_gradient"].shape == (mine.particles, 3, 3)
    assert mine.attributes["material"] == "fixed_corotated" and mine.units["velocity"] == "m/s"
    assert mine.parameters["material"]["mu"] == simulation.material(0)["mu"]
    arrays["velocity"][:] = 0
    assert mine.digest() != theirs.digest()
    del mine
    assert not arrays["velocity"].any()
    copy = simulation.copy()
    copy.step(), simulation.step()
    assert copy.state(0).digest() == simulation.state(0).digest()
    double = ball(jelly(precision="double"))
    double.write_state(tmp_path / "double.hdf")
    assert firn.read_state(tmp_path / "double.hdf")["velocity"].dtype == np.float64
    damaged = bytearray((tmp_path / "double.hdf").read_bytes())
    damaged[len(damaged) // 2] ^= 1
    (tmp_path / "double.hdf").write_bytes(damaged)
    with pytest.raises(firn.IoError) as problem:
        firn.read_state(tmp_path / "double.hdf")
    assert "read_state<" not in str(problem.value)
    with pytest.raises(firn.IoError, match="none.hdf"):
        firn.read_state(str(tmp_path / "none.hdf"))


def test_mistakes_have_sentences():
    with pytest.raises(firn.ParameterError, match="no material 'jam'; it has: fixed_corotated, "):
        firn.Simulation(jelly(materials=[{"name": "jam"}]))
    with pytest.raises(firn.IoError, match="^line 16, cell: there is no such member"):
        firn.Simulation({"materials": [{"name": "sand"}], "domain": {"lower": [0, 0], "upper": [1, 1], "cell": 1}})
    with pytest.raises(ValueError, match="Poisson's ratio is 0.7"):
        firn.Simulation(jelly(materials=[{"name": "fixed_corotated", "properties": {"young": 1, "poisson": 0.7}}]))
    simulation = ball()
    with pytest.raises(firn.Error, match="have no field 'colour'; they have: position, "):
        simulation.read(0, "colour")
    with pytest.raises(firn.MeshError):
        firn.sample_mesh(np.zeros((3, 3)), np.array([[0, 1, 2]], np.int32), spacing=0.1)
    with pytest.raises(firn.UsageError):
        ball(jelly(boundary=[{"shape": "walls"}])).reaction(0)
    velocities = simulation.read(0, "velocity")
    velocities[5] = np.nan
    with pytest.raises(firn.ParameterError, match="must be finite"):
        simulation.write(0, "velocity", velocities)
    velocities[5] = 1e9
    simulation.write(0, "velocity", velocities)
    simulation.set_fixed_time_step(1e-3)
    with pytest.raises(firn.ParticleError), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        simulation.step()


def test_warnings():
    simulation = ball(jelly(fixed_time_step=0.01))
    with pytest.warns(RuntimeWarning, match="bound"):
        simulation.step()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(RuntimeWarning, match="bound"):
            ball(jelly(fixed_time_step=0.01)).step()


def test_boundary():
    choice = jelly(boundary=[{"shape": "walls"}, {"shape": "sphere", "radius": 0.1, "position": [0.5, 0.14, 0.5]}])
    simulation = ball(choice, velocity=[0, -2, 0])
    simulation.measure_reactions()
    simulation.set_boundary_part(1, linear_velocity=[0, 1, 0])
    before = simulation.totals(0)["momentum"]
    simulation.step()
    pushed = simulation.reaction(1)["impulse"]
    assert pushed[1] > 0
    gravity = simulation.totals(0)["mass"] * np.array([0, -9.81, 0]) * simulation.last_time_step
    assert np.allclose(simulation.totals(0)["momentum"] - before, pushed + gravity, atol=1e-4 * abs(pushed[1]))
    assert simulation.boundary_part(1)["position"][1] == pytest.approx(0.14 + simulation.last_time_step, rel=1e-6)
    assert simulation.choice["boundary"][1]["radius"] == pytest.approx(0.1)
    simulation.gravity = [0, 0, 0]
    assert simulation.choice["gravity"] == [0, 0, 0]
    with pytest.raises(firn.IoError, match="mass"):
        simulation.set_boundary_part(1, mass=1)
    simulation.edit_material(0, {"mu": 1e4})
    assert simulation.material(0)["mu"] == 1e4


def test_sources_and_sinks():
    simulation = firn.Simulation({"domain": {"upper": [1, 1], "cell_size": 0.05}, "materials": [{"name": "fluid"}]})
    layer = firn.sample_box([0.4, 0.8], [0.6, 0.825], spacing=0.025)
    simulation.add_source("fluid", layer, 1000, [0, -1])
    simulation.add_sink("fluid", [0, 0], [1, 0.2])
    simulation.advance(0.24)
    assert simulation.particles("fluid") == 8 * 10
    simulation.advance(1)
    assert simulation.read("fluid", "position")[:, 1].min() > 0.2


def block(dimension, material="fixed_corotated", transfer="apic", **more):
    """A few particles, strained and moving at random, that run into walls and a turning sphere."""
    properties = {"young": 2e4, "poisson": 0.3}
    if material == "fluid":
        properties = {"bulk": 2e4, "viscosity": 5, "tension": 100}
    choice = {
        "domain": {"upper": [1, 1, 1][:dimension], "cell_size": 1 / 16},
        "materials": [{"name": material, "properties": properties}],
        "transfer": transfer,
        "boundary": [
            {"shape": "walls", "contact": "separate", "friction": 0.3},
            {
                "shape": "sphere",
                "radius": 0.15,
                "position": [0.42 if dimension == 2 else 0.33, 0.03, 0.1][:dimension],
                "linear_velocity": [-0.5, 0.3, 0.1][:dimension],
                "angular_velocity": 3 if dimension == 2 else [0, 0, 3],
                "friction": 0.4,
            },
        ],
        "precision": "double",
        "fixed_time_step": 4e-4,
        "threads": 1,
    }
    choice.update(more)
    simulation = firn.Simulation(choice)
    upper = 0.26 if dimension == 2 else 0.17
    simulation.add(0, firn.sample_box([0.03] * dimension, [upper] * dimension, spacing=1 / 32), 1000)
    random = np.random.default_rng(3)
    simulation.remove(0, random.random(simulation.particles(0)) < 0.1)  # ids have gaps
    sizes = {"position": 3e-3, "velocity": 1, "mass": 1e-4, "volume": 1e-6}
    if choice["precision"] == "double":
        sizes |= {"affine_velocity": 5, "volume_ratio" if material == "fluid" else "deformation_gradient": 0.01}
    for name, size in sizes.items():
        values = simulation.read(0, name)
        values += size * random.uniform(-1, 1, values.shape)
        if name == "velocity":
            values += [3, -2, 0][:dimension]
        if name == "volume_ratio":
            values -= 0.02  # off the kink at 1
        simulation.write(0, name, values)
    return simulation


def loss(positions, velocities):
    weights = np.random.default_rng(7).uniform(-1, 1, (2, *positions.shape))
    value = (weights * [positions, 0.5 * velocities**2]).sum()
    return value, weights[0], weights[1] * velocities


def slope(simulation, duration, change):
    """The derivative of the loss after a run by h, where change(copy, h) changes a copy before it: by differences of
    several sizes."""

    def value(h):
        copy = simulation.copy()
        change(copy, h)
        copy.run(duration)
        return loss(copy.read(0, "position"), copy.read(0, "velocity"))[0]

    quotients = []
    for h in (1e-4, 1e-5, 1e-6):
        quotients.append((8 * (value(h) - value(-h)) - (value(2 * h) - value(-2 * h))) / (12 * h))
    return quotients


def walk(by, values, path=()):
    """The numbers of a part of the boundary that can be a little more and a little less: path, derivative, value."""
    for name, one in by.items():
        if isinstance(one, dict):
            yield from walk(one, values[name], (*path, name))
        elif not isinstance(one, str) and name not in ("rotation", "thickness", "lower", "upper"):
            yield (*path, name), np.array(one, float), np.array(values[name], float)


SPHERE = ("friction", "position", "linear_velocity", "angular_velocity")


def changed(part, path, value):
    part = dict(part)
    part[path[0]] = value.tolist() if len(path) == 1 else changed(part[path[0]], path[1:], value)
    return part


@pytest.mark.parametrize("transfer", ["apic", "aflip"])
@pytest.mark.parametrize("material", ["fixed_corotated", "neo_hookean", "fluid"])
@pytest.mark.parametrize("dimension", [2, 3])
def test_gradient(dimension, material, transfer):
    """The derivatives by all that a run begins with, against differences of runs."""
    simulation = block(dimension, material, transfer)
    simulation.run(2e-3)
    before, duration = simulation.state(0).digest(), 6.2e-3  # the last step is shortened
    ends = []

    def called(positions, velocities):
        assert simulation.time == pytest.approx(2e-3)  # it may be used
        ends.append((positions.tobytes(), velocities.tobytes()))
        return loss(positions, velocities)

    value, by = firn.gradient(simulation, duration, called)
    assert simulation.state(0).digest() == before
    end = simulation.copy()
    end.run(duration)
    assert ends == [(end.read(0, "position").tobytes(), end.read(0, "velocity").tobytes())]
    assert value == loss(end.read(0, "position"), end.read(0, "velocity"))[0]

    random = np.random.default_rng(5)
    checked = set()

    def check(what, derivatives, size, change):
        direction = size * random.uniform(0.5, 1, np.shape(derivatives)) * random.choice([-1, 1], np.shape(derivatives))
        wanted = float((derivatives * direction).sum())
        quotients = slope(simulation, duration, lambda copy, h: change(copy, h * direction))
        assert min(abs(one - wanted) for one in quotients) <= 1e-6 * abs(wanted) + 1e-10, (what, wanted, quotients)
        if wanted != 0:
            checked.add(what)

    fields = [name for name in simulation.fields(0) if name not in ("place", "kirchhoff_stress")]
    assert set(by) == {*fields, "material", "gravity", "boundary"}
    sizes = {"position": 0.01, "velocity": 1, "affine_velocity": 10, "mass": 0.1, "volume": 1e-4}
    for name in fields:
        values = simulation.read(0, name)
        assert by[name].shape == values.shape

        def change(copy, change, name=name, values=values):
            copy.write(0, name, values + change)

        check(name, by[name], sizes.get(name, 0.1), change)
    check("gravity", by["gravity"], 10, lambda copy, change: setattr(copy, "gravity", copy.gravity + change))
    parameters = simulation.material(0)
    assert set(by["material"]) == set(parameters)
    for name, parameter in parameters.items():
        change = lambda copy, change: copy.edit_material(0, {name: parameter + float(change)})
        check(name, by["material"][name], 0.5 * parameter, change)
    for k, derivatives in enumerate(by["boundary"]):
        part = simulation.boundary_part(k)
        for path, derivative, number in walk(derivatives, part):
            change = lambda copy, change: copy.set_boundary_part(k, **changed(part, path, number + change))
            check(path, derivative, 0.1, change)
    of_boundary = {("faces", "y_lower", "friction"), *((name,) for name in SPHERE)}
    assert checked >= {*fields, *parameters, "gravity", *of_boundary} - {"tension"}


def test_gradient_of_a_throw():
    """The example of README.md: a jelly is thrown to a target."""
    text = (EXAMPLES / "python/README.md").read_text()
    example = text.split("## Derivatives")[1].split("```python\n")[1].split("```")[0]
    names = {}
    exec(example, names)
    assert names["distance"] < 1e-3


def test_gradient_needs():
    def flat(positions, velocities):
        return 0, None, None

    simulation = block(2)
    n = simulation.particles(0)
    by = [firn.gradient(simulation, 0.01, loss, memory=memory)[1] for memory in (60_000, 1 << 26)]  # of 25 states, 3 fit
    assert all(by[0][name].tobytes() == by[1][name].tobytes() for name in ("position", "velocity", "mass"))
    value, by_nothing = firn.gradient(simulation, 0, lambda x, v: (x[:, 0].sum(), np.ones_like(x) * [1, 0], None))
    assert np.array_equal(by_nothing["position"], np.ones((n, 2)) * [1, 0]) and not by_nothing["velocity"].any()
    with pytest.raises(firn.ParameterError, match="a checkpoint of this simulation takes"):
        firn.gradient(simulation, 0.01, loss, memory=1000)
    with pytest.raises(firn.ParameterError, match="negative"):
        firn.gradient(simulation, 0.01, loss, memory=-1)
    with pytest.raises(firn.ParameterError, match="precision \"double\"; this simulation has \"float\""):
        firn.gradient(block(2, precision="float"), 0.01, flat)
    with pytest.raises(firn.ParameterError, match="through 'sand' here; .* fixed_corotated, neo_hookean, fluid"):
        firn.gradient(block(2, "sand"), 0.01, flat)
    with pytest.raises(firn.ParameterError, match="one material; this simulation has 2"):
        firn.gradient(block(2, materials=[{"name": "fixed_corotated"}, {"name": "fluid"}]), 0.01, flat)
    with pytest.raises(firn.ParameterError, match="duration"):
        firn.gradient(simulation, -1, flat)
    with pytest.raises(firn.ParameterError, match="returned one float; it must return its value"):
        firn.gradient(simulation, 0.01, lambda x, v: 1.0)
    with pytest.raises(firn.ParameterError, match="returned 2 values"):
        firn.gradient(simulation, 0.01, lambda x, v: (1.0, x))
    with pytest.raises(firn.ParameterError, match="velocities of the shape .2,.; the velocities have"):
        firn.gradient(simulation, 0.01, lambda x, v: (1.0, None, v[0]))
    with pytest.raises(firn.ParameterError, match="positions that are not finite"):
        firn.gradient(simulation, 0.01, lambda x, v: (1.0, x * np.inf, None))
    with pytest.raises(ZeroDivisionError):
        firn.gradient(simulation, 0.01, lambda x, v: 1 / 0)
    with pytest.warns(RuntimeWarning, match="bound"):
        firn.gradient(block(2, fixed_time_step=5e-3), 0.005, flat)
    simulation.add_sink(0, [0, 0], [0.01, 0.01])
    with pytest.raises(firn.ParameterError, match="without sources and sinks"):
        firn.gradient(simulation, 0.01, flat)


def test_own_material():
    """The module that is installed with own.hpp has the material of examples/own_material.hpp, too."""
    try:
        simulation = ball(jelly(materials=[{"name": "soft_tissue", "parameters": {"mu": 2e4, "lambda": 3e4}}]))
    except firn.ParameterError as problem:
        assert "no material 'soft_tissue'" in str(problem)
        pytest.skip("The module was installed without own.hpp")
    assert simulation.material("soft_tissue") == {"mu": 2e4, "lambda": 3e4, "stiffening": 0.5}
    simulation.advance(0.05)
    totals = simulation.totals()
    assert totals["elastic_energy"] > 0 and totals["kinetic_energy"] > 0
    with pytest.raises(firn.ParameterError, match="no derivatives through 'soft_tissue' here"):
        firn.gradient(block(2, materials=[{"name": "soft_tissue"}]), 0.01, loss)


def test_own_shape():
    """The module that is installed with own.hpp has the solid of examples/own_shape.hpp, too."""
    box = {"shape": "rounded_box", "half_extents": [0.2, 0.1, 0.2], "position": [0.5, 0.1, 0.5], "friction": 0.25}
    try:
        simulation = ball(jelly(boundary=[{"shape": "walls"}, box]))
    except firn.IoError as problem:
        assert "'rounded_box' is no shape" in str(problem)
        pytest.skip("The module was installed without own.hpp")
    given = simulation.boundary_part(1)
    assert {name: given[name] for name in box} == box and given["rounding"] == 0.02
    simulation.set_boundary_part(1, rounding=0.05, linear_velocity=[0, 0.25, 0])
    simulation.measure_reactions()
    simulation.advance(0.2)
    assert simulation.reaction(1)["impulse"][1] > 0
    now = simulation.choice["boundary"][1]
    assert now["rounding"] == 0.05 and abs(now["position"][1] - 0.15) < 1e-12
    assert simulation.read(0, "position")[:, 1].min() > 0.25
    with pytest.raises(firn.IoError, match="rounding: The rounding of a rounded box is 0.3 m"):
        simulation.set_boundary_part(1, rounding=0.3)
    with pytest.raises(firn.IoError, match="no such number; it has: shape, contact, half_extents, rounding"):
        simulation.set_boundary_part(1, radius=0.3)
    assert firn.Simulation(simulation.choice).boundary_part(1) == now


def test_threads():
    """Eight threads run simulations of their own, and four share one."""
    expected = ball(jelly(threads=1))
    for _ in range(40):
        expected.step()
    digest = expected.state(0).digest()
    several = [ball(jelly(threads=1)) for _ in range(8)]
    shared = ball(jelly(threads=1))

    def steps(simulation, count):
        for _ in range(count):
            simulation.step()
            simulation.read(0, "position")

    workers = [threading.Thread(target=steps, args=(one, 40)) for one in several]
    workers += [threading.Thread(target=steps, args=(shared, 10)) for _ in range(4)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert [one.state(0).digest() for one in several] == [digest] * 8
    assert shared.steps == 40 and shared.state(0).digest() == digest


def ticks(work):
    """How often another thread has the interpreter's lock while work() runs, from the time that it returns."""
    working, at = True, []

    def tick():
        while working:
            at.append(time.monotonic())
            time.sleep(0.002)

    clock = threading.Thread(target=tick)
    clock.start()
    begin = work()
    end = time.monotonic()
    working = False
    clock.join()
    return sum(begin < one < end for one in at)


def test_step_does_without_the_lock():
    simulation = bunnies()
    simulation.step()

    def advance():
        begin = time.monotonic()
        simulation.advance(100 * simulation.last_time_step)
        return begin

    assert ticks(advance) > 10


def test_way_back_does_without_the_lock():
    simulation = ball(jelly(precision="double"))
    begin = []

    def called(positions, velocities):
        begin.append(time.monotonic())
        return 0, np.ones_like(positions), None

    def back():
        firn.gradient(simulation, 0.8, called)
        return begin[0]

    assert ticks(back) > 10
