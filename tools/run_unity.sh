#!/bin/sh
# run_unity.sh STAGE NAME COMMAND...: runs a test program, native or in an emulator, that ends with
# Unity's "N Tests N Failures N Ignored". Appends its counts to build/results/STAGE.txt and prints
# one line, or all that it said when it failed. A crash counts as one failure.
set -u
stage=$1
name=$2
shift 2
log=build/results/$stage/$name.log
mkdir -p "$(dirname "$log")"
"$@" >"$log" 2>&1 </dev/null
code=$?
# shellcheck disable=SC2046 # three numbers: passed, failed, skipped
set -- $(awk '/^[0-9]+ Tests [0-9]+ Failures [0-9]+ Ignored/ { print $1 - $3 - $5, $3, $5 }' "$log")
if [ $# -ne 3 ] || { [ "$2" -eq 0 ] && [ "$code" -ne 0 ]; }; then
    set -- 0 1 0
fi
echo "$*" >>"build/results/$stage.txt"
if [ "$2" -eq 0 ]; then
    echo "$name: $1 passed, $3 skipped"
else
    cat "$log"
    echo "$name: $2 failed, exit code $code"
    exit 1
fi
