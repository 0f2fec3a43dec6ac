"""Lines in what a hypothesis leaves: where they stand, and whether they are a disturbance.

A periodic disturbance has one amplitude in every record; what the command causes, and a model that
is not quite right, do not.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from madelung.diagnosis.case import Trace
from madelung.diagnosis.fit import Fit, Problem

Array = NDArray[np.float64]

LINES_MAX = 3
LINE_PERIODS = 5
ALIKE = 0.9
LINE_SPREAD = 2.0
"""A line whose amplitude differs by more than this from the records' mean is no disturbance."""
LINE_WHOLE = 1.5
"""Periods in a record from which on its amplitude there is known."""
LINE_SHARP = 4.0
"""Times what is beside it in the command's spectrum: a line."""
LINE_BLOCKS = 1024
"""Of a record, whose sums show what lies a few periods beside a line."""
LINE_DRIVEN = 0.3
"""Share of a line of the command that a model may be wrong by."""
LINE_PROVEN = 4.0
"""Standard errors of its amplitude, in all records together that show it as a line."""
LINE_SEEN = 8.0
"""... in records where that mean is so many standard errors."""
BINS_MAX = 2**21
"""Of a record's spectrum, more than which only its own rows may ask for."""


def peaks(problem: Problem, residual: Array) -> list[float]:
    """Frequencies (Hz) of lines that stand out of the residual, strongest first.

    A line above half of a record's rate shows in that record where it is folded to.
    """
    every = [
        (t, residual[s])
        for t, s in zip(problem.traces, problem.slices, strict=True)
        if t.role != "identify"
    ]
    length = max(t.u_V.size * t.step_s for t, _ in every)
    step_hz = 0.25 / length
    # A short burst at a high rate would be drawn out to very many bins, and tells little.
    traces = [(t, r) for t, r in every if 1 / (t.step_s * step_hz) < max(BINS_MAX, 5 * r.size)]
    spectra = []
    for t, r in traces:
        size = max(round(1 / (t.step_s * step_hz)), r.size)
        window = np.hanning(r.size)  # a strong line's side lobes would pass for others
        power = np.abs(np.fft.rfft(r * window, size)) ** 2
        spectra.append(power * 2 / float(window @ window))
    bins = np.arange(max(p.size for p in spectra))
    places = [np.minimum(bins % (2 * p.size - 2), -bins % (2 * p.size - 2)) for p in spectra]
    found: list[float] = []
    # In a shorter record a line is wider, and so is what surrounds it.
    widths = [round(length / (t.u_V.size * t.step_s)) for t, _ in traces]
    # With fewer periods in every record, as it is folded there, it may as well be drift.
    whole = [p >= 4 * LINE_PERIODS * w for p, w in zip(places, widths, strict=True)]
    may_be = np.any(whole, axis=0) & (bins > 4 * LINE_PERIODS)
    floors = [_running_median(p, 100 * w) for p, w in zip(spectra, widths, strict=True)]
    floor = _folded(floors, places)
    for _ in range(LINES_MAX):
        power = _folded(spectra, places)
        k = _lowest_peak(np.where(may_be, power - 3 * floor, 0.0))
        if not may_be[k] or power[k] < 30 + 6 * len(traces) or power[k] < 12 * floor[k]:
            break
        found.append(k * step_hz)
        for width, p, place in zip(widths, spectra, places, strict=True):
            lobes = 12 * width
            p[max(place[k] - lobes, 0) : place[k] + lobes + 1] = 0.0
    return found


def _lowest_peak(height: Array) -> int:
    """The lowest of the peaks that are about as high as the highest.

    Slow records show a line at the same place as its images, and what was cut out around another
    line may hide from the fast ones which of these it is.
    """
    k = int(np.argmax(height >= ALIKE * height.max()))
    while k + 1 < height.size and height[k + 1] > height[k]:
        k += 1
    return k


def _folded(spectra: list[Array], places: list[NDArray[np.int64]]) -> Array:
    """Sum of the records' spectra over the frequencies of the fastest."""
    return np.asarray(sum(p[at] for p, at in zip(spectra, places, strict=True)), np.float64)


