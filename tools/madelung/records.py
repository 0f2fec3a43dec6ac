"""Records: a command in V, and where measured a displacement, over time (contract: CSV)."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from madelung.errors import InputError
from madelung.files import replacing

if TYPE_CHECKING:
    import pandas as pd

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]
FaultKind = Literal["gap", "duplicate", "jitter", "stuck", "clipped", "outlier"]

SAMPLES_MIN = 10
JITTER_SHARE = 0.05
"""A sample further than this share of the step from its place in time is a fault."""
STEADY_ROWS = 0.9
"""No time is lost where the time stamps stay this close to a straight line, peak to peak in steps:
a row that is missing bends them by a whole step."""
TIME_RESOLUTION_S = 1e-6
"""Time stamps are taken to be rounded to this."""
OUTLIER_STROKES = 10.0
"""y that leaps by so many times the way of all other rows, in one row alone, was not moved."""
FLAT_SAMPLES = 5
"""So many equal values of y in a row, while u moves on, are stuck or clipped."""
FLAT_SHARE = 0.02
"""u must have moved by this share of its range over them, a quarter of it before it turned."""
REST_SHARE = 0.005
"""Of its range, that u moves by at most from row to row where it rests."""
PEAKS_MIN = 4
PEAKS_SHARE = 0.25
PEAK_STEPS = 8.0
"""So many sharp peaks (by steps of y) that end in the same value are clipped, if the next such
steps hold no more peaks than this share of them: free peaks are spread over both."""

_SCALE = {
    "t": {"s": 1.0, "ms": 1e-3},
    "u": {"V": 1.0, "mV": 1e-3},
    "u_meas": {"V": 1.0, "mV": 1e-3},
    "y": {"um": 1.0, "nm": 1e-3, "mm": 1e3, "V": 1.0, "deg": 1.0},
}
_UNCONVERTED = ("V", "deg")
_LIMIT = {"t": 1e10, "u": 1e6, "u_meas": 1e6, "y": 1e6}
"""Largest size that makes sense, in s, V and um; what is beyond overflows the firmware's float."""


@dataclass(frozen=True)
class Fault:
    """A fault of the data that is reported, and left out of fits, but does not refuse the record.

    Attributes
    ----------
    kind
        ``gap`` (samples missing before these), ``duplicate`` (the time of the sample before),
        ``jitter`` (off its place in time), ``stuck`` (y does not move while u does), ``clipped``
        (likewise, at the end of y's range), ``outlier`` (see `OUTLIER_STROKES`).
    first, last
        Samples of the record, from 0, both included.
    """

    kind: FaultKind
    first: int
    last: int


@dataclass(frozen=True)
class Record:
    """A record of one input and at most one output. Every row of the file is kept.

    Attributes
    ----------
    name
        Where it came from, for messages: the path of its file.
    t_s, u_V
        Time and command, shape (n,), finite, time never running back.
    y
        Displacement, shape (n,), in `y_unit`; None when the record has none.
    y_unit
        ``um``, or what the sensor gives: ``V`` or ``deg``.
    u_meas_V
        The amplifier's monitor, shape (n,), or None.
    extra
        Columns of other names, as they were read.
    faults
        See `Fault`.
    first_line
        Line of the file (from 1) that holds sample 0, for messages.
    """

    name: str
    t_s: Floats
    u_V: Floats
    y: Floats | None = None
    y_unit: str = "um"
    u_meas_V: Floats | None = None
    extra: dict[str, NDArray[Any]] = field(default_factory=dict)
    faults: tuple[Fault, ...] = ()
    first_line: int = 2

    @property
    def step_s(self) -> float:
        """Sample time in s: the mean of the steps that are neither gaps nor duplicates."""
        return _step_s(self.t_s)

    @property
    def places(self) -> Rows:
        """Of the samples on a uniform grid, counted from the first, shape (n,)."""
        if _is_steady(self.t_s):
            return np.asarray(np.append(0, np.cumsum(np.diff(self.t_s) > 0.0)), np.intp)
        t = self.t_s - self.t_s[0]
        step = t[-1] / np.rint(t[-1] / self.step_s)
        return np.asarray(np.rint(t / step), np.intp)

    @property
    def sound(self) -> NDArray[np.bool_]:
        """False on duplicates and where y is stuck, clipped or an outlier, shape (n,).

        Gaps and jitter concern the time between samples; the samples themselves are good.
        """
        mask = np.ones(self.t_s.size, np.bool_)
        for fault in self.faults:
            if fault.kind not in ("gap", "jitter"):
                mask[fault.first : fault.last + 1] = False
        return mask

    def line(self, sample: int) -> int:
        """Line of the file (from 1) that holds a sample (from 0)."""
        return sample + self.first_line

    def warnings(self) -> list[str]:
        """One sentence per kind of fault."""
        said = []
        for kind, text in _FAULT_TEXT.items():
            these = [f for f in self.faults if f.kind == kind]
            if these:
                rows = sum(f.last - f.first + 1 for f in these)
                where = f"the first in row {self.line(these[0].first)}"
                said.append(f"{self.name}: rows {text}: {rows} ({where})")
        return said


