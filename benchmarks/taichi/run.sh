#!/usr/bin/env bash
# benchmarks/taichi/run.sh [ROUNDS]: firn beside Taichi on the same scene, turn by turn. Installs Taichi in a virtual
# environment under build/ if it is missing, and builds firn's benchmarks.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
# shellcheck source=../python.sh
source "$root/benchmarks/python.sh"
firn_python taichi numpy
steps=50
"$root/benchmarks/run.sh" --build
cmake --build "$root/build/benchmarks-release" --target firn_write_scene
"$root/build/benchmarks-release/benchmarks/firn_write_scene" "$root/build/benchmarks/two_cubes.bin" $steps
"$python" "$root/benchmarks/taichi/compare.py" "$root/build/benchmarks/two_cubes.bin" $steps "$@"
