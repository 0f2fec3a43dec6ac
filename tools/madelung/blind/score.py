"""Answers against labels: what was right, how sure it was, and what trivial rivals reach."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from madelung.blind.trial import SEED_MIN, Trial
from madelung.diagnosis.vocabulary import EFFECTS
from madelung.errors import InputError
from madelung.files import read_json

Row = dict[str, Any]
"""A case: its label, its answer and what follows from both."""
NOTHING, OUTSIDE, LEFT_OUT = "none", "outside", "left out"
SEVERAL, ANOTHER_SET = "two or more", "another set"
AMBIGUOUS, UNKNOWN, NO_GAP, NO_ANSWER = "ambiguous", "unknown", "no gap", "no answer"
_CONFIDENCES = (0.0, 0.5, 0.7, 0.9, 0.95, 0.99, 1.0)
_GAPS = (0.0, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, np.inf)
"""Edges of the gap over the noise floor, rms."""
_CLOSABLE_MIN = 0.1
"""Hold-out records with less to close, over the noise floor's square, say nothing of shrinkage."""
_COMPARABLE = {key for effect in EFFECTS.values() for key in effect.keys} - {"knee_V"}
"""Parameters that mean the same in every law; a knee's width depends on its shape."""
_ANSWERS = len(EFFECTS) + 2
"""How many answers a single cause can get: an effect, unknown, no gap."""


def read_answers(trial: Trial, labels: Mapping[str, Any]) -> dict[str, Any]:
    """Answers by case.

    Raises
    ------
    InputError
        A case with a label has no answer.
    """
    for name in labels:
        if not trial.answer(name).exists():
            raise InputError(f"{trial.answer(name)}: is missing: the label names a case without it")
    return {name: read_json(trial.answer(name)) for name in labels}


def score(labels: Mapping[str, Any], answers: Mapping[str, Any]) -> dict[str, Any]:
    """The score card, plain enough for JSON.

    Parameters
    ----------
    labels
        Case to label: ``effects``; and where known what `madelung.blind.deal.deal_case` gives.
    answers
        Case to answer, see `madelung.blind.answer.diagnose_files`.
    """
    rows = [_row(name, labels[name], answers[name]) for name in sorted(labels)]
    plain = [r for r in rows if r["truth"] != LEFT_OUT]
    answered = [r for r in rows if r["status"] is not None]
    return {
        "schema": "madelung.card/1",
        "cases": len(rows),
        "not_answered": [r["case"] for r in rows if r["status"] is None],
        "seconds": float(np.median([r["seconds"] for r in rows])),
        "right": _share(plain, "right"),
        "kinds": {
            "one effect": _share([r for r in plain if len(r["effects"]) == 1], "right"),
            "two or more": _share([r for r in plain if len(r["effects"]) > 1], "right"),
            "none": _share([r for r in plain if r["truth"] == NOTHING], "right"),
            "outside the vocabulary": _share([r for r in plain if r["truth"] == OUTSIDE], "right"),
            "left out of the library": _share([r for r in rows if r["truth"] == LEFT_OUT], "right"),
        },
        "false_alarms": _false_alarms([r for r in plain if r["truth"] == NOTHING]),
        "wrong_cause": _share(rows, "wrong_cause"),
        "pairs": _sets([r for r in plain if len(r["effects"]) > 1]),
        "sets": _sets([r for r in plain if r["effects"]]),
        "probability": _mean([r["probability"] for r in answered]),
        "candidates": _candidates([r for r in answered if r["status"] == "ambiguous"]),
        "reliability": _reliability(answered),
        "where": _where([r for r in plain if r["where_first"] is not None]),
        "shrinkage": _shrinkage([r for r in rows if r["shrink"] is not None]),
        "parameters": _parameters(rows),
        "rivals": _rivals(plain),
        "confusion": _confusion(rows),
        "by": {
            "size of the effect": _by([r for r in plain if len(r["effects"]) == 1], _size),
            "gap over noise": _by([r for r in plain if r["effects"]], _gap_bin, _gap_names()),
            "effect": _by([r for r in plain if len(r["effects"]) == 1], lambda r: r["effects"]),
            "law": _by([r for r in rows if len(r["law"]) == 1], lambda r: r["law"]),
            "noise": _by(plain, lambda r: r["colour"]),
            "nothing to find, by noise": _by(
                [r for r in plain if r["truth"] == NOTHING], lambda r: r["colour"]
            ),
            "excitation in training": _by(plain, lambda r: r["waveforms"]),
            "base": _by(plain, lambda r: r["base"]),
        },
        "rows": rows,
    }


