#!/usr/bin/env bash
# check_vectorised.sh COMPILER FLAGS OBJDUMP SOURCE FOLDER: in the machine code of SOURCE's functions firn_*, all
# floating-point arithmetic is packed: with AVX2 and FMA, and with what every x86-64 has (SSE2). FLAGS is a response
# file. A scalar function that is planted must be found. Ends with 77 (skipped) where it cannot be told.
set -euo pipefail
export LC_ALL=C

compiler=$1 flags=$2 objdump=$3 source=$4 folder=$5
fewest_functions=13

machine=$("$compiler" -dumpmachine)
if [[ $machine != x86_64* && $machine != amd64* ]]; then
    echo "skipped: knows the instructions of x86-64 only, and this compiler's target is $machine"
    exit 77
fi
if ! command -v "$objdump" > /dev/null; then
    echo "skipped: no objdump (Debian, Ubuntu: binutils)"
    exit 77
fi
mkdir -p "$folder"

# functions OPTION...: a line for each function firn_*: its name, its number of packed and of scalar operations, and the
# first scalar one. Where a function's code is split, only the part that usually runs counts.
functions() {
    "$compiler" "@$flags" -O3 -fno-sanitize=all -march=x86-64 "$@" -c "$source" -o "$folder/vectorises.o" >&2
    "$objdump" -d --no-show-raw-insn "$folder/vectorises.o" | awk '
        function report() { if (name != "") print name, packed, scalar, (scalar ? first : "-") }
        /^[0-9a-f]+ <.*>:$/ {
            report(); name = ""
            if (match($2, /^<firn_[a-z0-9_]+>:$/)) { name = substr($2, 2, length($2) - 3); packed = scalar = 0 }
            next
        }
        name != "" && $2 ~ /^v?(add|sub|mul|div|sqrt|min|max|rcp|rsqrt)p[sd]$|^vfn?m(add|sub)[0-9]*p[sd]$/ { ++packed }
        name != "" && $2 ~ /^v?(add|sub|mul|div|sqrt|min|max|rcp|rsqrt)s[sd]$|^vfn?m(add|sub)[0-9]*s[sd]$/ {
            if (scalar++ == 0) first = $2
        }
        END { report() }'
}

bad=0
for target in "-mavx2 -mfma" ""; do
    read -ra options <<< "$target"
    list=$(functions "${options[@]}")
    count=$(grep -c . <<< "$list")
    if ((count < fewest_functions)); then
        printf '%s\nOnly %d functions firn_* are in the machine code (%s).\n' "$list" "$count" "${target:-SSE2}"
        bad=1
    fi
    while read -r name packed scalar first; do
        printf '%-28s %-12s %4d packed %3d scalar\n' "$name" "${target:-SSE2}" "$packed" "$scalar"
        if ((scalar > 0)); then echo "  works lane by lane: $first, …" && bad=1; fi
        if ((packed == 0)); then echo "  has no packed arithmetic" && bad=1; fi
    done <<< "$list"
    if ! functions "${options[@]}" -DFIRN_PLANT_SCALAR | grep -Eq '^firn_kernel [0-9]+ [1-9]'; then
        echo "A function that works lane by lane (-DFIRN_PLANT_SCALAR) was not found (${target:-SSE2})."
        bad=1
    fi
done
exit "$bad"
