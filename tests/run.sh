#!/usr/bin/env bash
# tests/run.sh [--ci | --full]: installs missing packages (clang 19 only if apt offers it), builds firn's tests and runs
# them. Without an option, that takes five minutes on two processors: each unit test once, the physics, golden bits, the
# layers of headers, README, and what the compiler must refuse.
#   --ci     runs also all unit tests sanitized, as users compile, or in the portable build, with pairwise combinations;
#            examples, programs for GPUs, WebAssembly, several ranks, all packages, fuzzers
#   --full   runs every test in every build and every combination, the long tests (such as AArch64), all tests with
#            clang 19, and tests with ThreadSanitizer; builds the benchmarks
# FIRN_JOBS=N limits how many compilers and tests run at once.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=../cmake/packages.sh
source "$root/cmake/packages.sh"
# shellcheck source=../cmake/webgpu.sh
source "$root/cmake/webgpu.sh"

ci=no full=no
for argument in "$@"; do
    case $argument in
        --ci) ci=yes ;;
        --full) ci=yes full=yes ;;
        -h | --help) sed -n '2,9s/^# //p' "${BASH_SOURCE[0]}" && exit ;;
        *) echo "tests/run.sh has no option $argument; give --ci, --full or none." >&2 && exit 2 ;;
    esac
done

mkdir -p "$root/build"
passed=0 failed=0 skipped=0
jobs=$(firn_jobs)
export OMP_WAIT_POLICY=${OMP_WAIT_POLICY:-passive} # tests run in parallel, so waiting threads must not spin

skip() { # TEXT
    printf '\n== skipped: %s\n' "$1"
    skipped=$((skipped + 1))
}

# cpu_seconds: sets cpu to the CPU time, user and system, of all that this script has waited for.
cpu_seconds() {
    times >"$root/build/cpu_times" # a pipe would count a new shell's
    cpu=$(tail -n 1 "$root/build/cpu_times" | awk -F '[ms ]' '{ printf "%d", 60 * ($1 + $4) + $2 + $5 }')
}

# begin, then report TITLE: prints how long a stage took. They use the caller's variables start and cpu_start.
begin() {
    cpu_seconds
    start=$SECONDS cpu_start=$cpu
}
report() { # TITLE
    cpu_seconds
    printf '== %s: %d s, %d s of CPU\n' "$1" "$((SECONDS - start))" "$((cpu - cpu_start))"
}

# stage TITLE FOLDER TARGETS LABEL CMAKE_OPTION...: configures and builds in build/FOLDER, runs the tests with LABEL,
# and adds to passed and failed. A failed build counts as one failure; the tests that were built still run.
stage() {
    local title=$1 build=$root/build/$2 targets=$3 label=$4 start cpu_start keep_going=-k
    shift 4
    begin
    printf '\n== %s\n' "$title"
    if ! cmake -S "$root" -B "$build" "$@"; then
        echo "== $title: cannot be configured"
        failed=$((failed + 1))
        return
    fi
    if [[ -e $build/build.ninja ]]; then keep_going=-k0; fi
    # shellcheck disable=SC2086 # several targets
    if ! cmake --build "$build" --parallel "$jobs" --target $targets -- "$keep_going"; then
        echo "== $title: does not build"
        failed=$((failed + 1))
    fi
    test_stage "$title" "$build" "$label"
    report "$title"
}

# test_stage TITLE BUILD LABEL CTEST_OPTION...
test_stage() {
    local title=$1 build=$2 label=$3 status=0 bad all
    shift 3
    if [[ $label != all ]]; then set -- -L "$label" "$@"; fi
    ctest --test-dir "$build" --output-on-failure --no-tests=error --parallel "$jobs" "$@" 2>&1 |
        tee "$build/ctest.log" || status=$?
    # Take the last such line, because the output of a failed test may contain that of another CTest.
    if [[ $(grep -E 'tests? failed out of' "$build/ctest.log" | tail -n 1) =~ ([0-9]+)\ tests?\ failed\ out\ of\ ([0-9]+) ]]; then
        bad=${BASH_REMATCH[1]} all=${BASH_REMATCH[2]}
    else
        bad=0 all=0
    fi
    # Count a failure of CTest itself, too.
    if ((status != 0 && bad == 0)); then bad=1 all=$((all + 1)); fi
    local without
    without=$(grep -c '^[[:space:]]*[0-9][0-9]* - .* (Skipped)$' "$build/ctest.log" || true)
    passed=$((passed + all - bad - without))
    failed=$((failed + bad))
    skipped=$((skipped + without))
}

