"""A case: the records of one device, on a uniform time grid (contract: diagnose.md)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, TypeGuard

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from madelung.diagnosis.vocabulary import EFFECTS, LIMITS
from madelung.errors import InputError
from madelung.files import read_json
from madelung.formats import READERS
from madelung.identify import UNIT_TIMES, check_reach
from madelung.model import MARGIN_SHARE
from madelung.records import Record, read_record, warm_up_rows

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
Role = Literal["identify", "train", "holdout"]
SUFFIXES = (".csv", *READERS)
ROWS_MIN = 100
"""Fewer tell nothing. The contract's 1e3 are what a record should have."""
KEYS = "device u_min_V u_max_V y_unit adc_bits dac_bits running known exclude".split()
"""Of case.json."""
KNEE_MIN = 1e-4
"""Of the range, that a knee may be wide; or 0."""
BITS_MAX = 32
"""Of a converter; 0 where there is none."""
AWAY_STROKES = 10.0
"""y so far beyond what identify.csv shows is another quantity, or in another unit."""
ENDS_SHARE = 0.002
"""A running record has been at an end when this share of its swing is left."""
GRID_GAP_MAX = 0.5
"""A record that misses more than this share of its rows is refused."""
SLOPE_ROWS = 4
"""Over so many rows the slope before and behind a gap is taken."""
BRIDGE_SHARE = 0.004
"""A gap can be bridged when the command is then wrong by less than this share of its swing."""


@dataclass(frozen=True)
class Trace:
    """A record on a uniform grid.

    Attributes
    ----------
    name, role
        File stem, and what the record is used for.
    step_s
        Sample time.
    u_V, y_um
        (n,); bridged where rows are missing.
    use
        (n,) bool: rows that are scored and fitted.
    rows
        (m,) int: place on the grid of each row of the file.
    record
        The record as it was read.
    running
        Begins in mid motion: history unknown.
    """

    name: str
    role: Role
    step_s: float
    u_V: Array
    y_um: Array
    use: NDArray[np.bool_]
    rows: NDArray[np.int64]
    record: Record
    running: bool = False
    u_meas_V: Array | None = None

    @property
    def t_s(self) -> Array:
        """Time since the record's start, s, (n,)."""
        return np.arange(self.u_V.size, dtype=np.float64) * self.step_s

    def filled(self, values: Array) -> Array:
        """Values (n,) with those of rows left out bridged linearly from the others'."""
        bad, before, behind, share = self._holes
        if bad.size == 0:
            return values
        out = values.copy()
        out[bad] = (1 - share) * values[before] + share * values[behind]
        return out

    @cached_property
    def _holes(self) -> tuple[Rows, Rows, Rows, Array]:
        """Rows left out, the used ones before and behind each, and its place between them."""
        kept, bad = np.flatnonzero(self.use), np.flatnonzero(~self.use)
        if kept.size == 0:
            return kept, kept, kept, np.empty(0)
        at = np.searchsorted(kept, bad)
        before, behind = kept[np.maximum(at - 1, 0)], kept[np.minimum(at, kept.size - 1)]
        share = np.clip((bad - before) / np.maximum(behind - before, 1), 0.0, 1.0)
        return bad, before, behind, share

    def head(self, n: int) -> Trace:
        """The first n grid points."""
        meas = None if self.u_meas_V is None else self.u_meas_V[:n]
        return replace(self, u_V=self.u_V[:n], y_um=self.y_um[:n], use=self.use[:n], u_meas_V=meas)


@dataclass(frozen=True)
class Case:
    """What `load_case` read."""

    device: str
    u_min_V: float
    u_max_V: float
    identify: Trace
    train: tuple[Trace, ...]
    holdout: tuple[Trace, ...]
    set_aside: tuple[str, ...]
    """Train records that serve as hold-out because the case has none."""
    known: dict[str, float]
    exclude: frozenset[str]
    faults: list[dict[str, Any]]
    warnings: list[str]

    @property
    def range_V(self) -> float:
        """u_max - u_min."""
        return self.u_max_V - self.u_min_V


