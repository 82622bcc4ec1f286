#!/usr/bin/env bash
# pkg_config.sh PREFIX COMPILER FOLDER: in the empty FOLDER, compiles programs with what pkg-config says of the firn that
# is installed in PREFIX. Skipped (77) without pkg-config or where Eigen or HDF5 does not know it.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
export PKG_CONFIG_PATH=$1/share/pkgconfig${PKG_CONFIG_PATH:+:$PKG_CONFIG_PATH}
compiler=$2 folder=$3
if ! command -v pkg-config >/dev/null || ! pkg-config --exists eigen3 hdf5; then
    echo "skipped: pkg-config, or what it knows of Eigen and HDF5, is not here"
    exit 77
fi
rm -rf "$folder"
mkdir -p "$folder"
cp "$here/"{main,other}.cpp "$folder"
cd "$folder"
version=$(pkg-config --modversion firn)
# shellcheck disable=SC2046 # options
"$compiler" -std=c++20 -O0 -Wall -Werror -DEXPECTED_VERSION="\"$version\"" -DCONSUMER_HDF5 main.cpp other.cpp \
    $(pkg-config --cflags --libs firn-hdf5) -o program
./program
