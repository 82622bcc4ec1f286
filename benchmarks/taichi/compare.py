#!/usr/bin/env python3
"""compare.py SCENE STEPS [ROUNDS]: the two cubes in Taichi and in firn, turn by turn, on one and on two threads; prints
medians and ratios and keeps them in build/benchmarks/taichi.json. benchmarks/taichi/run.sh prepares and starts it.
"""
import json
import statistics
import subprocess
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parent.parent))
import results

threads = (1, 2)
particles = 144_054
largest_error = 1e-5  # [m]: float rounding after 50 steps; a wrong force or transfer is off by some 1e-3


def start(scene, steps, count):
    return subprocess.Popen([sys.executable, str(Path(__file__).with_name("mls_mpm.py")), scene, steps, str(count)],
                            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def answer(taichi, steps=None):
    """Taichi greets in lines of its own on the way to the number."""
    if steps:
        taichi.stdin.write(f"{steps}\n")
        taichi.stdin.flush()
    for line in taichi.stdout:
        try:
            return float(line)
        except ValueError:
            pass
    raise SystemExit("Taichi's program ended before it answered.")


def measure(scene, steps, rounds):
    taichi = {count: start(scene, steps, count) for count in threads}
    for program in taichi.values():
        error = answer(program)
        print(f"Taichi and firn: positions differ by up to {error:.1e} m after {steps} steps")
        if not error < largest_error:
            raise SystemExit("That is not the same scene.")
    rates = {f"{who}, {count}": [] for count in threads for who in ("taichi", "firn")}
    for _ in range(rounds):
        for count in threads:
            rates[f"taichi, {count}"].append(particles * 8 / answer(taichi[count], 8) / 1e6)
            name = results.scene_a.format(count)
            _, numbers = results.run(f"^{name}$", results.folder / "taichi_round.json")
            rates[f"firn, {count}"].append(results.rate(numbers[name]))
    for program in taichi.values():
        program.stdin.close()
        program.wait()
    return {key: statistics.median(values) for key, values in rates.items()}


def main():
    import taichi  # only its version is asked for here

    rates = measure(sys.argv[1], sys.argv[2], int(sys.argv[3]) if len(sys.argv) > 3 else 7)
    version = ".".join(map(str, taichi.__version__))
    (results.folder / "taichi.json").write_text(json.dumps({"version": version, "rates": rates}, indent=1))
    print(f"{'M particle-steps/s':<20} {'Taichi ' + version:>14} {'firn':>8} {'ratio':>8}")
    for count in threads:
        a, b = rates[f"taichi, {count}"], rates[f"firn, {count}"]
        print(f"{f'{count} thread(s)':<20} {a:>14.2f} {b:>8.2f} {b / a:>8.1f}")


if __name__ == "__main__":
    main()