def load_case(folder: Path, flashed: bool = False) -> Case:
    """Read a case folder.

    Parameters
    ----------
    folder
        See the contract.
    flashed
        The predictor is given: no f0 is identified, so identify.csv need not reach both ends.

    Raises
    ------
    InputError
        Something of the contract is missing or wrong: file, row, what to do.
    """
    head = _head(folder / "case.json")
    running = set(head["running"])
    identify = _trace(_only(folder, "identify"), "identify", head, running)
    train = [_trace(p, "train", head, running) for p in _records(folder / "train")]
    if not train:
        raise InputError(f"{folder / 'train'}: holds no record; at least one is needed")
    holdout = [_trace(p, "holdout", head, running) for p in _records(folder / "holdout")]
    aside: tuple[str, ...] = ()
    if not holdout and len(train) > 1:
        holdout = [replace(t, role="holdout") for t in train[-max(1, len(train) // 4) :]]
        aside = tuple(t.name for t in holdout)
        train = [t for t in train if t.name not in aside]
    traces = [identify, *train, *holdout]
    faults = [f for t in traces for f in _faults(t)]
    warnings = [*head["warnings"], *(w for t in traces for w in t.record.warnings())]
    if not flashed:
        ends = (head["u_min_V"], head["u_max_V"])
        mend = "mend u_min_V and u_max_V in case.json, or record the whole range"
        warnings += check_reach(f"{identify.record.name}: reaches", _ends(identify), ends, mend)
    warnings += [w for t in (*train, *holdout) for w in _in_other_units(identify, t)]
    warnings += _repeated(train, holdout)
    if aside or not holdout:
        warnings.append(_without_holdout(folder / "holdout", aside))
    lost = [t.name for t in train if t.use.sum() < ROWS_MIN]
    train = [t for t in train if t.name not in lost]
    warnings += [
        f"{n}: too many rows are missing to know the command's turns: left out" for n in lost
    ]
    if not train:
        raise InputError(f"{folder / 'train'}: too many rows are missing in every record")
    unknown = running - {t.name for t in traces}
    if unknown:
        raise InputError(f"{folder / 'case.json'}: running names no record: {sorted(unknown)[0]}")
    return Case(
        head["device"],
        head["u_min_V"],
        head["u_max_V"],
        identify,
        tuple(train),
        tuple(holdout),
        aside,
        head["known"],
        frozenset(head["exclude"]),
        faults,
        warnings,
    )


def _ends(trace: Trace) -> tuple[float, float]:
    return float(trace.u_V.min()), float(trace.u_V.max())


def _in_other_units(identify: Trace, trace: Trace) -> Iterator[str]:
    """What can be diagnosed, and is hardly what the user means."""
    ratio = _um_per_V(trace) / max(_um_per_V(identify), 1e-9)
    if not 1 / UNIT_TIMES < ratio < UNIT_TIMES:
        yield (
            f"{trace.record.name}: y moves {ratio:.2g} times as far per volt as in "
            f"{identify.record.name}: is a unit wrong in one of them?"
        )
        return
    y, low, high = trace.record.y, identify.y_um.min(), identify.y_um.max()
    assert y is not None
    away = np.maximum(y - high, low - y) > AWAY_STROKES * (high - low)
    away &= trace.record.sound
    if away.any():
        row = _first(away)
        yield (
            f"{trace.record.name}: row {trace.record.line(row)}: y is {y[row]:g} um, more than "
            f"{AWAY_STROKES:g} strokes away from {identify.record.name}: is its unit wrong?"
        )


def _um_per_V(trace: Trace) -> float:
    return float(np.ptp(trace.y_um) / np.ptp(trace.u_V))


def _without_holdout(folder: Path, aside: Sequence[str]) -> str:
    lacks = f"{folder}: {'holds no record' if folder.is_dir() else 'is missing'}"
    if aside:
        return f"{lacks}: {', '.join(aside)} set aside as hold-out"
    return f"{lacks}: how far the gap shrinks cannot be checked"


def _repeated(train: Sequence[Trace], holdout: Sequence[Trace]) -> Iterator[str]:
    for t in train:
        for h in holdout:
            if np.array_equal(t.u_V, h.u_V) and np.array_equal(t.y_um, h.y_um, equal_nan=True):
                yield f"holdout/{h.name} is train/{t.name} again: its score proves nothing"


def _head(path: Path) -> dict[str, Any]:
    data = _json_object(path)
    low, high = (_number(path, data, key) for key in ("u_min_V", "u_max_V"))
    if not low < high:
        raise InputError(f"{path}: u_min_V ({low:g}) must be below u_max_V ({high:g})")
    if data.get("y_unit", "um") != "um":
        raise InputError(f"{path}: y_unit is {data['y_unit']!r}, only 'um' is possible")
    exclude = _names(path, data, "exclude")
    wrong = [e for e in exclude if e not in EFFECTS]
    if wrong:
        raise InputError(f"{path}: exclude names no effect: {wrong[0]!r}")
    device = data.get("device", path.resolve().parent.name)
    if not isinstance(device, str):
        raise InputError(f"{path}: device must be a name, found {device!r}")
    for key in ("adc_bits", "dac_bits"):
        _check_bits(path, key, data.get(key, 0))
    return {
        "device": device,
        "u_min_V": low,
        "u_max_V": high,
        "running": [Path(n).stem for n in _names(path, data, "running")],
        "exclude": exclude,
        "known": _known(path, data),
        "warnings": [f"{path}: no key is named {k!r}: ignored" for k in data if k not in KEYS],
    }


def _json_object(path: Path) -> dict[str, Any]:
    data = read_json(path)
    if not isinstance(data, dict):
        raise InputError(f"{path}: must hold a JSON object")
    return data


def _number(path: Path, data: dict[str, Any], key: str) -> float:
    value = data.get(key)
    if not (_is_number(value) and abs(value) < 1e6):
        raise InputError(f"{path}: {key} must be a number below 1e6, found {value!r}")
    return float(value)


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _check_bits(path: Path, key: str, bits: object) -> None:
    if not (isinstance(bits, int) and not isinstance(bits, bool) and 0 <= bits <= BITS_MAX):
        raise InputError(f"{path}: {key} must be an integer from 0 to {BITS_MAX}, found {bits!r}")


def _names(path: Path, data: dict[str, Any], key: str) -> list[str]:
    names = data.get(key, [])
    if not isinstance(names, list) or not all(isinstance(n, str) for n in names):
        raise InputError(f"{path}: {key} must be a list of names")
    return names


def _known(path: Path, data: dict[str, Any]) -> dict[str, float]:
    known = data.get("known", {})
    if not isinstance(known, dict):
        raise InputError(f"{path}: known must map parameter keys to numbers")
    limits = _limits(float(data["u_min_V"]), float(data["u_max_V"]))
    for key in known:
        if key not in limits:
            raise InputError(f"{path}: known has no parameter {key!r}; possible: {sorted(limits)}")
        low, high = limits[key]
        if not (_is_number(known[key]) and low <= known[key] <= high):
            raise InputError(
                f"{path}: known: {key} must be a number between {low:g} and {high:g}, "
                f"found {known[key]!r}"
            )
    if "low_V" in known and "high_V" in known and not known["low_V"] < known["high_V"]:
        raise InputError(f"{path}: known: low_V must be below high_V")
    knee_V = known.get("knee_V")
    least = KNEE_MIN * (float(data["u_max_V"]) - float(data["u_min_V"]))
    if knee_V == 0.0 and not {"low_V", "high_V"} & set(known):
        raise InputError(f"{path}: known: a knee_V of 0 needs low_V or high_V")
    if knee_V and knee_V < least:
        raise InputError(f"{path}: known: knee_V must be 0 or at least {least:g}, found {knee_V:g}")
    return {k: float(v) for k, v in known.items()}


def _limits(u_min_V: float, u_max_V: float) -> dict[str, tuple[float, float]]:
    """Between what a parameter can be known. A line's phase and size differ by record: not here."""
    width = u_max_V - u_min_V
    return LIMITS | {
        "high_V": (u_min_V, u_max_V + 0.2 * width),
        "low_V": (u_min_V - 0.2 * width, u_max_V),
        "knee_V": (0.0, 0.5 * width),
        "start_peak_V": (u_min_V, u_max_V),
    }


def _records(folder: Path) -> list[Path]:
    if not folder.is_dir():
        return []
    shown = (p for p in folder.iterdir() if not p.name.startswith("."))
    paths = sorted(p for p in shown if p.suffix.lower() in SUFFIXES)
    stems = [p.stem for p in paths]
    for stem in stems:
        if stems.count(stem) > 1:
            raise InputError(f"{folder}: two records are named {stem!r}")
    return paths


def _only(folder: Path, stem: str) -> Path:
    for path in _records(folder):
        if path.stem == stem:
            return path
    raise InputError(f"{folder / (stem + '.csv')}: is missing; a slow loop over the whole range")


def _trace(path: Path, role: Role, head: dict[str, Any], running: set[str]) -> Trace:
    record = read_record(path, ROWS_MIN)
    if record.y is None:
        raise InputError(f"{path}: has no column y_um; a diagnosis needs the measured displacement")
    if record.y_unit != "um":
        raise InputError(f"{path}: y is in {record.y_unit}; micrometres (y_um) are needed")
    _check_range(path, record, head)
    return _on_grid(path, record, role, path.stem in running)


def _check_range(path: Path, record: Record, head: dict[str, Any]) -> None:
    margin = MARGIN_SHARE * (head["u_max_V"] - head["u_min_V"])
    out = (record.u_V < head["u_min_V"] - margin) | (record.u_V > head["u_max_V"] + margin)
    if out.any():
        at = int(np.argmax(out))
        raise InputError(
            f"{path}: row {record.line(at)}: u = {record.u_V[at]:g} V lies more than 15 % of the "
            f"range outside {head['u_min_V']:g}..{head['u_max_V']:g} V; check units and case.json"
        )


def _on_grid(path: Path, record: Record, role: Role, running: bool) -> Trace:
    assert record.y is not None
    rows = record.places
    step = float((record.t_s[-1] - record.t_s[0]) / rows[-1])
    size = int(rows[-1]) + 1
    if size > rows.size / (1 - GRID_GAP_MAX):
        raise InputError(f"{path}: most rows are missing between {record.t_s[0]:g} s and its end")
    first = np.concatenate([[True], np.diff(rows) > 0])
    sound = record.sound & first
    grid = np.arange(size)

    def bridge(values: Array) -> Array:
        return np.asarray(np.interp(grid, rows[sound], values[sound]), np.float64)

    u, doubtful = _bridged(rows[first], record.u_V[first])
    use = np.zeros(size, np.bool_)
    use[rows[sound]] = True
    warm_up = min(warm_up_rows(u, ENDS_SHARE), u.size - ROWS_MIN) if running else 0
    use &= (grid >= warm_up) & ~doubtful
    if use.sum() < ROWS_MIN and role == "identify":
        raise InputError(f"{path}: too many rows are missing to know the turns of the command")
    meas = None if record.u_meas_V is None else bridge(record.u_meas_V)
    return Trace(path.stem, role, step, u, bridge(record.y), use, rows, record, running, meas)


def _bridged(rows: Rows, u_V: Array) -> tuple[Array, NDArray[np.bool_]]:
    """The command on the whole grid, and rows whose past is in doubt.

    A gap is bridged in the way that errs least where the command is known. Where that is still too
    far from a straight line, the gap may hide a turn: until the command has since gone beyond all
    that this may have reached, the displacement cannot be foretold.
    """
    grid = np.arange(rows[-1] + 1)
    doubtful = np.zeros(grid.size, np.bool_)
    straight = np.asarray(np.interp(grid, rows, u_V), np.float64)
    lengths = np.diff(rows) - 1
    gaps = np.flatnonzero(lengths)
    if gaps.size == 0:
        return straight, doubtful
    usual = int(np.median(lengths[gaps]))
    errors = {k: _bridge_error(straight, usual, k) for k in ("straight", "smooth", "kinked")}
    kind = min(errors, key=lambda k: errors[k])
    bent = _kinked(rows, u_V, grid, straight)
    if kind != "kinked":
        bent = np.clip(CubicSpline(rows, u_V)(grid), u_V.min(), u_V.max())
    u = straight if kind == "straight" else bent
    swing = float(np.ptp(u_V))
    error = np.maximum.reduceat(np.abs(bent - straight), rows[:-1])[gaps]
    if kind != "straight":
        told, which = np.unique(lengths[gaps], return_inverse=True)
        share = [
            _bridge_error(straight, int(g), kind)
            / max(_bridge_error(straight, int(g), "straight"), 1e-12)
            for g in told
        ]
        error *= np.minimum(share, 1.0)[which]
    edge = ENDS_SHARE * swing
    for i, e in zip(gaps, error, strict=True):
        if e < BRIDGE_SHARE * swing:
            continue
        inside, after = u[rows[i] : rows[i + 1] + 1], u[rows[i + 1] :]
        place = np.linspace(-1.0, 1.0, inside.size)
        reach = e * (1 - place**2)
        top, bottom = float((inside + reach).max()), float((inside - reach).min())
        settled = 0
        if top > max(inside[0], inside[-1]) + edge:
            settled = _first(after >= min(top, float(u.max()) - edge))
        if bottom < min(inside[0], inside[-1]) - edge:
            settled = max(settled, _first(after <= max(bottom, float(u.min()) + edge)))
        doubtful[rows[i + 1] : rows[i + 1] + settled] = True
    return u, doubtful


def _kinked(rows: Rows, u_V: Array, grid: Rows, straight: Array) -> Array:
    """Gaps bridged by going on along the lines at both sides to where they meet."""
    left = np.minimum(np.searchsorted(rows, grid, side="right") - 1, rows.size - 2)
    right = left + 1

    def line(at: Rows, other: Rows) -> Array:
        """Through two known rows each, at the grid; flat at the record's ends."""
        slope = (u_V[at] - u_V[other]) / np.where(at == other, 1, rows[at] - rows[other])
        out: Array = u_V[at] + slope * (grid - rows[at])
        return out

    a = line(left, np.maximum(left - SLOPE_ROWS, 0))
    b = line(right, np.minimum(right + SLOPE_ROWS, rows.size - 1))
    return np.where(np.isin(grid, rows), straight, _meeting(a, b, straight))


def _meeting(a: Array, b: Array, chord: Array) -> Array:
    """Of two lines, what lies nearer the chord, if they leave it to the same side."""
    top, bottom = np.minimum(a, b), np.maximum(a, b)
    out: Array = np.where(top > chord, top, np.where(bottom < chord, bottom, chord))
    return out


def _first(where: NDArray[np.bool_]) -> int:
    """Place of the first True; the size where there is none."""
    at = int(np.argmax(where)) if where.size else 0
    return at if where.size and where[at] else where.size


def _bridge_error(u: Array, gap: int, kind: str) -> float:
    """Rms error in the middle of a gap of so many rows, where nothing is missing, V."""
    h = (gap + 2) // 2
    m = SLOPE_ROWS if kind == "kinked" else 1
    n = u.size - 2 * h - 2 * m
    if n < 1:
        return float(np.ptp(u))
    first, second, third, fourth = (u[k : k + n] for k in (0, m, 2 * h + m, 2 * h + 2 * m))
    guess = (second + third) / 2
    if kind == "smooth":
        guess = guess + h * h / (4 * h + 2) * (second + third - first - fourth)
    if kind == "kinked":
        on, back = (second - first) * h / m, (third - fourth) * h / m
        guess = _meeting(second + on, third + back, guess)
    return float(np.sqrt(np.mean((u[h + m : h + m + n] - guess) ** 2)))


def _faults(trace: Trace) -> list[dict[str, Any]]:
    """As diagnosis.json lists them; jitter, which is seldom in few rows, as one from end to end."""
    record = trace.record
    faults = [f for f in record.faults if f.kind != "jitter"]
    shaken = [f for f in record.faults if f.kind == "jitter"]
    if shaken:
        faults.append(replace(shaken[0], last=shaken[-1].last))
    return [
        {
            "record": trace.name,
            "rows": [record.line(f.first), record.line(f.last)],
            "kind": f.kind,
        }
        for f in faults
    ]
