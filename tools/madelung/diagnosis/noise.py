"""The noise floor: a model of the sensor's noise from cycle-to-cycle differences.

White noise plus at most two Ornstein-Uhlenbeck processes (AR(1) at any sample time), so that one
spectrum in Hz serves records of every rate. Whatever repeats from cycle to cycle is not noise,
whether or not a model explains it. Few cycles show little of slow noise: how little, the
likelihood's curvature tells (`Noise.upper`).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.signal import lfilter

from madelung.diagnosis.case import Trace

Array = NDArray[np.float64]
TREND_DEGREE = 3
BRANCH_DEGREE = 7
SINGLE_LOOP = 2.2
"""A single loop moves by less than so many times its swing."""
BINS_MAX = 400
PARTS_MAX = 2
PART_GAIN = 4.0
"""Log-likelihood that a further coloured part must add: 2 percent by chance."""
GUESS_ERROR = 0.3
"""Share of a floor's power that it may well be off by where no cycle repeats."""
OVERLAP = 0.5
"""Differences of successive cycles overlap: as much is known as from this share of them."""
WINDOWS = 100
"""Of a cycle, over which slopes are taken, ..."""
WHOLE_SHARE = 0.5
"""... where u moves by this share of what it does in the mean."""
FIRST_ERRORS = 5.0
"""Standard errors of its mean square by which the first ascent shows more, to be left out; ..."""
FIRST_ROWS_MIN = 50
"""... and its rows at least."""
START_LEFT = 1e-6
ROWS_MIN = 200
"""Differences from which a noise can be told."""
BANDS = 18
SURE_ERRORS = 3.0
SURE_ROWS = 50
LEFT_MIN = 0.1
"""Standard errors above what is left in a band that the noise may well be, if that many rows tell
of it; and the least share of the noise as estimated that is believed."""


@dataclass(frozen=True)
class Noise:
    """Standard deviations (um) of the parts, correlation times (s) of the coloured ones.

    ``samples`` is the number of differences it was estimated from, ``known`` whether these were
    differences of cycles (else of neighbouring samples). ``slow_um``, ``slow_tau_s``: a second
    coloured part. ``lowest_hz``: below, nothing was seen. ``covariance`` of the estimate, in the
    coordinates of `_gradient`.
    """

    white_um: float
    coloured_um: float
    tau_s: float
    samples: int
    known: bool
    slow_um: float = 0.0
    slow_tau_s: float = 1.0
    lowest_hz: float = 0.0
    covariance: tuple[tuple[float, ...], ...] = ()

    @property
    def rms_um(self) -> float:
        """Of the sum of all parts."""
        return float(np.sqrt(self.white_um**2 + self.coloured_um**2 + self.slow_um**2))

    @property
    def parts(self) -> list[tuple[float, float]]:
        """Standard deviation (um) and correlation time (s) of the coloured parts there are."""
        both = ((self.coloured_um, self.tau_s), (self.slow_um, self.slow_tau_s))
        return [part for part in both if part[0] > 0]

    def whiten(self, values: Array, step_s: float) -> Array:
        """Rows (..., n) of a record divided by the noise's spectrum: unit white where noise."""
        if not self.parts:
            return values / self.white_um
        f = _whitener(self, step_s)
        white: Array = lfilter(f.ar, f.ma, values, axis=-1) / f.sigma
        n = min(white.shape[-1], f.start.shape[0])
        start = f.start[:n]
        white[..., :n] -= ((white[..., :n] @ start) * f.excess) @ start.T
        return white

    def spectrum(self, freq_hz: Array, step_s: float) -> Array:
        """Two-sided power spectral density times sample rate, um^2, at frequencies in Hz."""
        density = np.full(freq_hz.shape, self.white_um**2)
        for um, tau in self.parts:
            density += um**2 * _unit(freq_hz, tau, step_s)
        return density

    def upper(self, freq_hz: Array, step_s: float) -> Array:
        """How many times the estimated power the noise may well have, (n,), at least 1.

        One standard error; and below the lowest frequency that was seen it may go on to rise as
        flicker noise does, with 1 / f.
        """
        unseen = np.maximum(1.0, self.lowest_hz / np.maximum(freq_hz, 1e-9))
        if not self.covariance:
            return np.asarray(unseen)
        slope = _gradient(self, freq_hz, step_s)
        spread = np.sqrt(np.einsum("ij,ik,jk->k", np.array(self.covariance), slope, slope))
        return np.asarray(unseen * np.exp(spread))

    def level_error(self, step_s: float) -> float:
        """Standard error of the mean square of a whitened record, as a share of it."""
        if not self.covariance:
            return float(np.sqrt(2 / max(self.samples, 1)))
        freq = np.linspace(0.0, 0.5 / step_s, BINS_MAX)
        slope = _gradient(self, freq, step_s).mean(axis=1)
        return float(np.sqrt(slope @ np.array(self.covariance) @ slope))

    def power_error(self) -> float:
        """Standard error of the noise's mean square, as a share of it."""
        if not self.known:
            return GUESS_ERROR
        if not self.covariance:
            return float(np.sqrt(2 / max(self.samples, 1)))
        # Of `_gradient`'s parameters the first of every part is a power, the other a time.
        of_power = np.array([1.0, *(1.0, 0.0) * len(self.parts)])
        return float(np.sqrt(of_power @ np.array(self.covariance) @ of_power)) / self.rms_um**2

    def rows_per_independent(self, step_s: float) -> float:
        """Rows that tell as much about the noise's power as one independent row."""
        total = self.rms_um**2
        shares = [(um**2 / total, np.exp(-step_s / tau)) for um, tau in self.parts]
        lags = sum(p * q * a * b / max(1 - a * b, 1e-9) for p, a in shares for q, b in shares)
        return float(1.0 + 2.0 * lags)