def is_tuning(seed: int) -> bool:
    """Whether a seed is one of those for tuning, which no trial may have."""
    return seed < SEED_MIN


def upper_bound(hits: int, of: int, level: float = 0.95) -> float:
    """Exact (Clopper and Pearson 1934) one-sided upper bound of a share, 0 to 1."""
    from scipy.stats import beta

    return 1.0 if hits >= of else float(beta.ppf(level, hits + 1, of - hits))


def interval(hits: int, of: int, level: float = 0.95) -> tuple[float, float]:
    """Exact two-sided interval of a share."""
    tail = (1.0 + level) / 2.0
    return 1.0 - upper_bound(of - hits, of, tail), upper_bound(hits, of, tail)


# One case.


def _row(name: str, label: Mapping[str, Any], answer: Mapping[str, Any]) -> Row:
    effects, outside = sorted(label["effects"]), sorted(label.get("outside", []))
    left_out = label.get("kind") == "left_out"
    found = answer.get("diagnosis") or {}
    verdict = found.get("verdict") or {}
    status = verdict.get("status")
    named = sorted(verdict.get("effects", []))
    row: Row = {
        "case": name,
        "effects": effects,
        "outside": outside,
        "truth": _truth(effects, outside, left_out),
        "status": status,
        "named": named,
        "candidates": verdict.get("candidates", []),
        "confidence": verdict.get("confidence"),
        "error": answer.get("error"),
        "seconds": answer.get("seconds", 0.0),
        "size": label.get("size", {}),
        "law": sorted(f"{k}: {v}" for k, v in label.get("law", {}).items()),
        "colour": [c] if (c := label.get("noise", {}).get("colour")) else [],
        "base": [b] if (b := label.get("base", {}).get("physics")) else [],
        "waveforms": _waveforms(label),
        "rivals": answer.get("rivals", {}),
    }
    row["right"] = is_right(row)
    row["held"] = is_held(row)
    row["wrong_cause"] = status == "identified" and not set(named) <= set(effects)
    row["probability"] = _probability(row)
    row["gap_over_noise"] = _gap_over_noise(label, found)
    row |= _where_of(label, found)
    row["shrink"] = _shrink_of(label, answer)
    row["parameters"] = _parameters_of(row, label, found)
    return row


def _truth(effects: Sequence[str], outside: Sequence[str], left_out: bool) -> str:
    if outside:
        return LEFT_OUT if left_out else OUTSIDE
    return " + ".join(effects) or NOTHING


def _waveforms(label: Mapping[str, Any]) -> list[str]:
    records = label.get("records", {})
    return sorted({r["waveform"] for name, r in records.items() if name.startswith("train/")})


def is_right(row: Row) -> bool:
    """The verdict is the one that a perfect diagnosis would give."""
    if row["outside"]:
        return bool(row["status"] == "unknown")
    if not row["effects"]:
        return bool(row["status"] == "no_gap")
    return bool(row["status"] == "identified" and row["named"] == row["effects"])


def is_held(row: Row) -> bool:
    """The verdict is not false: right, or ambiguous with the truth among what it leaves open."""
    if row["status"] != "ambiguous":
        return is_right(row)
    named, open_, truth = set(row["named"]), set(row["candidates"]), set(row["effects"])
    return named <= truth <= named | open_ and bool(truth & open_) and not row["outside"]


