"""The results of Yang et al. 2015 beside what this program gives, row by row.

The published parameters are run in the C core. The paper's measurements cannot be had: in their
place stands a simulated stage whose dynamics are not the model's - relays, an amplifier pole, a
lightly damped flexure mode, noise and 16-bit converters. Its pole is chosen so that its k(1500 Hz)
comes out near the paper's. What the paper leaves out is chosen here and said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from madelung.core import Predictor
from madelung.identify import identify
from madelung.model import yang_model
from madelung.path import Mode, Runner, SignalPath, predictor
from madelung.records import Record, make_record
from madelung.reproduce import Row, make_folder, write_table
from madelung.sim_effects import Effects
from madelung.stage import Stage, simulate
from madelung.waveforms import Command, Waveform
from madelung.yang2015 import Yang, polynomial, spectrum, weights_of_harmonics
from madelung.yang2015_identify import (
    GENERATIONS,
    SWARM,
    Sine,
    YangIdentification,
    errors,
    identify_yang,
    run,
)

Floats = NDArray[np.float64]

CITATION = "Yang, Li, Gu & Zhu, 2015, DOI 10.5772/58984"

BIAS_V, AMPLITUDE_V = 70.0, 50.0
LOW_V, HIGH_V = BIAS_V - AMPLITUDE_V, BIAS_V + AMPLITUDE_V
VOLTS, MICRONS = 200.0, 10.0
"""One unit of v, from the thresholds 0.06 to 0.60 at 120 V; one of y, from the errors in um."""
M = 9
HZ_MAX = 1500.0
PUBLISHED = Yang(
    tuple(VOLTS * 0.06 * i for i in range(1, 11)),
    tuple(
        p * MICRONS / VOLTS
        for p in (0.1898, 0.0572, 0.0784, 0.0616, 0.0611, 0.0632, 0.0521, 0.3420, 0.1143, 0.0607)
    ),
    a1=-0.0820 * MICRONS / VOLTS**3,
    a2=0.6625 * MICRONS / VOLTS,
    k=(0.9978, -4.6440e-4, 3.8680e-7, -2.2920e-10),
    c=tuple(MICRONS * b for b in (4.4260e-4, -1.4070e-4, 2.1690e-8)),
    m=(0.8015, 7.0120e-4, -1.1250e-6, 4.8030e-10),
    hz_max=HZ_MAX,
)
"""Tables 1 and 2."""
LITERAL_HZ = 1e9
"""Instead of HZ_MAX: the polynomials go on as they are printed."""

RATE_INDEPENDENT_300 = (11.1099, 7.1648)
DYNAMIC_1500 = (37.7, 15.3)
PROPOSED = (6.5, 3.0)
TRIANGLES = {100.0: 2.45, 250.0: 2.46, 500.0: 9.40}
TRIANGLES_UM = {100.0: 0.1110, 250.0: 0.1091}
"""Errors in percent, e_max and e_rms; of triangles e_max in percent and in um."""

STAGE = Stage(
    u_min_V=LOW_V,
    u_max_V=HIGH_V,
    stroke_um=4.9,
    hysteresis_share=0.12,
    y_min_um=1.6,
    dac_bits=16,
    adc_bits=16,
    adc_min_um=-10.0,
    adc_max_um=10.0,
    noise_um=0.002,
    between="waveform",
)
EFFECTS = Effects(corner_hz=1300.0, fn_hz=6000.0, zeta=0.02, mode_share=1.0)
RATE_HZ = 50_000.0
SINES_HZ = (10.0, *(100.0 * i for i in range(1, 16)))
LOOPS_HZ = (10.0, 400.0, 1200.0)
SETTLE_S = 0.03
"""Left out at the start of a record: the flexure comes to its steady state."""
SCORED_S = 0.008
"""Recorded after that, or four cycles."""
MULTISINE = Command(
    Waveform.MULTISINE,
    seconds=0.4,
    rate_hz=RATE_HZ,
    u_min_V=LOW_V,
    u_max_V=HIGH_V,
    hz=10.0,
    band_hz=(10.0, 500.0),
    seed=15,
)
DYNAMIC_FIT_HZ = SINES_HZ[::2] + SINES_HZ[-1:]
DYNAMIC_TRIALS = 40
FIGURES = ("fig04", "fig05", "fig06", "fig07", "fig07_tables", "fig08", "fig09", "limit")


@dataclass(frozen=True)
class Scored:
    """A prediction of a record: the rows that are scored, and e_max and e_rms in percent."""

    record: Record
    rows: NDArray[np.intp]
    predicted: Floats

    @property
    def measured(self) -> Floats:
        """Displacement, um, on the scored rows."""
        assert self.record.y is not None
        return self.record.y[self.rows]

    @property
    def error(self) -> tuple[float, float]:
        """Eq. (17)."""
        return errors(self.measured, self.predicted[self.rows])


By = dict[str, Scored]
"""By model."""
NAMES = ("rate-independent", "dynamic thresholds", "proposed")
LINEAR = "hysteresis, then linear dynamics"


@dataclass(frozen=True)
class YangReproduction:
    """All that was computed; the pictures are drawn from it.

    Attributes
    ----------
    damping
        By frequency in Hz: v and y_vd of Fig. 4 over one cycle.
    published
        By frequency in Hz: V, and um by Table 1 alone and by both tables, over one cycle.
    found
        The model identified on the stage's sines.
    sines
        By frequency in Hz, by model.
    triangles
        By frequency in Hz: ``clamped``, ``literal`` (the polynomials as they are), ``sine`` (as if
        it were one), both rivals and `LINEAR`.
    multisine
        ``rate-independent``, ``proposed`` and `LINEAR`.
    path
        Fitted: trajectory, pole and flexure.
    """

    rows: tuple[Row, ...]
    damping: dict[float, tuple[Floats, Floats]]
    published: dict[float, tuple[Floats, Floats, Floats]]
    found: YangIdentification
    sines: dict[float, By]
    triangles: dict[float, By]
    multisine: By
    path: SignalPath


def reproduce_yang() -> YangReproduction:
    """Compute every result of the paper that can be computed without its actuator."""
    damping = {hz: _damping(hz) for hz in (10.0, 100.0, 500.0)}
    published = {hz: _published(hz) for hz in LOOPS_HZ}
    records = [stage_record(hz, Waveform.SINE) for hz in SINES_HZ]
    found = identify_yang(records, from_s=SETTLE_S)
    sines = [rate.sine for rate in found.rates]
    yang = _of(found)
    dynamic = fit_dynamic(
        [s for s, hz in zip(sines, SINES_HZ, strict=True) if hz in DYNAMIC_FIT_HZ]
    )
    models = dict(zip(NAMES, (yang.rate_independent, dynamic, yang), strict=True))
    scored = {
        hz: {name: _score(model, s.record, s.rows) for name, model in models.items()}
        for hz, s in zip(SINES_HZ, sines, strict=True)
    }
    path = fit_linear(sines)
    triangles = {hz: _triangle(yang, dynamic, path, hz) for hz in TRIANGLES}
    multisine = _multisine(yang, path)
    rows = [
        *_tables(),
        _fig_2(published),
        *_own_loop(),
        *_fig_4(damping),
        *_fig_5(found),
        *_fig_6(),
        *_losses(found),
        *_fig_8(scored),
        *_fig_9(triangles),
        *_extrapolated(),
        *_limits(triangles, multisine, path),
    ]
    return YangReproduction(
        tuple(rows), damping, published, found, scored, triangles, multisine, path
    )


def _of(found: YangIdentification) -> Yang:
    assert found.model.yang is not None
    return found.model.yang


# -- the simulated stage ----------------------------------------------------------------------


def stage_record(hz: float, waveform: Waveform) -> Record:
    """A record of the stage from rest at 20 V; it is steady from SETTLE_S on."""
    cycles = max(4.0 + np.ceil(SETTLE_S * hz), np.ceil((SETTLE_S + SCORED_S) * hz))
    command = Command(
        waveform,
        seconds=cycles / hz,
        rate_hz=RATE_HZ,
        u_min_V=LOW_V,
        u_max_V=HIGH_V,
        hz=hz,
    )
    return replace(simulate(STAGE, command, int(hz), EFFECTS), name=f"{waveform} of {hz:g} Hz")


def _score(yang: Yang, record: Record, rows: NDArray[np.intp]) -> Scored:
    return Scored(record, rows, run(yang, LOW_V, HIGH_V, record))


# -- the rivals -------------------------------------------------------------------------------


def fit_dynamic(sines: Sequence[Sine]) -> Yang:
    """The rival r_i = alpha i + beta |u'| with ten two-side operators, fitted to sines.

    How the paper identified it is not said. For every alpha and beta the weights, a1, a2 and the
    zero are bounded linear least squares; the two are searched.
    """
    from scipy.optimize import lsq_linear, minimize

    low = np.append(np.zeros(10), np.full(3, -np.inf))
    tau_s = 0.5 / RATE_HZ

    def triangle(alpha: float, beta: float, s: Sine) -> Floats:
        """The triangular factor of columns and target of one record, which counts once."""
        parts = [
            Yang((alpha * i,), (1.0,), two_side=True, beta_s=beta, velocity_tau_s=tau_s)
            for i in range(1, 11)
        ]
        plays = [run(p, LOW_V, HIGH_V, s.record)[s.rows] for p in parts]
        v = s.record.u_V[s.rows] / HIGH_V
        columns = np.stack([*plays, v**3, v, np.ones_like(v), s.y], axis=1)
        return np.asarray(np.linalg.qr(columns / np.sqrt(s.rows.size), mode="r"))

    def solve(x: Floats) -> Any:
        both = np.concatenate([triangle(x[0], x[1] * 1e-4, s) for s in sines])
        return lsq_linear(both[:, :-1], both[:, -1], (low, np.inf), method="bvls")

    def cost(x: Floats) -> float:
        return float(solve(x).cost)

    best = minimize(
        cost,
        np.array([6.0, 1.5]),
        method="Nelder-Mead",
        bounds=[(1.0, 24.0), (0.0, 20.0)],
        options={"maxfev": DYNAMIC_TRIALS},
    ).x
    x = solve(best).x
    return Yang(
        tuple((best[0] * np.arange(1, 11)).tolist()),
        tuple(x[:10].tolist()),
        a1=float(x[10]) / HIGH_V**3,
        a2=float(x[11]) / HIGH_V,
        at_zero_um=float(x[12]),
        two_side=True,
        beta_s=float(best[1]) * 1e-4,
        velocity_tau_s=tau_s,
    )


def fit_linear(sines: Sequence[Sine]) -> SignalPath:
    """The diagnosis's blocks: a pole, the trajectory of the slowest sine, then a flexure mode.

    f0 is identified as for any Madelung model; pole, natural frequency and damping are fitted to
    all sines in free run.
    """
    from scipy.optimize import least_squares

    f0 = identify([sines[0].record]).model.f0
    runner = Runner(LOW_V, HIGH_V - LOW_V)

    def path(x: Floats) -> SignalPath:
        corner, fn, zeta = np.exp(x)
        return SignalPath(
            LOW_V,
            HIGH_V - LOW_V,
            f0,
            corner_hz=float(corner),
            modes=(Mode(float(fn), float(zeta)),),
        )

    def off(x: Floats) -> Floats:
        made = path(x)
        return np.concatenate(
            [
                (runner.run(made, s.record.u_V, s.record.step_s)[s.rows] - s.y)
                / np.sqrt(s.rows.size)
                for s in sines
            ]
        )

    found = least_squares(off, np.log([2000.0, 5000.0, 0.05]), diff_step=np.full(3, 1e-4))
    return path(found.x)


def _linear(path: SignalPath, record: Record, rows: NDArray[np.intp]) -> Scored:
    runner = Runner(LOW_V, HIGH_V - LOW_V)
    return Scored(record, rows, runner.run(path, record.u_V, record.step_s))


def _triangle(yang: Yang, dynamic: Yang, path: SignalPath, hz: float) -> By:
    record = stage_record(hz, Waveform.TRIANGLE)
    rows = np.flatnonzero(record.t_s >= SETTLE_S)
    models = {
        "clamped": yang.but(harmonics=M),
        "literal": yang.but(harmonics=M, hz_max=LITERAL_HZ, hz=hz, amplitude_V=AMPLITUDE_V),
        "sine": yang,
        NAMES[0]: yang.rate_independent,
        NAMES[1]: dynamic,
    }
    scored = {name: _score(model, record, rows) for name, model in models.items()}
    return scored | {LINEAR: _linear(path, record, rows)}


def _multisine(yang: Yang, path: SignalPath) -> By:
    record = replace(simulate(STAGE, MULTISINE, 15, EFFECTS), name="multisine")
    rows = np.flatnonzero(record.t_s >= SETTLE_S)
    models = {NAMES[0]: yang.rate_independent, NAMES[2]: yang}
    scored = {name: _score(model, record, rows) for name, model in models.items()}
    return scored | {LINEAR: _linear(path, record, rows)}


# -- rows -------------------------------------------------------------------------------------

_OWN = "the paper's actuator cannot be had; ours is the simulated stage"


def _percent(two: tuple[float, float]) -> str:
    return f"{two[0]:.3g} / {two[1]:.3g} %"


def _tables() -> list[Row]:
    """Tables 1 and 2, evaluated."""
    hz = np.arange(10.0, HZ_MAX + 1.0, 10.0)
    k, c, m = (polynomial(b, hz) for b in (PUBLISHED.k, PUBLISHED.c, PUBLISHED.m))
    c10, c100 = polynomial(PUBLISHED.c, [10.0, 100.0]) / MICRONS
    r = [f"{t / VOLTS:.2f}" for t in PUBLISHED.thresholds_V]
    tail = hz >= 100.0
    rows = [
        Row(
            "Table 1",
            "thresholds r_i = i / N max |v|",
            f"{r[0]} to {r[-1]}",
            f"{HIGH_V / VOLTS / 10:.2f} to {HIGH_V / VOLTS:.2f} with v = volts / {VOLTS:g}",
            True,
            "inferred: the paper gives v no unit; its largest input is B + A = 120 V",
        ),
        _swing_row(),
        Row(
            "Table 2",
            "k(f), 10 to 1500 Hz",
            "the higher f, the smaller",
            f"{k[0]:.3f} to {k[-1]:.3f}, "
            + ("falls" if (np.diff(k) < 0.0).all() else "not always"),
            bool((np.diff(k) < 0.0).all()),
            "k scales the mean displacement too, by 0.4 at 1500 Hz, which no actuator's does: our "
            "identification finds from the records about which displacement it scales",
        ),
        Row(
            "Table 2",
            "|c(f)|, 10 to 1500 Hz",
            "the higher f, the larger",
            f"{abs(c[0]) / MICRONS:.4f} to {abs(c[-1]) / MICRONS:.4f}, "
            + ("grows" if (np.diff(np.abs(c)) > 0.0).all() else "not always"),
            bool((np.diff(np.abs(c)) > 0.0).all()),
            "c is negative: the displacement lags, which is normal",
        ),
        Row(
            "Table 2",
            "c(10 Hz), why m(10 Hz) is left out",
            "close to zero",
            f"{c10:.5f}, {100.0 * c10 / c100:.0f} % of c(100 Hz)",
            bool(abs(c10) < 0.1 * abs(c100)),
        ),
        Row(
            "Table 2",
            "m(f), 100 to 1500 Hz",
            "about 0.9",
            f"{m[tail].min():.2f} to {m[tail].max():.2f}, mean {m[tail].mean():.2f}",
            bool(abs(m[tail].mean() - 0.9) < 0.05),
        ),
    ]
    return rows


def _swing_row() -> Row:
    """The unit of y: the swing of the 100 and 250 Hz triangles, from errors in um and percent."""
    paper = {hz: 100.0 * um / TRIANGLES[hz] for hz, um in TRIANGLES_UM.items()}
    ours = {}
    for hz in paper:
        t = np.arange(round(6.0 * RATE_HZ / hz)) / RATE_HZ
        u = LOW_V + (HIGH_V - LOW_V) * (1.0 - np.abs(1.0 - 2.0 * np.mod(hz * t, 1.0)))
        yang = PUBLISHED.but(harmonics=M, hz=hz, amplitude_V=AMPLITUDE_V)
        y = predictor(yang_model(yang, LOW_V, HIGH_V), "float64", 1.0 / RATE_HZ, LOW_V).run(u)
        ours[hz] = float(np.ptp(y[t >= 2.0 / hz]))
    off = max(abs(ours[hz] / paper[hz] - 1.0) for hz in paper)
    return Row(
        "Tables 1, 2",
        f"swing of triangles of {', '.join(f'{hz:g}' for hz in paper)} Hz",
        ", ".join(f"{v:.2f} um" for v in paper.values()),
        ", ".join(f"{v:.2f} um" for v in ours.values()),
        off < 0.15,
        f"inferred: y in units of {MICRONS:g} um, from 0.1110 um being 2.45 % and 0.1091 um 2.46 %",
    )


def _published(hz: float) -> tuple[Floats, Floats, Floats]:
    """The third cycle of a sine by Table 1 alone, and by both tables."""
    t = np.arange(1501) / 500.0 / hz
    u = BIAS_V - AMPLITUDE_V * np.cos(2.0 * np.pi * hz * t)
    given = PUBLISHED.but(hz=hz, amplitude_V=AMPLITUDE_V)
    alone, both = (
        np.asarray(predictor(yang_model(y, LOW_V, HIGH_V), "float64", t[1], LOW_V).run(u)[1000:])
        for y in (given.rate_independent, given)
    )
    return u[1000:], alone, both


def _fig_2(published: dict[float, tuple[Floats, Floats, Floats]]) -> Row:
    """What Fig. 2 is said to show, of the loops that both tables give."""
    swing = np.array([np.ptp(y) for _, _, y in published.values()])
    width = np.array([y[375] - y[125] for _, _, y in published.values()])  # falling, rising: 70 V
    return Row(
        "Fig. 2, Tables 1, 2",
        f"swing, and width at {BIAS_V:g} V, at {', '.join(f'{hz:g}' for hz in published)} Hz",
        "the swing falls, the width grows",
        ", ".join(f"{v:.2f}" for v in swing)
        + " um, "
        + ", ".join(f"{v:.2f}" for v in width)
        + " um",
        bool((np.diff(swing) < 0.0).all() and (np.diff(width) > 0.0).all()),
        "drawn as fig07_tables.png, with y in units of 10 um",
    )


def _own_loop() -> list[Row]:
    """What of Table 1 can be identified at the paper's excitation, from its own loop."""
    t = np.arange(0.0, 0.6, 1.0 / 5000.0)
    u = BIAS_V - AMPLITUDE_V * np.cos(2.0 * np.pi * 10.0 * t)
    alone = PUBLISHED.rate_independent
    y = Predictor(yang_model(alone, LOW_V, HIGH_V), "float64").run(u)
    y += np.random.default_rng(15).normal(0.0, 1e-4, y.size)
    found = identify_yang([make_record("Table 1", {"t_s": t, "u_V": u, "y_um": y})])
    weights = np.array(_of(found).weights) * VOLTS / MICRONS
    true = np.array(alone.weights) * VOLTS / MICRONS
    off = np.abs(weights - true)[:7]
    return [
        Row(
            "Table 1",
            "p_1 to p_7, identified from the loop that Table 1 gives",
            ", ".join(f"{p:.4f}" for p in true[:7]),
            ", ".join(f"{p:.4f}" for p in weights[:7]),
            bool(off.max() < 0.01),
            "with 0.1 nm of noise; the paper used its measured loop",
        ),
        Row(
            "Table 1",
            "p_9 and p_10",
            f"{true[8]:.4f}, {true[9]:.4f}",
            f"not seen: operators {', '.join(map(str, found.unseen))} do not move",
            None,
            "r_10 is the largest input, so that F_10 is 0; r_9 is wider than the swing, so that "
            "F_9 is a constant. At this excitation any p_10 gives the same output",
        ),
    ]


