#!/usr/bin/env bash
# check_headers_test.sh: plants one mistake at a time in a folder of its own and asks check_headers.sh to name it.
set -euo pipefail

check=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)/check_headers.sh
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
failed=0

# planted EXPECTED HEADER LINE...: a tree that holds HEADER with the lines; EXPECTED '' means that all is well.
planted() {
    local expected=$1 header=$2 output status=0
    shift 2
    rm -rf "$folder"
    mkdir -p "$(dirname "$folder/firn/$header")"
    printf '%s\n' '/// \file A planted header.' "$@" >"$folder/firn/$header"
    output=$(bash "$check" "$folder") || status=$?
    if [[ -z $expected && $status -eq 0 ]]; then return; fi
    if [[ -n $expected && $status -ne 0 && $output == *"$expected"* ]]; then return; fi
    echo "firn/$header with '$*': expected '${expected:-no mistake}', got (status $status):"
    echo "$output"
    failed=1
}

planted '' stage/a.hpp '#include <firn/core/tensor.hpp>' '#include <firn/stage/b.hpp>' '#include <vector>'
planted '' core/a.hpp '#include <omp.h>' '#pragma omp parallel for'
planted 'loops may not use openmp' loops/a.hpp '#pragma omp parallel for'
planted '' io/a.hpp '#include <hdf5.h>' '#include <firn/simulation.hpp>'
planted '' material/a.hpp '#pragma omp simd' '// #include <firn/loops/a.hpp>'
planted '' webgpu/a.hpp '#include <webgpu/webgpu.h>' '#include <firn/wgsl/inputs.hpp>'
planted 'wgsl may not use webgpu' wgsl/a.hpp '#include <webgpu/webgpu.h>'
planted 'io may not use webgpu' io/a.hpp '#include <webgpu/webgpu.h>'
planted 'webgpu may not use openmp' webgpu/a.hpp '#include <omp.h>'
planted 'firn may not include <firn/webgpu/host.hpp>' firn.hpp '#include <firn/webgpu/host.hpp>'
planted 'wgsl may not include <firn/webgpu/host.hpp>' wgsl/a.hpp '#include <firn/webgpu/host.hpp>'
planted '' mpi/a.hpp '#include <mpi.h>' '#include <firn/io/state.hpp>' '#include <unistd.h>'
planted '' mpi.hpp '#include <firn/mpi/session.hpp>' '#include <firn/firn.hpp>'
planted 'io may not use mpi' io/a.hpp '#include <mpi.h>'
planted 'mpi may not use hdf5' mpi/a.hpp '#include <hdf5.h>'
planted 'firn may not include <firn/mpi/cuts.hpp>' firn.hpp '#include <firn/mpi/cuts.hpp>'
planted 'core may not include <firn/math/svd.hpp>' core/a.hpp '#include <firn/math/svd.hpp>'
planted 'material may not include <firn/kernel/a.hpp>' material/a.hpp '  #  include <firn/kernel/a.hpp>'
planted 'transfer may not include <firn/data/grid.hpp>' transfer/a.hpp '#include <firn/data/grid.hpp>'
planted 'wgsl may not include <firn/loops/p2g.hpp>' wgsl/a.hpp '#include <firn/loops/p2g.hpp>'
planted 'firn may not include <firn/io/state.hpp>' firn.hpp '#include <firn/io/state.hpp>'
planted 'boundary may not use openmp' boundary/a.hpp '#include <omp.h>'
planted 'force may not use openmp' force/a.hpp '#pragma omp atomic'
planted 'data may not use hdf5' data/a.hpp '#include <hdf5.h>'
planted 'stage may not use posix' stage/a.hpp '#include <unistd.h>'
planted 'in angle brackets' core/a.hpp '#include "scalar.hpp"'
planted 'not in the table' utils/a.hpp ''
planted 'not in the table' core/a.hpp '#include <firn/utils/a.hpp>'
planted 'not in the table' core/a.hpp '#include <png.h>'
planted 'write namespace firn::inline FIRN_BUILD' core/a.hpp 'namespace firn::detail {'
planted '' core/a.hpp 'namespace firn::inline FIRN_BUILD::detail {' 'namespace firn {  // whatever the build'
planted 'at most 600' core/a.hpp "$(printf '//%.0s\n' {1..601})"

rm -rf "$folder"
mkdir -p "$folder/firn/core"
echo 'int x;' >"$folder/firn/core/a.hpp"
output=$(bash "$check" "$folder" || true)
[[ $output == *'begin with'* ]] || { echo 'a header without its first line passed'; failed=1; }
rm -rf "$folder"
exit "$failed"
