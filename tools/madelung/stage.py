"""The simulated actuator: the library of host_sim, its converters and its sensor."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path
from typing import Any, Literal

import cffi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from madelung.errors import InputError
from madelung.records import Record
from madelung.waveforms import Command

Floats = NDArray[np.float64]

_LIBRARY = Path(__file__).parent / "_lib" / "libstage.so"
_HEADERS = Path(__file__).parents[2] / "host_sim"
_MARGIN_SHARE = 0.2
"""The relay grid goes on this far beyond the range at both ends."""
_NOISE_HZ = 200.0
"""`Stage.noise_ar` is the correlation of neighbouring samples at this rate."""
_STUCK_SAMPLES = 20


@dataclass(frozen=True)
class Stage:
    """A simulated piezo stage with its converters and sensor.

    Attributes
    ----------
    u_min_V, u_max_V
        Range of the drive and of the digital-to-analog converter, V.
    stroke_um
        Displacement from u_min to u_max, um.
    hysteresis_share
        Width of the major loop at mid-range over the stroke, 0 to 0.5.
    y_min_um
        Displacement at u_min, um.
    physics
        ``relays``: a Preisach grid; ``slides``: Maxwell elasto-slides. Both symmetric.
    elements
        Levels of the grid over the range (relays are elements^2 / 2), or number of slides.
    dac_bits, adc_bits
        Resolution of the converters; 0: not quantised.
    adc_min_um, adc_max_um
        Range of the sensor and its converter, where the reading saturates; None: from a tenth of
        the stroke below y_min_um to a quarter above the stroke's end.
    noise_um
        Rms of the sensor's noise, um.
    noise_ar
        Colour of the noise, 0 (white) to below 1: correlation of samples 5 ms apart. The spectrum
        in Hz does not depend on the rate.
    offset_um
        Offset of the sensor, um.
    drop_share, stuck_share
        Share of the rows that are missing, and in which the reading is stuck, 0 to 0.5.

    Raises
    ------
    InputError
        A value is out of its range.
    """

    u_min_V: float = 0.0
    u_max_V: float = 40.0
    stroke_um: float = 30.0
    hysteresis_share: float = 0.13
    y_min_um: float = 0.0
    physics: Literal["relays", "slides"] = "relays"
    elements: int = 200
    dac_bits: int = 12
    adc_bits: int = 12
    adc_min_um: float | None = None
    adc_max_um: float | None = None
    noise_um: float = 0.01
    noise_ar: float = 0.0
    offset_um: float = 0.0
    drop_share: float = 0.0
    stuck_share: float = 0.0

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        limits: dict[str, tuple[float, float]] = {
            "stroke_um": (1e-3, 1e4),
            "hysteresis_share": (0.0, 0.3),
            "elements": (10, 1000),
            "dac_bits": (0, 24),
            "adc_bits": (0, 24),
            "noise_um": (0.0, 1e4),
            "noise_ar": (0.0, 0.9999),
            "drop_share": (0.0, 0.5),
            "stuck_share": (0.0, 0.5),
        }
        for name, (low, high) in limits.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise InputError(f"{name} is {value:g}: it must lie between {low:g} and {high:g}")
        if not self.u_max_V > self.u_min_V:
            raise InputError(f"u_max ({self.u_max_V:g} V) must be above u_min ({self.u_min_V:g} V)")
        if not self.reading_um[1] > self.reading_um[0]:
            raise InputError("adc_max_um must be above adc_min_um")
        if self.physics not in ("relays", "slides"):
            raise InputError(f"physics is {self.physics!r}: it must be 'relays' or 'slides'")

    @property
    def range_V(self) -> float:
        """Width of the drive's range, V."""
        return self.u_max_V - self.u_min_V

    @property
    def reading_um(self) -> tuple[float, float]:
        """Lowest and highest reading of the sensor, um."""
        low, high = self.adc_min_um, self.adc_max_um
        return (
            self.y_min_um - 0.1 * self.stroke_um if low is None else low,
            self.y_min_um + 1.25 * self.stroke_um if high is None else high,
        )


