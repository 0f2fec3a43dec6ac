"""Disturbances that no effect of the vocabulary is, as models to hold what was accepted against.

They have no name in a verdict. But where one of them explains the records better than the effects
that were accepted, with no more models, those are not proven, and the verdict is `unknown`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import NDArray
from scipy.signal import lfilter

from madelung.diagnosis.case import Trace
from madelung.diagnosis.effects.form import Form, Param, Scales, Values, over_time

Array = NDArray[np.float64]
Added = Callable[[Array, Trace, Array], Array]
"""What a sensor adds, um, to a displacement as a share of the stroke, (n,), by weights in um."""

OUTSIDE = "outside"
"""In the place of an effect's name."""
GAIN_DEGREE = 3
WANDER_DEGREE = 5
CURVE_DEGREE = 3
HEAT_TAUS = 6


def outside_forms(s: Scales, traces: Sequence[Trace]) -> list[Form]:
    """Every disturbance, for the records of a case."""
    names = [t.name for t in traces if t.role == "train"]

    def gain_in_time(share: Array, trace: Trace, w: Array) -> Array:
        return _gain_over(share, trace, w, s.length_max_s)

    found = [
        _sensor("the sensor's gain moves in time", 2 * (GAIN_DEGREE + 1), gain_in_time, s),
        _sensor("the sensor's curve has bent", CURVE_DEGREE + 1, _bent, s),
        *(_heating(power, s) for power in (1.0, 2.0)),
    ]
    if len(names) > 1:
        found += [
            _sensor("gain and offset differ from record to record", 4, _gain_and_slope, s, names),
            _sensor(
                "slow movements differ from record to record", WANDER_DEGREE + 1, _wander, s, names
            ),
        ]
    return found


def _sensor(name: str, count: int, added: Added, s: Scales, records: Sequence[str] = ()) -> Form:
    """What a sensor adds after the identification, by so many weights, um; if given, by record."""
    keys = {r: [f"outside{k}_um:{r}" for k in range(count)] for r in records or ("",)}
    params = tuple(
        Param(key, -s.stroke_um, s.stroke_um, scale=s.stroke_um)
        for own in keys.values()
        for key in own
    )

    def measure(y: Array, trace: Trace, v: Values) -> Array:
        own = keys.get(trace.name if records else "")
        if trace.role == "identify" or own is None:
            return y
        return y + added(y / s.stroke_um, trace, np.array([v[k] for k in own]))

    start = {p.key: 0.0 for p in params}
    return Form(OUTSIDE, name, params, lambda _: [start], measure=measure, linear=True)


def _gain_over(share: Array, trace: Trace, weights: Array, length_s: float) -> Array:
    """An offset and a gain that move in time, by half of the weights each."""
    offset, gain = (over_time(trace, length_s, w) for w in np.split(weights, 2))
    return offset + gain * share


def _gain_and_slope(share: Array, trace: Trace, weights: Array) -> Array:
    return _gain_over(share, trace, weights, _length_s(trace))


def _wander(_: Array, trace: Trace, weights: Array) -> Array:
    return over_time(trace, _length_s(trace), weights)


def _bent(share: Array, _: Trace, weights: Array) -> Array:
    return np.asarray(polyval(share, weights))


def _length_s(trace: Trace) -> float:
    return trace.u_V.size * trace.step_s


def _heating(power: float, s: Scales) -> Form:
    """Losses, by a power of the rate, warm the stage: it moves, and its gain changes."""
    params = (
        Param("heat_um", -s.stroke_um, s.stroke_um, scale=s.stroke_um),
        Param("heat_gain", -1.0, 1.0),
        Param("heat_s", 0.01 * s.length_max_s, 3 * s.length_max_s, log=True),
    )
    taus = np.geomspace(0.02 * s.length_max_s, s.length_max_s, HEAT_TAUS)

    def measure(y: Array, trace: Trace, v: Values) -> Array:
        rate = np.abs(np.diff(trace.u_V, prepend=trace.u_V[0])) / trace.step_s
        decay = float(np.exp(-trace.step_s / v["heat_s"]))
        warm = lfilter([1 - decay], [1.0, -decay], (rate / s.rate_max_V_per_s) ** power)
        seen: Array = y + (v["heat_um"] + v["heat_gain"] * y) * warm
        return seen

    return Form(
        OUTSIDE,
        f"losses warm the stage, by the rate's power {power:g}",
        params,
        lambda _: [{"heat_um": 0.01 * s.stroke_um, "heat_gain": 0.0, "heat_s": t} for t in taus],
        measure=measure,
    )
