#!/usr/bin/env bash
# benchmarks/run.sh [--quick] [--full] [OPTION...]: installs what is missing, builds the benchmarks for this machine,
# runs them and writes Google Benchmark's JSON to build/benchmarks/results.json. --quick measures each once and for a
# shorter time, --full adds scenes of 8 and 16 million particles (5 GB of memory); other options go to Google Benchmark
# (--benchmark_filter=step/two_cubes).
# benchmarks/run.sh --ratio [REPETITIONS]: firn against the straightforward Eigen code, in one run.
# benchmarks/run.sh --gpu [OPTION...]: steps on the GPU that is there, else on SwiftShader; the options are those of
# gpu/steps.cpp: --particles, --scene, --steps, --turns, --quick, --check.
# benchmarks/run.sh --build: builds only.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=../cmake/packages.sh
source "$root/cmake/packages.sh"
# shellcheck source=../cmake/webgpu.sh
source "$root/cmake/webgpu.sh"

mode=all
if [[ ${1:-} == --gpu ]]; then mode=gpu && shift; fi
arguments=("$@")
options=(--benchmark_repetitions=3 --benchmark_enable_random_interleaving=true --benchmark_display_aggregates_only=true)
for argument in "$@"; do
    [[ $mode != gpu ]] || break
    case $argument in
        --quick)
            options=(--benchmark_min_time=0.05)
            export FIRN_BENCHMARK_QUICK=1
            ;;
        --full) export FIRN_BENCHMARK_FULL=1 ;;
        --ratio) mode=ratio options=() ;;
        --build) mode=build ;;
        -h | --help) sed -n '2,9s/^# //p' "${BASH_SOURCE[0]}" && exit ;;
        *) options+=("$argument") ;;
    esac
done

firn_install compiler cmake ninja eigen hdf5 benchmark

webgpu=() target=all
if [[ $mode == gpu ]]; then
    firn_webgpu_c || exit
    webgpu=("-DFIRN_WEBGPU_HEADER_DIR=$FIRN_WEBGPU_HEADER_DIR" "-DFIRN_WEBGPU_LIBRARY=$FIRN_WEBGPU_LIBRARY")
    target=firn_gpu_steps
fi

build=$root/build/benchmarks-release
results=$root/build/benchmarks/results.json
cmake -S "$root" -B "$build" -DCMAKE_BUILD_TYPE=Release -DFIRN_BUILD_BENCHMARKS=ON -DFIRN_BUILD_TESTS=OFF \
    -DFIRN_BUILD_EXAMPLES=OFF -DFIRN_NATIVE=ON -DFIRN_WARNINGS_AS_ERRORS=OFF \
    ${webgpu[@]+"${webgpu[@]}"}
cmake --build "$build" --target "$target" --parallel "$(firn_jobs)"

mkdir -p "$(dirname "$results")"
case $mode in
    build) ;;
    gpu)
        run=()
        if ! "$build/benchmarks/firn_gpu_steps" --adapter >/dev/null; then
            firn_webgpu || exit
            echo "SwiftShader takes the steps, on the CPU."
            run=(firn_swiftshader)
        fi
        ${run[@]+"${run[@]}"} "$build/benchmarks/firn_gpu_steps" ${arguments[@]+"${arguments[@]}"}
        ;;
    ratio) exec python3 "$root/benchmarks/ratio.py" ${options[@]+"${options[@]}"} ;;
    all)
        "$build/benchmarks/firn_benchmarks" "--benchmark_out=$results" --benchmark_out_format=json \
            ${options[@]+"${options[@]}"}
        echo "Results: $results"
        ;;
esac
