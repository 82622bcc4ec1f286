#!/usr/bin/env python3
"""benchmarks/compile_time/run.py [FOLDER]: how long a program takes to compile that includes firn.hpp and runs one
simulation, beside one that includes it and runs none, and one that leaves the simulation to another of its files; with
-O0 and -O3 -march=native; medians of 3, in seconds of CPU and of wall time, kept in build/benchmarks/compile_time.json.
CXX names the compiler, FOLDER firn's headers.
"""
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parent.parent))
import results

compiler = os.environ.get("CXX", "g++")
include = sys.argv[1] if len(sys.argv) > 1 else str(results.root / "include")
# As the README says for builds without CMake.
flags = ["-std=c++20", "-fopenmp", "-fopenmp-simd", "-fno-math-errno", "-Wno-psabi", "-I", include, "-isystem",
         "/usr/include/eigen3"]
one_simulation = Path(__file__).with_name("one_simulation.cpp").read_text()
programs = {
    "includes firn.hpp": "#include <firn/firn.hpp>\nint main() {}\n",
    "runs one simulation": one_simulation,
    "runs one, compiled elsewhere": one_simulation.replace(
        "int main", "extern template class firn::Simulation<3>;\nint main"),
}
if "g++" in compiler and "clang" not in compiler:
    version = subprocess.run([compiler, "-dumpversion"], capture_output=True, text=True, check=True).stdout
    if int(version.split(".")[0]) < 13:
        flags.append("-fno-tree-slp-vectorize")
optimisations = {"-O0": ["-O0"], "-O3": ["-O3", "-march=native"]}


def seconds(source, options, output):
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run([compiler, *flags, *options, "-c", source, "-o", output], check=True)
    wall, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall


def main():
    measured = {}
    with tempfile.TemporaryDirectory() as folder:
        for program, text in programs.items():
            source = Path(folder) / "program.cpp"
            source.write_text(text)
            for name, options in optimisations.items():
                runs = [seconds(str(source), options, str(source.with_suffix(".o"))) for _ in range(3)]
                cpu, wall = (statistics.median(column) for column in zip(*runs))
                measured[f"{program}, {name}"] = {"cpu": cpu, "wall": wall}
                print(f"{program + ', ' + name:<35} {cpu:6.2f} s of CPU time {wall:6.2f} s")
    results.folder.mkdir(parents=True, exist_ok=True)
    (results.folder / "compile_time.json").write_text(json.dumps({"compiler": compiler, "seconds": measured}, indent=1))


if __name__ == "__main__":
    main()
