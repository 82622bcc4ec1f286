#!/usr/bin/env bash
# check_together.sh CLANG FLAGS TOGETHER SOURCE...: clang compiles TOGETHER, which includes every SOURCE, once. Each SOURCE
# is refused as by check.sh: an error is that of the SOURCE which it or its notes point into, or may be anyone's.
set -euo pipefail
export LC_ALL=C

compiler=$1 flags=$2 together=$3
shift 3
failed=0
fail() { # OUTPUT SENTENCE
    printf '%s\n%s\n' "$1" "$2"
    failed=$((failed + 1))
}

if output=$("$compiler" "@$flags" -fsyntax-only -ferror-limit=0 -ftemplate-backtrace-limit=0 "$together" 2>&1); then
    echo "$together compiles, but must not."
    exit 1
fi

# parts_with TEXT [not]: of the parts of the output, each from one error to the next, those that hold TEXT, or do not.
parts_with() {
    awk -v text="$1" -v without="${2:-}" '
        function end() { if ((index(part, text) > 0) != (without == "not")) printf "%s", part; part = "" }
        / error: / { end() }
        !/^ *(In file included )?from / { part = part $0 "\n" }
        END { end() }' <<<"$output"
}

nobodys=$(parts_with "${1%/*}/" not)
for source in "$@"; do
    mapfile -t expected < <(sed -n 's|^// expect: *||p' "$source")
    ((${#expected[@]} > 0)) || { fail '' "$source has no line '// expect: <text>'" && continue; }
    own=$(parts_with "/${source##*/}:")
    errors=$own$nobodys
    if [[ $errors != *' error: '* ]]; then fail '' "$source compiles, but must not." && continue; fi
    for text in "${expected[@]}"; do
        if [[ $errors != *"$text"* ]]; then fail "$errors" "For ${source##*/}, the compiler does not say: $text"; fi
    done
    most=$(sed -n 's|^// errors: *||p' "$source")
    if [[ -n $most ]] && found=$(grep -c ' error: ' <<<"$own") && ((found != most)); then
        fail "$errors" "For ${source##*/}, the compiler reports $found errors, not $most."
    fi
done
((failed == 0))
