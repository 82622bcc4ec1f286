#!/usr/bin/env bash
# arm.sh FOLDER: builds the runs whose hash is stored, and the tests of rows, for AArch64 in FOLDER, and runs them on a
# processor that QEMU imitates: the same bits as on x86-64. Ends with 77 (skipped) where that cannot be done.
set -euo pipefail
export LC_ALL=C

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
folder=$1
compiler=${FIRN_ARM_CXX:-aarch64-linux-gnu-g++}
machine=${FIRN_ARM_RUN:-qemu-aarch64-static}

for command in "$compiler" "$machine"; do
    if ! command -v "$command" >/dev/null; then
        echo "skipped: no $command (Debian, Ubuntu: g++-aarch64-linux-gnu, qemu-user-static)"
        exit 77
    fi
done

# Headers that know no processor, and nothing of this machine's beside them.
mkdir -p "$folder/include"
link() { # NAME TARGET...: of the targets the first that is there
    local name=$1 target
    shift
    for target in "$@"; do
        [[ -e $target ]] || continue
        ln -sfn "$target" "$folder/include/$name"
        return
    done
    return 1
}
if ! link Eigen /usr/include/eigen3/Eigen /usr/local/include/eigen3/Eigen /usr/include/Eigen; then
    echo "skipped: no Eigen in the usual places"
    exit 77
fi

# build PROGRAM OPTION... SOURCE...
build() {
    local program=$folder/$1 log=$folder/$1.log
    shift
    if ! "$compiler" -std=c++20 -fopenmp -fno-math-errno -Wno-psabi -fno-tree-slp-vectorize -static \
        -I"$root/include" -I"$root/tests" -isystem "$folder/include" "$@" -o "$program" &>"$log"; then
        cat "$log"
        exit 1
    fi
}

build golden -O2 -ffp-contract=off "$here/golden.cpp"
"$machine" "$folder/golden"
if link catch2 /usr/include/catch2 /usr/local/include/catch2 && [[ -e $folder/include/catch2/catch.hpp ]]; then
    build rows -O1 "$root/tests/unit/simd/row.cpp" "$root/tests/support/main.cpp"
    "$machine" "$folder/rows"
else
    echo "The tests of rows were left out: they need Catch2 version 2, which is headers only."
fi
