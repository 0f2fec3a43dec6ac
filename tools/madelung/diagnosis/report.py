"""The diagnosis for people: sentences, at most twenty lines for a terminal, and report.html.

Beside the keys of diagnosis.schema.json these are shown where they are there: ``case`` (object or
text), ``records``, ``versions``, ``seed``, ``command``, ``warnings``, ``where[].sentence``,
``ranking[].rms_um_ci95``, ``shrink.regions[]`` with ``rms_before_um`` and ``rms_after_um``, and
everything in ``next_experiment``, ``checked`` and ``good_enough_below_percent``: no effect was
fitted, because that was asked for or because the gap is below the tolerance.
"""

from __future__ import annotations

import math
import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from madelung.diagnosis.figures import DARK, figures, records
from madelung.diagnosis.noise import Noise
from madelung.diagnosis.page import render
from madelung.diagnosis.pictures import (
    NAMES,
    View,
    in_percent,
    in_percents,
    printable,
    region_label,
)
from madelung.diagnosis.remedies import ACTIONS, KINDS, Action
from madelung.diagnosis.vocabulary import EFFECTS, SIZES
from madelung.export import RATE_HZ
from madelung.files import write_atomically

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderResult

Diagnosis = Mapping[str, Any]

LINES_MAX = 20
FAULTS_MAX = 30
UNITS = {
    "per_V_s": "1/(V s)",
    "V_per_s": "V/s",
    "um_per_s": "um/s",
    "per_decade": "of the step per decade of time",
    "hz": "Hz",
    "ppm": "ppm",
    "um": "um",
    "V": "V",
    "s": "s",
}
STATUS = {
    "identified": "Identified",
    "ambiguous": "Ambiguous",
    "unknown": "Unknown cause",
    "no_gap": "No gap",
    "good_enough": "Good enough",
    "checked": "Checked only",
}
"""By `state`."""
UNTESTED = ("good_enough", "checked")
"""States in which no effect was fitted."""
FLOOR_TIMES = 1.05
"""A hold-out whose error is below so many noise floors shows no gap to speak of."""
NAME_MAX = 120
TEXT_MAX = 2000
"""Characters of a name and of a text from outside that the page shows."""
FIXED = "fixed"
"""In an interval's place."""
CAPTIONS = {
    "gap": "What was measured and predicted, and what each prediction misses, in time.",
    "loops": "The same as loops over the command.",
    "where": "Where the gap of the training records lies.",
    "ranking": "What each effect explains, on the training records.",
}


# -- sentences --------------------------------------------------------------------------------


def spoken(effect: str) -> str:
    """An effect's name, or several joined by '+', in words."""
    return effect.replace("_", " ").replace("+", " with ")


def listed(names: Sequence[str], last: str = "and") -> str:
    """'a, b and c'."""
    said = [spoken(n) for n in names]
    return said[0] if len(said) == 1 else f"{', '.join(said[:-1])} {last} {said[-1]}"


def state(diagnosis: Diagnosis) -> str:
    """The verdict's status, or why no effect was looked for: a key of `STATUS`."""
    if diagnosis.get("good_enough_below_percent") is not None:
        return "good_enough"
    return "checked" if diagnosis.get("checked") else str(diagnosis["verdict"]["status"])


def sentence_of_verdict(diagnosis: Diagnosis) -> str:
    """What was found, in a sentence or two, with the confidence."""
    verdict, gap = diagnosis["verdict"], diagnosis["gap"]
    effects, candidates = verdict["effects"], verdict["candidates"]
    if state(diagnosis) == "good_enough":
        return (
            f"Good enough: the gap is {gap['percent_of_stroke']:.3g} % of the stroke, below the "
            f"{diagnosis['good_enough_below_percent']:g} % that --tolerance allows."
        )
    if state(diagnosis) == "checked":
        return (
            f"Checked only, no effect was fitted: the baseline misses {gap['rms_um']:.3g} um rms, "
            f"the noise floor is {gap['noise_floor_um']:.3g} um."
        )
    sure = f"confidence {100 * verdict['confidence']:.0f} %"
    left = f"{100 * verdict['remainder_share']:.1f} % of the gap's energy"
    if verdict["status"] == "identified":
        count = "cause of the gap is" if len(effects) == 1 else "causes of the gap are"
        return f"The {count} {listed(effects)} ({sure}; {left} stays unexplained)."
    if verdict["status"] == "ambiguous":
        proven = f" {listed(effects).capitalize()} is part of it in any case." if effects else ""
        which = listed(candidates, "or") if candidates else "which effect"
        return f"The cause is {which}: this data cannot tell them apart ({sure}).{proven}"
    if verdict["status"] == "unknown":
        known = effects or candidates
        proven = f" What is proven all the same: {listed(known)}." if known else ""
        return f"No effect of the list explains the gap: {left} stays unexplained ({sure}).{proven}"
    return (
        f"There is no gap that this campaign could show: the baseline misses {gap['rms_um']:.3g} "
        f"um rms, the noise floor is {gap['noise_floor_um']:.3g} um ({sure})."
    )


