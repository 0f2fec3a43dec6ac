"""The score card of a trial: for the terminal, as one page, and as JSON."""

from __future__ import annotations

import io
import json
from base64 import b64encode
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from madelung.blind.score import is_tuning
from madelung.files import write_atomically

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.console import Group
    from rich.table import Table

Card = Mapping[str, Any]
_HIT, _MISS = "#0072B2", "#D55E00"


def write_card(folder: Path, card: Card) -> None:
    """Write card.json and card.html.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    from madelung.diagnosis.page import render

    write_atomically(folder / "card.json", json.dumps(card, indent=1, allow_nan=False) + "\n")
    filters: dict[str, Callable[..., object]] = {
        "share": share,
        "number": number,
        "percent": percent,
    }
    text = render(
        "card.html.j2",
        filters,
        card=card,
        summary=summary(card),
        tuning=is_tuning(card["commitments"].get("seed", 0)),
        misses=[r for r in card["rows"] if not r["right"]],
        pictures={
            "confusion": _picture(11.0, 7.0, lambda axes: _confusion(axes, card["confusion"])),
            "detectability": _picture(
                6.0, 3.6, lambda axes: _strata(axes, card["by"]["gap over noise"])
            ),
            "reliability": _picture(4.2, 3.6, lambda axes: _reliability(axes, card["reliability"])),
        },
    )
    write_atomically(folder / "card.html", text)


def summary(card: Card) -> list[tuple[str, str]]:
    """The figures that answer what a trial is for: what, and the figure."""
    alarms, sets, pairs = card["false_alarms"], card["sets"], card["pairs"]
    shrink, candidates, where = card["shrinkage"], card["candidates"], card["where"]
    rows = [(f"right: {name}", share(told)) for name, told in card["kinds"].items()]
    rows += [
        (
            "false alarms where nothing acts",
            f"{alarms['alarms']} of {alarms['of']}; at most {percent(alarms['bound95'])} (95 %)",
        ),
        ("a cause named that does not act", share(card["wrong_cause"])),
        ("precision, recall of named effects", _two(sets["precision"], sets["recall"])),
        ("precision, recall in pairs", _two(pairs["precision"], pairs["recall"])),
        ("mean probability given to the truth", number(card["probability"])),
        ("ambiguous, truth among the candidates", share(candidates["coverage"])),
        ("candidates of an ambiguous verdict, mean", number(candidates["mean_size"])),
        (
            "confidence less success, mean size",
            number(card["reliability"]["calibration_error"]),
        ),
        ("first region contains the true one", share(where["first"])),
        ("any region contains the true one", share(where["any"])),
        ("share closed on hold-out, true, median", number(shrink["true_median"])),
        ("claimed less true, median size", number(shrink["off_median"], digits=4)),
        ("true share inside the claimed interval", share(shrink["covered"])),
        ("hold-out made worse", f"{shrink['worse']} of {shrink['cases']}"),
        ("no answer", f"{len(card['not_answered'])} of {card['cases']}"),
        ("seconds a case, median", number(card["seconds"])),
    ]
    return rows


def terminal(card: Card) -> Group:
    """The card as tables for `rich`."""
    from rich.console import Group

    rivals = [
        (
            r["who"],
            percent(r["right"]),
            percent(r["right_where_something_acts"]),
            percent(r["false_alarms"]),
        )
        for r in card["rivals"]
    ]
    tables = [
        _table(f"{card['cases']} cases", ("", ""), summary(card)),
        _table("rivals", ("", "right", "something acts", "false alarms"), rivals),
    ]
    for title in ("size of the effect", "gap over noise", "effect", "noise"):
        told = [(name, share(s), number(s["probability"])) for name, s in card["by"][title].items()]
        tables.append(_table(title, ("", "right", "probability"), told))
    counts = _counts(card["confusion"])
    tables.append(_table("answers", ("truth", "answered (cases)"), counts))
    return Group(*tables)


def _table(title: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, show_header=any(head))
    for name in head:
        table.add_column(name)
    for row in rows:
        table.add_row(*row)
    return table


def _counts(confusion: Card) -> list[tuple[str, str]]:
    """Truth, and its answers from the most frequent on."""
    lines = []
    for truth, cases in zip(confusion["truth"], confusion["cases"], strict=True):
        ranked = sorted(zip(cases, confusion["answer"], strict=True), key=lambda c: -c[0])
        lines.append((truth, ", ".join(f"{name} {n}" for n, name in ranked if n)))
    return lines


def share(told: Mapping[str, Any]) -> str:
    """A share as ``hits of cases, per cent (95 % interval)``."""
    if not told["of"]:
        return "-"
    text = f"{told['hits']} of {told['of']}, {100.0 * told['share']:.1f} %"
    low, high = told["ci95"]
    return f"{text} ({100.0 * low:.0f} to {100.0 * high:.0f} %)"


def number(value: float | None, scale: float = 1.0, digits: int = 3) -> str:
    """A number with so many digits that count, or a dash."""
    return "-" if value is None else f"{scale * value:.{digits}g}"


def percent(value: float | None) -> str:
    """A share in per cent, or a dash."""
    return "-" if value is None else f"{100.0 * value:.1f} %"


def _two(first: float | None, second: float | None) -> str:
    return f"{number(first)}, {number(second)}"


def _picture(width: float, height: float, draw: Callable[[Axes], None]) -> str:
    """A PNG as a data URL."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    draw(figure.add_subplot())
    content = io.BytesIO()
    figure.savefig(content, format="png", metadata={"Software": None})
    return "data:image/png;base64," + b64encode(content.getvalue()).decode("ascii")