@dataclass(frozen=True)
class _Whitener:
    """ARMA filter of a noise at a sample time, and how its unknown past is made up for.

    Without its past the filter gives too much at the start: along the columns of ``start``,
    (n, parts), by the share ``excess`` too much.
    """

    ar: Array
    ma: Array
    sigma: float
    start: Array
    excess: Array


@lru_cache(maxsize=64)
def _whitener(noise: Noise, step_s: float) -> _Whitener:
    """Spectral factorisation in y = 2 - z - 1 / z, in which all roots are real and negative."""
    decays = np.array([np.exp(-step_s / tau) for _, tau in noise.parts])
    factors = [np.array([np.exp(-step_s / t), np.expm1(-step_s / t) ** 2]) for _, t in noise.parts]
    whole = np.ones(1)
    for factor in factors:
        whole = np.polymul(whole, factor)
    density = noise.white_um**2 * whole
    for i, (um, tau) in enumerate(noise.parts):
        rest = np.array([-(um**2) * np.expm1(-2 * step_s / tau)])
        for j, factor in enumerate(factors):
            rest = np.polymul(rest, factor) if j != i else rest
        density = np.polyadd(density, rest)
    density = np.trim_zeros(density, "f")
    q = -np.real(np.roots(density))
    zeros = 1 + q / 2 - np.sqrt(q + q * q / 4)
    sigma = float(np.sqrt(density[0] / np.prod(zeros)))
    ar, ma = np.atleast_1d(np.poly(decays)), np.atleast_1d(np.poly(zeros))
    return _Whitener(ar, ma, sigma, *_start(noise, step_s, ar, ma, sigma))


def _start(noise: Noise, step_s: float, ar: Array, ma: Array, sigma: float) -> tuple[Array, Array]:
    """What the past before a record adds to the filter's output, as directions and shares."""
    k = ar.size - 1
    lag = np.abs(np.subtract.outer(np.arange(k), np.arange(k))) * step_s
    covariance = noise.white_um**2 * np.eye(k)
    for um, tau in noise.parts:
        covariance = covariance + um**2 * np.exp(-lag / tau)
    seen = np.array([[ar[i - j] if i >= j else 0.0 for j in range(k)] for i in range(k)])
    known = np.array([[_at(ma, i - j) for j in range(k)] for i in range(k)])
    past = seen @ covariance @ seen.T / sigma**2 - known @ known.T
    slowest = max(np.abs(np.roots(ma)), default=0.0)
    rows = k + int(np.log(START_LEFT) / np.log(max(slowest, 1e-3)))
    kicks = np.zeros((k, rows))
    kicks[:, :k] = np.eye(k)
    directions, r = np.linalg.qr(lfilter([1.0], ma, kicks, axis=-1).T)
    size, turn = np.linalg.eigh(r @ past @ r.T)
    return directions @ turn, 1 - 1 / np.sqrt(1 + np.maximum(size, 0.0))


def _at(values: Array, i: int) -> float:
    return float(values[i]) if 0 <= i < values.size else 0.0


def _unit(freq_hz: Array, tau_s: float, step_s: float) -> Array:
    """Spectrum of a coloured part of variance 1."""
    a = np.exp(-step_s / tau_s)
    z = np.exp(-2j * np.pi * freq_hz * step_s)
    density: Array = -np.expm1(-2 * step_s / tau_s) / np.abs(1 - a * z) ** 2
    return density