def _damping(hz: float) -> tuple[Floats, Floats]:
    """v and y_vd = 0.2 |v'| sgn v' over a cycle in the core; f and A are such that Q = 1."""
    t = np.arange(2000) / 1000.0 / hz
    v = (BIAS_V - AMPLITUDE_V * np.cos(2.0 * np.pi * hz * t)) / VOLTS
    yang = Yang((), (), k=(0.0,), c=(0.2,), m=(1.0,), hz=1.0 / (2.0 * np.pi), amplitude_V=1.0)
    model = yang_model(yang, LOW_V / VOLTS, HIGH_V / VOLTS)
    y = predictor(model, "float64", t[1], float(v[0])).run(v)
    return v[1000:], np.asarray(y[1000:], np.float64)


def _fig_4(damping: dict[float, tuple[Floats, Floats]]) -> list[Row]:
    width = {hz: float(np.ptp(y)) for hz, (_, y) in damping.items()}
    widths = list(width.values())
    ideal = [2.0 * 0.2 * 2.0 * np.pi * hz * AMPLITUDE_V / VOLTS for hz in width]
    return [
        Row(
            "Fig. 4",
            "width of the damping's loops at 10, 100, 500 Hz, c = 0.2, m = 1",
            "increases with f",
            ", ".join(f"{w:.1f}" for w in widths),
            bool(np.allclose(widths, ideal, rtol=2e-3)),
            "with v = volts / 200: 2 c 2 pi f A; drawn without numbers in the paper",
        )
    ]


