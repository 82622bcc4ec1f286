#!/usr/bin/env bash
# guide.sh FOLDER: compiles the program of examples/guide/12_webassembly.md in FOLDER, and runs the page's script in node.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
page=$root/examples/guide/12_webassembly.md
mkdir -p "$1"
cd "$1"

block() { # LANGUAGE: prints the page's block of code in this language
    awk -v begin="\`\`\`$1" '$0 == "```" { inside = 0 } inside { print } $0 == begin { inside = 1 }' "$page"
}
block cpp >jelly.cpp
"$root/examples/web/wasm/build.sh" jelly.cpp . -O1 -Wall -Wextra -Werror
block js | sed "s#'./wasm/module.mjs'#'$root/examples/web/wasm/module.mjs'#; s#'/programs/wasm/jelly'#'jelly'#" >jelly.mjs
said=$(node jelly.mjs)
echo "$said"
if [[ $said =~ ^6859\ particles,\ the\ first\ at\ 0\.[0-9]+,\ 0\.[0-9]+,\ 0\.[0-9]+\ m$ ]]; then
    echo '1 passed, 0 failed'
else
    echo '0 passed, 1 failed'
fi
