#!/usr/bin/env bash
# check.sh COMPILER FLAGS SOURCE GOOD: the compiler refuses SOURCE, and its output holds the text of each line
# `// expect: <text>`; with a line `// errors: N` it holds N errors and no more. If GOOD is 1, SOURCE compiles with
# -DFIRN_GOOD.
set -euo pipefail
export LC_ALL=C

compiler=$1 flags=$2 source=$3 good=$4
compile() { "$compiler" "@$flags" "$@" -fsyntax-only "$source" 2>&1; } # which instantiates templates, too

mapfile -t expected < <(sed -n 's|^// expect: *||p' "$source")
((${#expected[@]} > 0)) || { echo "$source has no line '// expect: <text>'"; exit 1; }

if ((good)) && ! output=$(compile -DFIRN_GOOD); then
    printf '%s\nThe good half of %s does not compile.\n' "$output" "$source"
    exit 1
fi
if output=$(compile); then
    echo "$source compiles, but must not."
    exit 1
fi
for text in "${expected[@]}"; do
    if [[ $output != *"$text"* ]]; then
        printf '%s\nThe compiler does not say: %s\n' "$output" "$text"
        exit 1
    fi
done
most=$(sed -n 's|^// errors: *||p' "$source")
if [[ -n $most ]] && found=$(grep -c ' error: ' <<<"$output") && ((found != most)); then
    printf '%s\nThe compiler reports %s errors, not %s.\n' "$output" "$found" "$most"
    exit 1
fi