def _fig_5(found: YangIdentification) -> list[Row]:
    hz = np.array(SINES_HZ)
    value = np.array([r.value for r in found.rates])
    half = np.array([r.half_width for r in found.rates])
    k, c, m = value.T
    left_out = [f"{r.sine.hz:.0f} Hz" for r in found.rates if not r.m_counts]
    paper = [polynomial(b, [HZ_MAX])[0] for b in (PUBLISHED.k, PUBLISHED.c, PUBLISHED.m)]
    shape = bool((np.diff(k) < 0.0).all() and (np.diff(np.abs(c[hz <= 1000.0])) > 0.0).all())
    told = [
        f"{name} = {value[-1, i]:.3f} +- {half[-1, i]:.3f}{unit}"
        for i, (name, unit) in enumerate((("k", ""), ("c", " um"), ("m", "")))
    ]
    return [
        Row(
            "Fig. 5",
            "k, c, m at 1500 Hz",
            f"k = {paper[0]:.3f}, c = {paper[1]:.3f} um, m = {paper[2]:.3f}",
            ", ".join(told),
            None,
            f"95 % intervals; {_OWN}, whose pole is chosen for a k like the paper's",
        ),
        Row(
            "Fig. 5",
            "k falls, |c| grows with f; m about constant",
            "yes, m about 0.9",
            f"{'yes' if shape else 'no'}, m {m[1:].min():.2f} to {m[1:].max():.2f}",
            shape and bool(np.ptp(m[1:]) < 0.2),
            "ours: |c| levels off near 1200 Hz",
        ),
        Row(
            "Fig. 5 (c)",
            "left out of the fit of m",
            "10 Hz",
            ", ".join(left_out) or "none",
            left_out == ["10 Hz"],
            "the damping there is below 1 % of half the swing: its power is of no importance",
        ),
    ]


