"""Pictures of `madelung reproduce`, drawn as the paper's figures are, as PNG."""

from __future__ import annotations

from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import Polynomial

from madelung.identify import Identification
from madelung.plots import FALLING, MEASURED, MODEL, RISING, label_axes, new_figure, save_figure
from madelung.reproduce import EQ_20, FIG_14_US, LINE_US, MAX_ERROR_UM, MCT_US, Reproduction

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def draw(out: Path, found: Reproduction) -> None:
    """Draw fig06.png to fig14.png into a folder.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    pictures = {
        "fig06": _fig_6(found),
        "fig07": _fig_7(found),
        "fig08": _fig_8(found),
        "fig11": _fig_11(found),
        "fig12": _fig_12(found),
        "fig13": _fig_13(found),
        "fig14": _fig_14(found),
    }
    for name, figure in pictures.items():
        save_figure(out / f"{name}.png", figure)


def _loop(axes: Axes, found: Identification) -> None:
    """Rows of both branches, and f0."""
    for rising, name, colour in (
        (found.rising, "ascending", MEASURED),
        (~found.rising, "descending", RISING),
    ):
        axes.plot(found.x_V[rising], found.y[rising], ".", color=colour, ms=3, label=name)
    x = np.linspace(0.0, found.model.range_V, 300)
    axes.plot(x, Polynomial(found.model.f0)(x), color=MODEL, lw=1.5, label="f0 identified")


def _fig_6(found: Reproduction) -> Figure:
    figure = new_figure()
    axes = figure.subplots()
    _loop(axes, found.example_1)
    label_axes(axes, "Fig. 6: noisy loop of x^2, and f0 identified from it", "input x", "output y")
    return figure


def _fig_7(found: Reproduction) -> Figure:
    figure = new_figure()
    figure.set_size_inches(13, 9)
    grid = figure.subplots(4, 4)
    for i, one in enumerate(found.example_2):
        row, column = divmod(i, 2)
        over_time, loop = grid[row, 2 * column], grid[row, 2 * column + 1]
        over_time.plot(one.t_s, one.play, color=MEASURED, lw=3)
        over_time.plot(one.t_s, one.ours, color=MODEL, lw=0.9)
        label_axes(over_time, one.name, "time (s)", "output")
        loop.plot(one.x, one.play, color=MEASURED, lw=3, label="ten play operators")
        loop.plot(one.x, one.ours, color=MODEL, lw=0.9, label="trajectory")
        label_axes(loop, f"off by {one.off['float32']:.1e}", "input x", "output")
        if i:
            loop.get_legend().remove()
    figure.suptitle("Fig. 7: the PI model of Table 1 and the trajectory with f_PI, in float")
    return figure


def _fig_8(found: Reproduction) -> Figure:
    figure = new_figure()
    panels = figure.subplots(1, 2 if found.costs else 1, squeeze=False)[0]
    p = np.arange(1, 13)
    panels[0].plot(p, LINE_US[0] + LINE_US[1] * p, color=MODEL, label="0.57 + 0.19 p")
    panels[0].plot([12, 4], [MCT_US, FIG_14_US], "x", color=MODEL, label="given in the text")
    label_axes(panels[0], "Fig. 8: paper, F28335 at 150 MHz", "comparisons p", "time (us)")
    for cost, colour in zip(found.costs, cycle((RISING, FALLING, MEASURED)), strict=False):
        panels[1].plot(cost.p, cost.most_us, "-", color=colour, label=f"{cost.name}, most")
        panels[1].plot(cost.p, cost.mean_us, ":", color=colour, label=f"{cost.name}, mean")
    if found.costs:
        label_axes(panels[1], "Captured pin", "comparisons p of Fig. 2's search", "time (us)")
    for axes in panels:
        axes.set_ylim(bottom=0.0)
        axes.set_xticks(p[1::2])
    return figure


def _fig_11(found: Reproduction) -> Figure:
    figure = new_figure()
    axes = figure.subplots()
    _loop(axes, found.fitted)
    x = np.linspace(0.0, EQ_20.range_V, 300)
    axes.plot(
        x, Polynomial(EQ_20.f0)(x), "--", color=FALLING, lw=1.5, label="the paper's f0, eq. (20)"
    )
    label_axes(axes, "Fig. 11: loop of the simulated stage", "voltage (V)", "displacement (um)")
    return figure


def _fig_12(found: Reproduction) -> Figure:
    figure = new_figure()
    axes = figure.subplots()
    record = found.predicted.record
    axes.plot(record.t_s, record.u_V, color=MODEL, lw=1.0)
    label_axes(axes, "Fig. 12: test signal", "time (s)", "voltage (V)")
    return figure


def _fig_13(found: Reproduction) -> Figure:
    figure = new_figure()
    position, error = figure.subplots(2, 1, sharex=True)
    record, predicted = found.predicted.record, found.predicted.predicted
    assert record.y is not None
    position.plot(record.t_s, record.y, color=MEASURED, lw=3, label="simulated stage")
    position.plot(record.t_s, predicted, color=MODEL, lw=0.9, label="predicted")
    label_axes(position, "Fig. 13: prediction", "time (s)", "displacement (um)")
    error.plot(record.t_s[found.predicted.scored], found.predicted.error, color=RISING, lw=0.8)
    for sign in (-1.0, 1.0):
        error.axhline(
            sign * MAX_ERROR_UM,
            color=FALLING,
            ls="--",
            lw=1.0,
            label="the paper's largest, on its own actuator" if sign > 0.0 else None,
        )
    label_axes(error, "Error", "time (s)", "measured - predicted (um)")
    return figure


def _fig_14(found: Reproduction) -> Figure:
    from matplotlib.ticker import MaxNLocator

    figure = new_figure()
    axes = figure.subplots()
    t = found.predicted.record.t_s
    axes.plot(t, found.turning_points, color=MODEL, lw=1.0, drawstyle="steps-post")
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    label_axes(axes, "Fig. 14: turning points held", "time (s)", "number")
    return figure
