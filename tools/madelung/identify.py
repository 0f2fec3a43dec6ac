"""f0 from measured loops: the data reproduction of Cao & Li 2019, section 2.3, as least squares.

The paper maps the descending branch onto the ascending one by central symmetry, eq. (14) and
Fig. 5: x_t = R - x, y_t = S - y with S = f0(0) + f0(R), x = u - u_min, R = u_max - u_min; then it
fits a polynomial to all points. S is read from two noisy samples there. Here S stays unknown: it
is linear in f0's coefficients, so a row of the descending branch enters the same least squares as
phi(0) + phi(R) - phi(R - x) for the basis phi, and a row of the ascending branch as phi(x). The
C core gives these rows when it runs once per basis function; it does so for swings that end a
little inside the range too. The basis is Chebyshev's on [0, R], converted to powers of x at the
end.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial
from numpy.typing import NDArray

from madelung import __version__
from madelung.core import Predictor
from madelung.errors import InputError
from madelung.model import DEGREE_MAX, MARGIN_SHARE, Model
from madelung.records import Record

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

ENDS_SHARE = 0.02
"""A swing counts as full when it comes this close to both ends, as a share of the range."""
INNER_SHARE = 0.005
"""Rows this far inside the swing's outermost voltage lie on an inner loop and are left out."""
CONDITION_MAX = 1e10
"""Of the Gram matrix with unit diagonal; beyond it the rows do not determine the degree."""
MOVES_MIN = 2 * (DEGREE_MAX + 1)
"""On a half-loop u moves in at least so many rows on average, or it was no slow one."""
PAIR_SHARE = 0.01
"""Rows of successive cycles are compared when this close, as a share of the range."""
FOLDS_MAX = 40
"""Half-loops are spread over at most so many folds of the cross-validation."""
UNIT_TIMES = 100.0
"""A displacement that moves so many times as far as it should, or as little, is in another unit:
units are 1000 apart; a resonance, or a lag, comes to less."""
BINS = 40
"""Of x, in which the two branches are averaged and compared."""


@dataclass(frozen=True)
class Half:
    """A half-loop: the rows of a record on one branch of the outermost loop."""

    record: int
    rising: bool
    rows: Rows


@dataclass(frozen=True)
class Noise:
    """Size of the noise, and how many neighbouring rows share it.

    Attributes
    ----------
    sigma
        Standard deviation, in the unit of y.
    rows
        Integrated autocorrelation: sigma^2 * rows / n is the variance of a mean of n rows.
    source
        ``cycle-to-cycle differences``, or ``residuals`` (which hold what the model cannot follow).
    """

    sigma: float
    rows: float
    source: str


@dataclass(frozen=True)
class Identification:
    """An identified model, and what it was identified from.

    Attributes
    ----------
    model
        With covariance, errors and sources under `Model.extra`.
    x_V, y, fitted
        The rows used, shape (n,): x = u - u_min, measured and fitted displacement.
    rising
        True on the ascending branch, shape (n,).
    noise
        See `Noise`.
    asymmetry
        Shape (BINS,): what the ascending branch lies above the mirrored descending one, over x in
        bins of equal width; NaN where a branch has no rows.
    warnings
        One sentence each.
    """

    model: Model
    x_V: Floats
    y: Floats
    fitted: Floats
    rising: NDArray[np.bool_]
    noise: Noise
    asymmetry: Floats
    warnings: tuple[str, ...]

    @property
    def mapped(self) -> tuple[Floats, Floats]:
        """All rows on the ascending branch (Fig. 5): x and y, shape (n,) each."""
        f0 = Polynomial(self.model.f0)
        ends = f0(0.0) + f0(self.model.range_V)
        return reproduce(self.x_V, self.y, self.rising, self.model.range_V, ends)


def reproduce(
    x_V: Floats, y: Floats, rising: NDArray[np.bool_], range_V: float, ends: float
) -> tuple[Floats, Floats]:
    """Map the descending branch onto the ascending one, Cao & Li 2019, eq. (14).

    Parameters
    ----------
    x_V, y
        u - u_min in V and displacement, shape (n,).
    rising
        True where the row already lies on the ascending branch, shape (n,).
    range_V
        R = u_max - u_min, V.
    ends
        S = f0(0) + f0(R), in the unit of y.
    """
    return np.where(rising, x_V, range_V - x_V), np.where(rising, y, ends - y)


