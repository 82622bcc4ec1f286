#!/usr/bin/env python3
"""benchmarks/verification/report.py FOLDER [--report | --update] CASE...: gathers FOLDER/CASE.json of the suite's
programs into FOLDER/results.json and draws their plots: in FOLDER, or with --report beside the report, README.md, which
it writes. --update writes only the sections of these cases anew.
"""
import json
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

here = Path(__file__).resolve().parent
# The order of the report: from what is exact to what is only scaled.
order = ["uniaxial", "rotation", "bar", "disks", "manufactured", "walls", "symmetry", "wall_contact", "cantilever",
         "cook", "cylinder", "footing", "footing_friction", "column", "hydrostatic", "sloshing", "splash", "incline",
         "incline_body", "bounce", "ball_and_block", "rigid_gripper", "floating", "disc_in_tank", "contact_bars",
         "contact_gap", "contact_stack", "deformable_incline", "ring", "contact_hertz", "dam_break", "sand_column",
         "sphere_drop", "snowball", "mohr_coulomb", "cam_clay", "plane_strain", "level_ground", "vertical_cut",
         "soil_slope", "gradients", "wgsl"]
colours = ["#1f5a93", "#d1603d", "#3f8f5b", "#8c6bb1", "#c9a227", "#3aa6a6", "#a3475d", "#777777"]
plt.rcParams.update({"figure.dpi": 110, "font.size": 9, "axes.grid": True, "grid.alpha": 0.25, "axes.axisbelow": True,
                     "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False})

preface = """# Verification

This report compares the results of firn with exact solutions, experiments and other codes. The commands below compute
every figure and draw every plot:

    benchmarks/verification/run.sh            # all cases; writes this report
    benchmarks/verification/run.sh --quick    # a few minutes: fewer and coarser variants, with the same references
    benchmarks/verification/run.sh bar disks  # some cases only

A command fails if the error of a figure is above its tolerance. The error is |value − reference| / max(|reference|,
floor); where the reference is 0, the floor is 1. `build/verification/results.json` has all figures. In the plots,
dashed black lines are references, and black dots are published data.

The report found these weak points. Each case gives the figures:

* Splines at walls whose nodes behind are held (NodesBehind::held): stresses in the two cells next to a wall are off by
  a fifth, whatever the cell size (column, water), and convergence between walls is of first order (manufactured waves).
  Mirrored nodes mend both (waves between walls, half against whole, column). With both, a ball feels the floor one cell
  early; with GapContact it touches it (bouncing ball). Solids that lie askew in the grid have no mirrored nodes. The
  forces that boundaries bear (their reactions) are right.
* MLS forces: an elastic beam that is bent far does not come back. With 2 × 2 particles a cell, 8 % of the deflection
  stays (cantilever). With weight gradients 2 % stays, with weight gradients and the compact quartic kernel 0.5 %.
* Contact through the grid, of bodies of one contact group: two disks lose a fifth of their energy at 20 cells a metre,
  and 2 % at 160; bodies feel each other 2.5 cells apart (blocks that meet). Contact groups mend it (bars, blocks, stack,
  incline, ring, Hertz). What remains: coarse balls are too soft, by 8 % with R = 8 cells, and a block that has not come
  to rest may slip below its angle of friction.
* GapContact at edges of meshes: a grid of distances rounds them off within a spacing, so a block of 16 cells given as a
  mesh, without friction, slides down an incline of 30° with 94 to 100 % of the acceleration, a box with 100 %. A rigid
  block that slides catches with its front at what it sinks in: a box loses 1 % of its acceleration on a hard slab, and 4
  to 6 % on a soft one (rigid block on an incline).
* A disc that water accelerates drags along the water in its layer: with R = 12 cells and half the water's density it
  gains 70 % of the speed of potential flow with the default layer, 86 % with half a cell. With RigidBody::in_flow it
  gains 95 %, where the walls of the tank leave 98 % (disc in a tank). A ball of R = 5 cells that hits sand comes to rest
  at a depth that is a quarter less with the default layer than with half a cell (ball dropped onto sand).
* FLIP and FMPM: their losses depend on the number of steps, not on time. With small steps they lose much more than
  APIC.
* Water without viscosity that is left alone between walls that hold nodes: its pressure scatters by 6 % of the pressure
  at the floor. With weight gradients and cubic splines it scatters more. Mirrored walls and VolumeFilter mend it
  (water at rest, sloshing).
* Water after a splash loses up to half of its depth. VolumeFilter keeps it within 3 % at h = 1/32 m; on finer cells,
  between walls that hold nodes, still water loses 8 %, and with a larger rate of shifting 2 to 4 % (splash).
* Nearly incompressible solids lock and their stresses scatter without FBar (Cook's membrane, cylinder, footing). FLIP
  and AFLIP answer too softly to loads on single particles (Cook's membrane).
* Quasi-static steps: nodes with little matter follow those beside them (SmallNodes), which makes edges stiffer than in
  explicit runs. With the default threshold, Cook's membrane with 32 cells moves by 1.2 % less than if none followed
  (MLS; weight gradients: 2.5 %), a beam with 4 cells by 0.3 %.
* Sand: the deposits of tall columns are too flat. A toe (the tip of a deposit) that is thinner than half a cell is not
  seen.

The report does not cover everything. Most cases are 2D; only balls, the rigid ball and its block, cubes at planes of
symmetry, and sand in a simulation, are 3D. Cam clay is tested under uniaxial strain only. Solids with a given motion are
in no case; `tests/physics/solids.cpp` tests them. WGSL runs only two of the cases, on a GPU in software.

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
        elif curve["kind"] == "particles":
            axes.plot(curve["x"], curve["y"], ".", color=colours[ours % len(colours)], markersize=2.5,
                      label=curve["label"])
            ours += 1
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


def updated(report, cases, sections):
    """The report with some sections in place of those that it has of these cases."""
    parts = report.split("\n## ")
    for name, section_of_case in sections.items():
        at = [i for i, part in enumerate(parts) if part.startswith(cases[name]["title"] + "\n")]
        if len(at) != 1:
            sys.exit(f"The report has no section {cases[name]['title']}; write it as a whole, with --report.")
        parts[at[0]] = section_of_case.removeprefix("## ").rstrip() + "\n"
    return "\n## ".join(parts)


def main(arguments):
    folder, update = Path(arguments[0]), "--update" in arguments
    write = update or "--report" in arguments
    names = [name for name in arguments[1:] if name not in ("--report", "--update")]
    names.sort(key=lambda name: (order.index(name) if name in order else len(order), name))
    cases = {name: json.loads((folder / f"{name}.json").read_text()) for name in names
             if (folder / f"{name}.json").exists()}
    plots = here / "plots" if write else folder
    plots.mkdir(parents=True, exist_ok=True)
    sections = {name: section(name, case, [(plot, draw(name, plot, plots)) for plot in case["plots"]]) + "\n"
                for name, case in cases.items()}
    results = [{"case": name, **check} for name, case in cases.items() for check in case["checks"]]
    (folder / "results.json").write_text(json.dumps(results, indent=1, ensure_ascii=False) + "\n")
    off = sum(check["error"] is None or check["error"] > check["tolerance"] for check in results)
    if write:
        readme = here / "README.md"
        text = updated(readme.read_text(), cases, sections) if update else preface + "".join(sections.values())
        readme.write_text(text.rstrip() + "\n")
        print(readme)
    print(f"{len(results)} figures of {len(cases)} cases, {off} off: {folder / 'results.json'}")
    if len(cases) < len(names):
        sys.exit("No result of: " + ", ".join(name for name in names if name not in cases))


main(sys.argv[1:])
