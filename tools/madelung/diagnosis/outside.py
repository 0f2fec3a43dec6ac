"""Disturbances that no effect of the vocabulary is, as models to hold what was accepted against.

They have no name in a verdict. But where one of them explains the records better than the effects
that were accepted, with no more models, those are not proven, and the verdict is `unknown`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray
from scipy.signal import lfilter

from madelung.diagnosis.case import Trace
from madelung.diagnosis.forms import Form, Param, Scales, Values

Array = NDArray[np.float64]
Columns = Callable[[Array, Trace], Array]
"""What a sensor may add to a displacement as a share of the stroke, (n,): terms (count, n)."""

OUTSIDE = "outside"
"""In the place of an effect's name."""
GAIN_DEGREE = 3
WANDER_DEGREE = 5
CURVE_DEGREE = 3
HEAT_TAUS = 6


def outside_forms(s: Scales, traces: Sequence[Trace]) -> list[Form]:
    """Every disturbance, for the records of a case."""
    names = [t.name for t in traces if t.role == "train"]

    def gain_in_time(share: Array, trace: Trace) -> Array:
        moves = _over_time(trace, GAIN_DEGREE, s.length_max_s)
        return np.vstack([moves, moves * share])

    found = [
        _sensor("the sensor's gain moves in time", 2 * GAIN_DEGREE + 2, gain_in_time, s),
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


def _sensor(
    name: str, count: int, columns: Columns, s: Scales, records: Sequence[str] = ()
) -> Form:
    """Terms that a sensor adds after the identification; weights in um, if given by record."""
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
        seen: Array = y + np.array([v[k] for k in own]) @ columns(y / s.stroke_um, trace)
        return seen

    start = {p.key: 0.0 for p in params}
    return Form(OUTSIDE, name, params, lambda _: [start], measure=measure, linear=True)


def _over_time(trace: Trace, degree: int, length_s: float) -> Array:
    """Polynomials of time, (degree + 1, n); all but the first vanish at the start."""
    rows = legvander(2 * trace.t_s / length_s - 1, degree).T
    rows[1:] -= legvander(np.array([-1.0]), degree)[0, 1:, None]
    return np.asarray(rows)


def _bent(share: Array, trace: Trace) -> Array:
    return np.array([share**k for k in range(CURVE_DEGREE + 1)])


def _gain_and_slope(share: Array, trace: Trace) -> Array:
    moves = _over_time(trace, 1, trace.u_V.size * trace.step_s)
    return np.vstack([moves, moves * share])


def _wander(share: Array, trace: Trace) -> Array:
    return _over_time(trace, WANDER_DEGREE, trace.u_V.size * trace.step_s)


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
