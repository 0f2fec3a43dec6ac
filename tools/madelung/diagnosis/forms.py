"""The effects as physical models: parameters in units and bounds, and what they change.

A form is one model of one effect; an effect may have several (hard and soft saturation, one and
two modes). A form changes the signal path that the C core runs, or the measured displacement
behind it (what no open-loop firmware can run), or the history before a record.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.polynomial.legendre import legval
from numpy.typing import ArrayLike, NDArray

from madelung.diagnosis.case import Trace
from madelung.path import CreepMode, Mode, SignalPath

Array = NDArray[np.float64]
Values = Mapping[str, float]

CREEP_TAU_S = tuple(float(10.0**k) for k in np.arange(-2.5, 3.01, 0.5))
CREEP_STEP = 0.0015
"""Neighbouring creep modes are expected to differ by about this share (log-like spectrum)."""
LINES_MAX = 3
LINE_SHARE = 0.1
"""Of the stroke, that a line's amplitude is expected below."""
DRIFT_DEGREE = 8
"""Of a polynomial over the longest record: up to two swings and a half."""
SKEW_MAX_PPM = 20_000.0
SKEW_NEAR_PPM = 3000.0
"""Within it, starts lie close together."""
SKEW_STARTS = 160


@dataclass(frozen=True)
class Param:
    """A parameter: bounds in its unit, the value without effect, whether it is searched as log."""

    key: str
    low: float
    high: float
    null: float = 0.0
    log: bool = False
    scale: float = 1.0
    """Typical size in its unit: finite steps are a thousandth of it."""


@dataclass(frozen=True)
class Scales:
    """What bounds and starts refer to, from the case."""

    u_min_V: float
    range_V: float
    stroke_um: float
    rate_max_V_per_s: float
    step_min_s: float
    length_max_s: float
    start_max_V: float


Starts = Callable[[Scales], list[dict[str, float]]]
Apply = Callable[[SignalPath, Values], SignalPath]
Measure = Callable[[Array, Trace, Values], Array]
History = Callable[[Trace, Values], Array]
Resample = Callable[[Trace, Values], Array]


@dataclass(frozen=True)
class Form:
    """One physical model of one effect.

    ``path`` changes the signal path, ``measure`` the displacement behind it, ``history`` gives
    voltages before a record, ``resample`` the samples' true places, (n,) in sample times, for a
    command that is linear between samples; exactly one of them is set. ``linear``: the
    displacement is linear in the parameters, so that one start serves. ``priors`` are rows
    (weights by key) of weak expectations that regularise what the data cannot excite.
    """

    effect: str
    name: str
    params: tuple[Param, ...]
    starts: Starts
    path: Apply | None = None
    measure: Measure | None = None
    history: History | None = None
    resample: Resample | None = None
    linear: bool = False
    priors: tuple[dict[str, float], ...] = field(default=())
    refines: bool = False
    """Only tried where a simpler form of the effect has been fitted, from its values."""

    @property
    def keys(self) -> tuple[str, ...]:
        """Of its parameters."""
        return tuple(p.key for p in self.params)

    def null(self) -> dict[str, float]:
        """Values without effect."""
        return {p.key: p.null for p in self.params}


def _same_names(params: tuple[Param, ...]) -> Apply:
    """Parameters that are fields of the signal path under their own keys."""
    return lambda path, v: path.but(**{p.key: v[p.key] for p in params})


def _null_start(form_params: tuple[Param, ...]) -> Starts:
    return lambda _: [{p.key: p.null for p in form_params}]


def over_time(trace: Trace, length_s: float, coefficients: ArrayLike) -> Array:
    """A Legendre series of time, (n,); all its terms but the first vanish at the record's start."""
    c = np.asarray(coefficients, np.float64)
    series = np.array([0.0, *c[1:]])
    z = 2 * trace.t_s / length_s - 1
    moved: Array = c[0] + legval(z, series) - float(legval(-1.0, series))
    return moved