def sentence_of_where(diagnosis: Diagnosis) -> str:
    """The most telling region, or that there is none."""
    regions = diagnosis["where"]
    if not regions:
        return "The gap lies nowhere in particular."
    return f"{_told(regions[0])}."


def sentence_of_shrink(diagnosis: Diagnosis) -> str:
    """How far the gap shrinks on the hold-out records."""
    shrink, floor = diagnosis["shrink"], diagnosis["gap"]["noise_floor_um"]
    if not shrink["records"]:
        return "There is no hold-out record: how far the gap shrinks is not known."
    before, after = shrink["rms_before_um"], shrink["rms_after_um"]
    said = (
        f"On the hold-out records the error goes from {before:.3g} to {after:.3g} um rms; "
        f"the noise floor is {floor:.3g} um"
    )
    closed, ci95 = shrink["closable_closed"], shrink["closable_closed_ci95"]
    if closed is None:
        return f"{said}: nothing there can be closed{_unexcited(diagnosis)}."
    share, *ends = in_percents([closed, *(ci95 or [])])
    between = f" (95 %: {ends[0]} to {ends[1]})" if ends else ""
    above = float(share.removesuffix(" %")) > 100.0
    more = "; above 100 %: less is left than the noise floor, which is an estimate" if above else ""
    return f"{said}: {share}{between} of what can be closed is closed{more}{_unexcited(diagnosis)}."


def _unexcited(diagnosis: Diagnosis) -> str:
    """What to add where the train records show a gap and the hold-out hardly any."""
    least = FLOOR_TIMES * diagnosis["gap"]["noise_floor_um"]
    if state(diagnosis) == "no_gap" or diagnosis["gap"]["rms_um"] <= least:
        return ""
    quiet = diagnosis["shrink"]["rms_before_um"] <= least
    return "; the hold-out does not excite the cause" if quiet else ""


def _told(region: Mapping[str, Any]) -> str:
    share, times = 100 * region["energy_share"], region["enrichment"]
    plain = f"{share:.0f} % of the gap lies at {region_label(region)}, {times:.2g} times its share"
    return printable(region.get("sentence", plain))


def sentence_of_next(diagnosis: Diagnosis) -> str | None:
    """The next experiment, and why, where there is one."""
    asked = diagnosis.get("next_experiment")
    if not asked:
        return None
    why = f"{printable(asked['why'])}: " if "why" in asked else ""
    return why + _inline({k: v for k, v in asked.items() if k != "why"})


# -- tables -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Quantity:
    """A parameter in words: name, value and interval with unit; as numbers in the key's unit."""

    effect: str
    name: str
    value: str
    ci95: str
    unit: str
    ends: tuple[float, float, float] | None = None
    """Low end, value, high end."""

    @property
    def said(self) -> str:
        """On a line."""
        sure = self.ci95 if self.ci95 == FIXED else f"95 %: {self.ci95}"
        return " ".join(f"{self.name} = {self.value} {self.unit} ({sure})".split())


def split_unit(key: str) -> tuple[str, str]:
    """Name and unit of a parameter's key; a number at its end tells equals apart (freq_hz_2)."""
    if after_s(key) is not None:  # no time, though it ends in one
        return key.replace("_", " "), "of the step"
    if mode := re.fullmatch(r"share(\d+)", key):
        return f"share of mode {mode[1]}", "of the displacement"
    key, number = re.fullmatch(r"(.*?)(_\d+)?", key).groups("")  # type: ignore[union-attr]
    for suffix, unit in UNITS.items():
        if key.endswith(f"_{suffix}"):
            return f"{key.removesuffix(f'_{suffix}')}{number}".replace("_", " "), unit
    return f"{key}{number}".replace("_", " "), ""


def after_s(key: str) -> float | None:
    """Time constant in a key of creep's ladder (gain_at_10_s), s."""
    found = re.fullmatch(r"gain_at_([\d.e+-]+)_s", key)
    return float(found[1]) if found else None


