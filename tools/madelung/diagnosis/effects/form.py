"""What a model of an effect is: parameters in units and bounds, and what they change."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.polynomial.legendre import legval
from numpy.typing import ArrayLike, NDArray

from madelung.diagnosis.case import Trace
from madelung.path import SignalPath

Array = NDArray[np.float64]
Values = Mapping[str, float]


@dataclass(frozen=True)
class Param:
    """A parameter: bounds in its unit, the value without effect, whether it is searched as log."""

    key: str
    low: float
    high: float
    null: float = 0.0
    log: bool = False
    scale: float = 1.0
    """Typical size in its unit: finite steps are a thousandth of it."""


@dataclass(frozen=True)
class Scales:
    """What bounds and starts refer to, from the case."""

    u_min_V: float
    range_V: float
    stroke_um: float
    rate_max_V_per_s: float
    step_min_s: float
    length_max_s: float
    start_max_V: float


Starts = Callable[[Scales], list[dict[str, float]]]
Apply = Callable[[SignalPath, Values], SignalPath]
Measure = Callable[[Array, Trace, Values], Array]
History = Callable[[Trace, Values], Array]
Resample = Callable[[Trace, Values], Array]


@dataclass(frozen=True)
class Form:
    """One physical model of one effect.

    ``path`` changes the signal path, ``measure`` the displacement behind it, ``history`` gives
    voltages before a record, ``resample`` the samples' true places, (n,) in sample times, for a
    command that is linear between samples; exactly one of them is set. ``linear``: the
    displacement is linear in the parameters, so that one start serves. ``priors`` are rows
    (weights by key) of weak expectations that regularise what the data cannot excite.
    """

    effect: str
    name: str
    params: tuple[Param, ...]
    starts: Starts
    path: Apply | None = None
    measure: Measure | None = None
    history: History | None = None
    resample: Resample | None = None
    linear: bool = False
    priors: tuple[dict[str, float], ...] = field(default=())
    size: str | None = None
    """The parameter that the displacement is about linear in; the records tell its start."""
    refines: bool = False
    """Only tried where another form of the effect that shares a parameter has been fitted."""
    unlikely: bool = False
    """A variant that is believed only where the data tell it from all that is more usual."""
    same_law: bool = False
    """It refines another form's steps, not its law: it may tell a size better."""

    @property
    def keys(self) -> tuple[str, ...]:
        """Of its parameters."""
        return tuple(p.key for p in self.params)

    def null(self) -> dict[str, float]:
        """Values without effect."""
        return {p.key: p.null for p in self.params}


def same_names(params: tuple[Param, ...]) -> Apply:
    """Parameters that are fields of the signal path under their own keys."""
    return lambda path, v: path.but(**{p.key: v[p.key] for p in params})


def null_start(form_params: tuple[Param, ...]) -> Starts:
    """One start, without effect."""
    return lambda _: [{p.key: p.null for p in form_params}]


def over_time(trace: Trace, length_s: float, coefficients: ArrayLike) -> Array:
    """A Legendre series of time, (n,); all its terms but the first vanish at the record's start."""
    c = np.asarray(coefficients, np.float64)
    series = np.array([0.0, *c[1:]])
    z = 2 * trace.t_s / length_s - 1
    moved: Array = c[0] + legval(z, series) - float(legval(-1.0, series))
    return moved
