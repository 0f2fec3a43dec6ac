"""What trivial diagnosers would say: templates of effects regressed on the gap, no physics fitted.

These are the selectors that a first attempt would use; their answers stand beside the diagnosis's.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

Array = NDArray[np.float64]
_CREEP_S = 3.0
_BOUND = 2.576
"""A correlation above this over sqrt(rows) is taken for real: 99 % for white noise."""


def templates(u_V: Array, y_um: Array, gap_um: Array, step_s: float) -> dict[str, list[Array]]:
    """Effect to columns of shape (n,) that its gap would resemble.

    Parameters
    ----------
    u_V, y_um
        Command and prediction of the baseline, shape (n,).
    gap_um
        Measured less predicted; its largest line serves periodic_disturbance alone.
    """
    t = np.arange(u_V.size) * step_s
    x = 2.0 * (u_V - u_V.min()) / max(float(np.ptp(u_V)), 1e-12) - 1.0
    rate = np.gradient(x, step_s)
    way = np.sign(rate)
    passed = 1.0 - np.exp(-step_s / _CREEP_S)
    slow = lfilter([passed], [1.0, passed - 1.0], x - x[0]) + x[0]
    fast = np.quantile(np.abs(rate), 0.95)
    until_peak = (np.maximum.accumulate(x) < x.max()).astype(np.float64)
    line = np.argmax(np.abs(np.fft.rfft(gap_um - gap_um.mean()))[1:]) + 1
    turn = 2.0 * np.pi * line * np.arange(u_V.size) / u_V.size
    return {
        "delay": [rate],
        "saturation": [np.maximum(x - 0.8, 0.0), np.minimum(x + 0.8, 0.0)],
        "slew_limit": [way * np.maximum(np.abs(rate) - fast, 0.0)],
        "amplifier_lag": [x - gaussian_filter1d(x, 3.0)],
        "asymmetry": [1.0 - x**2, x * (1.0 - x**2)],
        "rate_dependence": [way * np.abs(rate) ** 0.5],
        "non_masing": [way * (1.0 - x**2)],
        "initial_state": [until_peak],
        "creep": [slow - x],
        "backlash": [way],
        "resonance": [np.gradient(rate, step_s)],
        "gain_offset": [y_um - y_um[0], np.ones_like(x)],
        "drift": [t, t**2],
        "periodic_disturbance": [np.sin(turn), np.cos(turn)],
        "clock_skew": [t * rate],
    }


def pick(records: Sequence[tuple[Array, Array, Array, float]]) -> dict[str, list[str]]:
    """Effects that two selectors name: ``correlation`` and ``bic``.

    Parameters
    ----------
    records
        (u_V, y_um of the baseline, gap_um, step_s) of each train record.
    """
    columns: dict[str, list[list[Array]]] = {}
    for record in records:
        for name, own in templates(*record).items():
            columns.setdefault(name, []).append(own)
    gap = np.concatenate([r[2] for r in records])
    stacked = {
        name: np.column_stack([np.concatenate(parts) for parts in zip(*by_record, strict=True)])
        for name, by_record in columns.items()
    }
    n = gap.size
    total = float(np.sum((gap - gap.mean()) ** 2)) + 1e-300
    explained, bic = {}, {"": n * np.log(total / n) + np.log(n)}
    for name, matrix in stacked.items():
        design = np.column_stack([matrix / (np.abs(matrix).max(axis=0) + 1e-300), np.ones(n)])
        fitted = design @ np.linalg.lstsq(design, gap, rcond=None)[0]
        left = float(np.sum((gap - fitted) ** 2)) + 1e-300
        explained[name] = 1.0 - left / total
        bic[name] = n * np.log(left / n) + design.shape[1] * np.log(n)
    best = max(explained, key=lambda name: explained[name])
    found = explained[best] > _BOUND**2 / n
    chosen = min(bic, key=lambda name: bic[name])
    return {"correlation": [best] if found else [], "bic": [chosen] if chosen else []}
