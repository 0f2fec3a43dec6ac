"""A Prandtl-Ishlinskii model with one-side play operators: Cao & Li 2019, eqs. (15)-(17)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def play(x: Array, weight: Array, threshold: Array) -> Array:
    """Output for inputs x, shape (n,), of operators with weights and thresholds, shape (m,).

    Each operator recurses on itself, H_i(t) = max(x - r_i, min(x, H_i(t-1))), and starts at 0;
    as printed, eq. (15) recurses on the sum y_PI.
    """
    operators = np.zeros_like(threshold)
    y = np.empty_like(x)
    for t, x_t in enumerate(x):
        operators = np.maximum(x_t - threshold, np.minimum(x_t, operators))
        y[t] = weight @ operators
    return y


def major_curve(weight: Array, threshold: Array, range_volts: float) -> list[tuple[float, float]]:
    """Breakpoints (x, y) of the model's major ascending curve, eqs. (16)-(17)."""
    x = np.append(threshold, range_volts)
    y = np.maximum(0.0, x[:, None] - threshold) @ weight
    return list(zip(x.tolist(), y.tolist(), strict=True))
