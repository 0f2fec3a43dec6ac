"""Pictures of `madelung reproduce yang2015`, drawn as the paper's figures are, as PNG."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from madelung.plots import FALLING, MEASURED, MODEL, RISING, label_axes, new_figure, save_figure
from madelung.reproduce_yang import (
    DYNAMIC_1500,
    HZ_MAX,
    LINEAR,
    LOOPS_HZ,
    MULTISINE,
    NAMES,
    PROPOSED,
    PUBLISHED,
    RATE_INDEPENDENT_300,
    SETTLE_S,
    SINES_HZ,
    M,
    Scored,
    YangReproduction,
)
from madelung.yang2015 import spectrum, weights_of_harmonics
from madelung.yang2015_plots import rates_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = dict(zip(NAMES, (FALLING, RISING, MODEL), strict=True)) | {LINEAR: "#009E73"}


def draw(out: Path, found: YangReproduction) -> None:
    """Draw fig04.png to fig09.png and limit.png into a folder.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    pictures = {
        "fig04": _fig_4(found),
        "fig05": rates_figure(found.found, PUBLISHED),
        "fig06": _fig_6(),
        "fig07": _fig_7(found),
        "fig07_tables": _fig_7_tables(found),
        "fig08": _fig_8(found),
        "fig09": _fig_9(found),
        "limit": _limit(found),
    }
    for name, figure in pictures.items():
        save_figure(out / f"{name}.png", figure)


def _fig_4(found: YangReproduction) -> Figure:
    figure = new_figure()
    axes = figure.subplots()
    for (hz, (v, y)), colour in zip(found.damping.items(), COLOURS.values(), strict=False):
        axes.plot(v, y, color=colour, label=f"{hz:g} Hz")
    label_axes(axes, "Fig. 4: mth-power velocity damping, c = 0.2, m = 1", "v (200 V)", "y_vd")
    return figure


def _fig_6() -> Figure:
    figure = new_figure()
    figure.set_size_inches(11, 4)
    i = np.arange(1, M + 1)
    titles = ("Fig. 6 (a): A_i", "Fig. 6 (b): lambda_i")
    both = zip(figure.subplots(1, 2), titles, (spectrum(M), weights_of_harmonics(M)), strict=True)
    for axes, title, values in both:
        axes.stem(100.0 * i, values, basefmt="k-")
        label_axes(axes, f"{title}, triangle of 100 Hz", "frequency (Hz)", title[-8:].split()[-1])
    return figure


def _loop(axes: Axes, scored: Scored, name: str) -> None:
    """One measured and one predicted loop, and the error."""
    rows = scored.rows
    axes.plot(scored.record.u_V[rows], scored.measured, color=MEASURED, lw=3, label="stage")
    axes.plot(
        scored.record.u_V[rows], scored.predicted[rows], color=COLOURS[name], lw=0.9, label=name
    )


def _fig_7(found: YangReproduction) -> Figure:
    figure = new_figure()
    figure.set_size_inches(13, 11)
    grid = figure.subplots(3, 3)
    for row, name in zip(grid, NAMES, strict=True):
        for axes, hz in zip(row, LOOPS_HZ, strict=True):
            scored = found.sines[hz][name]
            _loop(axes, scored, name)
            label_axes(
                axes,
                f"{hz:g} Hz: e_max {scored.error[0]:.1f} %, e_rms {scored.error[1]:.1f} %",
                "u (V)",
                "y (um)",
            )
    figure.suptitle("Fig. 7: loops of the simulated stage and of the three models")
    return figure


def _fig_7_tables(found: YangReproduction) -> Figure:
    figure = new_figure()
    figure.set_size_inches(13, 4)
    panels = figure.subplots(1, 3, sharey=True)
    for axes, (hz, (u, alone, both)) in zip(panels, found.published.items(), strict=True):
        axes.plot(u, alone, color=COLOURS[NAMES[0]], label="Table 1: rate-independent")
        axes.plot(u, both, color=COLOURS[NAMES[2]], label="Tables 1, 2: proposed")
        label_axes(axes, f"{hz:g} Hz", "u (V)", "y (um)")
    figure.suptitle("Fig. 7: loops that the published parameters give")
    return figure


