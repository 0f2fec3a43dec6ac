"""An identification as an interactive page: one HTML file that needs no network."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from madelung.errors import InputError
from madelung.files import write_atomically
from madelung.identify import Identification
from madelung.plots import FALLING, MEASURED, MODEL, RISING

POINTS_MAX = 4000
"""Points that a browser draws quickly without WebGL, which not every machine has."""


def write_identification(path: Path, found: Identification) -> None:
    """Write the loop, the rows mapped onto the ascending branch, what is left, and the asymmetry.

    Of a long record every n-th row is shown.

    Raises
    ------
    InputError
        The name does not end in .html, or the folder cannot be written.
    """
    from plotly.subplots import make_subplots

    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{path}: pages are HTML: give a name that ends in .html")
    titles = ("Major loop", "Both branches on the ascending one", "What the fit leaves")
    figure = make_subplots(
        2, 2, subplot_titles=(*titles, "Asymmetry of the loop"), vertical_spacing=0.14
    )
    for place, traces in enumerate(_traces(found)):
        row, column = divmod(place, 2)
        figure.add_traces(traces, rows=row + 1, cols=column + 1)
    unit = str(found.model.extra.get("y_unit", "um"))
    x, u = "x = u - u_min (V)", "command u (V)"
    for place, (along, up) in enumerate(
        (
            (u, f"displacement y ({unit})"),
            (x, f"y ({unit})"),
            (u, f"measured - fitted ({unit})"),
            (x, f"rising - mirrored falling ({unit})"),
        )
    ):
        row, column = divmod(place, 2)
        figure.update_xaxes(title_text=along, row=row + 1, col=column + 1)
        figure.update_yaxes(title_text=up, row=row + 1, col=column + 1)
    figure.update_layout(template="simple_white", height=900, hovermode="closest")
    text = figure.to_html(include_plotlyjs=True, div_id="identification", full_html=True)
    write_atomically(path, text.rstrip() + "\n")


def _traces(found: Identification) -> list[list[Any]]:
    """The traces of the four panels."""
    from plotly.graph_objects import Scatter

    model = found.model
    f0 = Polynomial(model.f0)
    x = np.linspace(0.0, model.range_V, 300)
    fall = f0(0.0) + f0(model.range_V) - f0(model.range_V - x)
    rows = np.unique(
        np.linspace(0, found.y.size - 1, min(found.y.size, POINTS_MAX)).astype(np.intp)
    )
    u = found.x_V + model.u_min_V
    left = found.y - found.fitted
    x_t, y_t = found.mapped
    centre = (np.arange(found.asymmetry.size) + 0.5) * model.range_V / found.asymmetry.size

    def points(x: Any, y: Any, of: Any, name: str, colour: str, legend: bool) -> Any:
        return Scatter(
            x=x[of],
            y=y[of],
            mode="markers",
            marker={"size": 4, "color": colour},
            name=name,
            legendgroup=name,
            showlegend=legend,
        )

    def line(x: Any, y: Any, name: str, colour: str) -> Any:
        return Scatter(x=x, y=y, mode="lines", line={"color": colour, "width": 2}, name=name)

    def branches(x: Any, y: Any, legend: bool) -> list[Any]:
        rising, falling = rows[found.rising[rows]], rows[~found.rising[rows]]
        return [
            points(x, y, rising, "rising", RISING, legend),
            points(x, y, falling, "falling", FALLING, legend),
        ]

    loop = line(
        np.append(x, x[::-1]) + model.u_min_V,
        np.append(f0(x), fall[::-1]),
        f"model, degree {len(model.f0) - 1}",
        MODEL,
    )
    return [
        [points(u, found.y, rows, "measured", MEASURED, True), loop],
        [*branches(x_t, y_t, True), line(x, f0(x), "f0", MODEL)],
        branches(u, left, False),
        [line(centre, found.asymmetry, "asymmetry", RISING)],
    ]
