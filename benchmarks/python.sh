# Sourced: firn_python PACKAGE... sets `python` to a Python 3 that has the packages, from a virtual environment under
# build/ if the system's has not. Needs $root.
firn_python() {
    local package missing=no
    python=python3
    for package in "$@"; do
        "$python" -c "import $package" 2>/dev/null || missing=yes
    done
    if [[ $missing == no ]]; then return 0; fi
    python=$root/build/benchmarks/python/bin/python
    if [[ ! -x $python ]]; then python3 -m venv "$root/build/benchmarks/python"; fi
    "$python" -m pip install --quiet --disable-pip-version-check "$@"
}
