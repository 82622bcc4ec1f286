#!/usr/bin/env bash
# examples/run.sh [--all] [OPTION...]: installs missing packages, builds build/examples/03_two_bunnies and runs it with
# the options (--help lists them). It writes states and a picture to out/, or to the folder of --output. --all builds
# all examples.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=../cmake/packages.sh
source "$root/cmake/packages.sh"

firn_install compiler cmake ninja eigen hdf5 cli11 png boost

build=$root/build target=03_two_bunnies
if [[ ${1-} == --all ]]; then
    target=firn_examples
    shift
fi
options=(-DCMAKE_BUILD_TYPE=Release -DFIRN_BUILD_EXAMPLES=ON -DFIRN_NATIVE=ON -DFIRN_WARNINGS_AS_ERRORS=OFF)
if [[ ! -e $build/CMakeCache.txt ]]; then options+=(-DFIRN_BUILD_TESTS=OFF); fi
cmake -S "$root" -B "$build" "${options[@]}"
cmake --build "$build" --parallel "$(firn_jobs)" --target "$target"

output=(--output "$root/out")
for argument in "$@"; do
    if [[ $argument == --output || $argument == --output=* ]]; then output=(); fi
done
exec "$build/examples/03_two_bunnies" ${output[@]+"${output[@]}"} "$@"