def identify(
    records: Sequence[Record],
    degree: int | None = None,
    u_min_V: float | None = None,
    u_max_V: float | None = None,
    from_s: float = -np.inf,
    to_s: float = np.inf,
) -> Identification:
    """Identify f0 from the outermost loops of one or more records.

    Parameters
    ----------
    records
        With measured y, all in one unit. A record that does not begin at u_min begins in mid
        motion: its first full swing is left out.
    degree
        0 to 7; None: chosen by cross-validation, the simplest within one standard error.
    u_min_V, u_max_V
        Range of the model, V; None: what the records reach.
    from_s, to_s
        Only rows in this time enter the fit; the rows before still set the history.

    Raises
    ------
    InputError
        No y, units that differ, no full swing, or rows that do not determine the degree.
    """
    if degree is not None and not 0 <= degree <= DEGREE_MAX:
        raise InputError(f"the degree is {degree}: 0 to {DEGREE_MAX} are possible")
    unit = _unit(records)
    warnings = [w for record in records for w in record.warnings()]
    low = min(float(r.u_V.min()) for r in records)
    high = max(float(r.u_V.max()) for r in records)
    u_min = low if u_min_V is None else u_min_V
    u_max = high if u_max_V is None else u_max_V
    if not (np.isfinite([u_min, u_max]).all() and u_max > u_min):
        raise InputError(f"u_max ({u_max:g} V) must be above u_min ({u_min:g} V)")
    mend = "mend --u-min and --u-max, or record the whole range"
    warnings += check_reach("the records reach", (low, high), (u_min, u_max), mend)
    halves: list[Half] = []
    for i, record in enumerate(records):
        found, said = _halves(i, record, low, high, from_s, to_s)
        halves += found
        warnings += said
    if not halves:
        raise InputError(
            f"{', '.join(r.name for r in records)}: no full swing between {low:g} V and {high:g} V "
            "with sound rows: record at least one slow triangle or sine over the whole range"
        )
    moves = sum(_moves(records[h.record].u_V, h.rows) for h in halves)
    if moves < MOVES_MIN * len(halves):
        raise InputError(
            f"{', '.join(r.name for r in records)}: u moves in {moves} rows of {len(halves)} full "
            "swings, these are jumps: record a slow triangle or sine of two cycles or more"
        )
    terms = (DEGREE_MAX if degree is None else degree) + 1
    basis = _basis(u_max - u_min, terms)
    matrix = _matrix(records, halves, u_min, u_max, basis)
    y = np.concatenate([_y(records[h.record])[h.rows] for h in halves])
    fit = _Fit(matrix, y, [h.rows.size for h in halves])
    chosen = fit.choose() if degree is None else fit.check(degree)
    a, inverse = fit.solve(chosen)
    fitted = matrix[:, : chosen + 1] @ a
    x = np.concatenate([records[h.record].u_V[h.rows] for h in halves]) - u_min
    rising = np.concatenate([np.full(h.rows.size, h.rising) for h in halves])
    noise = _noise(halves, x, y - fitted, u_max - u_min)
    asymmetry, spread = _asymmetry(x, y - fitted, rising, u_max - u_min, noise)
    to_powers = basis[: chosen + 1, : chosen + 1].T
    model = Model("madelung", u_min, u_max, f0=tuple(float(c) for c in to_powers @ a))
    stroke = stroke_of(model)
    warnings += _check_curve(model, stroke)
    warnings += _check_float(model, records, stroke, unit)
    warnings += _check_symmetry(asymmetry, spread, stroke, unit)
    extra: dict[str, Any] = {
        "degree": chosen,
        f"stroke_{unit}": stroke,
        f"rms_{unit}": _rms(y - fitted),
        f"max_{unit}": _most(y - fitted),
        f"noise_{unit}": noise.sigma,
        "noise_from": noise.source,
        "noise_correlation_rows": noise.rows,
        f"asymmetry_rms_{unit}": _rms(asymmetry),
        f"asymmetry_max_{unit}": _most(asymmetry),
        "covariance": (noise.sigma**2 * noise.rows * (to_powers @ inverse @ to_powers.T)).tolist(),
        "half_loops": len(halves),
        "rows": int(y.size),
        "records": [Path(r.name).name for r in records],
        "versions": {"madelung": __version__, "numpy": np.__version__},
    }
    if unit != "um":
        extra["y_unit"] = unit
    return Identification(
        replace(model, extra=extra), x, y, fitted, rising, noise, asymmetry, tuple(warnings)
    )


