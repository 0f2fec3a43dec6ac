"""The interactive figures of a report, as plotly.js wants them, and the rows of the records.

Colours are those of daylight; the page swaps them for `DARK`'s in the dark. A trace of the figures
``time`` and ``loops`` names in ``meta`` which channels of a record it shows: ``t``, ``u``, ``y``,
``baseline``, ``augmented``, ``before`` (y less baseline) or ``after``.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from madelung.diagnosis.noise import Noise
from madelung.diagnosis.pictures import (
    AFTER,
    BEFORE,
    PROBABLE,
    RANKED_MAX,
    View,
    after_turns,
    gap_map,
    in_percent,
    map_limits,
    near_worst,
    printable,
    spectra,
    train_of,
    worst_first,
)
from madelung.errors import InputError
from madelung.plots import FALLING, MEASURED, extremes
from madelung.waveforms import planned

Array = NDArray[np.float64]
Figure = dict[str, Any]

TEXT, GRID, PAPER, FLOOR = "#222222", "#dddddd", "#ffffff", "#999999"
DARK = {
    TEXT: "#e6e6e6",
    GRID: "#3a3f46",
    PAPER: "#16191d",
    FLOOR: "#8b929b",
    AFTER: "#ffffff",
    BEFORE: "#ff7f2a",
    FALLING: "#4fa8e0",
}
"""What a colour of daylight becomes in the dark; the others stay."""
ROWS_MAX = 60_000
"""Rows of all records together that the page holds: 1.5 MB of it."""
RECORDS_MAX = 40
POINTS_NEXT = 4000


def figures(
    views: Sequence[View], noise: Noise | None, diagnosis: Mapping[str, Any]
) -> dict[str, Figure]:
    """The figures by the id of their place in the page; none where there is nothing to draw."""
    drawn = {"ranking": _ranking(diagnosis), "next": _next(diagnosis)}
    if views and noise is not None:
        train = train_of(views)
        drawn |= {
            "time": _time(noise),
            "loops": _loops(noise),
            "map": _map(train),
            "turn": _turn(train, noise),
            "spectrum": _spectrum(train, noise),
        }
    return {name: figure for name, figure in drawn.items() if figure is not None}


def records(views: Sequence[View]) -> list[dict[str, Any]]:
    """The worst records, hold-out first, with at most `ROWS_MAX` rows that keep all extremes."""
    shown = worst_first(views)[:RECORDS_MAX]
    share = np.zeros(len(shown), np.int64)
    by_size = np.argsort([v.t_s.size for v in shown], kind="stable")
    for done, i in enumerate(by_size):  # what short records leave is for the long ones
        share[i] = min(shown[i].t_s.size, (ROWS_MAX - share.sum()) // (len(shown) - done))
    return [_record(v, int(points)) for v, points in zip(shown, share, strict=True)]


def _record(view: View, points: int) -> dict[str, Any]:
    channels = (view.u_V, view.y_um, view.before_um, view.after_um)
    rows = extremes(*channels, points=points)
    worst = view.t_s[near_worst(view)]
    return {
        "name": printable(view.name)[:200],
        "role": "hold-out" if view.role == "holdout" else view.role,
        "size": view.t_s.size,
        "start_s": float(view.t_s[0]),
        "step_s": view.step_s,
        "worst_s": [float(worst[0]), float(worst[-1])],
        "row": _packed(rows, "<i4"),
        "u": _packed(view.u_V[rows], "<f4"),
        "y": _packed(view.y_um[rows], "<f4"),
        "baseline": _packed(view.baseline_um[rows], "<f4"),
        "augmented": _packed(view.augmented_um[rows], "<f4"),
    }


def _packed(values: ArrayLike, kind: str) -> str:
    return b64encode(np.asarray(values).astype(kind).tobytes()).decode("ascii")


def _list(values: Array, digits: int = 5) -> list[Any]:
    """Rounded to significant digits; null where there is no number."""
    if values.ndim > 1:
        return [_list(v, digits) for v in values]
    return [float(f"{v:.{digits}g}") if np.isfinite(v) else None for v in values]


# -- parts of a figure --------------------------------------------------------------------------


def _axis(title: str, **more: Any) -> dict[str, Any]:
    plain = {"gridcolor": GRID, "linecolor": FLOOR, "zeroline": False, "automargin": True}
    return plain | {"title": {"text": title, "standoff": 6}} | more


def _log(title: str, **more: Any) -> dict[str, Any]:
    # Without dtick: plotly labels less than a decade, too.
    return _axis(title, **{"type": "log", "exponentformat": "power"}, **more)


def _layout(height: int, **axes: Any) -> dict[str, Any]:
    return {
        "height": height,
        "paper_bgcolor": PAPER,
        "plot_bgcolor": PAPER,
        "font": {"color": TEXT, "family": "system-ui, sans-serif", "size": 13},
        "margin": {"l": 60, "r": 12, "t": 34, "b": 68},
        "legend": {"orientation": "h", "x": 0, "y": 1.01, "yanchor": "bottom"},
        "hovermode": "closest",
        "dragmode": "zoom",
        **axes,
    }


def _line(colour: str, width: float, name: str, **more: Any) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "line": {"color": colour, "width": width},
        **more,
    }


def _band(noise: Noise, axis: str) -> dict[str, Any]:
    """Two sigma of the noise floor to both sides."""
    end = 2 * noise.rms_um
    return {
        "type": "rect",
        "layer": "below",
        "xref": "paper",
        "x0": 0,
        "x1": 1,
        "yref": axis,
        "y0": -end,
        "y1": end,
        "fillcolor": FLOOR,
        "opacity": 0.3,
        "line": {"width": 0},
    }


def _band_key(axis: str) -> dict[str, Any]:
    """The band's entry in the legend."""
    return {
        "type": "scatter",
        "mode": "markers",
        "name": "noise floor, 2 sigma",
        "x": [None],
        "y": [None],
        "yaxis": axis,
        "marker": {"symbol": "square", "size": 12, "color": FLOOR, "opacity": 0.5},
    }


