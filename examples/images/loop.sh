#!/usr/bin/env bash
# examples/images/loop.sh FILM.mp4 LOOP.webp [WIDTH [RATE [QUALITY]]]: makes a loop for a README of a film that an
# example has written with --film: an animated WebP of at most 1 MB, WIDTH pixels wide, with RATE pictures per second.
# It needs ffmpeg.
set -euo pipefail

if (($# < 2)); then
    echo "usage: examples/images/loop.sh FILM.mp4 LOOP.webp [WIDTH [RATE [QUALITY]]]" >&2
    exit 2
fi
film=$1 loop=$2 width=${3:-480} rate=${4:-15} quality=${5:-70}
ffmpeg -nostdin -y -loglevel error -i "file:$film" -vf "fps=$rate,scale=$width:-2:flags=lanczos" \
    -c:v libwebp_anim -quality "$quality" -compression_level 6 -loop 0 "file:$loop"
bytes=$(wc -c <"$loop")
echo "$loop: $bytes bytes"
if ((bytes > 1000000)); then
    echo "$loop has more than 1 MB; give a smaller WIDTH, RATE or QUALITY" >&2
    exit 1
fi
