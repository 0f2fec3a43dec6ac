"""Inputs for the comparison, as codes of a 12-bit converter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

CODES = 4096
RANGE_V = 40.0
Codes = NDArray[np.int64]


def volts(codes: Codes) -> NDArray[np.float32]:
    """Inputs in volts above the minimum, as the firmware computes them in float."""
    return codes.astype(np.float32) * np.float32(RANGE_V / (CODES - 1))


def nested(turning_points: int) -> Codes:
    """Codes that nest so many turning points, A_0 among them: 4095, 1, 4094, 2, ..."""
    k = np.arange(1, turning_points + 1)
    spiral = np.where(k % 2 == 1, CODES - (k + 1) // 2, k // 2)
    return np.minimum(spiral, CODES - 1)


def worst() -> Codes:
    """All codes nested, then one jump that wipes them all: 12 comparisons after eq. (18)."""
    return np.append(nested(CODES - 1), 0)


def partial() -> Codes:
    """All codes nested, then a jump that wipes a part of them, of every order of magnitude."""
    pieces = []
    for left in (1, 2, 100, 1000, 2000):
        pieces += [nested(CODES - 1), [left], nested(CODES - 1), [CODES - 1 - left]]
    return np.concatenate(pieces)


def ladder() -> Codes:
    """Nests of 2 to 4096 turning points, each ended by jumps to every depth of its search."""
    pieces = []
    for points in 2 ** np.arange(1, 13):
        pieces += [nested(points), [0], nested(points // 2 + 1), [CODES - 1, 0]]
    return np.concatenate(pieces)


def random(samples: int = 12000) -> Codes:
    """Uniform over all codes."""
    return np.random.default_rng(1).integers(0, CODES, samples)


def smooth(samples: int = 12000) -> Codes:
    """Three sines of 10, 23 and 61 Hz at 10 kHz."""
    t = np.arange(samples) / 10e3
    u = 0.5 - 0.25 * np.cos(2 * np.pi * 10 * t) - 0.15 * np.cos(2 * np.pi * 23 * t)
    u -= 0.1 * np.cos(2 * np.pi * 61 * t)
    return np.rint(u * (CODES - 1)).astype(np.int64)


def noisy(samples: int = 12000) -> Codes:
    """The smooth input with 5 codes of white noise."""
    noise = np.random.default_rng(2).normal(0.0, 5.0, samples)
    return np.clip(np.rint(smooth(samples) + noise), 0, CODES - 1).astype(np.int64)