def forms(s: Scales) -> list[Form]:
    """Every form of every effect for a case."""
    return [
        *_input_forms(s),
        *_hysteresis_forms(s),
        *_mechanics_forms(s),
        *_sensor_forms(s),
    ]


def _input_forms(s: Scales) -> list[Form]:
    top = s.u_min_V + s.range_V
    high = Param("high_V", s.u_min_V + 0.5 * s.range_V, top + 0.2 * s.range_V, scale=s.range_V)
    low = Param("low_V", s.u_min_V - 0.2 * s.range_V, s.u_min_V + 0.45 * s.range_V, scale=s.range_V)
    knee = Param("knee_V", 1e-3 * s.range_V, 0.15 * s.range_V, log=True)
    begins = Param("knee_V", 1e-3 * s.range_V, 0.5 * s.range_V, log=True)
    sharp = Param("knee_power", 1.0, 32.0, log=True)
    shares = (0.01, 0.03, 0.07, 0.12, 0.2)

    def saturation(path: SignalPath, v: Values) -> SignalPath:
        high_V, low_V = v.get("high_V", path.high_V), v.get("low_V", path.low_V)
        return path.but(
            high_V=high_V,
            low_V=low_V,
            knee_V=min(v.get("knee_V", 0.0), 0.49 * (high_V - low_V)),  # they must not meet
            knee_power=v.get("knee_power", 0.0),
        )

    at = {"high_V": lambda d: top - d * s.range_V, "low_V": lambda d: s.u_min_V + d * s.range_V}

    both = ("both ends", (high, low))

    def clip(name: str, ends: tuple[Param, ...], *knees: Param) -> Form:
        starts = [{p.key: at[p.key](d) for p in ends} for d in shares]
        if knees:
            starts = [v | {"knee_V": w * s.range_V} for v in starts for w in (0.01, 0.05)]
        if sharp in knees:
            wide = [v | {"knee_V": 0.4 * s.range_V} for v in starts[::2]]
            starts = [v | {"knee_power": p} for v in (*starts, *wide) for p in (2.0, 8.0)]
        return Form(
            "saturation",
            name,
            (*ends, *knees),
            lambda _: starts,
            path=saturation,
            refines=bool(knees),
        )

    longest = min(0.05, 0.1 * s.length_max_s, 400 * s.step_min_s)

    def delay(name: str, substeps: int) -> Form:
        return Form(
            "delay",
            name,
            (Param("delay_s", 0.0, longest, scale=s.step_min_s),),
            lambda _: [{"delay_s": d} for d in np.geomspace(2e-5, longest / 2, 20)],
            path=lambda path, v: path.but(delay_s=v["delay_s"], substeps_min=substeps),
        )

    corner = Param("corner_hz", 0.3, 100_000.0, log=True)
    corners = [float(f) for f in np.geomspace(1.0, 30000.0, 14)]
    slew = Param("slew_V_per_s", 1e-3 * s.rate_max_V_per_s, s.rate_max_V_per_s, log=True)
    slews = [s.rate_max_V_per_s * float(k) for k in np.geomspace(0.02, 0.98, 14)]
    return [
        delay("smooth command", 1),
        delay("command linear between samples", 4),
        *(
            clip(f"{kind}, {name}", ends, *knees)
            for kind, knees in (("hard", ()), ("soft", (knee,)), ("rounded", (begins, sharp)))
            for name, ends in (("high end", (high,)), ("low end", (low,)), both)
        ),
        Form(
            "slew_limit",
            "slew limit",
            (slew,),
            lambda _: [{"slew_V_per_s": v} for v in slews],
            path=_same_names((slew,)),
        ),
        Form(
            "slew_limit",
            "unequal, about a geometric mean",
            (slew, Param("rise_over_fall", 0.3, 3.0, log=True)),
            lambda _: [
                {"slew_V_per_s": v, "rise_over_fall": r}
                for v in slews[-6:]
                for r in (0.85, 0.95, 1.05, 1.15)
            ],
            path=lambda path, v: path.but(
                slew_V_per_s=v["slew_V_per_s"] * v["rise_over_fall"] ** 0.5,
                slew_fall_V_per_s=v["slew_V_per_s"] / v["rise_over_fall"] ** 0.5,
            ),
        ),
        Form(
            "amplifier_lag",
            "one pole",
            (corner,),
            lambda _: [{"corner_hz": f} for f in corners],
            path=_same_names((corner,)),
        ),
        Form(
            "amplifier_lag",
            "one pole, and faster ones as a delay",
            (corner, Param("delay_share", 0.0, 0.13)),
            lambda _: [{"corner_hz": f, "delay_share": 0.1} for f in corners],
            path=lambda path, v: path.but(
                corner_hz=v["corner_hz"],
                delay_s=path.delay_s
                + min(v["delay_share"] / (2 * np.pi * v["corner_hz"]), longest),
                substeps_min=4,
            ),
            refines=True,
        ),
    ]