def named_effects(diagnosis: Diagnosis) -> list[str]:
    """Effects of the verdict, then its candidates, each once."""
    verdict = diagnosis["verdict"]
    parts = [e for name in [*verdict["effects"], *verdict["candidates"]] for e in name.split("+")]
    return list(dict.fromkeys(parts))


def quantities(diagnosis: Diagnosis) -> list[Quantity]:
    """Parameters of the effects that the verdict names.

    Not how creep would go on after the longest record: that is a guess.
    """
    by_effect = {r["effect"]: r["parameters"] for r in reversed(diagnosis["ranking"])}
    longest = max((r["seconds"] for r in diagnosis.get("records", [])), default=math.inf)
    return [
        _quantity(effect, key, found)
        for effect in named_effects(diagnosis)
        for key, found in by_effect.get(effect, {}).items()
        if (after_s(key) or 0.0) <= longest
    ]


def _quantity(effect: str, key: str, found: Mapping[str, Any]) -> Quantity:
    name, unit = split_unit(key)
    value, ci95 = found["value"], found["ci95"]
    factor, unit = _scale(value, unit)
    between = f"{_number(ci95[0], factor)} to {_number(ci95[1], factor)}" if ci95 else "-"
    if found.get("fixed"):  # by the case
        between = FIXED
    ends = (float(ci95[0]), float(value), float(ci95[1])) if ci95 else None
    return Quantity(spoken(effect), name, _number(value, factor), between, unit, ends)


def parameter(effect: str, key: str, value: Any) -> str:
    """A parameter in words, without an interval."""
    told = _quantity(effect, key, {"value": value, "ci95": None})
    return f"{told.name} = {told.value} {told.unit}".rstrip()


def _scale(value: object, unit: str) -> tuple[float, str]:
    """Short times in ms or us: the factor to the value and the unit."""
    if unit == "s" and isinstance(value, int | float) and 0 < abs(value) < 1:
        return (1e3, "ms") if abs(value) >= 1e-4 else (1e6, "us")
    return 1.0, unit


def _number(value: Any, factor: float = 1.0) -> str:
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ", ".join(_number(v, factor) for v in value)
    if isinstance(value, int | float) and not isinstance(value, bool):
        return f"{factor * value:.5g}"
    return short(value, TEXT_MAX)


def short(text: object, length: int = NAME_MAX) -> str:
    """A text from outside, printable and of bounded length."""
    said = printable(str(text)[: length + 1])
    return said if len(said) <= length else f"{said[:length]}\N{HORIZONTAL ELLIPSIS}"


@dataclass(frozen=True)
class Cause:
    """An effect that the verdict names: what it is, its size, what to do about it."""

    name: str
    what: str
    size: str
    actions: tuple[Action, ...]
    proven: bool


def causes(diagnosis: Diagnosis) -> list[Cause]:
    """The effects that the verdict names, as far as they are of the vocabulary."""
    known = reversed(quantities(diagnosis))
    sizes = {q.effect: f"{q.name} {q.value} {q.unit}".strip() for q in known}
    proven = diagnosis["verdict"]["effects"]
    return [
        Cause(spoken(e), EFFECTS[e].what, sizes.get(spoken(e), ""), ACTIONS[e], e in proven)
        for e in named_effects(diagnosis)
        if e in EFFECTS
    ]


def unseen(diagnosis: Diagnosis) -> list[tuple[str, str, str]]:
    """Effect, the smallest size that the campaign could reveal, and what the size is."""
    rows = []
    for effect, size in diagnosis.get("detectable", {}).items():
        unit, meaning = SIZES.get(effect, ("", ""))
        said = "not at any size"
        if isinstance(size, int | float):
            factor, unit = _scale(size, unit)
            said = f"{digits(factor * size)} {unit}".strip()
        rows.append((spoken(effect), said, meaning))
    return rows


def sentence_of_unseen(diagnosis: Diagnosis) -> str:
    """The smallest size of each effect that the campaign could reveal."""
    return "; ".join(f"{effect} {size}" for effect, size, _ in unseen(diagnosis)) + "."


def digits(value: float, count: int = 3) -> str:
    """Significant digits, without an exponent where the number is not that large."""
    return f"{float(f'{value:.{count}g}'):.{max(count, 6)}g}"