def _gradient(noise: Noise, freq_hz: Array, step_s: float) -> Array:
    """Of the spectrum's logarithm by white_um^2, and each part's um^2 and log tau, (p, n)."""
    rows = [np.ones(freq_hz.shape)]
    for um, tau in noise.parts:
        unit = _unit(freq_hz, tau, step_s)
        rows += [unit, um**2 * (_unit(freq_hz, tau * 1.001, step_s) - unit) / 0.001]
    slope: Array = np.array(rows) / noise.spectrum(freq_hz, step_s)
    return slope


def proven_fall(
    noise: Noise, old: Sequence[Array], new: Sequence[Array], steps_s: Sequence[float]
) -> float:
    """Fall from one hypothesis's whitened residuals to another's, under the least favourable noise.

    In each frequency band the fall is counted in units of the largest of: what the noise may well
    be (`Noise.upper`), unless every record leaves less; what the new hypothesis leaves there in
    this record, and in the middle one of all records (noise that was underestimated is so in all).

    Parameters
    ----------
    old, new
        By record, (n,); zero where rows are left out.
    steps_s
        Sample times of the records.
    """
    longest = max(r.size * step for r, step in zip(new, steps_s, strict=True))
    edges = np.geomspace(1.0 / longest, 0.5 / min(steps_s), BANDS)[1:-1]
    centres = np.sqrt(np.append(0.5 / longest, edges) * np.append(edges, 0.5 / min(steps_s)))
    parts = [_bands(a, b, step, edges) for a, b, step in zip(old, new, steps_s, strict=True)]
    left = np.array([[*(b / np.where(n > 0, n, np.nan))] for _, b, n in parts])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a band that no record has
        middle = np.nan_to_num(np.nanmedian(left, axis=0), nan=1.0)
        most = np.nan_to_num(np.nanmax(left, axis=0), nan=np.inf)
    rows = sum(n for _, _, n in parts)
    most = np.maximum(most * (1 + SURE_ERRORS * np.sqrt(2 / np.maximum(rows, 1.0))), LEFT_MIN)
    most[rows < SURE_ROWS] = np.inf  # there a fit of few parameters takes all there is
    total = 0.0
    for (fall, _, _), own, step in zip(parts, left, steps_s, strict=True):
        noisy = np.minimum(np.maximum(noise.upper(centres, step), 1.0), most)
        total += float(np.sum(fall / np.maximum(noisy, np.fmax(own, middle))))
    return total


def _bands(old: Array, new: Array, step_s: float, edges: Array) -> tuple[Array, Array, Array]:
    """By band: fall of the energy, what is left of it, and what noise would leave."""
    n = new.size
    before, after = (np.abs(np.fft.rfft(r)) ** 2 / n for r in (old, new))
    weight = np.full(before.size, 2.0)
    weight[0] = 1.0
    if n % 2 == 0:
        weight[-1] = 1.0
    band = np.searchsorted(edges, np.arange(before.size) / (n * step_s), side="right")
    share = float(np.count_nonzero(new)) / n
    fall, left, rows = (
        np.asarray(np.bincount(band, v, edges.size + 1), np.float64)
        for v in ((before - after) * weight, after * weight, weight * share)
    )
    return fall, left, rows


def estimate_noise(trace: Trace) -> Noise:
    """The noise of a record of two or more cycles.

    Of a single loop it is what no smooth curve per branch explains; of any other record the
    second differences, in which colour cannot be seen. Both are guesses (``known`` is False).
    """
    y = trace.y_um[trace.use]
    coarse = float(np.diff(np.unique(y)).min(initial=np.inf)) / np.sqrt(12)
    noise = _of_cycles(trace, coarse)
    if noise is not None:
        return noise
    d = _branch_residual(trace)
    if d is not None:
        return replace(_whittle(d, trace.step_s, BRANCH_DEGREE + 5, coarse), known=False)
    whole = trace.use[2:] & trace.use[1:-1] & trace.use[:-2]
    second = np.diff(trace.y_um, 2)[whole]
    white = float(np.sqrt(np.mean(second**2) / 6)) if second.size else 0.0
    return Noise(max(white, coarse, 1e-9), 0.0, trace.step_s, second.size, known=False)


