#!/usr/bin/env bash
# check_requirements.sh COMPILER INCLUDE EIGEN HEADER...: a compiler that is too old, C++17, options that change the
# arithmetic, and a program that does not link what it includes are told so in a few lines, whichever header they meet
# first; this compiler is not.
set -euo pipefail
export LC_ALL=C

compiler=$1 include_dir=$2 eigen=$3
shift 3
mistakes=0
most=10 # lines
try() { # TEXT HEADER OPTION...: expects TEXT; nothing expected: no complaint
    local text=$1 header=$2 output lines
    shift 2
    output=$(echo "#include <firn/$header.hpp>" |
        "$compiler" -x c++ -I"$include_dir" -isystem "$eigen" -w "$@" -fsyntax-only - 2>&1) || true
    lines=$(grep -c . <<<"$output") || true
    if [[ -n $text && ($output != *"$text"* || $lines -gt $most) || -z $text && -n $output ]]; then
        printf '%s, %s: %s lines, expected "%s"\n%s\n' "$header" "$*" "$lines" "$text" "$output"
        mistakes=$((mistakes + 1))
    fi
}

# Macros of a compiler, as an older one has them.
if "$compiler" --version | grep -q clang; then
    older=(-U__clang_major__ -D__clang_major__=15)
    apple=(-D__apple_build_version__=16000000 -U__clang_major__)
    try '' core/requirements -std=c++20 "${apple[@]}" -D__clang_major__=17
    try 'or AppleClang 17' core/requirements -std=c++20 "${apple[@]}" -D__clang_major__=16
else
    older=(-U__GNUC__ -D__GNUC__=11)
fi
try '' core/requirements -std=c++20
# MSVC, as far as its macros go: it defines neither __GNUC__ nor __clang__, and __cplusplus is that of C++98.
try 'firn does not compile with MSVC, which has no vector types' core/requirements -std=c++20 -D_MSC_VER=1940 \
    -U__GNUC__ -U__clang__ -U__cplusplus -D__cplusplus=199711L
for header in "$@"; do
    try 'firn needs C++20: compile with -std=c++20' "$header" -std=c++17
    try 'firn needs g++ 12, clang 16 or AppleClang 17' "$header" -std=c++20 "${older[@]}"
    try 'firn does not compile with -fno-exceptions: its errors are exceptions' "$header" -std=c++20 -fno-exceptions
done
try '' core/requirements -std=c++20 -fno-rtti

# Options with which sums, sines and powers are wrong, or checks for NaN are left out.
try 'firn does not work with -ffast-math' firn -std=c++20 -ffast-math
try 'firn does not work with -ffast-math' lagrangian -std=c++20 -Ofast
unsafe='firn does not work with -funsafe-math-optimizations and its parts'
most=14 # of which six name the headers between
for option in -ffast-math -Ofast; do try 'firn does not work with -ffast-math' math/elementary -std=c++20 $option; done
for options in -funsafe-math-optimizations -freciprocal-math -fno-signed-zeros \
    '-fassociative-math -fno-signed-zeros -fno-trapping-math'; do
    # shellcheck disable=SC2086 # several options
    try "$unsafe" math/elementary -std=c++20 -O2 $options
done
try 'firn does not work with -ffinite-math-only' math/elementary -std=c++20 -ffinite-math-only
if "$compiler" --version | grep -q clang; then
    try "$unsafe" math/elementary -std=c++20 -fapprox-func
else
    try 'compile without -fsingle-precision-constant' math/elementary -std=c++20 -fsingle-precision-constant
    if [[ $("$compiler" -dumpmachine) == x86_64* ]]; then
        try 'Compile with -msse2 -mfpmath=sse' math/elementary -std=c++20 -mfpmath=387
    fi
fi
most=10
for options in -fno-math-errno -fno-trapping-math -frounding-math -ffp-contract=off -ffp-contract=fast \
    '-Ofast -fno-fast-math'; do
    # shellcheck disable=SC2086 # several options
    try '' math/elementary -std=c++20 -O2 -Wno-psabi $options
done

# Where hdf5.h lies among the compiler's own headers, nothing is amiss.
if ! echo '#include <hdf5.h>' | "$compiler" -x c++ -fsyntax-only - 2>/dev/null; then
    most=12 # of which four name the headers between
    for header in io/states io/state_reader; do
        try 'in CMake link firn::hdf5, not firn::firn' "$header" -std=c++20 -fopenmp-simd -Wno-psabi
    done
fi

exit $((mistakes > 0))
