#!/usr/bin/env bash
# check_see.sh INCLUDE: every name after a \see in the headers under INCLUDE/firn is there: a header, a name of the code,
# or A::b, of which b is in a header that defines A or its base. Several names are separated by commas.
set -euo pipefail
export LC_ALL=C
cd "$1"

find firn -name '*.hpp' | sort | xargs awk '
    FNR == 1 {
        headers[FILENAME]
        base = FILENAME
        sub(/.*\//, "", base)
        headers[base]
    }
    {
        code = $0
        if (match(code, /\\see [^`]*/)) {
            places[++count] = FILENAME ":" FNR
            wanted[count] = substr(code, RSTART + 5, RLENGTH - 5)
            # A list goes on in the next line.
            open = wanted[count] ~ /,$/
        } else if (open) {
            sub(/^ *\/\/\/ */, "", code)
            wanted[count] = wanted[count] " " code
            open = code ~ /,$/
        }
        code = $0
        gsub(/"([^"\\]|\\.)*"/, " ", code)
        sub(/\/\/.*/, "", code)
        before = ""
        while (match(code, /[A-Za-z_][A-Za-z_0-9]*/)) {
            word = substr(code, RSTART, RLENGTH)
            named[word]
            of[FILENAME, word]
            if (before ~ /^(struct|class|enum|union|concept|using|namespace|inline|FIRN_BUILD)$/)
                definers[word] = definers[word] " " FILENAME
            if (word ~ /^(struct|class)$/) owner = ""
            else if (before ~ /^(struct|class)$/) owner = word
            else if (before == "public" && owner != "") bases[owner] = bases[owner] " " word
            before = word
            code = substr(code, RSTART + RLENGTH)
        }
    }
    function is_member(name, of_what,    files, i) {
        split(definers[of_what], files, " ")
        for (i in files)
            if ((files[i], name) in of) return 1
        split(bases[of_what], files, " ")
        for (i in files)
            if (is_member(name, files[i])) return 1
        return 0
    }
    function is_there(name,    parts, n) {
        if (name ~ /\.hpp$/) return name in headers || ("firn/" name) in headers
        n = split(name, parts, "::")
        return n == 1 ? name in named : is_member(parts[n], parts[n - 1])
    }
    END {
        for (k = 1; k <= count; ++k) {
            rest = wanted[k]
            do {
                sub(/^,? */, "", rest)
                if (!match(rest, /^[A-Za-z_0-9\/:]+(\.hpp)?/)) {
                    print places[k] ": \\see needs a name at: " rest
                    ++mistakes
                    break
                }
                name = substr(rest, 1, RLENGTH)
                rest = substr(rest, RLENGTH + 1)
                sub(/^\([^)]*\)/, "", rest)
                if (!is_there(name)) {
                    print places[k] ": \\see " name ": there is no such name"
                    ++mistakes
                }
                ++names
            } while (rest ~ /^, *[A-Za-z_0-9\/:]+(\(\)|\.hpp)?( *,|\.?$)/)
        }
        print names + 0 " names after \\see, " mistakes + 0 " mistakes"
        exit !(names > 0 && mistakes == 0)
    }'