def _probability(row: Row) -> float:
    """What the answer gives to the truth: its confidence, or a share of what that leaves.

    An ambiguous verdict shares its confidence among its candidates.
    """
    if row["confidence"] is None:
        return 0.0
    sure = float(row["confidence"])
    if row["status"] == "ambiguous":
        return sure / len(row["candidates"]) if row["held"] and row["candidates"] else 0.0
    return sure if row["right"] else (1.0 - sure) / (_ANSWERS - 1)


def _floor_um(label: Mapping[str, Any]) -> float | None:
    floor = label.get("noise", {}).get("floor_um", label.get("noise_um"))
    return float(floor) if floor else None


def _gap_over_noise(label: Mapping[str, Any], found: Mapping[str, Any]) -> float | None:
    """Rms of the baseline's error beyond the true noise, over that noise."""
    floor = _floor_um(label)
    gap = found.get("gap", {}).get("rms_um")
    if floor is None or gap is None:
        return None
    return float(np.sqrt(max(gap**2 - floor**2, 0.0)) / floor)


def _where_of(label: Mapping[str, Any], found: Mapping[str, Any]) -> Row:
    """Whether the first region, and any, contains the true one; None: it is not clear."""
    true, regions = label.get("where"), found.get("where", [])
    if not true or not regions:
        return {"where_first": None, "where_any": None}
    hits = [_contains(region, true) for region in regions]
    return {"where_first": hits[0], "where_any": any(hits)}


def _contains(region: Mapping[str, Any], true: Mapping[str, Any]) -> bool:
    """Whether a region and the true one share half of the narrower, or a line."""
    if region["axis"] != true["axis"]:
        return False
    low = -np.inf if region["low"] is None else float(region["low"])
    high = np.inf if region["high"] is None else float(region["high"])
    common = min(high, true["high"]) - max(low, true["low"])
    width = min(true["high"] - true["low"], high - low)
    return bool(common >= 0.0 and common >= 0.5 * width)


def _shrink_of(label: Mapping[str, Any], answer: Mapping[str, Any]) -> Row | None:
    """Claimed and true share of what could be closed on the hold-out records."""
    noise, rms = label.get("noise", {}), answer.get("holdout")
    floor = noise.get("in_um", {}).get("holdout", _floor_um(label))
    told = (answer.get("diagnosis") or {}).get("shrink", {})
    if floor is None or not rms or not rms["rows"] or told.get("closable_closed") is None:
        return None
    before, after = rms["before_um"] ** 2, rms["after_um"] ** 2
    acting = [*label["effects"], *label.get("outside", [])]
    if before - floor**2 < _CLOSABLE_MIN * floor**2 or "periodic_disturbance" in acting:
        return None
    true = (before - after) / (before - floor**2)
    ends = told.get("closable_closed_ci95") or (np.nan, np.nan)
    return {
        "claimed": told["closable_closed"],
        "true": true,
        "covered": bool(ends[0] <= true <= ends[1]),
        "honest": bool(np.isclose(told["rms_after_um"], rms["after_um"], rtol=1e-3)),
    }


def _parameters_of(row: Row, label: Mapping[str, Any], found: Mapping[str, Any]) -> list[Row]:
    """Errors of the parameters of effects that were named and act."""
    errors = []
    truth = label.get("parameters", {})
    entries = {entry["effect"]: entry["parameters"] for entry in found.get("ranking", [])}
    for effect in row["named"]:
        for key, told in entries.get(effect, {}).items():
            true = truth.get(effect, {}).get(key)
            if effect not in row["effects"] or true is None or key not in _COMPARABLE:
                continue
            scale = _scale(key, true, label)
            low, high = told["ci95"] or (np.nan, np.nan)
            errors.append(
                {
                    "key": key,
                    "error": (told["value"] - true) / scale,
                    "covered": bool(low is not None and low <= true <= high),
                }
            )
    return errors


def _scale(key: str, true: float, label: Mapping[str, Any]) -> float:
    """What an error is measured against: the value, a voltage's range, a gain's change."""
    base = label.get("base", {})
    if key in ("high_V", "low_V", "start_peak_V") and "u_max_V" in base:
        return float(base["u_max_V"] - base["u_min_V"])
    return abs(true - 1.0 if key == "gain" else true) or 1.0


