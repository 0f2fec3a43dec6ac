"""A diagnosis for the tests of its report, made up, and records to go with it."""

from typing import Any

import numpy as np

from madelung.diagnosis.noise import Noise
from madelung.diagnosis.pictures import View
from madelung.diagnosis.regions import Region

HOSTILE = '<script>alert(1)</script>"><img src=x onerror=alert(2)> $x^{ \x1b[31m{{7*7}}'
NOISE = Noise(0.01, 0.0, 0.01, 10_000, known=True)


def entry(effect: str, rms: float, closed: float | None, **parameters: Any) -> dict[str, Any]:
    """An entry of the ranking."""
    return {
        "effect": effect,
        "effects": [effect],
        "rms_um": rms,
        "closable_closed": closed,
        "p_value": 1e-20,
        "parameters": {k: {"value": v, "ci95": [0.9 * v, 1.1 * v]} for k, v in parameters.items()},
    }


def diagnosis() -> dict[str, Any]:
    """Delay and creep, found on a record whose rows 7 to 19 are stuck."""
    region = Region(
        "rate", 500.0, 900.0, "V/s", "above", None, 0.83, 9.2, 0.09, (0.8, 0.86), (8.0, 10.0)
    )
    return {
        "schema": "madelung.diagnosis/1",
        "gap": {
            "rms_um": 0.12,
            "max_um": 0.6,
            "percent_of_stroke": 2.1,
            "noise_floor_um": 0.01,
        },
        "where": [region.to_json()],
        "verdict": {
            "status": "identified",
            "effects": ["delay", "creep"],
            "candidates": [],
            "confidence": 0.97,
            "remainder_share": 0.004,
        },
        "ranking": [
            entry("delay", 0.0101, 0.998, delay_s=4e-4),
            entry("creep", 0.0101, 0.998, creep_per_decade=0.012),
            entry("slew_limit", 0.09, 0.4, slew_V_per_s=900.0),
            entry("drift", 0.13, None),
        ],
        "shrink": {
            "records": [{"name": "hold", "rms_before_um": 0.11, "rms_after_um": 0.0102}],
            "rms_before_um": 0.11,
            "rms_after_um": 0.0102,
            "closable_closed": 0.9966,
            "closable_closed_ci95": [0.995, 0.998],
            "regions": [{**region.to_json(), "rms_before_um": 0.1, "rms_after_um": 0.009}],
        },
        "data_faults": [{"record": "sweep", "rows": [7, 19], "kind": "stuck"}],
        "detectable": {"delay": 1.2e-5, "resonance": None},
        "next_experiment": None,
        "case": {"device": "stage 4", "u_min_V": 0.0, "u_max_V": 40.0},
        "seed": 5,
        "warnings": ["sweep.csv: rows in which y is stuck while u moves: 13"],
    }


def changed(status: str, **verdict: Any) -> dict[str, Any]:
    """The same with another verdict."""
    d = diagnosis()
    d["verdict"] = {**d["verdict"], "status": status, "effects": [], **verdict}
    return d


def untested(**why: Any) -> dict[str, Any]:
    """The same with no effect looked for: ``checked``, or ``good_enough_below_percent``."""
    status = "no_gap" if "good_enough_below_percent" in why else "unknown"
    return changed(status, confidence=0.0, remainder_share=1.0) | {"ranking": []} | why


def views() -> list[View]:
    """A train and a hold-out record, the latter with a hostile name."""
    t = np.arange(6000) * 1e-3
    rng = np.random.default_rng(2)
    made = []
    for name, role, hz in (("sweep", "train", 2.0), (HOSTILE, "holdout", 3.0)):
        u = 20.0 - 20.0 * np.cos(2 * np.pi * hz * t)
        y = 0.1 * u + 0.01 * rng.standard_normal(t.size)
        made.append(View(name, role, t, u, y, y - 0.002 * np.gradient(u, t), 0.1 * u))
    return made


def hostile() -> dict[str, Any]:
    """A diagnosis with a hostile text wherever one can come from outside."""
    d = diagnosis()
    d["case"] = {"device": HOSTILE, HOSTILE: HOSTILE}
    d["shrink"]["records"][0]["name"] = HOSTILE
    d["data_faults"][0]["record"] = HOSTILE
    d["where"][0] |= {"axis": "record", "low": HOSTILE, "high": None, "sentence": HOSTILE}
    d["warnings"] = [HOSTILE]
    d["command"] = HOSTILE
    d["next_experiment"] = {HOSTILE: HOSTILE}
    d["records"] = [{"file": HOSTILE, "role": "train", "rows": 1, "rate_hz": 1.0, "seconds": 1.0}]
    d["ranking"].append(entry(HOSTILE, 0.1, 0.1, **{HOSTILE: 1.0}))
    d["detectable"][HOSTILE] = 1.0
    return d
