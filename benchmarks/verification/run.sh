#!/usr/bin/env bash
# benchmarks/verification/run.sh [--quick] [CASE...]: installs what is missing, builds the verification suite, runs its
# cases (all unless some are named) and writes build/verification/results.json. A whole run writes the report,
# benchmarks/verification/README.md, and its plots too; --quick takes fewer and coarser variants, and leaves the report.
# Fails if a figure is farther from its reference than the suite's tolerance.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
# shellcheck source=../../cmake/packages.sh
source "$root/cmake/packages.sh"
# shellcheck source=../../cmake/webgpu.sh
source "$root/cmake/webgpu.sh"
# shellcheck source=../python.sh
source "$root/benchmarks/python.sh"

quick=() cases=()
for argument in "$@"; do
    case $argument in
        --quick) quick=(--quick) ;;
        -h | --help) sed -n '2,5s/^# //p' "${BASH_SOURCE[0]}" && exit ;;
        -*) echo "benchmarks/verification/run.sh does not know $argument; it knows --quick." >&2 && exit 2 ;;
        *) cases+=("$argument") ;;
    esac
done

firn_install compiler cmake ninja eigen
firn_python matplotlib

build=$root/build/verification-release out=$root/build/verification
all=() webgpu=() gpu=no
if firn_webgpu_c && firn_webgpu; then
    gpu=yes
    webgpu=("-DFIRN_WEBGPU_HEADER_DIR=$FIRN_WEBGPU_HEADER_DIR" "-DFIRN_WEBGPU_LIBRARY=$FIRN_WEBGPU_LIBRARY")
else
    printf '\n== skipped: wgsl, which needs the packages above\n'
fi
for file in "$root"/benchmarks/verification/cases/*.cpp; do
    name=$(basename "$file" .cpp)
    if [[ $name != wgsl || $gpu == yes ]]; then all+=("$name"); fi
done
if ((${#cases[@]} == 0)); then cases=("${all[@]}"); fi
for name in "${cases[@]}"; do
    if [[ " ${all[*]} " != *" $name "* ]]; then
        echo "There is no case $name; there are: ${all[*]}." >&2
        exit 2
    fi
done
cmake -S "$root" -B "$build" -DCMAKE_BUILD_TYPE=Release -DFIRN_BUILD_VERIFICATION=ON -DFIRN_BUILD_TESTS=OFF \
    -DFIRN_BUILD_EXAMPLES=OFF -DFIRN_NATIVE=ON -DFIRN_WARNINGS_AS_ERRORS=OFF ${webgpu[@]+"${webgpu[@]}"}
cmake --build "$build" --parallel "$(firn_jobs)" --target "${cases[@]/#/verify_}"

failed=()
mkdir -p "$out"
for name in "${cases[@]}"; do
    start=$SECONDS
    printf '\n== %s\n' "$name"
    rm -f "$out/$name.json"
    on=()
    if [[ $name == wgsl ]]; then on=(firn_swiftshader); fi
    ${on[@]+"${on[@]}"} "$build/benchmarks/verification/verify_$name" "$out/$name.json" ${quick[@]+"${quick[@]}"} ||
        failed+=("$name")
    echo "== $name: $((SECONDS - start)) s"
done

report=()
if ((${#quick[@]} == 0 && ${#cases[@]} == ${#all[@]})); then report=(--report); fi
"$python" "$root/benchmarks/verification/report.py" "$out" ${report[@]+"${report[@]}"} "${cases[@]}"
if ((${#failed[@]})); then
    echo "Off: ${failed[*]}" >&2
    exit 1
fi
