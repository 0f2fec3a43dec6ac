"""Run a model over a record, and say how far the measured displacement lies off."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from madelung.core import Precision, Predictor, Status
from madelung.errors import InputError
from madelung.identify import ENDS_SHARE, check_unit, percent, stroke_of
from madelung.model import MARGIN_SHARE, Model
from madelung.records import Record, warm_up_rows

Floats = NDArray[np.float64]

SWING_SHARE = 0.3
"""What moves further than predicted, but not so much of the stroke, may be noise."""


@dataclass(frozen=True)
class Prediction:
    """A prediction for every row of a record.

    Attributes
    ----------
    record, model
        What was predicted with what.
    unit
        Of the displacements, ``um`` unless the model was identified in the sensor's unit.
    predicted
        Shape (n,).
    turning_points
        Left and right turning points held after each row, shape (n,).
    scored
        True on the rows whose error counts, shape (n,): measured, sound, within the asked time,
        and after the warm-up of a running record.
    warnings
        One sentence each.
    """

    record: Record
    model: Model
    unit: str
    predicted: Floats
    turning_points: NDArray[np.uint32]
    scored: NDArray[np.bool_]
    warnings: tuple[str, ...]

    @property
    def error(self) -> Floats:
        """Measured less predicted on the scored rows; empty when nothing was measured."""
        if self.record.y is None:
            return np.empty(0)
        return (self.record.y - self.predicted)[self.scored]

    def columns(self) -> dict[str, NDArray[np.float64]]:
        """The columns of the contract's out.csv."""
        columns = {"t_s": self.record.t_s, "u_V": self.record.u_V}
        if self.record.y is not None:
            columns[f"y_{self.unit}"] = self.record.y
        return {**columns, f"predicted_{self.unit}": self.predicted}


def predict(
    model: Model,
    record: Record,
    precision: Precision = "float32",
    running: bool = False,
    from_s: float = -np.inf,
    to_s: float = np.inf,
) -> Prediction:
    """Predict the displacement for every row of a record.

    Parameters
    ----------
    model
        See `Model`.
    record
        Begins at rest at its first voltage, reached from u_min without a turn.
    precision
        ``float32``: the firmware's arithmetic; ``float64``: the reference.
    running
        The record begins in mid motion instead: what it predicts is right, and scored, once it has
        been at both of its ends.
    from_s, to_s
        Only rows in this time are scored; all rows are predicted.

    Raises
    ------
    InputError
        The command leaves the model's range by more than 15 %, y is in another unit than the
        model, or no row is left to score.
    """
    unit = str(model.extra.get("y_unit", "um"))
    if record.y is not None and record.y_unit != unit:
        raise InputError(
            f"{record.name}: y is in {record.y_unit}, the model gives {unit}: convert the record"
        )
    _check_range(model, record)
    predicted, status, turning_points = _run(model, record, precision)
    warnings = record.warnings()
    if model.not_in_firmware:
        names = ", ".join(b.effect for b in model.not_in_firmware)
        warnings.append(f"the model knows of {names}, which no open-loop predictor can predict")
    for bit, text in (
        (Status.EXTRAPOLATED, _outside(model)),
        (Status.MEMORY_FULL, "with more turning points than the memory holds"),
    ):
        rows = int(np.count_nonzero(status & int(bit)))
        if rows:
            warnings.append(f"{record.name}: rows {text}: {rows} of {status.size}")
    scored = record.sound & (record.t_s >= from_s) & (record.t_s <= to_s)
    if running:
        scored[: warm_up_rows(record.u_V, ENDS_SHARE)] = False
    if record.y is None:
        scored[:] = False
    elif not scored.any():
        raise InputError(
            f"{record.name}: no row is left to compare with: time runs from {record.t_s[0]:g} to "
            f"{record.t_s[-1]:g} s"
        )
    else:
        warnings += _check_swing(model, record, record.y[scored], predicted[scored])
    return Prediction(
        record,
        model,
        unit,
        predicted.astype(np.float64),
        turning_points,
        scored,
        tuple(warnings),
    )


