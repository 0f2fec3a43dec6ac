"""Creep box and mechanics box: the creep ladder, flexure modes, backlash."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from madelung.diagnosis.effects.form import (
    Apply,
    Form,
    Param,
    Scales,
    Values,
    null_start,
)
from madelung.path import CreepMode, Mode

CREEP_TAU_S = tuple(float(10.0**k) for k in np.arange(-2.5, 3.01, 0.5))
CREEP_STEP = 0.0015
"""Neighbouring creep modes are expected to differ by about this share (log-like spectrum)."""
MODE_MAX_HZ = 5000.0
START_MAX_HZ = 3000.0


def creep_forms(s: Scales) -> list[Form]:
    """Every model of creep."""
    return [
        _creep_form("ladder, a mode a decade", CREEP_TAU_S[1::2], s),
        _creep_form("ladder, two modes a decade", CREEP_TAU_S, s),
    ]


def creep_tau_s(key: str) -> float:
    """Time constant of the mode whose gain is the parameter of that key."""
    return CREEP_TAU_S[int(key.removeprefix("creep_"))]


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
        null_start(gains),
        path=lambda path, v: path.but(
            creep=tuple(CreepMode(t, v[g.key]) for t, g in zip(within, gains, strict=True))
        ),
        linear=True,
        priors=smooth,
        refines=taus is CREEP_TAU_S,
        same_law=taus is CREEP_TAU_S,
    )


def mechanics_forms(s: Scales) -> list[Form]:
    """Every model of the mechanics box."""
    return [*_resonances(s), *_backlashes(s)]


def _resonances(s: Scales) -> list[Form]:
    f_max = min(MODE_MAX_HZ, 2.0 / s.step_min_s)
    highest = min(f_max, START_MAX_HZ)

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

    grid = [
        {"fn1_hz": f, "zeta1": z} for f in np.geomspace(10.0, highest, 40) for z in (0.03, 0.15)
    ]
    return [
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
                for f in np.geomspace(20.0, highest, 80)
            ],
            path=modes(1, 2),
            refines=True,
        ),
    ]


def _backlashes(s: Scales) -> list[Form]:
    band = Param("dead_band_um", 0.0, 0.2 * s.stroke_um, scale=0.1 * s.stroke_um)
    bands = [s.stroke_um * float(k) for k in np.geomspace(3e-4, 0.05, 8)]

    def of_gap(v: Values) -> dict[str, float]:
        return {k: v.get(k, 0.0) for k in ("dead_band_um", "spread", "spring_share")}

    def gap(name: str, more: Param | None = None, at: tuple[float, ...] = ()) -> Form:
        starts = [{"dead_band_um": w} for w in bands]
        if more is not None:
            starts = [v | {more.key: a} for v in starts for a in at]
        return Form(
            "backlash",
            name,
            (band,) if more is None else (band, more),
            lambda _: starts,
            path=lambda path, v: path.but(**of_gap(v)),
            refines=more is not None,
        )

    return [
        gap("dead band"),
        gap("dead band, with a spring across it", Param("spring_share", 0.0, 0.5), (0.1,)),
        gap("dead band of a rough contact", Param("spread", 0.0, 1.0), (0.2, 0.6)),
    ]