def stroke_of(model: Model) -> float:
    """Displacement from u_min to u_max, the size that percentages refer to; in the unit of y."""
    y = Predictor(model, "float64").run([model.u_min_V, model.u_max_V])
    return float(abs(y[1] - y[0]))


def check_unit(said: str, moved: float, expected: float) -> Iterator[str]:
    """Warn where a displacement moves so much further, or less, than a model says.

    Nothing is told of one that rests, nor of a model that says it does.
    """
    if moved <= 0.0 or expected <= 0.0:
        return
    if not 1.0 / UNIT_TIMES < moved / expected < UNIT_TIMES:
        times = float(f"{moved / expected:.2g}")
        yield f"{said} moves {times:.12g} times as far as the model says: check the unit"


def _y(record: Record) -> Floats:
    if record.y is None:
        raise InputError(
            f"{record.name}: no column y_um (or y_nm, y_mm, y_V, y_deg): a model is "
            "identified from a measured displacement"
        )
    return record.y


def _unit(records: Sequence[Record]) -> str:
    for record in records:
        _y(record)
    units = {r.y_unit for r in records}
    if len(units) != 1:
        raise InputError(f"the records measure y in {' and '.join(sorted(units))}: use one unit")
    return units.pop()


def check_reach(
    said: str, reached_V: tuple[float, float], range_V: tuple[float, float], mend: str
) -> Iterator[str]:
    """Warn when the ends of the range (V) are not quite reached, refuse when far from it."""
    off = max(abs(a - b) for a, b in zip(reached_V, range_V, strict=True))
    off /= range_V[1] - range_V[0]
    reached = "{} {:g} to {:g} V of the range {:g} to {:g} V".format(said, *reached_V, *range_V)
    if off > MARGIN_SHARE:
        raise InputError(
            f"{reached}: {100 * off:.0f} % off, {100 * MARGIN_SHARE:.0f} % at most "
            f"are possible; {mend}"
        )
    if off > ENDS_SHARE / 2:
        yield f"{reached}: f0 is extrapolated at the ends"


