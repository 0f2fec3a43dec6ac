"""The modified Prandtl-Ishlinskii model of Yang et al. 2015, in units, and for the C core.

mdl_pi.h and mdl_yang.h hold the equations, and what was decided where the paper is silent.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from madelung.blocks import number
from madelung.errors import InputError

Floats = NDArray[np.float64]

PLAYS_MAX, HARMONICS_MAX, TERMS = 32, 9, 4
"""Limits of mdl_config.h; coefficients of a polynomial of eq. (13)."""
TURN_SHARE = 0.02
"""An input turns when it has come back by this share of the range."""
VELOCITY_SAMPLES = 0.5
"""Least time constant of the velocity's filter, in samples."""


@dataclass(frozen=True)
class Yang:
    """Parameters of the model; the defaults leave the rate-independent one, eq. (4).

    Attributes
    ----------
    thresholds_V, weights
        r_i, ascending, and p_i (um / V) of the play operators, at most 32.
    a1, a2
        Of the polynomial a1 u^3 + a2 u, um / V^3 and um / V; u is the command itself.
    at_zero_um
        Zero of the sensor, which the paper does not have.
    two_side
        Two-side operators, for commands of either sign.
    k, c, m
        Coefficients of eq. (13), ascending powers of the frequency in Hz, at most four; k and m
        without unit, c in um.
    hz_max
        Above this frequency the polynomials keep their value.
    center_um
        Displacement about which k scales; 0 in the paper.
    harmonics
        1 for sines; M of eq. (14) for triangles.
    hz, amplitude_V
        Of the excitation; 0: found on line from the turning points.
    velocity_tau_s
        Time constant of the velocity's filter; at least half a sample is taken.
    beta_s
        Of the dynamic thresholds r_i + beta |u'|, the rival; 0: none.
    """

    thresholds_V: tuple[float, ...]
    weights: tuple[float, ...]
    a1: float = 0.0
    a2: float = 0.0
    at_zero_um: float = 0.0
    two_side: bool = False
    k: tuple[float, ...] = (1.0,)
    c: tuple[float, ...] = (0.0,)
    m: tuple[float, ...] = (1.0,)
    hz_max: float = 1e9
    center_um: float = 0.0
    harmonics: int = 1
    hz: float = 0.0
    amplitude_V: float = 0.0
    velocity_tau_s: float = 0.0
    beta_s: float = 0.0

    def but(self, **changes: Any) -> Yang:
        """A copy with some parameters changed."""
        return replace(self, **changes)

    @property
    def rate_independent(self) -> Yang:
        """Eq. (4) alone."""
        return self.but(k=(1.0,), c=(0.0,), m=(1.0,), beta_s=0.0)

    def at_rest_um(self, u_V: float) -> float:
        """Displacement at a voltage that was reached from 0 V without a turn."""
        r = np.array(self.thresholds_V)
        high = u_V + r if self.two_side else u_V
        plays = np.maximum(u_V - r, np.minimum(high, 0.0))
        y = self.at_zero_um + (self.a1 * u_V**2 + self.a2) * u_V
        return float(y + plays @ np.array(self.weights))

    def to_json(self) -> dict[str, Any]:
        """As model.json holds it."""
        return {
            key: list(value) if isinstance(value, tuple) else value
            for key, value in vars(self).items()
        }


_LISTS = {"thresholds_V": PLAYS_MAX, "weights": PLAYS_MAX, "k": TERMS, "c": TERMS, "m": TERMS}
_RANGES = {
    "a1": (-1e6, 1e6),
    "a2": (-1e6, 1e6),
    "at_zero_um": (-1e6, 1e6),
    "center_um": (-1e6, 1e6),
    "hz_max": (1e-6, 1e9),
    "hz": (0.0, 1e9),
    "amplitude_V": (0.0, 1e6),
    "velocity_tau_s": (0.0, 1e3),
    "beta_s": (0.0, 1e3),
}
KEYS = frozenset((*_LISTS, *_RANGES, "two_side", "harmonics"))
"""Of a model.json of kind ``yang2015``, beside those of every model."""