# Many cases.


def _share(rows: Sequence[Row], key: str) -> Row:
    hits, of = sum(bool(r[key]) for r in rows), len(rows)
    if not of:
        return {"hits": 0, "of": 0, "share": None, "ci95": None}
    return {"hits": hits, "of": of, "share": hits / of, "ci95": interval(hits, of)}


def _mean(values: Sequence[float]) -> float | None:
    return float(np.mean(values)) if len(values) else None


def _false_alarms(rows: Sequence[Row]) -> Row:
    """Cases with nothing to find in which something is found."""
    alarms = [r for r in rows if r["status"] not in ("no_gap", None)]
    names = [r for r in alarms if r["named"] or r["candidates"]]
    return {
        "alarms": len(alarms),
        "naming": len(names),
        "of": len(rows),
        "share": len(alarms) / len(rows) if rows else None,
        "bound95": upper_bound(len(alarms), len(rows)) if rows else None,
        "naming_bound95": upper_bound(len(names), len(rows)) if rows else None,
    }


def _sets(rows: Sequence[Row]) -> Row:
    """Exact sets, precision and recall of the effects that are named for certain."""
    common = sum(len(set(r["named"]) & set(r["effects"])) for r in rows)
    named = sum(len(r["named"]) for r in rows)
    acting = sum(len(r["effects"]) for r in rows)
    return {
        "exact": _share(rows, "right"),
        "precision": common / named if named else None,
        "recall": common / acting if acting else None,
    }


def _candidates(rows: Sequence[Row]) -> Row:
    return {
        "coverage": _share(rows, "held"),
        "mean_size": _mean([len(r["candidates"]) for r in rows]),
    }


def _reliability(rows: Sequence[Row]) -> Row:
    """Stated confidence against how often the verdict holds."""
    stated = np.array([r["confidence"] for r in rows], np.float64)
    held = np.array([r["held"] for r in rows], np.float64)
    place = np.clip(np.searchsorted(_CONFIDENCES, stated, "right") - 1, 0, len(_CONFIDENCES) - 2)
    bins = [
        {
            "from": _CONFIDENCES[k],
            "to": _CONFIDENCES[k + 1],
            "cases": int(np.sum(place == k)),
            "stated": float(stated[place == k].mean()),
            "held": float(held[place == k].mean()),
        }
        for k in sorted(set(place.tolist()))
    ]
    off = sum(b["cases"] * abs(b["stated"] - b["held"]) for b in bins)
    return {
        "bins": bins,
        "calibration_error": off / len(rows) if rows else None,
        "brier": float(np.mean((stated - held) ** 2)) if rows else None,
    }


def _where(rows: Sequence[Row]) -> Row:
    return {"first": _share(rows, "where_first"), "any": _share(rows, "where_any")}


def _shrinkage(rows: Sequence[Row]) -> Row:
    told = [r["shrink"] for r in rows]
    off = [s["claimed"] - s["true"] for s in told]
    return {
        "cases": len(told),
        "true_median": float(np.median([s["true"] for s in told])) if told else None,
        "off_median": float(np.median(np.abs(off))) if off else None,
        "off_p95": float(np.quantile(np.abs(off), 0.95)) if off else None,
        "covered": _share(told, "covered"),
        "honest": _share(told, "honest"),
        "worse": sum(s["true"] < 0.0 for s in told),
    }


def _parameters(rows: Sequence[Row]) -> list[Row]:
    every = [p for r in rows for p in r["parameters"]]
    table = []
    for key in sorted({p["key"] for p in every}):
        own = [p for p in every if p["key"] == key]
        off = np.abs([p["error"] for p in own])
        table.append(
            {
                "key": key,
                "cases": len(own),
                "error_median": float(np.median(off)),
                "error_p90": float(np.quantile(off, 0.9)),
                "covered": sum(p["covered"] for p in own) / len(own),
            }
        )
    return table


