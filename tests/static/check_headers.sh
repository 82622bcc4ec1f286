#!/usr/bin/env bash
# check_headers.sh INCLUDE: sizes, layers and namespaces of the headers under INCLUDE/firn; names each mistake.
set -euo pipefail
export LC_ALL=C

max_lines=600

# The layers, lowest first. A header includes its own folder and the folders of the lines above, so folders of one
# line (the families of policies) do not know each other. Contact shares the law of friction with boundary. A header
# outside any folder counts as one of its own name.
# After the colon: which libraries besides Eigen and the standard library a layer may use.
layers='
core       : intrinsics openmp posix
version    :
math       :
simd       : intrinsics
kernel transfer force material boundary field volumetric :
contact    :
data       : posix
sort       :
stage      :
loops wgsl :
lagrangian :
simulation :
implicit soil rigid_body :
adjoint    :
firn       :
io         : hdf5 posix
any        :
any_simulation :
webgpu     : webgpu
mpi        : mpi posix
'

include_dir=$1
declare -A level may_use
number=0
while IFS=: read -r folders libraries; do
    [[ -n ${folders// /} ]] || continue
    number=$((number + 1))
    for folder in $folders; do
        level[$folder]=$number
        may_use[$folder]=" $libraries "
    done
done <<<"$layers"

mistakes=0
mistake() {
    echo "$1"
    mistakes=$((mistakes + 1))
}

# layer_of HEADER: sets layer to its layer: firn/core/tensor.hpp -> core; firn/simulation.hpp -> simulation
layer_of() {
    layer=${1#firn/}
    layer=${layer%%/*}
    layer=${layer%.hpp}
}

uses() { # HEADER LAYER LIBRARY WHERE
    [[ ${may_use[$2]} == *" $3 "* ]] || mistake "$1:$4: the layer $2 may not use $3"
}

cd "$include_dir"
headers=() # of layers that are known
count=0
while IFS= read -r -d '' header; do
    count=$((count + 1))

    mapfile -t text <"$header"
    lines=${#text[@]}
    ((lines <= max_lines)) || mistake "$header: $lines lines, at most $max_lines are allowed"
    [[ ${text[0]:-} == '/// \file '* ]] || mistake "$header:1: begin with /// \\file and what it is for"

    layer_of "$header"
    if [[ -n ${level[$layer]:-} ]]; then
        headers+=("$header")
    else
        mistake "$header: the folder $layer is not in the table of layers"
    fi
done < <(find firn -name '*.hpp' -print0 | sort -z)

# lines_of PATTERN: HEADER:LINE:TEXT of all lines that match; one process for all headers.
lines_of() { ((${#headers[@]} == 0)) || grep -HnE "$1" "${headers[@]}" || true; }

while IFS=: read -r header line text; do
    layer_of "$header"
    own=$layer
    if [[ $text =~ \"(.*)\" ]]; then
        mistake "$header:$line: write #include <${BASH_REMATCH[1]}>, in angle brackets and from firn/ on"
        continue
    fi
    [[ $text =~ \<(.*)\> ]] || continue
    target=${BASH_REMATCH[1]}
    case $target in
        firn/*)
            layer_of "$target"
            if [[ -z ${level[$layer]:-} ]]; then
                mistake "$header:$line: the folder $layer is not in the table of layers"
            elif [[ $layer != "$own" ]] && ((level[$layer] >= level[$own])); then
                mistake "$header:$line: the layer $own may not include <$target>"
            fi
            ;;
        omp.h) uses "$header" "$own" openmp "$line" ;;
        hdf5*.h | H5*.h) uses "$header" "$own" hdf5 "$line" ;;
        webgpu.h | webgpu/*.h) uses "$header" "$own" webgpu "$line" ;;
        mpi.h) uses "$header" "$own" mpi "$line" ;;
        immintrin.h | arm_neon.h) uses "$header" "$own" intrinsics "$line" ;;
        fcntl.h | sched.h | unistd.h | sys/*.h) uses "$header" "$own" posix "$line" ;;
        Eigen/* | unsupported/Eigen/* | math.h | stdlib.h) ;;
        */* | *.h) mistake "$header:$line: <$target> is not in the table of layers" ;;
    esac
done < <(lines_of '^[[:space:]]*#[[:space:]]*include')

while IFS=: read -r header line _; do
    mistake "$header:$line: write namespace firn::inline FIRN_BUILD, see firn/core/build.hpp"
done < <(lines_of '^namespace firn[ :]' | grep -vE 'firn::inline FIRN_BUILD|whatever the build' || true)

# `omp simd` is a promise to the compiler and needs no OpenMP.
while IFS=: read -r header line text; do
    layer_of "$header"
    [[ $text =~ omp[[:space:]]+(simd|declare[[:space:]]+simd) ]] || uses "$header" "$layer" openmp "$line"
done < <(lines_of '^[[:space:]]*#[[:space:]]*pragma[[:space:]]+omp|_Pragma\("omp')

echo "$count headers, $mistakes mistakes"
((count > 0 && mistakes == 0))