def _branch_residual(trace: Trace) -> Array | None:
    """Of a single loop, what smooth curves for its branches and a trend leave."""
    u = trace.u_V
    if np.abs(np.diff(u)).sum() > SINGLE_LOOP * np.ptp(u) or u.size < 50:
        return None
    z = 2 * (u - u.min()) / np.ptp(u) - 1
    rising = np.gradient(u) > 0
    curves = np.polynomial.legendre.legvander(z, BRANCH_DEGREE).T
    columns = [c * side for c in curves for side in (rising, ~rising)]
    return _without([*columns, *_trend(u.size)], trace.y_um, trace.use)


def _trend(n: int) -> list[Array]:
    return list(np.polynomial.legendre.legvander(np.linspace(-1, 1, n), TREND_DEGREE).T)


def _without(columns: list[Array], values: Array, good: NDArray[np.bool_]) -> Array:
    """What columns do not explain of values; rows left out are zeros, the others carry theirs."""
    design = np.column_stack(columns)
    fit = np.linalg.lstsq(design[good], values[good], rcond=None)[0]
    residual: Array = np.where(good, values - design @ fit, 0.0) / np.sqrt(good.mean())
    return residual


def _of_cycles(trace: Trace, coarse_um: float) -> Noise | None:
    """From the differences of successive cycles.

    The first ascent is left out where it shows clearly more than all later branches: an engaged
    dead band, or memory of what was before, does not come again.
    """
    differences = _cycle_differences(trace)
    if differences is None:
        return None

    def fitted(d: Array) -> Noise:
        return _whittle(d / np.sqrt(2), trace.step_s, TREND_DEGREE + 2, coarse_um)

    d, shifts, good = differences
    top = _first_top(trace.u_V)
    whole = _without([*_trend(d.size), *shifts], d, good)
    rows = np.count_nonzero(whole[:top])
    if good[top:].sum() < ROWS_MIN or rows < FIRST_ROWS_MIN:
        return fitted(whole)
    later = [*_trend(d.size - top), *(s[top:] for s in shifts)]
    calm = fitted(_without(later, d[top:], good[top:]))
    used = np.count_nonzero(whole) / whole.size
    first = used * float(whole[:top] @ whole[:top]) / (2 * rows)
    error = np.sqrt(2 * calm.rows_per_independent(trace.step_s) / rows)
    return calm if first > (1 + FIRST_ERRORS * error) * calm.rms_um**2 else fitted(whole)


