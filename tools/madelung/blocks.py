"""Effects as a model file holds them: blocks of the signal path, their parameters in units."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from madelung.errors import InputError

_LARGEST = sys.float_info.max  # integers may be larger
UNLIMITED_V = 1e6


@dataclass(frozen=True)
class Block:
    """One effect: its name (diagnose.md), its physical model, its parameters in units."""

    effect: str
    model: str
    parameters: dict[str, Any]

    def to_json(self) -> dict[str, Any]:
        """As model.json holds it."""
        return {"effect": self.effect, "model": self.model, "parameters": self.parameters}

    def told(self) -> str:
        """For people, on one line."""
        name = f"{self.effect}, {self.model}" if self.model else self.effect
        return f"{name}: {_text(self.parameters)}"


@dataclass(frozen=True)
class _Range:
    """Least and largest value of a parameter, and the one that it has when it is not given."""

    low: float
    high: float
    default: float | None = None
    whole: bool = False


def _terms(rows: Sequence[int]) -> dict[str, _Range]:
    return {f"g{k}{j}_um": _Range(-1e6, 1e6, 0.0) for k in rows for j in range(1, 5)}


_POSITIVE = (1e-9, 1e12)
_ANY = (-1e6, 1e6)
_FLAT = {
    "delay": {"delay_s": _Range(0.0, 1e3), "substeps_min": _Range(1, 64, 1)},
    "saturation": {
        "high_V": _Range(*_ANY, UNLIMITED_V),
        "low_V": _Range(*_ANY, -UNLIMITED_V),
        "knee_V": _Range(0.0, 1e6, 0.0),
        "knee_power": _Range(0.0, 32.0, 0.0),
        "parabolic": _Range(0, 1, 0, whole=True),
        "rest_free": _Range(0, 1, 0, whole=True),
    },
    "slew_limit": {
        "slew_V_per_s": _Range(*_POSITIVE),
        "slew_fall_V_per_s": _Range(0.0, 1e12, 0.0),
        "slew_knee_V": _Range(0.0, 1e6, 0.0),
    },
    "amplifier_lag": {
        "corner_hz": _Range(0.0, 1e12, 0.0),
        "corner_lean": _Range(-0.5, 0.5, 0.0),
        "behind_hz": _Range(0.0, 1e12, 0.0),
    },
    "asymmetry": _terms((1, 3))
    | {
        "rise_V": _Range(0.0, 1e6, 0.0),
        "rise_skew": _Range(-1.0, 1.0, 0.0),
        "fall_V": _Range(0.0, 1e6, 0.0),
        "fall_skew": _Range(-1.0, 1.0, 0.0),
        "follow": _Range(0.0, 1.0, 0.0),
    },
    "rate_dependence": {
        "damping_um": _Range(*_ANY, 0.0),
        "widening": _Range(0.0, 1e6, 0.0),
        "threshold_V": _Range(0.0, 1e6, 0.0),
        "swelling": _Range(0.0, 1e6, 0.0),
        "lean": _Range(*_ANY, 0.0),
        "power": _Range(0.01, 4.0, 1.0),
        "v_ref_V_per_s": _Range(*_POSITIVE),
        "v_knee": _Range(0.0, 1e6, 0.0),
        "velocity_tau_s": _Range(0.0, 1e3, 0.0),
        "of_speed": _Range(0, 1, 0, whole=True),
        "relax_s": _Range(0.0, 1e6, 0.0),
        "relax_per_V_s": _Range(0.0, 1e12, 0.0),
        "smooth": _Range(0.0, 1.0, 0.0),
    },
    "non_masing": _terms((2, 4))
    | {
        "bouc_um": _Range(*_ANY, 0.0),
        "bouc_V": _Range(*_POSITIVE, 1.0),
        "bouc_power": _Range(1.0, 4.0, 1.0),
        "bouc_gamma": _Range(-0.9, 1.0, 0.0),
        "loop_share": _Range(*_ANY, 0.0),
        "loop_slope": _Range(*_ANY, 0.0),
    },
    "initial_state": {
        "start_peak_V": _Range(*_ANY),
        "start_dip_V": _Range(-UNLIMITED_V, UNLIMITED_V, UNLIMITED_V),
    },
    "backlash": {
        "dead_band_um": _Range(0.0, 1e6),
        "spread": _Range(0.0, 1.0, 0.0),
        "spring_share": _Range(0.0, 1.0, 0.0),
    },
    "gain_offset": {"gain": _Range(*_ANY, 1.0), "offset_um": _Range(*_ANY, 0.0)},
}
_MODES = {
    "creep": {"tau_s": _Range(*_POSITIVE), "gain": _Range(*_ANY)},
    "resonance": {
        "fn_hz": _Range(*_POSITIVE),
        "zeta": _Range(0.0, 10.0),
        "share": _Range(*_ANY, 1.0),
    },
}
"""Effects that are a list of modes: {"modes": [{...}, ...]}."""


def blocks_from_json(data: object) -> tuple[Block, ...]:
    """The blocks of a model, checked; what is not given has its default.

    Raises
    ------
    InputError
        An effect that no chain of the core has, or has twice; a parameter that is missing,
        unknown, not finite or out of its range.
    """
    blocks = tuple(_checked(b) for b in _plain(data, "blocks"))
    names = [b.effect for b in blocks]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"blocks: {name} stands there twice")
    return blocks


def notes_from_json(data: object) -> tuple[Block, ...]:
    """``not_in_firmware``: effects that are kept, and not run."""
    blocks = _plain(data, "not_in_firmware")
    for b in blocks:
        for key, value in b.parameters.items():
            number(value, f"{b.effect}: {key}")
    return blocks


def _plain(data: object, key: str) -> tuple[Block, ...]:
    if not isinstance(data, list):
        raise InputError(f"{key} must be a list of effects with their parameters")
    for b in data:
        if (
            not isinstance(b, dict)
            or not isinstance(b.get("effect"), str)
            or not isinstance(b.get("parameters"), dict)
        ):
            raise InputError(f'{key} must hold objects with "effect" and "parameters"')
    return tuple(Block(b["effect"], str(b.get("model", "")), b["parameters"]) for b in data)


def _checked(block: Block) -> Block:
    name, given = block.effect, block.parameters
    if name in _FLAT:
        values: dict[str, Any] = _values(name, given, _FLAT[name])
    elif name in _MODES:
        modes = given.get("modes")
        if not isinstance(modes, list) or not all(isinstance(m, dict) for m in modes):
            raise InputError(f"{name}: modes must be a list of objects")
        values = {"modes": [_values(name, m, _MODES[name]) for m in modes]}
    else:
        raise InputError(f"blocks: {name!r:.40} is no effect that the core runs")
    if name == "saturation" and not values["low_V"] < values["high_V"]:
        raise InputError(f"saturation: high_V must be above low_V ({values['low_V']:g})")
    if name == "saturation":
        _check_knee(values)
    poles = [values.get(key, 0.0) for key in ("corner_hz", "behind_hz")]
    if name == "amplifier_lag" and max(poles) < _POSITIVE[0]:
        raise InputError("amplifier_lag: corner_hz or behind_hz must be above 0")
    if name == "rate_dependence":
        laws = ("relax_s", "relax_per_V_s", "widening")
        if sum(values[k] > 0.0 for k in laws) > 1:
            raise InputError(f"rate_dependence: only one of {', '.join(laws)} may be above 0")
    return Block(name, block.model, values)


def _check_knee(v: dict[str, Any]) -> None:
    wide, power, parabolic = 0.5 * (v["high_V"] - v["low_V"]), v["knee_power"], v["parabolic"]
    if power and parabolic:
        raise InputError("saturation: a parabolic knee has no knee_power")
    if (0.0 < power < 1.0) or ((power or parabolic) and not 0.0 < v["knee_V"] <= wide):
        what = "parabolic" if parabolic else "a knee_power, 1 to 32,"
        raise InputError(f"saturation: with {what} knee_V must be above 0, at most {wide:g}")


def _values(name: str, given: dict[str, Any], ranges: dict[str, _Range]) -> dict[str, float]:
    for key in given:
        if key not in ranges:
            raise InputError(f"{name} has no parameter {key!r:.40}")
    values = {
        key: number(given.get(key, r.default), f"{name}: {key}", r.low, r.high)
        for key, r in ranges.items()
    }
    for key, value in values.items():
        if ranges[key].whole and value != int(value):
            raise InputError(f"{name}: {key} = {value:g} must be a whole number")
    return values


def number(value: object, key: str, low: float = -math.inf, high: float = math.inf) -> float:
    """A finite number, or a sentence that names its key."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= _LARGEST:
        raise InputError(f"{key} must hold finite numbers, found {value!r:.40}")
    if not low <= value <= high:
        raise InputError(f"{key} = {value:g} must be {low:g} to {high:g}")
    return float(value)


def _text(values: dict[str, Any]) -> str:
    if "modes" in values:
        return "; ".join(_text(m) for m in values["modes"])
    return ", ".join(f"{k} = {v:.9g}" for k, v in values.items())