def _entries(value: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What an object of unknown keys says, a row per key, with the units that the keys carry."""
    rows = []
    for key, held in value.items():
        name, unit = split_unit(short(key))
        inner = _inline(held) if isinstance(held, Mapping) else _number(held)
        rows.append((name, f"{inner} {unit}".strip()))
    return rows


def _inline(value: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {said}" for name, said in _entries(value))


# -- terminal ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Paragraph:
    text: str
    style: str = ""
    spare: bool = False
    """Left out where the lines are too few for all."""


class _Lines:
    """Paragraphs that together take at most `LINES_MAX` lines, whatever the width."""

    def __init__(self, paragraphs: list[_Paragraph]) -> None:
        self.paragraphs = paragraphs

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        from rich.text import Text

        told = [
            (Text(printable(p.text), p.style).wrap(console, options.max_width), p.spare)
            for p in self.paragraphs
        ]
        room = LINES_MAX - sum(len(wrapped) for wrapped, spare in told if not spare)
        count = 0
        for wrapped, spare in told:
            if spare:
                room -= len(wrapped)
                if room < 0:
                    continue
            if count + len(wrapped) > LINES_MAX:
                break
            count += len(wrapped)
            yield from wrapped


def terminal(diagnosis: Diagnosis) -> _Lines:
    """The diagnosis in at most twenty lines, for rich's `Console.print`, without its warnings."""
    said = [
        _Paragraph(sentence_of_verdict(diagnosis), "bold"),
        _Paragraph(f"Where: {sentence_of_where(diagnosis)}"),
        *(_Paragraph(f"       {_told(r)}.", "dim") for r in diagnosis["where"][1:3]),
    ]
    if diagnosis.get("checked"):
        said.append(_Paragraph(f"Could be seen from: {sentence_of_unseen(diagnosis)}"))
    elif state(diagnosis) not in UNTESTED:
        said.append(_Paragraph(f"How far: {sentence_of_shrink(diagnosis)}"))
    said += _sizes(diagnosis)
    following = sentence_of_next(diagnosis)
    if following:  # Before what to do about causes of which only some act.
        said.append(_Paragraph(f"Next experiment: {following}", "yellow"))
    for cause in causes(diagnosis):
        actions = "; or ".join(a.what for a in cause.actions)
        said.append(_Paragraph(f"Do: {cause.name}: {actions}."))
    faults = diagnosis.get("data_faults", [])
    if faults:
        records = len({f["record"] for f in faults})
        of = "one record" if records == 1 else f"{records} records"
        said.append(_Paragraph(f"Data faults: {len(faults)} in {of}, left out.", "yellow"))
    return _Lines(said)


def _sizes(diagnosis: Diagnosis) -> list[_Paragraph]:
    """First the first parameter of every effect; the others are spare."""
    known = quantities(diagnosis)
    first = {q.effect: q for q in reversed(known)}
    told = sorted(known, key=lambda q: q is not first[q.effect])
    return [_Paragraph(f"  {q.effect}: {q.said}", "cyan", q is not first[q.effect]) for q in told]


# -- page -------------------------------------------------------------------------------------


def write_report(
    out: Path, diagnosis: Diagnosis, views: Sequence[View] = (), noise: Noise | None = None
) -> None:
    """Write OUT/report.html, one page that needs no other file and no network.

    Parameters
    ----------
    out
        Folder of the diagnosis; the pictures of `madelung.diagnosis.pictures.draw` that are in it
        are for readers whose viewer runs no scripts.
    diagnosis
        The content of diagnosis.json.
    views, noise
        What the interactive figures show; without them the page has tables only.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    drawn = figures(views, noise, diagnosis)
    data = {"figures": drawn, "records": records(views) if "time" in drawn else [], "dark": DARK}
    heights = {name: figure["layout"]["height"] for name, figure in drawn.items()}
    context = _context(out, diagnosis)
    page = render("report.html.j2", FILTERS, data, heights=heights, **context)
    write_atomically(out / "report.html", page)


def rounded(value: object) -> str:
    """Three digits."""
    return digits(value) if isinstance(value, int | float) else "-"


def chance(p: float) -> str:
    """A p-value."""
    return "< 1e-99" if p < 1e-99 else f"{p:.2g}"


FILTERS = {
    f.__name__: f for f in (in_percent, in_percents, spoken, printable, short, rounded, chance)
}


@dataclass(frozen=True)
class Bar:
    """A bar of the first screen and of the table of records; width in per cent.

    ``kind`` is ``before``, ``after`` or ``floor``, with ``cut`` where it does not fit.
    """

    kind: str
    label: str
    value: str
    width: str


def bars(before: float, after: float | None, floor: float, longest: float) -> list[Bar]:
    """Before, after and noise floor, um rms, side by side; from ``longest`` on they fill it."""
    rows = (
        ("before", "before", before),
        ("after", "after", after),
        ("floor", "noise floor", floor),
    )
    return [
        Bar(
            f"{kind} cut" if v > longest else kind,
            label,
            f"{digits(v)} um",
            f"{100 * min(max(v / (longest or 1.0), 0.0), 1.0):.2f}%",
        )
        for kind, label, v in rows
        if v is not None
    ]


def shrunk_bars(diagnosis: Diagnosis) -> list[Bar]:
    """How far the gap shrinks on the hold-out; without one the gap of the train records."""
    shrink, gap = diagnosis["shrink"], diagnosis["gap"]
    floor = gap["noise_floor_um"]
    if not shrink["records"]:
        return bars(gap["rms_um"], None, floor, max(gap["rms_um"], floor))
    before, after = shrink["rms_before_um"], shrink["rms_after_um"]
    return bars(before, after, floor, max(before, after, floor))


def _shrunk_rows(diagnosis: Diagnosis) -> list[tuple[str, float, float, list[Bar]]]:
    """Hold-out records, all together, and the regions: label, before, after, bars."""
    shrink, floor = diagnosis["shrink"], diagnosis["gap"]["noise_floor_um"]
    rows = [(short(r["name"]), r["rms_before_um"], r["rms_after_um"]) for r in shrink["records"]]
    rows.append(("all hold-out records", shrink["rms_before_um"], shrink["rms_after_um"]))
    rows += [
        (region_label(r), r["rms_before_um"], r["rms_after_um"])
        for r in shrink.get("regions", [])
        if "rms_before_um" in r and "rms_after_um" in r and "axis" in r
    ]
    longest = max(max(b, a) for _, b, a in rows)
    return [(name, b, a, bars(b, a, floor, longest)[:2]) for name, b, a in rows]


def main_parameters(diagnosis: Diagnosis) -> dict[str, list[Quantity]]:
    """Parameters of every ranked effect that the contract names."""
    return {
        r["effect"]: [
            _quantity(r["effect"], key, found)
            for key, found in r["parameters"].items()
            if r["effect"] in EFFECTS and key in EFFECTS[r["effect"]].keys
        ]
        for r in diagnosis["ranking"]
    }


def _context(out: Path, diagnosis: Diagnosis) -> dict[str, Any]:
    faults = diagnosis.get("data_faults", [])
    case = diagnosis.get("case", {})
    case = case if isinstance(case, Mapping) else {"device": case}
    status = state(diagnosis)
    seed = diagnosis.get("seed")
    repeat = "madelung diagnose CASE_DIR -o OUT_DIR" + ("" if seed is None else f" --seed {seed}")
    return {
        "d": diagnosis,
        "device": short(case.get("device", "")),
        "status": status,
        "badge": STATUS[status],
        "tested": status not in UNTESTED,
        "verdict": sentence_of_verdict(diagnosis),
        "where": sentence_of_where(diagnosis),
        "also": [_told(r) for r in diagnosis["where"][1:3]],
        "shrink": sentence_of_shrink(diagnosis),
        "bars": shrunk_bars(diagnosis),
        "proven": [c for c in causes(diagnosis) if c.proven],
        "possible": [c for c in causes(diagnosis) if not c.proven],
        "kinds": KINDS,
        "rate_hz": RATE_HZ,
        "warnings": diagnosis.get("warnings", []),
        "regions": [(region_label(r), r) for r in diagnosis["where"]],
        "shrunk": _shrunk_rows(diagnosis) if diagnosis["shrink"]["records"] else [],
        "quantities": quantities(diagnosis),
        "creeps": any(q.name.startswith("gain at ") for q in quantities(diagnosis)),
        "main_parameters": main_parameters(diagnosis),
        "named": named_effects(diagnosis),
        "unseen": unseen(diagnosis),
        "faults": faults[:FAULTS_MAX],
        "faults_more": max(len(faults) - FAULTS_MAX, 0),
        "next_experiment": _entries(diagnosis.get("next_experiment") or {}),
        "case": _entries(case),
        "files": diagnosis.get("records", []),
        "versions": _entries(diagnosis.get("versions", {})),
        "seed": seed,
        "command": short(diagnosis.get("command", repeat), TEXT_MAX),
        "pictures": [
            (name, CAPTIONS[name], b64encode((out / f"{name}.png").read_bytes()).decode("ascii"))
            for name in NAMES
            if (out / f"{name}.png").exists()
        ],
    }