def _fig_8(found: YangReproduction) -> Figure:
    figure = new_figure()
    figure.set_size_inches(11, 4.5)
    for i, (axes, what) in enumerate(zip(figure.subplots(1, 2), ("e_max", "e_rms"), strict=True)):
        for name in NAMES:
            errors = [found.sines[hz][name].error[i] for hz in SINES_HZ]
            axes.plot(SINES_HZ, errors, ".-", color=COLOURS[name], label=name)
        for hz, value, name in (
            (300.0, RATE_INDEPENDENT_300[i], NAMES[0]),
            (HZ_MAX, DYNAMIC_1500[i], NAMES[1]),
        ):
            label = "paper, its own stage" if name == NAMES[0] else None
            axes.plot(hz, value, "x", color=COLOURS[name], ms=9, mew=2, label=label)
        axes.axhline(PROPOSED[i], color=MODEL, ls=":", lw=1.0, label="paper, proposed at most")
        label_axes(axes, f"Fig. 8: {what}", "frequency (Hz)", f"{what} (%)")
        axes.legend(framealpha=0.9, edgecolor="none")
    return figure


def _fig_9(found: YangReproduction) -> Figure:
    figure = new_figure()
    figure.set_size_inches(13, 10)
    grid = figure.subplots(3, 3)
    for row, (hz, by) in zip(grid, found.triangles.items(), strict=True):
        loop, time, error = row
        scored = by["clamped"]
        t = _milliseconds(scored)
        shown = t <= 2e3 / hz
        _loop(loop, scored, NAMES[2])
        label_axes(loop, f"Fig. 9: triangle of {hz:g} Hz", "u (V)", "y (um)")
        time.plot(t[shown], scored.measured[shown], color=MEASURED, lw=3, label="stage")
        time.plot(
            t[shown], scored.predicted[scored.rows][shown], color=MODEL, lw=0.9, label="proposed"
        )
        label_axes(time, f"e_max {scored.error[0]:.1f} %", "time (ms)", "y (um)")
        styles = {"clamped": (MODEL, "held at 1500 Hz"), "literal": (RISING, "literal")}
        for name, (colour, label) in styles.items():
            one = by[name]
            off = (one.predicted[one.rows] - one.measured)[shown]
            error.plot(t[shown], off, color=colour, lw=0.9, label=label)
        label_axes(error, "Error", "time (ms)", "predicted - measured (um)")
    return figure


def _milliseconds(scored: Scored) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    t = scored.record.t_s[scored.rows]
    return np.asarray(1e3 * (t - t[0]))


def _limit(found: YangReproduction) -> Figure:
    figure = new_figure()
    figure.set_size_inches(11, 8)
    (left, right), below = figure.subplots(2, 2)
    low, high = MULTISINE.band_hz
    cases = (
        (left, below[0], f"multisine, {low:g} to {high:g} Hz", found.multisine, NAMES[2]),
        (right, below[1], "triangle, 500 Hz", found.triangles[500.0], "clamped"),
    )
    for top, error, what, by, proposed in cases:
        both = {NAMES[2]: by[proposed], LINEAR: by[LINEAR]}
        t = _milliseconds(by[proposed])
        shown = t <= 1e3 * SETTLE_S
        top.plot(t[shown], by[proposed].measured[shown], color=MEASURED, lw=3, label="stage")
        for name, scored in both.items():
            y = scored.predicted[scored.rows]
            top.plot(t[shown], y[shown], color=COLOURS[name], lw=0.9, label=name)
            error.plot(t[shown], (y - scored.measured)[shown], color=COLOURS[name], lw=0.9)
        label_axes(top, what, "time (ms)", "y (um)")
        label_axes(error, "Error", "time (ms)", "predicted - measured (um)")
    return figure
