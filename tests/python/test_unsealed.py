"""What was sealed beside what was diagnosed: the line that ends the demo."""

import json
from pathlib import Path
from typing import Any

import pytest
from report_cases import changed, untested
from typer.testing import CliRunner

from madelung.blind.unsealed import compared
from madelung.cli import app
from madelung.errors import InputError
from madelung.sealing import seal

DELAY = {"effects": ["delay"], "outside": [], "parameters": {"delay": {"delay_s": 4.052e-4}}}
TOO_MUCH = {"saturation": {"high_V": 57.3, "knee_V": 0.0, "other": [1]}}


def labels(*effects: str, **more: Any) -> dict[str, Any]:
    return {"effects": list(effects), **more}


@pytest.mark.parametrize(
    ("sealed", "found", "said"),
    [
        (
            DELAY,
            changed("identified", effects=["delay"]),
            "delay (delay = 0.4052 ms); diagnosed: delay: right",
        ),
        (
            labels("saturation", parameters=TOO_MUCH),
            changed("identified", effects=["slew_limit"]),
            "saturation (high = 57.3 V, knee = 0 V); diagnosed: slew limit: wrong",
        ),
        (
            labels("delay", "creep"),
            changed("identified", effects=["creep"]),
            "delay; creep; diagnosed: creep: wrong",
        ),
        (
            labels("creep", "delay"),
            changed("identified", effects=["delay", "creep"]),
            "creep; delay; diagnosed: delay and creep: right",
        ),
        (
            labels("delay"),
            changed("ambiguous", candidates=["delay", "amplifier_lag"]),
            "delay; diagnosed: delay or amplifier lag: undecided, the truth is among them",
        ),
        (
            labels("creep", "delay"),
            changed("ambiguous", effects=["creep"], candidates=["drift", "backlash"]),
            "creep; delay; diagnosed: creep and drift or backlash: wrong",
        ),
        (labels(), changed("no_gap"), "nothing; diagnosed: no gap: right"),
        (labels("creep"), changed("no_gap"), "creep; diagnosed: no gap: wrong"),
        (
            labels(outside=["fading_gain"]),
            changed("unknown"),
            "fading gain; diagnosed: unknown cause: right",
        ),
        (labels("creep"), changed("unknown"), "creep; diagnosed: unknown cause: wrong"),
        (
            labels("creep"),
            untested(checked=True),
            "creep; diagnosed: nothing was fitted: no verdict",
        ),
    ],
)
def test_the_verdict_stands_beside_what_was_sealed(
    sealed: dict[str, Any], found: dict[str, Any], said: str
) -> None:
    assert compared(sealed, found) == f"sealed: {said}"
    assert compared(sealed) == f"sealed: {said.partition('; diagnosed')[0]}"


def test_what_cannot_be_compared_is_refused() -> None:
    with pytest.raises(InputError, match="not those of one case"):
        compared({"case_1": DELAY}, changed("no_gap"))
    for found in ({}, [], {"verdict": {"status": "identified"}}):
        with pytest.raises(InputError, match="not a whole diagnosis"):
            compared(DELAY, found)  # type: ignore[arg-type]


def test_the_command_keeps_the_labels_and_prints_a_line(tmp_path: Path) -> None:
    key, _ = seal(DELAY, tmp_path / "sealed.json")
    diagnosed = tmp_path / "diagnosis.json"
    diagnosed.write_text(json.dumps(changed("identified", effects=["delay"])))
    told = ["unseal", str(tmp_path / "sealed.json"), key]
    out = tmp_path / "labels.json"
    done = CliRunner().invoke(app, [*told, "-o", str(out), "--diagnosis", str(tmp_path)])
    assert done.output == "sealed: delay (delay = 0.4052 ms); diagnosed: delay: right\n"
    assert json.loads(out.read_text()) == DELAY
    assert json.loads(CliRunner().invoke(app, told).output) == DELAY
    before = diagnosed.read_bytes()
    done = CliRunner().invoke(app, [*told, "-o", str(diagnosed), "--diagnosis", str(tmp_path)])
    assert isinstance(done.exception, InputError) and diagnosed.read_bytes() == before
