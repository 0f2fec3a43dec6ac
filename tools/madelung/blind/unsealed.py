"""What was sealed beside what was diagnosed, in a line."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from madelung.blind.score import Row, is_held, is_right
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
        told = {"status": verdict["status"], "named": sorted(found), "candidates": candidates}
        right = _judged(status, told | {"effects": sorted(labels["effects"]), "outside": outside})
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


def _judged(status: str, row: Row) -> str:
    """Right, wrong, or between, as `madelung blind` counts."""
    if status == "checked":
        return "no verdict"
    if is_right(row):
        return "right"
    return "undecided, the truth is among them" if is_held(row) else "wrong"
