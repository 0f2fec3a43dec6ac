"""The noise floor: a model of the sensor's noise from cycle-to-cycle differences.

White noise plus one Ornstein-Uhlenbeck process (AR(1) at any sample time), so that one spectrum
in Hz serves records of every rate. Whatever repeats from cycle to cycle is not noise, whether or
not a model explains it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.signal import lfilter

from madelung.diagnosis.case import Trace

Array = NDArray[np.float64]
TREND_DEGREE = 3
BINS_MAX = 400


@dataclass(frozen=True)
class Noise:
    """Standard deviations (um) of both parts, correlation time (s) of the coloured one.

    ``samples`` is the number of differences it was estimated from, ``known`` whether these were
    differences of cycles (else of neighbouring samples).
    """

    white_um: float
    coloured_um: float
    tau_s: float
    samples: int
    known: bool

    @property
    def rms_um(self) -> float:
        """Of the sum of both parts."""
        return float(np.hypot(self.white_um, self.coloured_um))

    def innovations(self, step_s: float) -> tuple[float, float, float]:
        """AR and MA coefficient and innovation's standard deviation at a sample time."""
        a = float(np.exp(-step_s / self.tau_s)) if self.coloured_um > 0 else 0.0
        c0 = self.white_um**2 * (1 + a * a) + self.coloured_um**2 * (1 - a * a)
        c1 = self.white_um**2 * a
        power = (c0 + np.sqrt(max(c0 * c0 - 4 * c1 * c1, 0.0))) / 2
        return a, float(c1 / power), float(np.sqrt(power))

    def whiten(self, values: Array, step_s: float) -> Array:
        """Rows (..., n) of a record divided by the noise's spectrum: unit white where noise."""
        a, theta, sigma = self.innovations(step_s)
        if a == 0.0:
            return values / sigma
        white: Array = lfilter([1.0, -a], [1.0, -theta], values, axis=-1) / sigma
        white[..., 0] *= sigma / self.rms_um
        return white

    def spectrum(self, freq_hz: Array, step_s: float) -> Array:
        """Two-sided power spectral density times sample rate, um^2, at frequencies in Hz."""
        a, theta, sigma = self.innovations(step_s)
        z = np.exp(-2j * np.pi * freq_hz * step_s)
        density: Array = sigma**2 * np.abs((1 - theta * z) / (1 - a * z)) ** 2
        return density


def estimate_noise(trace: Trace) -> Noise:
    """The noise of a record of two or more cycles; else of its second differences."""
    d = _cycle_differences(trace)
    if d is None:
        y = trace.y_um[trace.use]
        second = y[2:] - 2 * y[1:-1] + y[:-2]
        white = float(np.sqrt(np.mean(second**2) / 6))
        return Noise(max(white, 1e-9), 0.0, trace.step_s, second.size, known=False)
    return _whittle(d / np.sqrt(2), trace.step_s)


def _cycle_differences(trace: Trace) -> Array | None:
    """Differences of successive cycles, without trend, and without what u's mismatch explains."""
    starts = _cycle_starts(trace.u_V)
    if starts.size < 2:
        return None
    shift = int(np.median(np.diff(starts)))
    n = trace.u_V.size - shift
    if shift < 50 or n < 50:
        return None
    good = trace.use[:n] & trace.use[shift:]
    du = trace.u_V[shift:] - trace.u_V[:n]
    if good.mean() < 0.5:
        return None
    if np.sqrt(np.mean(du**2)) > 0.05 * np.ptp(trace.u_V):
        return None
    d = trace.y_um[shift:] - trace.y_um[:n]
    z = 2 * (trace.u_V[:n] - trace.u_V.min()) / np.ptp(trace.u_V) - 1
    rising = np.gradient(trace.u_V[:n]) > 0
    columns = list(np.polynomial.legendre.legvander(np.linspace(-1, 1, n), TREND_DEGREE).T)
    columns += [du * z**k * side for k in range(3) for side in (rising, ~rising)]
    design = np.column_stack(columns)
    fit = np.linalg.lstsq(design[good], d[good], rcond=None)[0]
    # Rows left out are zeros; the others carry their share of the energy.
    residual: Array = np.where(good, d - design @ fit, 0.0) / np.sqrt(good.mean())
    return residual


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


def _whittle(d: Array, step_s: float) -> Noise:
    """Maximum of Whittle's likelihood; the coloured part stays only where BIC wants it."""
    n = d.size
    power = np.abs(np.fft.rfft(d)) ** 2 / n
    freq = np.asarray(np.fft.rfftfreq(n, step_s), np.float64)
    skip = TREND_DEGREE + 2
    freq, power, weight = _bins(freq[skip:-1], power[skip:-1])
    variance = float(np.average(power, weights=weight))
    if variance <= 0:
        return Noise(1e-9, 0.0, step_s, n, known=True)

    def loss(p: Array) -> float:
        white, coloured, tau = (float(v) for v in np.exp(p))
        s = Noise(white, coloured, tau, n, known=True).spectrum(freq, step_s)
        return float(np.sum(weight * (np.log(s) + power / s)))

    white = float(np.sum(weight * (np.log(variance) + 1)))
    s = np.log(np.sqrt(variance))
    bounds = [(s - 8, s + 2), (s - 8, s + 4), (np.log(0.3 * step_s), np.log(0.2 * n * step_s))]
    tries = [
        minimize(
            loss,
            np.array([s + a, s + b, np.log(k * step_s)]),
            method="L-BFGS-B",
            bounds=bounds,
        )
        for a, b, k in ((-0.5, -0.5, 3), (-0.5, -0.5, 30), (-3, 0, 10), (-3, 0, 50))
    ]
    best = min(tries, key=lambda t: float(t.fun))
    if 2 * (white - float(best.fun)) < 2 * np.log(n):
        return Noise(float(np.sqrt(variance)), 0.0, step_s, n, known=True)
    p = best.x
    return Noise(float(np.exp(p[0])), float(np.exp(p[1])), float(np.exp(p[2])), n, known=True)


def _bins(freq: Array, power: Array) -> tuple[Array, Array, Array]:
    """Averages of the periodogram over at most `BINS_MAX` bins, narrow where f is low."""
    if freq.size <= BINS_MAX:
        return freq, power, np.ones_like(freq)
    edges = np.unique(np.geomspace(1, freq.size, BINS_MAX).astype(np.int64)) - 1
    count = np.diff(np.append(edges, freq.size)).astype(np.float64)
    return np.add.reduceat(freq, edges) / count, np.add.reduceat(power, edges) / count, count
