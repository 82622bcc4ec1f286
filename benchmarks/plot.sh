#!/usr/bin/env bash
# benchmarks/plot.sh [RESULTS.json [FOLDER]]: draws benchmarks/plots/*.png from build/benchmarks/results.json. Installs
# matplotlib in a virtual environment under build/ if it is missing.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=python.sh
source "$root/benchmarks/python.sh"
firn_python matplotlib
exec "$python" "$root/benchmarks/plots.py" "$@"