def _running_median(power: Array, half: int) -> Array:
    """Median over a window, computed on a coarse grid."""
    n = power.size
    centres = np.arange(0, n, half)
    medians = [float(np.median(power[max(c - half, 0) : c + half])) for c in centres]
    out: Array = np.interp(np.arange(n), centres, medians)
    return out


def steady(problem: Problem, fit: Fit) -> bool:
    """Whether each line of a periodic disturbance has one amplitude in all records that show it.

    What the command causes, and a model that is not quite right, differ from record to record.
    """
    return all(_is_steady(problem, fit, key) for key in _keys(fit))


def steady_hz(problem: Problem, fit: Fit) -> tuple[float, ...]:
    """Frequencies of the lines that have (Hz)."""
    return tuple(fit.values[key] for key in _keys(fit) if _is_steady(problem, fit, key))


def lines_hz(fit: Fit) -> tuple[float, ...]:
    """Frequencies of all lines (Hz)."""
    return tuple(fit.values[key] for key in _keys(fit))


def _keys(fit: Fit) -> list[str]:
    """Of the lines' frequencies."""
    return [k for k in fit.values if k.startswith("freq")]


def _is_steady(problem: Problem, fit: Fit, key: str) -> bool:
    line = key.removeprefix("freq").removesuffix("_hz")
    told = [_amplitude(problem, fit, line, t) for t in problem.traces if t.role == "train"]
    amps, shown, errors = np.array(told).T
    if np.linalg.norm(shown) < LINE_PROVEN:
        return False  # what it explains it explains where it may be something else
    weights = 1 / np.square(errors)
    if not weights.any():
        return True
    typical = float(np.average(amps, weights=weights))
    spread = amps[typical > LINE_SEEN * errors] / typical
    return bool(np.all(spread >= 1 / LINE_SPREAD) and np.all(spread <= LINE_SPREAD))


def _amplitude(problem: Problem, fit: Fit, line: str, trace: Trace) -> tuple[float, float, float]:
    """Of a line in a record: um; in standard errors, 0 where it may be something else; its error.

    Folded to the bottom it may be drift, and a line of the command the model's error. At half the
    record's rate it is a line, but its phase hides a part: the error is infinite, as in those.
    """
    freq = fit.values[f"freq{line}_hz"]
    cos, sin = (fit.values[f"{part}{line}:{trace.name}"] for part in ("cos", "sin"))
    amp = float(np.hypot(cos, sin))
    density = problem.noise.spectrum(np.array([freq]), trace.step_s)[0]
    error = float(np.sqrt(2 * density / max(int(trace.use.sum()), 1)))
    folded, beside = _periods(trace, freq)
    range_per_um = problem.scales.range_V / problem.scales.stroke_um
    if folded < LINE_WHOLE or driven(trace, freq, amp * range_per_um):
        return amp, 0.0, np.inf
    return amp, amp / error, error if beside >= LINE_WHOLE else np.inf


def _periods(trace: Trace, freq_hz: float) -> tuple[float, float]:
    """Of a line as it is folded in a record, and of its beat with half of the record's rate."""
    turns = freq_hz * trace.step_s
    folded = abs(turns - round(turns))
    return float(folded * trace.u_V.size), float((0.5 - folded) * trace.u_V.size)


def driven(trace: Trace, freq_hz: float, amp_V: float) -> bool:
    """Whether the command has a line there, of which a model's error may be such a share."""
    n = trace.u_V.size
    turn = np.exp(-2j * np.pi * trace.step_s * np.arange(n) * freq_hz)
    starts = np.arange(0, n, max(n // LINE_BLOCKS, 1))
    lined = np.add.reduceat((trace.u_V - trace.u_V.mean()) * np.hanning(n) * turn, starts)
    beat = np.exp(-2j * np.pi * np.outer(np.arange(-8, 9), starts) / n)
    around = 4 * np.abs(beat @ lined) / n
    at, beside = around[7:10].max(), np.median(around[np.r_[0:6, 11:17]])
    return bool(at > LINE_SHARP * beside and amp_V < LINE_DRIVEN * at)
