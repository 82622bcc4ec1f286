#!/usr/bin/env bash
# run.sh COMPILER INCLUDE EIGEN FOLDER: a program of two files, one for every processor and not optimised, one for this
# machine's. In every order of linking each file gives the bits that it gives alone, and one catches what the other throws.
set -euo pipefail
export LC_ALL=C

compiler=$1 include_dir=$2 eigen=$3 folder=$4
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
mistakes=0
mistake() {
    echo "$1"
    mistakes=$((mistakes + 1))
}
mkdir -p "$folder"
flags=(-std=c++20 -pthread -fopenmp-simd -fno-math-errno -Wno-psabi -w -DFIRN_ALLOW_UNOPTIMISED "-I$include_dir"
    -isystem "$eigen")
if ! "$compiler" --version | grep -q clang; then flags+=(-fno-tree-slp-vectorize); fi

# Options of which each gives the build another name.
build() { echo $'#include <firn/core/build.hpp>\nFIRN_BUILD' | "$compiler" -x c++ -std=c++20 "-I$include_dir" "$@" -E -P - | tail -n 1; }
options=(-O2 -O0 '-O2 -fsanitize=address' '-O2 -D_GLIBCXX_DEBUG' '-O2 -DFIRN_PORTABLE_ROWS')
if "$compiler" -fopenmp -x c++ -E - </dev/null >/dev/null 2>&1; then options+=('-O2 -fopenmp'); fi
for_all=(-O0) for_this=(-O2 -march=native)
if [[ $("$compiler" -dumpmachine) == x86_64* ]]; then
    for_all+=(-march=x86-64)
    for march in x86-64-v2 sandybridge x86-64-v3 'x86-64-v3 -mno-fma' bdver1 knl x86-64-v4 cascadelake icelake-server; do
        options+=("-O2 -march=$march")
    done
fi
names=()
for option in "${options[@]}"; do
    # shellcheck disable=SC2086 # several options
    names+=("$(build $option)")
done
twice=$(printf '%s\n' "${names[@]}" | sort | uniq -d)
[[ -z $twice ]] || mistake "builds of different options have the same name: $twice"
[[ ${names[0]} =~ ^[a-z][a-z0-9_]+$ ]] || mistake "the build is named ${names[0]}"

part() { # NAME OBJECT OPTION...
    "$compiler" "${flags[@]}" "-DPART=$1" "${@:3}" -c "$here/part.cpp" -o "$folder/$2.o"
}
part all all "${for_all[@]}" -DOTHER=native &
part native native "${for_this[@]}"
wait "$!"
printf '#include <cstdint>\n#include <cstdio>\nstd::uint64_t run_of_native();\nint main() { std::printf("%%016llx", static_cast<unsigned long long>(run_of_native())); }\n' \
    >"$folder/alone.cpp"
"$compiler" "${flags[@]}" "$folder/alone.cpp" "$folder/native.o" -o "$folder/alone"
expected=$("$folder/alone")
part all all_alone "${for_all[@]}" -DALONE
"$compiler" -pthread "$folder/all_alone.o" -o "$folder/all_alone"
expected="$("$folder/all_alone") $expected"
for order in 'all native' 'native all'; do
    read -r first second <<<"$order"
    "$compiler" -pthread "$folder/$first.o" "$folder/$second.o" -o "$folder/mixed"
    output=$("$folder/mixed") || mistake "linked in the order $order, the program ends with $?: $output"
    [[ $output == "$expected" ]] || mistake "linked in the order $order: $output; alone: $expected"
done

# No function of firn's is common to both, but those of exceptions.
shared() { nm -C "$folder/$1.o" | sed -n 's/^[0-9a-f ]* [WVu] //p' | sort -u; }
common=$(comm -12 <(shared all) <(shared native) | grep -E '\bfirn' |
    grep -Ev '^(typeinfo|typeinfo name|vtable) for firn::\w*error$|^firn::\w*error::~?\w*error\(' || true)
[[ -z $common ]] || mistake "both files have"$'\n'"$common"

# A function that the other file has for its own build only: the linker names the builds.
printf '#include <firn/core/tensor.hpp>\n%s\n' 'void take(const firn::Vec<float, 2>&) {}' >"$folder/callee.cpp"
printf '#include <firn/core/tensor.hpp>\n%s\n' 'void take(const firn::Vec<float, 2>&);' \
    'int main() { take({1, 2}); }' >"$folder/caller.cpp"
"$compiler" "${flags[@]}" "${for_this[@]}" -c "$folder/callee.cpp" -o "$folder/callee.o"
if output=$("$compiler" "${flags[@]}" "${for_all[@]}" "$folder/caller.cpp" "$folder/callee.o" -o "$folder/calls" 2>&1); then
    mistake 'a function of another build is called'
elif [[ $output != *"take(firn::$(build "${for_all[@]}")::Vec"* ]]; then
    mistake "the linker does not name the build: $output"
fi
exit $((mistakes > 0))