def _cycle_differences(trace: Trace) -> tuple[Array, list[Array], NDArray[np.bool_]] | None:
    """Of successive cycles: their differences, what u's mismatch may add, and the rows used, (n,).

    None where there are too few.
    """
    starts = _cycle_starts(trace.u_V)
    if starts.size < 2:
        return None
    shift = int(np.median(np.diff(starts)))
    n = trace.u_V.size - shift
    if shift < 50 or n < 50:
        return None
    good = trace.use[:n] & trace.use[shift:]
    du = trace.u_V[shift:] - trace.u_V[:n]
    if good.sum() < ROWS_MIN:
        return None
    if np.sqrt(np.mean(du**2)) > 0.05 * np.ptp(trace.u_V):
        return None
    d = trace.y_um[shift:] - trace.y_um[:n]
    shifts = [du * slope for slope in _slopes(trace, max(shift // WINDOWS, 1))[:, :n]]
    return d, shifts, good


def _slopes(trace: Trace, window: int) -> Array:
    """dy/du over so many rows to either side; of the rising branches, of the falling ones, (2, n).

    Each is zero in the other's rows. Where u hardly moves, as at a turn, it is between those of the
    nearest rows of such branches where it does.
    """
    u, y = (np.pad(v, window, mode="edge") for v in (trace.u_V, trace.filled(trace.y_um)))
    du, dy = (v[2 * window :] - v[: -2 * window] for v in (u, y))
    rising = np.gradient(trace.u_V) > 0
    whole = np.abs(du) > WHOLE_SHARE * np.mean(np.abs(du))
    rows = np.arange(rising.size)
    slopes = np.zeros((2, rising.size))
    for slope, side in zip(slopes, (rising, ~rising), strict=True):
        good = np.flatnonzero(whole & side & (rising == (du > 0)))
        if good.size:
            slope[side] = np.interp(rows[side], good, dy[good] / du[good])
    return slopes


def _first_top(u: Array) -> int:
    """Rows up to where u is highest before it falls through its middle for the first time."""
    z = (u - u.min()) / np.ptp(u)
    above = int(np.argmax(z > 0.75))
    falls = np.flatnonzero(z[above:] < 0.5)
    end = above + int(falls[0]) if falls.size else u.size
    return int(np.argmax(z[:end])) + 1


def _cycle_starts(u: Array) -> NDArray[np.int64]:
    """Samples at which u rises through its middle, having been in its lower quarter before."""
    z = (u - u.min()) / np.ptp(u)
    state = np.where(z < 0.25, -1, np.where(z > 0.75, 1, 0))
    visited = np.flatnonzero(state)
    turns = np.flatnonzero((state[visited][1:] == 1) & (state[visited][:-1] == -1)) + 1
    low = visited[turns - 1]
    high = visited[turns]
    return np.array(
        [a + int(np.argmax(z[a : b + 1] >= 0.5)) for a, b in zip(low, high, strict=True)], np.int64
    )


def _whittle(d: Array, step_s: float, skip: int, white_min_um: float) -> Noise:
    """Maximum of Whittle's likelihood from bin `skip` on; coloured parts only where proven."""
    n = d.size
    power = np.abs(np.fft.rfft(d)) ** 2 / n
    freq = np.asarray(np.fft.rfftfreq(n, step_s), np.float64)
    freq, power, weight = _bins(freq[skip:-1], power[skip:-1])
    variance = float(np.average(power, weights=weight))
    if variance <= 0:
        return Noise(1e-9, 0.0, step_s, n, known=True)

    best = Noise(float(np.sqrt(variance)), 0.0, step_s, n, known=True)
    loss = float(np.sum(weight) * (np.log(variance) + 1))
    for starts in (_starts_coloured, _starts_slow):
        tries = [_fitted(freq, power, weight, start, step_s) for start in starts(best, step_s)]
        least, richer = min(tries, key=lambda t: t[0])
        if loss - least < PART_GAIN:
            break
        loss, best = least, richer
    best = replace(best, white_um=max(best.white_um, white_min_um))
    slope = _gradient(best, freq, step_s)
    told_by = OVERLAP * (slope * weight) @ slope.T
    size = np.sqrt(np.diag(told_by))  # of um^2 and of a time's logarithm
    scaled = np.linalg.pinv(told_by / np.outer(size, size), rcond=1e-12, hermitian=True)
    covariance = scaled / np.outer(size, size)
    told = tuple(tuple(float(c) for c in row) for row in covariance)
    return replace(best, lowest_hz=skip / (n * step_s), covariance=told)


def _starts_coloured(best: Noise, step_s: float) -> list[Noise]:
    return [
        replace(best, white_um=w * best.rms_um, coloured_um=c * best.rms_um, tau_s=k * step_s)
        for w, c, k in ((0.6, 0.6, 3), (0.6, 0.6, 30), (0.05, 1.0, 10), (0.05, 1.0, 50))
    ]


def _starts_slow(best: Noise, step_s: float) -> list[Noise]:
    return [
        replace(best, slow_um=size * best.rms_um, slow_tau_s=tau)
        for size in (0.3, 0.8)
        for tau in (10 * best.tau_s, 0.1 * best.tau_s)
    ]


def _fitted(
    freq: Array, power: Array, weight: Array, start: Noise, step_s: float
) -> tuple[float, Noise]:
    """From a start to the nearest best, over the logarithms of what there is."""
    keys = ["white_um", "coloured_um", "tau_s"]
    keys += ["slow_um", "slow_tau_s"] if start.slow_um > 0 else []
    s = np.log(np.sqrt(np.average(power, weights=weight)))
    taus = (np.log(0.3 * step_s), np.log(0.2 * start.samples * step_s))
    bounds = [taus if key.endswith("_s") else (s - 8, s + 4) for key in keys]

    def noise(p: Array) -> Noise:
        told: dict[str, Any] = {k: float(v) for k, v in zip(keys, np.exp(p), strict=True)}
        return replace(start, **told)

    def loss(p: Array) -> float:
        density = noise(p).spectrum(freq, step_s)
        return float(np.sum(weight * (np.log(density) + power / density)))

    first = np.clip(np.log([getattr(start, key) for key in keys]), *np.array(bounds).T)
    found = minimize(loss, first, method="L-BFGS-B", bounds=bounds)
    return float(found.fun), noise(found.x)


def _bins(freq: Array, power: Array) -> tuple[Array, Array, Array]:
    """Averages of the periodogram over at most `BINS_MAX` bins, narrow where f is low."""
    if freq.size <= BINS_MAX:
        return freq, power, np.ones_like(freq)
    edges = np.unique(np.geomspace(1, freq.size, BINS_MAX).astype(np.int64)) - 1
    count = np.diff(np.append(edges, freq.size)).astype(np.float64)
    return np.add.reduceat(freq, edges) / count, np.add.reduceat(power, edges) / count, count
