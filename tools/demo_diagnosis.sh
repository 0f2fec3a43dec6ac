#!/bin/sh
# Draws a cause at random, seals it, diagnoses the stage, then unseals the cause: FOLDER [SEED]
set -eu
out=$1
seed=${2:-$(od -An -N2 -tu2 /dev/urandom | tr -d ' ')}
madelung=.venv/bin/madelung
rm -rf "$out/case" "$out/case.sealed.json" "$out/case.labels.json" "$out/diagnosis"
mkdir -p "$out"
echo
echo "== A stage with one cause that nobody has been told (seed $seed), diagnosed:"
said=$($madelung simulate --case "$out/case" --effect random --campaign short --seal --seed "$seed")
$madelung diagnose "$out/case" -o "$out/diagnosis"
echo
echo "== Unsealed:"
$madelung unseal "$out/case.sealed.json" "${said##*: }" -o "$out/case.labels.json" --diagnosis "$out/diagnosis"
echo
echo "The report is $out/diagnosis/report.html, the whole diagnosis diagnosis.json beside it; the labels"
echo "are in $out/case.labels.json."
