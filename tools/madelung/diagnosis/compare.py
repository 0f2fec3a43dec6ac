"""Several diagnoses on one page: before and after a repair, the devices of a batch."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median_low
from urllib.parse import quote

import numpy as np

from madelung.diagnosis.page import render
from madelung.diagnosis.report import (
    FILTERS,
    STATUS,
    UNTESTED,
    Bar,
    Diagnosis,
    Quantity,
    bars,
    digits,
    main_parameters,
    named_effects,
    sentence_of_verdict,
    sentence_of_where,
    short,
    spoken,
    state,
    unseen,
)
from madelung.diagnosis.vocabulary import EFFECTS
from madelung.errors import InputError
from madelung.files import read_json, write_atomically

CUT = 5.0
"""Bars are cut where they are so much longer than the middle one of what the baselines miss: one
device out of order leaves the others to be seen."""
Ends = tuple[float, float, float]
_DAMAGED = (KeyError, TypeError, ValueError, AttributeError, IndexError)


@dataclass(frozen=True)
class Compared:
    """A diagnosis as the page shows it.

    Attributes
    ----------
    name, device, link
        Folder, what was diagnosed, address of its report ('' where there is none).
    status
        A key of `STATUS`.
    found, possible
        Effects of the verdict, candidates.
    sizes
        By effect, of what the verdict names: the parameters that the contract names.
    seen_from
        By effect: the smallest size that this campaign could have shown.
    before_um, after_um, floor_um
        Rms on the hold-out; without one before is that of the train records, after None, as it
        is where nothing was fitted.
    gap_um, percent_of_stroke
        Rms of the gap on the train records.
    """

    name: str
    device: str
    link: str
    status: str
    verdict: str
    where: str
    found: list[str]
    possible: list[str]
    sizes: dict[str, list[Quantity]]
    seen_from: dict[str, str]
    before_um: float
    after_um: float | None
    floor_um: float
    gap_um: float
    percent_of_stroke: float

    @property
    def badge(self) -> str:
        """The status in words."""
        return STATUS[self.status]

    @property
    def tested(self) -> bool:
        """Whether effects were looked for."""
        return self.status not in UNTESTED


@dataclass(frozen=True)
class Strip:
    """A parameter over the diagnoses: where value and interval lie on its axis, per cent."""

    title: str
    rows: list[tuple[str, str, tuple[float, ...]]]
    """Name, value with interval; left end, middle, right end."""


def write_comparison(path: Path, outs: Sequence[Path]) -> list[Compared]:
    """Write one page that needs no other file and no network; returns what it shows.

    Parameters
    ----------
    path
        The page, .html.
    outs
        Folders of diagnoses, in the order of the page.

    Raises
    ------
    InputError
        A folder holds no diagnosis.json, or a damaged one; the page cannot be written.
    """
    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{path}: pages are HTML: give a name that ends in .html")
    names = [Path(os.path.realpath(out)).name for out in outs]
    told = [n if names.count(n) == 1 else str(out) for n, out in zip(names, outs, strict=True)]
    compared = [_read(out, name, path.parent) for out, name in zip(outs, told, strict=True)]
    longest = max(max(c.before_um, c.after_um or 0.0, c.floor_um) for c in compared)
    longest = min(longest, CUT * median_low(c.before_um for c in compared) or longest)
    effects = [e for e in EFFECTS if any(e in [*c.found, *c.possible] for c in compared)]
    drawn = [(c, _bars(c, longest)) for c in compared]
    page = render(
        "compare.html.j2",
        FILTERS,
        compared=drawn,
        cut=any("cut" in bar.kind for _, bars_of in drawn for bar in bars_of),
        effects=effects,
        strips=_strips(compared, effects),
        changes=changes(*compared) if len(compared) == 2 else [],
    )
    write_atomically(path, page)
    return compared


def _read(out: Path, name: str, beside: Path) -> Compared:
    source = out / "diagnosis.json"
    d = read_json(source)
    try:
        return _compared(out, name, d, beside)
    except _DAMAGED as error:
        raise InputError(f"{source}: is not a whole diagnosis: run it again") from error


def _compared(out: Path, name: str, d: Diagnosis, beside: Path) -> Compared:
    verdict, shrink, gap = d["verdict"], d["shrink"], d["gap"]
    case = d.get("case", {})
    page = out / "report.html"
    status = {s: s for s in STATUS}[state(d)]
    parts = [e for several in verdict["effects"] for e in several.split("+")]
    return Compared(
        name=short(name),
        device=short(case.get("device", "") if isinstance(case, dict) else case),
        link=quote(os.path.relpath(page, beside)) if page.exists() else "",
        status=status,
        verdict=sentence_of_verdict(d),
        where=sentence_of_where(d),
        found=parts,
        possible=[e for e in named_effects(d) if e not in parts],
        sizes={e: q for e, q in main_parameters(d).items() if e in named_effects(d)},
        seen_from={e: f"{size}, {what}".rstrip(", ") for e, size, what in unseen(d)},
        before_um=float(shrink["rms_before_um"] if shrink["records"] else gap["rms_um"]),
        after_um=(
            float(shrink["rms_after_um"]) if shrink["records"] and status not in UNTESTED else None
        ),
        floor_um=float(gap["noise_floor_um"]),
        gap_um=float(gap["rms_um"]),
        percent_of_stroke=float(gap["percent_of_stroke"]),
    )


def _bars(c: Compared, longest: float) -> list[Bar]:
    return bars(c.before_um, c.after_um, c.floor_um, longest)


def changes(first: Compared, second: Compared) -> list[str]:
    """What went, came and stayed between two diagnoses, in sentences."""
    said = [
        f"The gap of the training records goes from {digits(first.gap_um)} to "
        f"{digits(second.gap_um)} um rms ({digits(first.percent_of_stroke)} to "
        f"{digits(second.percent_of_stroke)} % of the stroke)."
    ]
    for effect in dict.fromkeys([*first.found, *second.found]):
        name = spoken(effect).capitalize()
        before, after = (_size(c, effect) for c in (first, second))
        if not first.tested:
            said.append(f"{name} is found; it was not looked for before.{after}")
        elif not second.tested:
            said.append(f"{name} was not looked for again. Before:{before or ' -'}")
        elif effect not in first.found:
            said.append(f"{name} is new.{after}")
        elif effect in second.found:
            said.append(f"{name} stays. Before:{before or ' -'} After:{after or ' -'}")
        elif effect in second.possible:
            said.append(f"{name} is now one of several candidates. Before:{before or ' -'}")
        else:
            seen = second.seen_from.get(spoken(effect), "not at any size")
            said.append(f"{name} is gone. Before:{before or ' -'} Now it would show from: {seen}.")
    return said


def _size(c: Compared, effect: str) -> str:
    sizes = c.sizes.get(effect, [])
    return f" {sizes[0].said}." if sizes else ""


def _strips(compared: Sequence[Compared], effects: Sequence[str]) -> list[Strip]:
    """A strip for every parameter that several diagnoses hold."""
    held: dict[str, list[tuple[str, str, Ends]]] = {}
    for effect in effects:
        for c in compared:
            for q in c.sizes.get(effect, []):
                if q.ends and np.isfinite(q.ends).all():
                    title = f"{spoken(effect)}: {q.name}"
                    held.setdefault(title, []).append((c.name, q.said, q.ends))
    return [_strip(title, rows) for title, rows in held.items() if len(rows) > 1]


def _strip(title: str, rows: Sequence[tuple[str, str, Ends]]) -> Strip:
    low = min(ends[0] for _, _, ends in rows)
    width = (max(ends[2] for _, _, ends in rows) - low) or 1.0
    placed = [tuple(3.0 + 94.0 * (v - low) / width for v in ends) for _, _, ends in rows]
    return Strip(title, [(n, s, p) for (n, s, _), p in zip(rows, placed, strict=True)])
