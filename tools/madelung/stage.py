"""The simulated actuator: the library of host_sim, its converters and its sensor."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import Any, Literal

import cffi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from madelung.campaigns import Campaign, Commands, bias_V, commands, fast_V_per_s, highest_V_per_s
from madelung.errors import InputError
from madelung.files import read_json, write_atomically
from madelung.records import Record, write_record
from madelung.sim_effects import (
    OUTSIDE,
    VOCABULARY,
    Effects,
    Parameters,
    Scene,
    draw_effects,
)
from madelung.waveforms import Command

Floats = NDArray[np.float64]

_LIBRARY = Path(__file__).parent / "_lib" / "libstage.so"
_HEADERS = Path(__file__).parents[2] / "host_sim"
_MARGIN_SHARE = 0.2
"""The relay grid goes on this far beyond the range at both ends."""
_NOISE_HZ = 200.0
"""`Stage.noise_ar` is the correlation of neighbouring samples at this rate."""
_STUCK_SAMPLES = 20
_FINE_HZ = 20_000.0
_STEPS_PER_PERIOD = 25.0
"""Steps of the simulation: so many a second, and in the period of the fastest pole."""
_VELOCITY_TAU_S = 1e-3
_HEATING_TAU_S = 6.0
_BOUC_WEN_BETA = 2.0
"""Of Bouc-Wen's law, per range of the drive: the loop bends all over the range."""
_PINK_HZ = np.geomspace(0.05, 1500.0, 10)
"""Corners of the poles whose noises add up to 1 / f."""
_CREEP_TAU_S = np.geomspace(0.03, 1000.0, 37)
_NO_EFFECTS = Effects()


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
        ``relays``: a Preisach grid; ``slides``: Maxwell elasto-slides, or plays. Both symmetric.
    loop_decay, loop_heap, loop_dead_zone
        How much loops of each width add: exp(-loop_decay * width over range), as in real
        ceramics, and a heap at 0.4 of the range; none narrower than the dead zone, share of the
        range.
    elements
        Levels of the grid over the range (relays are elements^2 / 2), or number of slides.
    dac_bits, adc_bits
        Resolution of the converters; 0: not quantised.
    adc_min_um, adc_max_um
        Range of the sensor and its converter, where the reading saturates; None: headroom_share
        of the stroke above its end, and half of that below y_min_um.
    headroom_share
        See above.
    noise_um
        Rms of the sensor's noise, um.
    noise_ar
        Colour of the noise, 0 (white) to below 1: correlation of samples 5 ms apart. The spectrum
        in Hz does not depend on the rate.
    noise_pink
        Noise whose power goes as 1 / f from 0.05 Hz to 1.5 kHz, instead.
    offset_um
        Offset of the sensor, um.
    between
        What the drive does between the samples of a record when more than the hysteresis is
        simulated: ``linear``, or the ``waveform`` itself, when the logger is slower than the drive
        (turns then lie between samples).
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
    loop_decay: float = 1.0
    loop_heap: float = 0.0
    loop_dead_zone: float = 0.0
    elements: int = 200
    dac_bits: int = 12
    adc_bits: int = 12
    adc_min_um: float | None = None
    adc_max_um: float | None = None
    headroom_share: float = 0.25
    noise_um: float = 0.01
    noise_ar: float = 0.0
    noise_pink: bool = False
    offset_um: float = 0.0
    between: Literal["linear", "waveform"] = "linear"
    drop_share: float = 0.0
    stuck_share: float = 0.0

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        limits: dict[str, tuple[float, float]] = {
            "stroke_um": (1e-3, 1e4),
            "hysteresis_share": (0.0, 0.3),
            "loop_decay": (0.0, 10.0),
            "loop_heap": (0.0, 10.0),
            "loop_dead_zone": (0.0, 0.4),
            "elements": (10, 1000),
            "dac_bits": (0, 24),
            "adc_bits": (0, 24),
            "headroom_share": (0.0, 10.0),
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
        if self.between not in ("linear", "waveform"):
            raise InputError(f"between is {self.between!r}: it must be 'linear' or 'waveform'")

    @property
    def range_V(self) -> float:
        """Width of the drive's range, V."""
        return self.u_max_V - self.u_min_V

    @property
    def reading_um(self) -> tuple[float, float]:
        """Lowest and highest reading of the sensor, um."""
        low, high = self.adc_min_um, self.adc_max_um
        headroom = self.headroom_share * self.stroke_um
        return (
            self.y_min_um - headroom / 2.0 if low is None else low,
            self.y_min_um + self.stroke_um + headroom if high is None else high,
        )

    @property
    def adc_step_um(self) -> float:
        """Step of the sensor's converter, um; of one of 16 bits where it is not quantised."""
        low, high = self.reading_um
        return float((high - low) / (2 ** (self.adc_bits or 16) - 1))


def load_stage(path: Path) -> Stage:
    """Read a `Stage` from a JSON object whose keys are its attributes.

    Raises
    ------
    InputError
        The file cannot be read, is not JSON, or has an unknown key or a bad value.
    """
    data = read_json(path)
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
    for name in ("hysteresis.h", "bouc_wen.h", "path.h"):
        header = (_HEADERS / name).read_text(encoding="utf-8")
        ffi.cdef("\n".join(line for line in header.splitlines() if not line.startswith("#")))
    return ffi, ffi.dlopen(str(_LIBRARY))


def _array(values: ArrayLike) -> Floats:
    return np.ascontiguousarray(values, np.float64).reshape(-1)


def _pointer(array: Floats) -> Any:
    return load_library()[0].from_buffer("double[]", array)


class Hysteresis:
    """The hysteresis of a stage, with its state: at rest at u_min, after a swing to u_max.

    Parameters
    ----------
    stage
        Its range, stroke, loop width and kind of physics are used.
    effects
        Asymmetry and non-Masing densities, for which the relays are taken.
    """

    def __init__(self, stage: Stage, effects: Effects = _NO_EFFECTS) -> None:
        ffi, self._lib = load_library()
        n = stage.elements
        cell = stage.range_V / n
        loss, slope = _loss(stage, 1.0 - effects.bouc_wen)
        self._bouc_wen = _BoucWen(stage, effects) if effects.bouc_wen else None
        bent = effects.density_odd or effects.density_even or effects.density_core
        if stage.physics == "slides" and not bent:
            reach = _array((np.arange(n) + 0.5) * cell / 2.0)
            made = self._lib.hysteresis_new_slides(
                n, _pointer(reach), _pointer(loss), slope + loss.sum()
            )
        else:
            beyond = int(np.ceil(_MARGIN_SHARE * n))
            weight = _array(_relay_weights(loss * cell, n, beyond, effects))
            low = stage.u_min_V - beyond * cell
            made = self._lib.hysteresis_new_relays(
                low, cell, n + 2 * beyond, _pointer(weight), slope
            )
        if made == ffi.NULL:
            raise MemoryError("hysteresis")
        self._handle = ffi.gc(made, self._lib.hysteresis_free)
        self._shift_um = 0.0
        self._shift_um = stage.y_min_um - float(self.run([stage.u_max_V, stage.u_min_V])[1])

    def run(self, u_V: ArrayLike, widen_V: Floats | None = None) -> Floats:
        """Displacement in um, shape (n,), for a drive in V, shape (n,); the state goes on.

        widen_V, shape (n,), V: how much later elements switch in both directions.
        """
        u = _array(u_V)
        y = np.empty_like(u)
        widen = load_library()[0].NULL if widen_V is None else _pointer(_array(widen_V))
        self._lib.hysteresis_run(self._handle, _pointer(u), widen, _pointer(y), u.size)
        if self._bouc_wen is not None:
            y += self._bouc_wen.run(u)
        return y + self._shift_um


class _BoucWen:
    """Bouc-Wen's part of a stage's hysteresis; what it adds at the ends of the range is alike."""

    def __init__(self, stage: Stage, effects: Effects) -> None:
        self._range_V = stage.range_V
        self._power = effects.bouc_wen_power
        self._beta = _BOUC_WEN_BETA / stage.range_V**self._power
        self._gamma = effects.bouc_wen_gamma * self._beta
        self._state = np.array([stage.u_min_V, 0.0])
        self._um_per_V, self._slope = 1.0, 0.0
        low, high, middle = stage.u_min_V, stage.u_max_V, 0.5 * (stage.u_min_V + stage.u_max_V)
        self.run(np.tile([high, low], 50))
        up, top, down, bottom = self.run([middle, high, middle, low])
        width_um = effects.bouc_wen * stage.hysteresis_share * stage.stroke_um
        self._um_per_V = width_um / (down - up)
        self._slope = (top - bottom) / stage.range_V

    def run(self, u_V: ArrayLike) -> Floats:
        u = _array(u_V)
        z = np.empty_like(u)
        load_library()[1].bouc_wen_run(
            _pointer(u),
            u.size,
            self._power,
            self._beta,
            self._gamma,
            _pointer(self._state),
            _pointer(z),
        )
        return np.asarray(self._um_per_V * (z - self._slope * u))


def _loss(stage: Stage, share: float = 1.0) -> tuple[Floats, float]:
    """What elements of growing width hold back (um / V each), and the reversible slope (um / V).

    They carry this share of the loop's width.
    """
    n = stage.elements
    width = (np.arange(n) + 0.5) / n
    heap = np.exp(-(((width - 0.4) / 0.12) ** 2) / 2.0)
    density = np.exp(-stage.loop_decay * width) + stage.loop_heap * heap
    density[width < stage.loop_dead_zone] = 0.0

    def given_back(x: float) -> float:
        return float(np.sum(density * np.maximum(x - width, 0.0)))

    bend = given_back(1.0) - 2.0 * given_back(0.5)
    scale = share * stage.hysteresis_share * stage.stroke_um / bend
    loss = scale * density / stage.range_V
    slope = (stage.stroke_um - scale * given_back(1.0)) / stage.range_V
    if slope <= 0.0:
        raise InputError(
            f"hysteresis_share is {stage.hysteresis_share:g}: too wide for this stroke"
        )
    return loss, slope


def _relay_weights(loss_um: Floats, n: int, beyond: int, effects: Effects) -> Floats:
    """Weights of a grid, shape (levels, levels), for n levels in the range and some beyond.

    They depend on the relay's width alone - Madelung's rules then hold -, but for what the
    effects' densities add. A relay of k cells stands for the widths within half a cell; the
    narrowest for half of that.
    """
    halves = np.append(loss_um, 0.0) / 2.0
    by_width = np.zeros(n + 2 * beyond)
    by_width[: halves.size] = halves + np.insert(halves[:-1], 0, 0.0)
    i, j = np.indices((by_width.size, by_width.size))
    weights = np.where(j <= i, by_width[np.abs(i - j)], 0.0)
    middle = np.clip((i + j + 1 - 2 * beyond) / n - 1.0, -1.0, 1.0)
    width = (i - j) / n
    density = (
        1.0
        + effects.density_odd * np.tanh(2.0 * middle)
        + effects.density_even * np.cos(np.pi * middle)
        + effects.density_core * np.exp(-(middle**2 + width**2) / (2.0 * 0.4**2))
    )
    return np.asarray(weights * np.maximum(density, 0.0))


def quantise(values: Floats, low: float, high: float, bits: int) -> Floats:
    """Values rounded to the codes of a converter (bits 0: not rounded), saturated at its ends."""
    inside = np.clip(values, low, high)
    if bits == 0:
        return inside
    step = (high - low) / (2**bits - 1)
    return np.asarray(low + step * np.rint((inside - low) / step))


def simulate(
    stage: Stage, command: Command, seed: int = 0, effects: Effects | None = None
) -> Record:
    """A record of a stage that follows a command.

    The record's u is what the converter was told, rounded to its codes. The stage rests at the
    first voltage, reached from u_min without a turn. The same arguments give the same record.

    Parameters
    ----------
    effects
        The whole signal path is simulated in fine steps. None: hysteresis alone, which needs no
        steps between samples.

    Raises
    ------
    InputError
        The command leaves the stage's range.
    """
    t = command.time_s
    u = drive(stage, command, t)
    if effects is None:
        return measure(stage, t, u, Hysteresis(stage).run(u), seed)
    shown = _shown(stage, effects, command, seed)[0]
    return measure(stage, t, u, shown, seed, int(effects.stuck_bit))


def drive(stage: Stage, command: Command, t_s: Floats) -> Floats:
    """What the digital-to-analog converter gives at times in s: V, shape as t_s."""
    slack = 1e-9 * stage.range_V
    if command.u_min_V < stage.u_min_V - slack or command.u_max_V > stage.u_max_V + slack:
        raise InputError(
            f"the command goes from {command.u_min_V:g} to {command.u_max_V:g} V, the stage is "
            f"driven from {stage.u_min_V:g} to {stage.u_max_V:g} V"
        )
    return quantise(command.at(t_s), stage.u_min_V, stage.u_max_V, stage.dac_bits)


def _displacement(
    stage: Stage, effects: Effects, command: Command, seed: int
) -> tuple[Floats, Floats, float]:
    """True displacement (um) and drive (V) at the samples, and displacement at rest at u_min.

    Steps lie on the actuator's clock, which the record's clock is off by the skew: every n-th
    step is a sample.
    """
    fine_hz = max(_FINE_HZ, _STEPS_PER_PERIOD * effects.fastest_hz)
    every = max(1, int(np.ceil(fine_hz / command.rate_hz)))
    step_s = (1.0 + 1e-6 * effects.skew_ppm) / (command.rate_hz * every)
    t = np.asarray(np.arange((command.samples - 1) * every + 1) * step_s, np.float64)
    missed = _missed(effects, command, seed)
    u = _amplified(stage, effects, _told(stage, command, t - effects.delay_s, missed), step_s)
    rate = _low_pass(np.gradient(u, step_s), step_s / _VELOCITY_TAU_S)
    rate[0] = 0.0
    h, rest_um = _hysteresis(stage, effects, u, rate)
    y = _mechanics(effects, _crept(effects, h - rest_um, step_s), step_s)
    if effects.heating_um:
        power = 2.0 * np.abs(rate) * (u - stage.u_min_V) / stage.range_V
        power[0] = 0.0
        warm = _low_pass(power / effects.reference_V_per_s, step_s / _HEATING_TAU_S)
        y += effects.heating_um * warm
    return y[::every] + rest_um, u[::every], rest_um


def _missed(effects: Effects, command: Command, seed: int) -> NDArray[np.bool_]:
    """Which commands the drive's converter misses, shape (samples,)."""
    rng = np.random.default_rng([seed, 6])
    return np.asarray(rng.uniform(size=command.samples) < effects.missed_share)


def _told(stage: Stage, command: Command, t_s: Floats, missed: NDArray[np.bool_]) -> Floats:
    """The drive at any times, V; before the record it rests."""
    if stage.between == "waveform":
        return drive(stage, command, np.maximum(t_s, 0.0))
    count = max(missed.size, int(np.ceil(t_s[-1] * command.rate_hz)) + 2)
    samples = np.arange(count) / command.rate_hz
    u = drive(stage, command, samples)
    own = np.arange(u.size)
    own[1 : missed.size][missed[1:]] = 0
    return np.interp(t_s, samples, u[np.maximum.accumulate(own)])


def _low_pass(signal: Floats, rate: float) -> Floats:
    """One pole; rate is the step over its time constant."""
    out = _array(signal).copy()
    load_library()[1].path_lag(_pointer(out), out.size, rate)
    return out


_KNEES: tuple[Callable[[Floats], Floats], ...] = (
    np.tanh,
    lambda x: np.asarray(x / np.sqrt(1.0 + x**2)),
    lambda x: np.asarray(-np.expm1(-x)),
)
"""By knee_law: from 0 with slope 1 to 1."""


def _saturated(effects: Effects, u_V: Floats) -> Floats:
    """Clipped drive; a soft knee bends from knee_V below the limit on."""
    knee = effects.knee_V
    bend = _KNEES[int(effects.knee_law)]

    def soft(u: Floats, limit: float) -> Floats:
        if not (knee > 0.0 and np.isfinite(limit)):
            return np.minimum(u, limit)
        over = np.maximum(u - (limit - knee), 0.0)
        return np.asarray(u - over + knee * bend(over / knee))

    return -soft(-soft(u_V, effects.high_V), -effects.low_V)


def _amplified(stage: Stage, effects: Effects, u_V: Floats, step_s: float) -> Floats:
    lib = load_library()[1]
    u = _array(_saturated(effects, u_V)).copy()
    if np.isfinite(effects.slew_V_per_s):
        rise_V = effects.slew_V_per_s * step_s
        lib.path_slew(_pointer(u), u.size, rise_V, effects.slew_fall * rise_V)
    if np.isfinite(effects.corner_hz):
        rate = 2.0 * np.pi * effects.corner_hz * step_s
        lib.path_charge(_pointer(u), u.size, rate, effects.droop, stage.u_min_V, stage.range_V)
    if np.isfinite(effects.corner2_hz):
        u = _low_pass(u, 2.0 * np.pi * effects.corner2_hz * step_s)
    return u


def _bow(stage: Stage, effects: Effects, u_V: Floats) -> Floats:
    """What a memoryless asymmetry adds, um; 0 at both ends of the range."""
    share = (u_V - stage.u_min_V) / stage.range_V
    grown = np.expm1(effects.exponential * share) / np.expm1(effects.exponential)
    return np.asarray(
        effects.bow_um * np.sin(np.pi * share) + 4.0 * effects.exponential_um * (grown - share)
    )


def _elbow(stage: Stage, effects: Effects, h_um: Floats) -> Floats:
    """What a one-sided dead zone behind the hysteresis adds, um; 0 at both ends of the stroke."""
    share = (h_um - stage.y_min_um) / stage.stroke_um
    return np.asarray(effects.elbow_um * (2.0 * np.maximum(share - 0.5, 0.0) - share) * 2.0)


def _widening(effects: Effects, relative: Floats) -> Floats | None:
    """How much later elements switch at rates relative to the reference, V."""
    if not effects.widen_V:
        return None
    if effects.widen_power:
        return np.asarray(effects.widen_V * relative**effects.widen_power)
    return np.asarray(effects.widen_V * np.log1p(10.0 * relative) / np.log(11.0))


def _hysteresis(
    stage: Stage, effects: Effects, u_V: Floats, rate_V_per_s: Floats
) -> tuple[Floats, float]:
    """Displacement behind the hysteresis box, and at rest at u_min; um."""
    relative = np.abs(rate_V_per_s) / effects.reference_V_per_s
    hysteresis = Hysteresis(stage, effects)

    def bent(u: Floats, widen_V: Floats | None = None) -> Floats:
        h = hysteresis.run(u, widen_V)
        return np.asarray(h + _bow(stage, effects, u) + _elbow(stage, effects, h))

    rest_um = float(bent(_saturated(effects, np.array([stage.u_max_V, stage.u_min_V])))[1])
    history = [u for u in (effects.start_peak_V, effects.start_dip_V) if np.isfinite(u)]
    hysteresis.run(_saturated(effects, np.array(history)))
    y = bent(u_V, _widening(effects, relative))
    if effects.damping_um:
        lag = np.arcsinh(10.0 * relative) / np.arcsinh(10.0)
        y -= np.asarray(effects.damping_um * np.sign(rate_V_per_s) * lag, np.float64)
    return y, rest_um


def _crept(effects: Effects, h_um: Floats, step_s: float) -> Floats:
    if not effects.creep_per_decade:
        return h_um
    few = int(effects.creep_elements)
    tau = np.geomspace(0.1, 100.0, few) if few else _CREEP_TAU_S
    gain = tau**effects.creep_tilt
    gain *= effects.creep_per_decade / np.sum(gain * (np.exp(-1.0 / tau) - np.exp(-10.0 / tau)))
    moved = np.zeros_like(h_um)
    for one_tau, one_gain in zip(tau, gain, strict=True):
        load_library()[1].path_creep(
            _pointer(h_um), _pointer(moved), h_um.size, one_tau / step_s, one_gain
        )
    return h_um + moved


def _mechanics(effects: Effects, y_um: Floats, step_s: float) -> Floats:
    lib = load_library()[1]
    moved = np.zeros_like(y_um)
    for (fn_hz, share), zeta in zip(effects.modes_hz, (effects.zeta, effects.zeta2), strict=True):
        if share:
            rate = 2.0 * np.pi * fn_hz * step_s
            lib.path_mode(_pointer(y_um), _pointer(moved), y_um.size, rate, zeta, share)
    y = y_um + moved
    if effects.dead_band_um:
        faces = [y.copy() for _ in range(2)]
        for face, share in zip(faces, (-1.0, 1.0), strict=True):
            band_um = (1.0 + share * effects.dead_band_spread) * effects.dead_band_um
            lib.path_backlash(_pointer(face), y.size, band_um)
        y = np.mean(faces, axis=0)
    return y


def _shown(stage: Stage, effects: Effects, command: Command, seed: int) -> tuple[Floats, Floats]:
    """What the sensor shows before noise and converter (um), and the drive (V), at the samples."""
    t_s = command.time_s
    y_um, drive_V, rest_um = _displacement(stage, effects, command, seed)
    rng = np.random.default_rng([seed, 5])
    y = _read(effects, t_s, y_um - rest_um, rng) + rest_um
    y += effects.drift_um_per_s * t_s - effects.drift_um * np.expm1(-t_s / effects.drift_tau_s)
    turn = 2.0 * np.pi * t_s / effects.swing_period_s + effects.swing_phase
    y += effects.swing_um * (np.sin(turn) - np.sin(effects.swing_phase))
    phase = rng.uniform(0.0, 2.0 * np.pi, 3)
    lines = (effects.freq_hz, 2.0 * effects.freq_hz, effects.freq2_hz)
    sizes = (effects.amp_um, effects.harmonic_um, effects.amp2_um)
    for size, hz, begin in zip(sizes, lines, phase, strict=True):
        y += size * np.sin(2.0 * np.pi * hz * t_s + begin)
    paces = rng.standard_normal(t_s.size) * np.sqrt(t_s[1] / 10.0)
    y += effects.walk_um * np.cumsum(paces)
    hit = rng.uniform(size=t_s.size) < 1.0 / 200.0
    y += effects.impulse_um * hit * rng.standard_normal(t_s.size)
    y += effects.fringe_um * np.sin(2.0 * np.pi * y_um / effects.fringe_period_um)
    return y, drive_V


def _read(effects: Effects, t_s: Floats, moved_um: Floats, rng: np.random.Generator) -> Floats:
    """What the sensor makes of a displacement: calibration, and when it looks."""
    if effects.jitter_s:
        late_s = effects.jitter_s * rng.standard_normal(t_s.size)
        moved_um = np.interp(t_s + late_s, t_s, moved_um)
    gain = effects.gain * (1.0 + effects.fading_per_s * t_s)
    return np.asarray(gain * moved_um + effects.offset_um)


def measure(
    stage: Stage, t_s: Floats, u_V: Floats, y_um: Floats, seed: int, stuck_bit: int = -1
) -> Record:
    """The record that noise, converter and logger make of what the sensor shows, um."""
    noise = _noise(stage, t_s.size, 1.0 / (t_s[1] - t_s[0]), seed)
    low, high = stage.reading_um
    reading = quantise(y_um + noise + stage.offset_um, low, high, stage.adc_bits)
    if stuck_bit >= 0:
        code = np.rint((reading - low) / stage.adc_step_um).astype(np.int64) | (1 << stuck_bit)
        reading = np.asarray(low + stage.adc_step_um * code, np.float64)
    reading = reading[_held_from(t_s.size, stage.stuck_share, seed)]
    kept = np.random.default_rng([seed, 4]).uniform(size=t_s.size) >= stage.drop_share
    kept[0] = True
    return Record(
        name="simulated",
        t_s=np.round(t_s[kept], 6),
        u_V=np.round(u_V[kept], 6),
        y=np.round(reading[kept], 6),
    )


def _noise(stage: Stage, n: int, rate_hz: float, seed: int) -> Floats:
    """The sensor's noise, um, stationary from the start, shape (n,)."""
    from scipy.signal import lfilter

    if stage.noise_pink:
        corners = np.exp(-2.0 * np.pi * _PINK_HZ / rate_hz)
    else:
        corners = np.array([stage.noise_ar ** (_NOISE_HZ / rate_hz)])
    white = np.random.default_rng([seed, 2]).standard_normal((corners.size, n))
    total = np.zeros(n)
    for ar, pace in zip(corners, white, strict=True):
        pace[1:] *= np.sqrt(1.0 - ar**2)
        total += lfilter([1.0], [1.0, -ar], pace)
    return np.asarray(stage.noise_um * total / np.sqrt(corners.size))


def _held_from(n: int, share: float, seed: int) -> NDArray[np.int64]:
    """Which sample's reading each sample shows: its own, or where it stuck; shape (n,)."""
    starts = np.random.default_rng([seed, 3]).uniform(size=n) < share / _STUCK_SAMPLES
    own = np.arange(n)
    last = np.maximum.accumulate(np.where(starts, own, -_STUCK_SAMPLES))
    return np.where(own - last < _STUCK_SAMPLES, np.maximum(last, 0), own)


def make_case(
    directory: Path,
    effects: Mapping[str, float | Parameters] | None = None,
    seed: int = 0,
    campaign: Campaign | str = Campaign.RICH,
    stage: Stage | None = None,
    every: Commands | None = None,
    noise_um: float | None = None,
    noise_ar: float | None = None,
    monitor: bool = False,
    apart: bool = False,
) -> dict[str, Any]:
    """Write a case for `madelung diagnose` (contract: diagnose.md) and give its labels.

    Parameters
    ----------
    directory
        The case; it must not exist yet. Nothing in it tells the cause.
    effects
        Effect to its strength (1: ordinary size; 0.1: a tenth) or to its parameters; see
        `sim_effects.EFFECTS` and `sim_effects.Effects`. None: there is nothing to find.
    seed
        Decides the stage (where it is not given), the records, sizes and noise. The records do
        not depend on the effects.
    campaign, every
        What is recorded: a campaign, or commands by record name (``identify``, ``train/...``,
        ``holdout/...``).
    stage
        The stage; None: `random_stage`.
    noise_um, noise_ar
        Instead of the stage's.
    monitor
        Whether the records have the amplifier's output, u_meas_V.
    apart
        Whether to find out what each effect adds to the others.

    Returns
    -------
    ``effects`` and ``outside`` (names), ``parameters`` (effect to parameters), ``deviation_um``
    (record to the rms by which all effects together change the reading), ``noise_um``, ``seed``;
    ``noise_in_um`` (record to the rms of noise and converter in it); ``apart_um`` (effect to
    record to the rms by which it changes what the sensor shows) where it was asked for.

    Raises
    ------
    InputError
        The directory exists, or an effect is not known.
    """
    if directory.exists():
        raise InputError(f"{directory}: exists already; name a new folder")
    stage = random_stage(seed) if stage is None else stage
    stage = replace(
        stage,
        noise_um=stage.noise_um if noise_um is None else noise_um,
        noise_ar=stage.noise_ar if noise_ar is None else noise_ar,
    )
    if every is None:
        record_rng = np.random.default_rng([seed, 11])
        every = commands(Campaign(campaign), stage.u_min_V, stage.u_max_V, record_rng)
    chosen, drawn = make_effects(stage, every, effects or {}, seed)
    try:
        part = Path(tempfile.mkdtemp(prefix=f".{directory.name}.", dir=directory.parent))
    except OSError as error:
        raise InputError(f"{directory}: cannot be written: {error.strerror}") from error
    try:
        deviation, noise = _write_case(part, stage, every, chosen, seed, monitor)
        part.chmod(0o755)
        part.rename(directory)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return {
        "effects": [name for name in drawn if name in VOCABULARY],
        "outside": [name for name in drawn if name in OUTSIDE],
        "parameters": drawn,
        "deviation_um": deviation,
        "noise_um": stage.noise_um,
        "seed": seed,
        **({"apart_um": _apart_um(stage, every, drawn, seed)} if apart else {}),
        "noise_in_um": noise,
    }


def make_effects(
    stage: Stage, every: Commands, wanted: Mapping[str, float | Parameters], seed: int = 0
) -> tuple[Effects, dict[str, Parameters]]:
    """Effects of a stage and its commands by strength or parameters; see `draw_effects`."""
    if not wanted:
        return Effects(), {}
    return draw_effects(wanted, np.random.default_rng([seed, 12]), make_scene(stage, every))


def _record_seed(seed: int, index: int) -> int:
    return int(np.random.SeedSequence([seed, 13, index]).generate_state(1)[0])


def _apart_um(
    stage: Stage, every: Commands, drawn: Mapping[str, Parameters], seed: int
) -> dict[str, dict[str, float]]:
    """See `make_case`."""
    together = {k: v for one in drawn.values() for k, v in one.items()}
    found: dict[str, dict[str, float]] = {name: {} for name in drawn}
    for index, record in enumerate(every):

        def shown(keys: Mapping[str, float], index: int = index, record: str = record) -> Floats:
            effects = Effects(**dict(keys))
            acting = effects.at_identification() if record == "identify" else effects
            return _shown(stage, acting, every[record], _record_seed(seed, index))[0]

        whole = shown(together)
        for name, own in drawn.items():
            rest = shown({k: v for k, v in together.items() if k not in own})
            found[name][record] = float(np.sqrt(np.mean((whole - rest) ** 2)))
    return found


def _write_case(
    directory: Path, stage: Stage, every: Commands, effects: Effects, seed: int, monitor: bool
) -> tuple[dict[str, float], dict[str, float]]:
    """Write the files of a case; record to the rms, um, by which effects and noise change it."""
    device = {
        "device": "simulated piezo stage",
        "u_min_V": stage.u_min_V,
        "u_max_V": stage.u_max_V,
        "y_unit": "um",
        "adc_bits": stage.adc_bits,
        "dac_bits": stage.dac_bits,
    }
    write_atomically(directory / "case.json", json.dumps(device, indent=1) + "\n")
    deviation, noise = {}, {}
    for index, (name, command) in enumerate(every.items()):
        acting = effects.at_identification() if name == "identify" else effects
        own_seed = _record_seed(seed, index)
        t = command.time_s
        u = drive(stage, command, t)
        shown, drive_V = _shown(stage, acting, command, own_seed)
        record = measure(stage, t, u, shown, own_seed, int(acting.stuck_bit))
        if monitor:
            record = replace(record, u_meas_V=np.interp(record.t_s, t, drive_V).round(3))
        path = directory / f"{name}.csv"
        path.parent.mkdir(exist_ok=True)
        write_record(path, record)
        plain = measure(stage, t, u, Hysteresis(stage).run(u), own_seed)
        assert record.y is not None and plain.y is not None
        deviation[name] = float(np.std(record.y - plain.y))
        true = np.interp(record.t_s, t, shown) + stage.offset_um
        noise[name] = float(np.sqrt(np.mean((record.y - true) ** 2)))
    return deviation, noise


def random_stage(seed: int) -> Stage:
    """A stage of one of several ranges, strokes, loop widths and noises, of either physics."""
    rng = np.random.default_rng([seed, 10])
    u_min, u_max = ((0.0, 40.0), (0.0, 100.0), (-20.0, 130.0), (-10.0, 60.0))[rng.integers(4)]
    stroke = rng.uniform(15.0, 60.0)
    return Stage(
        u_min,
        u_max,
        stroke,
        rng.uniform(0.10, 0.15),
        y_min_um=rng.uniform(0.0, 5.0),
        physics="relays" if rng.uniform() < 0.5 else "slides",
        noise_um=rng.uniform(2e-4, 5e-4) * stroke,
        headroom_share=0.6,
    )


def make_scene(stage: Stage, every: Commands) -> Scene:
    """What the sizes of effects are measured against, of a stage and its commands."""
    return Scene(
        stage.u_min_V,
        stage.u_max_V,
        stage.stroke_um,
        1.0 - _loss(stage)[1] * stage.range_V / stage.stroke_um,
        fast_V_per_s(every),
        highest_V_per_s(every),
        bias_V(every, stage.u_min_V, stage.u_max_V),
        _density_um(stage),
        stage.adc_step_um,
    )


@cache
def _density_um(stage: Stage) -> dict[str, float]:
    """See `Scene.density_um`; the deviations are proportional to densities and shares."""
    unit = {
        "density_odd": _asymmetry_um(stage, Effects(density_odd=0.5)),
        "density_even": _non_masing_um(stage, Effects(density_even=0.5)),
        "density_core": _non_masing_um(stage, Effects(density_core=0.5)),
        "bouc_wen": _non_masing_um(stage, Effects(bouc_wen=0.5)),
    }
    return {name: size / 0.5 for name, size in unit.items()}


def _asymmetry_um(stage: Stage, effects: Effects) -> float:
    """By how much the major loop deviates from its central mirror at most, halved; um."""
    u = np.linspace(stage.u_min_V, stage.u_max_V, 201)
    hysteresis = Hysteresis(stage, effects)
    up, down = hysteresis.run(u), hysteresis.run(u[::-1])
    return float(np.abs(up + down - up[0] - up[-1]).max() / 2.0)


def _non_masing_um(stage: Stage, effects: Effects) -> float:
    """By how much a rise from any voltage deviates from the rise from u_min at most; um."""
    u = np.linspace(stage.u_min_V, stage.u_max_V, 201)
    major = Hysteresis(stage, effects).run(u)
    worst = 0.0
    for first in range(20, 181, 20):
        hysteresis = Hysteresis(stage, effects)
        hysteresis.run(u[[200, first]])
        branch = hysteresis.run(u[first:])
        off = branch - branch[0] - (major[: branch.size] - major[0])
        worst = max(worst, float(np.abs(off).max()))
    return worst
