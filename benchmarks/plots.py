#!/usr/bin/env python3
"""benchmarks/plots.py [RESULTS.json [FOLDER]]: draws benchmarks/plots/*.png; benchmarks/plot.sh starts it. A picture
whose benchmarks were not run is left as it is.

Roofs: roof/fma over the operations of a particle-step (counted by running the stages with a counting scalar), and
roof/stream over the bytes that it must read and write.
"""
import math
import re
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import mpi.model
import results

colours = ["#1f5a93", "#d1603d", "#3f8f5b", "#8c6bb1", "#777777"]
plt.rcParams.update({"figure.dpi": 110, "font.size": 9, "axes.grid": True, "grid.alpha": 0.25, "axes.axisbelow": True,
                     "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False})


class Measured:
    def __init__(self, file):
        self.context, self.numbers = results.load(file)
        self.operations = float(self.context["operations_per_particle_step"])

    def steps(self, pattern):
        """{threads: numbers} of step/PATTERN/threads:N."""
        prefix = f"step/{pattern}/threads:"
        return {int(name.removeprefix(prefix)): of for name, of in sorted(self.numbers.items())
                if name.startswith(prefix)}

    def sizes(self, threads):
        """(particles, seconds a step) of the two cubes by size, rising."""
        found = [(of["particles"], of["particles"] / of["particle_steps_per_second"])
                 for name, of in self.numbers.items()
                 if re.fullmatch(rf"step/two_cubes(_\d+[km]?)?/coloured/threads:{threads}", name)]
        return sorted(found)

    def stiffnesses(self, integration):
        """(Young's modulus, seconds of CPU time for a second of motion) of the stiff jelly, rising."""
        found = [(of["young"], of["cpu_seconds_per_second"]) for name, of in self.numbers.items()
                 if re.fullmatch(rf"motion/stiff_jelly_[^/]+/{integration}/threads:1", name)]
        return sorted(found)

    def arithmetic_roof(self, threads):
        """Particle-steps a second that the multiply-adds allow."""
        of = self.numbers.get(f"roof/fma/threads:{threads}")
        return of and of["flops_per_second"] / self.operations

    def memory_roof(self, threads):
        of = self.numbers.get(f"roof/stream/threads:{threads}")
        return of and of["bytes_per_second"] / results.bytes_of_a_particle_step


def finish(figure, file, measured):
    figure.text(0.995, 0.005, results.machine(measured.context), ha="right", va="bottom", fontsize=6.5, color="#666666")
    figure.tight_layout(rect=(0, 0.02, 1, 1))
    figure.savefig(file)
    plt.close(figure)
    print(file)


def particles(measured, file):
    figure, (time, rate) = plt.subplots(1, 2, figsize=(9, 3.8))
    for colour, threads in zip(colours, (1, 2)):
        sizes = measured.sizes(threads)
        if not sizes:
            continue
        counts = [count for count, _ in sizes]
        label = f"{threads} thread" + "s" * (threads > 1)
        time.plot(counts, [1e3 * seconds for _, seconds in sizes], "o-", ms=4, color=colour, label=label)
        rate.plot(counts, [count / seconds / 1e6 for count, seconds in sizes], "o-", ms=4, color=colour, label=label)
        for roof, style, what in ((measured.arithmetic_roof(threads), "--", "multiply-adds"),
                                  (measured.memory_roof(threads), ":", "memory, from RAM")):
            if roof:
                time.plot(counts, [1e3 * count / roof for count in counts], style, lw=1, color=colour)
                rate.axhline(roof / 1e6, ls=style, lw=1, color=colour, label=f"roof, {what}, {label}")
    if results.baseline in measured.numbers:
        base = measured.numbers[results.baseline]
        time.plot(base["particles"], 1e3 * base["particles"] / base["particle_steps_per_second"], "s", ms=5,
                  color="black", label="Eigen, straightforward")
        rate.plot(base["particles"], results.rate(base), "s", ms=5, color="black", label="Eigen, straightforward")
    time.set(xscale="log", yscale="log", xlabel="particles", ylabel="time of a step [ms]", title="Two cubes")
    rate.set(xscale="log", ylim=(0, None), xlabel="particles", ylabel="million particle-steps a second")
    rate.legend(fontsize=6.5, loc="center left", bbox_to_anchor=(1, 0.5))
    finish(figure, file, measured)


def threads(measured, file):
    figure, axes = plt.subplots(figsize=(6.4, 3.6))
    found = dict(sorted(measured.steps("two_cubes/coloured").items()))
    counts = list(found)
    times = [1e3 * of["particles"] / of["particle_steps_per_second"] for of in found.values()]
    axes.plot(counts, times, "o-", color=colours[0], label="firn, coloured")
    axes.plot(counts, [times[0] / count * counts[0] for count in counts], "-", lw=0.8, color=colours[4],
              label="one thread's time, divided")
    roofs = {count: measured.arithmetic_roof(count) for count in counts}
    if all(roofs.values()):
        axes.plot(counts, [1e3 * found[count]["particles"] / roofs[count] for count in counts], "--", lw=1,
                  color=colours[1], label="roof, multiply-adds")
    for name, style, label in (("serial", "D", "firn, serial"), ("baseline", "s", "Eigen, straightforward")):
        for count, of in measured.steps(f"two_cubes/{name}").items():
            milliseconds = 1e3 * of["particles"] / of["particle_steps_per_second"]
            axes.plot(count, milliseconds, style, ms=5, color="black" if name == "baseline" else colours[2],
                      label=label)
    axes.set(yscale="log", xlabel="threads", ylabel="time of a step [ms]", title="Two cubes, 144,054 particles",
             xticks=counts)
    axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1, 0.5))
    finish(figure, file, measured)


