#!/bin/sh
# run_stages.sh STAGE...: runs stages of the tests and ends with "N passed, N failed, N skipped".
#
# A stage is a target of the Makefile. For each program that it runs it appends one line
# "PASSED FAILED SKIPPED" to build/results/STAGE.txt; programs that print Unity's text are run
# through tools/run_unity.sh, which does that. A stage that fails without having counted a failure
# (it crashed, it did not build), or that has counted nothing, counts as one failure.
set -u
cd "$(dirname "$0")/.." || exit 1
rm -rf build/results
mkdir -p build/results
for stage in "$@"; do
    echo "== $stage"
    counts=build/results/$stage.txt
    "${MAKE:-make}" --no-print-directory "$stage"
    code=$?
    touch "$counts"
    awk -v code=$code '{ ran += $1 + $2 + $3; failed += $2 } END { exit !(ran && (failed || !code)) }' \
        "$counts" && continue
    echo "$stage: ended with code $code and without a test that says why"
    echo "0 1 0" >>"$counts"
done
awk '{ p += $1; f += $2; s += $3 }
     END { printf "%d passed, %d failed, %d skipped\n", p, f, s; exit f > 0 || p == 0 }' \
    build/results/*.txt