_FAULT_TEXT: dict[FaultKind, str] = {
    "gap": "with samples missing before them",
    "duplicate": "with the time of the row before",
    "jitter": "that are off their place in time",
    "stuck": "in which y is stuck while u moves",
    "clipped": "in which y is clipped",
    "outlier": "in which y leaps by many strokes and back",
}


def warm_up_rows(u_V: Floats, share: float) -> int:
    """Rows until a command, (n,), has been within a share of its swing of both of its ends."""
    reach = share * float(np.ptp(u_V))
    return int(max(np.argmax(u_V >= u_V.max() - reach), np.argmax(u_V <= u_V.min() + reach)))


def read_record(path: Path, rows_min: int = SAMPLES_MIN) -> Record:
    """Read a record; the suffix of its name decides how (CSV unless `formats` knows it).

    Parameters
    ----------
    path
        The file.
    rows_min
        A record of fewer rows is refused.

    Raises
    ------
    InputError
        The file cannot be read or is not a record: missing or doubled column, unit that does not
        fit, a value that is not a finite number, time running back, u constant, too short.
    """
    from madelung.formats import read_other

    columns = read_other(path)
    if columns is None:
        return make_record(str(path), _read_csv(path), rows_min=rows_min)
    return make_record(str(path), columns, first_line=1, rows_min=rows_min)


def write_record(path: Path, record: Record) -> None:
    """Write a record as CSV, whole or not at all; values are rounded to nine decimals.

    Raises
    ------
    InputError
        The folder does not exist or cannot be written.
    """
    columns: dict[str, NDArray[Any]] = {"t_s": record.t_s, "u_V": record.u_V}
    if record.y is not None:
        columns[f"y_{record.y_unit}"] = record.y
    if record.u_meas_V is not None:
        columns["u_meas_V"] = record.u_meas_V
    write_columns(path, {**columns, **record.extra})


def write_columns(path: Path, columns: dict[str, NDArray[Any]]) -> None:
    """Write columns of equal length as CSV, whole or not at all, rounded to nine decimals."""
    import pandas as pd

    with replacing(path) as part:
        pd.DataFrame(columns).round(9).to_csv(part, index=False, lineterminator="\n")


def make_record(
    name: str,
    columns: dict[str, NDArray[Any]],
    first_line: int = 2,
    rows_min: int = SAMPLES_MIN,
) -> Record:
    """Check named columns and make a `Record` of them; what every loader ends with.

    Parameters
    ----------
    name
        For messages: the path of the file.
    columns
        Arrays of equal length by their name with unit (``t_ms``, ``u_V``, ``y_nm``, ...).
    first_line
        Number of the first row in messages; 1 where the names are not in a row.
    rows_min
        See `read_record`.

    Raises
    ------
    InputError
        See `read_record`.
    """
    chosen = _choose(name if first_line == 1 else f"{name}: row 1", list(columns))
    values: dict[str, Floats] = {}
    for quantity, (column, scale) in chosen.items():
        limit = _LIMIT[quantity] / scale
        values[quantity] = _numbers(name, column, columns[column], limit, first_line) * scale
    t, u, y = values["t"], values["u"], values.get("y")
    if t.size < rows_min:
        raise InputError(f"{name}: {t.size} rows are too few: at least {rows_min} are needed")
    _check_time(name, t, first_line)
    for quantity in chosen.keys() & {"u", "y"}:
        if np.ptp(values[quantity]) == 0.0:
            raise InputError(
                f"{name}: {chosen[quantity][0]} is {columns[chosen[quantity][0]][0]} in all rows: "
                "record a movement (is everything connected?)"
            )
    taken = {column for column, _ in chosen.values()}
    unit = chosen["y"][0].rpartition("_")[2] if y is not None else "um"
    return Record(
        name=name,
        t_s=t,
        u_V=u,
        y=y,
        y_unit=unit if unit in _UNCONVERTED else "um",
        u_meas_V=values.get("u_meas"),
        extra={k: v for k, v in columns.items() if k not in taken},
        faults=tuple(_faults(t, u, y)),
        first_line=first_line,
    )


