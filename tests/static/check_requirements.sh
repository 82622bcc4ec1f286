#!/usr/bin/env bash
# check_requirements.sh COMPILER INCLUDE EIGEN: a compiler that is too old, or C++17, is told so in ten lines at most,
# whichever header it meets first; this one is not.
set -euo pipefail
export LC_ALL=C

compiler=$1 include_dir=$2 eigen=$3
mistakes=0
try() { # TEXT HEADER OPTION...: expects TEXT; nothing expected: no complaint
    local text=$1 header=$2 output lines
    shift 2
    output=$(echo "#include <firn/$header.hpp>" |
        "$compiler" -x c++ -I"$include_dir" -isystem "$eigen" -w "$@" -fsyntax-only - 2>&1) || true
    lines=$(grep -c . <<<"$output") || true
    if [[ -n $text && ($output != *"$text"* || $lines -gt 10) || -z $text && -n $output ]]; then
        printf '%s, %s: %s lines, expected "%s"\n%s\n' "$header" "$*" "$lines" "$text" "$output"
        mistakes=$((mistakes + 1))
    fi
}

# Macros of a compiler, as an older one has them.
if "$compiler" --version | grep -q clang; then
    older=(-U__clang_major__ -D__clang_major__=18)
    apple=(-D__apple_build_version__=16000000 -U__clang_major__)
    try '' core/requirements -std=c++20 "${apple[@]}" -D__clang_major__=17
    try 'or AppleClang 17' core/requirements -std=c++20 "${apple[@]}" -D__clang_major__=16
else
    older=(-U__GNUC__ -D__GNUC__=11)
fi
try '' core/requirements -std=c++20
for header in firn simulation lagrangian core/eigen wgsl/program; do
    try 'firn needs C++20: compile with -std=c++20' "$header" -std=c++17
    try 'firn needs g++ 12, clang 19 or AppleClang 17' "$header" -std=c++20 "${older[@]}"
done
exit $((mistakes > 0))
