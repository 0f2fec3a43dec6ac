"""The model of Yang et al. 2015 from records of sines: its parameters in two steps, section 4.2.

First eq. (4) from the slowest record. It is linear in a1, a2, p_i and the sensor's zero, so that it
is a bounded linear least squares with p_i >= 0; the paper's particle swarm is run beside it on the
same loss, eq. (5). Then k, c and m of every record by nonlinear least squares, eq. (12), and the
polynomials of eq. (13) over the frequency. Every regressor is a run of the C core.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from madelung import __version__
from madelung.errors import InputError
from madelung.identify import correlation_rows, percent
from madelung.model import Model, yang_model
from madelung.path import predictor
from madelung.predict import on_grid
from madelung.records import Record
from madelung.yang2015 import HARMONICS_MAX, PLAYS_MAX, Yang

Floats = NDArray[np.float64]

CYCLES_MIN = 4
WARM_UP_CYCLES = 2
"""Cycles at the start of a record that are left out: memory, and the found frequency, settle."""
SINE_SHARE = 0.02
"""The fundamental of a record may miss so much of half its swing; a triangle's misses 0.19."""
JITTER_SHARE = 0.05
"""Rms by which the cycles of a record may differ in length, as a share."""
STILL_SHARE = 1e-9
"""An operator that moves by less than this share of the range cannot be seen."""
SMALL_SHARE = 0.01
"""A damping below this share of half the swing leaves its power m without importance."""
K_SHARE = 0.05
"""Unless k departs from 1 by this, the center about which it scales cannot be seen."""
VELOCITY_SHARE = 0.05
"""The velocity's filter lags by so much, in rad, at the highest frequency."""
M_RANGE = (0.05, 4.0)
SWARM, GENERATIONS = 50, 200
BOX = 3.0
"""The swarm searches slopes up to this many times the whole loop's."""
Z95 = 1.96


@dataclass(frozen=True)
class Sine:
    """A record of one sine: frequency, amplitude, and the rows of whole cycles that are used."""

    record: Record
    hz: float
    amplitude_V: float
    rows: NDArray[np.intp]

    @property
    def y(self) -> Floats:
        """Measured displacement on the rows, shape (n,)."""
        assert self.record.y is not None
        return self.record.y[self.rows]


@dataclass(frozen=True)
class Rate:
    """k, c and m at one frequency, each with the half width of its 95 % interval.

    ``m_counts`` is false where the damping is too small for m to be of importance. ``e_max`` and
    ``e_rms`` are the errors of the finished model, which finds frequency and amplitude on line, in
    percent, eq. (17).
    """

    sine: Sine
    value: Floats
    half_width: Floats
    m_counts: bool
    e_max: float = np.nan
    e_rms: float = np.nan


@dataclass(frozen=True)
class YangIdentification:
    """An identified model, and what it was identified from.

    Attributes
    ----------
    model
        Of kind ``yang2015``.
    rates
        By record, the slowest first.
    loss
        Eq. (5) of the rate-independent part, um^2: ``least squares`` and ``swarm``.
    swarm
        p_i (um / V), a1, a2 that the particle swarm finds.
    unseen
        Operators (from 1) that the slowest record does not move; their weights are 0.
    warnings
        One sentence each.
    """

    model: Model
    rates: tuple[Rate, ...]
    loss: dict[str, float]
    swarm: Floats
    unseen: tuple[int, ...]
    warnings: tuple[str, ...]


