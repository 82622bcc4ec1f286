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
implicit soil :
adjoint    :
firn       :
io         : hdf5 posix
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

# firn/core/tensor.hpp -> core; firn/simulation.hpp -> simulation
layer_of() {
    local path=${1#firn/}
    path=${path%%/*}
    echo "${path%.hpp}"
}

uses() { # HEADER LAYER LIBRARY WHERE
    [[ ${may_use[$2]} == *" $3 "* ]] || mistake "$1:$4: the layer $2 may not use $3"
}

count=0
while IFS= read -r -d '' file; do
    header=${file#"$include_dir"/}
    count=$((count + 1))

    lines=$(wc -l <"$file")
    ((lines <= max_lines)) || mistake "$header: $lines lines, at most $max_lines are allowed"
    [[ $(head -n 1 "$file") == '/// \file '* ]] || mistake "$header:1: begin with /// \\file and what it is for"

    own=$(layer_of "$header")
    if [[ -z ${level[$own]:-} ]]; then
        mistake "$header: the folder $own is not in the table of layers"
        continue
    fi

    while IFS=: read -r line text; do
        if [[ $text =~ \"(.*)\" ]]; then
            mistake "$header:$line: write #include <${BASH_REMATCH[1]}>, in angle brackets and from firn/ on"
            continue
        fi
        [[ $text =~ \<(.*)\> ]] || continue
        target=${BASH_REMATCH[1]}
        case $target in
            firn/*)
                other=$(layer_of "$target")
                if [[ -z ${level[$other]:-} ]]; then
                    mistake "$header:$line: the folder $other is not in the table of layers"
                elif [[ $other != "$own" ]] && ((level[$other] >= level[$own])); then
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
    done < <(grep -nE '^[[:space:]]*#[[:space:]]*include' "$file" || true)

    while IFS=: read -r line _; do
        mistake "$header:$line: write namespace firn::inline FIRN_BUILD, see firn/core/build.hpp"
    done < <(grep -nE '^namespace firn[ :]' "$file" | grep -vE 'firn::inline FIRN_BUILD|whatever the build' || true)

    # `omp simd` is a promise to the compiler and needs no OpenMP.
    while IFS=: read -r line text; do
        [[ $text =~ omp[[:space:]]+(simd|declare[[:space:]]+simd) ]] || uses "$header" "$own" openmp "$line"
    done < <(grep -nE '^[[:space:]]*#[[:space:]]*pragma[[:space:]]+omp|_Pragma\("omp' "$file" || true)
done < <(find "$include_dir/firn" -name '*.hpp' -print0 | sort -z)

echo "$count headers, $mistakes mistakes"
((count > 0 && mistakes == 0))
