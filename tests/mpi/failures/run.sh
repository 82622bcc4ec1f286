#!/usr/bin/env bash
# run.sh PROGRAM MPIEXEC...: runs PROGRAM by `MPIEXEC... RANKS` and makes one rank fail in several ways. Each time all
# ranks must end within 5 s, with one message that names the rank, and with an exit code that is not 0.
set -euo pipefail

program=$1
shift
mpiexec=("$@")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mistakes=0

mistake() { # TEXT
    echo "Not so: $1"
    sed 's/^/    /' "$folder/said"
    mistakes=$((mistakes + 1))
}

# started COMMAND...: runs the command for at most 20 s; its processes are in $folder/processes. Sets status, and seconds until all processes have ended; kills
# those that have not after 10 s. What they print is in $folder/said.
started() {
    local start tries
    start=$(date +%s%N)
    status=0
    rm -rf "$folder/processes" && mkdir "$folder/processes"
    timeout -k 5 20 "$@" >"$folder/said" 2>&1 || status=$?
    for ((tries = 0; tries < 100; ++tries)); do
        [[ -n $(alive) ]] || break
        sleep 0.1
    done
    seconds=$(((($(date +%s%N) - start) / 100000000)))
    seconds=$((seconds / 10)).$((seconds % 10))
    # shellcheck disable=SC2046 # several processes
    kill -9 $(alive) 2>/dev/null || true
}

# alive: the started processes that run; not those that have ended and that nobody has asked about.
alive() {
    local process
    for process in $(ls "$folder/processes"); do
        [[ $(ps -o stat= -p "$process" || true) == [!Z]* ]] && echo "$process"
    done
    return 0
}

# fails TITLE RANKS MESSAGE ARGUMENT...: with several ranks. MESSAGE is a regular expression of a line that is printed
# once.
fails() {
    local title=$1 ranks=$2 message=$3 times
    shift 3
    started "${mpiexec[@]}" "$ranks" "$program" "$@" "$folder/processes"
    printf '%-45s ended after %s s with %d: %s\n' "$title" "$seconds" "$status" \
        "$(grep -E "$message" "$folder/said" | head -n 1 || true)"
    [[ $(ls "$folder/processes" | wc -l) -eq $ranks ]] || mistake "$title: $ranks ranks have begun"
    ((status != 0 && status != 124)) || mistake "$title: the exit code says that it failed"
    ((${seconds%.*} < 5)) || mistake "$title: all ranks end within 5 s"
    times=$(grep -cE "$message" "$folder/said" || true)
    [[ $times -eq 1 ]] || mistake "$title: $times lines are '$message', not one"
}

for rank in 0 2; do
    fails "rank $rank throws" 4 "^firn: rank $rank of 4: This rank gives up\\.$" throw "$rank"
done
fails 'a rank throws what is no std::exception' 3 '^firn: rank 1 of 3: an exception that is no std::exception' \
    throw_other 1
fails 'a thread of a rank throws' 3 '^firn: rank 1 of 3: A thread gives up\.$' throw_in_thread 1
fails 'a rank calls Session::fail()' 3 '^firn: rank 1 of 3: This rank cannot go on\.$' fail 1
for how in together together_late; do
    fails "all ranks throw $how" 4 '^firn: All ranks agree\.$' "$how" 3
    ! grep -q '^firn: rank' "$folder/said" || mistake "all ranks throw $how: only one message"
done
grep -q '^Rank 0 comes last' "$folder/said" || mistake 'all ranks throw together_late: the others wait for rank 0'
# These lines are mpiexec's.
fails 'a rank is killed' 4 '(rank 2 .*signal 9|Killed \(signal 9\))' kill 2
fails 'a rank crashes' 4 '(rank 2 .*signal 11|Segmentation fault \(signal 11\))' crash 2

started "${mpiexec[@]}" 3 "$program" nothing 0 "$folder/processes"
((status == 0)) && grep -q '^3 ranks, sum 3$' "$folder/said" || mistake 'three ranks end well'

# Without mpiexec.
started "$program" nothing 0 "$folder/processes"
((status == 0)) && grep -q '^1 ranks, sum 1$' "$folder/said" || mistake 'without mpiexec there is one rank'
started "$program" throw 0 "$folder/processes"
((status != 0 && status != 124)) && [[ $(grep -c '^firn: rank 0 of 1: This rank gives up\.$' "$folder/said") -eq 1 ]] ||
    mistake 'without mpiexec an exception is printed, and the exit code says that it failed'
started "$program" no_session
((status == 3)) && grep -q 'Make a firn::mpi::Session in main()' "$folder/said" ||
    mistake 'without a session a communicator is refused'

((mistakes == 0)) && echo 'all so'
