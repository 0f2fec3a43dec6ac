"""The diagnosis for people: sentences, at most twenty lines for a terminal, and report.html.

Beside the keys of diagnosis.schema.json these are shown where they are there: ``case`` (object or
text), ``versions``, ``seed``, ``command``, ``warnings``, ``where[].sentence``, ``ranking[].gain``,
``shrink.regions[]`` with ``rms_before_um`` and ``rms_after_um``, and everything in
``next_experiment``.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from madelung.diagnosis.pictures import NAMES, in_percent, printable, region_label
from madelung.diagnosis.vocabulary import EFFECTS
from madelung.files import write_atomically

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderResult

Diagnosis = Mapping[str, Any]

LINES_MAX = 20
FAULTS_MAX = 30
UNITS = {
    "V_per_s": "V/s",
    "um_per_s": "um/s",
    "per_decade": "of the step per decade of time",
    "hz": "Hz",
    "ppm": "ppm",
    "um": "um",
    "V": "V",
    "s": "s",
}
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


def sentence_of_verdict(diagnosis: Diagnosis) -> str:
    """What was found, in a sentence or two, with the confidence."""
    verdict, gap = diagnosis["verdict"], diagnosis["gap"]
    effects, candidates = verdict["effects"], verdict["candidates"]
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
        return f"{said}: nothing there can be closed."
    between = f" (95 %: {in_percent(ci95[0])} to {in_percent(ci95[1])})" if ci95 else ""
    return f"{said}: {in_percent(closed)}{between} of what can be closed is closed."


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
    """A parameter in words: name, value and interval with unit."""

    effect: str
    name: str
    value: str
    ci95: str
    unit: str

    @property
    def said(self) -> str:
        """On a line."""
        return " ".join(f"{self.name} = {self.value} {self.unit} (95 %: {self.ci95})".split())


def split_unit(key: str) -> tuple[str, str]:
    """Name and unit of a parameter's key."""
    for suffix, unit in UNITS.items():
        if key.endswith(f"_{suffix}"):
            return key.removesuffix(f"_{suffix}").replace("_", " "), unit
    return key.replace("_", " "), ""


def named_effects(diagnosis: Diagnosis) -> list[str]:
    """Effects of the verdict, then its candidates, each once."""
    verdict = diagnosis["verdict"]
    parts = [e for name in [*verdict["effects"], *verdict["candidates"]] for e in name.split("+")]
    return list(dict.fromkeys(parts))


def quantities(diagnosis: Diagnosis) -> list[Quantity]:
    """Parameters of the effects that the verdict names."""
    by_effect = {r["effect"]: r["parameters"] for r in reversed(diagnosis["ranking"])}
    return [
        _quantity(effect, key, found)
        for effect in named_effects(diagnosis)
        for key, found in by_effect.get(effect, {}).items()
    ]


def _quantity(effect: str, key: str, found: Mapping[str, Any]) -> Quantity:
    name, unit = split_unit(key)
    ci95 = found["ci95"]
    between = f"{_number(ci95[0])} to {_number(ci95[1])}" if ci95 else "-"
    return Quantity(spoken(effect), name, _number(found["value"]), between, unit)


def _number(value: Any) -> str:
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ", ".join(_number(v) for v in value)
    if isinstance(value, int | float) and not isinstance(value, bool):
        return f"{value:.5g}"
    return printable(value)


def remedies(diagnosis: Diagnosis) -> list[tuple[str, str, str]]:
    """Effect, what it is, what to do, for the effects that the verdict names."""
    known = [EFFECTS[e] for e in named_effects(diagnosis) if e in EFFECTS]
    return [(spoken(e.name), e.what, e.remedy) for e in known]


