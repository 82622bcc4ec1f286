# Sourced by tests/run.sh, examples/run.sh and benchmarks/run.sh: what firn needs, how to see that it is there, and its
# package on Debian and Ubuntu. There firn_install installs what is missing; elsewhere it says what is and goes on.

# need       package           there if one of these is found
firn_needs='
compiler     g++               compiler
cmake        cmake             command:cmake
ninja        ninja-build       command:ninja
eigen        libeigen3-dev     header:Eigen/Core header:eigen3/Eigen/Core
hdf5         libhdf5-dev       header:hdf5.h header:hdf5/serial/hdf5.h
catch2       catch2            header:catch2/catch.hpp header:catch2/catch_all.hpp
cli11        libcli11-dev      header:CLI/CLI.hpp
png          libpng-dev        header:png.h
boost        libboost-dev      header:boost/version.hpp
lbfgspp      liblbfgspp-dev    header:LBFGS.h
benchmark    libbenchmark-dev  header:benchmark/benchmark.h
clang        clang-19          command:clang++-19
clang_openmp libomp-19-dev     file:/usr/lib/llvm-19/lib/libomp.so
arm_compiler g++-aarch64-linux-gnu command:aarch64-linux-gnu-g++
arm_machine  qemu-user-static  command:qemu-aarch64-static
mpi          libopenmpi-dev    command:mpicxx
mpi_run      openmpi-bin       command:mpiexec
node         nodejs            command:node
npm          npm               command:npm
python       python3           command:python3
doxygen      doxygen           command:doxygen
doxygen_theme doxygen-awesome-css file:/usr/share/doxygen-awesome-css/doxygen-awesome.css
python_venv  python3-venv      command:conan python:ensurepip
pkg_config   pkgconf           command:pkg-config
wasm_linker  lld-19            file:/usr/lib/llvm-19/bin/wasm-ld
wasm_libc    wasi-libc         file:/usr/lib/wasm32-wasi/libc.a
wasm_cxx     libc++-19-dev-wasm32 file:/usr/lib/wasm32-wasi/libc++.a
wasm_cxxabi  libc++abi-19-dev-wasm32 file:/usr/lib/wasm32-wasi/libc++abi.a
wasm_rt      libclang-rt-19-dev-wasm32 file:/usr/lib/llvm-19/lib/clang/19/lib/wasi/libclang_rt.builtins-wasm32.a
clang_rt     libclang-rt-19-dev file:/usr/lib/llvm-19/lib/clang/19/lib/linux/libclang_rt.tsan-x86_64.a
'

# What examples/web/wasm/build.sh needs.
# shellcheck disable=SC2034 # for the scripts that source this file
firn_wasm_needs=(clang wasm_linker wasm_libc wasm_cxx wasm_cxxabi wasm_rt)

firn_compiler_major=12 # g++, at least

firn_major() { "$1" -dumpversion 2>/dev/null | cut -d. -f1; }

firn_is_apt() { command -v apt-get >/dev/null && command -v dpkg-query >/dev/null; }

firn_is_installed() { [[ $(dpkg-query -W -f '${Status}' "$1" 2>/dev/null) == 'install ok installed' ]]; }

# Sets and exports CXX and CC to a g++ that is new enough, unless the user has chosen; fails if there is none.
firn_choose_compiler() {
    [[ -z ${CXX:-} ]] || return 0
    local cxx major
    for cxx in g++ g++-12 g++-13 g++-14 g++-15; do
        major=$(firn_major "$cxx" || true)
        if [[ $major =~ ^[0-9]+$ ]] && ((major >= firn_compiler_major)); then
            export CXX=$cxx CC=${cxx/g++/gcc}
            return 0
        fi
    done
    return 1
}

