"""The C core, float (as flashed) and double, called through cffi."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag
from functools import cache
from pathlib import Path
from typing import Any, Literal

import cffi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from madelung.errors import InputError
from madelung.model import MARGIN_SHARE, Model
from madelung.yang2015 import YangParams, discretise_yang

Precision = Literal["float32", "float64"]
_HERE = Path(__file__).parent
_LIBRARY = {"float32": ("float", "libmdl_f32.so"), "float64": ("double", "libmdl_f64.so")}


class Status(IntFlag):
    """Positive status bits of mdl_status.h."""

    OK = 0
    EXTRAPOLATED = 1
    CLAMPED = 2
    MEMORY_FULL = 4


_ERRORS = {
    -1: "a value is not finite",
    -2: "a parameter is out of its range",
    -3: "an array is too long for the core",
    -4: "the saved state is not one that the model can be in",
}


@cache
def load(precision: Precision) -> tuple[Any, Any]:
    """The cffi instance and the library of one precision.

    Raises
    ------
    InputError
        The library has not been built.
    """
    real, name = _LIBRARY[precision]
    path = _HERE / "_lib" / name
    if not path.exists():
        raise InputError(f"{path} is missing: run `make` in the project's folder first")
    header = (_HERE / "binding" / "batch.h").read_text(encoding="utf-8")
    plain = "\n".join(line for line in header.splitlines() if not line.startswith("#"))
    ffi = cffi.FFI()
    ffi.cdef(f"typedef {real} mdl_real;\n{plain}")
    return ffi, ffi.dlopen(str(path))


def n_u(precision: Precision = "float32") -> int:
    """N_u of a build: the number of turning points that its memory holds."""
    return int(load(precision)[1].batch_n_u())


@dataclass(frozen=True)
class Chain:
    """The blocks of mdl_chain_params, discretised for one sample time; None, empty: off.

    Attributes
    ----------
    substeps
        Steps per sample, 1 to 64.
    smooth
        The command between samples: 0 linear, 1 a parabola.
    shape
        (4, 4), um, see mdl_shape.h.
    loop
        l_0 and l_1 of mdl_shape.h; without a shape they do not act.
    saturation
        high, low and knee, V, the knee's power, parabolic and rest_free (0 or 1).
    slew
        rise, fall and knee, V, decay and early, see mdl_drive.h.
    lag, behind
        decay and ramp of the poles before and behind the hysteresis; of the first then how
        its load leans with the voltage, their slopes and their bends.
    rate
        decay and ramp of the velocity, v_scale, power, v_knee, at_knee, damping_um, widening,
        threshold_volts, swelling, lean, of_speed (0 or 1), decay, early and pull of viscous
        operators.
    envelope
        per_volt, rise_volts, rise_skew, fall_volts, fall_skew and follow, see mdl_envelope.h.
    bouc
        size_um, per_volt, power and gamma, see mdl_bouc.h.
    creep
        By mode: decay, ramp, gain.
    modes
        By flexure mode: Phi - I (4, row by row), gamma (2), share.
    backlash
        Dead band, um, its widths' spread, and the spring's share.
    delay
        Whole samples, and the four weights.
    gain
        gain, and offset in um.
    yang
        In the trajectory's place, see mdl_yang.h.
    """

    substeps: int = 1
    smooth: float = 0.0
    shape: tuple[tuple[float, ...], ...] | None = None
    loop: tuple[float, float] = (0.0, 0.0)
    saturation: tuple[float, ...] | None = None
    slew: tuple[float, float, float, float, float] | None = None
    lag: tuple[float, ...] | None = None
    behind: tuple[float, float] | None = None
    rate: tuple[float, ...] | None = None
    envelope: tuple[float, ...] | None = None
    bouc: tuple[float, float, float, float] | None = None
    creep: tuple[tuple[float, ...], ...] = ()
    modes: tuple[tuple[float, ...], ...] = ()
    backlash: tuple[float, float, float] | None = None
    delay: tuple[int, tuple[float, ...]] | None = None
    gain: tuple[float, float] | None = None
    yang: YangParams | None = None


class Core:
    """One chain of the core in one precision."""

    def __init__(self, precision: Precision) -> None:
        self._ffi, self._lib = load(precision)
        self._dtype = np.dtype(precision)
        self._batch = self._ffi.NULL

    def _make_polynomial(
        self, u_min_V: float, range_V: float, margin_V: float, f0: ArrayLike
    ) -> None:
        c = self._array(f0)
        status = self._ffi.new("int32_t *")
        made = self._lib.batch_new_polynomial(
            u_min_V, range_V, margin_V, self._pointer(c), c.size - 1, status
        )
        self._own(made, status)

    def _own(self, made: Any, status: Any) -> None:
        if made == self._ffi.NULL:
            raise InputError(f"the model cannot be run: {_ERRORS[status[0]]}")
        self._batch = self._ffi.gc(made, self._lib.batch_free)

    def _set_f0(self, f0: ArrayLike) -> None:
        c = self._array(f0)
        self._check(self._lib.batch_set_polynomial(self._batch, self._pointer(c), c.size - 1), "f0")

    def _set_blocks(self, chain: Chain) -> None:
        """Switch on what the chain has, and everything else off."""
        lib, batch = self._lib, self._batch
        lib.batch_clear_blocks(batch)
        lib.batch_set_substeps(batch, chain.substeps, chain.smooth)
        shape = self._ffi.NULL if chain.shape is None else self._pointer(self._array(chain.shape))
        lib.batch_set_shape(batch, shape, self._pointer(self._array(chain.loop)))
        if chain.saturation is not None:
            *knee, parabolic, rest_free = chain.saturation
            lib.batch_set_saturation(batch, *knee, int(parabolic), int(rest_free))
        if chain.slew is not None:
            lib.batch_set_slew(batch, *chain.slew)
        if chain.lag is not None:
            lib.batch_set_lag(batch, *chain.lag)
        if chain.behind is not None:
            lib.batch_set_behind(batch, *chain.behind)
        if chain.rate is not None:
            reals, of_speed, relax = chain.rate[:11], int(chain.rate[11]), chain.rate[12:]
            lib.batch_set_rate(batch, *reals, of_speed, *relax)
        if chain.envelope is not None:
            lib.batch_set_envelope(batch, *chain.envelope)
        if chain.bouc is not None:
            lib.batch_set_bouc(batch, *chain.bouc)
        if chain.backlash is not None:
            lib.batch_set_backlash(batch, *chain.backlash)
        if chain.gain is not None:
            lib.batch_set_gain(batch, *chain.gain)
        self._set_arrays(chain)
        lib.batch_reset(batch)  # behind a saturation the rest is another

    def _set_arrays(self, chain: Chain) -> None:
        """Blocks that the build may have too little memory for."""
        lib, batch = self._lib, self._batch
        if chain.creep:
            columns = [self._pointer(self._array(v)) for v in zip(*chain.creep, strict=True)]
            self._check(lib.batch_set_creep(batch, len(chain.creep), *columns), "creep")
        if chain.modes:
            values = np.array(chain.modes)
            parts = [self._pointer(self._array(values[:, at])) for at in (_PHI, _GAMMA, _SHARE)]
            self._check(lib.batch_set_modes(batch, len(chain.modes), *parts), "resonance")
        if chain.delay is not None:
            whole, weights = chain.delay
            weight = self._pointer(self._array(weights))
            self._check(lib.batch_set_delay(batch, whole, weight), f"delay of {whole} samples")
        if chain.yang is not None:
            self._set_yang(chain.yang)

    def _set_yang(self, yang: YangParams) -> None:
        lists = (
            yang.threshold_volts,
            yang.weight,
            (*yang.k, *yang.c_um, *yang.m),
            yang.lambda_,
            list(yang.values.values()),
        )
        threshold, weight, terms, harmonic, values = (self._pointer(self._array(v)) for v in lists)
        count, harmonics = len(yang.threshold_volts), len(yang.lambda_)
        status = self._lib.batch_set_yang(
            self._batch, count, yang.two_side, threshold, weight, terms, harmonics, harmonic, values
        )
        self._check(status, "the model of Yang et al.")

    def _check(self, status: int, what: str) -> None:
        if status < 0:
            raise InputError(f"the model cannot be run: {what}: {_ERRORS[status]}")

    def _array(self, values: ArrayLike) -> NDArray[np.floating[Any]]:
        if self._dtype == np.float64:
            return np.ascontiguousarray(values, dtype=np.float64).reshape(-1)
        with np.errstate(over="ignore"):  # the core refuses the infinity
            return np.ascontiguousarray(values, dtype=self._dtype).reshape(-1)

    def _pointer(self, array: NDArray[np.floating[Any]]) -> Any:
        return self._ffi.from_buffer("mdl_real[]", array)


_PHI, _GAMMA, _SHARE = slice(0, 4), slice(4, 6), slice(6, 7)


class Predictor(Core):
    """A model's predictor with its state.

    Parameters
    ----------
    model
        The model to run.
    precision
        ``float32``: the arithmetic of the firmware; ``float64``: the reference.
    chain
        Its blocks, discretised; without them the hysteresis alone is run. See path.predictor.

    Raises
    ------
    InputError
        The core refuses a parameter.
    """

    def __init__(
        self, model: Model, precision: Precision = "float32", chain: Chain | None = None
    ) -> None:
        super().__init__(precision)
        range_V = model.range_as(self._dtype.type)
        margin = MARGIN_SHARE * model.range_V
        if model.kind == "major_curve":
            x, y = (self._array(v) for v in zip(*model.breakpoints, strict=True))
            x[-1] = range_V
            status = self._ffi.new("int32_t *")
            made = self._lib.batch_new_breakpoints(
                model.u_min_V, margin, self._pointer(x), self._pointer(y), x.size, status
            )
            self._own(made, status)
        else:
            self._make_polynomial(model.u_min_V, range_V, margin, model.f0)
        if chain is None and model.yang is not None:
            alone = model.yang.rate_independent
            yang = discretise_yang(alone, model.u_min_V, model.u_max_V, margin, 1.0)
            chain = Chain(yang=yang)
        if chain is not None:
            self._set_blocks(chain)

    def lead(self, u_V: ArrayLike) -> None:
        """Lead the hysteresis alone through voltages, (n,): the history before a record."""
        u = self._array(u_V)
        self._lib.batch_history(self._batch, self._pointer(u), u.size)

    def reset(self) -> None:
        """Back to rest at u_min."""
        self._lib.batch_reset(self._batch)

    def run(self, u_V: ArrayLike) -> NDArray[np.floating[Any]]:
        """Displacement in um, shape (n,), for commands in V, shape (n,); the state goes on."""
        return self.run_with_status(u_V)[0]

    def run_with_status(
        self, u_V: ArrayLike
    ) -> tuple[NDArray[np.floating[Any]], NDArray[np.int32], NDArray[np.uint32]]:
        """As `run`, with the status and the number of turning points after each sample.

        A negative status (-1: not finite) marks a refused sample; y then repeats the last one.
        """
        u = self._array(u_V)
        y = np.empty_like(u)
        status = np.empty(u.size, np.int32)
        count = np.empty(u.size, np.uint32)
        self._lib.batch_run(
            self._batch,
            self._pointer(u),
            self._pointer(y),
            self._ffi.from_buffer("int32_t[]", status),
            self._ffi.from_buffer("uint32_t[]", count),
            u.size,
        )
        return y, status, count

    def save(self) -> NDArray[np.floating[Any]]:
        """The state (see mdl_traj_save): a copy that `resume` takes."""
        saved = np.empty(self._lib.batch_saved_length(self._batch), self._dtype)
        self._lib.batch_save(self._batch, self._pointer(saved), saved.size)
        return saved

    def resume(self, saved: ArrayLike) -> None:
        """Continue from a saved state of the same model.

        Raises
        ------
        InputError
            The state is refused; the predictor is as before.
        """
        state = self._array(saved)
        status = self._lib.batch_resume(self._batch, self._pointer(state), state.size)
        if status < 0:
            raise InputError(f"the state cannot be resumed: {_ERRORS[status]}")
