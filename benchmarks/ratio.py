#!/usr/bin/env python3
"""benchmarks/ratio.py [REPETITIONS]: the two cubes in firn and in the straightforward Eigen code, in one run, in random
order, 9 times each unless told otherwise; prints the ratios of the medians and keeps them in
build/benchmarks/ratio.json. benchmarks/run.sh --ratio builds first.
"""
import sys

import results


def rows(numbers):
    """(name, rate, ratio to the baseline, the same by CPU time for one thread), slowest first."""
    base = numbers[results.baseline]
    for name, of in sorted(numbers.items(), key=lambda item: results.rate(item[1])):
        # What others took from this processor is no part of the CPU time.
        by_cpu = of["particle_steps_per_cpu_second"] / base["particle_steps_per_cpu_second"]
        yield (name.removeprefix("step/"), results.rate(of), results.rate(of) / results.rate(base),
               by_cpu if name.endswith("threads:1") else None)


def main():
    repetitions = int(sys.argv[1]) if len(sys.argv) > 1 else 9
    context, numbers = results.run(
        "^step/two_cubes(_portable)?/(baseline|serial|coloured|coloured_fixed_point)/", results.folder / "ratio.json",
        f"--benchmark_repetitions={repetitions}", "--benchmark_enable_random_interleaving=true")
    print(results.machine(context))
    print(f"{'':<42} {'M/s':>8} {'ratio':>8} {'by CPU time':>12}")
    for name, rate, ratio, cpu in rows(numbers):
        print(f"{name:<42} {rate:>8.2f} {ratio:>8.2f} {'' if cpu is None else f'{cpu:.2f}':>12}")


if __name__ == "__main__":
    main()
