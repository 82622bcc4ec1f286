#!/usr/bin/env bash
# check_readme.sh ROOT COMPILER: a block of the README below <!-- FILE --> is that file, the first examples/01_hello.cpp,
# at most 25 lines; links to files lead somewhere; and the command of the README that compiles a program without CMake
# compiles that one, with states. If COMPILER is not the command's (g++), the command is left out.
set -euo pipefail

root=$(cd "$1" && pwd) compiler=$2
mistakes=0
mapfile -t files < <(sed -n 's/^<!-- \(.*\) -->$/\1/p' "$root/README.md")
for file in "${files[@]}"; do
    awk -v mark="<!-- $file -->" '$0 == mark { wanted = 1; next } /^```/ { if (inside) exit; inside = wanted; next } inside' \
        "$root/README.md" | diff -u - "$root/$file" || mistakes=$((mistakes + 1))
done
[[ ${files[0]:-} == examples/01_hello.cpp ]] || { echo "the README shows ${files[*]}"; mistakes=$((mistakes + 1)); }
lines=$(wc -l <"$root/examples/01_hello.cpp")
((lines <= 25)) || { echo "01_hello.cpp has $lines lines, at most 25 are allowed"; mistakes=$((mistakes + 1)); }

# Links of our own texts to files of ours.
shopt -s nullglob
for text in "$root"/README.md "$root"/.github/*.md "$root"/examples/guide/* "$root"/benchmarks/README.md \
    "$root"/benchmarks/verification/README.md; do
    while read -r link; do
        [[ $link == http* || -e $(dirname "$text")/$link ]] && continue
        echo "${text#"$root"/} links to $link, which is not there"
        mistakes=$((mistakes + 1))
    done < <(grep -oE '\]\([A-Za-z./][^() ]*\.(md|[ch]pp|png)\)' "$text" | sed 's/^](//; s/)$//')
done

if "$compiler" --version | grep -q 'Free Software Foundation' && pkg-config --exists hdf5; then
    folder=$(mktemp -d)
    trap 'rm -rf "$folder"' EXIT
    ln -s "$root/include" "$root/examples" "$folder/" # the command is given in the folder of firn
    command=$(sed -n 's/^    g++ \(.*hello.cpp.*\)$/\1/p' "$root/README.md")
    # Not optimised, which is quicker; it says so, in its first line, and is stopped at once.
    command=${command/-O3 -march=native/-O0}
    if ! (cd "$folder" && eval "$compiler -Wall -Werror $command") || [[ ! -x $folder/hello ]]; then
        echo "the README's command does not compile: $command"
        mistakes=$((mistakes + 1))
    elif ! (cd "$folder" && timeout 2 ./hello 2>&1 || true) | grep -q 'compiled without optimisation'; then
        echo "the program does not say that it is not optimised"
        mistakes=$((mistakes + 1))
    fi
fi
exit $((mistakes > 0))
