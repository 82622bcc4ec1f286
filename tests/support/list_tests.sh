#!/usr/bin/env bash
# list_tests.sh PROGRAM LABEL CATCH_MAJOR OUTPUT [WHICH]: writes the file by which CTest knows each test case of PROGRAM,
# or those that Catch's test specification WHICH selects.
# (Catch's own CMake module splits a name at its semicolons.)
set -euo pipefail

program=$1 label=$2 catch_major=$3 output=$4 which=${5:-}
if ((catch_major >= 3)); then
    list=(--list-tests --verbosity quiet) unmatched=UnmatchedTestSpec none_is_fine='--allow-running-no-tests'
else
    list=(--list-test-names-only) unmatched=NoTests none_is_fine=''
fi

names=$("$program" "${list[@]}" ${which:+"$which"} || true) # version 2 returns the number of tests
[[ -n $names ]] || { echo "$program lists no tests" >&2; exit 1; }

title=${program##*/}
# What Catch's test specification would read as more than a letter gets a backslash.
paste -d '\n' <(printf '%s\n' "$names") <(sed 's/[][\\,"~]/\\&/g' <<<"$names") | while IFS= read -r name; do
    IFS= read -r pattern
    printf 'add_test([==[%s: %s]==] [==[%s]==] [==[%s]==] --warn %s)\n' \
        "$title" "$name" "$program" "$pattern" "$unmatched"
    printf 'set_tests_properties([==[%s: %s]==] PROPERTIES LABELS %s TIMEOUT 600)\n' "$title" "$name" "$label"
done >"$output"

cat >>"$output" <<END
if(CTEST_CONFIGURATION_TYPE STREQUAL "Full")
    add_test([==[$title: the long tests]==] [==[$program]==] [.full] $none_is_fine)
    set_tests_properties([==[$title: the long tests]==] PROPERTIES LABELS full TIMEOUT 3600)
endif()
END
