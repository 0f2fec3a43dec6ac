"""Hysteresis box: asymmetry, non-Masing loops, rate dependence, an unknown initial state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from madelung.diagnosis.effects.form import (
    Apply,
    Form,
    Param,
    Scales,
    Values,
    null_start,
    same_names,
)
from madelung.path import SignalPath

MEMORYLESS = ((1, 1), (1, 3), (3, 1))
BRANCHES = ((1, 1), (2, 1), (3, 1), (1, 3), (2, 3))
MINOR = ((1, 2), (2, 2), (3, 2), (1, 4))
FINE = ((4, 2), (2, 4), (3, 4), (4, 4))
"""Terms (j, k) of s'^j m'^k in the shape block."""


def hysteresis_forms(s: Scales) -> list[Form]:
    """Every model of the hysteresis box."""
    return [*_asymmetries(s), *_non_masing(s), *_rate_dependences(s), *_initial_states(s)]


# -- shape ----------------------------------------------------------------------------------------


def _asymmetries(s: Scales) -> list[Form]:
    return [
        _shape_form("asymmetry", "memoryless", MEMORYLESS, s),
        _shape_form("asymmetry", "branches", BRANCHES, s),
        *(_envelope_form(side, s) for side in ("rise", "fall")),
        # What is proven asymmetric bends minor loops too; no effect of its own (diagnose.md).
        _shape_form("asymmetry", "memoryless, with minor loops", (*MEMORYLESS, *MINOR), s, True),
        _shape_form("asymmetry", "branches, with minor loops", (*BRANCHES, *MINOR), s, True),
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
        null_start(params),
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
        path=same_names(params),
    )


def _non_masing(s: Scales) -> list[Form]:
    bouc = (
        Param("bouc_um", -0.5 * s.stroke_um, 0.5 * s.stroke_um, scale=s.stroke_um),
        Param("bouc_V", 0.02 * s.range_V, 3 * s.range_V, log=True),
        Param("bouc_power", 1.0, 3.0),
        Param("bouc_gamma", -0.8, 0.8),
    )
    starts = [
        {"bouc_um": 0.01 * s.stroke_um, "bouc_V": k * s.range_V, "bouc_power": p, "bouc_gamma": 0.0}
        for k in (0.1, 0.2, 0.4, 1.0)
        for p in (1.0, 2.0)
    ]
    loop = (Param("loop_share", -2.0, 2.0), Param("loop_slope", -4.0, 4.0))
    return [
        _shape_form("non_masing", "minor loops", MINOR, s),
        _shape_form("non_masing", "minor loops, finer", (*MINOR, *FINE), s, True),
        Form(
            "non_masing",
            "loops of another width, by their size",
            loop,
            null_start(loop),
            path=same_names(loop),
            linear=True,
            priors=({"loop_share": 1.0}, {"loop_slope": 1.0}),
        ),
        Form(
            "non_masing",
            "a part by Bouc and Wen",
            bouc,
            lambda _: starts,
            path=same_names(bouc),
            size="bouc_um",
        ),
    ]


# -- rate -----------------------------------------------------------------------------------------


def _rate_dependences(s: Scales) -> list[Form]:
    """Loops widen with the rate: the displacement lags behind, whatever the law."""
    damping = Param("damping_um", -0.2 * s.stroke_um, 0.0, scale=s.stroke_um)
    widening = Param("widening", 0.0, 5.0)
    swelling, lean = Param("swelling", 0.0, 5.0), Param("lean", -0.5, 1.5, scale=0.3)
    threshold = Param("threshold_V", 0.0, 0.3 * s.range_V, scale=0.1 * s.range_V)
    volts = 0.01 * s.range_V
    held = {"of_speed": 1.0}  # through a turn
    share, volt = "thresholds grow by a share", "thresholds grow by a voltage"
    return [
        *_by_velocity("velocity damping", damping, -0.01 * s.stroke_um, s),
        *_by_velocity(share, widening, 0.1, s),
        *_by_velocity(f"{share}, not less at turns", widening, 0.1, s, held, True),
        *_by_velocity(volt, threshold, volts, s),
        *_by_velocity(f"{volt}, not less at turns", threshold, volts, s, held, True),
        *_by_velocity(
            "loops swell by a share, not less at turns", swelling, 0.05, s, held, more=(lean,)
        ),
        *_viscous(s),
    ]


def _v_ref(s: Scales) -> float:
    """The rate at which the velocity's laws are told, V/s."""
    return max(0.3 * s.rate_max_V_per_s, 1e-6)


