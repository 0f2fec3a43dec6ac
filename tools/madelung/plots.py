"""Pictures of an identification and of a prediction, as PNG."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from madelung.errors import InputError
from madelung.files import replacing
from madelung.identify import Identification, stroke_of
from madelung.predict import Prediction

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

# Okabe and Ito's palette: told apart with any colour vision, and in grey.
MEASURED = "#56B4E9"
MODEL = "#000000"
RISING = "#D55E00"
FALLING = "#0072B2"
POINTS_MAX = 20_000
"""Points drawn of a long record: lowest and highest of so many stretches."""


def draw_identification(path: Path, found: Identification) -> None:
    """Draw the loop, the rows mapped onto the ascending branch, and what the fit leaves.

    Raises
    ------
    InputError
        The name does not end in .png, or the folder cannot be written.
    """
    figure = new_figure()
    loop, branch, rest, symmetry = figure.subplots(2, 2).flat
    model, unit = found.model, str(found.model.extra.get("y_unit", "um"))
    u = found.x_V + model.u_min_V
    f0 = Polynomial(model.f0)
    x = np.linspace(0.0, model.range_V, 300)
    x_t, y_t = found.mapped
    shown = _every(u.size)
    loop.plot(u[shown], found.y[shown], ".", color=MEASURED, ms=3, label="measured")
    fall = f0(0.0) + f0(model.range_V) - f0(model.range_V - x)
    loop.plot(
        np.append(x, x[::-1]) + model.u_min_V,
        np.append(f0(x), fall[::-1]),
        color=MODEL,
        lw=1.2,
        label=f"model, degree {len(model.f0) - 1}",
    )
    label_axes(loop, "Major loop", "command u (V)", f"displacement y ({unit})")
    for rising, name, colour in _branches(found):
        these = shown[rising[shown]]
        branch.plot(x_t[these], y_t[these], ".", color=colour, ms=3, label=f"{name}")
        rest.plot(u[these], (found.y - found.fitted)[these], ".", color=colour, ms=3, label=name)
    branch.plot(x, f0(x), color=MODEL, lw=1.2, label="f0")
    label_axes(branch, "Both branches on the ascending one", "x = u - u_min (V)", f"y ({unit})")
    rest.axhline(0.0, color=MODEL, lw=0.8)
    label_axes(rest, "What the fit leaves", "command u (V)", f"measured - fitted ({unit})")
    centre = (np.arange(found.asymmetry.size) + 0.5) * model.range_V / found.asymmetry.size
    symmetry.plot(centre, found.asymmetry, color=RISING, label="rising - mirrored falling")
    symmetry.axhspan(-found.noise.sigma, found.noise.sigma, color="0.85", label="noise, 1 sigma")
    label_axes(symmetry, "Asymmetry of the loop", "x = u - u_min (V)", f"difference ({unit})")
    save_figure(path, figure)


def draw_prediction(path: Path, found: Prediction) -> None:
    """Draw the loop, the movement over time, the error, and the number of turning points.

    Raises
    ------
    InputError
        The name does not end in .png, or the folder cannot be written.
    """
    figure = new_figure()
    loop, time, error, turns = figure.subplots(2, 2).flat
    record, unit = found.record, found.unit
    t, u = record.t_s, record.u_V
    ends = extremes(u)
    if record.y is not None:
        loop.plot(u[ends], record.y[ends], color=MEASURED, lw=3, label="measured")
        draw_over_time(time, t, record.y, color=MEASURED, lw=3, label="measured")
        _draw_error(error, found)
    else:
        error.text(0.5, 0.5, "nothing measured", ha="center", transform=error.transAxes)
    loop.plot(u[ends], found.predicted[ends], color=MODEL, lw=0.9, label="predicted")
    label_axes(loop, "Loop", "command u (V)", f"displacement y ({unit})")
    draw_over_time(time, t, found.predicted, color=MODEL, lw=0.9, label="predicted")
    label_axes(time, "Displacement", "time (s)", f"displacement y ({unit})")
    label_axes(error, "Error", "time (s)", f"measured - predicted ({unit})")
    draw_over_time(turns, t, found.turning_points.astype(np.float64), color=FALLING, lw=1.0)
    turns.yaxis.get_major_locator().set_params(integer=True)
    label_axes(turns, "Turning points held", "time (s)", "number")
    save_figure(path, figure)


def _draw_error(axes: Axes, found: Prediction) -> None:
    t = found.record.t_s[found.scored]
    stroke = stroke_of(found.model)
    draw_over_time(axes, t, found.error, color=RISING, lw=0.8)
    axes.axhline(0.0, color=MODEL, lw=0.8)
    if stroke > 0.0:
        one = stroke / 100.0
        share = axes.secondary_yaxis(
            "right", functions=(lambda e: np.divide(e, one), lambda p: np.multiply(p, one))
        )
        share.set_ylabel("% of the stroke")


def _branches(found: Identification) -> list[tuple[NDArray[np.bool_], str, str]]:
    return [(found.rising, "rising", RISING), (~found.rising, "falling", FALLING)]


def _every(size: int) -> NDArray[np.intp]:
    return np.unique(np.linspace(0, size - 1, min(size, POINTS_MAX)).astype(np.intp))


def extremes(*channels: Floats, points: int = POINTS_MAX) -> NDArray[np.intp]:
    """Rows that keep the lowest and highest value of every stretch, so that no peak is lost.

    Parameters
    ----------
    channels
        One or more, each (n,).
    points
        About how many rows are left at most.

    Returns
    -------
    Row numbers, rising; the first and the last row are among them.
    """
    size = channels[0].size
    if size <= points:
        return np.arange(size)
    length = -(-2 * len(channels) * size // points)
    starts = np.arange(0, size, length)
    rows = [np.array([0, size - 1])]
    for values in channels:
        parts = np.pad(values, (0, -size % length), mode="edge").reshape(-1, length)
        rows += [starts + parts.argmin(axis=1), starts + parts.argmax(axis=1)]
    return np.unique(np.concatenate(rows))


def draw_over_time(axes: Axes, t: Floats, values: Floats, **style: object) -> None:
    """Draw a line over time that keeps its peaks."""
    rows = extremes(values)
    axes.plot(t[rows], values[rows], **style)  # type: ignore[arg-type]


def label_axes(axes: Axes, title: str, x: str, y: str, legend: bool = True) -> None:
    """Title, axes, grid, and a legend where something has a label."""
    axes.set_title(title, loc="left", fontweight="bold")
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(color="0.9", lw=0.6)
    axes.set_axisbelow(True)
    if legend and axes.get_legend_handles_labels()[0]:
        axes.legend(framealpha=0.9, edgecolor="none", markerscale=3)


def new_figure() -> Figure:
    """A figure that is drawn without a screen."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 7.5), dpi=90, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save_figure(path: Path, figure: Figure) -> None:
    """Write a PNG, whole or not at all, with nothing in it that differs between runs.

    Raises
    ------
    InputError
        The name does not end in .png, or the folder cannot be written.
    """
    if path.suffix.lower() != ".png":
        raise InputError(f"{path}: pictures are PNG: give a name that ends in .png")
    with replacing(path) as part:
        figure.savefig(part, format="png", metadata={"Software": None})