firn_probe() { # PROBE
    local root
    case $1 in
        compiler) firn_choose_compiler ;;
        command:*) command -v "${1#*:}" >/dev/null ;;
        file:*) [[ -e ${1#*:} ]] ;;
        python:*) python3 -c "import ${1#*:}" 2>/dev/null ;;
        header:*)
            for root in /usr /usr/local /opt/homebrew /opt/local "${CONDA_PREFIX:-}" "${CMAKE_PREFIX_PATH:-}"; do
                [[ ! -e $root/include/${1#*:} ]] || return 0
            done
            return 1
            ;;
    esac
}

# The line of the table for a need, as the words PACKAGE PROBE...
firn_need() {
    awk -v need="$1" '$1 == need { $1 = ""; print; found = 1 } END { exit !found }' <<<"$firn_needs"
}

firn_is_there() { # NEED
    local words package probe
    words=$(firn_need "$1")
    read -r package words <<<"$words"
    for probe in $words; do
        if firn_probe "$probe"; then return 0; fi
    done
    [[ $1 != compiler ]] && firn_is_apt && firn_is_installed "$package"
}

firn_root() { # COMMAND...: as root, through sudo if need be
    if [[ $(id -u) -eq 0 ]]; then
        env DEBIAN_FRONTEND=noninteractive "$@"
    else
        sudo env DEBIAN_FRONTEND=noninteractive "$@"
    fi
}

firn_updated=no
firn_update() {
    [[ $firn_updated == no ]] || return 0
    firn_updated=yes
    firn_root apt-get update -qq
}

firn_candidate() { LC_ALL=C apt-cache policy "$1" 2>/dev/null | awk '/Candidate:/ { print $2 }'; }

# The package of a need; for the compiler the distribution's g++ if new enough, else the one that is.
firn_package() {
    local package candidate
    read -r package _ <<<"$(firn_need "$1")"
    if [[ $1 == compiler ]]; then
        candidate=$(firn_candidate g++)
        candidate=${candidate#*:}
        ((${candidate%%[!0-9]*} >= firn_compiler_major)) 2>/dev/null || package="g++-$firn_compiler_major"
    fi
    echo "$package"
}

firn_missing() { # NEED...: prints those that are not there
    local need
    for need in "$@"; do
        firn_is_there "$need" || echo "$need"
    done
}

firn_install() { # NEED...
    local need missing packages=()
    missing=$(firn_missing "$@")
    if [[ -n $missing ]]; then
        if firn_is_apt && { [[ $(id -u) -eq 0 ]] || command -v sudo >/dev/null; }; then
            firn_update || true
            for need in $missing; do packages+=("$(firn_package "$need")"); done
            echo "Installing ${packages[*]}"
            firn_root apt-get install -qq -y --no-install-recommends "${packages[@]}" >/dev/null ||
                echo "apt-get could not install them; going on with what is here." >&2
        else
            for need in $missing; do packages+=("$(firn_package "$need")"); done
            {
                echo "firn did not find: ${missing//$'\n'/ }"
                echo "Please install them. On Debian and Ubuntu these are the packages: ${packages[*]}"
                echo "Going on, in case they are where only CMake finds them."
            } >&2
        fi
    fi
    firn_choose_compiler || echo "firn needs g++ $firn_compiler_major or clang 19, or later; CXX=... names one." >&2
    if command -v ninja >/dev/null; then export CMAKE_GENERATOR=${CMAKE_GENERATOR:-Ninja}; fi
}

# Installs what the distribution offers and is not there; true if all are there afterwards.
firn_install_if_offered() { # NEED...
    local need missing package packages=()
    missing=$(firn_missing "$@")
    [[ -n $missing ]] || return 0
    firn_is_apt && { [[ $(id -u) -eq 0 ]] || command -v sudo >/dev/null; } || return 1
    firn_update || return 1
    for need in $missing; do
        package=$(firn_package "$need")
        [[ $(firn_candidate "$package") =~ ^[0-9] ]] || return 1
        packages+=("$package")
    done
    echo "Installing ${packages[*]}"
    firn_root apt-get install -qq -y --no-install-recommends "${packages[@]}" >/dev/null
}

firn_jobs() { echo "${FIRN_JOBS:-$(nproc 2>/dev/null || getconf _NPROCESSORS_ONLN)}"; }