def is_column(name: str) -> bool:
    """Whether a name is that of time, command, monitor or displacement, with whatever unit."""
    return name.rpartition("_")[0] in _SCALE


def _choose(where: str, columns: list[str]) -> dict[str, tuple[str, float]]:
    """Which column holds which quantity, with its factor to the base unit."""
    chosen: dict[str, tuple[str, float]] = {}
    for column in columns:
        if not is_column(column):
            continue
        quantity, _, unit = column.rpartition("_")
        units = _SCALE[quantity]
        if unit not in units:
            known = " or ".join(f"{quantity}_{u}" for u in units)
            raise InputError(
                f"{where}: column {column!r}: the unit {unit!r} does not fit; "
                f"convert it and name it {known}"
            )
        if quantity in chosen:
            raise InputError(
                f"{where}: columns {chosen[quantity][0]!r} and {column!r} both hold "
                f"{quantity}: remove one"
            )
        chosen[quantity] = (column, units[unit])
    several = [c for c in columns if c[:1] == "u" and c[1:].partition("_")[0].isdigit()]
    if several and "u" in chosen:
        several.insert(0, chosen["u"][0])
    if len(several) > 1:
        raise InputError(
            f"{where}: {len(several)} input columns ({', '.join(several)}): a predictor with "
            "one input cannot explain an output that several inputs drive; record one actuator "
            "with the others at rest and name its columns u_V and y_um"
        )
    for quantity, wanted in (("t", "t_s or t_ms"), ("u", "u_V or u_mV")):
        if quantity not in chosen:
            names = ",".join(columns)[:100]
            held = f"the names are {names!r}" if names else "it holds no vector of numbers"
            raise InputError(f"{where}: no column {wanted}; {held}")
    return chosen


def _numbers(name: str, column: str, raw: NDArray[Any], limit: float, first_line: int) -> Floats:
    """The column as finite float64, or a sentence about its first cell that is none."""
    import pandas as pd

    if np.issubdtype(raw.dtype, np.number) and not np.issubdtype(raw.dtype, np.complexfloating):
        values = np.array(raw, np.float64)
    else:
        text = pd.Series(raw)
        values = pd.to_numeric(text, errors="coerce").to_numpy(np.float64, na_value=np.nan)
    with np.errstate(invalid="ignore"):
        bad = np.flatnonzero(~(np.abs(values) <= limit))
    if bad.size:
        row = int(bad[0])
        cell = str(raw[row])
        said = "is empty or not a number" if cell in ("nan", "None", "<NA>") else f"reads {cell!r}"
        rest = f" ({bad.size} such rows)" if bad.size > 1 else ""
        raise InputError(
            f"{name}: row {first_line + row}: {column} {said}{rest}: every cell must hold a "
            f"number with a decimal point, at most {limit:g} in size; mend or remove the row"
        )
    return values


def _check_time(name: str, t: Floats, first_line: int) -> None:
    step = np.diff(t)
    back = np.flatnonzero(step < 0.0)
    if back.size:
        row = int(back[0]) + 1
        raise InputError(
            f"{name}: row {first_line + row}: time runs back from {t[row - 1]:.9g} s to "
            f"{t[row]:.9g} s: sort the rows, or split the file where a new recording starts"
        )
    still = int(np.count_nonzero(step == 0.0))
    if still > 0.1 * t.size:
        raise InputError(
            f"{name}: {still} of {t.size} rows have the time of the row before: "
            "write the time with more digits"
        )
    if not _usual(step).any():
        row = int(np.argmax(np.abs(np.diff(step)))) + 1
        raise InputError(
            f"{name}: row {first_line + row}: the sample time changes from {step[row - 1]:.3g} s "
            f"to {step[row]:.3g} s: split the file there"
        )


