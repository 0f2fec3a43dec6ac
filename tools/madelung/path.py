"""The signal path in physical units, discretised for the C core.

Every effect that the firmware can run is a block of the chain (mdl_chain.h). Here its parameters
are in units; the coefficients for a sample time are computed in double, exact for an input that
is linear between samples.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

from madelung.core import Precision, load
from madelung.model import MARGIN_SHARE

Array = NDArray[np.float64]
SHAPE_ORDER = 4
CREEP_MODES_MAX = 12
SLEW_SUBSTEPS = 4
VELOCITY_SAMPLES = 0.75
"""Time constant of the velocity filter of the rate block, in (sub)samples."""
UNLIMITED_V = 1e6


@dataclass(frozen=True)
class Mode:
    """A flexure mode: natural frequency (Hz), damping ratio, share of the static displacement."""

    fn_hz: float
    zeta: float
    share: float = 1.0


@dataclass(frozen=True)
class CreepMode:
    """A mode of the creep ladder: time constant (s), share of the displacement."""

    tau_s: float
    gain: float


@dataclass(frozen=True)
class SignalPath:
    """Parameters of all blocks; the defaults switch every one off.

    Attributes
    ----------
    u_min_V, range_V
        Identified range of the command.
    f0
        Coefficients of the major ascending curve, um / V^k, ascending, at most degree 7.
    shape
        (4, 4), um: terms s'^j m'^k, row k - 1, column j - 1 (mdl_shape.h).
    high_V, low_V, knee_V
        Saturation of the drive.
    slew_V_per_s
        Slew limit, 0: none.
    corner_hz
        Amplifier lag, 0: none.
    damping_um, widening, power, v_ref_V_per_s
        Rate dependence (mdl_rate.h).
    creep, modes
        Creep ladder, flexure modes.
    dead_band_um
        Backlash, full width.
    delay_s
        Pure delay.
    gain, offset_um
        Sensor: y' = gain (y - y(u_min)) + y(u_min) + offset.
    """

    u_min_V: float
    range_V: float
    f0: tuple[float, ...]
    shape: tuple[tuple[float, ...], ...] | None = None
    high_V: float = UNLIMITED_V
    low_V: float = -UNLIMITED_V
    knee_V: float = 0.0
    slew_V_per_s: float = 0.0
    corner_hz: float = 0.0
    damping_um: float = 0.0
    widening: float = 0.0
    power: float = 1.0
    v_ref_V_per_s: float = 1.0
    creep: tuple[CreepMode, ...] = field(default=())
    modes: tuple[Mode, ...] = field(default=())
    dead_band_um: float = 0.0
    delay_s: float = 0.0
    gain: float = 1.0
    offset_um: float = 0.0

    def but(self, **changes: Any) -> SignalPath:
        """A copy with some parameters changed."""
        return replace(self, **changes)

    @property
    def substeps(self) -> int:
        """Steps per sample: slew limit and rate dependence need more than one."""
        return SLEW_SUBSTEPS if self.slew_V_per_s or self.has_rate else 1

    @property
    def has_rate(self) -> bool:
        """Whether the rate block acts."""
        return self.damping_um != 0.0 or self.widening != 0.0


def lag_coefficients(tau_s: float, step_s: float) -> tuple[float, float]:
    """``decay``, ``ramp`` of mdl_lag.h for a pole with time constant tau."""
    decay = -np.expm1(-step_s / tau_s)
    return float(decay), float(decay * tau_s / step_s)


def mode_coefficients(fn_hz: float, zeta: float, step_s: float) -> tuple[Array, Array]:
    """``phi`` (2, 2) less the unit matrix, and ``gamma`` (2,) of mdl_mode.h."""
    w = 2 * np.pi * fn_hz
    system = np.zeros((3, 3))
    system[:2, :2] = [[0.0, w], [-w, -2 * zeta * w]]
    system[0, 2] = -1.0 / step_s
    exact = expm(system * step_s)
    return exact[:2, :2] - np.eye(2), exact[:2, 2]


def delay_coefficients(delay_s: float, step_s: float) -> tuple[int, Array]:
    """Whole samples and the four Lagrange weights of mdl_delay.h."""
    samples = delay_s / step_s
    whole = max(int(np.floor(samples)) - 1, 0)
    at = samples - whole
    nodes = np.arange(4.0)
    weights = [np.prod([(at - n) / (k - n) for n in nodes if n != k]) for k in nodes]
    return whole, np.array(weights)


class Runner:
    """Runs signal paths over records in the C core.

    Parameters
    ----------
    u_min_V, range_V
        Identified range of the command.
    precision
        ``float64`` for fits, ``float32`` for what the firmware computes.
    """

    def __init__(self, u_min_V: float, range_V: float, precision: Precision = "float64") -> None:
        self._ffi, self._lib = load(precision)
        self._dtype = np.dtype(precision)
        status = self._ffi.new("int32_t *")
        zero = self._real([0.0])
        made = self._lib.batch_new_polynomial(
            u_min_V, range_V, MARGIN_SHARE * range_V, zero[1], 0, status
        )
        if made == self._ffi.NULL:
            raise ValueError(f"the core refuses the range: status {status[0]}")
        self._batch = self._ffi.gc(made, self._lib.batch_free)

    def run(
        self, path: SignalPath, u_V: ArrayLike, step_s: float, history_V: ArrayLike = ()
    ) -> Array:
        """Displacement in um, (n,), from rest; history_V is run through the hysteresis first."""
        self._configure(path, step_s)
        u, u_pointer = self._real(u_V)
        past, past_pointer = self._real(history_V)
        y = np.empty_like(u)
        none = self._ffi.NULL
        self._lib.batch_reset(self._batch)
        self._lib.batch_history(self._batch, past_pointer, past.size)
        y_pointer = self._ffi.from_buffer("mdl_real[]", y)
        self._lib.batch_run(self._batch, u_pointer, y_pointer, none, none, u.size)
        return y.astype(np.float64, copy=False)

    def _real(self, values: ArrayLike) -> tuple[NDArray[Any], Any]:
        array = np.ascontiguousarray(values, dtype=self._dtype).reshape(-1)
        return array, self._ffi.from_buffer("mdl_real[]", array)

    def _check(self, status: int) -> None:
        if status < 0:
            raise ValueError(f"the core refuses a parameter: status {status}")

    def _configure(self, path: SignalPath, step_s: float) -> None:
        lib, batch = self._lib, self._batch
        lib.batch_clear_blocks(batch)
        f0, f0_pointer = self._real(path.f0)
        self._check(lib.batch_set_polynomial(batch, f0_pointer, f0.size - 1))
        shape = self._ffi.NULL if path.shape is None else self._real(path.shape)[1]
        lib.batch_set_shape(batch, shape)
        lib.batch_set_substeps(batch, path.substeps)
        self._configure_drive(path, step_s / path.substeps)
        self._configure_dynamics(path, step_s / path.substeps)
        if path.delay_s > 0:
            whole, weights = delay_coefficients(path.delay_s, step_s)
            self._check(lib.batch_set_delay(batch, whole, self._real(weights)[1]))
        if path.gain != 1.0 or path.offset_um != 0.0:
            lib.batch_set_gain(batch, path.gain, path.offset_um)

    def _configure_drive(self, path: SignalPath, step_s: float) -> None:
        lib, batch = self._lib, self._batch
        if path.high_V < UNLIMITED_V or path.low_V > -UNLIMITED_V:
            lib.batch_set_saturation(batch, path.high_V, path.low_V, path.knee_V)
        if path.slew_V_per_s:
            lib.batch_set_slew(batch, path.slew_V_per_s * step_s)
        if path.corner_hz:
            lib.batch_set_lag(batch, *lag_coefficients(1 / (2 * np.pi * path.corner_hz), step_s))
        if path.has_rate:
            tau = VELOCITY_SAMPLES * step_s
            scale = -1.0 / (tau * path.v_ref_V_per_s)
            lib.batch_set_rate(
                batch,
                *lag_coefficients(tau, step_s),
                scale,
                path.power,
                path.damping_um,
                path.widening,
            )

    def _configure_dynamics(self, path: SignalPath, step_s: float) -> None:
        lib, batch = self._lib, self._batch
        if path.creep:
            lags = np.array([lag_coefficients(m.tau_s, step_s) for m in path.creep])
            columns = [self._real(v)[1] for v in (*lags.T, [m.gain for m in path.creep])]
            self._check(lib.batch_set_creep(batch, len(path.creep), *columns))
        if path.modes:
            parts = [mode_coefficients(m.fn_hz, m.zeta, step_s) for m in path.modes]
            phi = self._real([p[0] for p in parts])[1]
            gamma = self._real([p[1] for p in parts])[1]
            share = self._real([m.share for m in path.modes])[1]
            self._check(lib.batch_set_modes(batch, len(path.modes), phi, gamma, share))
        if path.dead_band_um:
            lib.batch_set_backlash(batch, path.dead_band_um)
