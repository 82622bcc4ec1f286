#!/usr/bin/env python3
"""benchmarks/table.py [--write]: the tables of benchmarks/README.md from what was measured (build/benchmarks/*.json), on
the terminal or, with --write, between the marks in that file. What was not measured is left as it stands.
"""
import json
import math
import re
import sys

import results
from mpi.model import mpi_messages, mpi_model


def load(name):
    file = results.folder / name
    return results.load(file) if file.exists() else (None, {})


def table(head, rows, left=1):
    lines = [head, ["---"] * left + ["---:"] * (len(head) - left), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)


def number(value, digits=3):
    """So many significant digits, without an exponent."""
    if value is None:
        return ""
    places = max(0, digits - 1 - math.floor(math.log10(abs(value)))) if value else 0
    return f"{value:,.{places}f}"


def steps(numbers, scene, execution, threads):
    return numbers.get(f"step/{scene}/{execution}/threads:{threads}")


def rates(numbers, scene, execution="coloured"):
    """The rates on one and on two threads, and the ratio."""
    one, two = (steps(numbers, scene, execution, threads) for threads in (1, 2))
    both = one and two
    return [number(one and results.rate(one)), number(two and results.rate(two)),
            f"{results.rate(two) / results.rate(one):.2f}" if both else ""]


def machine():
    context, _ = load("results.json")
    return context and f"{results.machine(context)}; {context['date'][:10]}."


def ratio():
    from ratio import rows

    context, numbers = load("ratio.json")
    return context and table(
        ["", "M particle-steps/s", "times the Eigen code", "by CPU time"],
        [[f"`{name}`", number(rate), number(times), number(cpu)] for name, rate, times, cpu in rows(numbers)])


def sizes():
    _, numbers = load("results.json")
    scene_a = steps(numbers, "two_cubes", "coloured", 1)
    if not scene_a:
        return None
    rows, logs = [], []
    for scene in ("two_cubes_8k", "two_cubes_10k", "two_cubes_100k", "two_cubes", "two_cubes_1m", "two_cubes_8m",
                  "two_cubes_16m"):
        of = steps(numbers, scene, "coloured", 1)
        if not of:
            continue
        rows.append([f"`{scene}`", f"{int(of['particles']):,}", *rates(numbers, scene),
                     f"{100 * results.rate(of) / results.rate(scene_a):.0f} %",
                     number(of["bytes_per_particle"]), number(of["grid_bytes_per_particle"])])
        if 10_000 <= of["particles"] <= 8_000_000:
            logs.append((math.log(of["particles"]), math.log(of["particles"] / of["particle_steps_per_second"])))
    mean_x, mean_y = (sum(column) / len(logs) for column in zip(*logs))
    exponent = sum((x - mean_x) * (y - mean_y) for x, y in logs) / sum((x - mean_x) ** 2 for x, _ in logs)
    return table(["scene", "particles", "1 thread", "2 threads", "2 / 1", "of `two_cubes`", "bytes a particle",
                  "grid, bytes a particle"], rows) + (
        f"\n\nThe time of a step on one thread grows as the number of particles to the power of {exponent:.3f}, fitted "
        f"from {math.exp(logs[0][0]):,.0f} to {math.exp(logs[-1][0]):,.0f} particles.")


def scenes():
    _, numbers = load("results.json")
    rows = []
    for scene in ("bunnies", "dense_block", "thin_sheet", "splash", "disorder_solid", "disorder_sheet", "spray_11",
                  "spray_4", "two_cubes_pic", "two_cubes_flip", "two_cubes_flip_1m", "two_cubes_fmpm",
                  "two_cubes_gradient", "two_cubes_cubic", "two_cubes_2d", "two_cubes_double"):
        if of := steps(numbers, scene, "coloured", 1):
            rows.append([f"`{scene}`", f"{int(of['particles']):,}", *rates(numbers, scene),
                         number(of["bytes_per_particle"]), number(of["grid_bytes_per_particle"])])
    return rows and table(["scene", "particles", "1 thread", "2 threads", "2 / 1", "bytes a particle",
                           "grid, bytes a particle"], rows)


def contact():
    _, numbers = load("results.json")
    rows = []
    for scene in ("two_cubes_apart", "two_cubes_meet", "stones"):
        one, groups = ([steps(numbers, name, "coloured", threads) for threads in (1, 2)]
                       for name in (scene + "_one_field", scene))
        if all(one + groups):
            rows.append([f"`{scene}`", *(number(results.rate(of)) for of in (one[0], groups[0])),
                         *(f"{results.rate(a) / results.rate(b):.2f}" for a, b in zip(one, groups))])
    return rows and table(["scene", "one field, 1 thread", "groups, 1 thread", "times as long", "on 2 threads"], rows)


def materials():
    _, numbers = load("results.json")
    times = {name.split("/")[2]: 1e9 / of["particle_steps_per_second"] for name, of in numbers.items()
             if name.startswith("step/cubes/") and name.endswith("/threads:1")}
    if not times:
        return None

    def faster(name):
        return f"{times[name] * numbers[f'step/cubes/{name}/threads:2']['particle_steps_per_second'] / 1e9:.2f}"

    rows = [[f"`{name}`", number(1e3 / time), number(time), f"{time / times['fixed_corotated']:.2f}", faster(name)]
            for name, time in sorted(times.items(), key=lambda item: item[1]) if name != "four"]
    mixed = times["four"]
    mean = sum(times[name] for name in ("fixed_corotated", "fluid", "sand", "snow")) / 4
    rows.append(["a cube each of `fixed_corotated`, `fluid`, `sand`, `snow`", number(1e3 / mixed), number(mixed),
                 f"{mixed / mean:.2f} of the cubes' mean", faster("four")])
    return table(["material", "M particle-steps/s", "ns a particle", "of fixed corotated", "2 threads / 1"], rows)