def _shape_form(
    effect: str, name: str, terms: tuple[tuple[int, int], ...], s: Scales, refines: bool = False
) -> Form:
    """Terms (j, k) of s'^j m'^k."""
    params = tuple(
        Param(f"g{k}{j}_um", -2 * s.stroke_um, 2 * s.stroke_um, scale=s.stroke_um) for j, k in terms
    )

    def path(base: SignalPath, v: Values) -> SignalPath:
        shape = np.zeros((4, 4)) if base.shape is None else np.array(base.shape)
        for (j, k), p in zip(terms, params, strict=True):
            shape[k - 1, j - 1] += v[p.key]
        return base.but(shape=tuple(map(tuple, shape.tolist())))

    weak = tuple({p.key: 1.0 / (0.1 * s.stroke_um)} for p in params)
    return Form(
        effect,
        name,
        params,
        _null_start(params),
        path=path,
        linear=True,
        priors=weak,
        refines=refines,
    )


def _envelope_form(side: str, s: Scales) -> Form:
    """A generalised play whose input function differs in one sense of the command."""
    size, skew = f"{side}_V", f"{side}_skew"
    params = (
        Param(size, 0.0, 0.2 * s.range_V, scale=0.1 * s.range_V),
        Param(skew, -1.0, 1.0),
        Param("follow", 0.0, 1.0),
    )
    return Form(
        "asymmetry",
        f"generalised play, {'rising' if side == 'rise' else 'falling'} envelope",
        params,
        lambda _: [
            {size: c * s.range_V, skew: 0.0, "follow": f} for c in (0.003, 0.03) for f in (0.0, 1.0)
        ],
        path=_same_names(params),
    )