def _fig_6() -> list[Row]:
    a, weights = spectrum(M), weights_of_harmonics(M)
    t = np.arange(4096) / 4096.0
    triangle = 4.0 * np.abs(np.mod(t - 0.25, 1.0) - 0.5) - 1.0
    sampled = -2.0 / t.size * np.fft.rfft(triangle)[1 : M + 1].imag
    return [
        Row(
            "Fig. 6 (a), eq. (15)",
            "A_i of the triangle, i = 1, 3, 5, 7, 9",
            "drawn only",
            ", ".join(f"{v:.4f}" for v in a[::2]),
            bool(np.allclose(sampled, a, atol=1e-5)),
            "agrees with the Fourier transform of a sampled triangle; the even ones are 0",
        ),
        Row(
            "Fig. 6 (b), eq. (16)",
            "lambda_i, i = 1, 3, 5, 7, 9",
            "drawn only",
            ", ".join(f"{v:.4f}" for v in weights[::2]),
            bool(np.isclose(weights.sum(), 1.0)),
            "they sum to 1",
        ),
    ]


def _losses(found: YangIdentification) -> list[Row]:
    best, swarm = found.loss["least squares"], found.loss["swarm"]
    return [
        Row(
            "eq. (5)",
            "loss of the rate-independent part, 10 Hz",
            "particle swarm, no number",
            f"swarm {swarm:.2e} um^2, bounded linear least squares {best:.2e} um^2",
            None,
            "the problem is linear: least squares finds the optimum at once, the swarm of "
            f"{SWARM} particles is {100.0 * (np.sqrt(swarm / best) - 1.0):.0f} % above it in rms "
            f"after {GENERATIONS} generations",
        )
    ]


