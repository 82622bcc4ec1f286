#!/usr/bin/env bash
# benchmarks/wasm/run.sh: times a step of three scenes in WebAssembly (node), against the same source compiled natively
# by the same clang, for x86-64 with SSE2 and without FMA. Each with one thread, and with two.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd) root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
# shellcheck source=../../cmake/packages.sh
source "$root/cmake/packages.sh"
firn_install_if_offered node clang_openmp "${firn_wasm_needs[@]}"

build=$root/build/wasm
"$root/examples/web/wasm/build.sh" "$here/steps.cpp" "$build"
clang++-19 -std=c++20 -O3 -ffp-contract=off -fno-math-errno -fopenmp "-I$root/include" "-I$root/examples/web/wasm" \
    "$here/steps.cpp" -o "$build/steps"
export OMP_WAIT_POLICY=passive
printf '%-8s %7s %12s %12s %6s\n' scene threads 'native [ms]' 'wasm [ms]' ratio
for threads in 1 2; do
    "$build/steps" "$threads" >"$build/native.txt"
    node "$here/steps.mjs" "$build/steps" "$threads" >"$build/wasm.txt"
    paste -d ' ' "$build/native.txt" "$build/wasm.txt" |
        awk -v threads="$threads" '{ printf "%-8s %7d %12.2f %12.2f %6.2f\n", $1, threads, $2, $4, $4 / $2 }'
done