# -- records ------------------------------------------------------------------------------------

_SHOWN = (
    ("y", "y", MEASURED, 4, "measured"),
    ("baseline", "y", BEFORE, 1.5, "predicted before"),
    ("augmented", "y", AFTER, 1.2, "predicted after"),
    ("before", "y2", BEFORE, 1.2, "error before"),
    ("after", "y2", AFTER, 1.0, "error after"),
)


def _traces(along: str) -> list[Figure]:
    lines: list[Figure] = []
    for channel, axis, colour, width, name in _SHOWN:
        error = axis == "y2"
        group = {"legendgroup": channel, "showlegend": not error}
        meta = {"x": along, "y": channel}
        lines.append(_line(colour, width, name, yaxis=axis, meta=meta, **group))
    return [*lines, _band_key("y2")]


def _time(noise: Noise) -> Figure:
    command = _line(FALLING, 1.2, "command", yaxis="y3", meta={"x": "t", "y": "u"})
    return {
        "data": [*_traces("t"), command | {"showlegend": False}],
        "layout": _layout(
            640,
            xaxis=_axis("time (s)", anchor="y3"),
            yaxis=_axis("displacement (um)", domain=[0.58, 1.0]),
            yaxis2=_axis("error (um)", domain=[0.21, 0.54]),
            yaxis3=_axis("command (V)", domain=[0.0, 0.17]),
            shapes=[_band(noise, "y2")],
        ),
    }


def _loops(noise: Noise) -> Figure:
    return {
        "data": [t | {"showlegend": False} for t in _traces("u")],
        "layout": _layout(
            640,
            xaxis=_axis("command (V)", anchor="y2"),
            yaxis=_axis("displacement (um)", domain=[0.45, 1.0]),
            yaxis2=_axis("error (um)", domain=[0.0, 0.41]),
            shapes=[_band(noise, "y2")],
        ),
    }


# -- where --------------------------------------------------------------------------------------


def _map(views: Sequence[View]) -> Figure:
    u, rate, rms = gap_map(views)
    low, high = map_limits(rms)
    ticks = np.unique(np.concatenate([np.geomspace(low, high, 4), [high]]))
    level = np.log10(np.where(rms > 0, rms, np.nan)).T
    hover = "%{x:.4g} V, %{y:.3g} V/s: %{customdata:.3g} um rms<extra></extra>"
    return {
        "data": [
            {
                "type": "heatmap",
                "x": _list(u),
                "y": _list(rate),
                "z": _list(level),
                "customdata": _list(rms.T),
                "zmin": np.log10(low),
                "zmax": np.log10(high),
                "colorscale": "Cividis",
                "hovertemplate": hover,
                "colorbar": {
                    "title": {"text": "rms (um)", "side": "right"},
                    "tickvals": _list(np.log10(ticks)),
                    "ticktext": [f"{v:.2g}" for v in ticks],
                    "thickness": 14,
                    "outlinewidth": 0,
                },
            }
        ],
        "layout": _layout(
            360, xaxis=_axis("command (V)"), yaxis=_log("rate of the command, magnitude (V/s)")
        ),
    }


def _turn(views: Sequence[View], noise: Noise) -> Figure:
    since, errors = after_turns(views)
    x = _list(since)
    ends = [x[0], x[-1]]
    lines = [
        _line(FLOOR, 4, "noise floor", x=ends, y=[noise.rms_um] * 2),
        _line(BEFORE, 1.8, "before", x=x, y=_list(errors[0]), mode="lines+markers"),
        _line(AFTER, 1.8, "after", x=x, y=_list(errors[1]), mode="lines+markers"),
    ]
    axes = {
        "xaxis": _log("time since the last turn (s)"),
        "yaxis": _log("error, rms (um)"),
    }
    return {"data": lines, "layout": _layout(360, **axes)}