def _hysteresis_forms(s: Scales) -> list[Form]:
    power = Param("power", 0.05, 2.0, null=1.0)
    v_knee = Param("v_knee", 1e-3, 3.0, log=True)
    tau = Param("velocity_tau_s", 0.05 * s.step_min_s, 100 * s.step_min_s, log=True)
    v_ref = max(0.3 * s.rate_max_V_per_s, 1e-6)

    def rate(key: str, of_speed: bool) -> Apply:
        def apply(path: SignalPath, v: Values) -> SignalPath:
            knee, p = v.get("v_knee", 0.0), v["power"]
            return path.but(
                **{key: v[key] / ((1 + knee) ** p - knee**p)},  # the parameter is c g(1)
                power=p,
                v_ref_V_per_s=v_ref,
                v_knee=knee,
                velocity_tau_s=v["velocity_tau_s"],
                of_speed=float(of_speed),
            )

        return apply

    def rate_forms(name: str, size: Param, start: float, of_speed: bool = False) -> list[Form]:
        """With a power of the rate; and with a law that is straight below a knee."""
        starts = [
            {size.key: start, "power": p, "velocity_tau_s": s.step_min_s}
            for p in (0.3, 0.6, 1.0, 1.5)
        ]
        kneed = [v | {"v_knee": k} for v in starts[1:3] for k in (0.03, 0.3)]
        plain = (size, power, tau)
        apply = rate(size.key, of_speed)
        return [
            Form("rate_dependence", name, plain, lambda _: starts, apply, refines=of_speed),
            Form(
                "rate_dependence",
                f"{name}, straight below a knee",
                (*plain, v_knee),
                lambda _: kneed,
                apply,
                refines=True,
            ),
        ]

    # Loops widen with the rate: the displacement lags behind, whatever the law.
    damping = Param("damping_um", -0.2 * s.stroke_um, 0.0, scale=s.stroke_um)
    widening = Param("widening", 0.0, 5.0)
    threshold = Param("threshold_V", 0.0, 0.3 * s.range_V, scale=0.1 * s.range_V)
    memoryless = ((1, 1), (1, 3), (3, 1))
    branches = ((1, 1), (2, 1), (3, 1), (1, 3), (2, 3))
    minor = ((1, 2), (2, 2), (3, 2), (1, 4))
    bouc = (
        Param("bouc_um", -0.5 * s.stroke_um, 0.5 * s.stroke_um, scale=s.stroke_um),
        Param("bouc_V", 0.02 * s.range_V, 3 * s.range_V, log=True),
        Param("bouc_power", 1.0, 3.0),
        Param("bouc_gamma", -0.8, 0.8),
    )
    dip = Param("start_dip_V", s.u_min_V, s.u_min_V + s.range_V, scale=s.range_V)
    peak = Param("start_peak_V", s.u_min_V, s.u_min_V + s.range_V, scale=s.range_V)
    return [
        _shape_form("asymmetry", "memoryless", memoryless, s),
        _shape_form("asymmetry", "branches", branches, s),
        *(_envelope_form(side, s) for side in ("rise", "fall")),
        # What is proven asymmetric bends minor loops too; no effect of its own (diagnose.md).
        _shape_form("asymmetry", "memoryless, with minor loops", (*memoryless, *minor), s, True),
        _shape_form("asymmetry", "branches, with minor loops", (*branches, *minor), s, True),
        _shape_form("non_masing", "minor loops", minor, s),
        Form(
            "non_masing",
            "a part by Bouc and Wen",
            bouc,
            lambda _: [
                {
                    "bouc_um": c * s.stroke_um,
                    "bouc_V": k * s.range_V,
                    "bouc_power": 1.5,
                    "bouc_gamma": 0.0,
                }
                for k in (0.1, 0.25, 0.5, 1.0)
                for c in (-0.05, 0.05)
            ],
            path=_same_names(bouc),
        ),
        *rate_forms("velocity damping", damping, -0.01 * s.stroke_um),
        *rate_forms("thresholds grow by a share", widening, 0.1),
        *rate_forms("thresholds grow by a share, not less at turns", widening, 0.1, True),
        *rate_forms("thresholds grow by a voltage", threshold, 0.01 * s.range_V),
        *rate_forms(
            "thresholds grow by a voltage, not less at turns", threshold, 0.01 * s.range_V, True
        ),
        Form(
            "rate_dependence",
            "viscous operators",
            (Param("relax_s", 0.2 * s.step_min_s, 0.1 * s.length_max_s, log=True),),
            lambda _: [{"relax_s": k * s.step_min_s} for k in (0.5, 2.0, 8.0, 32.0)],
            path=lambda path, v: path.but(relax_s=v["relax_s"], v_ref_V_per_s=v_ref),
        ),
        Form(
            "rate_dependence",
            "viscous operators, by the square of the force",
            (Param("relax_per_V_s", v_ref / s.range_V**2, 1e8 * v_ref / s.range_V**2, log=True),),
            lambda _: [
                {"relax_per_V_s": v_ref / (k * s.range_V) ** 2} for k in (0.003, 0.01, 0.03, 0.1)
            ],
            path=lambda path, v: path.but(relax_per_V_s=v["relax_per_V_s"], v_ref_V_per_s=v_ref),
        ),
        Form(
            "initial_state",
            "unknown peak",
            (peak,),
            lambda _: [
                {"start_peak_V": s.u_min_V + d * s.range_V} for d in np.arange(0.05, 1.01, 0.1)
            ],
            history=lambda trace, v: np.array([max(v["start_peak_V"], trace.u_V[0])]),
        ),
        Form(
            "initial_state",
            "unknown peak, then a dip",
            (peak, dip),
            lambda _: [
                {"start_dip_V": s.u_min_V + d * (s.start_max_V - s.u_min_V)}
                for d in (0.05, 0.3, 0.6, 0.9)
            ],
            history=lambda trace, v: np.array(
                [max(v["start_peak_V"], trace.u_V[0]), min(v["start_dip_V"], trace.u_V[0])]
            ),
            refines=True,
        ),
    ]


