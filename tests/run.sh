#!/usr/bin/env bash
# tests/run.sh [--full]: installs what is missing, clang 19 too where apt offers it, builds firn's tests, runs them.
#   --full   adds the long tests (AArch64 among them), all tests with clang 19, ThreadSanitizer, and the benchmarks
# FIRN_JOBS=N limits how many compilers and tests run at once.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=../cmake/packages.sh
source "$root/cmake/packages.sh"
# shellcheck source=../cmake/webgpu.sh
source "$root/cmake/webgpu.sh"

full=no
for argument in "$@"; do
    case $argument in
        --full) full=yes ;;
        -h | --help) sed -n '2,4s/^# //p' "${BASH_SOURCE[0]}" && exit ;;
        *) echo "tests/run.sh does not know $argument; it knows --full." >&2 && exit 2 ;;
    esac
done

passed=0 failed=0
jobs=$(firn_jobs)
export OMP_WAIT_POLICY=${OMP_WAIT_POLICY:-passive} # tests run beside each other: waiting threads shall not spin

# stage TITLE FOLDER TARGET LABEL CMAKE_OPTION...: configures and builds in build/FOLDER, runs the tests with LABEL, and
# adds to passed and failed. What does not build is one failure; the tests that did build are run all the same.
stage() {
    local title=$1 build=$root/build/$2 target=$3 label=$4 start=$SECONDS keep_going=-k
    shift 4
    printf '\n== %s\n' "$title"
    if ! cmake -S "$root" -B "$build" "$@"; then
        echo "== $title: cannot be configured"
        failed=$((failed + 1))
        return
    fi
    if [[ -e $build/build.ninja ]]; then keep_going=-k0; fi
    if ! cmake --build "$build" --parallel "$jobs" --target "$target" -- "$keep_going"; then
        echo "== $title: does not build"
        failed=$((failed + 1))
    fi
    test_stage "$title" "$build" "$label"
    echo "== $title: $((SECONDS - start)) s"
}

# test_stage TITLE BUILD LABEL CTEST_OPTION...
test_stage() {
    local title=$1 build=$2 label=$3 status=0 bad all
    shift 3
    if [[ $label != all ]]; then set -- -L "$label" "$@"; fi
    ctest --test-dir "$build" --output-on-failure --no-tests=error --parallel "$jobs" "$@" 2>&1 |
        tee "$build/ctest.log" || status=$?
    if [[ $(<"$build/ctest.log") =~ ([0-9]+)\ tests?\ failed\ out\ of\ ([0-9]+) ]]; then
        bad=${BASH_REMATCH[1]} all=${BASH_REMATCH[2]}
    else
        bad=0 all=0
    fi
    # A failure that CTest does not count as a test's is one nevertheless.
    if ((status != 0 && bad == 0)); then bad=1 all=$((all + 1)); fi
    passed=$((passed + all - bad))
    failed=$((failed + bad))
}

