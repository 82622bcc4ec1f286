#!/usr/bin/env python3
"""benchmarks/threads.py [--rounds N] [--vs PROGRAM]: the two cubes on two threads, in 144,054 and in 8,000 particles: free;
bound by OpenMP's settings; while another program holds one of two processors; and two simulations at once. Medians of
5 rounds unless told otherwise, kept in build/benchmarks/threads.json. --vs takes turns with another build of the same
program and prints the ratio. Linux; needs firn_threads_steps (benchmarks/run.sh --build).
"""
import argparse
import json
import os
import statistics
import subprocess
import sys

import results

program = results.root / "build/benchmarks-release/benchmarks/firn_threads_steps"
# name: threads of a simulation, simulations, settings of OpenMP, the processor that another program holds
conditions = {
    "1 thread": (1, 1, {}, None),
    "2 threads": (2, 1, {}, None),
    "2 threads, OMP_PROC_BIND=true": (2, 1, {"OMP_PROC_BIND": "true"}, None),
    "2 threads, OMP_PROC_BIND=spread": (2, 1, {"OMP_PROC_BIND": "spread"}, None),
    "2 threads, processor 0 held": (2, 1, {}, 0),
    "2 threads, processor 1 held": (2, 1, {}, 1),
    "2 simulations, 1 thread each": (1, 2, {}, None),
    "2 simulations, 2 threads each": (2, 2, {}, None),
}


def rates(executable, scene, mode, condition, seconds):
    threads, hosts, settings, held = condition
    processors = sorted(os.sched_getaffinity(0))[:2]
    environment = {k: v for k, v in os.environ.items() if not k.startswith("OMP_")} | settings
    holder = None
    if held is not None:
        holder = subprocess.Popen([sys.executable, "-c", "while True: pass"])
        os.sched_setaffinity(holder.pid, {processors[held]})
    try:
        command = [executable, scene, threads, hosts, seconds, mode]
        text = subprocess.run([str(part) for part in command], env=environment, check=True, capture_output=True,
                              text=True, preexec_fn=lambda: os.sched_setaffinity(0, processors)).stdout
    finally:
        if holder:
            holder.kill()
            holder.wait()
    return [float(line) for line in text.split()]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=1.5)
    parser.add_argument("--vs")
    parser.add_argument("--only", default="", help="conditions with this in their names")
    given = parser.parse_args()
    programs = {"this": program} | ({"other": given.vs} if given.vs else {})
    found = {}
    for turn in range(given.rounds):
        for scene in ("144k", "8k"):
            for mode in ("step", "advance"):
                for name, condition in conditions.items():
                    if given.only not in name:
                        continue
                    for which in sorted(programs, reverse=turn % 2 == 1):
                        of = rates(programs[which], scene, mode, condition, given.seconds)
                        found.setdefault((scene, mode, name), {}).setdefault(which, []).append(of)
    rows = []
    for (scene, mode, name), by_program in found.items():
        row = {"scene": scene, "mode": mode, "condition": name,
               "rate": statistics.median(map(sum, by_program["this"])),
               "least": statistics.median(map(min, by_program["this"]))}
        if given.vs:
            row["ratio"] = statistics.median(
                sum(a) / sum(b) for a, b in zip(by_program["this"], by_program["other"]))
        rows.append(row)
        print(f"{scene:<5} {mode:<8} {name:<34} {row['rate']:>8.2f} {row.get('ratio', 0) or '':>8.4}", flush=True)
    results.folder.mkdir(parents=True, exist_ok=True)
    (results.folder / "threads.json").write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