def identify_yang(
    records: Sequence[Record],
    operators: int = 10,
    harmonics: int = 1,
    from_s: float = -np.inf,
    to_s: float = np.inf,
    seed: int = 0,
) -> YangIdentification:
    """Identify the model from sines of one amplitude at several frequencies.

    Parameters
    ----------
    records
        With measured y in one unit; each a steady sine of four cycles or more. The slowest gives
        the rate-independent part.
    operators
        N of eq. (4), thresholds i / N of the largest input.
    harmonics
        1: the model is for sines; 9: for triangles, eq. (14).
    seed
        Of the particle swarm.

    Raises
    ------
    InputError
        No y, units that differ, a record that is no sine, too few cycles.
    """
    if not 1 <= operators <= PLAYS_MAX:
        raise InputError(f"{operators} play operators: 1 to {PLAYS_MAX} are possible")
    if not 1 <= harmonics <= HARMONICS_MAX:
        raise InputError(f"{harmonics} harmonics: 1 to {HARMONICS_MAX} are possible")
    units = {r.y_unit for r in records}
    if len(units) != 1:
        raise InputError(f"the records measure y in {' and '.join(sorted(units))}: use one unit")
    warnings = [w for record in records for w in record.warnings()]
    sines = sorted((sine_of(r, from_s, to_s) for r in records), key=lambda s: s.hz)
    low = min(float(s.record.u_V.min()) for s in sines)
    high = max(float(s.record.u_V.max()) for s in sines)
    slowest = sines[0]
    tau_s = VELOCITY_SHARE / (2.0 * np.pi * sines[-1].hz)
    base, loss, swarm, unseen = _rate_independent(slowest, operators, low, high, seed)
    rest = base.rate_independent
    center = float(np.mean(run(rest, low, high, slowest.record)[slowest.rows]))
    base = base.but(center_um=center, velocity_tau_s=tau_s, hz_max=sines[-1].hz)
    if unseen:
        warnings.append(
            f"play operators {', '.join(map(str, unseen))} of {operators} do not move in the "
            f"slowest record ({low:g} to {high:g} V, thresholds from "
            f"{base.thresholds_V[unseen[0] - 1]:g} V on): their weights cannot be seen and are 0"
        )
    fitted = [_rate(base, low, high, s) for s in sines]
    rates = [rate for rate, _ in fitted]
    yang, said = _polynomials(_centred(base, fitted), rates)
    yang = yang.but(harmonics=harmonics)
    rates = [_scored(yang.but(harmonics=1), low, high, r) for r in rates]
    unit = units.pop()
    model = yang_model(yang, low, high, _extra(rates, loss, unseen, unit))
    return YangIdentification(model, tuple(rates), loss, swarm, unseen, (*warnings, *said))


def sine_of(record: Record, from_s: float = -np.inf, to_s: float = np.inf) -> Sine:
    """Frequency, amplitude and usable rows of a record of one sine.

    Raises
    ------
    InputError
        It has no y, fewer than four cycles, cycles that differ, or is no sine.
    """
    if record.y is None:
        raise InputError(f"{record.name}: no column y_um (or y_nm, y_mm, y_V, y_deg)")
    t, u = record.t_s, record.u_V
    low, high = float(u.min()), float(u.max())
    middle, amplitude = (low + high) / 2.0, (high - low) / 2.0
    # Hysteresis of the crossings: noise about the middle does not count.
    outer = np.flatnonzero(np.abs(u - middle) > 0.3 * amplitude)
    above = u[outer] > middle
    ups = np.flatnonzero(above[1:] & ~above[:-1])
    rises = [slice(outer[i], outer[i + 1] + 1) for i in ups]
    crossings = np.array([np.interp(middle, u[s], t[s]) for s in rises])
    if crossings.size < CYCLES_MIN + 1:
        raise InputError(
            f"{record.name}: {max(crossings.size - 1, 0)} whole cycles: record {CYCLES_MIN} or more"
        )
    cycles = np.diff(crossings)
    if cycles.std() > JITTER_SHARE * cycles.mean():
        raise InputError(f"{record.name}: its cycles differ in length: record one steady sine")
    hz = float(1.0 / np.polyfit(np.arange(crossings.size), crossings, 1)[0])
    phase = 2.0 * np.pi * hz * (t - crossings[0])
    columns = np.stack([np.ones_like(t), np.sin(phase), np.cos(phase)], axis=1)
    line = np.linalg.lstsq(columns, u, rcond=None)[0]
    if abs(np.hypot(line[1], line[2]) / amplitude - 1.0) > SINE_SHARE:
        raise InputError(f"{record.name}: u is no sine; the model is identified from sines")
    used = record.sound & (t >= from_s) & (t <= to_s)
    used &= (t >= crossings[WARM_UP_CYCLES]) & (t < crossings[-1])
    rows = np.flatnonzero(used)
    if rows.size < 10:
        raise InputError(f"{record.name}: no sound rows are left after its first two cycles")
    return Sine(record, hz, amplitude, rows)


def run(yang: Yang, u_min_V: float, u_max_V: float, record: Record) -> Floats:
    """What the core (double) gives for a record's command, um, shape (n,)."""
    rows, u_V = on_grid(record)
    made = predictor(yang_model(yang, u_min_V, u_max_V), "float64", record.step_s, float(u_V[0]))
    return np.asarray(made.run(u_V)[rows], np.float64)


def errors(measured: Floats, predicted: Floats) -> tuple[float, float]:
    """e_max and e_rms of eq. (17) in percent of the measured swing.

    Printed with 1 / n outside of the root, which is no rms; here it stands inside.
    """
    e = predicted - measured
    swing = float(np.ptp(measured))
    return 100.0 * float(np.abs(e).max()) / swing, 100.0 * float(np.sqrt(np.mean(e**2))) / swing


# -- the rate-independent part ----------------------------------------------------------------