# logged NAME COMMAND...: runs the command and writes its output to build/logs/NAME.log.
logged() {
    local log=$root/build/logs/$1.log status=0 start=$SECONDS
    mkdir -p "$root/build/logs"
    shift
    "$@" >"$log" 2>&1 || status=$?
    printf '\n== ended with %d after %d s: %s\n' "$status" "$((SECONDS - start))" "$*" >>"$log"
}

# counted NAME: prints the log, and adds its last lines to passed and failed: "N passed, N failed", or "# pass N" and
# "# fail N" of node.
counted() {
    local line good=0 bad=0 status=1 log=$root/build/logs/$1.log
    touch "$log"
    cat "$log"
    while read -r line; do
        if [[ $line =~ ^([0-9]+)\ passed,\ ([0-9]+)\ failed$ ]]; then
            good=$((good + BASH_REMATCH[1])) bad=$((bad + BASH_REMATCH[2]))
        elif [[ $line =~ ^\#\ pass\ ([0-9]+)$ ]]; then
            good=$((good + BASH_REMATCH[1]))
        elif [[ $line =~ ^\#\ fail\ ([0-9]+)$ ]]; then
            bad=$((bad + BASH_REMATCH[1]))
        elif [[ $line =~ ^==\ ended\ with\ ([0-9]+)\ after ]]; then
            status=${BASH_REMATCH[1]}
        fi
    done <"$log"
    # A crash without a count is a failure, too.
    if ((status != 0 && bad == 0)) || ((good + bad == 0)); then bad=$((bad + 1)); fi
    passed=$((passed + good)) failed=$((failed + bad))
}

# Runs emitted programs with two compilers, Tint and naga, on a software GPU, and compares integers and particles with
# the CPU's. The software GPU uses one thread, so two lanes of about the same duration run in parallel.
wgsl_stage() { # FOLDER CASES_OPTION...
    local start cpu_start tests=$root/tests/wgsl build=$root/build/wgsl programs=$root/build/$1 validate=--pairwise log
    local lane=(host tint tint_refuses dawn page) other_lane=(serve naga naga_refuses deno)
    shift
    begin
    if [[ $full == yes ]]; then validate=--validate; fi
    printf '\n== WGSL on a software GPU\n'
    if ! firn_webgpu; then
        skip 'WGSL, which needs the packages above'
        return
    fi
    rm -rf "$build" && mkdir -p "$build"
    if ! "$programs/tests/wgsl/firn_wgsl_cases" "$build" "$@" ||
        ! "$programs/examples/06_emit_wgsl" --all "$build/programs"; then
        echo "== WGSL: the programs cannot be emitted"
        failed=$((failed + 1))
        return
    fi
    # Without --full, each case runs with one of the two compilers: Dawn's lane has the page, too, so it has fewer.
    local cases=("$build"/cases/*/) dawn_cases=() deno_cases=() i
    for i in "${!cases[@]}"; do
        if [[ $full == yes ]] || ((i % 5 < 2)); then dawn_cases+=("${cases[i]}"); fi
        if [[ $full == yes ]] || ((i % 5 >= 2)); then deno_cases+=("${cases[i]}"); fi
    done
    if ((${#webgpu[@]})); then other_lane+=(host_in_c++ on_gpu tank sets features); fi
    if ((${#webgpu[@]})) && [[ $full == yes ]]; then other_lane+=(example); fi
    if ((jobs > 1)); then
        wgsl_lane "${lane[@]}" &
        wgsl_lane "${other_lane[@]}"
        wait "$!"
    else
        wgsl_lane "${lane[@]}" "${other_lane[@]}"
    fi
    for log in "${lane[@]}" "${other_lane[@]}"; do counted "$log"; done
    report WGSL
}

# Runs the example that needs a GPU on one in software.
gpu_example() { # uses the variables of wgsl_stage
    if firn_swiftshader cmake "-DPROGRAM=$programs/examples/23_on_gpu" -DMODE=gpu "-DOUTPUT=$build/example" \
        -P "$root/examples/check_example.cmake"; then
        echo '1 passed, 0 failed'
    else
        echo '0 passed, 1 failed'
    fi
}

wgsl_lane() { # NAME...; uses the variables of wgsl_stage
    local name
    for name in "$@"; do
        case $name in
            serve) logged "$name" node "$tests/serve.mjs" ;;
            host) logged "$name" firn_dawn "$tests/host.mjs" ;;
            host_in_c++) logged "$name" firn_swiftshader "$programs/tests/wgsl/firn_webgpu_host" ;;
            on_gpu) logged "$name" firn_swiftshader "$programs/tests/wgsl/firn_webgpu_on_gpu" ;;
            tank) logged "$name" firn_swiftshader "$programs/tests/wgsl/firn_webgpu_tank" "$build/sets" ;;
            features) logged "$name" firn_swiftshader "$programs/tests/wgsl/firn_webgpu_features" ;;
            sets) logged "$name" firn_dawn "$tests/sets.mjs" "$build/sets" ;; # what tank has written
            example) logged "$name" gpu_example ;;
            tint) logged "$name" firn_dawn "$tests/run.mjs" "$validate" "$build"/programs/*/ ;;
            naga) logged "$name" firn_deno "$tests/run.mjs" "$validate" "$build"/programs/*/ ;;
            tint_refuses) logged "$name" firn_dawn "$tests/run.mjs" --expect-invalid "$build"/broken/{every,tint}/*.wgsl ;;
            naga_refuses) logged "$name" firn_deno "$tests/run.mjs" --expect-invalid "$build"/broken/every/*.wgsl ;;
            page) logged "$name" firn_chromium "$tests/page.mjs" "$build/cases/3d_page" ;;
            dawn) logged "$name" firn_dawn "$tests/run.mjs" "${dawn_cases[@]}" ;;
            deno) logged "$name" firn_deno "$tests/run.mjs" "${deno_cases[@]}" ;;
        esac
    done
}

# Compiles a program to WebAssembly and runs it in node: the bits of a native build, and how a program ends. Then the
# page of particles, in a browser.
wasm_stage() {
    local start cpu_start
    begin
    printf '\n== WebAssembly\n'
    if ! firn_install_if_offered node "${firn_wasm_needs[@]}"; then
        skip 'WebAssembly, which needs node, clang 19 and its packages for wasm32'
        return
    fi
    if "$root/examples/web/wasm/build.sh" "$root/tests/wasm/program.cpp" "$root/build/wasm" "-I$root/tests"; then
        logged wasm timeout 120 node --test "$root/tests/wasm/module.mjs"
        logged wasm_guide timeout 300 "$root/tests/wasm/guide.sh" "$root/build/wasm"
        counted wasm
        counted wasm_guide
    else
        echo "== WebAssembly: does not build"
        failed=$((failed + 1))
    fi
    if ! firn_webgpu; then
        skip 'the page of particles, which needs the packages above for a browser'
    elif "$root/examples/web/wasm/build.sh" "$root/examples/web/particles.cpp" "$root/build/wasm/web/wasm" \
        "-I$root/examples"; then
        logged particles firn_chromium "$root/tests/wgsl/particles.mjs" "$root/build/wasm/web"
        counted particles
    else
        echo "== the page of particles: does not build"
        failed=$((failed + 1))
    fi
    report WebAssembly
}

# Programs on several ranks of this machine.
mpi_stage() {
    if ! firn_install_if_offered mpi mpi_run; then
        skip 'several ranks, which need MPI (on Debian and Ubuntu: openmpi-bin libopenmpi-dev)'
        return
    fi
    local targets=firn_mpi_tests examples=OFF compiler=()
    if [[ $clang == yes ]]; then compiler=("${with_clang[@]}"); fi # in half the time of g++
    if [[ $full == yes ]]; then targets+=' firn_mpi_full_tests' examples=ON; fi
    stage 'several ranks' tests-mpi "$targets" mpi "${release[@]}" ${compiler[@]+"${compiler[@]}"} \
        -DFIRN_BUILD_MPI_TESTS=ON -DFIRN_TEST_UNITY=ON -DFIRN_BUILD_EXAMPLES=$examples -DFIRN_EXAMPLES=18
    if [[ $full == yes ]]; then
        test_stage 'several ranks, long' "$root/build/tests-mpi" '^full$' -R '^firn_mpi_' -C Full
    fi
}

finish() {
    start=0 cpu_start=0
    printf '\n'
    report all
    printf '%d skipped\n%d passed, %d failed\n' "$skipped" "$passed" "$failed"
    ((failed == 0))
    exit
}

firn_install compiler cmake ninja eigen hdf5 catch2 cli11 png boost
clang=no
if firn_install_if_offered clang clang_openmp clang_rt; then
    clang=yes
else
    skip 'clang 19, which is not installed and not offered by apt'
fi
with_clang=(-DCMAKE_C_COMPILER=clang-19 -DCMAKE_CXX_COMPILER=clang++-19)
release=(-DCMAKE_BUILD_TYPE=Release -DFIRN_EXAMPLE_OPTIONS=-O1)
portable=(-DCMAKE_BUILD_TYPE=Release -DFIRN_EXAMPLE_OPTIONS=-O1 -DFIRN_PORTABLE=ON)
# Each compiler builds what it compiles faster: clang, if installed, builds sanitized and unoptimised code.
second=(-DFIRN_TEST_UNITY=ON)
if [[ $clang == yes ]]; then second+=("${with_clang[@]}"); fi

stage 'each unit test once, physics, golden bits, headers' tests-quick \
    'firn_unit_tests firn_physics_tests firn_determinism_tests firn_static_tests' \
    'unit|physics|determinism|static|package' "${portable[@]}" "${second[@]}" -DFIRN_TEST_PART=quick \
    -DFIRN_BUILD_EXAMPLES=OFF
if [[ $ci == no ]]; then finish; fi

for need in python python_venv doxygen doxygen_theme pkg_config lbfgspp; do firn_install_if_offered "$need" || true; done
# Reports of sanitizers name functions, and with --full also lines.
sanitizer=(-DCMAKE_BUILD_TYPE=Debug "-DCMAKE_CXX_FLAGS_DEBUG=-O0 $([[ $full == no ]] || echo -g1)" -DFIRN_NATIVE=OFF
    -DFIRN_BUILD_EXAMPLES=OFF -DFIRN_WARNINGS_AS_ERRORS=OFF)

webgpu=() # paths of the C interface, for the host in C++
if firn_webgpu_c; then
    webgpu=("-DFIRN_WEBGPU_HEADER_DIR=$FIRN_WEBGPU_HEADER_DIR" "-DFIRN_WEBGPU_LIBRARY=$FIRN_WEBGPU_LIBRARY")
else
    skip 'the WebGPU host in C++'
fi

where=portable sanitized='firn_unit_tests' labels='unit' fuzzers=()
if [[ $clang == yes ]]; then
    where=portable-clang sanitized+=' firn_fuzzers' labels+='|fuzz'
    fuzzers=(-DFIRN_BUILD_FUZZERS=ON "-DFIRN_FUZZ_RUNS=$([[ $full == yes ]] && echo 10000 || echo 500)")
fi
if [[ $full == yes ]]; then
    stage 'all tests' tests-release all all "${release[@]}" ${webgpu[@]+"${webgpu[@]}"} -DFIRN_TEST_PART=all \
        -DFIRN_TEST_UNITY=OFF
else
    stage 'arithmetic, physics, headers, packages' tests-release \
        'firn_unit_tests firn_physics_tests firn_determinism_tests firn_static_tests' \
        'unit|physics|determinism|static|package' "${release[@]}" ${webgpu[@]+"${webgpu[@]}"} -DFIRN_TEST_PART=arithmetic \
        -DFIRN_TEST_UNITY=ON
fi
stage 'AddressSanitizer and UndefinedBehaviorSanitizer' tests-asan "$sanitized" "$labels" "${sanitizer[@]}" \
    "${second[@]}" ${fuzzers[@]+"${fuzzers[@]}"} -DFIRN_SANITIZE=address,undefined \
    -DFIRN_TEST_PART="$([[ $full == yes ]] && echo all || echo memory)"
stage 'portable build: behaviour, determinism, examples' "tests-$where" \
    'firn_unit_tests firn_determinism_tests firn_examples firn_wgsl_programs' 'unit|determinism|example' \
    "${portable[@]}" "${second[@]}" ${webgpu[@]+"${webgpu[@]}"} -DFIRN_TEST_PART=behaviour \
    -DFIRN_EXAMPLES="$([[ $full == yes ]] && echo '.*' || echo '01|05|06|12|13|14|15')"
wgsl_stage "tests-$where"
wasm_stage
mpi_stage

if [[ $full == yes ]]; then
    printf '\n== long tests\n'
    firn_install_if_offered arm_compiler arm_machine || true
    test_stage 'long tests' "$root/build/tests-release" '^full$' -C Full
    wgsl_stage tests-release --large
    if [[ $clang == yes ]]; then
        stage 'determinism, portable build, g++' tests-portable firn_determinism_tests determinism "${portable[@]}"
        stage 'all tests, clang 19' tests-clang all all "${release[@]}" "${with_clang[@]}" -DFIRN_TEST_UNITY=ON
        export TSAN_OPTIONS=ignore_noninstrumented_modules=1 OMP_TOOL_LIBRARIES=/usr/lib/llvm-19/lib/libarcher.so
        stage 'unit and determinism tests with ThreadSanitizer' tests-tsan firn_threaded_tests 'unit|determinism' \
            "${sanitizer[@]}" "${with_clang[@]}" -DFIRN_SANITIZE=thread -DFIRN_TEST_UNITY=ON
        unset TSAN_OPTIONS OMP_TOOL_LIBRARIES
    fi
    firn_install benchmark
    stage 'benchmarks build' tests-benchmarks all '^benchmark$' "${release[@]}" -DFIRN_BUILD_TESTS=OFF \
        -DFIRN_BUILD_EXAMPLES=OFF -DFIRN_BUILD_BENCHMARKS=ON
fi

finish
