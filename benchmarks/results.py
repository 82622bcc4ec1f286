"""What the scripts here share: Google Benchmark's results, medians over repetitions, where files lie."""
import json
import os
import statistics
import subprocess
from pathlib import Path

root = Path(__file__).resolve().parent.parent
folder = root / "build" / "benchmarks"
program = Path(os.environ.get("FIRN_BENCHMARKS", root / "build/benchmarks-release/benchmarks/firn_benchmarks"))
baseline = "step/two_cubes/baseline/threads:1"
scene_a = "step/two_cubes/coloured/threads:{}"
bytes_of_a_particle_step = 2 * 4 * (3 + 3 + 9 + 9 + 6)  # x, v, C, F, τ are read and written once, in float


def load(path):
    """The machine as a dictionary, and {name: {number: median over repetitions}}; times in seconds."""
    document = json.loads(Path(path).read_text())
    units = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0}
    runs = {}
    for run in document["benchmarks"]:
        if run.get("run_type") != "iteration" or run.get("error_occurred"):
            continue
        numbers = runs.setdefault(run["run_name"], {})
        for key, value in run.items():
            if isinstance(value, (int, float)) and not isinstance(value, bool):
                scale = units[run["time_unit"]] if key in ("real_time", "cpu_time") else 1
                numbers.setdefault(key, []).append(value * scale)
    medians = {name: {key: statistics.median(values) for key, values in numbers.items()}
               for name, numbers in runs.items()}
    return document["context"], medians


def run(pattern, file, *options):
    """Runs the benchmarks of a regular expression and loads what they gave."""
    file.parent.mkdir(parents=True, exist_ok=True)
    command = [program, f"--benchmark_filter={pattern}", f"--benchmark_out={file}", "--benchmark_out_format=json"]
    subprocess.run([*map(str, command), *options], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return load(file)


def machine(context):
    """One line: which processor, how many of them, which compiler."""
    return (f"{context.get('processor', 'unknown processor')}, {context.get('processors', context['num_cpus'])} "
            f"processors, {context.get('vectors', 'unknown vectors')}, {context.get('compiler', 'unknown compiler')}")


def rate(numbers):
    """Millions of particle-steps a second."""
    return numbers["particle_steps_per_second"] / 1e6
