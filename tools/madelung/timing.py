"""Timing from a capture of the firmware's pin, which is high while a sample is computed.

The paper measures so (Cao & Li 2019, section 3.1 and Fig. 8).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from madelung.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Bools = NDArray[np.bool_]

SCHEMA = "madelung.timing/1"
CYCLES_MIN = 3
PAPER_LINE_US = (0.57, 0.19)
"""Fig. 8's line: us at p = 0, and per comparison, at 150 MHz."""
PAPER_TEXT_US = {12: 2.80, 4: 1.23}
"""What the text of section 3 gives for p; the line gives 2.85 and 1.33 there."""
_PER_SECOND = {
    "s": 1.0,
    "ms": 1e3,
    "us": 1e6,
    "µs": 1e6,
    "μs": 1e6,
    "ns": 1e9,
    "ps": 1e12,
    "fs": 1e15,
}
_MISSED = 1.5
"""Cycles are missing where a period is longer than this many usual ones."""


@dataclass(frozen=True)
class Capture:
    """The pin over the cycles that were captured from edge to edge.

    Attributes
    ----------
    name
        Where it came from, for messages.
    rises, falls
        Times of both edges of every cycle, shape (n,), in the capture's unit.
    per_second
        How many of the unit a second has.
    resolution_s
        Times are known to this, s; 0 if the capture does not say.
    """

    name: str
    rises: Floats
    falls: Floats
    per_second: float = 1.0
    resolution_s: float = 0.0

    @property
    def rises_s(self) -> Floats:
        """Times of the rising edges, s, shape (n,)."""
        return self.rises / self.per_second


@dataclass(frozen=True)
class Timing:
    """What a capture tells.

    Attributes
    ----------
    capture
        What it was computed from.
    period_s
        The usual time between two cycles, s: the median.
    jitter_rms_s, jitter_peak_s
        Standard deviation of the periods, and the largest distance from the usual one, s; periods
        in which cycles are missing left out.
    missed
        Cycles that should have been between those captured.
    inputs
        Inputs of the cycles, shape (n,), and their unit (``code`` or ``V``); None without a record.
    p
        Comparisons that the search of the paper's Fig. 2 makes on them, shape (n,), or None.
    """

    capture: Capture
    period_s: float
    jitter_rms_s: float
    jitter_peak_s: float
    missed: int
    inputs: tuple[Floats, str] | None = None
    p: Ints | None = None

    @property
    def computation_s(self) -> Floats:
        """Time for which the pin is high in every cycle, s, shape (n,)."""
        return (self.capture.falls - self.capture.rises) / self.capture.per_second

    @property
    def worst(self) -> int:
        """The first cycle of the longest computation."""
        return int(self.computation_s.argmax())

    @property
    def maximum_s(self) -> float:
        """Maximum computation time, s."""
        return float(self.computation_s.max())

    @property
    def line_s(self) -> tuple[float, float] | None:
        """Least-squares line of the cycles with p > 0: s at p = 0, and s per comparison."""
        if self.p is None or np.unique(self.p[self.p > 0]).size < 2:
            return None
        searched = self.p > 0
        slope, start = np.polyfit(self.p[searched], self.computation_s[searched], 1)
        return float(start), float(slope)

    def by_p(self) -> pd.DataFrame:
        """Cycles, mean and longest computation (s) for every p."""
        import pandas as pd

        frame = pd.DataFrame({"p": self.p, "s": self.computation_s})
        return frame.groupby("p")["s"].agg(cycles="size", mean_s="mean", max_s="max").reset_index()

    def to_json(self, budget_s: float | None = None) -> dict[str, Any]:
        """The content of timing.json."""
        told: dict[str, Any] = {
            "schema": SCHEMA,
            "capture": Path(self.capture.name).name,
            "resolution_s": self.capture.resolution_s,
            "cycles": self.capture.rises.size,
            "missed": self.missed,
            "period_s": self.period_s,
            "jitter_rms_s": self.jitter_rms_s,
            "jitter_peak_s": self.jitter_peak_s,
            "computation_s": {
                "least": float(self.computation_s.min()),
                "mean": float(self.computation_s.mean()),
                "most": self.maximum_s,
            },
            "worst": {"cycle": self.worst, "at_s": float(self.capture.rises_s[self.worst])},
            "paper": {
                "line_us": dict(zip(("at_p_0", "per_comparison"), PAPER_LINE_US, strict=True)),
                "text_us": {str(p): us for p, us in PAPER_TEXT_US.items()},
            },
        }
        if self.inputs is not None:
            values, unit = self.inputs
            told["worst"][f"input_{unit}"] = float(values[self.worst])
            if self.worst > 0:
                told["worst"][f"input_before_{unit}"] = float(values[self.worst - 1])
        if self.p is not None:
            told["worst"]["p"] = int(self.p[self.worst])
            told["by_p"] = self.by_p().to_dict("records")
        if self.line_s is not None:
            told["line_s"] = dict(zip(("at_p_0", "per_comparison"), self.line_s, strict=True))
        if budget_s is not None:
            told["budget"] = {"s": budget_s, "fits": self.maximum_s <= budget_s}
        return told


