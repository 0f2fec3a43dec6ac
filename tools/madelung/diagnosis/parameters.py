"""Parameters of a fitted hypothesis in the contract's keys, with intervals."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from madelung.diagnosis.effects.form import Form, Param
from madelung.diagnosis.fit import Fit, Problem

Array = NDArray[np.float64]
Z95 = 1.96
BLOCKS = 8
"""Of each record, that are taken as independent."""
MINOR_MODE = 0.1
"""Of the largest mode's share of the displacement, below which a mode comes last."""


def reported(effect: str, full: Fit, problem: Problem) -> dict[str, dict[str, Any]]:
    """``{key: {"value": x, "ci95": [lo, hi]}}`` of one effect of a fit with its covariance.

    Where an interval of a logarithmic parameter is given it is not symmetric. A parameter that the
    case fixes is marked: ``"fixed": True``.
    """
    form = next(f for f in full.forms if f.effect == effect)
    spread = Z95 * _errors(full, problem)
    names = [p.key for p in full.params]
    by_key = dict(zip(names, spread[full.beta.size :], strict=False)) if spread.size else {}

    def interval(p: Param) -> dict[str, Any]:
        value, s = full.values[p.key], float(by_key.get(p.key, 0.0))
        s = min(s, 50.0) if p.log else s  # beyond, the bounds decide
        low, high = (value * np.exp(-s), value * np.exp(s)) if p.log else (value - s, value + s)
        entry = _entry(value, max(float(low), p.low), min(float(high), p.high))
        return entry | {"fixed": True} if p.low == p.high else entry

    if effect == "creep":
        return _creep(form, full, by_key)
    if effect == "gain_offset":
        return _gain(full, interval, form)
    if effect == "periodic_disturbance":
        return _lines(form, full, interval)
    if effect == "resonance":
        return _modes(form, full, interval)
    return {p.key: interval(p) for p in form.params}


def _errors(full: Fit, problem: Problem) -> Array:
    """Standard errors of all that was fitted, (k,).

    From the curvature of the cost at the optimum, widened where the fit leaves more than noise; or
    larger, from how differently the blocks of the records pull: what a model leaves that is not
    quite the device's is no white noise (White's sandwich, by clusters).
    """
    widen = max(1.0, float(np.sqrt(full.cost / max(problem.rows, 1))))
    curved: Array = widen * np.sqrt(np.maximum(np.diag(full.covariance), 0.0))
    if not curved.size:
        return curved
    pulls = [
        full.jacobian[:, rows] @ full.residual[rows]
        for place in problem.slices
        for rows in np.array_split(np.arange(place.start, place.stop), BLOCKS)
    ]
    moved = np.array(pulls) @ full.covariance
    between: Array = np.sqrt(len(pulls) / (len(pulls) - 1) * np.sum(moved**2, axis=0))
    return np.maximum(curved, between)


def _entry(value: float, low: float, high: float) -> dict[str, Any]:
    return {"value": float(value), "ci95": [float(low), float(high)]}


def _creep(form: Form, fit: Fit, spread: dict[str, float]) -> dict[str, dict[str, Any]]:
    """Share of the step between 1 s and 10 s after it, from the ladder's step response."""
    from madelung.path import SignalPath

    assert form.path is not None
    ladder = form.path(SignalPath(0.0, 1.0, (0.0,)), fit.values).creep
    taus = np.array([m.tau_s for m in ladder])
    gains = np.array([m.gain for m in ladder])
    weight = np.exp(-1.0 / taus) - np.exp(-10.0 / taus)
    start = 1.0 + float(gains @ -np.expm1(-0.1 / taus))
    value = float(weight @ gains) / start
    s = float(np.sqrt(np.sum((weight * [spread.get(k, 0.0) for k in form.keys]) ** 2))) / start
    shares = {
        f"gain_at_{t:.3g}_s": _entry(
            fit.values[k], fit.values[k] - spread.get(k, 0.0), fit.values[k] + spread.get(k, 0.0)
        )
        for k, t in zip(form.keys, taus, strict=True)
    }
    return {"creep_per_decade": _entry(value, value - s, value + s)} | shares


def _gain(
    fit: Fit, interval: Callable[[Param], dict[str, Any]], form: Form
) -> dict[str, dict[str, Any]]:
    """The offset at y(u_min): y' = gain (y - y(u_min)) + y(u_min) + offset."""
    gain, offset = (interval(p) for p in form.params)
    shift = (gain["value"] - 1.0) * float(fit.beta[0])
    moved = [v + shift for v in offset["ci95"]]
    return {"gain": gain, "offset_um": offset | _entry(offset["value"] + shift, *moved)}


def _modes(
    form: Form, fit: Fit, interval: Callable[[Param], dict[str, Any]]
) -> dict[str, dict[str, Any]]:
    """fn, zeta and share of every mode, the lowest first of those that carry something."""
    by_key = {p.key: p for p in form.params}
    found = [i for i in "12" if f"fn{i}_hz" in by_key]
    shares = {i: abs(fit.values.get(f"share{i}", 1.0)) for i in found}
    least = MINOR_MODE * max(shares.values())
    found.sort(key=lambda i: (shares[i] < least, fit.values[f"fn{i}_hz"]))
    out: dict[str, dict[str, Any]] = {}
    for place, i in enumerate(found, 1):
        tail = "" if place == 1 else str(place)
        out |= {f"fn{tail}_hz": interval(by_key[f"fn{i}_hz"])}
        out |= {f"zeta{tail}": interval(by_key[f"zeta{i}"])}
        if f"share{i}" in by_key:
            out |= {f"share{place}": interval(by_key[f"share{i}"])}
    return out


def _lines(
    form: Form, fit: Fit, interval: Callable[[Param], dict[str, Any]]
) -> dict[str, dict[str, Any]]:
    """Frequency and amplitude (mean over records) of every line, the strongest first."""
    found = []
    for p in form.params:
        if not p.key.startswith("freq"):
            continue
        i = p.key[4:-3]
        waves = [q for q in form.params if q.key.startswith(f"cos{i}:")]
        amps = [
            float(np.hypot(fit.values[q.key], fit.values[q.key.replace("cos", "sin", 1)]))
            for q in waves
        ]
        amp = float(np.sqrt(np.mean(np.square(amps))))
        fitted = [np.ptp(interval(q)["ci95"]) / 2 for q in waves]
        error = Z95 * float(np.std(amps)) / np.sqrt(max(len(amps), 1))
        error = max(error, float(np.sqrt(np.mean(np.square(fitted)) / len(fitted))))
        found.append((amp, interval(p), _entry(amp, max(amp - error, 0.0), amp + error)))
    found.sort(key=lambda f: -f[0])
    out: dict[str, dict[str, Any]] = {}
    for n, (_, freq, amp_entry) in enumerate(found):
        tail = "" if n == 0 else f"_{n + 1}"
        out |= {f"freq_hz{tail}": freq, f"amp_um{tail}": amp_entry}
    return out
