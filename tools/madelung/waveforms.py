"""Commands to drive an actuator with: the papers' waveforms, multisines, steps, noise, codes.

A waveform is a function of time, not of samples: the simulated actuator evaluates it between the
samples of a record too.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from madelung.errors import InputError

Floats = NDArray[np.float64]

SAMPLES_MAX = 10_000_000
VOLTS_MAX, SECONDS_MAX = 1e6, 1e10
_POINTS_PER_CYCLE = 64
"""Of the highest line of a multisine; a cubic spline between them is off by 1e-6 of the range."""
_LINES_MAX = 20_000
"""Periods of the highest frequency of noise."""
_DENSE_MAX = 1_000_000
"""Points at which a sum of sines is searched for its extremes."""


class Waveform(StrEnum):
    """What a command can look like."""

    TRIANGLE = "triangle"
    SINE = "sine"
    DECAYING = "decaying"
    SINES = "sines"
    MULTISINE = "multisine"
    STAIRCASE = "staircase"
    STEPS = "steps"
    CODES = "codes"
    ROUNDED = "rounded"
    CHIRP = "chirp"
    NOISE = "noise"
    WALK = "walk"


_CYCLIC = (Waveform.TRIANGLE, Waveform.SINE, Waveform.DECAYING, Waveform.ROUNDED)
"""Those whose cycles per second are ``hz``."""


@dataclass(frozen=True)
class Command:
    """A command voltage over time.

    Attributes
    ----------
    waveform
        ``triangle`` (Cao & Li 2019, Fig. 10) and ``sine``: from u_min up and back. ``decaying``: a
        full swing, nested triangles of falling peaks, a turnaround, growing ones, back to u_min
        (Fig. 12). ``sines``: equal sines of the frequencies ``lines_hz``. ``multisine``: all
        multiples of ``hz`` within ``band_hz``, equal in size, phases at random. ``staircase``:
        equal steps up and down. ``steps``: levels at random. ``codes``: a random level every
        sample. ``rounded``: ``decaying`` with sines instead of straight lines. ``chirp``: a sine
        whose frequency grows exponentially over ``band_hz``. ``noise``: Gaussian, low-passed (two
        poles) at the end of ``band_hz``, periodic in ``seconds``. ``walk``: a staircase whose
        steps are at random.
    seconds, rate_hz
        Length and sampling rate of the record.
    u_min_V, u_max_V
        The range, V; every waveform but random levels reaches both ends.
    hz
        Cycles per second; of ``decaying`` those of its first full swing.
    band_hz, lines_hz
        See waveform.
    dwell_s, rise_s
        How long staircase, steps and walk rest at a level, and how long they take to get there.
    turns
        Peaks of ``decaying`` (the paper: 7), levels of ``staircase``.
    seed
        Of what is random.

    Raises
    ------
    InputError
        A value is out of its range.
    """

    waveform: Waveform = Waveform.TRIANGLE
    seconds: float = 20.0
    rate_hz: float = 200.0
    u_min_V: float = 0.0
    u_max_V: float = 40.0
    hz: float = 0.1
    band_hz: tuple[float, float] = (0.5, 20.0)
    lines_hz: tuple[float, ...] = (0.3, 0.7, 1.9)
    dwell_s: float = 0.5
    rise_s: float = 0.0
    turns: int = 7
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        object.__setattr__(self, "waveform", Waveform(self.waveform))
        for name in ("seconds", "rate_hz", "hz", "dwell_s"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise InputError(f"{name} is {value:g}: it must be above 0")
        if not (np.isfinite([self.u_min_V, self.u_max_V]).all() and self.u_max_V > self.u_min_V):
            raise InputError(f"u_max ({self.u_max_V:g} V) must be above u_min ({self.u_min_V:g} V)")
        if max(abs(self.u_min_V), abs(self.u_max_V)) > VOLTS_MAX or self.seconds > SECONDS_MAX:
            raise InputError(
                f"{self.u_min_V:g} to {self.u_max_V:g} V over {self.seconds:g} s: no record holds "
                f"more than {VOLTS_MAX:g} V or {SECONDS_MAX:g} s"
            )
        samples = self.seconds * self.rate_hz  # may be infinite
        if not 1.5 < samples < SAMPLES_MAX + 0.5:
            raise InputError(
                f"{self.seconds:g} s at {self.rate_hz:g} Hz are {samples:.0f} samples: "
                f"2 to {SAMPLES_MAX} are possible"
            )
        if self.waveform in _CYCLIC and self.hz > self.rate_hz / 2:
            raise InputError(
                f"{self.hz:g} cycles per s cannot be told at {self.rate_hz:g} samples per s: "
                f"lower --hz to at most {self.rate_hz / 2:g} or raise --rate"
            )
        if not 0.0 <= self.rise_s <= self.dwell_s:
            raise InputError(f"rise_s is {self.rise_s:g}: it must lie between 0 and dwell_s")
        if self.turns < 1:
            raise InputError(f"turns is {self.turns}: it must be 1 or more")
        if self.waveform is Waveform.SINES and not (
            self.lines_hz and all(0.0 < f <= self.rate_hz / 2 for f in self.lines_hz)
        ):
            raise InputError("lines_hz must be frequencies above 0, up to half the rate")
        self._check_band()

    def _check_band(self) -> None:
        low, high = self.band_hz
        sound = 0.0 <= low < high <= self.rate_hz / 2
        if self.waveform is Waveform.MULTISINE and not (sound and self._harmonics().size):
            raise InputError(
                f"band_hz {low:g} to {high:g} must lie between 0 and half the rate and hold a "
                f"multiple of hz ({self.hz:g})"
            )
        if self.waveform is Waveform.CHIRP and not (sound and low > 0.0):
            raise InputError(f"band_hz {low:g} to {high:g} must lie above 0, up to half the rate")
        if self.waveform is Waveform.NOISE and not (sound and self.seconds * high <= _LINES_MAX):
            raise InputError(
                f"band_hz up to {high:g} must lie within half the rate, and {self.seconds:g} s "
                f"hold at most {_LINES_MAX} periods of it"
            )

    @property
    def samples(self) -> int:
        """Number of samples of the record."""
        return round(self.seconds * self.rate_hz)

    @property
    def time_s(self) -> Floats:
        """Times of the samples, s, shape (samples,)."""
        return np.arange(self.samples) / self.rate_hz

    def at(self, t_s: ArrayLike) -> Floats:
        """The command in V, shape (n,), at times in s from 0 to seconds, shape (n,)."""
        t = np.asarray(t_s, np.float64)
        shape = {
            Waveform.TRIANGLE: self._triangle,
            Waveform.SINE: self._sine,
            Waveform.DECAYING: self._decaying,
            Waveform.SINES: self._sines,
            Waveform.MULTISINE: self._multisine,
            Waveform.STAIRCASE: self._staircase,
            Waveform.STEPS: self._steps,
            Waveform.CODES: self._codes,
            Waveform.ROUNDED: self._rounded,
            Waveform.CHIRP: self._chirp,
            Waveform.NOISE: self._noise,
            Waveform.WALK: self._walk,
        }[self.waveform](t)
        return self.u_min_V + (self.u_max_V - self.u_min_V) * shape

    # Each gives the command as a share of the range, 0 to 1.

    def _triangle(self, t: Floats) -> Floats:
        return 1.0 - np.abs(1.0 - 2.0 * np.mod(self.hz * t, 1.0))

    def _sine(self, t: Floats) -> Floats:
        return 0.5 - 0.5 * np.cos(2.0 * np.pi * self.hz * t)

    def _decaying(self, t: Floats) -> Floats:
        level, moment = self._nested()
        return np.asarray(np.interp(np.mod(t, moment[-1]), moment, level))

    def _rounded(self, t: Floats) -> Floats:
        level, moment = self._nested()
        way = np.interp(np.mod(t, moment[-1]), moment, np.arange(level.size))
        k = np.minimum(way.astype(np.int64), level.size - 2)
        eased = 0.5 - 0.5 * np.cos(np.pi * (way - k))
        return np.asarray(level[k] + (level[k + 1] - level[k]) * eased)

    def _nested(self) -> tuple[Floats, Floats]:
        """Levels between which nested swings go, and when they are reached, s."""
        swings = 1.0 - np.arange(1, 2 * self.turns) / (2.0 * self.turns)
        nested = np.cumsum(swings * np.where(np.arange(swings.size) % 2, -1.0, 1.0))
        level = np.concatenate(([0.0, 1.0, 0.0], nested, nested[-2::-1], [0.0]))
        moment = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(level))))) / (2.0 * self.hz)
        return level, moment

    def _chirp(self, t: Floats) -> Floats:
        low, high = self.band_hz
        grown = np.log(high / low) / self.seconds
        return np.asarray(0.5 - 0.5 * np.cos(2.0 * np.pi * low * np.expm1(grown * t) / grown))

    def _sines(self, t: Floats) -> Floats:
        phase = self._random().uniform(0.0, 2.0 * np.pi, len(self.lines_hz))

        def total(at_s: Floats) -> Floats:
            lines = zip(self.lines_hz, phase, strict=True)
            sines = [np.sin(2.0 * np.pi * f * at_s + p) for f, p in lines]
            return np.asarray(np.sum(sines, axis=0))

        points = min(int(_POINTS_PER_CYCLE * max(self.lines_hz) * self.seconds) + 2, _DENSE_MAX)
        return _scaled(total(t), total(np.linspace(0.0, self.seconds, points)))

    def _harmonics(self) -> NDArray[np.int64]:
        first = max(1, int(np.ceil(self.band_hz[0] / self.hz - 1e-9)))
        return np.arange(first, int(np.floor(self.band_hz[1] / self.hz + 1e-9)) + 1)

    def _multisine(self, t: Floats) -> Floats:
        lines = self._harmonics()
        phases = self._random().uniform(0.0, 2.0 * np.pi, lines.size)
        return _periodic(self.hz * t, lines, np.exp(1j * phases))

    def _noise(self, t: Floats) -> Floats:
        lines = np.arange(1, max(2, int(4.0 * self.band_hz[1] * self.seconds)))
        random = self._random().standard_normal((2, lines.size))
        passed = 1.0 / (1.0 + (lines / (self.seconds * self.band_hz[1])) ** 2)
        return _periodic(t / self.seconds, lines, passed * (random[0] + 1j * random[1]))

    def _staircase(self, t: Floats) -> Floats:
        step = np.arange(self._dwells(self.dwell_s))
        cycle = np.abs(np.mod(step + self.turns, 2 * self.turns) - self.turns)
        return self._held(t, cycle / self.turns, self.dwell_s, self.rise_s)

    def _steps(self, t: Floats) -> Floats:
        levels = self._random().uniform(size=self._dwells(self.dwell_s))
        return self._held(t, levels, self.dwell_s, self.rise_s)

    def _walk(self, t: Floats) -> Floats:
        walk = np.cumsum(self._random().standard_normal(self._dwells(self.dwell_s)))
        return self._held(t, _scaled(walk, walk), self.dwell_s, self.rise_s)

    def _codes(self, t: Floats) -> Floats:
        sample_s = 1.0 / self.rate_hz
        return self._held(t, self._random().uniform(size=self._dwells(sample_s)), sample_s, 0.0)

    def _dwells(self, dwell_s: float) -> int:
        return int(np.ceil(self.seconds / dwell_s)) + 1

    def _held(self, t: Floats, levels: Floats, dwell_s: float, rise_s: float) -> Floats:
        # A sample on the edge belongs to the new level, whatever its last bit says.
        k = np.minimum(np.floor(t / dwell_s + 1e-9).astype(np.int64), levels.size - 1)
        before = levels[np.maximum(k - 1, 0)]
        arrived = np.clip((t - k * dwell_s) / rise_s, 0.0, 1.0) if rise_s > 0.0 else 1.0
        return np.asarray(before + (levels[k] - before) * arrived)

    def _random(self) -> np.random.Generator:
        return np.random.default_rng([self.seed, 1])


def planned(experiment: object) -> Command:
    """The command of a diagnosis's ``next_experiment``.

    f_low_hz and f_high_hz are the band of a multisine; f_low_hz is the frequency of whatever
    repeats, and levels rest for a period of f_high_hz.

    Raises
    ------
    InputError
        A key is missing or its value is out of range.
    """
    try:
        told: dict[str, Any] = dict(experiment)  # type: ignore[call-overload]
        low, high = float(told["f_low_hz"]), float(told["f_high_hz"])
        return Command(
            waveform=Waveform(told["waveform"]),
            seconds=float(told["seconds"]),
            rate_hz=float(told["rate_hz"]),
            u_min_V=float(told["u_min_V"]),
            u_max_V=float(told["u_max_V"]),
            hz=low,
            band_hz=(low, high),
            dwell_s=1.0 / high,
        )
    except (ValueError, KeyError, TypeError, ZeroDivisionError) as error:
        raise InputError("names no next experiment") from error


def _periodic(cycles: Floats, lines: NDArray[np.int64], spectrum: NDArray[np.complex128]) -> Floats:
    """A sum of harmonics as a share of its range; cycles of the fundamental, shape (n,)."""
    from scipy.fft import irfft, next_fast_len
    from scipy.interpolate import CubicSpline

    points = next_fast_len(_POINTS_PER_CYCLE * int(lines[-1]), real=True)
    whole = np.zeros(points // 2 + 1, np.complex128)
    whole[lines] = spectrum
    period = irfft(whole, points)
    closed = np.append(period, period[0])
    spline = CubicSpline(np.arange(points + 1) / points, closed, bc_type="periodic")
    return _scaled(spline(np.mod(cycles, 1.0)), period)


def _scaled(values: Floats, whole: Floats) -> Floats:
    """Values as a share of the range of the whole waveform."""
    low, high = float(whole.min()), float(whole.max())
    return np.clip((values - low) / (high - low), 0.0, 1.0)