def analyse(capture: Capture, inputs: tuple[Floats, str] | None = None) -> Timing:
    """Periods, and with the inputs of the cycles their comparisons.

    Parameters
    ----------
    capture
        At least three cycles.
    inputs
        One input per cycle and its unit, as `read_inputs` gives them.

    Raises
    ------
    InputError
        There are too few cycles, or not as many inputs.
    """
    n = capture.rises.size
    if n < CYCLES_MIN:
        raise InputError(
            f"{capture.name}: holds {n} whole cycles of the pin, at least {CYCLES_MIN} are needed"
        )
    periods = np.diff(capture.rises) / capture.per_second
    usual = float(np.median(periods))
    whole = periods <= _MISSED * usual
    off = periods[whole] - usual
    return Timing(
        capture,
        usual,
        float(np.sqrt(np.mean(off**2))),
        float(np.abs(off).max()),
        int(np.sum(np.rint(periods[~whole] / usual) - 1)),
        inputs,
        None if inputs is None else _comparisons(capture, *inputs),
    )


def _comparisons(capture: Capture, values: Floats, unit: str) -> Ints:
    """p of every cycle: the inputs, the lowest voltage as u_min, replayed through the core."""
    from madelung.core import Predictor
    from madelung.model import Model
    from madelung.reproduce import searched

    n = capture.rises.size
    if values.size != n:
        raise InputError(
            f"{capture.name}: holds {n} whole cycles, the record {values.size} inputs: "
            "give the inputs of these cycles, one each"
        )
    x = values - (0.0 if unit == "code" else values.min())
    if not x.any():
        return np.zeros(n, np.intp)
    straight = Model("madelung", 0.0, float(x.max()), f0=(0.0, 1.0))
    count = Predictor(straight, "float64").run_with_status(x)[2]
    return searched(x, count.astype(np.intp))


def summary(found: Timing, budget_s: float | None = None) -> Iterator[str]:
    """The result in lines for a reader, the paper's beside it."""
    c = found.computation_s
    known = f", to {_us(found.capture.resolution_s)} us" if found.capture.resolution_s else ""
    yield (
        f"{c.size} cycles, period {_us(found.period_s)} us, {found.missed} cycles missed, "
        f"jitter {_us(found.jitter_rms_s)} us rms and {_us(found.jitter_peak_s)} us at most"
    )
    yield (f"computation: {_us(c.min())} to {_us(c.max())} us, mean {_us(c.mean())} us{known}")
    at = f"cycle {found.worst} at {found.capture.rises_s[found.worst]:.6f} s"
    if found.inputs is not None and found.p is not None:
        values, unit = found.inputs
        before = f" after {values[found.worst - 1]:g}" if found.worst > 0 else ""
        at += f", input {values[found.worst]:g} {unit}{before}, p = {found.p[found.worst]}"
    yield f"maximum computation time {_us(found.maximum_s)} us: {at}"
    if found.line_s is not None:
        yield f"line: {line_text(found.line_s)}"
    start, per = PAPER_LINE_US
    text = ", ".join(f"{us:.2f} us at p = {p}" for p, us in PAPER_TEXT_US.items())
    yield f"paper, F28335 at 150 MHz: line {start} + {per} p us; its text gives {text}"
    if budget_s is not None:
        fits = "fits in" if found.maximum_s <= budget_s else "does not fit in"
        yield f"the maximum {fits} the budget of {_us(budget_s)} us"