def scenes(measured, file):
    names = list(dict.fromkeys(name.split("/")[1] for name in measured.numbers
                               if name.startswith("step/") and "/coloured/" in name))
    names = [name for name in names if measured.steps(f"{name}/coloured").keys() >= {1, 2}]
    names.sort(key=lambda name: results.rate(measured.steps(f"{name}/coloured")[1]))
    figure, axes = plt.subplots(figsize=(6.4, 0.24 * len(names) + 1.2))
    for place, name in enumerate(names):
        of = measured.steps(f"{name}/coloured")
        for shift, count in ((0.2, 1), (-0.2, 2)):
            axes.barh(place + shift, results.rate(of[count]), 0.38, color=colours[count - 1],
                      label=f"{count} thread" + "s" * (count > 1) if place == 0 else None)
    for count in (1, 2):
        if roof := measured.arithmetic_roof(count):
            axes.axvline(roof / 1e6, ls="--", lw=1, color=colours[count - 1],
                         label=f"roof of 3D, float: multiply-adds, {count}")
    axes.set(yticks=range(len(names)), yticklabels=names, xlabel="million particle-steps a second")
    axes.grid(axis="y", visible=False)
    axes.legend(fontsize=7, loc="lower right")
    finish(figure, file, measured)


def crossing(first, second):
    """(x, y) where two curves over the same x first cross; None where they do not. Both are straight between points in
    logarithms."""
    points = [(math.log(x), math.log(a), math.log(b)) for (x, a), (_, b) in zip(first, second)]
    for (x, a, b), (x_next, a_next, b_next) in zip(points, points[1:]):
        if (a - b) * (a_next - b_next) < 0:
            part = (a - b) / ((a - b) - (a_next - b_next))
            return math.exp(x + part * (x_next - x)), math.exp(a + part * (a_next - a))
    return None


def stiffness(measured, file):
    curves = {name: measured.stiffnesses(name) for name in ("explicit", "implicit")}
    figure, axes = plt.subplots(figsize=(6.4, 3.8))
    for colour, style, (name, curve), label in zip(colours, ("s-", "o-"), curves.items(),
                                                   ("explicit steps", "implicit steps, half a cell each")):
        axes.plot(*zip(*curve), style, ms=4, color=colour, label=label)
    if place := crossing(*curves.values()):
        axes.plot(*place, "x", ms=9, mew=2, color="black", zorder=3)
        axes.axvline(place[0], ls=":", lw=1, color="black")
        exponent = math.floor(math.log10(place[0]))
        axes.annotate(rf"$E = {place[0] / 10 ** exponent:.1f} \times 10^{{{exponent}}}$ Pa", place, (8, -24),
                      textcoords="offset points")
    axes.set(xscale="log", yscale="log", xlabel="Young's modulus [Pa]",
             ylabel="CPU time of a second of motion [s]", title="A jelly of 1,600 particles falls onto a floor")
    axes.legend(fontsize=8)
    finish(figure, file, measured)


def main():
    folder = Path(sys.argv[2]) if len(sys.argv) > 2 else results.root / "benchmarks/plots"
    folder.mkdir(parents=True, exist_ok=True)
    mpi.model.draw(plt, colours, folder / "ranks.png")
    measured = Measured(sys.argv[1] if len(sys.argv) > 1 else results.folder / "results.json")
    if measured.steps("two_cubes/coloured"):
        particles(measured, folder / "particles.png")
        threads(measured, folder / "threads.png")
        scenes(measured, folder / "scenes.png")
    if measured.stiffnesses("explicit") and measured.stiffnesses("implicit"):
        stiffness(measured, folder / "stiffness.png")


if __name__ == "__main__":
    main()