# counted COMMAND...: adds to passed and failed what it closes with, "N passed, N failed" or node's "# pass N", "# fail N".
counted() {
    local status=0 line good=0 bad=0 log=$root/build/wgsl/counted.log
    "$@" 2>&1 | tee "$log" || status=$?
    while read -r line; do
        if [[ $line =~ ^([0-9]+)\ passed,\ ([0-9]+)\ failed$ ]]; then
            good=$((good + BASH_REMATCH[1])) bad=$((bad + BASH_REMATCH[2]))
        elif [[ $line =~ ^\#\ pass\ ([0-9]+)$ ]]; then
            good=$((good + BASH_REMATCH[1]))
        elif [[ $line =~ ^\#\ fail\ ([0-9]+)$ ]]; then
            bad=$((bad + BASH_REMATCH[1]))
        fi
    done <"$log"
    # A crash that counted nothing is a failure nevertheless.
    if ((status != 0 && bad == 0)) || ((good + bad == 0)); then bad=$((bad + 1)); fi
    passed=$((passed + good)) failed=$((failed + bad))
}

# Emitted programs under two compilers, Tint and naga, on a software GPU; integers and particles against the CPU's.
wgsl_stage() { # CASES_OPTION...
    local start=$SECONDS tests=$root/tests/wgsl build=$root/build/wgsl release=$root/build/tests-release naga=--pairwise
    if [[ $full == yes ]]; then naga=--validate; fi
    printf '\n== WGSL on a software GPU\n'
    if ! firn_webgpu; then
        printf '== skipped: WGSL, which needs the packages above\n'
        return
    fi
    rm -rf "$build" && mkdir -p "$build"
    if ! "$release/tests/wgsl/firn_wgsl_cases" "$build" "$@" ||
        ! "$release/examples/06_emit_wgsl" --all "$build/programs"; then
        echo "== WGSL: nothing is emitted"
        failed=$((failed + 1))
        return
    fi
    counted node "$tests/serve.mjs"
    counted firn_dawn "$tests/host.mjs"
    if ((${#webgpu[@]})); then counted firn_swiftshader "$release/tests/wgsl/firn_webgpu_host"; fi
    counted firn_dawn "$tests/run.mjs" --validate "$build"/programs/*/
    counted firn_deno "$tests/run.mjs" "$naga" "$build"/programs/*/
    counted firn_dawn "$tests/run.mjs" --expect-invalid "$build"/broken/{every,tint}/*.wgsl
    counted firn_deno "$tests/run.mjs" --expect-invalid "$build"/broken/every/*.wgsl
    counted firn_chromium "$tests/page.mjs" "$build/cases/3d_page"
    counted firn_dawn "$tests/run.mjs" "$build"/cases/*/
    counted firn_deno "$tests/run.mjs" "$build"/cases/*/
    echo "== WGSL: $((SECONDS - start)) s"
}

firn_install compiler cmake ninja eigen hdf5 catch2 cli11 png boost
clang=no
if firn_install_if_offered clang clang_openmp clang_rt; then clang=yes; fi
with_clang=(-DCMAKE_C_COMPILER=clang-19 -DCMAKE_CXX_COMPILER=clang++-19)
release=(-DCMAKE_BUILD_TYPE=Release -DFIRN_EXAMPLE_OPTIONS=-O1)
portable=("${release[@]}" -DFIRN_PORTABLE=ON -DFIRN_BUILD_EXAMPLES=OFF)
sanitizer=(-DCMAKE_BUILD_TYPE=Debug "-DCMAKE_CXX_FLAGS_DEBUG=-O0 -g1" -DFIRN_NATIVE=OFF -DFIRN_BUILD_EXAMPLES=OFF
    -DFIRN_WARNINGS_AS_ERRORS=OFF)

webgpu=() # where the C interface is, for the host in C++
if firn_webgpu_c; then
    webgpu=("-DFIRN_WEBGPU_HEADER_DIR=$FIRN_WEBGPU_HEADER_DIR" "-DFIRN_WEBGPU_LIBRARY=$FIRN_WEBGPU_LIBRARY")
else
    printf '\n== skipped: the WebGPU host in C++\n'
fi

stage 'all tests' tests-release all all "${release[@]}" ${webgpu[@]+"${webgpu[@]}"}
wgsl_stage
# clang compiles what is sanitized more than twice as fast as g++ does.
quicker=()
if [[ $clang == yes ]]; then quicker=("${with_clang[@]}"); fi
stage 'unit tests with AddressSanitizer and UndefinedBehaviorSanitizer' tests-asan firn_unit_tests unit \
    "${sanitizer[@]}" ${quicker[@]+"${quicker[@]}"} -DFIRN_SANITIZE=address,undefined
stage 'determinism, portable build' tests-portable firn_determinism_tests determinism "${portable[@]}"
if [[ $clang == yes ]]; then
    stage 'determinism, portable build, clang 19' tests-portable-clang firn_determinism_tests determinism \
        "${portable[@]}" "${with_clang[@]}"
else
    printf '\n== skipped: determinism with clang 19, which is not here and apt does not offer it\n'
fi

if [[ $full == yes ]]; then
    printf '\n== long tests\n'
    firn_install_if_offered arm_compiler arm_machine || true
    test_stage 'long tests' "$root/build/tests-release" '^full$' -C Full
    wgsl_stage --large
    if [[ $clang == yes ]]; then
        stage 'all tests, clang 19' tests-clang all all "${release[@]}" "${with_clang[@]}"
        export TSAN_OPTIONS=ignore_noninstrumented_modules=1 OMP_TOOL_LIBRARIES=/usr/lib/llvm-19/lib/libarcher.so
        stage 'unit and determinism tests with ThreadSanitizer' tests-tsan firn_threaded_tests 'unit|determinism' \
            "${sanitizer[@]}" "${with_clang[@]}" -DFIRN_SANITIZE=thread
        unset TSAN_OPTIONS OMP_TOOL_LIBRARIES
    fi
    firn_install benchmark
    stage 'benchmarks build' tests-benchmarks all '^benchmark$' "${release[@]}" -DFIRN_BUILD_TESTS=OFF \
        -DFIRN_BUILD_EXAMPLES=OFF -DFIRN_BUILD_BENCHMARKS=ON
fi

printf '\n%d s in all\n%d passed, %d failed\n' "$SECONDS" "$passed" "$failed"
((failed == 0))
