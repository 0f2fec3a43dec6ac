"""Sensor box: gain and offset, drift, clock skew, lines; they began after the identification."""

from __future__ import annotations

import numpy as np

from madelung.diagnosis.case import Trace
from madelung.diagnosis.effects.form import (
    Array,
    Form,
    Measure,
    Param,
    Scales,
    Values,
    null_start,
    over_time,
)

LINE_SHARE = 0.1
"""Of the stroke, that a line's amplitude is expected below."""
DRIFT_DEGREE = 8
"""Of a polynomial over the longest record: up to two swings and a half."""
SKEW_MAX_PPM = 20_000.0
SKEW_NEAR_PPM = 3000.0
"""Within it, starts lie close together."""
SKEW_STARTS = 160
BEYOND_ROWS = 10.0
"""Behind the end of a record, that a straight line is good for."""


def sensor_forms(s: Scales) -> list[Form]:
    """Every model of the sensor box, but for lines."""
    return [*_gains(s), *_drifts(s), *_skews(s)]


def _later(measure: Measure) -> Measure:
    """Only in records taken after the identification."""
    return lambda y, trace, v: y if trace.role == "identify" else measure(y, trace, v)


def _gains(s: Scales) -> list[Form]:
    gain = (
        Param("gain", 0.5, 2.0, null=1.0),
        Param("offset_um", -s.stroke_um, s.stroke_um, scale=s.stroke_um),
    )
    return [
        Form(
            "gain_offset",
            "gain and offset",
            gain,
            null_start(gain),
            measure=_later(lambda y, _, v: v["gain"] * y + v["offset_um"]),
            linear=True,
        )
    ]


def _drifts(s: Scales) -> list[Form]:
    drift = (
        Param("drift_um_per_s", -s.stroke_um, s.stroke_um, scale=s.stroke_um / s.length_max_s),
        Param("settle_um", -s.stroke_um, s.stroke_um, scale=s.stroke_um),
        Param("settle_s", 0.01 * s.length_max_s, 3 * s.length_max_s, log=True),
    )
    bends = tuple(
        Param(f"drift{k}_um", -s.stroke_um, s.stroke_um, scale=s.stroke_um)
        for k in range(1, DRIFT_DEGREE + 1)
    )
    small = 0.002 * s.stroke_um

    def drifted(y: Array, trace: Trace, v: Values) -> Array:
        t = trace.t_s
        moved: Array = y + v["drift_um_per_s"] * t - v["settle_um"] * np.expm1(-t / v["settle_s"])
        return moved

    def bent(y: Array, trace: Trace, v: Values) -> Array:
        moved: Array = y + over_time(trace, s.length_max_s, [0.0, *(v[p.key] for p in bends)])
        return moved

    return [
        Form(
            "drift",
            "linear and exponential",
            drift,
            lambda _: [
                {
                    "drift_um_per_s": small / s.length_max_s,
                    "settle_um": small,
                    "settle_s": k * s.length_max_s,
                }
                for k in (0.05, 0.15, 0.4, 1.0)
            ],
            measure=_later(drifted),
        ),
        Form(
            "drift",
            "smooth in time",
            bends,
            null_start(bends),
            measure=_later(bent),
            linear=True,
        ),
    ]


def _skews(s: Scales) -> list[Form]:
    skew = (Param("skew_ppm", -SKEW_MAX_PPM, SKEW_MAX_PPM, scale=1000.0),)
    # Where the command jumps, a skew shows only to who is wrong by less than a sample at the end.
    near = max(0.5e6 * s.step_min_s / s.length_max_s, 2 * SKEW_NEAR_PPM / SKEW_STARTS)
    ppm = np.arange(-SKEW_NEAR_PPM, SKEW_NEAR_PPM + near, near)
    skews = [{"skew_ppm": float(p)} for p in (*ppm, -SKEW_MAX_PPM / 2, SKEW_MAX_PPM / 2)]
    return [
        Form(
            "clock_skew",
            "smooth command",
            skew,
            lambda _: skews,
            measure=_later(lambda y, trace, v: cubic(y, _places(trace, v))),
        ),
        Form(
            "clock_skew",
            "command linear between samples",
            skew,
            lambda _: skews,
            resample=_places,
        ),
    ]


def _places(trace: Trace, v: Values) -> Array:
    n: Array = np.arange(trace.u_V.size, dtype=np.float64)
    return n * (1 + v["skew_ppm"] * 1e-6)


def cubic(y: Array, at: Array) -> Array:
    """Values of y at fractional samples, (n,), third-order Lagrange; `beyond` the end."""
    base = np.clip(np.floor(at).astype(np.int64) - 1, 0, max(y.size - 4, 0))
    f = np.clip(at - base, 0.0, 3.0)
    w0 = -(f - 1) * (f - 2) * (f - 3) / 6
    w1 = f * (f - 2) * (f - 3) / 2
    w2 = -f * (f - 1) * (f - 3) / 2
    w3 = f * (f - 1) * (f - 2) / 6
    out: Array = w0 * y[base] + w1 * y[base + 1] + w2 * y[base + 2] + w3 * y[base + 3]
    return out + beyond(at, y.size, y[-1] - y[-2])


def beyond(at: Array, rows: int, rise: float) -> Array:
    """What a value that rises so much in a sample gains behind a record's last row, (n,)."""
    return np.clip(at - (rows - 1), 0.0, BEYOND_ROWS) * rise


def line_form(freq_hz: tuple[float, ...], traces: tuple[str, ...], s: Scales) -> Form:
    """Periodic disturbance at given start frequencies; a phase of its own in each record."""
    params: list[Param] = []
    for i, f in enumerate(freq_hz):
        width = 0.5 / s.length_max_s
        params.append(Param(f"freq{i}_hz", max(f - 4 * width, 1e-3), f + 4 * width, scale=width))
        for name in traces:
            for part in ("cos", "sin"):
                params.append(Param(f"{part}{i}:{name}", -s.stroke_um, s.stroke_um))

    def measure(y: Array, trace: Trace, v: Values) -> Array:
        if trace.role != "train":  # the phase on another record cannot be known, even if it has
            return y  # the name of one that was fitted
        total = y
        for i in range(len(freq_hz)):
            phase = 2 * np.pi * v[f"freq{i}_hz"] * trace.t_s
            total = total + v[f"cos{i}:{trace.name}"] * np.cos(phase)
            total = total + v[f"sin{i}:{trace.name}"] * np.sin(phase)
        return total

    start = {p.key: 0.0 for p in params} | {f"freq{i}_hz": f for i, f in enumerate(freq_hz)}
    amps = [p.key for p in params if not p.key.startswith("freq")]
    return Form(
        "periodic_disturbance",
        f"{len(freq_hz)} line{'s' if len(freq_hz) > 1 else ''}",
        tuple(params),
        lambda _: [start],
        measure=measure,
        linear=True,
        # At half a record's rate one of the two parts cannot be seen in it.
        priors=tuple({key: 1.0 / (LINE_SHARE * s.stroke_um)} for key in amps),
    )
