#!/bin/sh
# run_pytest.sh STAGE PATH...: runs pytest, says what is skipped and why, and appends its counts to
# build/results/STAGE.txt.
set -u
stage=$1
shift
results=build/results/$stage
mkdir -p build/results
rm -f "$results.xml"
.venv/bin/pytest -q -rs --junitxml="$results.xml" "$@"
code=$?
sed -n 's/.*<testsuite [^>]*errors="\([0-9]*\)" failures="\([0-9]*\)" skipped="\([0-9]*\)" tests="\([0-9]*\)".*/\4 \1 \2 \3/p' \
    "$results.xml" | awk '{ print $1 - $2 - $3 - $4, $2 + $3, $4 }' >>"$results.txt"
exit $code