def _fig_8(sines: dict[float, By]) -> list[Row]:
    e = {name: np.array([sines[hz][name].error for hz in SINES_HZ]) for name in NAMES}
    hz = np.array(SINES_HZ)
    where = "Figs. 7, 8"
    alone, dynamic, ours = (e[name] for name in NAMES)
    worst = (float(ours[:, 0].max()), float(ours[:, 1].max()))
    order = bool((ours[1:] < dynamic[1:]).all() and (ours[1:] < alone[1:]).all())
    fit = np.polyfit(hz, alone[:, 1], 1)
    bent = float(np.abs(np.polyval(fit, hz) - alone[:, 1]).max() / alone[:, 1].max())
    at = {f: int(np.flatnonzero(hz == f)[0]) for f in (300.0, 400.0, 1500.0)}
    return [
        Row(
            where,
            "rate-independent at 300 Hz, e_max / e_rms",
            _percent(RATE_INDEPENDENT_300),
            _percent(tuple(alone[at[300.0]])),
            None,
            _OWN,
        ),
        Row(
            where,
            "dynamic thresholds at 1500 Hz",
            f"exceeds {_percent(DYNAMIC_1500)}",
            _percent(tuple(dynamic[at[1500.0]])),
            None,
            f"{_OWN}; two-side operators, whose falling branch widens too, fitted to every second "
            "sine",
        ),
        Row(
            where,
            "proposed, 10 to 1500 Hz, at most",
            _percent(PROPOSED),
            _percent(worst),
            None,
            f"{_OWN}; frequency and amplitude are found on line",
        ),
        *(
            Row(
                "Fig. 7",
                f"all three models at {f:g} Hz, e_max / e_rms",
                "drawn only",
                "; ".join(f"{name} {_percent(sines[f][name].error)}" for name in NAMES),
                None,
                _OWN,
            )
            for f in LOOPS_HZ
        ),
        Row(
            where,
            "errors of the rate-independent model over f",
            "increase linearly",
            f"e_rms off a line by {100.0 * bent:.0f} % of its largest at most",
            bent < 0.1 and bool((np.diff(alone, axis=0) > 0.0).all()),
        ),
        Row(
            where,
            "proposed better than both others, above 10 Hz",
            "at every frequency",
            "at every frequency" if order else "not at every frequency",
            order,
        ),
        Row(
            "Fig. 7",
            "dynamic thresholds, up to 400 Hz and at 1200 Hz",
            "describes the loop up to 400 Hz, worsens to 1200 Hz",
            f"400 Hz {_percent(tuple(dynamic[at[400.0]]))}, 1200 Hz "
            f"{_percent(tuple(dynamic[hz == 1200.0][0]))}",
            bool((dynamic[at[400.0]] < dynamic[hz == 1200.0][0]).all()),
        ),
        Row(
            "eq. (17)",
            "e_rms",
            "1 / n outside of the root",
            "the root mean square",
            None,
            "as printed it is no rms: it would fall with the number of samples",
        ),
    ]


