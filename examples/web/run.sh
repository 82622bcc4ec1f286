#!/usr/bin/env bash
# examples/web/run.sh [PORT]: installs missing packages, writes the WGSL programs to build/web, and serves the page that
# runs them on http://127.0.0.1:PORT (default 8000). /particles.html there runs a WebAssembly module, which clang 19
# compiles if apt offers it.
set -euo pipefail

port=${1:-8000}
if [[ ! $port =~ ^[0-9]+$ ]] || ((10#$port > 65535)); then
    echo "The port is $port; it must be a whole number from 0 (any free port) to 65535." >&2
    exit 2
fi
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
# shellcheck source=../../cmake/packages.sh
source "$root/cmake/packages.sh"

firn_install compiler cmake ninja eigen hdf5 cli11 png boost node

build=$root/build
options=(-DCMAKE_BUILD_TYPE=Release -DFIRN_BUILD_EXAMPLES=ON -DFIRN_WARNINGS_AS_ERRORS=OFF)
if [[ ! -e $build/CMakeCache.txt ]]; then options+=(-DFIRN_BUILD_TESTS=OFF); fi
cmake -S "$root" -B "$build" "${options[@]}"
cmake --build "$build" --parallel "$(firn_jobs)" --target 06_emit_wgsl
"$build/examples/06_emit_wgsl" --all "$build/web"
if firn_install_if_offered "${firn_wasm_needs[@]}"; then
    "$root/examples/web/wasm/build.sh" "$root/examples/web/particles.cpp" "$build/web/wasm" "-I$root/examples"
else
    echo 'The page particles.html is left out: it needs clang 19 and its packages for wasm32.' >&2
fi
exec node "$root/examples/web/serve.mjs" "$port" "$build/web"