def _creep_form(name: str, taus: tuple[float, ...], s: Scales) -> Form:
    """A ladder whose spectrum is expected to be smooth over log tau (log-like creep)."""
    within = [t for t in taus if 3 * s.step_min_s < t < 10 * s.length_max_s]
    gains = tuple(Param(f"creep_{CREEP_TAU_S.index(t)}", -0.02, 0.2, scale=0.01) for t in within)
    step = CREEP_STEP * (2 if taus is not CREEP_TAU_S else 1)
    smooth = tuple({a.key: 1 / step, b.key: -1 / step} for a, b in pairwise(gains))
    return Form(
        "creep",
        name,
        gains,
        _null_start(gains),
        path=lambda path, v: path.but(
            creep=tuple(CreepMode(t, v[g.key]) for t, g in zip(within, gains, strict=True))
        ),
        linear=True,
        priors=smooth,
        refines=taus is CREEP_TAU_S,
    )


def _mechanics_forms(s: Scales) -> list[Form]:
    f_max = min(5000.0, 2.0 / s.step_min_s)

    def mode(i: int, share: bool) -> tuple[Param, ...]:
        own = (
            Param(f"fn{i}_hz", 3.0, f_max, log=True),
            Param(f"zeta{i}", 0.001, 0.25, log=True),
        )
        return (*own, Param(f"share{i}", -1.0, 2.0)) if share else own

    def modes(*indices: int) -> Apply:
        return lambda path, v: path.but(
            modes=tuple(
                Mode(v[f"fn{i}_hz"], v[f"zeta{i}"], v.get(f"share{i}", 1.0)) for i in indices
            )
        )

    band = Param("dead_band_um", 0.0, 0.2 * s.stroke_um, scale=0.1 * s.stroke_um)
    sprung = (band, Param("spring_share", 0.0, 0.5))
    bands = [s.stroke_um * float(k) for k in np.geomspace(3e-4, 0.05, 8)]
    grid = [
        {"fn1_hz": f, "zeta1": z}
        for f in np.geomspace(10.0, min(f_max, 3000.0), 40)
        for z in (0.03, 0.15)
    ]
    return [
        _creep_form("ladder, a mode a decade", CREEP_TAU_S[1::2], s),
        _creep_form("ladder, two modes a decade", CREEP_TAU_S, s),
        Form("resonance", "one mode", mode(1, False), lambda _: grid, path=modes(1)),
        Form(
            "resonance",
            "one mode, part of the displacement",
            mode(1, True),
            lambda _: [g | {"share1": 1.0} for g in grid[::3]],
            path=modes(1),
        ),
        Form(
            "resonance",
            "two modes",
            (*mode(1, True), *mode(2, True)),
            lambda _: [
                {"share1": 0.9, "share2": 0.1, "zeta2": 0.03, "fn2_hz": f}
                for f in np.geomspace(20.0, min(f_max, 3000.0), 80)
            ],
            path=modes(1, 2),
            refines=True,
        ),
        Form(
            "backlash",
            "dead band",
            (band,),
            lambda _: [{"dead_band_um": w} for w in bands],
            path=_same_names((band,)),
        ),
        Form(
            "backlash",
            "dead band, with a spring across it",
            sprung,
            lambda _: [{"dead_band_um": w, "spring_share": 0.1} for w in bands],
            path=_same_names(sprung),
            refines=True,
        ),
    ]


