#!/bin/sh
# Simulates a stage, identifies it from slow loops and predicts another record: demo.sh FOLDER
set -eu
out=$1
madelung=.venv/bin/madelung
mkdir -p "$out"
$madelung simulate --seconds 40 --seed 1 -o "$out/identify.csv" >/dev/null
# At this rate every corner of the command is a sample.
$madelung simulate --waveform decaying --hz 0.25 --rate 210 --seconds 30.5 --seed 2 -o "$out/measured.csv" >/dev/null
echo
echo "== Identified from four slow triangles:"
$madelung identify "$out/identify.csv" -o "$out/model.json" --plot "$out/identify.png"
echo
echo "== Predicted, in the firmware's arithmetic, a command of nested triangles:"
$madelung predict "$out/model.json" "$out/measured.csv" -o "$out/predicted.csv" --plot "$out/predict.png"
echo
echo "Files are in $out: identify.csv and measured.csv (simulated), model.json, predicted.csv,"
echo "identify.png, predict.png. The command is .venv/bin/madelung; try it with --help."
