"""Pictures of a diagnosis, as PNG: the gap, the loops, where it lies, what explains it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from madelung.diagnosis.noise import Noise
from madelung.diagnosis.regions import senses, since_turn_s
from madelung.plots import (
    FALLING,
    MEASURED,
    MODEL,
    RISING,
    draw_over_time,
    extremes,
    label_axes,
    new_figure,
    save_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

NAMES = ("gap", "loops", "where", "ranking")
BEFORE = RISING
AFTER = MODEL
FLOOR = "0.6"
PROBABLE = "#E69F00"
LOOPS_MAX = 3
BINS_MAP = 40
BINS_PROFILE = 24
BINS_SPECTRUM = 160
ZOOM_TURNS = 2
RANKED_MAX = 15
RATES_RATIO = 1e4
LEGEND_COLUMNS = 5
NOT_RANKED = "Nothing to rank: no effect was fitted that explains more than the noise."


@dataclass(frozen=True)
class View:
    """What is drawn of a record; all arrays (n,), times in s, voltages in V, the rest in um."""

    name: str
    role: str
    t_s: Array
    u_V: Array
    y_um: Array
    baseline_um: Array
    augmented_um: Array

    @property
    def before_um(self) -> Array:
        """Measured less baseline."""
        return self.y_um - self.baseline_um

    @property
    def after_um(self) -> Array:
        """Measured less augmented."""
        return self.y_um - self.augmented_um

    @property
    def step_s(self) -> float:
        """Mean sample time."""
        return float((self.t_s[-1] - self.t_s[0]) / (self.t_s.size - 1))


def draw(out: Path, views: Sequence[View], noise: Noise, diagnosis: Mapping[str, Any]) -> None:
    """Draw gap.png, loops.png, where.png and ranking.png.

    Parameters
    ----------
    out
        Folder that exists.
    views
        Train and hold-out records.
    noise
        The noise floor.
    diagnosis
        The content of diagnosis.json.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    shown = worst_first(views)
    _draw_gap(out / "gap.png", shown[0], noise)
    _draw_loops(out / "loops.png", shown[:LOOPS_MAX])
    _draw_where(out / "where.png", train_of(views), noise, diagnosis)
    _draw_ranking(out / "ranking.png", diagnosis)


def train_of(views: Sequence[View]) -> list[View]:
    """Train records, in which the gap is looked for; all where none is one."""
    return [v for v in views if v.role == "train"] or list(views)


def worst_first(views: Sequence[View]) -> list[View]:
    """Hold-out records before the others, each by its gap."""
    return sorted(views, key=lambda v: (v.role != "holdout", -float(np.std(v.before_um))))


def printable(text: object) -> str:
    """A name from outside without control characters."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in str(text))


def _name(view: View) -> str:
    return f"{printable(view.name)[:40]} ({'hold-out' if view.role == 'holdout' else 'train'})"


# -- gap --------------------------------------------------------------------------------------


def _draw_gap(path: Path, view: View, noise: Noise) -> None:
    figure = new_figure()
    whole, rest, zoom = figure.subplots(3, 1)
    _displacements(whole, view, slice(None))
    label_axes(whole, "", "", "displacement y (um)")
    _legend_above(whole)
    whole.set_title(f"Record {_name(view)}", loc="left", fontweight="bold", parse_math=False)
    _errors(rest, view, slice(None), noise)
    label_axes(rest, "What each prediction misses", "", "error (um)")
    _legend_above(rest)
    rest.set_xlim(*whole.get_xlim())
    near = near_worst(view)
    _errors(zoom, view, near, noise)
    command = zoom.twinx()
    draw_over_time(command, view.t_s[near], view.u_V[near], color=FLOOR, lw=0.8, ls=":")
    command.set_ylabel("command u (V), dotted")
    label_axes(zoom, "The same, close up where the gap is largest", "time (s)", "error (um)")
    _legend_above(zoom)
    save_figure(path, figure)


def _displacements(axes: Axes, view: View, rows: slice) -> None:
    t = view.t_s[rows]
    draw_over_time(axes, t, view.y_um[rows], color=MEASURED, lw=3, label="measured")
    draw_over_time(axes, t, view.baseline_um[rows], color=BEFORE, lw=1.2, label="baseline")
    draw_over_time(axes, t, view.augmented_um[rows], color=AFTER, lw=0.9, label="augmented")


def _errors(axes: Axes, view: View, rows: slice, noise: Noise) -> None:
    t = view.t_s[rows]
    band = 2 * noise.rms_um
    axes.axhspan(-band, band, color="0.85", label="noise floor, 2 sigma")
    draw_over_time(axes, t, view.before_um[rows], color=BEFORE, lw=1.0, label="baseline")
    draw_over_time(axes, t, view.after_um[rows], color=AFTER, lw=0.8, label="augmented")


def _legend_above(axes: Axes) -> None:
    """On the title's line, where it hides nothing."""
    axes.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        borderaxespad=0.1,
        frameon=False,
        ncols=LEGEND_COLUMNS,
    )