def _halves(
    index: int, record: Record, low: float, high: float, from_s: float, to_s: float
) -> tuple[list[Half], list[str]]:
    """The full swings of a record between low and high (V), and what to say about them."""
    u, name = record.u_V, record.name
    swings = _swings(u, low, high)
    said = []
    if swings and u[0] > low + ENDS_SHARE * (high - low):
        if len(swings) > 2:
            swings = swings[1:]
        else:
            said.append(
                f"{name}: begins in mid motion, and there are too few full swings to leave "
                "the first one out as warm-up"
            )
    within = record.sound & (record.t_s >= from_s) & (record.t_s <= to_s)
    halves, inner, reversals, total = [], 0, 0, 0
    for rising, first, last in swings:
        outward = u[first : last + 1] if rising else -u[first : last + 1]
        outer = outward >= np.maximum.accumulate(outward) - INNER_SHARE * (high - low)
        rows = np.arange(first + 1, last + 1)  # the turn itself belongs to the swing before
        kept = rows[outer[1:] & within[rows]]
        if kept.size:
            halves.append(Half(index, rising, kept))
            inner += int(np.count_nonzero(within[rows])) - kept.size
            moves = np.sign(np.diff(outward))
            moves = moves[moves != 0.0]
            reversals += int(np.count_nonzero(np.diff(moves)))
            total += rows.size
    if not halves:
        said.append(f"{name}: not used: it has no full swing between {low:g} V and {high:g} V")
        return halves, said
    if {h.rising for h in halves} != {True, False}:
        said.append(
            f"{name}: only {'rising' if halves[0].rising else 'falling'} full swings: "
            "whether the loop is symmetric cannot be seen"
        )
    if reversals > 0.05 * total:
        said.append(f"{name}: u is noisy: {reversals} reversals in {total} rows of full swings")
    elif inner:
        said.append(
            f"{name}: the command is not monotone between its ends: {inner} rows on inner "
            "loops are left out"
        )
    said += _check_dwell(name, u, total // len(halves))
    return halves, said


def _swings(u: Floats, low: float, high: float) -> list[tuple[bool, int, int]]:
    """(rising, first row, last row) of every swing between the zones at both ends."""
    reach = ENDS_SHARE * (high - low)
    zone = np.where(u >= high - reach, 1, np.where(u <= low + reach, -1, 0))
    at = np.flatnonzero(zone)
    starts = np.flatnonzero(np.diff(zone[at], prepend=0))
    visits = []
    for a, b in zip(starts, np.append(starts[1:], at.size), strict=True):
        first, last = at[a], at[b - 1]
        outward = u[first : last + 1] * zone[first]
        to = first + int(np.argmax(outward))
        away = last - int(np.argmax(outward[::-1]))
        visits.append((int(to), int(away)))
    return [(bool(zone[here[1]] < 0), here[1], there[0]) for here, there in pairwise(visits)]


def _moves(u: Floats, rows: Rows) -> int:
    """In how many of the rows u is not what it was in the row before."""
    return int(np.count_nonzero(u[rows] != u[rows - 1]))


def _check_dwell(name: str, u: Floats, rows_per_half: int) -> Iterator[str]:
    for end, called in ((u.min(), "lowest"), (u.max(), "highest")):
        edges = np.flatnonzero(np.diff(u == end, prepend=False, append=False))
        longest = int(np.diff(edges.reshape(-1, 2)).max())
        if longest > max(5, 0.1 * rows_per_half):
            yield (
                f"{name}: u stays at its {called} value {end:g} V for {longest} rows: a dwell, "
                "or the command is clipped"
            )


def _basis(range_V: float, terms: int) -> Floats:
    """Row k: Chebyshev polynomial k on [0, range] in ascending powers of x."""
    rows = np.zeros((terms, terms))
    for k in range(terms):
        powers = Chebyshev.basis(k, domain=[0.0, range_V]).convert(kind=Polynomial).coef
        rows[k, : powers.size] = powers
    return rows


def _matrix(
    records: Sequence[Record], halves: list[Half], u_min: float, u_max: float, basis: Floats
) -> Floats:
    """What the core gives for every basis function, at the rows of the half-loops."""
    rows = {
        i: np.concatenate([h.rows for h in halves if h.record == i])
        for i in sorted({h.record for h in halves})
    }
    columns = []
    for powers in basis:
        predictor = Predictor(Model("madelung", u_min, u_max, f0=tuple(powers)), "float64")
        column = []
        for i, used in rows.items():
            predictor.reset()
            column.append(predictor.run(records[i].u_V)[used])
        columns.append(np.concatenate(column))
    return np.stack(columns, axis=1)


class _Fit:
    """Least squares by Gram matrices, one per fold: the basis is well conditioned."""

    def __init__(self, matrix: Floats, y: Floats, sizes: list[int]) -> None:
        parts = 1 if len(sizes) >= 4 else 5
        edges = np.cumsum([0, *sizes])
        pieces = [
            piece
            for first, end in pairwise(edges)
            for piece in np.array_split(np.arange(first, end), parts)
        ]
        folds = min(len(pieces), FOLDS_MAX)
        terms = matrix.shape[1]
        self._mean = float(y.mean())
        self.gram = np.zeros((folds, terms, terms))
        self.moment = np.zeros((folds, terms))
        self.square = np.zeros(folds)
        self.count = np.zeros(folds)
        for i, piece in enumerate(pieces):
            m, r = matrix[piece], y[piece] - self._mean
            self.gram[i % folds] += m.T @ m
            self.moment[i % folds] += m.T @ r
            self.square[i % folds] += r @ r
            self.count[i % folds] += piece.size

    def check(self, degree: int) -> int:
        """The degree, if the rows determine it."""
        if self._condition(degree) > CONDITION_MAX:
            raise InputError(
                f"the rows do not determine a polynomial of degree {degree}: they lie "
                "at too few different voltages; use a lower --degree"
            )
        return degree

    def _condition(self, degree: int) -> float:
        gram = self.gram.sum(axis=0)[: degree + 1, : degree + 1]
        scale = np.sqrt(np.diagonal(gram))
        if not scale.all():
            return np.inf
        return float(np.linalg.cond(gram / np.outer(scale, scale)))

    def choose(self) -> int:
        """The lowest degree within one standard error of the best, over the folds left out."""
        degrees = [d for d in range(1, DEGREE_MAX + 1) if self._condition(d) <= CONDITION_MAX]
        if not degrees:
            return self.check(1)
        scores = np.array([self._left_out(d) for d in degrees])
        best = scores[int(np.argmin(scores.mean(axis=1)))]
        worse = scores - best
        spread = worse.std(axis=1, ddof=1) / np.sqrt(best.size)
        return degrees[int(np.argmax(worse.mean(axis=1) <= spread))]

    def _left_out(self, degree: int) -> Floats:
        """Mean square error of every fold under the fit to the others, shape (folds,)."""
        d = slice(0, degree + 1)
        gram, moment = self.gram[:, d, d], self.moment[:, d]
        others = np.linalg.pinv(gram.sum(axis=0) - gram, hermitian=True)
        a = np.einsum("fij,fj->fi", others, moment.sum(axis=0) - moment)
        error = self.square - 2.0 * np.einsum("fi,fi->f", a, moment)
        error += np.einsum("fi,fij,fj->f", a, gram, a)
        return np.asarray(error / self.count)

    def solve(self, degree: int) -> tuple[Floats, Floats]:
        """Coefficients in the basis, shape (degree + 1,), and the inverse of the Gram matrix."""
        d = slice(0, degree + 1)
        inverse = np.linalg.inv(self.gram.sum(axis=0)[d, d])
        a = inverse @ self.moment.sum(axis=0)[d]
        a[0] += self._mean
        return a, inverse


def _noise(halves: list[Half], x: Floats, residual: Floats, range_V: float) -> Noise:
    """From the residuals of successive half-loops of the same direction, row by nearest row."""
    edges = np.cumsum([0] + [h.rows.size for h in halves])
    pieces = [slice(a, b) for a, b in pairwise(edges)]
    before: dict[tuple[int, bool], slice] = {}
    differences = []
    for half, piece in zip(halves, pieces, strict=True):
        last = before.get((half.record, half.rising))
        if last is not None:
            nearest = _nearest(x[last], x[piece])
            pair = np.abs(x[last][nearest] - x[piece]) <= PAIR_SHARE * range_V
            difference = residual[piece] - residual[last][nearest]
            differences.append(difference[pair] / np.sqrt(2.0))
        before[half.record, half.rising] = piece
    if differences and np.concatenate(differences).size > residual.size / 4:
        d, source = np.concatenate(differences), "cycle-to-cycle differences"
    else:
        d, source = residual, "residuals"
    return Noise(float(np.sqrt(np.mean(d**2))), correlation_rows(d), source)


def _nearest(among: Floats, wanted: Floats) -> Rows:
    """Index of the value nearest to each wanted one."""
    order = np.argsort(among, kind="stable")
    ordered = among[order]
    right = np.clip(np.searchsorted(ordered, wanted), 1, max(1, ordered.size - 1))
    right = np.minimum(right, ordered.size - 1)
    left = np.maximum(right - 1, 0)
    closer = np.abs(wanted - ordered[left]) <= np.abs(ordered[right] - wanted)
    return np.asarray(order[np.where(closer, left, right)])


def correlation_rows(d: Floats) -> float:
    """1 + 2 * sum of the autocorrelation up to its first zero."""
    from scipy.signal import correlate

    if not d.any():
        return 1.0
    auto = correlate(d, d, method="fft")[d.size - 1 :]
    auto = auto / auto[0]
    negative = np.flatnonzero(auto <= 0.0)
    end = int(negative[0]) if negative.size else d.size
    return float(1.0 + 2.0 * auto[1:end].sum())


def _asymmetry(
    x: Floats, residual: Floats, rising: NDArray[np.bool_], range_V: float, noise: Noise
) -> tuple[Floats, Floats]:
    """Ascending branch above the mirrored descending one, per bin of x, and its standard error."""
    at = np.where(rising, x, range_V - x) / range_V
    bins = np.clip((at * BINS).astype(np.intp), 0, BINS - 1)
    total, variance = np.zeros(BINS), np.zeros(BINS)
    with np.errstate(invalid="ignore", divide="ignore"):
        for branch in (rising, ~rising):
            count = np.bincount(bins[branch], minlength=BINS)
            total += np.bincount(bins[branch], residual[branch], BINS) / count
            variance += noise.sigma**2 * np.minimum(noise.rows, count) / count
    return total, np.sqrt(variance)


def _check_symmetry(asymmetry: Floats, spread: Floats, stroke: float, unit: str) -> Iterator[str]:
    rms, most = _rms(asymmetry), _most(asymmetry)
    if rms is None or most is None:
        return
    if rms > max(3.0 * (_rms(spread) or 0.0), 1e-3 * stroke):
        yield (
            f"the loop is not centrally symmetric: the descending branch, mirrored, lies up to "
            f"{most:.3g} {unit} ({percent(most, stroke)}) off the ascending one, "
            f"{rms:.3g} {unit} rms; the model takes the mean of both"
        )


def _check_curve(model: Model, stroke: float) -> Iterator[str]:
    x = np.linspace(0.0, model.range_V, 201)
    y = Polynomial(model.f0)(x)
    if y[-1] < y[0]:
        yield "the displacement falls as the voltage rises: is the sensor's sign reversed?"
    against = -np.diff(y) * np.sign(y[-1] - y[0])
    if against.max() > 1e-6 * stroke:
        i = int(np.argmax(against))
        yield (
            f"f0 runs back near {model.u_min_V + x[i]:.3g} V: the degree is too high, or a lag "
            f"rounds the ends of the loop"
        )


def _check_float(
    model: Model, records: Sequence[Record], stroke: float, unit: str
) -> Iterator[str]:
    u = np.concatenate([r.u_V for r in records])
    off = np.abs(Predictor(model, "float32").run(u) - Predictor(model, "float64").run(u)).max()
    if off > 2e-4 * stroke:
        yield (
            f"the firmware's float arithmetic is off by up to {off:.2g} {unit} "
            f"({percent(float(off), stroke)}): use a lower --degree"
        )


def _rms(values: Floats) -> float | None:
    """Of the finite values; None when there are none."""
    values = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(values**2))) if values.size else None