def yang_from_json(data: Mapping[str, Any]) -> Yang:
    """Check the parameters of a model.json; what is not given has its default.

    Raises
    ------
    InputError
        A list or number is missing, not finite or out of its range.
    """
    fields: dict[str, Any] = {}
    for key, most in _LISTS.items():
        values = data.get(key)
        if not isinstance(values, list) or len(values) > most:
            raise InputError(f"{key} must be a list of at most {most} numbers")
        fields[key] = tuple(number(v, key) for v in values)
    for key, (low, high) in _RANGES.items():
        if key in data:
            fields[key] = number(data[key], key, low, high)
    if not isinstance(data.get("two_side", False), bool):
        raise InputError("two_side must be true or false")
    fields["two_side"] = data.get("two_side", False)
    harmonics = number(data.get("harmonics", 1), "harmonics", 1, HARMONICS_MAX)
    if harmonics != int(harmonics):
        raise InputError(f"harmonics = {harmonics:g} must be a whole number")
    return _sound(Yang(**fields, harmonics=int(harmonics)))


def _sound(yang: Yang) -> Yang:
    if len(yang.thresholds_V) != len(yang.weights):
        raise InputError(
            f"{len(yang.thresholds_V)} thresholds_V and {len(yang.weights)} weights: "
            "every play operator has one of each"
        )
    ascending = all(b > a for a, b in pairwise((-math.inf, *yang.thresholds_V)))
    if not ascending or min(yang.thresholds_V, default=0.0) < 0.0:
        raise InputError("thresholds_V must ascend, from 0 or above")
    return yang


def spectrum(harmonics: int) -> Floats:
    """A_i of a triangle of amplitude 1, eq. (15): its sines of 1 to M times f0, shape (M,)."""
    i = np.arange(1, harmonics + 1)
    return np.asarray(8.0 / (np.pi * i) ** 2 * np.array([0.0, 1.0, 0.0, -1.0])[i % 4])


def weights_of_harmonics(harmonics: int) -> Floats:
    """lambda_i of eq. (16), shape (M,); they sum to 1."""
    a = spectrum(harmonics)
    return np.asarray(a / a.sum())


@dataclass(frozen=True)
class YangParams:
    """mdl_yang_params for one sample time: arrays by the names of the struct, and its numbers."""

    two_side: bool
    threshold_volts: tuple[float, ...]
    weight: tuple[float, ...]
    k: tuple[float, ...]
    c_um: tuple[float, ...]
    m: tuple[float, ...]
    lambda_: tuple[float, ...]
    values: dict[str, float]


PI_VALUES = ("cubic", "linear", "at_zero_um")
FILTER_VALUES = ("decay", "ramp")
"""Names of `YangParams.values` that lie in a struct of their own."""


def discretise_yang(
    yang: Yang, u_min_V: float, u_max_V: float, margin_V: float, step_s: float
) -> YangParams:
    """The parameters for the C core at a sample time in s; see mdl_yang_params."""
    tau_s = max(yang.velocity_tau_s, VELOCITY_SAMPLES * step_s)
    decay = -math.expm1(-step_s / tau_s)
    return YangParams(
        yang.two_side,
        yang.thresholds_V,
        yang.weights,
        _terms(yang.k),
        _terms(yang.c),
        _terms(yang.m),
        tuple(weights_of_harmonics(yang.harmonics).tolist()),
        {
            "cubic": yang.a1,
            "linear": yang.a2,
            "at_zero_um": yang.at_zero_um,
            "low_volts": u_min_V,
            "high_volts": u_max_V,
            "margin_volts": margin_V,
            "center_um": yang.center_um,
            "hz_max": yang.hz_max,
            "hz": yang.hz,
            "amplitude_volts": yang.amplitude_V,
            "turn_volts": TURN_SHARE * (u_max_V - u_min_V),
            "rate_hz": 1.0 / step_s,
            "decay": decay,
            "ramp": decay * tau_s / step_s,
            "v_scale": -1.0 / tau_s,
            "widen_s": yang.beta_s,
        },
    )


def _terms(coefficients: Sequence[float]) -> tuple[float, ...]:
    return (*coefficients, *(0.0,) * (TERMS - len(coefficients)))


def polynomial(coefficients: Sequence[float], hz: ArrayLike) -> Floats:
    """k, c or m of eq. (13) at frequencies in Hz, shape (n,)."""
    return np.asarray(np.polynomial.polynomial.polyval(np.asarray(hz, np.float64), coefficients))