def _by_velocity(
    name: str,
    size: Param,
    start: float,
    s: Scales,
    others: Mapping[str, float] = MappingProxyType({}),
    refines: bool = False,
    more: tuple[Param, ...] = (),
) -> list[Form]:
    """With a power of the rate; and straight below a knee, of a command that may be smooth.

    ``others``: further fields of the signal path; ``more``: and those that are fitted.
    """
    power = Param("power", 0.05, 2.0, null=1.0)
    v_knee = Param("v_knee", 1e-3, 3.0, log=True)
    tau = Param("velocity_tau_s", 0.05 * s.step_min_s, 100 * s.step_min_s, log=True)
    plain = (size, power, tau, *more)
    starts = [
        {size.key: start, "power": p, "velocity_tau_s": s.step_min_s} for p in (0.3, 0.6, 1.0, 1.5)
    ]
    for param in more:
        starts = [v | {param.key: at} for at in (param.null, param.scale) for v in starts]
    middle = [v for v in starts if v["power"] in (0.6, 1.0)]
    smooth = Param("smooth", 0.0, 1.0)
    kneed = [v | {"v_knee": k, "smooth": 0.0} for v in middle for k in (0.03, 0.3)]
    keys = [p.key for p in more]
    apply = _velocity_law(size.key, others, keys, _v_ref(s))
    return [
        Form(
            "rate_dependence",
            name,
            plain,
            lambda _: starts,
            apply,
            size=size.key,
            refines=refines,
        ),
        Form(
            "rate_dependence",
            f"{name}, straight below a knee",
            (*plain, v_knee, smooth),
            lambda _: kneed,
            apply,
            size=size.key,
            refines=True,
        ),
    ]


def _velocity_law(
    key: str, others: Mapping[str, float], more: Sequence[str], v_ref: float
) -> Apply:
    def apply(path: SignalPath, v: Values) -> SignalPath:
        knee, p = v.get("v_knee", 0.0), v["power"]
        return path.but(
            **{key: v[key] / ((1 + knee) ** p - knee**p)},  # the parameter is c g(1)
            power=p,
            v_ref_V_per_s=v_ref,
            v_knee=knee,
            velocity_tau_s=v["velocity_tau_s"],
            smooth=v.get("smooth", 0.0),
            **others,
            **{k: v[k] for k in more},
        )

    return apply


def _viscous(s: Scales) -> list[Form]:
    v_ref = _v_ref(s)
    square = v_ref / s.range_V**2
    return [
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
            (Param("relax_per_V_s", square, 1e8 * square, log=True),),
            lambda _: [
                {"relax_per_V_s": v_ref / (k * s.range_V) ** 2} for k in (0.003, 0.01, 0.03, 0.1)
            ],
            path=lambda path, v: path.but(relax_per_V_s=v["relax_per_V_s"], v_ref_V_per_s=v_ref),
        ),
    ]


# -- history --------------------------------------------------------------------------------------


def _initial_states(s: Scales) -> list[Form]:
    dip = Param("start_dip_V", s.u_min_V, s.u_min_V + s.range_V, scale=s.range_V)
    peak = Param("start_peak_V", s.u_min_V, s.u_min_V + s.range_V, scale=s.range_V)
    return [
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
