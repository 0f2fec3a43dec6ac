"""What is recorded of a case in a trial: other commands, lengths and rates for every case."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from madelung.campaigns import Commands
from madelung.waveforms import Command, Waveform

_RATES_HZ = np.array([200.0, 500.0, 1000.0, 2000.0, 2500.0, 5000.0, 10_000.0, 20_000.0])
_POINTS_PER_PERIOD = 15.0
ROWS_MIN, ROWS_MAX = 4000, 100_000
"""Of all train records of a case together."""
_RECORD_ROWS_MIN = 2000
_LOOP_ROWS_MAX = 15_000
_SLOW_SHARE = 0.15
_MOVING = (
    Waveform.TRIANGLE,
    Waveform.DECAYING,
    Waveform.ROUNDED,
    Waveform.SINES,
    Waveform.MULTISINE,
    Waveform.CHIRP,
    Waveform.NOISE,
)
_LEVELS = (Waveform.STEPS, Waveform.WALK, Waveform.STAIRCASE)
_NESTED_SWINGS_S = 7.5
"""How long a decaying waveform of seven peaks takes at 1 Hz."""


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number whose logarithm is evenly distributed."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def draw_commands(
    rng: np.random.Generator, u_min_V: float, u_max_V: float, rows_max: int = ROWS_MAX
) -> Commands:
    """Commands by record: ``identify``, one to five ``train/...``, one to three ``holdout/...``.

    At least one train record moves all the time, and one begins above a quarter of the range. One
    case in seven has nothing above 3 Hz. rows_max: see `ROWS_MAX`.
    """
    slow = bool(rng.uniform() < _SLOW_SHARE)
    top_hz = log_uniform(rng, 0.5, 3.0) if slow else log_uniform(rng, 5.0, 150.0)
    trains, holdouts = int(rng.integers(1, 6)), int(rng.integers(1, 4))
    rows = int(max(log_uniform(rng, ROWS_MIN, rows_max) / trains, _RECORD_ROWS_MIN))
    places = ["train"] * trains + ["holdout"] * holdouts
    every = {"identify": _within(_slow_loop(rng), u_min_V, u_max_V, (0.0, 1.0), rng)}
    for index, place in enumerate(places):
        kinds = _MOVING if index == 0 else _MOVING + _LEVELS
        waveform = Waveform(rng.choice(kinds))
        command = _command(waveform, rows, top_hz, slow, rng)
        share = _share(rng, biased=index == trains - 1)
        every[f"{place}/{waveform}_{index}"] = _within(command, u_min_V, u_max_V, share, rng)
    return every


def _slow_loop(rng: np.random.Generator) -> Command:
    waveform = Waveform.TRIANGLE if rng.uniform() < 0.7 else Waveform.SINE
    hz, cycles = log_uniform(rng, 0.05, 0.4), rng.integers(2, 6) + 0.1
    seconds = cycles / hz
    rates_hz = [r for r in (200.0, 500.0, 1000.0) if seconds * r >= _RECORD_ROWS_MIN]
    rate_hz = min(float(rng.choice(rates_hz)), np.ceil(_LOOP_ROWS_MAX / seconds))
    return Command(waveform, seconds, rate_hz, hz=hz)


def _share(rng: np.random.Generator, biased: bool) -> tuple[float, float]:
    """Lowest and highest command as shares of the range."""
    if not biased and rng.uniform() < 0.4:
        return 0.0, 1.0
    low = rng.uniform(0.27, 0.45) if biased else rng.uniform(0.0, 0.4)
    return low, rng.uniform(low + 0.35, 1.0)


def _within(
    command: Command,
    u_min_V: float,
    u_max_V: float,
    share: tuple[float, float],
    rng: np.random.Generator,
) -> Command:
    low, high = (u_min_V + s * (u_max_V - u_min_V) for s in share)
    return replace(command, u_min_V=low, u_max_V=high, seed=int(rng.integers(2**31)))


def _command(
    waveform: Waveform, rows: int, top_hz: float, slow: bool, rng: np.random.Generator
) -> Command:
    hz = top_hz * log_uniform(rng, 0.4, 1.0)
    fast_enough = _RATES_HZ[np.searchsorted(_RATES_HZ, _POINTS_PER_PERIOD * hz) :]
    rate_hz = float(fast_enough[min(rng.geometric(0.5) - 1, fast_enough.size - 1)])
    rate_hz = float(np.rint(min(rate_hz, max(float(fast_enough[0]), rows * hz / 5.0))))
    seconds = rows / rate_hz
    told: dict[str, Any] = {"hz": hz / 3.0}
    if waveform in _LEVELS:
        dwell_s = seconds / rng.uniform(8.0, 40.0)
        rise_s = 0.4 * dwell_s if slow else min(0.004, 0.2 * dwell_s)
        told = {"dwell_s": dwell_s, "rise_s": rise_s, "turns": int(rng.integers(3, 12))}
    elif waveform is Waveform.SINES:
        shares = (rng.uniform(0.05, 0.2), rng.uniform(0.3, 0.6), 1.0)
        told = {"lines_hz": tuple(float(hz * s) for s in shares)}
    elif waveform is Waveform.MULTISINE:
        first_hz = max(2.0 / seconds, hz / 40.0)
        told = {"hz": first_hz, "band_hz": (first_hz, max(hz, 2.0 * first_hz))}
    elif waveform is Waveform.CHIRP:
        told = {"band_hz": (min(2.0 / seconds, 0.3 * hz), hz)}
    elif waveform is Waveform.NOISE:
        told = {"band_hz": (0.0, 0.4 * hz)}
    elif waveform in (Waveform.DECAYING, Waveform.ROUNDED):
        told = {"hz": max(hz / 3.0, _NESTED_SWINGS_S / seconds)}
    return Command(waveform, seconds, rate_hz, **told)
