"""The score of a trial, on labels and answers whose score is plain."""

import io
import json
from typing import Any

import pytest
from rich.console import Console

from madelung.blind.card import terminal, write_card
from madelung.blind.score import interval, is_tuning, score, upper_bound


def label(*effects: str, **more: Any) -> dict[str, Any]:
    noise = {"colour": "white", "floor_um": 0.01}
    return {"effects": list(effects), "noise": noise, "size": dict.fromkeys(effects, 1.0)} | more


def said(
    status: str, *effects: str, open_: tuple[str, ...] = (), sure: float = 0.9, **more: Any
) -> Any:
    verdict = {"status": status, "effects": effects, "candidates": open_, "confidence": sure}
    found = {"verdict": verdict, "gap": {"rms_um": 0.1}} | more
    return {"status": "answered", "seconds": 2.0, "diagnosis": json.loads(json.dumps(found))}


CASES = {
    "right": (label("creep"), said("identified", "creep")),
    "wrong": (label("delay"), said("identified", "creep")),
    "open": (label("delay"), said("ambiguous", open_=("delay", "amplifier_lag"), sure=0.8)),
    "open, and wrong": (label("delay"), said("ambiguous", open_=("creep", "drift"))),
    "pair": (label("delay", "creep"), said("identified", "creep", "delay")),
    "half": (label("delay", "creep"), said("identified", "creep", "drift")),
    "agreed and open": (
        label("delay", "creep"),
        said("ambiguous", "creep", open_=("delay", "resonance"), sure=0.5),
    ),
    "silent": (label(), said("no_gap")),
    "alarm": (label(), said("identified", "drift")),
    "doubt": (label(), said("unknown")),
    "outside": (label(outside=["fringes"]), said("unknown")),
    "outside, named": (label(outside=["fringes"]), said("identified", "backlash")),
    "left out": (label(outside=["creep"], kind="left_out"), said("unknown", open_=("drift",))),
    "failed": (label("drift"), {"status": "failed", "error": "ValueError: x", "seconds": 1.0}),
}


def card(names: list[str] | None = None, **more: tuple[Any, Any]) -> dict[str, Any]:
    cases = {n: CASES[n] for n in (list(CASES) if names is None else names)} | more
    return score({n: c[0] for n, c in cases.items()}, {n: c[1] for n, c in cases.items()})


def test_what_is_right() -> None:
    right = {r["case"] for r in card()["rows"] if r["right"]}
    assert right == {"right", "pair", "silent", "outside", "left out"}
    held = {r["case"] for r in card()["rows"] if r["held"]}
    assert held == right | {"open", "agreed and open"}


def test_kinds_are_counted_apart() -> None:
    told = {name: (s["hits"], s["of"]) for name, s in card()["kinds"].items()}
    assert told == {
        "one effect": (1, 5),
        "two or more": (1, 3),
        "none": (1, 3),
        "outside the vocabulary": (1, 2),
        "left out of the library": (1, 1),
    }
    assert card()["not_answered"] == ["failed"]
    assert card()["wrong_cause"]["hits"] == 4


def test_false_alarms_have_an_exact_bound() -> None:
    alarms = card()["false_alarms"]
    assert (alarms["alarms"], alarms["naming"], alarms["of"]) == (2, 1, 3)
    assert 0.04 < upper_bound(0, 59) < 0.05 < upper_bound(0, 58)
    assert 0.009 < upper_bound(0, 300) < 0.01
    assert upper_bound(5, 5) == 1.0
    low, high = interval(8, 10)
    assert low == pytest.approx(0.4439, abs=1e-4) and high == pytest.approx(0.9748, abs=1e-4)


def test_pairs_have_precision_and_recall() -> None:
    pairs = card()["pairs"]
    assert pairs["precision"] == pytest.approx(4 / 5)
    assert pairs["recall"] == pytest.approx(4 / 6)
    assert pairs["exact"]["hits"] == 1


def test_probability_of_the_truth() -> None:
    told = {r["case"]: r["probability"] for r in card()["rows"]}
    assert told["right"] == 0.9 and told["open"] == 0.4 and told["agreed and open"] == 0.25
    assert told["wrong"] == pytest.approx(0.1 / 16)
    assert told["open, and wrong"] == told["failed"] == 0.0


def test_candidates_and_reliability() -> None:
    told = card()
    assert told["candidates"]["coverage"]["hits"] == 2 and told["candidates"]["mean_size"] == 2.0
    bins = {b["from"]: b for b in told["reliability"]["bins"]}
    assert bins[0.9]["cases"] == 11 and bins[0.9]["held"] == pytest.approx(5 / 11)
    sure = card(["right", "silent"])["reliability"]
    assert sure["calibration_error"] == pytest.approx(0.1) and sure["brier"] == pytest.approx(0.01)


def test_confusion_counts_every_case_once() -> None:
    told = card()["confusion"]
    assert sum(map(sum, told["cases"])) == len(CASES)
    cells = {
        (t, a): n
        for t, row in zip(told["truth"], told["cases"], strict=True)
        for a, n in zip(told["answer"], row, strict=True)
        if n
    }
    assert cells["delay", "creep"] == 1 and cells["delay", "ambiguous"] == 2
    assert cells["two or more", "two or more"] == cells["two or more", "another set"] == 1
    assert (
        cells["none", "no gap"] == cells["left out", "unknown"] == cells["drift", "no answer"] == 1
    )


