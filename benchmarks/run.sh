#!/usr/bin/env bash
# benchmarks/run.sh [--quick] [--full] [OPTION...]: installs what is missing, builds the benchmarks for this machine,
# runs them and writes Google Benchmark's JSON to build/benchmarks/results.json. --quick measures each once and for a
# shorter time, --full adds scenes of 8 and 16 million particles (5 GB of memory); other options go to Google Benchmark
# (--benchmark_filter=step/two_cubes).
# benchmarks/run.sh --ratio [REPETITIONS]: firn against the straightforward Eigen code, in one run.
# benchmarks/run.sh --build: builds only.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=../cmake/packages.sh
source "$root/cmake/packages.sh"

mode=all
options=(--benchmark_repetitions=3 --benchmark_enable_random_interleaving=true --benchmark_display_aggregates_only=true)
for argument in "$@"; do
    case $argument in
        --quick)
            options=(--benchmark_min_time=0.05)
            export FIRN_BENCHMARK_QUICK=1
            ;;
        --full) export FIRN_BENCHMARK_FULL=1 ;;
        --ratio) mode=ratio options=() ;;
        --build) mode=build ;;
        -h | --help) sed -n '2,7s/^# //p' "${BASH_SOURCE[0]}" && exit ;;
        *) options+=("$argument") ;;
    esac
done

firn_install compiler cmake ninja eigen hdf5 benchmark

build=$root/build/benchmarks-release
results=$root/build/benchmarks/results.json
cmake -S "$root" -B "$build" -DCMAKE_BUILD_TYPE=Release -DFIRN_BUILD_BENCHMARKS=ON -DFIRN_BUILD_TESTS=OFF \
    -DFIRN_BUILD_EXAMPLES=OFF -DFIRN_NATIVE=ON -DFIRN_WARNINGS_AS_ERRORS=OFF
cmake --build "$build" --parallel "$(firn_jobs)"

mkdir -p "$(dirname "$results")"
case $mode in
    build) ;;
    ratio) exec python3 "$root/benchmarks/ratio.py" ${options[@]+"${options[@]}"} ;;
    all)
        "$build/benchmarks/firn_benchmarks" "--benchmark_out=$results" --benchmark_out_format=json \
            ${options[@]+"${options[@]}"}
        echo "Results: $results"
        ;;
esac