def line_text(line_s: tuple[float, float]) -> str:
    """A line over p for a reader: ``0.57 + 0.19 p us``."""
    start, per = line_s
    return f"{_us(start)} {'-' if per < 0.0 else '+'} {_us(abs(per))} p us"


def _us(seconds: float) -> str:
    return f"{seconds * 1e6:.4g}"


def parse_time(text: str) -> float:
    """Seconds of a time with its unit, such as ``10us``.

    Raises
    ------
    InputError
        It is not a positive number followed by s, ms, us or ns.
    """
    match = re.fullmatch(r"\s*([0-9.eE+-]+)\s*([a-zµμ]+)\s*", text)
    try:
        seconds = float(match[1]) / _PER_SECOND[match[2]] if match else 0.0
    except (ValueError, KeyError):
        seconds = 0.0
    if not 0.0 < seconds < np.inf:
        raise InputError(f"{text!r} is not a time: write it like 10us, 0.5ms or 800ns")
    return seconds


# -- Captures -------------------------------------------------------------------------------------


def read_capture(path: Path, pin: str | None = None) -> Capture:
    """Read a VCD file (sigrok, PulseView, the emulated board), or a CSV file of Saleae's Logic.

    Parameters
    ----------
    path
        Read as VCD when its name ends in .vcd, else as CSV.
    pin
        Name of the channel; needed if there are several.

    Raises
    ------
    InputError
        It cannot be read, or has no such channel, a time unit that is not known, or no edges.
    """
    try:
        _check_end(path)
        if path.suffix.lower() == ".vcd":
            times, levels, per_second, resolution_s = _read_vcd(path, pin)
        else:
            times, levels, per_second, resolution_s = _read_csv(path, pin)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    if np.any(np.diff(times) < 0.0):
        raise InputError(f"{path}: time runs back in it")
    changed = np.flatnonzero(levels[1:] != levels[:-1]) + 1
    if changed.size == 0:
        state = "high" if levels.size and levels[0] else "low"
        raise InputError(f"{path}: the pin has no edges, it is {state} all the time")
    edges = times[changed]
    first = 0 if levels[changed[0]] else 1  # a capture may begin within a cycle, and end in one
    whole = (edges.size - first) // 2
    pairs = edges[first : first + 2 * whole].reshape(-1, 2)
    return Capture(str(path), pairs[:, 0], pairs[:, 1], per_second, resolution_s)


def _check_end(path: Path) -> None:
    with path.open("rb") as file:
        file.seek(max(file.seek(0, 2) - 1, 0))
        if file.read(1) not in (b"\n", b"\r", b""):
            raise InputError(f"{path}: is cut off: its last line does not end; capture it again")


def _read_vcd(path: Path, pin: str | None) -> tuple[Floats, Bools, float, float]:
    """Times and levels of the changes of a pin, the unit per second, and the resolution (s)."""
    from vcd.reader import TokenKind, VCDParseError, tokenize

    now, times, levels = 0, [], []
    with path.open("rb") as stream:
        tokens: Iterator[Any] = tokenize(stream)
        try:
            names, magnitude, per_second = _vcd_head(tokens)
            chosen = names[_choose(path, list(names), pin)]
            for token in tokens:
                if token.kind is TokenKind.CHANGE_TIME:
                    now = token.data
                elif token.kind is TokenKind.CHANGE_SCALAR and token.data.id_code == chosen:
                    times.append(now)
                    levels.append(token.data.value)
        except (VCDParseError, ValueError, IndexError, UnicodeDecodeError) as error:
            raise InputError(f"{path}: is not a whole VCD file: {error}") from error
    if magnitude == 0:
        raise InputError(f"{path}: has no $timescale: its times have no unit")
    scaled = np.array(times, np.float64) * magnitude
    return *_known(path, scaled, np.array(levels, "U1")), per_second, magnitude / per_second