def _fig_9(triangles: dict[float, By]) -> list[Row]:
    rows = [
        Row(
            "Fig. 9",
            f"triangle of {hz:g} Hz, e_max",
            f"{paper:.2f} %",
            f"{triangles[hz]['clamped'].error[0]:.3g} % held at 1500 Hz, "
            f"{triangles[hz]['literal'].error[0]:.3g} % literal",
            None,
            f"{_OWN}; m = m(f0), Q = 2 pi f0 A, which the paper leaves open",
        )
        for hz, paper in TRIANGLES.items()
    ]
    rows += [
        Row(
            "Fig. 9",
            f"triangle of {hz:g} Hz, e_max / e_rms of all three models",
            "no number for the others",
            f"{NAMES[0]} {_percent(by[NAMES[0]].error)}; {NAMES[1]} "
            f"{_percent(by[NAMES[1]].error)}; {NAMES[2]} {_percent(by['clamped'].error)}",
            None,
            "proposed: held at 1500 Hz",
        )
        for hz, by in triangles.items()
    ]
    worse = triangles[500.0]["clamped"].error[0] > triangles[250.0]["clamped"].error[0]
    gain = {hz: by["sine"].error[1] / by["clamped"].error[1] for hz, by in triangles.items()}
    return [
        *rows,
        Row(
            "Fig. 9",
            "500 Hz is described worse than 250 Hz",
            "yes",
            "yes" if worse else "no",
            worse,
        ),
        Row(
            "section 4.3",
            "weights lambda_i describe triangles up to 250 Hz better than the sine's model does",
            "yes",
            "e_rms without them over with them: "
            + ", ".join(f"{v:.2f} at {hz:g} Hz" for hz, v in gain.items()),
            all(v > 1.0 for hz, v in gain.items() if hz <= 250.0),
            "m and Q are the same in both; at 500 Hz most harmonics lie above the identified band",
        ),
    ]


