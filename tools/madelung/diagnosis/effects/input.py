"""Input box: delay, saturation, slew limit, and the amplifier's lag of the command.

A pole behind the hysteresis (an overdamped stage, a sensor's filter) is called by the lag's name.
"""

from __future__ import annotations

import numpy as np

from madelung.diagnosis.effects.form import Form, Param, Scales, Values, same_names
from madelung.path import SignalPath

DELAY_MAX_S = 1.0
DELAY_MAX_STEPS = 400
"""Of the fastest record: the core's memory."""
CLIP_SHARES = (0.01, 0.03, 0.07, 0.12, 0.2)
"""Of the range, that a clip may cut off."""
SOFT_SLEW = 1.25
"""Of the fastest command's rate: a limit with a knee bends slower ones too; far above, it is a lag.
"""
LEAN_MAX = 0.4
"""A stack's capacitance grows by up to twice this share from one end of its range to the other."""
FAST_SHARE = 0.13
"""Of a pole's time constant, that faster ones may delay by."""


def input_forms(s: Scales) -> list[Form]:
    """Every model of the input box."""
    return [*_delays(s), *_saturations(s), *_slew_limits(s), *_lags(s)]


def _longest_delay_s(s: Scales) -> float:
    return min(DELAY_MAX_S, 0.1 * s.length_max_s, DELAY_MAX_STEPS * s.step_min_s)


def _delays(s: Scales) -> list[Form]:
    longest = _longest_delay_s(s)

    def delay(name: str, substeps: int) -> Form:
        return Form(
            "delay",
            name,
            (Param("delay_s", 0.0, longest, scale=s.step_min_s),),
            lambda _: [{"delay_s": d} for d in np.geomspace(2e-5, longest / 2, 20)],
            path=lambda path, v: path.but(delay_s=v["delay_s"], substeps_min=substeps),
        )

    return [delay("smooth command", 1), delay("command linear between samples", 4)]


def _saturations(s: Scales) -> list[Form]:
    """Hard; or with a knee: a softplus, a parabola, or by a power from where it begins on.

    Where the low end is cut off, what rests may have seen u_min itself all the same.
    """
    top = s.u_min_V + s.range_V
    high = Param("high_V", s.u_min_V + 0.5 * s.range_V, top + 0.2 * s.range_V, scale=s.range_V)
    low = Param("low_V", s.u_min_V - 0.2 * s.range_V, s.u_min_V + 0.45 * s.range_V, scale=s.range_V)
    knee = Param("knee_V", 1e-3 * s.range_V, 0.15 * s.range_V, log=True)
    begins = Param("knee_V", 1e-3 * s.range_V, 0.5 * s.range_V, log=True)
    half = Param("knee_V", 1e-3 * s.range_V, 0.3 * s.range_V, log=True)
    sharp = Param("knee_power", 1.0, 6.0, log=True)
    at = {"high_V": lambda d: top - d * s.range_V, "low_V": lambda d: s.u_min_V + d * s.range_V}

    def clip(name: str, ends: tuple[Param, ...], *knees: Param, free: bool = False) -> Form:
        starts = [{p.key: at[p.key](d) for p in ends} for d in CLIP_SHARES]
        if knees:
            starts = [v | {"knee_V": w * s.range_V} for v in starts for w in (0.01, 0.05)]
        if sharp in knees:
            wide = [v | {"knee_V": 0.4 * s.range_V} for v in starts[::2]]
            starts = [v | {"knee_power": p} for v in (*starts, *wide) for p in (1.5, 3.0)]
        return Form(
            "saturation",
            f"{name}, not at rest" if free else name,
            (*ends, *knees),
            lambda _: starts,
            path=lambda path, v: _clipped(path, v, parabolic=half in knees, free=free),
            refines=bool(knees),
        )

    knees_of = {"hard": (), "soft": (knee,), "parabolic": (half,), "rounded": (begins, sharp)}
    return [
        clip(f"{kind}, {name}", ends, *knees, free=free)
        for kind, knees in knees_of.items()
        for name, ends in (("high end", (high,)), ("low end", (low,)), ("both ends", (high, low)))
        for free in ((False, True) if low in ends else (False,))
    ]


