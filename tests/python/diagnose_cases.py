"""Small cases for the tests of the diagnosis, and how it is run on them."""

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from madelung import cli
from madelung.campaigns import Commands
from madelung.diagnosis.case import load_case
from madelung.diagnosis.diagnose import Options, diagnose
from madelung.stage import Stage, make_case
from madelung.waveforms import Command, Waveform

STAGE = Stage(noise_um=0.01, headroom_share=0.6)


def commands(stage: Stage = STAGE) -> Commands:
    """Half a minute of everything: fast and slow, steps, minor loops, a start at a bias."""
    low, width = stage.u_min_V, stage.range_V

    def within(a: float, b: float, command: Command) -> Command:
        return replace(command, u_min_V=low + a * width, u_max_V=low + b * width)

    fast = Command(Waveform.MULTISINE, 2.0, 1000.0, hz=1.0, band_hz=(1.0, 60.0), seed=1)
    steps = Command(Waveform.STEPS, 6.0, 500.0, dwell_s=1.0, rise_s=0.004, seed=2)
    return {
        "identify": within(0.0, 1.0, Command(hz=0.2, seconds=15.0)),
        "train/bias": within(0.3, 0.75, Command(Waveform.SINES, 4.0, 250.0, lines_hz=(0.5, 1.5))),
        "train/decaying": within(0.0, 1.0, Command(Waveform.DECAYING, 6.0, 200.0, hz=1.0)),
        "train/multisine": within(0.1, 0.9, fast),
        "train/steps": within(0.1, 0.9, steps),
        "holdout/multisine": within(0.15, 0.85, replace(fast, seconds=1.0, seed=3)),
        "holdout/steps": within(0.2, 0.8, replace(steps, seconds=4.0, seed=4)),
    }


def written(folder: Path, *effects: str, **more: Any) -> dict[str, Any]:
    """A small case with effects of ordinary size; its labels."""
    told = {"effects": dict.fromkeys(effects, 1.0), "stage": STAGE, "seed": 3} | more
    if "campaign" not in told:
        told.setdefault("every", commands(told["stage"]))
    return make_case(folder, **told)


def tell(case: Path, **keys: Any) -> None:
    """Add keys to case.json."""
    path = case / "case.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | keys))


def content(case: Path, **options: Any) -> dict[str, Any]:
    """What diagnosis.json would hold, without writing anything."""
    return diagnose(load_case(case), Options(**options)).content


def named(diagnosis: dict[str, Any]) -> set[str]:
    """Effects of the verdict, and candidates."""
    return {*diagnosis["verdict"]["effects"], *diagnosis["verdict"]["candidates"]}


def parameters(diagnosis: dict[str, Any], effect: str) -> dict[str, float]:
    """Values of an effect's parameters in the ranking."""
    entry = next(e for e in diagnosis["ranking"] if e["effect"] == effect)
    return {k: p["value"] for k, p in entry["parameters"].items()}


def run(monkeypatch: Any, case: Path, out: Path, *options: str) -> dict[str, Any]:
    """Run the command as a user does; diagnosis.json."""
    told = ["madelung", "diagnose", str(case), "-o", str(out), *options]
    monkeypatch.setattr(sys, "argv", told)
    cli.main()
    return json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))


def change(path: Path, **columns: Any) -> None:
    """Replace columns of a record by functions of its frame."""
    frame = pd.read_csv(path)
    for name, new in columns.items():
        frame[name] = new(frame)
    frame.to_csv(path, index=False)


def cut(path: Path, seconds: float) -> None:
    """Drop the beginning of a record."""
    frame = pd.read_csv(path)
    frame[frame["t_s"] >= seconds].to_csv(path, index=False)
