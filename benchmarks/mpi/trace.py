#!/usr/bin/env python3
"""trace.py TRACE.csv FILE.png: draws what each rank did when in one step of firn_mpi_steps --trace TRACE.csv."""
import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

colours = {
    "find reached nodes": "#9ecae1",
    "clear": "#c6dbef",
    "scatter first half": "#3182bd",
    "scatter second half": "#08519c",
    "send first half": "#e6550d",
    "send second half": "#e6550d",
    "add pieces": "#31a354",
    "send sums back": "#fdae6b",
    "take sums": "#74c476",
}
waits = "#dddddd"
other = "#bcbddc"


def main():
    events = {}
    with open(sys.argv[1], encoding="utf-8") as file:
        for row in csv.DictReader(file):
            events.setdefault(int(row["rank"]), []).append(
                (float(row["begin"]), float(row["end"]), row["phase"], row["waits"] == "1"))
    # A step ends when the ranks join their reports; the last but one of these marks the begin of the last step.
    ends = sorted(end for _, end, phase, _ in events[0] if phase == "join reports")
    begin, end = ends[-2], max(e[1] for all_events in events.values() for e in all_events)
    figure, axes = plt.subplots(figsize=(10, 0.7 * len(events) + 1.4))
    for rank, all_events in sorted(events.items()):
        axes.barh(rank, 1e3 * (end - begin), height=0.7, color=other)
        for first, last, phase, is_wait in all_events:
            if last < begin:
                continue
            axes.barh(rank, 1e3 * (last - first), left=1e3 * (first - begin), height=0.7,
                      color=waits if is_wait else colours.get(phase, other))
    names = [name for name in colours if name != "send second half"]
    handles = [plt.Rectangle((0, 0), 1, 1, color=colours[name]) for name in names]
    handles += [plt.Rectangle((0, 0), 1, 1, color=colour) for colour in (waits, other)]
    labels = ["send" if name == "send first half" else name for name in names] + ["wait", "grid update and G2P"]
    axes.legend(handles, labels, fontsize=7, ncols=6, loc="upper center", bbox_to_anchor=(0.5, -0.35 / len(events) - 0.1))
    axes.set(yticks=sorted(events), ylabel="rank", xlabel="time in one step [ms]", xlim=(0, 1e3 * (end - begin)))
    axes.invert_yaxis()
    figure.savefig(sys.argv[2], dpi=110, bbox_inches="tight")


main()
