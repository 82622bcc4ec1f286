#!/usr/bin/env bash
# run.sh ROUNDS PROGRAM MPIEXEC...: starts PROGRAM on 4 ranks by `MPIEXEC... 4` ROUNDS times, which writes states, and
# kills a random rank at a random time. All states of the series must be whole, and none that was written may be
# missing. Then fills a small disk in memory, where this machine lets us have one.
set -euo pipefail

rounds=$1
program=$2
shift 2
mpiexec=("$@")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mistakes=0

begin() { # empties the folder
    rm -rf "${folder:?}"/* && mkdir "$folder/processes"
}

for ((round = 1; round <= rounds; ++round)); do
    begin
    "${mpiexec[@]}" 4 "$program" write "$folder" >"$folder/said" 2>&1 &
    started=$!
    for ((tries = 0; tries < 300; ++tries)); do # until a state is written
        [[ -s $folder/written ]] && break
        sleep 0.1
    done
    sleep "$((RANDOM % 2)).$(printf '%03d' $((RANDOM % 1000)))"
    victims=("$folder"/processes/*)
    kill -9 "$(basename "${victims[RANDOM % ${#victims[@]}]}")"
    start=$(date +%s%N)
    code=0
    wait "$started" || code=$?
    took=$((($(date +%s%N) - start) / 1000000))
    found=$("$program" check "$folder" 2>&1) || mistakes=$((mistakes + 1))
    left=$(find "$folder" -name '*.tmp.*' | wc -l)
    echo "kill $round: ended after $took ms with $code; $found; $left temporary files"
    ((code != 0 && took < 5000)) || mistakes=$((mistakes + 1))
done

begin
own_mounts=(unshare --mount)
if (($(id -u) != 0)); then own_mounts=(unshare --user --map-root-user --mount); fi
# shellcheck disable=SC2016 # the inner shell's arguments
disk='mount -t tmpfs -o size=20m none "$0" && mkdir "$0/processes"'
if why=$("${own_mounts[@]}" sh -c "$disk" "$folder" 2>&1); then
    # shellcheck disable=SC2016
    said=$("${own_mounts[@]}" sh -c "$disk"' && program=$1 && shift && exec "$@" 3 "$program" fill "$0"' "$folder" "$program" \
        "${mpiexec[@]}" 2>&1) || mistakes=$((mistakes + 1))
    echo "$said"
    grep -q 'on all ranks: .*No space left on device' <<<"$said" && grep -q '^written again' <<<"$said" ||
        mistakes=$((mistakes + 1))
else
    echo "No small disk can be mounted here (${own_mounts[*]}: $why): not filled."
fi

echo "$mistakes mistakes"
((mistakes == 0))