def _check_swing(
    model: Model, record: Record, y: Floats, predicted: NDArray[np.floating[Any]]
) -> Iterator[str]:
    """Warn when y is hardly in the model's unit. Noise on a command that rests is no sign of it."""
    moved, expected = float(np.ptp(y)), float(np.ptp(predicted))
    if moved < expected or moved > SWING_SHARE * stroke_of(model):
        yield from check_unit(f"{record.name}: y", moved, expected)


def _outside(model: Model) -> str:
    volts = f"outside {model.u_min_V:g} to {model.u_max_V:g} V"
    if model.yang is None:
        return f"{volts}: f0 extrapolated"
    return f"{volts}, or of harmonics above {model.yang.hz_max:g} Hz: the model extrapolated"


def _run(
    model: Model, record: Record, precision: Precision
) -> tuple[NDArray[np.floating[Any]], NDArray[np.int32], NDArray[np.uint32]]:
    """Displacement, status and turning points for every row.

    Blocks need a uniform sample time: where rows are missing, the command is bridged linearly.
    """
    if model.kind in ("madelung", "major_curve"):
        return Predictor(model, precision).run_with_status(record.u_V)
    from madelung.path import predictor  # scipy is slow to import

    rows, u_V = on_grid(record)
    made = predictor(model, precision, record.step_s, float(u_V[0]))
    predicted, status, turning_points = made.run_with_status(u_V)
    return predicted[rows], status[rows], turning_points[rows]


def on_grid(record: Record) -> tuple[NDArray[np.int64], Floats]:
    """Place of each row on a uniform time grid, (n,), and the command on that grid, (m,).

    Raises
    ------
    InputError
        Most rows of the record are missing.
    """
    rows = np.rint((record.t_s - record.t_s[0]) / record.step_s).astype(np.int64)
    size = int(rows[-1]) + 1
    if size > 2 * rows.size:
        raise InputError(f"{record.name}: most rows are missing; the model's dynamics need them")
    return rows, np.interp(np.arange(size), rows, record.u_V)


def _check_range(model: Model, record: Record) -> None:
    margin = MARGIN_SHARE * model.range_V
    low, high = model.u_min_V - margin, model.u_max_V + margin
    out = np.flatnonzero((record.u_V < low) | (record.u_V > high))
    if out.size:
        raise InputError(
            f"{record.name}: row {record.line(int(out[0]))}: the command {record.u_V[out[0]]:g} V "
            f"is more than {100 * MARGIN_SHARE:.0f} % outside the model's range {model.u_min_V:g} "
            f"to {model.u_max_V:g} V ({out.size} such rows): check the unit, or identify the model "
            "on a wider range"
        )


def summary(found: Prediction) -> list[str]:
    """What a user wants to know of a prediction, a line each."""
    record, error = found.record, found.error
    if record.y is None:
        return [f"rows predicted: {record.t_s.size}; nothing measured to compare with"]
    rows = np.flatnonzero(found.scored)
    stroke = stroke_of(found.model)
    worst = int(np.argmax(np.abs(error)))

    def size(value: float) -> str:
        plain = f"{float(f'{value:.3g}'):.7g}"  # three digits, 30000 rather than 3e+04
        return f"{plain} {found.unit} ({percent(value, stroke)})"

    lines = [
        f"rows predicted: {record.t_s.size}; compared: {rows.size}, "
        f"{record.t_s[rows[0]]:g} to {record.t_s[rows[-1]]:g} s",
        f"error: rms {size(float(np.sqrt(np.mean(error**2))))}, "
        f"largest {size(abs(error[worst]))} at {record.t_s[rows[worst]]:g} s, "
        f"mean {size(float(error.mean()))}",
    ]
    if found.model.yang is None:
        lines.append(f"most turning points held: {found.turning_points.max()}")
    return lines