def _extrapolated() -> list[Row]:
    """Table 2 beyond the band: triangles of 500 Hz need 4500 Hz."""
    k, m = (float(polynomial(b, [9.0 * 500.0])[0]) for b in (PUBLISHED.k, PUBLISHED.m))
    at = 500.0 * np.arange(1, M + 1)
    weights = weights_of_harmonics(M)
    sums = [
        float(weights @ polynomial(b, np.minimum(at, most)) / scale)
        for most in (LITERAL_HZ, HZ_MAX)
        for b, scale in ((PUBLISHED.k, 1.0), (PUBLISHED.c, MICRONS))
    ]
    return [
        Row(
            "Table 2",
            "k and m at 4500 Hz, the ninth harmonic of 500 Hz",
            "fitted up to 1500 Hz",
            f"k = {k:.1f}, m = {m:.1f}",
            None,
            "a polynomial does not extrapolate",
        ),
        Row(
            "eq. (14)",
            "sum of lambda_i k(i f0) and of lambda_i c(i f0) at 500 Hz",
            "no number",
            f"literal {sums[0]:.3f} and {sums[1]:.4f}; held at 1500 Hz {sums[2]:.3f} and "
            f"{sums[3]:.4f}",
            None,
            "c in the paper's unit",
        ),
    ]


