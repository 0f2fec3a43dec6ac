#!/bin/sh
# A whole blind trial: deal, answer, open. Usage: tools/blind.sh FOLDER [CASES [SEED]]
set -eu
madelung="$(dirname "$0")/../.venv/bin/madelung"
folder=$1
cases=${2:-60}
seed=${3:+--seed $3}
rm -rf "$folder" "$folder.key"
mkdir -p "$(dirname "$folder")"
echo "== $cases cases dealt, labels sealed:"
# shellcheck disable=SC2086 # the seed is an option and its value, or nothing
"$madelung" blind deal -o "$folder" --cases "$cases" --left-out "$((cases / 10))" --rows 8000 $seed \
    --key-file "$folder.key"
echo "== Answered, by processes that see the cases alone:"
"$madelung" blind answer "$folder"
echo "== Opened:"
"$madelung" blind open "$folder" --key "$folder.key"
