#!/usr/bin/env bash
# examples/python/test.sh [FOLDER [OPTION...]]: installs the module, with these options of pip, in a virtual environment
# in FOLDER, by default build/python, and runs its tests. It compiles for some minutes the first time. 77 without Python
# or without a way to its packages. With `-C cmake.define.FIRN_PYTHON_OWN=own.hpp` a material and a solid of one's own
# are tested, too.
# FIRN_PYTHON names another Python than python3; FIRN_SCENE the program 27_scene, whose bits are then compared.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
python=${FIRN_PYTHON:-python3}
folder=${1:-$root/build/python}
shift || true
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
if ! command -v "$python" >/dev/null || ! "$python" -m venv "$folder/venv"; then
    echo "Skipped: there is no $python with venv."
    exit 77
fi
if ! "$folder/venv/bin/pip" install --quiet numpy pytest mypy nanobind scikit-build-core; then
    echo "Skipped: pip cannot install numpy, pytest, mypy, nanobind and scikit-build-core."
    exit 77
fi
# Without a new environment of pip for each call, what is compiled is kept.
"$folder/venv/bin/pip" install --no-build-isolation -C build-dir="$folder/objects" "$@" "$here"
scene=$root/build/examples/27_scene
if [[ -z ${FIRN_SCENE-} && -x $scene ]]; then export FIRN_SCENE=$scene; fi
# From the folder, so that `import firn` is what was installed.
cd "$folder"
PYTHONDONTWRITEBYTECODE=1 "$folder/venv/bin/python" -m pytest -q -p no:cacheprovider "$here/test_firn.py"
exec "$folder/venv/bin/python" -m mypy --cache-dir="$folder/mypy" -p firn
