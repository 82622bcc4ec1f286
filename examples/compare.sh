#!/usr/bin/env bash
# examples/compare.sh [OPTION...]: what Poisson's ratio ν and Young's modulus E do. Installs missing packages, builds two
# examples and runs each with two values, for equal times: 02_two_cubes with ν = 0.3 and 0.15, 03_two_bunnies with
# E = 1000 and 2000 Pa. It prints a table of each, and writes states and the pictures two_cubes_compared.png and
# two_bunnies_compared.png to out/, or to the folder of --output. Both programs get the options: --force weight_gradient,
# --particles 20000, …
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=../cmake/packages.sh
source "$root/cmake/packages.sh"

firn_install compiler cmake ninja eigen hdf5 cli11 png boost

build=$root/build
options=(-DCMAKE_BUILD_TYPE=Release -DFIRN_BUILD_EXAMPLES=ON -DFIRN_NATIVE=ON -DFIRN_WARNINGS_AS_ERRORS=OFF)
if [[ ! -e $build/CMakeCache.txt ]]; then options+=(-DFIRN_BUILD_TESTS=OFF); fi
cmake -S "$root" -B "$build" "${options[@]}"
cmake --build "$build" --parallel "$(firn_jobs)" --target 02_two_cubes 03_two_bunnies

output=(--output "$root/out")
for argument in "$@"; do
    if [[ $argument == --output || $argument == --output=* ]]; then output=(); fi
done
"$build/examples/02_two_cubes" --other-poisson 0.15 --time 0.4 ${output[@]+"${output[@]}"} "$@"
"$build/examples/03_two_bunnies" --other-young 2000 --time 0.2 ${output[@]+"${output[@]}"} "$@"
