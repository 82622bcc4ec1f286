#!/usr/bin/env bash
# check_extern_template.sh COMPILER FLAGS NM SOURCE FOLDER OPTION...: where a program says that another of its files
# compiles its simulation, no stage is compiled again, with each of the options. A copy that is planted must be found.
# FLAGS is a response file.
set -euo pipefail

compiler=$1 flags=$2 nm=$3 source=$4 folder=$5
shift 5
mkdir -p "$folder"

# stages OPTION...: the functions of P2G, G2P and sorting in the object file.
stages() {
    "$compiler" "@$flags" -fno-sanitize=all "$@" -c "$source" -o "$folder/extern_template.o"
    "$nm" -C --defined-only "$folder/extern_template.o" | grep -E 'scatter_coloured|GroupUpdate|partition_places' || true
}

bad=0
for optimisation in "$@"; do
    found=$(stages "$optimisation")
    if [[ $found ]]; then
        printf 'Compiled again (%s):\n%s\n' "$optimisation" "${found:0:1000}"
        bad=1
    fi
done
planted=$(stages -O0 -DFIRN_PLANT_COPY)
for stage in scatter_coloured GroupUpdate partition_places; do
    if [[ $planted != *$stage* ]]; then
        echo "A copy of $stage (-DFIRN_PLANT_COPY) was not found."
        bad=1
    fi
done
exit "$bad"
