#!/usr/bin/env bash
# example.sh PROGRAM MPIEXEC...: runs the example 18_many_machines on one rank, on three, and on three and then two. All
# write the same bytes.
set -euo pipefail

program=$1
shift
mpiexec=("$@")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
options=(--particles 4000 --threads 1)
whole=("${options[@]}" --steps 300 --frames 3)

"$program" "${whole[@]}" --output "$folder/one"
"${mpiexec[@]}" 3 "$program" "${whole[@]}" --output "$folder/three"
"${mpiexec[@]}" 3 "$program" "${options[@]}" --steps 100 --frames 1 --output "$folder/parts"
"${mpiexec[@]}" 2 "$program" "${whole[@]}" --go-on --output "$folder/parts"
ls "$folder/one"
diff -r "$folder/one" "$folder/three"
diff -r "$folder/one" "$folder/parts"

# What cannot be is said once, not by each rank.
if "${mpiexec[@]}" 3 "$program" "${whole[@]}" --viscosity 2 --go-on --output "$folder/parts" >"$folder/said" 2>&1; then
    echo 'a run with another viscosity went on from this one'
    exit 1
fi
cat "$folder/said"
[[ $(grep -c 'has viscosity = 0, that of this run has 2' "$folder/said") -eq 1 ]]
