"""Where the gap lies: the regions of time, input, rate, ... that hold most of its energy.

The gap is measured less predicted displacement of the baseline on the rows that are used, less
its mean over all of them, and nothing else. A region's energy share is the sum of the gap's
squares in it over the sum of all; its enrichment is that over the share of samples in it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from madelung.diagnosis.case import Trace
from madelung.diagnosis.noise import Noise
from madelung.diagnosis.regions import (
    BRANCHES,
    UNITS,
    Axis,
    Region,
    Side,
    coordinate,
    holds,
    part,
)

Array = NDArray[np.float64]

CELLS_MAX = 40
PER_DECADE = 80
QUIETEST_OF = 2
"""Edges on logarithmic axes stand where the fewest of so many neighbours are."""
DECADES_MAX = 5
REGIONS_MAX = 6
ENRICHMENT_MIN = 1.25
SCORE_MIN = 0.05
SCORE_SHARE = 0.1
"""Regions that tell less than this share of the first are not worth a line."""
MIDDLE = 0.8
"""What an interval with two ends is worth, beside one with one end."""
BY_THE_CLOCK = 0.8
"""What time and record are worth, beside axes that say something of the cause."""
USUAL_MIN = 0.02
"""Regions smaller than this share of the samples are no more telling for it."""
TRIMMED = 0.03
"""A band of frequencies is narrowed as long as it keeps all but this share of its energy."""
CHANCE = 1e-7
"""Of noise to pass for a region: thousands of intervals are tried."""
SIGMAS = 5.0
"""Errors of the noise floor that are allowed for."""
NOISE_ERROR = 0.03
"""Relative error of the noise floor beside that of its estimate."""
BLOCKS = 200
RESAMPLES = 400
BAND_CELLS = 100
LINE_SHARE = 0.015
"""No band is narrower, to either side."""
DENSE = 0.01
"""Values are dense where neighbours differ by less than this share."""


@dataclass(frozen=True)
class _Cells:
    """An axis cut into K cells: energy, noise's energy (um^2), share that would be no wonder."""

    edges: Array
    energy: Array
    noise: Array
    usual: Array


def locate(
    traces: Sequence[Trace],
    gap_um: Sequence[Array],
    noise: Noise,
    ends_V: tuple[float, float] | None = None,
    seed: int = 0,
) -> list[Region]:
    """The few regions that hold most of the gap, the most telling first.

    On every axis the interval or category is sought whose share of the energy above the noise
    floor, times the logarithm of its enrichment, is largest. What is no news does not count for
    it: on the axis frequency the measured displacement's own share, on the axis time the record's.
    Regions that noise or chance would make are left out.

    Parameters
    ----------
    traces
        Train records; others are left out.
    gap_um
        By trace, (n,): measured less predicted displacement.
    noise
        The noise floor.
    ends_V
        u_min and u_max of the case; else the lowest and highest command of the traces.
    seed
        Of the bootstrap.

    Returns
    -------
    At most `REGIONS_MAX` regions, at most one of an axis; none where the gap is noise.
    """
    pairs = [(t, g) for t, g in zip(traces, gap_um, strict=True) if t.role == "train"]
    pairs = [(t, g) for t, g in pairs if t.use.any()]
    if not pairs:
        return []
    if ends_V is None:
        ends_V = (min(t.u_V.min() for t, _ in pairs), max(t.u_V.max() for t, _ in pairs))
    gap = _Gap([t for t, _ in pairs], [g for _, g in pairs], noise, ends_V, seed)
    if gap.total == 0.0:
        return []
    found = [f for axis in UNITS if (f := gap.best(axis)) is not None]
    kept = [(s, r) for s, r in found if s >= SCORE_MIN and gap.is_telling(r)]
    if not kept and gap.is_above_noise():
        kept = sorted(found, key=lambda f: -f[1].enrichment)[:1]
    kept.sort(key=lambda f: -f[0])
    return [r for s, r in kept[:REGIONS_MAX] if s >= SCORE_SHARE * kept[0][0]]


