#!/usr/bin/env bash
# run.sh FOLDER EIGEN: in the empty FOLDER, makes firn's Conan package and a program that requires it. EIGEN is where the
# machine's Eigen lies; it takes the place of Conan's, so that nothing is fetched. Without Conan, pip is asked for it; if
# that fails, the test is skipped (77).
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
folder=$1
export FIRN_EIGEN_INCLUDE=$2 CONAN_HOME=$folder/home
rm -rf "$folder"
mkdir -p "$folder/program"
conan=$(command -v conan) || conan=$folder/venv/bin/conan
if [[ ! -x $conan ]] && ! { python3 -m venv "$folder/venv" && "$folder/venv/bin/pip" install -q conan; } >&2; then
    echo "skipped: Conan is not here, and pip cannot install it"
    exit 77
fi
cp "$here/../"{main,other}.cpp "$folder"
cp "$here"/{conanfile.py,CMakeLists.txt} "$folder/program"
"$conan" profile detect
"$conan" create "$here/eigen"
"$conan" create "$here/../../../cmake/conan" --no-remote -s compiler.cppstd=20 --test-folder="$folder/program"