def regressors(sine: Sine, thresholds_V: Floats, u_min_V: float, u_max_V: float) -> Floats:
    """Columns of eq. (4) at the rows: every operator, then u^3 and u; shape (n, N + 2)."""
    two_side = u_min_V < 0.0
    parts = [Yang((float(r),), (1.0,), two_side=two_side) for r in thresholds_V]
    parts += [Yang((), (), a1=1.0), Yang((), (), a2=1.0)]
    return np.stack([run(p, u_min_V, u_max_V, sine.record)[sine.rows] for p in parts], axis=1)


def _rate_independent(
    sine: Sine, operators: int, u_min_V: float, u_max_V: float, seed: int
) -> tuple[Yang, dict[str, float], Floats, tuple[int, ...]]:
    """Eq. (4), the losses, what the swarm finds, and the operators that cannot be seen."""
    from scipy.optimize import lsq_linear

    largest = float(np.abs(sine.record.u_V).max())
    thresholds = largest * np.arange(1, operators + 1) / operators
    columns = regressors(sine, thresholds, u_min_V, u_max_V)
    moved = np.ptp(columns[:, :operators], axis=0) > STILL_SHARE * (u_max_V - u_min_V)
    swing = float(np.ptp(sine.y))
    # In units of the loop, about the mean, which is left to the sensor's zero.
    scale = np.append(np.full(operators, largest), [largest**3, largest]) / swing
    matrix = (columns - columns.mean(axis=0)) / (scale * swing)
    target = (sine.y - sine.y.mean()) / swing
    seen = np.append(moved, [True, True])
    low = np.append(np.zeros(operators), [-np.inf, -np.inf])
    solved = np.zeros(operators + 2)
    solved[seen] = lsq_linear(matrix[:, seen], target, (low[seen], np.inf), method="bvls").x
    found = _swarm(matrix, target, operators, seed)
    loss = {
        name: float(np.mean((matrix @ x - target) ** 2)) * swing**2
        for name, x in (("least squares", solved), ("swarm", found))
    }
    x = solved / scale
    zero = float(sine.y.mean() - columns.mean(axis=0) @ x)
    base = Yang(
        tuple(thresholds.tolist()),
        tuple(x[:operators].tolist()),
        a1=float(x[operators]),
        a2=float(x[operators + 1]),
        at_zero_um=zero,
        two_side=u_min_V < 0.0,
    )
    return base, loss, found / scale, tuple((np.flatnonzero(~moved) + 1).tolist())


def _swarm(matrix: Floats, target: Floats, operators: int, seed: int) -> Floats:
    """Eq. (5) minimised by a particle swarm, as in the paper; shape (N + 2,)."""
    from pymoo.algorithms.soo.nonconvex.pso import PSO
    from pymoo.optimize import minimize
    from pymoo.problems.functional import FunctionalProblem

    rows = target.size
    gram, moment, square = matrix.T @ matrix / rows, matrix.T @ target / rows, target @ target

    def fitness(x: Floats) -> float:
        return float(x @ gram @ x - 2.0 * (x @ moment) + square / rows)

    free = np.full(2, BOX)
    problem = FunctionalProblem(
        operators + 2,
        fitness,
        xl=np.append(np.zeros(operators), -free),
        xu=np.full(operators + 2, BOX),
    )
    found = minimize(problem, PSO(pop_size=SWARM), ("n_gen", GENERATIONS), seed=seed)
    return np.asarray(found.X, np.float64)


# -- the rate-dependent part ------------------------------------------------------------------


def _rate(base: Yang, u_min_V: float, u_max_V: float, sine: Sine) -> tuple[Rate, float]:
    """k, c and m of one record, eq. (12), and by what its mean is off, um."""
    from scipy.optimize import least_squares

    at = base.but(hz=sine.hz, amplitude_V=sine.amplitude_V, hz_max=max(base.hz_max, sine.hz))
    y = sine.y

    def off(x: Floats) -> Floats:
        yang = at.but(k=(float(x[0]),), c=(float(x[1]),), m=(float(x[2]),))
        return run(yang, u_min_V, u_max_V, sine.record)[sine.rows] + float(x[3]) - y

    swing = float(np.ptp(y))
    wide = np.array([np.inf, np.inf])
    found = least_squares(
        off,
        [1.0, -0.01 * swing, 1.0, 0.0],
        bounds=([*-wide, M_RANGE[0], -np.inf], [*wide, M_RANGE[1], np.inf]),
        x_scale=[0.1, 0.1 * swing, 0.3, 0.1 * swing],
        diff_step=np.full(4, 1e-4),  # the core's powers are good to 1e-8
    )
    spread = _standard_errors(np.asarray(found.jac), found.fun)
    m_counts = bool(abs(found.x[1]) > SMALL_SHARE * swing / 2.0)
    return Rate(sine, found.x[:3], Z95 * spread[:3], m_counts), float(found.x[3])