def _vcd_head(tokens: Iterator[Any]) -> tuple[dict[str, str], int, float]:
    """Identifiers of the one-bit channels by full name, and the timescale (0: there is none)."""
    from vcd.reader import TokenKind

    names: dict[str, str] = {}
    scope: list[str] = []
    magnitude, per_second = 0, 1.0
    for token in tokens:
        if token.kind is TokenKind.ENDDEFINITIONS:
            return names, magnitude, per_second
        if token.kind is TokenKind.TIMESCALE:
            magnitude = int(token.data.magnitude)
            per_second = _PER_SECOND[token.data.unit.value]
        elif token.kind is TokenKind.SCOPE:
            scope.append(token.data.ident)
        elif token.kind is TokenKind.UPSCOPE:
            scope.pop()
        elif token.kind is TokenKind.VAR and token.data.size == 1:
            names[".".join([*scope, token.data.reference])] = token.data.id_code
    raise ValueError("its definitions do not end")


def _read_csv(path: Path, pin: str | None) -> tuple[Floats, Bools, float, float]:
    """The same of a CSV file: a column of times, and one of levels for every channel."""
    import pandas as pd

    try:
        frame = pd.read_csv(path, skipinitialspace=True, index_col=False, dtype=str)
    except (pd.errors.ParserError, pd.errors.EmptyDataError, ValueError) as error:
        raise InputError(f"{path}: cannot be read as CSV: {str(error).strip()}") from error
    header = [str(name).strip() for name in frame.columns]
    clock = re.fullmatch(r"time\s*[\[(](\w+)[\])]", header[0], re.IGNORECASE)
    if clock is None or clock[1] not in _PER_SECOND:
        raise InputError(
            f"{path}: its first column is {header[0]!r}; a time with its unit is expected, "
            "such as 'Time [s]', as Saleae's Logic exports digital data"
        )
    channel = 1 + header[1:].index(_choose(path, header[1:], pin))
    times = pd.to_numeric(frame.iloc[:, 0], errors="coerce").to_numpy(np.float64)
    levels = frame.iloc[:, channel].fillna("").str.strip().to_numpy("U8")
    broken = np.flatnonzero(~np.isfinite(times) | (levels == ""))
    if broken.size:
        raise InputError(f"{path}: row {broken[0] + 2}: is cut off, or its time is no number")
    return *_known(path, times, levels), _PER_SECOND[clock[1]], 0.0


def _known(path: Path, times: Floats, levels: NDArray[np.str_]) -> tuple[Floats, Bools]:
    """Times and levels from the first on that is known."""
    known = np.isin(levels, ("0", "1"))
    first = int(known.argmax()) if known.any() else levels.size
    if not known[first:].all():
        at = times[first:][~known[first:]][0]
        raise InputError(f"{path}: the pin is neither 0 nor 1 at {at:.15g} of its units of time")
    return times[first:], levels[first:] == "1"


def _choose(path: Path, names: list[str], pin: str | None) -> str:
    """The channel that is asked for, by its full name or the last part of it; or the only one."""
    if pin is None and len(names) == 1:
        return names[0]
    fitting = [name for name in names if pin in (name, name.rpartition(".")[2])]
    if len(fitting) == 1:
        return fitting[0]
    listed = ", ".join(names) or "none"
    if pin is None or fitting:
        raise InputError(f"{path}: name the pin's channel with --pin; channels: {listed}")
    raise InputError(f"{path}: has no channel {pin!r}; channels: {listed}")


def read_inputs(path: Path) -> tuple[Floats, str]:
    """The inputs of the captured cycles: a CSV file with a column ``code``, or a record's u.

    Returns
    -------
    Inputs, shape (n,), and their unit: ``code`` or ``V``.

    Raises
    ------
    InputError
        The file cannot be read, or holds neither.
    """
    from madelung.records import read_record

    with path.open(encoding="utf-8", errors="replace") as file:
        header = [name.strip() for name in file.readline().lstrip("\ufeff").split(",")]
    if "code" not in header:
        return read_record(path).u_V, "V"
    import pandas as pd

    column = pd.read_csv(path, skipinitialspace=True)["code"]
    codes = pd.to_numeric(column, errors="coerce").to_numpy(np.float64)
    broken = np.flatnonzero(~(codes >= 0.0) | (codes != np.rint(codes)))
    if broken.size:
        raise InputError(f"{path}: row {broken[0] + 2}: code is not a whole number from 0 on")
    return codes, "code"