def _later(measure: Measure) -> Measure:
    """Only in records taken after the identification."""
    return lambda y, trace, v: y if trace.role == "identify" else measure(y, trace, v)


def _sensor_forms(s: Scales) -> list[Form]:
    gain = (
        Param("gain", 0.5, 2.0, null=1.0),
        Param("offset_um", -s.stroke_um, s.stroke_um, scale=s.stroke_um),
    )
    drift = (
        Param("drift_um_per_s", -s.stroke_um, s.stroke_um, scale=s.stroke_um / s.length_max_s),
        Param("settle_um", -s.stroke_um, s.stroke_um, scale=s.stroke_um),
        Param("settle_s", 0.01 * s.length_max_s, 3 * s.length_max_s, log=True),
    )
    skew = (Param("skew_ppm", -SKEW_MAX_PPM, SKEW_MAX_PPM, scale=1000.0),)
    # Where the command jumps, a skew shows only to who is wrong by less than a sample at the end.
    near = max(0.5e6 * s.step_min_s / s.length_max_s, 2 * SKEW_NEAR_PPM / SKEW_STARTS)
    ppm = np.arange(-SKEW_NEAR_PPM, SKEW_NEAR_PPM + near, near)
    skews = [{"skew_ppm": float(p)} for p in (*ppm, -SKEW_MAX_PPM / 2, SKEW_MAX_PPM / 2)]

    def drifted(y: Array, trace: Trace, v: Values) -> Array:
        t = trace.t_s
        moved: Array = y + v["drift_um_per_s"] * t - v["settle_um"] * np.expm1(-t / v["settle_s"])
        return moved

    bends = tuple(
        Param(f"drift{k}_um", -s.stroke_um, s.stroke_um, scale=s.stroke_um)
        for k in range(1, DRIFT_DEGREE + 1)
    )

    def bent(y: Array, trace: Trace, v: Values) -> Array:
        moved: Array = y + over_time(trace, s.length_max_s, [0.0, *(v[p.key] for p in bends)])
        return moved

    def places(trace: Trace, v: Values) -> Array:
        n: Array = np.arange(trace.u_V.size, dtype=np.float64)
        return n * (1 + v["skew_ppm"] * 1e-6)

    return [
        Form(
            "gain_offset",
            "gain and offset",
            gain,
            _null_start(gain),
            measure=_later(lambda y, _, v: v["gain"] * y + v["offset_um"]),
            linear=True,
        ),
        Form(
            "drift",
            "linear and exponential",
            drift,
            lambda _: [
                {
                    "drift_um_per_s": 0.002 * s.stroke_um / s.length_max_s,
                    "settle_um": 0.002 * s.stroke_um,
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
            _null_start(bends),
            measure=_later(bent),
            linear=True,
        ),
        Form(
            "clock_skew",
            "smooth command",
            skew,
            lambda _: skews,
            measure=_later(lambda y, trace, v: cubic(y, places(trace, v))),
        ),
        Form(
            "clock_skew",
            "command linear between samples",
            skew,
            lambda _: skews,
            resample=places,
        ),
    ]


def cubic(y: Array, at: Array) -> Array:
    """Values of y at fractional samples, (n,), third-order Lagrange; held beyond the ends."""
    base = np.clip(np.floor(at).astype(np.int64) - 1, 0, max(y.size - 4, 0))
    f = np.clip(at - base, 0.0, 3.0)
    w0 = -(f - 1) * (f - 2) * (f - 3) / 6
    w1 = f * (f - 2) * (f - 3) / 2
    w2 = -f * (f - 1) * (f - 3) / 2
    w3 = f * (f - 1) * (f - 2) / 6
    out: Array = w0 * y[base] + w1 * y[base + 1] + w2 * y[base + 2] + w3 * y[base + 3]
    return out


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
