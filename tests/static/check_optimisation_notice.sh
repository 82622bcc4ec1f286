#!/usr/bin/env bash
# check_optimisation_notice.sh COMPILER INCLUDE EIGEN: what is compiled without optimisation says so once, however many
# grids and systems it makes.
set -euo pipefail
export LC_ALL=C

compiler=$1 include_dir=$2 eigen=$3
mistakes=0

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cat >"$folder/two_grids.cpp" <<'END'
#include <firn/data/sparse_grid.hpp>
#include <firn/lagrangian/particle_system.hpp>
int main() {
    const firn::Domain<2> box{{0.0, 0.0}, {1.0, 1.0}, 0.1};
    for (int i = 0; i < 2; ++i) {
        firn::SparseGrid<float, 2> grid(box);
        firn::ParticleSystem<2> system;
    }
}
END
says() { # TIMES OPTION...
    local expected=$1 said
    shift
    "$compiler" -std=c++20 -pthread -fopenmp-simd -Wno-psabi -w -I"$include_dir" -isystem "$eigen" "$@" \
        "$folder/two_grids.cpp" -o "$folder/two_grids"
    said=$("$folder/two_grids" 2>&1 | grep -c 'compiled without optimisation' || true)
    ((said == expected)) && return
    echo "compiled with $*, a program says $said times that it is not optimised, expected $expected"
    mistakes=$((mistakes + 1))
}
says 1 -O0
says 0 -O0 -DFIRN_ALLOW_UNOPTIMISED
says 0 -O1
exit $((mistakes > 0))
