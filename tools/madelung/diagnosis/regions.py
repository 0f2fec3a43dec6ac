"""Regions of time, input, rate, ...: what their axes mean, and what they hold.

What an axis means, row by row of a record, with u its command and h its sample time:

=========== ====== ==============================================================================
time        s      as in the file; `record` names the record
input       V      u
rate        V/s    magnitude of (u[k+1] - u[k-1]) / 2h, one-sided at both ends (numpy.gradient)
branch             rising or falling: the sense in which u arrived at the row, kept while it rests,
                   rising at the start. On the major loop: rising with every turning point but u_min
                   wiped out, or falling from u_max; ends within 2 % of the range count as ends
nesting            turning points that the trajectory holds after the row (mdl_traj.h), u_min too
since_turn  s      since the last row before u reversed; since the start before the first turn
frequency   Hz     periodogram of every record, bad rows zero: energy of the bins in the band; the
                   share of samples is the share of bins (what white noise would have there)
record             the record
=========== ====== ==============================================================================
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from madelung.core import Predictor
from madelung.diagnosis.case import Trace
from madelung.model import Model

Array = NDArray[np.float64]
Axis = Literal["time", "input", "rate", "branch", "nesting", "frequency", "since_turn", "record"]
Side = Literal["above", "below", "between", "at"]

UNITS: dict[Axis, str] = {
    "time": "s",
    "input": "V",
    "rate": "V/s",
    "branch": "",
    "nesting": "turning points",
    "frequency": "Hz",
    "since_turn": "s",
    "record": "",
}
BRANCHES = ("major_rising", "major_falling", "minor_rising", "minor_falling")
END_SHARE = 0.02
"""A turn this close to an end of the range, as share of it, lies on the major loop."""


@dataclass(frozen=True)
class Region:
    """A part of an axis and the share of the gap that it holds.

    Attributes
    ----------
    axis, low, high, unit
        As in diagnosis.schema.json; both ends belong to the region.
    energy_share, enrichment
        See where.py.
    sample_share
        Share of samples (frequency: of bins).
    energy_share_ci95, enrichment_ci95
        By bootstrap over blocks of time.
    noise_share
        Share of the region's energy that the noise floor explains.
    side
        ``above`` (low and more), ``below`` (high and less), ``between``, ``at`` (a category).
    record
        Axis time: the record whose time it is.
    """

    axis: Axis
    low: float | str
    high: float | None
    unit: str
    side: Side
    record: str | None = None
    energy_share: float = 0.0
    enrichment: float = 0.0
    sample_share: float = 0.0
    energy_share_ci95: tuple[float, float] = (0.0, 1.0)
    enrichment_ci95: tuple[float, float] = (0.0, 0.0)
    noise_share: float = 0.0

    def to_json(self) -> dict[str, Any]:
        """The keys of the schema, and more."""
        out: dict[str, Any] = {
            "axis": self.axis,
            "low": self.low,
            "high": self.high,
            "unit": self.unit,
            "side": self.side,
            "energy_share": self.energy_share,
            "energy_share_ci95": list(self.energy_share_ci95),
            "enrichment": self.enrichment,
            "enrichment_ci95": list(self.enrichment_ci95),
            "sample_share": self.sample_share,
            "noise_share": self.noise_share,
            "sentence": sentence(self),
        }
        return out if self.record is None else {**out, "record": self.record}


def sentence(region: Region) -> str:
    """The region in words, with its shares."""
    whole = "spectrum" if region.axis == "frequency" else "samples"
    return (
        f"{_percent(region.energy_share)} of the gap lies {_place(region)}, "
        f"in {_percent(region.sample_share)} of the {whole}"
    )


def _place(region: Region) -> str:
    low, high = region.low, region.high
    if region.axis == "record":
        return f"in the record {low}"
    if region.axis == "branch":
        loop, _, sense = str(low).partition("_")
        loops = "the major loop" if loop == "major" else "minor loops"
        return f"on {sense} branches of {loops}"
    if region.axis == "nesting":
        ends = {"above": f"{low:g} or more", "below": f"at most {high:g}"}
        count = f"{low:g}" if low == high else ends.get(region.side, f"{low:g} to {high:g}")
        one = count in ("1", "at most 1")
        return f"where {count} turning {'point is' if one else 'points are'} held"
    a, b = _quantity(low, region.unit), _quantity(high, region.unit)
    if region.axis == "rate":
        words = {"above": f"faster than {a}", "below": f"slower than {b}"}
        return f"where the command moves {words.get(region.side, f'at {a} to {b}')}"
    if region.axis == "since_turn":
        words = {"above": f"more than {a}", "below": f"within {b}"}
        return f"{words.get(region.side, f'{a} to {b}')} after a turn of the command"
    if region.axis == "time":
        words = {"above": f"after {a}", "below": f"before {b}"}
        return f"{words.get(region.side, f'between {a} and {b}')} in the record {region.record}"
    words = {"above": f"above {a}", "below": f"below {b}"}
    return words.get(region.side, f"between {a} and {b}")


def _percent(share: float) -> str:
    if share > 0.995:
        return "over 99 %"
    if share < 0.001:
        return "under 0.1 %"
    return f"{100 * share:.{0 if share >= 0.0095 else 1}f} %"


def _quantity(value: object, unit: str) -> str:
    assert isinstance(value, int | float)
    if unit == "s" and 0 < abs(value) < 1:
        return f"{1000 * value:.4g} ms"
    return f"{value:.6g} {unit}".rstrip()


# -- axes -------------------------------------------------------------------------------------


def senses(u_V: Array) -> NDArray[np.int64]:
    """+1 where u arrived rising, -1 falling, the last one kept while it rests, (n,)."""
    sign = np.sign(np.diff(u_V)).astype(np.int64)
    moved = np.maximum.accumulate(np.where(sign != 0, np.arange(1, u_V.size), 0))
    arrived: NDArray[np.int64] = np.append(1, sign)[np.append(0, moved)]
    return arrived


def since_turn_s(u_V: Array, step_s: float) -> Array:
    """Time since the last row before u reversed, s, (n,)."""
    sense = senses(u_V)
    row = np.arange(u_V.size)
    turned = np.append(False, sense[1:] != sense[:-1])
    rows = row - np.maximum.accumulate(np.where(turned, row - 1, 0))
    return rows.astype(np.float64) * step_s


def nesting(u_V: Array, ends_V: tuple[float, float]) -> Array:
    """Turning points that the trajectory holds after each row, (n,)."""
    model = Model("madelung", *ends_V, f0=(0.0, 1.0))
    return Predictor(model, "float64").run_with_status(u_V)[2].astype(np.float64)


def branches(u_V: Array, ends_V: tuple[float, float]) -> NDArray[np.int64]:
    """Index into `BRANCHES` of each row, (n,)."""
    low, high = ends_V
    near = END_SHARE * (high - low)
    low, high = low + near, high - near
    held = nesting(np.clip(u_V, low, high), (low, high))
    row = np.arange(u_V.size)
    at_high = np.maximum.accumulate(np.where(u_V >= high, row, -1))
    at_low = np.maximum.accumulate(np.where(u_V <= low, row, -1))
    major = (held <= 1) | ((held == 2) & (at_high > at_low))
    index: NDArray[np.int64] = 2 * (~major).astype(np.int64) + (senses(u_V) < 0)
    return index


def coordinate(axis: Axis, trace: Trace, ends_V: tuple[float, float]) -> Array:
    """Place of each row of a trace on an axis, (n,); branch: index into `BRANCHES`.

    Raises
    ------
    ValueError
        The axis has no place per row (frequency, record).
    """
    if axis == "time":
        return trace.t_s + float(trace.record.t_s[0])
    if axis == "input":
        return trace.u_V
    if axis == "rate":
        return np.abs(np.gradient(trace.u_V, trace.step_s)).astype(np.float64, copy=False)
    if axis == "nesting":
        return nesting(trace.u_V, ends_V)
    if axis == "since_turn":
        return since_turn_s(trace.u_V, trace.step_s)
    if axis == "branch":
        return branches(trace.u_V, ends_V).astype(np.float64)
    raise ValueError(axis)


def part(region: Region, trace: Trace, error_um: Array, ends_V: tuple[float, float]) -> Array:
    """An error of a trace with all that lies outside a region taken away, um, (n,).

    Rows that are not used count as zero. On the axis frequency the region's band is left.
    """
    used = np.where(trace.use, error_um, 0.0)
    if region.axis == "record":
        return used if trace.name == region.low else np.zeros_like(used)
    if region.axis == "time" and trace.name != region.record:
        return np.zeros_like(used)
    if region.axis == "frequency":
        from scipy.fft import irfft, rfft, rfftfreq

        band = holds(region, rfftfreq(used.size, trace.step_s))
        return np.asarray(irfft(rfft(used) * band, used.size), np.float64)
    return np.where(holds(region, coordinate(region.axis, trace, ends_V)), used, 0.0)


def holds(region: Region, values: Array) -> NDArray[np.bool_]:
    """Which values on a region's axis lie in it, (n,)."""
    if region.axis == "branch":
        return np.equal(values, BRANCHES.index(str(region.low)))
    inside = np.ones(values.shape, np.bool_)
    if region.side != "below":
        inside &= values >= float(region.low)
    if region.side != "above":
        assert region.high is not None
        inside &= values <= region.high
    return inside
