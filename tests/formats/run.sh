#!/usr/bin/env bash
# run.sh PROGRAM FOLDER: PROGRAM writes to FOLDER, and check.py opens what it has written; 77 without Python or one of its
# packages. FIRN_PYTHON names another Python than python3, such as that of a virtual environment.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
python=${FIRN_PYTHON:-python3}
if ! command -v "$python" >/dev/null; then
    echo "Skipped: there is no $python."
    exit 77
fi
rm -rf "$2"
mkdir -p "$2"
"$1" "$2"
exec "$python" "$here/check.py" "$2"
