"""The picture of a capture: the pin's trace, and time per cycle."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from madelung.plots import FALLING, MEASURED, MODEL, RISING, label_axes, new_figure, save_figure
from madelung.timing import PAPER_LINE_US, PAPER_TEXT_US, Timing, line_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NEIGHBOURS = 2
"""Cycles drawn before and after the longest one."""


def draw_timing(path: Path, found: Timing) -> None:
    """Draw the pin about the longest cycle; below, time against p, or over the capture without p.

    Raises
    ------
    InputError
        The name does not end in .png, or the folder cannot be written.
    """
    figure = new_figure()
    figure.set_size_inches(9, 5.5)
    trace, zoom, time = figure.subplot_mosaic([["trace", "zoom"], ["time", "time"]]).values()
    first = max(found.worst - NEIGHBOURS, 0)
    _draw_pin(trace, found, first, min(found.worst + NEIGHBOURS, found.computation_s.size - 1))
    label_axes(trace, "Timing pin", f"time from {found.capture.rises_s[first]:.6f} s (us)", "")
    _draw_pin(zoom, found, found.worst, found.worst)
    label_axes(zoom, f"Longest cycle, number {found.worst}", "time from its rise (us)", "")
    if found.p is None:
        _draw_over_time(time, found)
    else:
        _draw_over_p(time, found)
    save_figure(path, figure)


def _draw_pin(axes: Axes, found: Timing, first: int, last: int) -> None:
    rises = found.capture.rises_s[first : last + 1] - found.capture.rises_s[first]
    falls = rises + found.computation_s[first : last + 1]
    margin = 0.15 * (falls[-1] - rises[0])
    t = np.concatenate(([-margin], np.column_stack((rises, falls)).ravel(), [falls[-1] + margin]))
    level = np.concatenate((np.arange(t.size - 1) % 2, [0]))
    axes.step(t * 1e6, level, where="post", color=MODEL, lw=1.2)
    axes.set_yticks([0, 1], ["low", "high"])
    axes.set_ylim(-0.3, 1.4)


def _draw_over_p(axes: Axes, found: Timing) -> None:
    table = found.by_p()
    p = table["p"].to_numpy(np.float64)
    axes.plot(p, table["mean_s"] * 1e6, "o", color=MEASURED, ms=5, label="mean")
    axes.plot(p, table["max_s"] * 1e6, "^", color=FALLING, ms=5, label="longest")
    reach = np.array([0.0, max(float(p.max()), *PAPER_TEXT_US)])
    if found.line_s is not None:
        start, per = (1e6 * v for v in found.line_s)
        label = f"line {line_text(found.line_s)}"
        axes.plot(reach, start + per * reach, color=MODEL, lw=1.2, label=label)
    start, per = PAPER_LINE_US
    label = f"paper, F28335 at 150 MHz:\n{start} + {per} p us"
    axes.plot(reach, start + per * reach, "--", color=RISING, lw=1.2, label=label)
    axes.plot(*zip(*PAPER_TEXT_US.items(), strict=True), "x", color=RISING, label="paper's text")
    axes.set_ylim(bottom=0.0)
    label_axes(axes, "Computation time", "comparisons p of the paper's search", "us")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)


def _draw_over_time(axes: Axes, found: Timing) -> None:
    axes.plot(found.capture.rises_s, found.computation_s * 1e6, ".", color=MEASURED, ms=3)
    axes.set_ylim(bottom=0.0)
    label_axes(axes, "Computation time of every cycle", "time (s)", "us")
