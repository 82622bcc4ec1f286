#!/usr/bin/env bash
# pkg_config.sh PREFIX COMPILER FOLDER: in the empty FOLDER, compiles a program of several ranks with what pkg-config says
# of the firn that is installed in PREFIX. Skipped (77) without pkg-config or where Eigen or MPI does not know it.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
export PKG_CONFIG_PATH=$1/share/pkgconfig${PKG_CONFIG_PATH:+:$PKG_CONFIG_PATH}
compiler=$2 folder=$3
if ! command -v pkg-config >/dev/null || ! pkg-config --exists eigen3 mpi-c; then
    echo "skipped: pkg-config, or what it knows of Eigen and MPI, is not here"
    exit 77
fi
rm -rf "$folder"
mkdir -p "$folder"
cd "$folder"
# shellcheck disable=SC2046 # options
"$compiler" -std=c++20 -O0 "$here/main.cpp" $(pkg-config --cflags --libs firn-mpi) -o program
./program
