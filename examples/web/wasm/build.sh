#!/usr/bin/env bash
# build.sh SOURCE.cpp FOLDER [OPTION...]: compiles a program that uses firn to WebAssembly, with clang 19, and writes
# FOLDER/NAME.wasm. module.mjs runs it on one thread or, where memory can be shared, on several.
# OPTION... goes to the compiler, after the script's own options. CXX names another clang than clang++-19.
# Packages of Debian: clang-19 lld-19 libc++-19-dev-wasm32 libc++abi-19-dev-wasm32 libclang-rt-19-dev-wasm32 wasi-libc
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
compiler=${CXX:-clang++-19}
if [[ $compiler != *clang* ]]; then compiler=clang++-19; fi # scripts that source cmake/packages.sh export CXX=g++
if [[ ${1:-} == -h || ${1:-} == --help ]]; then
    sed -n '2,5s/^# //p' "${BASH_SOURCE[0]}" && exit
fi
if (($# < 2)) || [[ $1 != *.cpp ]]; then
    echo 'build.sh needs a source file NAME.cpp and a folder. build.sh --help says more.' >&2 && exit 2
fi
if ! command -v "$compiler" >/dev/null; then
    echo "build.sh did not find $compiler. Install clang-19, or name another clang in CXX." >&2 && exit 2
fi
source=$1 folder=$2 name=$(basename "$1" .cpp)
shift 2

# The same bits as a native build without FMA: -ffp-contract=off. Every catch is left out: -fignore-exceptions.
compile=(--target=wasm32-wasi -std=c++20 -O3 -msimd128 -matomics -mbulk-memory -ffp-contract=off -fno-math-errno
    -fignore-exceptions -fopenmp-simd "-I$here/../../../include" "-I$here")
# The stack lies below all else, so that a stack overflow is found. Debian's libraries are compiled without atomics, as
# --no-check-features allows; runtime.cpp has the locks that they lack.
link=(--target=wasm32-wasi -mexec-model=reactor
    -Wl,--stack-first,-z,stack-size=1048576,--strip-debug
    -Wl,--shared-memory,--import-memory,--initial-memory=33554432,--max-memory=4294967296,--no-check-features
    -Wl,--export=__stack_pointer,--export=__wasm_init_tls,--export=__tls_size,--export=__tls_align
    -Wl,--wrap=malloc,--wrap=calloc,--wrap=realloc,--wrap=aligned_alloc,--wrap=posix_memalign,--wrap=free)

mkdir -p "$folder"
objects=$(mktemp -d)
trap 'rm -rf "$objects"' EXIT
"$compiler" "${compile[@]}" -c "$here/runtime.cpp" -o "$objects/runtime.o"
"$compiler" "${compile[@]}" "$@" -c "$source" -o "$objects/program.o"
"$compiler" "${link[@]}" "$objects"/*.o -o "$folder/$name.wasm"
