#!/usr/bin/env bash
# check_readme.sh ROOT: the first C++ block of the README is examples/01_hello.cpp, at most 25 lines.
set -euo pipefail

root=$1
hello=$root/examples/01_hello.cpp
awk '/^```(cpp|c\+\+)/ { inside = 1; next } /^```/ { if (inside) exit } inside' "$root/README.md" | diff -u - "$hello"
lines=$(wc -l <"$hello")
((lines <= 25)) || { echo "01_hello.cpp has $lines lines, at most 25 are allowed"; exit 1; }