def region(axis: str, low: float | None, high: float | None) -> dict[str, Any]:
    return {"axis": axis, "low": low, "high": high}


@pytest.mark.parametrize(
    ("found", "hit"),
    [
        (region("input", 33.0, None), True),
        (region("input", 36.0, 40.0), True),
        (region("input", 39.0, 40.0), True),
        (region("input", 20.0, 36.0), False),
        (region("input", None, 34.0), False),
        (region("rate", 0.0, 100.0), False),
    ],
)
def test_where_needs_half_of_the_narrower_region(found: dict[str, Any], hit: bool) -> None:
    truth = label("saturation", where={"axis": "input", "low": 35.0, "high": 40.0})
    other = region("branch", None, None) | {"low": "major_rising"}
    told = card([], x=(truth, said("identified", "saturation", where=[found, other])))["where"]
    assert told["first"]["hits"] == told["any"]["hits"] == hit
    told = card([], x=(truth, said("identified", "saturation", where=[other, found])))["where"]
    assert told["first"]["hits"] == 0 and told["any"]["hits"] == hit


def test_claimed_shrinkage_is_held_against_the_truth() -> None:
    answer = said(
        "identified",
        "creep",
        shrink={"closable_closed": 0.99, "closable_closed_ci95": [0.98, 1.0], "rms_after_um": 0.05},
    ) | {"holdout": {"rows": 1000, "before_um": 0.2, "after_um": 0.05}}
    told = card([], x=(label("creep"), answer))["shrinkage"]
    true = (0.2**2 - 0.05**2) / (0.2**2 - 0.01**2)
    assert told["true_median"] == pytest.approx(true)
    assert told["off_median"] == pytest.approx(0.99 - true)
    assert told["covered"]["hits"] == 0 and told["honest"]["hits"] == 1
    hum = card([], x=(label("periodic_disturbance"), answer))
    assert hum["shrinkage"]["cases"] == 0  # its lines count for neither


def test_parameter_errors() -> None:
    entry = {
        "effect": "gain_offset",
        "parameters": {
            "gain": {"value": 1.033, "ci95": [1.02, 1.04]},
            "offset_um": {"value": 0.1, "ci95": [0.05, 0.15]},
        },
    }
    truth = label("gain_offset", parameters={"gain_offset": {"gain": 1.03, "offset_um": 0.2}})
    told = card([], x=(truth, said("identified", "gain_offset", ranking=[entry])))["parameters"]
    gain, offset = told
    assert gain["error_median"] == pytest.approx(0.1) and gain["covered"] == 1.0
    assert offset["error_median"] == pytest.approx(0.5) and offset["covered"] == 0.0


def test_rivals_are_scored_on_the_same_cases() -> None:
    answer = said("identified", "creep") | {"rivals": {"correlation": ["creep"], "bic": []}}
    told = card(["silent", "alarm"], a=(label("creep"), answer), b=(label("creep"), answer))
    scored = {r["who"]: r for r in told["rivals"]}
    assert scored["this diagnosis"]["right"] == 0.75
    assert scored["always none"]["right"] == 0.5 and scored["always none"]["false_alarms"] == 0.0
    assert scored["largest correlation with a template"]["right_where_something_acts"] == 1.0
    assert scored["BIC pick among templates"]["right_where_something_acts"] == 0.0


def test_strata_count_what_belongs_to_them() -> None:
    loud = label("creep", size={"creep": 0.1}, law={"creep": "log"})
    loud["noise"] = {"colour": "pink", "floor_um": 0.08}
    records = {"identify": {"waveform": "triangle"}, "train/a": {"waveform": "chirp"}}
    told = card(["right"], x=(loud | {"records": records}, said("no_gap")))["by"]
    assert told["size of the effect"]["1"]["hits"] == 1
    assert told["size of the effect"]["0.1"]["hits"] == 0
    assert list(told["gap over noise"]) == ["0.3 to 1", "3 to 10"]
    assert told["noise"]["pink"]["of"] == told["noise"]["white"]["of"] == 1
    assert list(told["excitation in training"]) == ["chirp"]
    assert told["law"]["creep: log"]["of"] == 1


def test_the_card_shows_every_case_and_escapes(tmp_path: Any) -> None:
    told = card(**{"<b>": CASES["wrong"]}) | {"commitments": {"seed": 5, "versions": {"x": "1"}}}
    write_card(tmp_path, told)
    page = (tmp_path / "card.html").read_text()
    assert "<b>" not in page and "&lt;b&gt;" in page and "this is no trial" in page
    assert json.loads((tmp_path / "card.json").read_text())["cases"] == len(CASES) + 1
    console = Console(width=120, record=True, file=io.StringIO())
    console.print(terminal(told))
    assert "2 of 3" in console.export_text()


def test_seeds_below_the_first_trials_are_for_tuning() -> None:
    assert is_tuning(9999) and not is_tuning(10000)


def test_nothing_but_minimal_labels_is_needed() -> None:
    told = score({"x": {"effects": ["creep"]}}, {"x": said("identified", "creep")})
    assert told["right"]["hits"] == 1 and told["shrinkage"]["cases"] == 0
    json.dumps(told, allow_nan=False)
