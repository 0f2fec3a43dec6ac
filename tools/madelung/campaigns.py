"""What is recorded of a simulated stage: to identify its baseline, to diagnose it, to check."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum

import numpy as np

from madelung.waveforms import Command, Waveform

Commands = dict[str, Command]
_MOVING = (
    Waveform.TRIANGLE,
    Waveform.SINE,
    Waveform.DECAYING,
    Waveform.SINES,
    Waveform.MULTISINE,
    Waveform.ROUNDED,
    Waveform.CHIRP,
    Waveform.NOISE,
)


class Campaign(StrEnum):
    """How much a user has recorded."""

    RICH = "rich"
    SLOW = "slow"
    SINE = "sine"
    SHORT = "short"


def commands(
    campaign: Campaign, u_min_V: float, u_max_V: float, rng: np.random.Generator
) -> Commands:
    """The commands of a campaign by record: ``identify``, ``train/...``, ``holdout/...``.

    ``rich``: multisines, triangles, steps, decaying triangles, sums of sines about a bias, 0.2 to
    2.5 kHz, about 10^5 rows. ``short``: the same, a quarter as long. ``slow``: nothing above 2 Hz.
    ``sine``: one sine to train on, one to check.
    """

    def within(low: float, high: float, told: Command) -> Command:
        """The command with its range as shares of the whole, and a seed of its own."""
        width = u_max_V - u_min_V
        return replace(
            told,
            u_min_V=u_min_V + low * width,
            u_max_V=u_min_V + high * width,
            seed=int(rng.integers(2**31)),
        )

    make = {
        Campaign.RICH: _rich,
        Campaign.SHORT: _rich,
        Campaign.SLOW: _slow,
        Campaign.SINE: _sine,
    }[campaign]
    full = {
        "identify": within(0.0, 1.0, Command(hz=0.1, seconds=30.0)),
        **make(within, rng),
    }
    if campaign is not Campaign.SHORT:
        return full
    return {k: v if k == "identify" else replace(v, seconds=v.seconds / 4) for k, v in full.items()}


_Within = Callable[[float, float, Command], Command]


def _multisine(seconds: float, high_hz: float) -> Command:
    return Command(Waveform.MULTISINE, seconds, 2000.0, hz=0.5, band_hz=(1.0, high_hz))


def _steps(seconds: float) -> Command:
    return Command(Waveform.STEPS, seconds, 1000.0, dwell_s=1.5, rise_s=0.004)


def _sines(seconds: float, rate_hz: float, *lines_hz: float) -> Command:
    return Command(Waveform.SINES, seconds, rate_hz, lines_hz=lines_hz)


def _rich(within: _Within, rng: np.random.Generator) -> Commands:
    high_hz = rng.uniform(60.0, 90.0)
    triangle = Command(seconds=4.0, rate_hz=2500.0, hz=rng.uniform(6.0, 12.0))
    decaying = Command(Waveform.DECAYING, 20.0, 200.0, hz=rng.uniform(0.4, 0.6))
    return {
        "train/bias": within(0.3, 0.75, _sines(15.0, 500.0, 0.4, 1.1, rng.uniform(2.0, 4.0))),
        "train/decaying": within(0.0, 1.0, decaying),
        "train/multisine": within(0.1, 0.9, _multisine(8.0, high_hz)),
        "train/steps": within(0.1, 0.9, _steps(24.0)),
        "train/triangle": within(0.2, 0.8, triangle),
        "holdout/multisine": within(0.15, 0.85, _multisine(6.0, 0.8 * high_hz)),
        "holdout/sines": within(0.2, 0.9, _sines(10.0, 1000.0, 0.7, 3.1, rng.uniform(8.0, 15.0))),
        "holdout/steps": within(0.1, 0.9, _steps(12.0)),
    }


def _slow(within: _Within, rng: np.random.Generator) -> Commands:
    decaying = Command(Waveform.DECAYING, 40.0, 200.0, hz=rng.uniform(0.2, 0.3))
    return {
        "train/bias": within(0.3, 0.75, _sines(30.0, 200.0, 0.11, 0.4, rng.uniform(0.7, 1.5))),
        "train/decaying": within(0.0, 1.0, decaying),
        "holdout/sines": within(0.2, 0.9, _sines(30.0, 200.0, 0.07, 0.3, rng.uniform(0.7, 1.5))),
    }


def _sine(within: _Within, rng: np.random.Generator) -> Commands:
    sine = Command(Waveform.SINE, 20.0, 500.0, hz=rng.uniform(1.0, 20.0))
    return {
        "train/sine": within(0.2, 0.8, sine),
        "holdout/sine": within(0.1, 0.7, replace(sine, seconds=10.0, hz=0.7 * sine.hz)),
    }


def fast_V_per_s(every: Commands) -> float:
    """The rate that the moving training commands exceed in a twentieth of the time, V/s."""
    training = [c for k, c in every.items() if k.startswith("train/")]
    moving = [c for c in training if c.waveform in _MOVING] or training
    rates = [np.abs(np.diff(c.at(c.time_s))) * c.rate_hz for c in moving]
    return float(max(np.quantile(r, 0.95) for r in rates))


def highest_V_per_s(every: Commands) -> float:
    """The highest rate of all training commands, V/s."""
    training = [c for k, c in every.items() if k.startswith("train/")]
    return float(max(np.abs(np.diff(c.at(c.time_s))).max() * c.rate_hz for c in training))


def bias_V(every: Commands, u_min_V: float, u_max_V: float) -> float:
    """The lowest voltage above a quarter of the range at which a training record begins, V."""
    starts = [float(c.at([0.0])[0]) for k, c in every.items() if k.startswith("train/")]
    quarter = u_min_V + 0.25 * (u_max_V - u_min_V)
    return min((v for v in starts if v > quarter), default=quarter)
