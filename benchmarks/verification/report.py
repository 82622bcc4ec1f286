#!/usr/bin/env python3
"""benchmarks/verification/report.py FOLDER [--report] CASE...: gathers FOLDER/CASE.json of the suite's programs into
FOLDER/results.json and draws their plots: in FOLDER, or with --report beside the report, README.md, which it writes.
"""
import json
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

here = Path(__file__).resolve().parent
# The order of the report: from what is exact to what is only scaled.
order = ["uniaxial", "rotation", "bar", "disks", "manufactured", "cantilever", "column", "hydrostatic", "incline",
         "bounce", "dam_break", "sand_column", "snowball", "wgsl"]
colours = ["#1f5a93", "#d1603d", "#3f8f5b", "#8c6bb1", "#c9a227", "#3aa6a6", "#a3475d", "#777777"]
plt.rcParams.update({"figure.dpi": 110, "font.size": 9, "axes.grid": True, "grid.alpha": 0.25, "axes.axisbelow": True,
                     "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False})

preface = """# Verification

What firn computes, over what it should: every figure and plot here is drawn by

    benchmarks/verification/run.sh            # this report, anew
    benchmarks/verification/run.sh --quick    # a few minutes: fewer, coarser variants, held to the same references
    benchmarks/verification/run.sh bar disks  # some cases

It fails if a figure is farther from its reference than its tolerance. `build/verification/results.json` has all figures;
the error is |value − reference| / max(|reference|, floor). Dashed black lines are references, dots published data.

What it found that is poor, each told with figures in its case:

* Splines at walls: the nodes behind a wall are held like those on it, not mirrored. Stresses in the two cells next to it
  are off by a fifth, whatever the cell size (column, water), convergence between slipping walls is of first order
  (manufactured waves), and a floor is felt a cell early (ball). What boundaries bear, their reactions, is right.
* MLS forces let an elastic beam creep when bent far: 8 % of the deflection stays with 2 × 2 particles a cell
  (cantilever). Weight gradients leave 2 %, but hold water at rest less well.
* Contact through the grid takes a fifth of the energy of two disks at 20 cells a metre, 2 % at 160.
* FLIP's and FMPM's loss is by the step, not by time: with small steps much more than APIC's.
* Water without viscosity that is left alone scatters in pressure by 6 % of that at the floor, and more with weight
  gradients and cubic splines. Deposits of tall columns of sand are too flat; a toe below half a cell is not seen.

What it does not cover: most of it is 2D (the ball is 3D, and sand in a simulation); von Mises' material and Cam clay
are tried under uniaxial strain only; moving solids and rigid bodies are left to `tests/physics/solids.cpp`; WGSL runs two
of the cases, on a GPU in software.

"""


def number(value):
    if value is None:
        return "not finite"
    return f"{value:.4g}"


def draw(case, plot, folder):
    file = folder / f"{case}_{plot['name']}.png"
    figure, axes = plt.subplots(figsize=(6.4, 3.6))
    ours = 0
    for curve in plot["curves"]:
        if curve["kind"] == "reference":
            axes.plot(curve["x"], curve["y"], "k--", linewidth=1.1, label=curve["label"], zorder=5)
        elif curve["kind"] == "published":
            axes.plot(curve["x"], curve["y"], "o", color="black", markersize=3.2, label=curve["label"], zorder=6)
        else:
            marker = "o-" if len(curve["x"]) < 12 else "-"
            axes.plot(curve["x"], curve["y"], marker, color=colours[ours % len(colours)], linewidth=1.3, markersize=3.5,
                      label=curve["label"])
            ours += 1
    if plot["logarithmic"]:
        axes.set_xscale("log")
        axes.set_yscale("log")
    axes.set(title=plot["title"], xlabel=plot["x_label"], ylabel=plot["y_label"])
    axes.legend(fontsize=7.5)
    figure.tight_layout()
    figure.savefig(file)
    plt.close(figure)
    return file


def section(name, case, pictures):
    lines = [f"## {case['title']}", "", case["about"], ""]
    lines += [f"![{plot['title']}](plots/{file.name})" for plot, file in pictures] + [""]
    lines += ["| | ours | reference | error | tolerance | the reference's and tolerance's source |",
              "|---|---:|---:|---:|---:|---|"]
    for check in case["checks"]:
        lines.append(f"| {check['quantity']} | {number(check['value'])} | {number(check['reference'])} | "
                     f"{number(check['error'])} | {number(check['tolerance'])} | {check['source']} |")
    lines += [""] + [part for remark in case["remarks"] for part in (remark, "")]
    return "\n".join(lines)


def main(arguments):
    folder, write = Path(arguments[0]), "--report" in arguments
    names = [name for name in arguments[1:] if name != "--report"]
    names.sort(key=lambda name: (order.index(name) if name in order else len(order), name))
    cases = {name: json.loads((folder / f"{name}.json").read_text()) for name in names
             if (folder / f"{name}.json").exists()}
    plots = here / "plots" if write else folder
    plots.mkdir(parents=True, exist_ok=True)
    text = preface
    for name, case in cases.items():
        pictures = [(plot, draw(name, plot, plots)) for plot in case["plots"]]
        text += section(name, case, pictures) + "\n"
    results = [{"case": name, **check} for name, case in cases.items() for check in case["checks"]]
    (folder / "results.json").write_text(json.dumps(results, indent=1, ensure_ascii=False) + "\n")
    off = sum(check["error"] is None or check["error"] > check["tolerance"] for check in results)
    if write:
        (here / "README.md").write_text(text.rstrip() + "\n")
        print(here / "README.md")
    print(f"{len(results)} figures of {len(cases)} cases, {off} off: {folder / 'results.json'}")
    if len(cases) < len(names):
        sys.exit("No result of: " + ", ".join(name for name in names if name not in cases))


main(sys.argv[1:])