def _is_steady(t: Floats) -> bool:
    """Whether no time is lost, however much the time stamps jitter; duplicates do not count."""
    moved = t[np.append(True, np.diff(t) > 0.0)]
    k = np.arange(moved.size) - (moved.size - 1) / 2
    step = float(k @ (moved - moved[0]) / (k @ k))
    return bool(np.ptp(moved - step * k) < STEADY_ROWS * step)


def _step_s(t: Floats) -> float:
    steps = np.diff(t)
    if _is_steady(t):
        return float(np.mean(steps[steps > 0.0]))
    return float(np.mean(steps[_usual(steps)]))


def _usual(steps: Floats) -> NDArray[np.bool_]:
    """Steps that are neither gaps nor duplicates."""
    middle = np.median(steps)
    return np.asarray((steps > 0.5 * middle) & (steps < 1.5 * middle), np.bool_)


def _faults(t: Floats, u: Floats, y: Floats | None) -> Iterator[Fault]:
    steps = np.diff(t)
    step = _step_s(t)
    passed = steps > 0.0 if _is_steady(t) else np.rint(steps / step)
    yield from _runs("gap", passed > 1, 1)
    yield from _runs("duplicate", steps == 0.0, 1)
    off = np.abs(steps - passed * step) > JITTER_SHARE * step + TIME_RESOLUTION_S
    yield from _runs("jitter", off & (steps > 0.0), 1)
    if y is not None:
        calm = _middle(y)
        leaps = _leaps(u, y, calm)
        yield from _runs("outlier", leaps, 0)
        y = np.where(leaps, calm, y)  # a leap is not the end of y's range
        runs = _equal(y)
        yield from sorted([*_flat(u, y, runs), *_cut_peaks(u, y, runs)], key=lambda f: f.first)


def _middle(values: Floats) -> Floats:
    """The running median of three rows, shape (n,)."""
    a, b, c = values[:-2], values[1:-1], values[2:]
    inner = np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c))
    return np.concatenate([inner[:1], inner, inner[-1:]])


def _leaps(u: Floats, y: Floats, calm: Floats) -> NDArray[np.bool_]:
    """Rows of outliers; none where the command itself leaps in single rows."""
    way = np.ptp(calm)
    if way == 0.0 or np.ptp(_middle(u)) < 0.5 * np.ptp(u):
        return np.zeros(y.size, np.bool_)
    return np.asarray(np.abs(y - calm) > OUTLIER_STROKES * way)


def _equal(y: Floats) -> tuple[Rows, Rows]:
    """First and last sample of every run of equal values, of one sample or more."""
    change = np.flatnonzero(np.diff(y) != 0.0)
    return np.append(0, change + 1), np.append(change, y.size - 1)


def _flat(u: Floats, y: Floats, runs: tuple[Rows, Rows]) -> Iterator[Fault]:
    """Long runs of equal y while u goes on as before; after a turn of u, backlash does the same."""
    first, last = runs
    long = last - first >= FLAT_SAMPLES - 1
    first, last = first[long], last[long]
    if first.size == 0:
        return
    bounds = np.column_stack((first, np.minimum(last + 1, u.size - 1))).ravel()
    rise = np.maximum.reduceat(u, bounds)[::2] - u[first]
    fall = u[first] - np.minimum.reduceat(u, bounds)[::2]
    before = np.where(first > 0, u[first] - u[first - 1], u[last] - u[first])
    on = np.where(before > 0.0, rise, np.where(before < 0.0, fall, 0.0)) / np.ptp(u)
    whole = (rise + fall) / np.ptp(u)
    for i in np.flatnonzero((on > FLAT_SHARE / 4) & (whole > FLAT_SHARE)):
        at_end = y[first[i]] in (y.min(), y.max())
        yield Fault("clipped" if at_end else "stuck", int(first[i]), int(last[i]))


