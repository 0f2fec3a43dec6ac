"""The picture of an identified model of Yang et al.: its k, c and m over the frequency, Fig. 5."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from madelung.plots import FALLING, MODEL, RISING, label_axes, new_figure, save_figure
from madelung.yang2015 import Yang, polynomial
from madelung.yang2015_identify import YangIdentification

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_rates(path: Path, found: YangIdentification) -> None:
    """Draw k, c and m of every record with their polynomials.

    Raises
    ------
    InputError
        The name does not end in .png, or the folder cannot be written.
    """
    save_figure(path, rates_figure(found))


def rates_figure(found: YangIdentification, paper: Yang | None = None) -> Figure:
    """k, c and m with their 95 % intervals and polynomials, and another model's beside them."""
    figure = new_figure()
    yang = found.model.yang
    assert yang is not None
    unit = found.model.extra.get("y_unit", "um")
    hz = np.linspace(found.rates[0].sine.hz, yang.hz_max, 300)
    names = ("k", f"c ({unit})", "m")
    for i, (axes, name) in enumerate(zip(figure.subplots(3, 1, sharex=True), names, strict=True)):
        counted = [r for r in found.rates if i < 2 or r.m_counts]
        axes.errorbar(
            [r.sine.hz for r in counted],
            [r.value[i] for r in counted],
            [r.half_width[i] for r in counted],
            fmt=".",
            color=RISING,
            capsize=2,
            label="by record, 95 % intervals",
        )
        ours = (yang.k, yang.c, yang.m)[i]
        axes.plot(hz, polynomial(ours, hz), color=MODEL, lw=1.0, label="polynomial, eq. (13)")
        if paper is not None:
            theirs = (paper.k, paper.c, paper.m)[i]
            axes.plot(hz, polynomial(theirs, hz), "--", color=FALLING, label="paper's Table 2")
        label_axes(axes, f"Fig. 5: {name}", "frequency (Hz)", name)
        if i:
            axes.get_legend().remove()
    return figure