def executions():
    _, numbers = load("results.json")
    names = dict.fromkeys(name.split("/")[2] for name in numbers if name.startswith("step/two_cubes/"))
    rate_of = lambda name: results.rate(steps(numbers, "two_cubes", name, 1) or {"particle_steps_per_second": 0})
    rows = [[f"`{name}`", *rates(numbers, "two_cubes", name)]
            for name in sorted(names, key=rate_of, reverse=True) if name != "apart"]
    one, apart = steps(numbers, "two_cubes", "coloured", 1), steps(numbers, "two_cubes", "apart", 2)
    if one and apart:
        rows.append(["two scenes at once, one a thread", "", number(results.rate(apart)),
                     f"{results.rate(apart) / results.rate(one):.2f}"])
    return rows and table(["two cubes", "1 thread", "2 threads", "2 / 1"], rows)


def corner():
    _, numbers = load("results.json")
    rows = []
    for scene, domain in (("near_corner", "64³"), ("far_corner", "4096³")):
        if of := steps(numbers, scene, "coloured", 1):
            held = of["particles"] * (of["bytes_per_particle"] + of["grid_bytes_per_particle"])
            rows.append([f"`{scene}`", domain, f"{int(of['particles']):,}", *rates(numbers, scene),
                         f"{held / 1e6:.2f} MB", f"{of.get('peak_resident_bytes', 0) / 1e6:.1f} MB"])
    return rows and table(["scene", "cells", "particles", "1 thread", "2 threads", "2 / 1", "particles and grid",
                           "whole process"], rows, 2)


def stages():
    _, numbers = load("results.json")
    names = sorted({name.split("/")[1] for name in numbers if name.startswith("stage/")})
    nanoseconds = lambda name, threads: (of := numbers.get(f"stage/{name}/threads:{threads}")) and number(
        1e9 / of["particles_per_second"])
    return names and table(["stage", "1 thread", "2 threads"],
                           [[f"`{name}`", nanoseconds(name, 1), nanoseconds(name, 2)] for name in names])


def roof():
    context, numbers = load("results.json")
    if not context:
        return None
    operations = float(context["operations_per_particle_step"])
    rows = []
    for threads in (1, 2):
        fma, stream = (numbers.get(f"roof/{name}/threads:{threads}") for name in ("fma", "stream"))
        of = steps(numbers, "two_cubes", "coloured", threads)
        if not (fma and stream and of):
            continue
        allowed = fma["flops_per_second"] / operations / 1e6
        from_memory = stream["bytes_per_second"] / results.bytes_of_a_particle_step / 1e6
        rows.append([threads, number(fma["flops_per_second"] / 1e9), number(allowed),
                     number(stream["bytes_per_second"] / 1e9), number(from_memory), number(results.rate(of)),
                     f"{100 * results.rate(of) / allowed:.0f} %"])
    return rows and f"A particle-step is {operations:,.0f} operations.\n\n" + table(
        ["threads", "multiply-adds, GFLOP/s", "allow, M/s", "memory, GB/s", "allows, M/s", "`two_cubes`, M/s",
         "of the multiply-adds"], rows, 0)


def threads():
    file = results.folder / "threads.json"
    if not file.exists():
        return None
    columns = [(scene, mode) for scene in ("144k", "8k") for mode in ("step", "advance")]
    of = {(row["condition"], row["scene"], row["mode"]): row["rate"] for row in json.loads(file.read_text())}
    conditions = dict.fromkeys(condition for condition, _, _ in of)
    return table(["M particle-steps/s, of all simulations", *(f"{scene}, `{mode}()`" for scene, mode in columns)],
                 [[condition, *(number(of.get((condition, *column))) for column in columns)]
                  for condition in conditions])


def taichi():
    file = results.folder / "taichi.json"
    if not file.exists():
        return None
    of = json.loads(file.read_text())
    rate = of["rates"]
    return table(["threads", f"Taichi {of['version']}", "firn", "firn / Taichi"],
                 [[n, number(rate[f"taichi, {n}"]), number(rate[f"firn, {n}"]),
                   number(rate[f"firn, {n}"] / rate[f"taichi, {n}"])] for n in (1, 2)], 0)


def compile_time():
    file = results.folder / "compile_time.json"
    if not file.exists():
        return None
    of = json.loads(file.read_text())
    seconds = of["seconds"]
    reference = next(iter(seconds.values()))
    return table([of["compiler"], "seconds of CPU time", "times the first"],
                 [[name, f"{time:.2f}", f"{time / reference:.2f}"] for name, time in seconds.items()])


tables = [machine, ratio, sizes, scenes, contact, materials, executions, corner, stages, roof, threads, taichi,
          compile_time, mpi_messages, mpi_model]


def main():
    made = {make.__name__: make() for make in tables}
    made = {name: text for name, text in made.items() if text}
    if sys.argv[1:] != ["--write"]:
        print("\n\n".join(f"{name}\n\n{text}" for name, text in made.items()))
        return
    readme = results.root / "benchmarks/README.md"
    page = readme.read_text()
    for name, text in made.items():
        page, count = re.subn(rf"(<!-- {name} -->\n).*?(<!-- end -->)", lambda match: f"{match[1]}{text}\n{match[2]}",
                              page, flags=re.DOTALL)
        if count != 1:
            raise SystemExit(f"{readme} has {count} places for the table {name}; it needs one.")
    readme.write_text(page)


if __name__ == "__main__":
    main()