def _legend_below(figure: Figure, axes: Axes) -> None:
    """One for axes that show the same, where it hides nothing."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", frameon=False, ncols=LEGEND_COLUMNS)


def near_worst(view: View) -> slice:
    """Rows from some turns of the command before the largest error to some after it."""
    sense = senses(view.u_V)
    turns = np.concatenate([[0], np.flatnonzero(np.diff(sense)), [view.u_V.size - 1]])
    worst = int(np.argmax(np.abs(view.before_um - view.before_um.mean())))
    at = int(np.searchsorted(turns, worst))
    first = int(turns[max(at - ZOOM_TURNS, 0)])
    last = int(turns[min(at + ZOOM_TURNS, turns.size - 1)])
    return slice(first, max(last, first + 2) + 1)


# -- loops ------------------------------------------------------------------------------------


def _draw_loops(path: Path, views: Sequence[View]) -> None:
    figure = new_figure()
    grid = figure.subplots(2, len(views), squeeze=False, sharex="col")
    for (loop, rest), view in zip(grid.T, views, strict=True):
        rows = extremes(view.before_um)
        u = view.u_V[rows]
        loop.plot(u, view.y_um[rows], color=MEASURED, lw=2.5, label="measured")
        loop.plot(u, view.baseline_um[rows], color=BEFORE, lw=1.0, label="baseline")
        loop.plot(u, view.augmented_um[rows], color=AFTER, lw=0.8, label="augmented")
        label_axes(loop, "", "", "displacement y (um)", legend=False)
        loop.set_title(_name(view), loc="left", fontweight="bold", parse_math=False)
        rest.plot(u, view.before_um[rows], color=BEFORE, lw=0.7, label="baseline")
        rest.plot(u, view.after_um[rows], color=AFTER, lw=0.6, label="augmented")
        label_axes(rest, "", "command u (V)", "measured - predicted (um)", legend=False)
    _legend_below(figure, grid[0, 0])
    save_figure(path, figure)


# -- where ------------------------------------------------------------------------------------


def _draw_where(
    path: Path, views: Sequence[View], noise: Noise, diagnosis: Mapping[str, Any]
) -> None:
    figure = new_figure()
    shares, place, spectrum, turn = figure.subplots(2, 2).flat
    _draw_shares(shares, diagnosis.get("where", []))
    _draw_map(place, views)
    _draw_spectrum(spectrum, views, noise)
    _draw_since_turn(turn, views, noise)
    _legend_below(figure, spectrum)
    save_figure(path, figure)


def _draw_shares(axes: Axes, regions: Sequence[Mapping[str, Any]]) -> None:
    at = np.arange(len(regions))
    axes.barh(
        at - 0.2, [100 * r["energy_share"] for r in regions], 0.38, color=BEFORE, label="of the gap"
    )
    samples = [100 * r["energy_share"] / max(r["enrichment"], 1e-12) for r in regions]
    axes.barh(at + 0.2, samples, 0.38, color=FLOOR, label="of the samples")
    axes.set_yticks(at, [region_label(r) for r in regions], parse_math=False)
    axes.invert_yaxis()
    axes.set_xlim(0, 100)
    label_axes(axes, "", "share of the gap's energy and of the samples (%)", "")
    _legend_above(axes)
    if not regions:
        axes.text(0.5, 0.5, "nothing above the noise", ha="center", transform=axes.transAxes)


def region_label(region: Mapping[str, Any]) -> str:
    """A region in few words."""
    low, high, side = region["low"], region["high"], region.get("side", "between")
    axis = str(region["axis"]).replace("_", " ")
    if axis == "record":
        return f"record {printable(low)[:24]}"
    if isinstance(low, str) or high is None:
        return f"{axis}: {str(low).replace('_', ' ')}"
    ends = {"above": f"≥ {low:.4g}", "below": f"≤ {high:.4g}"}
    between = f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"
    unit = "turning point" if axis == "nesting" and low == high == 1 else region["unit"]
    said = f"{axis} {ends.get(side, between)} {unit}".rstrip()
    return f"{said} in {printable(region['record'])[:24]}" if "record" in region else said


def gap_map(views: Sequence[View]) -> tuple[Array, Array, Array]:
    """Rms of the gap over input and rate.

    Returns
    -------
    Edges in V, (k + 1,); edges in V/s, (k + 1,), on a logarithmic axis, all slower rates, rest
    included, in the lowest; rms in um, (k, k), NaN where no row was. The gap's mean over all
    views is taken away.
    """
    u = np.concatenate([v.u_V for v in views])
    rate = np.concatenate([np.abs(np.gradient(v.u_V, v.step_s)) for v in views])
    gap2 = (np.concatenate([v.before_um for v in views]) - mean_gap(views)) ** 2
    top = max(float(rate.max()), 1e-9)
    bottom = max(float(np.quantile(rate, 0.02)), top / RATES_RATIO)
    edges = (
        np.linspace(float(u.min()), float(u.max()), BINS_MAP + 1),
        np.geomspace(bottom, 1.0001 * top, BINS_MAP + 1),
    )
    rate = np.maximum(rate, bottom)
    count = np.histogram2d(u, rate, edges)[0]
    held = np.histogram2d(u, rate, edges, weights=gap2)[0]
    rms = np.sqrt(np.divide(held, count, out=np.full_like(held, np.nan), where=count > 0))
    return (*edges, rms)


def map_limits(rms: Array) -> tuple[float, float]:
    """Lowest and highest rms, um, of the colours of `gap_map`."""
    good = rms[rms > 0]
    high = float(good.max()) if good.size else 1.0
    low = max(float(np.quantile(good, 0.05)), 1e-3 * high) if good.size else 0.1
    return min(low, 0.9 * high), high


def mean_gap(views: Sequence[View]) -> float:
    """Of measured less baseline over all rows, um."""
    return float(np.mean(np.concatenate([v.before_um for v in views])))


def _draw_map(axes: Axes, views: Sequence[View]) -> None:
    from matplotlib.colors import LogNorm

    u, rate, rms = gap_map(views)
    norm = LogNorm(*map_limits(rms))
    drawn = axes.pcolormesh(u, rate, rms.T, cmap="cividis", norm=norm)
    axes.set_yscale("log")
    axes.figure.colorbar(drawn, ax=axes).set_label("rms (um)")
    label_axes(axes, "Gap over command and rate", "command u (V)", "rate, magnitude (V/s)")


def spectra(views: Sequence[View], noise: Noise) -> tuple[Array, Array]:
    """Amplitude densities over all records.

    Returns
    -------
    Frequencies in Hz, (k,); the error before, after, and the noise floor in um / sqrt(Hz), (3, k).
    """
    mean = mean_gap(views)
    low = min(1.0 / (v.t_s.size * v.step_s) for v in views)
    high = max(0.5 / v.step_s for v in views)
    edges = np.geomspace(low, high, BINS_SPECTRUM + 1)
    sums = np.zeros((4, BINS_SPECTRUM))
    for view in views:
        freq, before = _power(view.before_um - mean, view.step_s)
        floor = 2 * view.step_s * noise.spectrum(freq, view.step_s)
        at = np.clip(np.searchsorted(edges, freq, side="right") - 1, 0, BINS_SPECTRUM - 1)
        each = (np.ones_like(freq), before, _power(view.after_um, view.step_s)[1], floor)
        sums += [np.bincount(at, w, BINS_SPECTRUM) for w in each]
    good = sums[0] > 0
    return np.sqrt(edges[1:] * edges[:-1])[good], np.sqrt(sums[1:, good] / sums[0, good])


def _draw_spectrum(axes: Axes, views: Sequence[View], noise: Noise) -> None:
    freq, densities = spectra(views, noise)
    lines = ((BEFORE, 1.2, "baseline"), (AFTER, 1.0, "augmented"), (FLOOR, 2.0, "noise floor"))
    for density, (colour, width, label) in zip(densities, lines, strict=True):
        axes.loglog(freq, density, color=colour, lw=width, label=label)
    label_axes(axes, "Spectrum", "frequency (Hz)", "error (um / √Hz)", legend=False)


def _power(error_um: Array, step_s: float) -> tuple[Array, Array]:
    """Frequency, Hz, and one-sided density, um^2 / Hz, without the mean."""
    from scipy.fft import next_fast_len, rfft, rfftfreq

    n = int(next_fast_len(error_um.size, real=True))
    density = 2 * step_s * np.abs(rfft(error_um, n)) ** 2 / error_um.size
    return rfftfreq(n, step_s)[1:], density[1:]


def after_turns(views: Sequence[View]) -> tuple[Array, Array]:
    """Error over the time since the last turn of the command.

    Returns
    -------
    Times in s, (k,); rms of the error before and after in um, (2, k).
    """
    since = np.concatenate([since_turn_s(v.u_V, v.step_s) for v in views])
    moved = since > 0
    since = since[moved]
    edges = np.geomspace(since.min(), since.max() * 1.001, BINS_PROFILE + 1)
    at = np.searchsorted(edges, since, side="right") - 1
    count = np.bincount(at, minlength=BINS_PROFILE)
    good = count > 0
    before = np.concatenate([v.before_um for v in views]) - mean_gap(views)
    after = np.concatenate([v.after_um for v in views])
    sums = np.stack([np.bincount(at, e[moved] ** 2, BINS_PROFILE)[good] for e in (before, after)])
    return np.sqrt(edges[1:] * edges[:-1])[good], np.sqrt(sums / count[good])


def _draw_since_turn(axes: Axes, views: Sequence[View], noise: Noise) -> None:
    since, errors = after_turns(views)
    for rms, colour, label in zip(errors, (BEFORE, AFTER), ("baseline", "augmented"), strict=True):
        axes.loglog(since, rms, ".-", color=colour, lw=1, label=label)
    axes.axhline(noise.rms_um, color=FLOOR, lw=2, label="noise floor")
    title = "Error after a turn of the command"
    label_axes(axes, title, "time since the turn (s)", "rms (um)", legend=False)


# -- ranking ----------------------------------------------------------------------------------


def _draw_ranking(path: Path, diagnosis: Mapping[str, Any]) -> None:
    figure = new_figure()
    axes = figure.subplots()
    ranking = list(diagnosis.get("ranking", []))[:RANKED_MAX]
    figure.set_size_inches(11, 1.8 + 0.32 * len(ranking))
    if not ranking:
        axes.set_axis_off()
        axes.text(0.5, 0.5, NOT_RANKED, ha="center", va="center", transform=axes.transAxes)
        save_figure(path, figure)
        return
    verdict, gap = diagnosis["verdict"], diagnosis["gap"]
    floor = max(float(gap["noise_floor_um"]), 1e-9)
    for i, entry in enumerate(ranking):
        colour = _colour(entry["effect"], verdict)
        left = max(float(entry["rms_um"]), 1e-9)
        axes.hlines(i, floor, left, color=colour, lw=4)
        axes.plot(left, i, "o", color=colour, ms=9)
        axes.annotate(
            in_percent(entry["closable_closed"]),
            (1.0, float(i)),
            xycoords=axes.get_yaxis_transform(),
            xytext=(6, 0),
            textcoords="offset points",
            va="center",
        )
    axes.axvline(floor, color=MODEL, lw=1.5, ls="--", label="noise floor")
    axes.axvline(max(float(gap["rms_um"]), 1e-9), color=BEFORE, lw=1.5, label="baseline")
    for label, colour in (("in the verdict", FALLING), ("candidate", PROBABLE), ("other", FLOOR)):
        axes.plot([], [], "o", color=colour, label=label)
    axes.set_yticks(range(len(ranking)), [str(r["effect"]).replace("_", " ") for r in ranking])
    axes.invert_yaxis()
    axes.set_xscale("log")
    axes.margins(x=0.08)
    title = "error left by the best hypothesis with the effect, rms (um); beside it: % closed"
    label_axes(axes, "", title, "")
    _legend_above(axes)
    save_figure(path, figure)


def _colour(effect: str, verdict: Mapping[str, Any]) -> str:
    if effect in verdict["effects"]:
        return FALLING
    return PROBABLE if effect in verdict["candidates"] else FLOOR


def in_percent(share: float | None) -> str:
    """A share in per cent, with a decimal where it is nearly whole; '-' where there is none."""
    return in_percents([share])[0]


def in_percents(shares: Sequence[float | None]) -> list[str]:
    """A share and the ends of its interval in per cent, all with as many decimals.

    One where they lie within 1 %, or where a single one is nearly whole.
    """
    known = [100.0 * s for s in shares if s is not None]
    near = bool(known) and max(known) - min(known) < 1.0
    places = int(near and (len(known) > 1 or abs(known[0] - 100.0) < 1.5))
    # Adding 0 to what is rounded makes 0 of -0.
    return ["-" if s is None else f"{round(100.0 * s, places) + 0.0:.{places}f} %" for s in shares]
