#!/usr/bin/env bash
# run.sh PROGRAM: runs PROGRAM FOLDER, where FOLDER is a disk of 1 MiB in memory that only this process sees; 77 where
# this machine lets us have none.
set -euo pipefail

own_mounts=(unshare --mount)
if (($(id -u) != 0)); then own_mounts=(unshare --user --map-root-user --mount); fi
folder=$(mktemp -d)
trap 'rmdir "$folder"' EXIT
# shellcheck disable=SC2016 # the inner shell's arguments
disk='mount -t tmpfs -o size=1m none "$0"'

if ! why=$("${own_mounts[@]}" sh -c "$disk" "$folder" 2>&1); then
    echo "Skipped: no small disk can be mounted here (${own_mounts[*]}: $why)."
    exit 77
fi
# shellcheck disable=SC2016
"${own_mounts[@]}" sh -c "$disk"' && exec "$1" "$0"' "$folder" "$1"
