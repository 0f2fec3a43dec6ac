"""The C core, float (as flashed) and double, called through cffi."""

from __future__ import annotations

from enum import IntFlag
from functools import cache
from pathlib import Path
from typing import Any, Literal

import cffi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from madelung.errors import InputError
from madelung.model import MARGIN_SHARE, Model

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


class Predictor:
    """A model's predictor with its state.

    Parameters
    ----------
    model
        The model to run.
    precision
        ``float32``: the arithmetic of the firmware; ``float64``: the reference.

    Raises
    ------
    InputError
        The core refuses a parameter.
    """

    def __init__(self, model: Model, precision: Precision = "float32") -> None:
        self._ffi, self._lib = load(precision)
        self._dtype = np.dtype(precision)
        range_V = model.range_as(self._dtype.type)
        margin = MARGIN_SHARE * model.range_V
        status = self._ffi.new("int32_t *")
        if model.kind == "madelung":
            c = self._array(model.f0)
            made = self._lib.batch_new_polynomial(
                model.u_min_V, range_V, margin, self._pointer(c), c.size - 1, status
            )
        else:
            x, y = (self._array(v) for v in zip(*model.breakpoints, strict=True))
            x[-1] = range_V
            made = self._lib.batch_new_breakpoints(
                model.u_min_V, margin, self._pointer(x), self._pointer(y), x.size, status
            )
        if made == self._ffi.NULL:
            raise InputError(f"the model cannot be run: {_ERRORS[status[0]]}")
        self._batch = self._ffi.gc(made, self._lib.batch_free)

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

    def _array(self, values: ArrayLike) -> NDArray[np.floating[Any]]:
        with np.errstate(over="ignore"):  # the core refuses the infinity
            return np.ascontiguousarray(values, dtype=self._dtype).reshape(-1)

    def _pointer(self, array: NDArray[np.floating[Any]]) -> Any:
        return self._ffi.from_buffer("mdl_real[]", array)