def _limits(triangles: dict[float, By], multisine: By, path: SignalPath) -> list[Row]:
    where = "section 6"
    mode = path.modes[0]
    blocks = (
        f"fitted to the same sines: pole {path.corner_hz:.0f} Hz (true {EFFECTS.corner_hz:g}), "
        f"flexure {mode.fn_hz:.0f} Hz ({EFFECTS.fn_hz:g}), damping {mode.zeta:.3f} "
        f"({EFFECTS.zeta:g})"
    )
    low, high = MULTISINE.band_hz
    cases = {
        f"multisine of {low:g} to {high:g} Hz": multisine,
        "triangle of 500 Hz": triangles[500.0] | {NAMES[2]: triangles[500.0]["clamped"]},
    }
    rows = [
        Row(
            where,
            f"{what}, e_max / e_rms",
            "restricted to one sine or triangle",
            f"proposed {_percent(by[NAMES[2]].error)}; {LINEAR} {_percent(by[LINEAR].error)}",
            None,
            blocks if by is multisine else "the same blocks",
        )
        for what, by in cases.items()
    ]
    alone = _percent(multisine[NAMES[0]].error)
    note = "the frequency that is found on line from small swings misleads the damping"
    return [
        rows[0],
        replace(rows[0], what="the same by the rate-independent part alone", ours=alone, note=note),
        rows[1],
    ]


def write(out: Path, found: YangReproduction) -> None:
    """Write table.md, table.json and the pictures into a folder, which is made if need be.

    Raises
    ------
    InputError
        The folder cannot be made or written.
    """
    from madelung.reproduce_yang_pictures import draw

    make_folder(out)
    draw(out, found)
    write_table(out, CITATION, found.rows)