def _spectrum(views: Sequence[View], noise: Noise) -> Figure:
    freq, (before, after, floor) = spectra(views, noise)
    x = _list(freq)
    lines = [
        _line(FLOOR, 4, "noise floor", x=x, y=_list(floor)),
        _line(BEFORE, 1.5, "before", x=x, y=_list(before)),
        _line(AFTER, 1.2, "after", x=x, y=_list(after)),
    ]
    axes = {"xaxis": _log("frequency (Hz)"), "yaxis": _log("error (um / √Hz)")}
    return {"data": lines, "layout": _layout(360, **axes)}


# -- ranking ------------------------------------------------------------------------------------


def _ranking(diagnosis: Mapping[str, Any]) -> Figure | None:
    """Error left by the best hypothesis with each effect, from the noise floor's end."""
    entries = list(diagnosis["ranking"])[:RANKED_MAX]
    if not entries:
        return None
    verdict, gap = diagnosis["verdict"], diagnosis["gap"]
    groups = (
        ("in the verdict", FALLING, "circle", set(verdict["effects"])),
        ("candidate", PROBABLE, "diamond", set(verdict["candidates"]) - set(verdict["effects"])),
    )
    named = groups[0][3] | groups[1][3]
    others = {e["effect"] for e in entries} - named
    data = [
        _dots([e for e in entries if e["effect"] in chosen], label, colour, symbol)
        for label, colour, symbol, chosen in (*groups, ("other", FLOOR, "circle-open", others))
        if any(e["effect"] in chosen for e in entries)
    ]
    for value, label, colour in (
        (gap["noise_floor_um"], "noise floor", AFTER),
        (gap["rms_um"], "baseline", BEFORE),
    ):
        ends = [_plain(entries[0]["effect"]), _plain(entries[-1]["effect"])]
        dash = {"color": colour, "width": 1.5, "dash": "dash"}
        data.append(_line(colour, 1.5, label, x=[max(value, 1e-9)] * 2, y=ends) | {"line": dash})
    layout = _layout(
        110 + 34 * len(entries),
        xaxis=_log("error left, rms (um)"),
        yaxis=_axis(
            "",
            type="category",
            autorange="reversed",
            categoryorder="array",
            categoryarray=[_plain(e["effect"]) for e in entries],
        ),
    )
    layout["margin"] |= {"r": 64}
    layout["annotations"] = [_beside("closed", y=1.0, yref="paper", yanchor="bottom")] + [
        _beside(in_percent(e["closable_closed"]), y=_plain(e["effect"])) for e in entries
    ]
    return {"data": data, "layout": layout}


def _beside(text: str, **place: Any) -> dict[str, Any]:
    """A text in the right margin, where no point, interval or line is."""
    fixed = {"xref": "paper", "x": 1.0, "xanchor": "left", "xshift": 6, "showarrow": False}
    return {"text": text, **fixed, **place}


def _dots(entries: Sequence[Mapping[str, Any]], name: str, colour: str, symbol: str) -> Figure:
    x = np.array([max(float(e["rms_um"]), 1e-9) for e in entries])
    ends = np.array([e.get("rms_um_ci95") or [v, v] for e, v in zip(entries, x, strict=True)])
    return {
        "type": "scatter",
        "mode": "markers",
        "name": name,
        "x": _list(x),
        "y": [_plain(e["effect"]) for e in entries],
        "marker": {"color": colour, "symbol": symbol, "size": 11},
        "error_x": {
            "type": "data",
            "symmetric": False,
            "array": _list(ends[:, 1] - x),
            "arrayminus": _list(x - ends[:, 0]),
            "color": colour,
        },
        "hovertemplate": "%{y}: %{x:.4g} um<extra></extra>",
    }


def _plain(name: object) -> str:
    """A name that plotly shows as it is, markup and all."""
    return escape(printable(name)[:60].replace("_", " "), quote=False)


# -- next experiment ----------------------------------------------------------------------------


def _next(diagnosis: Mapping[str, Any]) -> Figure | None:
    try:
        command = planned(diagnosis["next_experiment"])
    except InputError:  # none, or one in words only
        return None
    t = command.time_s
    u = command.at(t)
    rows = extremes(u, points=POINTS_NEXT)
    return {
        "data": [_line(FALLING, 1.2, "command", x=_list(t[rows], 8), y=_list(u[rows]))],
        "layout": _layout(280, xaxis=_axis("time (s)"), yaxis=_axis("command (V)")),
    }