def _most(values: Floats) -> float | None:
    """The largest finite value, whatever its sign."""
    values = values[np.isfinite(values)]
    return float(np.abs(values).max()) if values.size else None


def percent(value: float, stroke: float) -> str:
    """A size as a share of the stroke, for people, with its sign."""
    if stroke <= 0.0:
        return "stroke 0"
    share = 100.0 * value / stroke
    return f"{share:.{'2g' if abs(share) < 99.5 else '0f'}} % of the stroke"


def summary(found: Identification) -> list[str]:
    """What a user wants to know of an identification, a line each."""
    model = found.model
    unit = model.extra.get("y_unit", "um")
    stroke = model.extra[f"stroke_{unit}"]

    def size(key: str) -> str:
        value: Any = model.extra[f"{key}_{unit}"]
        return f"{value:.3g} {unit} ({percent(value, stroke)})"

    lines = [
        f"f0: degree {model.extra['degree']} on {model.u_min_V:g} to {model.u_max_V:g} V, from "
        f"{model.extra['rows']} rows on {model.extra['half_loops']} half-loops",
        f"stroke: {stroke:.4g} {unit}",
        f"error of the fit: rms {size('rms')}, largest {size('max')}",
        f"noise: {found.noise.sigma:.3g} {unit}, from {found.noise.source}",
    ]
    if model.extra[f"asymmetry_max_{unit}"] is not None:
        lines.append(f"asymmetry: rms {size('asymmetry_rms')}, largest {size('asymmetry_max')}")
    return lines