def _confusion(axes: Axes, confusion: Card) -> None:
    """Cases by truth and answer, shaded by the share of the truth's cases."""
    counts = np.array(confusion["cases"], np.float64).reshape(-1, len(confusion["answer"]))
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1.0)
    axes.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for (i, j), count in np.ndenumerate(counts):
        if count:
            colour = "white" if shares[i, j] > 0.6 else "black"
            axes.text(j, i, f"{count:.0f}", ha="center", va="center", color=colour, fontsize=9)
    names = [name.replace("_", " ") for name in confusion["answer"]]
    axes.set_xticks(range(len(names)), names, rotation=45, ha="right")
    axes.set_yticks(range(len(counts)), [name.replace("_", " ") for name in confusion["truth"]])
    axes.set_xlabel("answer")
    axes.set_ylabel("truth")


def _strata(axes: Axes, strata: Mapping[str, Mapping[str, Any]]) -> None:
    """Share right with its interval, by stratum."""
    place = np.arange(len(strata))
    shares = np.array([s["share"] for s in strata.values()], np.float64)
    ends = np.array([s["ci95"] for s in strata.values()], np.float64).reshape(-1, 2)
    off = np.abs(ends.T - shares) if len(strata) else None
    axes.errorbar(place, 100.0 * shares, None if off is None else 100.0 * off, fmt="o", color=_HIT)
    labels = [f"{name}\n({s['of']})" for name, s in strata.items()]
    axes.set_xticks(place, labels, fontsize=8)
    axes.set_ylim(-3.0, 103.0)
    axes.set_ylabel("exact cause (%)")
    axes.set_xlabel("gap over noise floor, rms (cases)")
    axes.grid(axis="y", alpha=0.3)


def _reliability(axes: Axes, reliability: Card) -> None:
    """How often verdicts hold against their stated confidence."""
    bins = reliability["bins"]
    axes.plot([0, 1], [0, 1], color="#999999", linewidth=1)
    axes.plot([b["stated"] for b in bins], [b["held"] for b in bins], "o", color=_MISS)
    for b in bins:
        axes.annotate(
            str(b["cases"]), (b["stated"], b["held"]), (4, -10), textcoords="offset points"
        )
    axes.set_xlabel("stated confidence")
    axes.set_ylabel("verdict holds (share)")
    axes.set_xlim(0.0, 1.03)
    axes.set_ylim(-0.03, 1.03)
    axes.grid(alpha=0.3)