def _cut_peaks(u: Floats, y: Floats, runs: tuple[Rows, Rows]) -> Iterator[Fault]:
    """Peaks of a ringing, while u rests, that an end of the sensor's range cuts off.

    Where u moves, equal peaks may be a drive's that clips. Also y that repeats itself ends in equal
    peaks; but then what is beside them is equal, too.
    """
    first, last = (ends[1:-1] for ends in runs)
    still = np.abs(np.diff(u, prepend=u[0])) <= REST_SHARE * np.ptp(u)
    short = last - first < FLAT_SAMPLES - 1
    short &= still[first] & still[last] & still[last + 1]
    first, last = first[short], last[short]
    if first.size < PEAKS_MIN:
        return
    near = PEAK_STEPS * float(np.diff(np.unique(y)).min())
    for up in (y, -y):
        top, highest = up[first], up.max()
        sides = np.column_stack((up[first - 1], up[last + 1]))
        peak = sides.max(axis=1) < top - near
        at_end = peak & (top == highest)
        below = peak & ~at_end & (top >= highest - near)
        count = np.count_nonzero(at_end)
        if count < PEAKS_MIN or np.ptp(sides[at_end], axis=0).min() < near:
            continue
        if np.count_nonzero(below) <= PEAKS_SHARE * count:
            for i in np.flatnonzero(at_end):
                yield Fault("clipped", int(first[i]), int(last[i]))


def _runs(kind: FaultKind, where: NDArray[np.bool_], offset: int) -> Iterator[Fault]:
    """A fault per run of True."""
    edge = np.flatnonzero(np.diff(where, prepend=False, append=False))
    for first, end in edge.reshape(-1, 2):
        yield Fault(kind, int(first) + offset, int(end) - 1 + offset)


def _read_csv(path: Path) -> dict[str, NDArray[Any]]:
    import pandas as pd

    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    if b"\0" in content[:65536]:
        raise InputError(f"{path}: is not a text file; records are CSV")
    try:
        content.decode("utf-8")
    except UnicodeDecodeError as error:
        row = content.count(b"\n", 0, error.start) + 1
        raise InputError(f"{path}: row {row}: is not UTF-8 text; save the file as UTF-8") from error
    header = _header(path, content)
    try:
        frame = pd.read_csv(
            io.BytesIO(content),
            engine="c",
            encoding="utf-8-sig",
            skip_blank_lines=False,
            skipinitialspace=True,
            low_memory=False,
        )
    except (pd.errors.ParserError, pd.errors.EmptyDataError, ValueError) as error:
        raise InputError(f"{path}: {_csv_fault(str(error).strip())}") from error
    if not isinstance(frame.index, pd.RangeIndex):
        raise InputError(f"{path}: row 2: {_LONG_ROW}")
    return _columns(header, frame)


_LONG_ROW = (
    "more cells than the header has columns: write decimal points, not commas, and no comma at "
    "the end of a row"
)


def _csv_fault(told: str) -> str:
    """Where pandas stopped, and why."""
    long = re.search(r"Expected \d+ fields in line (\d+)", told)
    if long:
        return f"row {long[1]}: {_LONG_ROW}"
    open_text = re.search(r"EOF inside string starting at row (\d+)", told)
    if open_text:
        return f"row {int(open_text[1]) + 1}: a quotation mark is opened and not closed: remove it"
    return f"cannot be read as CSV: {told}"


def _header(path: Path, content: bytes) -> list[str]:
    """The names of the first line."""
    line = content.partition(b"\n")[0].partition(b"\r")[0]
    text = line.decode("utf-8-sig").replace("\N{MICRO SIGN}", "u").replace("μ", "u")
    for mark, called in ((";", "semicolons"), ("\t", "tabs")):
        if mark in text:
            raise InputError(
                f"{path}: row 1: columns are separated by {called}: save it with commas between "
                "columns and decimal points"
            )
    names = [cell.strip().strip('"').strip() for cell in text.split(",")]
    if all(n == "" or _is_number(n) for n in names):
        raise InputError(f"{path}: row 1: no header; the first row must read t_s,u_V,y_um")
    twice = [n for n in names if n and names.count(n) > 1]
    if twice:
        raise InputError(f"{path}: row 1: column {twice[0]!r} stands there twice: remove one")
    return names


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _columns(header: list[str], frame: pd.DataFrame) -> dict[str, NDArray[Any]]:
    """The columns by name, without the blank lines at the end of the file."""
    if frame.shape[0] and frame.iloc[-1].isna().all():
        filled = np.flatnonzero(~frame.isna().all(axis=1).to_numpy())
        frame = frame.iloc[: filled[-1] + 1 if filled.size else 0]
    return {name: frame.iloc[:, i].to_numpy() for i, name in enumerate(header)}
