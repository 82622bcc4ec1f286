#!/usr/bin/env python3
"""benchmarks/compile_time/run.py [FOLDER]: how long programs take to compile, as multiples of one that includes
<Eigen/SVD> and makes one JacobiSVD<Matrix3f>, compiled with -O3 -march=native: one that runs a simulation, one that
also writes and reads states, and one with states and a material of its own, header-only and with firn::compiled, and
one that leaves the simulation to another of its files. Medians of 5 by turns, in seconds of CPU time (user and system), kept in
build/benchmarks/compile_time.json. CXX names the compiler, FOLDER firn's headers, REPETITIONS another number than 5.
"""
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parent.parent))
import results

compiler = os.environ.get("CXX", "g++")
include = sys.argv[1] if len(sys.argv) > 1 else str(results.root / "include")
# As the README says for builds without CMake.
flags = ["-std=c++20", "-pthread", "-fopenmp", "-fopenmp-simd", "-fno-math-errno", "-Wno-psabi", "-I", include,
         "-I", str(results.root / "examples"),
         "-isystem", "/usr/include/eigen3"]
hdf5 = subprocess.run(["pkg-config", "--cflags", "hdf5"], capture_output=True, text=True).stdout.split()
folder = Path(__file__).parent
one = (folder / "one_simulation.cpp").read_text()
elsewhere = one.replace("int main", "extern template class firn::Simulation<3>;\nint main")
states = (folder / "with_states.cpp").read_text()
own = (folder / "own_material.cpp").read_text()
fast, slow, library = ["-O3", "-march=native"], ["-O0"], ["-DFIRN_COMPILED", "-DFIRN_COMPILED_HDF5"]
reference = "one JacobiSVD<Matrix3f>, -O3"
programs = {
    reference: ((folder / "jacobi_svd.cpp").read_text(), fast),
    "one simulation, -O3": (one, fast),
    "with states, -O3": (states, fast + hdf5),
    "one simulation, firn::compiled, -O3": (one, fast + library),
    "with states, firn::compiled, -O3": (states, fast + library + hdf5),
    "own material with states, -O3": (own, fast + hdf5),
    "own material with states, firn::compiled, -O3": (own, fast + library + hdf5),
    "one simulation, extern template, -O3": (elsewhere, fast),
    "one simulation, -O0": (one, slow),
    "with states, -O0": (states, slow + hdf5),
    "one simulation, extern template, -O0": (elsewhere, slow),
}
if "g++" in compiler and "clang" not in compiler:
    version = subprocess.run([compiler, "-dumpversion"], capture_output=True, text=True, check=True).stdout
    if int(version.split(".")[0]) < 13:
        flags.append("-fno-tree-slp-vectorize")


def seconds(source, options):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([compiler, *flags, *options, "-c", source, "-o", source + ".o"], check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    runs = {name: [] for name in programs}
    with tempfile.TemporaryDirectory() as temporary:
        for _ in range(int(os.environ.get("REPETITIONS", "5"))):
            for name, (text, options) in programs.items():
                source = Path(temporary) / "program.cpp"
                source.write_text(text)
                runs[name].append(seconds(str(source), options))
    measured = {name: statistics.median(times) for name, times in runs.items()}
    for name, time in measured.items():
        print(f"{name:<48} {time:6.2f} s {time / measured[reference]:6.2f}")
    results.folder.mkdir(parents=True, exist_ok=True)
    (results.folder / "compile_time.json").write_text(json.dumps({"compiler": compiler, "seconds": measured}, indent=1))


if __name__ == "__main__":
    main()