def _centred(base: Yang, fitted: Sequence[tuple[Rate, float]]) -> Yang:
    """The displacement about which k scales, from the means of the records.

    About another center than the mean of the slowest loop, k would shift a record's mean by
    (k - 1) times the difference: least squares over the records. 0, as in the paper, can come out.
    """
    scaled = np.array([rate.value[0] - 1.0 for rate, _ in fitted])
    shift = np.array([mean for _, mean in fitted])
    if np.abs(scaled).max() < K_SHARE:
        return base
    return base.but(center_um=base.center_um - float(scaled @ shift / (scaled @ scaled)))


def _standard_errors(jacobian: Floats, residual: Floats) -> Floats:
    """From the residuals, whose neighbours are alike: fewer rows count than there are."""
    variance = float(np.mean(residual**2)) * correlation_rows(residual)
    return np.sqrt(np.diag(variance * np.linalg.pinv(jacobian.T @ jacobian)))


def _polynomials(base: Yang, rates: Sequence[Rate]) -> tuple[Yang, list[str]]:
    """Eq. (13): degrees 3, 2 and 3, less where there are few records."""
    hz = np.array([r.sine.hz for r in rates])
    value = np.array([r.value for r in rates])
    counts = np.array([r.m_counts for r in rates])
    said = []
    k, c = (_fitted(hz, value[:, i], degree) for i, degree in ((0, 3), (1, 2)))
    m: tuple[float, ...] = (1.0,)
    degree = 3
    while counts.any():
        m = _fitted(hz[counts], value[counts, 2], degree)
        over = Polynomial(m)(np.linspace(0.0, base.hz_max, 200))
        if degree == 0 or (M_RANGE[0] <= over.min() and over.max() <= M_RANGE[1]):
            break
        degree -= 1
        said.append(f"m(f) of degree {degree + 1} leaves {M_RANGE}: degree {degree} is taken")
    return base.but(k=k, c=c, m=m), said


def _fitted(hz: Floats, value: Floats, degree: int) -> tuple[float, ...]:
    degree = min(degree, np.unique(np.round(hz, 3)).size - 1)
    return tuple(Polynomial.fit(hz, value, degree).convert().coef.tolist())


def _scored(yang: Yang, u_min_V: float, u_max_V: float, rate: Rate) -> Rate:
    predicted = run(yang, u_min_V, u_max_V, rate.sine.record)[rate.sine.rows]
    e_max, e_rms = errors(rate.sine.y, predicted)
    return Rate(rate.sine, rate.value, rate.half_width, rate.m_counts, e_max, e_rms)


def _extra(
    rates: Sequence[Rate], loss: dict[str, float], unseen: tuple[int, ...], unit: str
) -> dict[str, Any]:
    def told(rate: Rate) -> dict[str, Any]:
        low, high = rate.value - rate.half_width, rate.value + rate.half_width
        found = {
            name: {"value": v, "ci95": [a, b]}
            for name, v, a, b in zip(
                "kcm", *(x.tolist() for x in (rate.value, low, high)), strict=True
            )
        }
        where = {"record": Path(rate.sine.record.name).name, "hz": rate.sine.hz}
        return (
            where
            | found
            | {
                "m_counts": rate.m_counts,
                "e_max_percent": rate.e_max,
                "e_rms_percent": rate.e_rms,
            }
        )

    extra: dict[str, Any] = {
        f"loss_{unit}2": loss,
        "unseen_operators": list(unseen),
        "rates": [told(rate) for rate in rates],
        "versions": {"madelung": __version__, "numpy": np.__version__},
    }
    return extra | ({"y_unit": unit} if unit != "um" else {})


def summary(found: YangIdentification) -> list[str]:
    """What a user wants to know of an identification, a line each."""
    yang, unit = found.model.yang, str(found.model.extra.get("y_unit", "um"))
    assert yang is not None
    swing = float(np.ptp(found.rates[0].sine.y))
    losses = ", ".join(
        f"{name} {value:.3g} {unit}^2 ({percent(value**0.5, swing)} rms)"
        for name, value in found.loss.items()
    )
    lines = [
        f"rate-independent part: {len(yang.weights)} play operators on {found.model.u_min_V:g} to "
        f"{found.model.u_max_V:g} V, from {found.rates[0].sine.hz:.4g} Hz",
        f"loss, eq. (5): {losses}",
    ]
    for r in found.rates:
        k, c, m = (f"{v:.4g} +- {w:.2g}" for v, w in zip(r.value, r.half_width, strict=True))
        power = m if r.m_counts else "left out: the damping is too small to tell it"
        lines.append(
            f"{r.sine.hz:.4g} Hz: k {k}, c {c} {unit}, m {power}; "
            f"e_max {r.e_max:.2g} %, e_rms {r.e_rms:.2g} %"
        )
    return lines
