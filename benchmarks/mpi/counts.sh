#!/usr/bin/env bash
# benchmarks/mpi/counts.sh [PROGRAM]: counts the messages of the scenes of benchmarks/README.md and writes them to
# benchmarks/mpi/counts.csv. It takes some minutes on one processor. PROGRAM is firn_mpi_geometry.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
program=${1:-$root/build/benchmarks-release/benchmarks/firn_mpi_geometry}
csv=$root/benchmarks/mpi/counts.csv
new=$(mktemp --suffix=.csv)
rm "$new"
run() { "$program" --csv "$new" "$@" >/dev/null; }

# A million particles a rank: how messages grow with the number of ranks, and with what the particles do. At random
# places the box of a block is the same in all phases.
few=(--phases 1 --random)
run --ranks 2,4,8,16,32,64,128,256,512,1000,4096 --drift every_side
run --ranks 2,4,8,16,32,64,128,256,512,1000,4096 --drift flow "${few[@]}" --turn 0.6
run --ranks 1000 --drift none
run --ranks 1000 --drift flow
run --ranks 1000 --drift flow "${few[@]}"
run --ranks 1000 --drift flow --turn 0.6 --phases 8
for scene in dam layer; do run --ranks 64,1000 --scene "$scene" --drift flow "${few[@]}" --turn 0.6; done
run --ranks 64 --scene spray --drift flow "${few[@]}"
# A thousand million particles on more and more ranks.
for scene in box dam layer; do
    run --particles 1e9 --ranks 64,128,256,512,1024,2048,4096,8192,16384,32768,65536 --scene "$scene" --drift flow \
        "${few[@]}" --turn 0.6
done
mv "$new" "$csv"
chmod 644 "$csv"
