#!/usr/bin/env bash
# build.sh [--one | --shared] SOURCE.cpp FOLDER [OPTION...]: compiles a program of firn's to WebAssembly with clang 19.
# It writes FOLDER/NAME.wasm, for one thread, and FOLDER/NAME_shared.wasm, for several threads on shared memory.
#   --one, --shared   writes only the first, only the second
#   OPTION...         goes to the compiler after the script's own options: -O1, -D…, -I…
# CXX names the compiler (default clang++-19). The packages of Debian: clang-19 lld-19 libc++-19-dev-wasm32
# libc++abi-19-dev-wasm32 libclang-rt-19-dev-wasm32 wasi-libc.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
kinds=(one shared)
case ${1:-} in
    --one | --shared) kinds=("${1#--}") && shift ;;
    -h | --help) sed -n '2,7s/^# //p' "${BASH_SOURCE[0]}" && exit ;;
esac
if (($# < 2)) || [[ $1 != *.cpp ]]; then
    echo "build.sh needs a source file NAME.cpp and a folder; build.sh --help says more." >&2
    exit 2
fi
source=$1 folder=$2
shift 2
name=$(basename "$source" .cpp)

compiler=${CXX:-clang++-19}
if ! command -v "$compiler" >/dev/null; then
    echo "build.sh found no $compiler (Debian: clang-19); CXX=... names another clang." >&2
    exit 2
fi

common=(--target=wasm32-wasi -std=c++20 -O3 -msimd128 -ffp-contract=off -fno-math-errno -fignore-exceptions
    -fopenmp-simd -I"$here/../../../include" -I"$here")
# A stack that overflows ends the module (--stack-first).
link=(-mexec-model=reactor "-Wl,--stack-first,-z,stack-size=1048576,--strip-debug"
    "-Wl,--import-memory,--initial-memory=33554432,--max-memory=4294967296")
# Debian's libraries are compiled without atomics, which --no-check-features allows; runtime.cpp locks what must be.
shared=(-matomics -mbulk-memory)
link_shared=("-Wl,--shared-memory,--no-check-features"
    "-Wl,--export=__stack_pointer,--export=__wasm_init_tls,--export=__tls_size,--export=__tls_align"
    "-Wl,--wrap=malloc,--wrap=calloc,--wrap=realloc,--wrap=aligned_alloc,--wrap=posix_memalign,--wrap=free")

mkdir -p "$folder"
for kind in "${kinds[@]}"; do
    if [[ $kind == one ]]; then
        "$compiler" "${common[@]}" "${link[@]}" "$@" "$source" "$here/runtime.cpp" -o "$folder/$name.wasm"
    else
        "$compiler" "${common[@]}" "${shared[@]}" "${link[@]}" "${link_shared[@]}" "$@" "$source" "$here/runtime.cpp" \
            -o "$folder/${name}_shared.wasm"
    fi
done
