"""What was sealed beside what was diagnosed, in a line."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from madelung.diagnosis.report import Diagnosis, listed, parameter, spoken, state
from madelung.diagnosis.vocabulary import EFFECTS
from madelung.errors import InputError

NOTHING = "nothing"


def compared(labels: Mapping[str, Any], diagnosis: Diagnosis | None = None) -> str:
    """The causes of a case and, where it was diagnosed, the verdict and whether it is right.

    Parameters
    ----------
    labels
        As `madelung simulate --case` writes them: effects, outside, parameters.
    diagnosis
        The content of diagnosis.json.

    Raises
    ------
    InputError
        The diagnosis is not a whole one, or the labels are those of several cases.
    """
    if not isinstance(labels.get("effects"), list):
        raise InputError("the labels are not those of one case")
    outside = list(labels.get("outside", []))
    names = [*labels["effects"], *outside]
    causes = [_cause(name, labels.get("parameters", {}).get(name, {})) for name in names]
    said = f"sealed: {'; '.join(causes) or NOTHING}"
    if diagnosis is None:
        return said
    try:
        status, verdict = state(diagnosis), diagnosis["verdict"]
        found, candidates = list(verdict["effects"]), list(verdict["candidates"])
        answer = _answer(status, found, candidates)
        right = _judged(status, set(found), set(candidates), set(labels["effects"]), bool(outside))
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise InputError("diagnosis.json is not a whole diagnosis: run it again") from error
    return f"{said}; diagnosed: {answer}: {right}"


def _cause(name: str, values: Mapping[str, Any]) -> str:
    """An effect with the parameters that the contract names."""
    keys = EFFECTS[name].keys if name in EFFECTS else ()
    told = ", ".join(parameter(name, key, values[key]) for key in keys if key in values)
    return f"{spoken(name)} ({told})" if told else spoken(name)


def _answer(status: str, found: list[str], candidates: list[str]) -> str:
    if status == "identified":
        return listed(found)
    if status == "ambiguous":
        return " and ".join([*map(spoken, found), listed(candidates, "or")])
    return {"no_gap": "no gap", "unknown": "unknown cause"}.get(status, "nothing was fitted")


def _judged(
    status: str, found: set[str], candidates: set[str], effects: set[str], outside: bool
) -> str:
    """Right, wrong, or between: what `madelung blind` counts as right or as not false."""
    if outside:
        right = status == "unknown"
    elif not effects:
        right = status in ("no_gap", "good_enough")
    else:
        right = status == "identified" and found == effects
    if right:
        return "right"
    if status == "checked":
        return "no verdict"
    among = found <= effects <= found | candidates and effects & candidates
    if status == "ambiguous" and not outside and among:
        return "undecided, the truth is among them"
    return "wrong"
