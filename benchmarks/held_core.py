#!/usr/bin/env python3
"""benchmarks/held_core.py [ROUNDS]: the steps of 144,054 and of 8,000 particles on one and two threads while another
program holds one of two processors, and, between, while none does; medians of 5 rounds unless told otherwise, kept in
build/benchmarks/held_core.json. Linux; needs firn_benchmarks (benchmarks/run.sh builds it).
"""
import json
import os
import statistics
import subprocess
import sys

import results

pattern = "^step/two_cubes(_8k)?/coloured/threads:[12]$"


def measure(rounds):
    held_processor, other = sorted(os.sched_getaffinity(0))[:2]
    os.sched_setaffinity(0, {held_processor, other})  # what is started from here inherits it
    rates = {}
    for _ in range(rounds):
        for held in (False, True):
            holder = None
            if held:
                holder = subprocess.Popen([sys.executable, "-c", "while True: pass"])
                os.sched_setaffinity(holder.pid, {held_processor})
            try:
                _, numbers = results.run(pattern, results.folder / "held_core_round.json")
            finally:
                if holder:
                    holder.kill()
                    holder.wait()
            for name, of in numbers.items():
                rates.setdefault(name, {}).setdefault("held" if held else "free", []).append(results.rate(of))
    return {name: {key: statistics.median(values) for key, values in of.items()} for name, of in rates.items()}


def main():
    rates = measure(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
    (results.folder / "held_core.json").write_text(json.dumps(rates, indent=1))
    print(f"{'M particle-steps/s':<40} {'free':>8} {'held':>8} {'held / one thread free':>24}")
    for name, of in rates.items():
        alone = rates[name.replace("threads:2", "threads:1")]["free"]
        print(f"{name:<40} {of['free']:>8.2f} {of['held']:>8.2f} {of['held'] / alone:>24.2f}")


if __name__ == "__main__":
    main()
