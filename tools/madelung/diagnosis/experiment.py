"""The experiment that would tell apart what is still confused."""

from __future__ import annotations

from typing import Any

import numpy as np

from madelung.diagnosis.effects.form import Scales
from madelung.diagnosis.verdict import Verdict

_DYNAMIC = {"delay", "amplifier_lag", "resonance", "rate_dependence", "slew_limit"}
_SLOW = {"creep", "drift", "clock_skew"}
_STATIC = {"saturation", "asymmetry", "non_masing", "backlash", "gain_offset", "initial_state"}
RATE_MAX_HZ = 100_000.0


def next_experiment(verdict: Verdict, s: Scales) -> dict[str, Any] | None:
    """Excitation, rate, length and amplitude, with the reason; None where nothing is confused.

    The keys ``waveform``, ``rate_hz``, ``seconds``, ``u_min_V``, ``u_max_V``, ``f_low_hz``,
    ``f_high_hz`` are what ``madelung simulate --from`` reads.
    """
    if verdict.status == "identified":
        return None
    names = set(verdict.candidates)
    if verdict.status == "ambiguous" and names and names <= _SLOW | {"gain_offset"}:
        return _steps(s, f"steps, then rest: {_list(names)} differ in what follows a step")
    if verdict.status == "ambiguous" and names & _STATIC and not names & _DYNAMIC:
        return _loops(
            s,
            f"nested loops of shrinking swing: {_list(names)} act differently on small swings",
        )
    why = {
        "ambiguous": f"phase and gain over frequency tell {_list(names)} apart",
        "no_gap": "fast excitation: this campaign could not have seen what acts at high rates",
        "unknown": "a random-phase multisine, repeated: its periods separate noise, nonlinear "
        "distortion and what does not repeat",
    }[verdict.status]
    return _multisine(s, why)


def _multisine(s: Scales, why: str) -> dict[str, Any]:
    """Up to where half the range would move twice as fast as anything in this campaign."""
    rate = min(max(4.0 / s.step_min_s, 2000.0), RATE_MAX_HZ)
    fastest_hz = 2 * s.rate_max_V_per_s / (np.pi * 0.5 * s.range_V)
    why += "; look at the amplifier's current and at resonances before it is run"
    return {
        "waveform": "multisine",
        "rate_hz": rate,
        "seconds": 20.0,
        "f_low_hz": 0.5,
        "f_high_hz": float(np.clip(fastest_hz, 5.0, rate / 20)),
        **_levels(s, 0.25, 0.75),
        "why": why,
    }


def _steps(s: Scales, why: str) -> dict[str, Any]:
    seconds = max(4 * s.length_max_s, 120.0)
    return {
        "waveform": "steps",
        "rate_hz": 200.0,
        "seconds": seconds,
        "f_low_hz": 4 / seconds,
        "f_high_hz": 4 / seconds,
        **_levels(s, 0.0, 1.0),
        "why": why,
    }


def _loops(s: Scales, why: str) -> dict[str, Any]:
    return {
        "waveform": "decaying",
        "rate_hz": 1000.0,
        "seconds": 60.0,
        "f_low_hz": 0.2,
        "f_high_hz": 0.2,
        **_levels(s, 0.0, 1.0),
        "why": why,
    }


def _levels(s: Scales, low: float, high: float) -> dict[str, float]:
    return {"u_min_V": s.u_min_V + low * s.range_V, "u_max_V": s.u_min_V + high * s.range_V}


def _list(names: set[str]) -> str:
    return " and ".join(sorted(n.replace("_", " ") for n in names))