def load_stage(path: Path) -> Stage:
    """Read a `Stage` from a JSON object whose keys are its attributes.

    Raises
    ------
    InputError
        The file cannot be read, is not JSON, or has an unknown key or a bad value.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise InputError(f"{path}: is not a JSON file: {error}") from error
    known = {f.name for f in fields(Stage)}
    if not isinstance(data, dict) or not data.keys() <= known:
        raise InputError(
            f"{path}: a JSON object with some of these keys is expected: {', '.join(sorted(known))}"
        )
    try:
        return Stage(**data)
    except (InputError, TypeError) as error:
        raise InputError(f"{path}: {error}") from error


@cache
def load_library() -> tuple[Any, Any]:
    """The cffi instance and the library of host_sim.

    Raises
    ------
    InputError
        The library has not been built.
    """
    if not _LIBRARY.exists():
        raise InputError(f"{_LIBRARY} is missing: run `make` in the project's folder first")
    ffi = cffi.FFI()
    header = (_HEADERS / "hysteresis.h").read_text(encoding="utf-8")
    ffi.cdef("\n".join(line for line in header.splitlines() if not line.startswith("#")))
    return ffi, ffi.dlopen(str(_LIBRARY))


class Hysteresis:
    """The hysteresis of a stage, with its state: at rest at u_min, after a swing to u_max.

    Parameters
    ----------
    stage
        Its range, stroke, loop width and kind of physics are used.
    """

    def __init__(self, stage: Stage) -> None:
        self._ffi, self._lib = load_library()
        n = stage.elements
        cell = stage.range_V / n
        loss, slope = _loss(stage)
        if stage.physics == "slides":
            reach = self._array((np.arange(n) + 0.5) * cell / 2.0)
            made = self._lib.hysteresis_new_slides(
                n, self._pointer(reach), self._pointer(loss), slope + loss.sum()
            )
        else:
            beyond = int(np.ceil(_MARGIN_SHARE * n))
            levels = n + 2 * beyond
            weight = self._array(_relay_weights(loss * cell, levels))
            low = stage.u_min_V - beyond * cell
            made = self._lib.hysteresis_new_relays(low, cell, levels, self._pointer(weight), slope)
        if made == self._ffi.NULL:
            raise MemoryError("hysteresis")
        self._handle = self._ffi.gc(made, self._lib.hysteresis_free)
        self._shift_um = 0.0
        self._shift_um = stage.y_min_um - float(self.run([stage.u_max_V, stage.u_min_V])[1])

    def run(self, u_V: ArrayLike) -> Floats:
        """Displacement in um, shape (n,), for a drive in V, shape (n,); the state goes on."""
        u = self._array(u_V)
        y = np.empty_like(u)
        self._lib.hysteresis_run(
            self._handle, self._pointer(u), self._ffi.NULL, self._pointer(y), u.size
        )
        return y + self._shift_um

    def _array(self, values: ArrayLike) -> Floats:
        return np.ascontiguousarray(values, np.float64).reshape(-1)

    def _pointer(self, array: Floats) -> Any:
        return self._ffi.from_buffer("double[]", array)


def _loss(stage: Stage) -> tuple[Floats, float]:
    """What elements of growing width hold back (um / V each), and the reversible slope (um / V).

    The density over the element's width r falls as exp(-r / range), as it does in real ceramics:
    the loop's relative width then grows a little slower than the swing.
    """
    n = stage.elements
    width = (np.arange(n) + 0.5) / n
    density = np.exp(-width)

    def given_back(x: float) -> float:
        return float(np.sum(density * np.maximum(x - width, 0.0)))

    bend = given_back(1.0) - 2.0 * given_back(0.5)
    scale = stage.hysteresis_share * stage.stroke_um / bend
    loss = scale * density / stage.range_V
    slope = (stage.stroke_um - scale * given_back(1.0)) / stage.range_V
    if slope <= 0.0:
        raise InputError(
            f"hysteresis_share is {stage.hysteresis_share:g}: too wide for this stroke"
        )
    return loss, slope


def _relay_weights(loss_um: Floats, levels: int) -> Floats:
    """Weights of a grid, shape (levels, levels), that depend on the relay's width alone.

    A relay of k cells stands for the widths within half a cell; the narrowest for half of that.
    """
    halves = np.append(loss_um, 0.0) / 2.0
    by_width = np.zeros(levels)
    by_width[: halves.size] = halves + np.insert(halves[:-1], 0, 0.0)
    i, j = np.indices((levels, levels))
    return np.where(j <= i, by_width[np.abs(i - j)], 0.0)


def quantise(values: Floats, low: float, high: float, bits: int) -> Floats:
    """Values rounded to the codes of a converter (bits 0: not rounded), saturated at its ends."""
    inside = np.clip(values, low, high)
    if bits == 0:
        return inside
    step = (high - low) / (2**bits - 1)
    return np.asarray(low + step * np.rint((inside - low) / step))


def simulate(stage: Stage, command: Command, seed: int = 0) -> Record:
    """A record of a stage that follows a command.

    The record's u is what the converter was told, rounded to its codes. The stage rests at the
    first voltage, reached from u_min without a turn. The same arguments give the same record.

    Raises
    ------
    InputError
        The command leaves the stage's range.
    """
    t = command.time_s
    u = drive(stage, command, t)
    y = Hysteresis(stage).run(u)
    return measure(stage, t, u, y, seed)


def drive(stage: Stage, command: Command, t_s: Floats) -> Floats:
    """What the digital-to-analog converter gives at times in s: V, shape as t_s."""
    slack = 1e-9 * stage.range_V
    if command.u_min_V < stage.u_min_V - slack or command.u_max_V > stage.u_max_V + slack:
        raise InputError(
            f"the command goes from {command.u_min_V:g} to {command.u_max_V:g} V, the stage is "
            f"driven from {stage.u_min_V:g} to {stage.u_max_V:g} V"
        )
    return quantise(command.at(t_s), stage.u_min_V, stage.u_max_V, stage.dac_bits)


def measure(stage: Stage, t_s: Floats, u_V: Floats, y_um: Floats, seed: int) -> Record:
    """The record that the sensor, its converter and the logger make of a displacement in um."""
    rate_hz = 1.0 / (t_s[1] - t_s[0])
    noise = stage.noise_um * _noise(t_s.size, stage.noise_ar ** (_NOISE_HZ / rate_hz), seed)
    reading = quantise(y_um + noise + stage.offset_um, *stage.reading_um, stage.adc_bits)
    reading = reading[_held_from(t_s.size, stage.stuck_share, seed)]
    kept = np.random.default_rng([seed, 4]).uniform(size=t_s.size) >= stage.drop_share
    kept[0] = True
    return Record(
        name="simulated",
        t_s=np.round(t_s[kept], 6),
        u_V=np.round(u_V[kept], 6),
        y=np.round(reading[kept], 6),
    )


def _noise(n: int, ar: float, seed: int) -> Floats:
    """First-order autoregressive noise of rms 1, stationary from the start, shape (n,)."""
    from scipy.signal import lfilter

    white = np.random.default_rng([seed, 2]).standard_normal(n)
    white[1:] *= np.sqrt(1.0 - ar**2)
    return np.asarray(lfilter([1.0], [1.0, -ar], white))


def _held_from(n: int, share: float, seed: int) -> NDArray[np.int64]:
    """Which sample's reading each sample shows: its own, or where it stuck; shape (n,)."""
    starts = np.random.default_rng([seed, 3]).uniform(size=n) < share / _STUCK_SAMPLES
    own = np.arange(n)
    last = np.maximum.accumulate(np.where(starts, own, -_STUCK_SAMPLES))
    return np.where(own - last < _STUCK_SAMPLES, np.maximum(last, 0), own)