def _rivals(rows: Sequence[Row]) -> list[Row]:
    """What trivial answers would have scored, on the cases whose cause has a name, or none."""
    known = [r for r in rows if not r["outside"]]
    counts = Counter(tuple(r["effects"]) for r in known)
    commonest = max(counts, key=lambda answer: counts[answer]) if counts else ()
    effects = Counter(r["effects"][0] for r in known if len(r["effects"]) == 1)
    effect = max(effects, key=lambda name: effects[name]) if effects else ""
    said: dict[str, Callable[[Row], Iterable[str]]] = {
        "this diagnosis": lambda r: r["named"] if r["status"] in ("identified", "no_gap") else "?",
        "always none": lambda r: (),
        "always the commonest answer": lambda r: commonest,
        f"always the commonest effect ({effect})": lambda r: (effect,),
        "largest correlation with a template": lambda r: r["rivals"].get("correlation", "?"),
        "BIC pick among templates": lambda r: r["rivals"].get("bic", "?"),
    }
    nothing = [r for r in known if not r["effects"]]
    caused = [r for r in known if r["effects"]]
    return [
        {
            "who": who,
            "right": _hits([sorted(answer(r)) == r["effects"] for r in known]),
            "right_where_something_acts": _hits(
                [sorted(answer(r)) == r["effects"] for r in caused]
            ),
            "false_alarms": _hits([sorted(answer(r)) != [] for r in nothing]),
        }
        for who, answer in said.items()
    ]


def _hits(hits: Sequence[bool]) -> float | None:
    return sum(hits) / len(hits) if hits else None


def _confusion(rows: Sequence[Row]) -> Row:
    """Counts of (truth, answer); several effects are one row, and one column where right."""

    def told(row: Row) -> str:
        if row["status"] == "identified":
            if len(row["named"]) == 1:
                return str(row["named"][0])
            return SEVERAL if row["right"] else ANOTHER_SET
        names = {"ambiguous": AMBIGUOUS, "unknown": UNKNOWN, "no_gap": NO_GAP, None: NO_ANSWER}
        return names[row["status"]]

    def true(row: Row) -> str:
        return SEVERAL if len(row["effects"]) > 1 else str(row["truth"])

    counts = Counter((true(r), told(r)) for r in rows)
    truths = [*EFFECTS, SEVERAL, NOTHING, OUTSIDE, LEFT_OUT]
    tolds = [*EFFECTS, SEVERAL, ANOTHER_SET, AMBIGUOUS, UNKNOWN, NO_GAP, NO_ANSWER]
    truths = [t for t in truths if any(k[0] == t for k in counts)]
    tolds = [t for t in tolds if t in EFFECTS or any(k[1] == t for k in counts)]
    return {
        "truth": truths,
        "answer": tolds,
        "cases": [[counts[(t, a)] for a in tolds] for t in truths],
    }


def _size(row: Row) -> list[str]:
    return [f"{size:g}" for size in row["size"].values()]


def _gap_names() -> list[str]:
    edges = pairwise(_GAPS)
    return [f"{a:g} to {b:g}" if np.isfinite(b) else f"above {a:g}" for a, b in edges]


def _gap_bin(row: Row) -> list[str]:
    ratio = row["gap_over_noise"]
    return [] if ratio is None else [_gap_names()[int(np.searchsorted(_GAPS, ratio, "right")) - 1]]


def _by(
    rows: Sequence[Row], keys: Callable[[Row], list[str]], order: Sequence[str] = ()
) -> dict[str, Row]:
    """Share right by stratum; a case may be in several."""
    strata: dict[str, list[Row]] = {}
    for row in rows:
        for key in keys(row):
            strata.setdefault(key, []).append(row)
    names = [n for n in order if n in strata] or sorted(strata, key=_by_number)
    return {
        n: _share(strata[n], "right")
        | {"held": _share(strata[n], "held")["share"], "probability": _mean_of(strata[n])}
        for n in names
    }


def _mean_of(rows: Sequence[Row]) -> float | None:
    return _mean([r["probability"] for r in rows])


def _by_number(name: str) -> tuple[float, str]:
    try:
        return -float(name), name
    except ValueError:
        return 0.0, name
