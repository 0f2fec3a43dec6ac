"""model.json: the parameters of a predictor (schema ``madelung.model/1``)."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np

from madelung.blocks import Block, blocks_from_json, notes_from_json, number
from madelung.errors import InputError
from madelung.files import read_json, write_atomically
from madelung.yang2015 import KEYS as YANG_KEYS
from madelung.yang2015 import Yang, yang_from_json

SCHEMA = "madelung.model/1"
DEGREE_MAX = 7
BREAKPOINTS_MAX = 64
_KEYS = {"schema", "kind", "u_min_V", "u_max_V", "f0", "breakpoints", "blocks", "not_in_firmware"}
MARGIN_SHARE = 0.15
"""f0 is extrapolated up to this share of the identified range; further out the core clamps."""


@dataclass(frozen=True)
class Model:
    """A predictor of displacement (um) from voltage (V).

    Attributes
    ----------
    kind
        ``madelung``: f0 is a polynomial; ``major_curve``: f0 is piecewise linear; ``augmented``:
        a polynomial, and the blocks of the signal path; ``yang2015``: see yang2015.py.
    u_min_V, u_max_V
        Identified range of the command, V; x = u - u_min_V.
    f0
        Polynomial: coefficients in ascending powers of x, um / V^k, at most degree 7.
    breakpoints
        ``major_curve``: pairs (x V, y um), x ascending from 0 to u_max_V - u_min_V.
    blocks
        ``augmented``: effects that the core runs, in the order of the file; path.py.
    not_in_firmware
        ``augmented``: effects that no open-loop predictor can run; they are told, not predicted.
    yang
        ``yang2015``: its parameters, in the trajectory's place.
    extra
        Further keys of the file (covariance, sources, versions), kept as they are.
    """

    kind: Literal["madelung", "major_curve", "augmented", "yang2015"]
    u_min_V: float
    u_max_V: float
    f0: tuple[float, ...] = ()
    breakpoints: tuple[tuple[float, float], ...] = ()
    blocks: tuple[Block, ...] = ()
    not_in_firmware: tuple[Block, ...] = ()
    yang: Yang | None = None
    extra: dict[str, Any] = field(default_factory=dict)

    @property
    def range_V(self) -> float:
        """Width of the identified range, V."""
        return self.u_max_V - self.u_min_V

    def range_as(self, real: type[np.floating[Any]]) -> float:
        """Width of the identified range, V, as a build of the core holds it.

        The difference of the rounded ends: x = u - u_min of that build never exceeds it while u
        is at most u_max.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            return float(real(self.u_max_V) - real(self.u_min_V))

    def to_json(self) -> dict[str, Any]:
        """The content of model.json."""
        curve: dict[str, Any] = {"f0": list(self.f0)}
        if self.yang is not None:
            curve = self.yang.to_json()
        if self.kind == "major_curve":
            curve = {"breakpoints": [list(p) for p in self.breakpoints]}
        if self.kind == "augmented":
            curve |= {
                "blocks": [b.to_json() for b in self.blocks],
                "not_in_firmware": [b.to_json() for b in self.not_in_firmware],
            }
        head = {
            "schema": SCHEMA,
            "kind": self.kind,
            "u_min_V": self.u_min_V,
            "u_max_V": self.u_max_V,
        }
        return {**head, **curve, **self.extra}

    def save(self, path: Path) -> None:
        """Write model.json, whole or not at all."""
        write_atomically(path, json.dumps(self.to_json(), indent=1, allow_nan=False) + "\n")


def load_model(path: Path) -> Model:
    """Read model.json.

    Raises
    ------
    InputError
        The file cannot be read, is not JSON, has another schema or a bad value.
    """
    data = read_json(path)
    try:
        return model_from_json(data)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def model_from_json(data: object) -> Model:
    """Check the content of a model.json and make a `Model` of it."""
    if not isinstance(data, dict):
        raise InputError("is not a JSON object; a model written by `madelung identify` is expected")
    if data.get("schema") != SCHEMA:
        raise InputError(f"schema is {data.get('schema')!r}, this version reads {SCHEMA!r}")
    kind = data.get("kind")
    u_min, u_max = _number(data, "u_min_V"), _number(data, "u_max_V")
    if not 0.0 < u_max - u_min < math.inf:
        raise InputError(f"u_max_V ({u_max:g}) must be above u_min_V ({u_min:g})")
    extra = {k: v for k, v in data.items() if k not in _KEYS}
    if kind == "madelung":
        return Model("madelung", u_min, u_max, f0=_f0(data), extra=extra)
    if kind == "major_curve":
        points = _points(data.get("breakpoints"), u_max - u_min)
        return Model("major_curve", u_min, u_max, breakpoints=points, extra=extra)
    if kind == "augmented":
        return Model(
            "augmented",
            u_min,
            u_max,
            f0=_f0(data),
            blocks=blocks_from_json(data.get("blocks")),
            not_in_firmware=notes_from_json(data.get("not_in_firmware", [])),
            extra=extra,
        )
    if kind == "yang2015":
        extra = {k: v for k, v in extra.items() if k not in YANG_KEYS}
        return yang_model(yang_from_json(data), u_min, u_max, extra)
    raise InputError(
        f"kind is {kind!r}; this version runs 'madelung', 'major_curve', 'augmented' and 'yang2015'"
    )


def yang_model(
    yang: Yang, u_min_V: float, u_max_V: float, extra: dict[str, Any] | None = None
) -> Model:
    """A model of kind ``yang2015``; its f0 is the displacement at rest at u_min, for the blocks."""
    rest_um = yang.at_rest_um(u_min_V)
    return Model("yang2015", u_min_V, u_max_V, f0=(rest_um,), yang=yang, extra=extra or {})


def _f0(data: dict[str, Any]) -> tuple[float, ...]:
    f0 = tuple(_numbers(data.get("f0"), "f0"))
    if not 1 <= len(f0) <= DEGREE_MAX + 1:
        raise InputError(f"f0 has {len(f0)} coefficients, 1 to {DEGREE_MAX + 1} are possible")
    return f0


def _number(data: dict[str, Any], key: str) -> float:
    return number(data.get(key), key)


def _numbers(values: object, key: str) -> list[float]:
    if not isinstance(values, list):
        raise InputError(f"{key} must be a list of numbers")
    return [number(v, key) for v in values]


def _points(values: object, range_V: float) -> tuple[tuple[float, float], ...]:
    if not isinstance(values, list) or not 2 <= len(values) <= BREAKPOINTS_MAX:
        raise InputError(f"breakpoints must be a list of 2 to {BREAKPOINTS_MAX} pairs [x_V, y_um]")
    pairs = [tuple(_numbers(p, "breakpoints")) for p in values]
    if any(len(p) != 2 for p in pairs):
        raise InputError("breakpoints must be pairs [x_V, y_um]")
    x = [p[0] for p in pairs]
    if x[0] != 0.0 or any(b <= a for a, b in pairwise(x)):
        raise InputError("breakpoints must start at x = 0 and ascend")
    if not math.isclose(x[-1], range_V, rel_tol=1e-6):
        raise InputError(f"the last breakpoint ({x[-1]:g} V) must be u_max_V - u_min_V")
    return tuple((p[0], p[1]) for p in pairs)