def _clipped(path: SignalPath, v: Values, parabolic: bool, free: bool) -> SignalPath:
    high_V, low_V = v.get("high_V", path.high_V), v.get("low_V", path.low_V)
    return path.but(
        high_V=high_V,
        low_V=low_V,
        knee_V=min(v.get("knee_V", 0.0), 0.49 * (high_V - low_V)),  # they must not meet
        knee_power=v.get("knee_power", 0.0),
        parabolic=float(parabolic),
        rest_free=float(free),
    )


def _slew_limits(s: Scales) -> list[Form]:
    fastest = s.rate_max_V_per_s
    slew = Param("slew_V_per_s", 1e-3 * fastest, fastest, log=True)
    softly = Param("slew_V_per_s", 1e-3 * fastest, SOFT_SLEW * fastest, log=True)
    knee = Param("slew_knee_V", 1e-4 * s.range_V, 0.3 * s.range_V, log=True)
    slews = [fastest * float(k) for k in np.geomspace(0.02, 0.98, 14)]
    return [
        Form(
            "slew_limit",
            "slew limit",
            (slew,),
            lambda _: [{"slew_V_per_s": v} for v in slews],
            path=same_names((slew,)),
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
            "slew_limit",
            "with a knee, as of an input stage that saturates",
            (softly, knee),
            lambda _: [
                {"slew_V_per_s": v, "slew_knee_V": k * s.range_V}
                for v in (*slews[-5:], 1.1 * fastest)
                for k in (0.002, 0.01, 0.05)
            ],
            path=same_names((softly, knee)),
            unlikely=True,  # a small command sees nothing but a lag
        ),
    ]


def _lags(s: Scales) -> list[Form]:
    corner = Param("corner_hz", 0.3, 100_000.0, log=True)
    corners = [float(f) for f in np.geomspace(1.0, 30000.0, 14)]
    longest = _longest_delay_s(s)
    return [
        Form(
            "amplifier_lag",
            "one pole",
            (corner,),
            lambda _: [{"corner_hz": f} for f in corners],
            path=lambda path, v: path.but(corner_hz=v["corner_hz"], corner_lean=0.0, behind_hz=0.0),
        ),
        Form(
            "amplifier_lag",
            "one pole, of a load that grows with the voltage",
            (corner, Param("corner_lean", -LEAN_MAX, LEAN_MAX)),
            lambda _: [{"corner_hz": f, "corner_lean": 0.1} for f in corners],
            path=lambda path, v: path.but(
                corner_hz=v["corner_hz"], corner_lean=v["corner_lean"], behind_hz=0.0
            ),
            refines=True,
        ),
        Form(
            "amplifier_lag",
            "one pole behind the hysteresis",
            (corner,),
            lambda _: [{"corner_hz": f} for f in corners],
            path=lambda path, v: path.but(corner_hz=0.0, corner_lean=0.0, behind_hz=v["corner_hz"]),
            unlikely=True,  # nor the effect's name where one before the hysteresis is ruled out
        ),
        Form(
            "amplifier_lag",
            "one pole, and faster ones as a delay",
            (corner, Param("delay_share", 0.0, FAST_SHARE)),
            lambda _: [{"corner_hz": f, "delay_share": 0.1} for f in corners],
            path=lambda path, v: path.but(
                corner_hz=v["corner_hz"],
                corner_lean=0.0,
                behind_hz=0.0,
                delay_s=path.delay_s
                + min(v["delay_share"] / (2 * np.pi * v["corner_hz"]), longest),
                substeps_min=4,
            ),
            refines=True,
        ),
    ]