class _Gap:
    """The gap of all used rows, and what is needed to measure regions of it."""

    def __init__(
        self,
        traces: list[Trace],
        gap_um: list[Array],
        noise: Noise,
        ends_V: tuple[float, float],
        seed: int,
    ) -> None:
        self.traces, self.noise, self.ends_V = traces, noise, ends_V
        used = np.concatenate([g[t.use] for t, g in zip(traces, gap_um, strict=True)])
        mean = float(used.mean())
        self.gap = [np.where(t.use, g - mean, 0.0) for t, g in zip(traces, gap_um, strict=True)]
        self.energy = (used - mean) ** 2
        self.total = float(self.energy.sum())
        self.rows = np.array([int(t.use.sum()) for t in traces])
        self.ends = np.append(0, np.cumsum(self.rows))
        spreads = [noise.rows_per_independent(t.step_s) for t in traces]
        self.spread = float(np.average(spreads, weights=self.rows))
        self._blocks = self._block_edges()
        self._seed = seed
        self._known: dict[Axis, Array] = {}

    def values(self, axis: Axis) -> Array:
        """Places of all used rows on an axis, (N,)."""
        if axis not in self._known:
            parts = [coordinate(axis, t, self.ends_V)[t.use] for t in self.traces]
            self._known[axis] = np.concatenate(parts)
        return self._known[axis]

    def best(self, axis: Axis) -> tuple[float, Region] | None:
        """The most telling region of an axis and its score; None where the axis has but one."""
        score, region = max(self._tries(axis), key=lambda f: f[0], default=(0.0, None))
        if region is None:
            return None
        worth = BY_THE_CLOCK if axis in ("time", "record") else 1.0
        return worth * score, self._measured(region)

    def is_telling(self, region: Region) -> bool:
        """Whether neither noise nor chance explains the region."""
        if region.enrichment < ENRICHMENT_MIN or region.enrichment_ci95[0] <= 1.0:
            return False
        energy = region.energy_share * self.total
        spread = 1.0 if region.axis == "frequency" else self.spread
        return energy > self._bound(region.noise_share * energy, region.sample_share, spread)

    def is_above_noise(self) -> bool:
        """Whether the whole is more than noise."""
        return self.total > self._bound(self.total_noise, 1.0, self.spread)

    @property
    def total_noise(self) -> float:
        """Energy that noise leaves on all rows, um^2."""
        return self.noise.rms_um**2 * float(self.rows.sum())

    @property
    def excess(self) -> float:
        """Energy above the noise floor on all rows, um^2."""
        return self.total - self.total_noise

    def _bound(self, noise_energy: float, sample_share: float, spread: float) -> float:
        """Energy that noise does not pass."""
        from scipy.stats import chi2

        free = max(sample_share * float(self.rows.sum()) / spread, 1.0)
        error = np.hypot(np.sqrt(2 * self.spread / max(self.noise.samples, 1)), NOISE_ERROR)
        chance = float(chi2.isf(CHANCE, free)) / free
        return float(noise_energy * chance * (1 + SIGMAS * error))

    # -- candidates -----------------------------------------------------------------------

    def _tries(self, axis: Axis) -> Iterator[tuple[float, Region]]:
        if axis == "frequency":
            yield from self._intervals(axis, self._frequency_cells())
        elif axis == "time":
            for i in range(len(self.traces)):
                rows = slice(self.ends[i], self.ends[i + 1])
                values = self.values(axis)[rows]
                cells = self._cells(values, _edges(axis, values), self.energy[rows])
                # A record's own share of the gap is the axis record's to tell.
                own = float((cells.energy - cells.noise).sum()) / max(self.excess, 1e-300)
                share = max(own * self.energy.size / values.size, 1.0)
                cells = replace(cells, usual=cells.usual * share)
                yield from self._intervals(axis, cells, self.traces[i].name)
        elif axis == "record":
            names = [t.name for t in self.traces]
            yield from self._categories(axis, np.repeat(np.arange(len(names)), self.rows), names)
        elif axis == "branch":
            yield from self._categories(axis, self.values(axis), BRANCHES)
        else:
            values = self.values(axis)
            yield from self._intervals(axis, self._cells(values, _edges(axis, values), self.energy))

    def _categories(
        self, axis: Axis, index: NDArray[Any], names: Sequence[str]
    ) -> Iterator[tuple[float, Region]]:
        cells = self._cells(index, np.arange(1.0, len(names)), self.energy)
        for name, score in zip(names, np.diag(_scores(cells, self.excess), 1), strict=True):
            if score > 0:
                yield float(score), Region(axis, name, None, UNITS[axis], "at")

    def _intervals(
        self, axis: Axis, cells: _Cells, record: str | None = None
    ) -> Iterator[tuple[float, Region]]:
        """The best interval between edges, if any."""
        scores = _scores(cells, self.excess)
        last = cells.edges.size - 1
        scores[1:last, 1:last] *= MIDDLE
        scores[0, last] = 0.0
        i, j = np.unravel_index(int(np.argmax(scores)), scores.shape)
        score = float(scores[i, j])
        if score <= 0:
            return
        low, high = float(cells.edges[i]), float(cells.edges[j])
        side: Side = "below" if i == 0 else "above" if j == last else "between"
        if axis == "nesting":
            low, high = float(np.ceil(low)), float(np.floor(high))
        if axis in ("rate", "since_turn"):
            values = self.values(axis)
            low = low if i == 0 else _apart(values, low)
            high = high if j == last else _apart(values, high)
        if axis == "frequency" and side == "between":
            low, high = self._trimmed(low, high)
        yield score, Region(axis, low, high, UNITS[axis], side, record)

    def _cells(self, values: Array, inner: Array, energy: Array) -> _Cells:
        """Cells of used rows by their values; inner edges ascend."""
        at = np.searchsorted(inner, values, side="right")
        count = np.bincount(at, minlength=inner.size + 1).astype(np.float64)
        held = _sums(at, energy, inner.size + 1)
        outer = _outward(float(values.min()), float(values.max()))
        edges = np.concatenate([[outer[0]], inner, [outer[1]]])
        noise = self.noise.rms_um**2 * count
        return _Cells(edges, held, noise, count / self.energy.size)

    def _frequency_cells(self) -> _Cells:
        freq, bins, power, noise = self._spectrum
        y = [np.where(t.use, t.y_um - t.y_um[t.use].mean(), 0.0) for t in self.traces]
        inner = _log_edges(freq, power)
        at = np.searchsorted(inner, freq, side="right")
        share, held, floor, moved = (
            _sums(at, w, inner.size + 1)
            for w in (bins, power, noise, np.concatenate([_periodogram(v) for v in y]))
        )
        edges = np.concatenate([[0.0], inner, [float(freq.max())]])
        usual = np.maximum(share / share.sum(), moved / max(float(moved.sum()), 1e-300))
        return _Cells(edges, held, floor, usual)

    @cached_property
    def _spectrum(self) -> tuple[Array, Array, Array, Array]:
        """Frequency, rows that it stands for, energy and noise's energy of every bin."""
        from scipy.fft import rfftfreq

        freq, rows, power, noise = [], [], [], []
        for trace, gap in zip(self.traces, self.gap, strict=True):
            freq.append(rfftfreq(gap.size, trace.step_s))
            rows.append(_multiplicity(gap.size) * trace.use.mean())
            power.append(_periodogram(gap))
            noise.append(self.noise.spectrum(freq[-1], trace.step_s) * rows[-1])
        f, n, p, s = (np.concatenate(v) for v in (freq, rows, power, noise))
        return f, n, p, s

    def _trimmed(self, low: float, high: float) -> tuple[float, float]:
        """The narrowest part of a band that keeps nearly all of its energy."""
        freq, _, power, noise = self._spectrum
        inside = (freq >= low) & (freq <= high)
        f, e = freq[inside], (power - noise)[inside]
        fine = np.linspace(low, high, BAND_CELLS + 1)
        held = _sums(np.searchsorted(fine[1:-1], f, side="right"), e, BAND_CELLS)
        share = np.append(0.0, np.cumsum(held)) / held.sum()
        i = int(np.flatnonzero(share <= TRIMMED / 2)[-1])
        j = int(np.flatnonzero(share >= 1 - TRIMMED / 2)[0])
        line = (fine[i] + fine[j]) / 2
        return (
            _round(min(float(fine[i]), line * (1 - LINE_SHARE))),
            _round(max(float(fine[j]), line * (1 + LINE_SHARE))),
        )

    # -- measure --------------------------------------------------------------------------

    def _block_edges(self) -> NDArray[np.int64]:
        """First used row of each block; a block lies within one record."""
        n = self.rows.sum()
        starts = [
            np.linspace(a, b, max(1, round(BLOCKS * (b - a) / n)), endpoint=False)
            for a, b in zip(self.ends[:-1], self.ends[1:], strict=True)
        ]
        return np.concatenate(starts).astype(np.int64)

    def _inside(self, region: Region) -> tuple[Array, Array, float]:
        """Energy in the region and share of the sample in it, by used row; noise's energy."""
        n = self.energy.size
        if region.axis == "frequency":
            return self._inside_band(region)
        if region.axis in ("record", "time"):
            i = [t.name for t in self.traces].index(str(region.record or region.low))
            inside = np.zeros(n, np.bool_)
            rows = slice(self.ends[i], self.ends[i + 1])
            inside[rows] = True
            if region.axis == "time":
                inside[rows] = holds(region, self.values("time")[rows])
        else:
            inside = holds(region, self.values(region.axis))
        share = inside.astype(np.float64)
        return self.energy * share, share, self.noise.rms_um**2 * float(share.sum())

    def _inside_band(self, region: Region) -> tuple[Array, Array, float]:
        freq, bins, _, noise = self._spectrum
        band = holds(region, freq)
        energy, share = [], []
        ends = np.cumsum([g.size // 2 + 1 for g in self.gap])[:-1]
        held = [float(b.sum()) for b in np.split(bins * band, ends)]
        for trace, gap, rows, n in zip(self.traces, self.gap, self.rows, held, strict=True):
            left = part(region, trace, gap, self.ends_V) ** 2
            kept = left[trace.use]
            energy.append(kept * (left.sum() / max(float(kept.sum()), 1e-300)))
            share.append(np.full(rows, n / rows))
        return np.concatenate(energy), np.concatenate(share), float(noise @ band)

    def _measured(self, region: Region) -> Region:
        """The region with its shares and their intervals."""
        energy, share, noise = self._inside(region)
        sums = [
            np.add.reduceat(v, self._blocks)
            for v in (energy, self.energy, share, np.ones_like(share))
        ]
        count = self._blocks.size
        rng = np.random.default_rng(self._seed)
        draws = np.vstack(
            [np.ones(count), rng.multinomial(count, np.full(count, 1 / count), RESAMPLES)]
        )
        held, whole, inside, rows = (draws @ s for s in sums)
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = held / whole
            enriched = shares / (inside / rows)
        return replace(
            region,
            energy_share=float(min(shares[0], 1.0)),
            enrichment=float(enriched[0]),
            sample_share=float(inside[0] / rows[0]),
            energy_share_ci95=_ci95(np.minimum(shares, 1.0)),
            enrichment_ci95=_ci95(enriched),
            noise_share=float(min(noise / max(held[0], 1e-300), 1.0)),
        )


def _scores(cells: _Cells, total: float) -> Array:
    """How telling each interval (i, j) of cells is, (K + 1, K + 1): share times log enrichment."""
    excess = np.append(0.0, np.cumsum(cells.energy - cells.noise))
    held = excess[None, :] - excess[:, None]
    usual = np.append(0.0, np.cumsum(cells.usual))
    p = np.clip(usual[None, :] - usual[:, None], USUAL_MIN, 1.0)
    s = np.clip(held / max(total, float(held.max()), 1e-300), 0.0, 1.0)
    score: Array = s * np.log(np.maximum(s, 1e-12) / p)
    return np.where(np.triu(score > 0, 1), score, 0.0)


def _sums(cell: NDArray[np.int64], weights: Array, size: int) -> Array:
    """Sum of the weights by cell."""
    return np.bincount(cell, weights, size).astype(np.float64)


def _edges(axis: Axis, values: Array) -> Array:
    if axis == "nesting":
        held = np.unique(values)
        every = -(-held.size // CELLS_MAX)
        return held[every::every] - 0.5
    if axis in ("input", "time"):
        return _linear_edges(float(values.min()), float(values.max()))
    return _log_edges(values, np.ones_like(values))


def _linear_edges(low: float, high: float) -> Array:
    """Round numbers strictly between the ends, at most `CELLS_MAX`."""
    least = (high - low) / CELLS_MAX
    power = 10.0 ** np.floor(np.log10(max(least, 1e-12)))
    step = power * next(k for k in (1.0, 2.0, 2.5, 5.0, 10.0) if k * power >= least)
    edges = np.round(np.arange(np.floor(low / step) + 1, np.ceil(high / step)) * step, 12)
    inner: Array = edges[(edges > low) & (edges < high)]
    return inner


def _log_edges(values: Array, weights: Array) -> Array:
    """Edges in log steps, each where the fewest lie of `QUIETEST_OF` neighbours."""
    positive = values[values > 0]
    if positive.size == 0:
        return np.empty(0)
    top = float(np.log10(positive.max()))
    bottom = max(float(np.log10(positive.min())), top - DECADES_MAX)
    fine = np.arange(np.floor(bottom * PER_DECADE), np.ceil(top * PER_DECADE) + 1)
    tried = np.unique([_round(v) for v in 10.0 ** (fine / PER_DECADE)])
    held = np.bincount(np.searchsorted(tried, values, side="right"), weights, tried.size + 1)
    near = held[:-1] + held[1:]
    near = np.append(near, np.full(-near.size % QUIETEST_OF, np.inf)).reshape(-1, QUIETEST_OF)
    chosen = np.arange(near.shape[0]) * QUIETEST_OF + near.argmin(axis=1)
    edges = tried[chosen]
    inner: Array = edges[(edges > positive.min()) & (edges < positive.max())]
    return inner


def _round(value: float) -> float:
    return float(f"{value:.3g}")


def _apart(values: Array, edge: float) -> float:
    """The roundest number between the same values as an edge, but apart from them.

    So rounding does not decide on which side they lie. Where they lie dense it matters little.
    """
    at = edge * (1 - 1e-9)
    below, above = values[values < at], values[values >= at]
    if below.size == 0 or above.size == 0:
        return edge
    a, b = float(below.max()), float(above.min())
    if b - a < DENSE * edge:
        return edge
    for digits in range(1, 7):
        tried = float(f"{(a + b) / 2:.{digits}g}")
        if a + 0.2 * (b - a) <= tried <= b - 0.2 * (b - a):
            return tried
    return edge


def _outward(low: float, high: float) -> tuple[float, float]:
    """Both ends, rounded outward to a thousandth or so of their distance."""
    unit = 10.0 ** (np.floor(np.log10(max(high - low, 1e-9))) - 2)
    return (
        float(np.round(np.floor(low / unit) * unit, 12)),
        float(np.round(np.ceil(high / unit) * unit, 12)),
    )


def _multiplicity(n: int) -> Array:
    """How many bins of the two-sided transform each of the one-sided stands for."""
    m = np.full(n // 2 + 1, 2.0)
    m[0] = 1.0
    if n % 2 == 0:
        m[-1] = 1.0
    return m


def _periodogram(values: Array) -> Array:
    """Energy of each one-sided bin; their sum is the values' sum of squares."""
    from scipy.fft import rfft

    power: Array = np.abs(rfft(values)) ** 2 * _multiplicity(values.size) / values.size
    return power


def _ci95(draws: Array) -> tuple[float, float]:
    """Of the resamples, widened to hold the estimate that stands first."""
    good = draws[1:][np.isfinite(draws[1:])]
    low, high = np.quantile(good, [0.025, 0.975]) if good.size else (draws[0], draws[0])
    return float(min(low, draws[0])), float(max(high, draws[0]))