def unseen(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Effect and the smallest size that the campaign could reveal."""
    rows = []
    for effect, size in diagnosis.get("detectable", {}).items():
        keys = EFFECTS[effect].keys if effect in EFFECTS else ()
        unit = split_unit(keys[0])[1] if keys else ""
        value = size.get("value") if isinstance(size, Mapping) else size
        unit = str(size.get("unit", unit)) if isinstance(size, Mapping) else unit
        known = isinstance(value, int | float)
        rows.append(
            (spoken(effect), f"{value:.3g} {unit}".rstrip() if known else "not at any size")
        )
    return rows


def _entries(value: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What an object of unknown keys says, a row per key, with the units that the keys carry."""
    rows = []
    for key, held in value.items():
        name, unit = split_unit(printable(key))
        inner = _inline(held) if isinstance(held, Mapping) else _number(held)
        rows.append((name, f"{inner} {unit}".strip()))
    return rows


def _inline(value: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {said}" for name, said in _entries(value))


# -- terminal ---------------------------------------------------------------------------------


class _Lines:
    """Paragraphs that together take at most `LINES_MAX` lines, whatever the width."""

    def __init__(self, paragraphs: list[tuple[str, str]]) -> None:
        self.paragraphs = paragraphs

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        from rich.text import Text

        lines: list[Text] = []
        for text, style in self.paragraphs:
            wrapped = Text(printable(text), style).wrap(console, options.max_width)
            if len(lines) + len(wrapped) > LINES_MAX:
                break
            lines += wrapped
        yield from lines


def terminal(diagnosis: Diagnosis) -> _Lines:
    """The diagnosis in at most twenty lines, for rich's `Console.print`."""
    said = [
        (sentence_of_verdict(diagnosis), "bold"),
        (f"Where: {sentence_of_where(diagnosis)}", ""),
        *((f"       {_told(r)}" + ".", "dim") for r in diagnosis["where"][1:3]),
        (f"How far: {sentence_of_shrink(diagnosis)}", ""),
    ]
    for q in quantities(diagnosis)[:4]:
        said.append((f"  {q.effect}: {q.said}", "cyan"))
    said += [
        (f"Do: {spoken_effect}: {todo}.", "") for spoken_effect, _, todo in remedies(diagnosis)
    ]
    following = sentence_of_next(diagnosis)
    if following:
        said.append((f"Next experiment: {following}", "yellow"))
    faults = diagnosis.get("data_faults", [])
    if faults:
        records = len({f["record"] for f in faults})
        of = "one record" if records == 1 else f"{records} records"
        said.append((f"Data faults: {len(faults)} in {of}, left out.", "yellow"))
    said += [(f"Warning: {w}", "yellow") for w in diagnosis.get("warnings", [])]
    return _Lines(said)


# -- page -------------------------------------------------------------------------------------


def write_report(out: Path, diagnosis: Diagnosis) -> None:
    """Write OUT/report.html, one page that needs no other file.

    Parameters
    ----------
    out
        Folder of the diagnosis; the pictures of `madelung.diagnosis.pictures.draw` that are in it
        become part of the page.
    diagnosis
        The content of diagnosis.json.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    from jinja2 import Environment, FileSystemLoader

    folder = Path(__file__).parent / "templates"
    environment = Environment(
        loader=FileSystemLoader(folder), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters["number"] = lambda v: f"{v:.4g}"
    for shown in (in_percent, spoken, printable):
        environment.filters[shown.__name__] = shown
    page = environment.get_template("report.html.j2").render(_context(out, diagnosis))
    write_atomically(out / "report.html", page)


def _context(out: Path, diagnosis: Diagnosis) -> dict[str, Any]:
    faults = diagnosis.get("data_faults", [])
    case = diagnosis.get("case", {})
    case = case if isinstance(case, Mapping) else {"device": case}
    return {
        "d": diagnosis,
        "device": case.get("device", ""),
        "status": diagnosis["verdict"]["status"],
        "verdict": sentence_of_verdict(diagnosis),
        "where": sentence_of_where(diagnosis),
        "shrink": sentence_of_shrink(diagnosis),
        "regions": [(region_label(r), r) for r in diagnosis["where"]],
        "shrunk": [
            (region_label(r), r)
            for r in diagnosis["shrink"].get("regions", [])
            if "rms_before_um" in r and "rms_after_um" in r and "axis" in r
        ],
        "quantities": quantities(diagnosis),
        "remedies": remedies(diagnosis),
        "named": named_effects(diagnosis),
        "unseen": unseen(diagnosis),
        "faults": faults[:FAULTS_MAX],
        "faults_more": max(len(faults) - FAULTS_MAX, 0),
        "next_experiment": _entries(diagnosis.get("next_experiment") or {}),
        "case": _entries(case),
        "versions": _entries(diagnosis.get("versions", {})),
        "pictures": [
            (name, CAPTIONS[name], b64encode((out / f"{name}.png").read_bytes()).decode("ascii"))
            for name in NAMES
            if (out / f"{name}.png").exists()
        ],
    }
