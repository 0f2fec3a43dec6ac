"""How far the gap shrinks on records that no fit, choice or threshold has seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from madelung.diagnosis.case import Trace
from madelung.diagnosis.fit import Fit, Problem
from madelung.diagnosis.noise import Noise
from madelung.diagnosis.regions import Region, part

Array = NDArray[np.float64]
BLOCKS = 40
TRAIN_BLOCKS = 8
DRAWS = 400
CLOSABLE_MIN = 0.05
"""Nothing can be closed when the gap's energy is above the noise by less than this share of it."""


@dataclass(frozen=True)
class Prediction:
    """Of one record, on its grid, um."""

    trace: Trace
    baseline_um: Array
    augmented_um: Array


def predict(problem: Problem, baseline: Fit, augmented: Fit) -> list[Prediction]:
    """Both predictions of a problem's records, made from u alone."""
    before = problem.simulate(baseline)
    after = problem.simulate(augmented)
    return [Prediction(t, b, a) for t, b, a in zip(problem.traces, before, after, strict=True)]


def shrink(
    predictions: Sequence[Prediction], noise: Noise, lines_hz: Sequence[float], seed: int
) -> dict[str, Any]:
    """The contract's ``shrink``: rms before and after, share of the closable gap, its interval.

    Lines of a periodic disturbance are projected out of the share alone.
    """
    records: list[dict[str, Any]] = []
    before: list[Array] = []
    after: list[Array] = []
    for p in predictions:
        use = p.trace.use
        b, a = ((p.trace.y_um - v)[use] for v in (p.baseline_um, p.augmented_um))
        records.append({"name": p.trace.name, "rms_before_um": _rms(b), "rms_after_um": _rms(a)})
        t = p.trace.t_s[use]
        before += np.array_split(_without_lines(b, t, lines_hz) ** 2, BLOCKS)
        after += np.array_split(_without_lines(a, t, lines_hz) ** 2, BLOCKS)
    eb, ea = (np.array([v.sum() for v in blocks]) for blocks in (before, after))
    n = np.array([v.size for v in before])
    rows = [int(p.trace.use.sum()) for p in predictions]
    closed, ci = _closed(eb, ea, n, noise, seed)
    return {
        "records": records,
        "rms_before_um": _pooled([r["rms_before_um"] for r in records], rows),
        "rms_after_um": _pooled([r["rms_after_um"] for r in records], rows),
        "closable_closed": closed,
        "closable_closed_ci95": ci,
    }


def _closed(
    eb: Array, ea: Array, n: Array, noise: Noise, seed: int
) -> tuple[float | None, list[float] | None]:
    """Share of the closable energy that was closed, and its interval.

    The share is a ratio of sums over blocks: its error is how much each block departs from it, by
    weight. (Blocks drawn anew do not do: a few blocks may hold all of the gap, and draws without
    them tell of nothing.) Beside it the floor varies, as far as it is not known.
    """
    floor = noise.rms_um**2
    rows = n.sum()
    closable = eb.sum() - floor * rows
    if not rows or closable < CLOSABLE_MIN * floor * rows:
        return None, None
    closed = eb.sum() - ea.sum()
    share = float(closed / closable)
    departs = (eb - ea) - share * (eb - floor * n)
    error = np.sqrt(n.size / (n.size - 1) * np.sum(departs**2)) / closable
    rng = np.random.default_rng(seed)
    floors = floor * np.exp(noise.power_error() * rng.standard_normal(DRAWS))
    # Noise is part of what is left; where by chance less is left than the floor, it is the floor.
    floors = np.minimum(floors, max(min(ea.sum(), eb.sum()) / rows, floor))
    shares = closed / np.maximum(eb.sum() - floors * rows, CLOSABLE_MIN * floor * rows)
    low, high = np.percentile(shares + error * rng.standard_normal(DRAWS), [2.5, 97.5])
    return share, [float(low), float(high)]


def _without_lines(residual: Array, t_s: Array, lines_hz: Sequence[float]) -> Array:
    """Without its components at given frequencies."""
    if not lines_hz or residual.size < 4 * len(lines_hz):
        return residual
    phases = 2 * np.pi * np.outer(t_s, lines_hz)
    design = np.hstack([np.cos(phases), np.sin(phases)])
    fit = np.linalg.lstsq(design, residual, rcond=None)[0]
    out: Array = residual - design @ fit
    return out


def _pooled(rms: Sequence[float], rows: Sequence[int]) -> float:
    """Over the rows of all records."""
    energy = sum(n * r * r for r, n in zip(rms, rows, strict=True))
    return float(np.sqrt(energy / max(sum(rows), 1)))


def cross_validated(problem: Problem, full: Fit) -> tuple[float, float]:
    """Mean square error on the train records, each block predicted by a fit to all the others.

    The second is its standard error, from how much the blocks differ.

    Parameters
    ----------
    full
        With jacobian and covariance. Without a block's rows the parameters move by what its
        residuals weighed, to first order: r' = r + J_b' (A - J_b J_b')^-1 J_b r.
    """
    size = np.sqrt(np.maximum(np.diag(full.covariance), 1e-300))
    columns = full.jacobian * size[:, None]
    whole = np.linalg.pinv(full.covariance / np.outer(size, size), rcond=1e-12, hermitian=True)
    energies, rows = [], []
    seen = problem.simulate(full)
    for trace, use, y, place in zip(
        problem.traces, problem.used, seen, problem.slices, strict=True
    ):
        if trace.role != "train":
            continue
        error = np.where(use, trace.y_um - y, 0.0) ** 2
        for block in np.array_split(np.arange(trace.u_V.size), TRAIN_BLOCKS):
            j = columns[:, place][:, block]
            r = full.residual[place][block]
            rest = np.linalg.pinv(whole - j @ j.T, rcond=1e-9, hermitian=True)
            missed = r + j.T @ (rest @ (j @ r))
            told = float(r @ r)
            worse = float(missed @ missed) / told if told else 1.0
            energies.append(float(error[block].sum()) * worse)
            rows.append(int(use[block].sum()))
    energy, n = np.array(energies), np.array(rows)
    mean = float(energy.sum()) / max(int(n.sum()), 1)
    spread = np.sqrt(energy.size / max(energy.size - 1, 1) * np.sum((energy - mean * n) ** 2))
    return mean, float(spread) / max(int(n.sum()), 1)


def region_shrink(
    regions: Sequence[Region], predictions: Sequence[Prediction], ends_V: tuple[float, float]
) -> list[dict[str, Any]]:
    """Regions of ``where`` on hold-out records: rms inside them, of a band the part in it."""
    out = []
    for region in regions:
        if region.axis in ("time", "record") or not predictions:
            continue
        sums, rows = np.zeros(2), 0.0
        for p in predictions:
            for i, y in enumerate((p.baseline_um, p.augmented_um)):
                sums[i] += float(np.sum(part(region, p.trace, p.trace.y_um - y, ends_V) ** 2))
            inside = np.ones(p.trace.u_V.size)
            if region.axis != "frequency":
                inside = part(region, p.trace, inside, ends_V)
            rows += float(np.sum(inside * p.trace.use))
        before, after = np.sqrt(sums / max(rows, 1.0))
        out.append(
            region.to_json() | {"rms_before_um": float(before), "rms_after_um": float(after)}
        )
    return out


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0
