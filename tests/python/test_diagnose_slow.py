"""The diagnosis over many simulated cases; `make test-all` runs it and prints the tables."""

import warnings
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from diagnose_cases import content

from madelung.sim_effects import OUTSIDE, VOCABULARY
from madelung.stage import make_case

pytestmark = pytest.mark.slow

PAIRS = (
    ("delay", "asymmetry"),
    ("saturation", "creep"),
    ("slew_limit", "gain_offset"),
    ("amplifier_lag", "backlash"),
    ("asymmetry", "drift"),
    ("rate_dependence", "resonance"),
    ("non_masing", "amplifier_lag"),
    ("initial_state", "periodic_disturbance"),
    ("creep", "resonance"),
    ("backlash", "clock_skew"),
    ("resonance", "drift"),
    ("gain_offset", "delay"),
)


def verdict(folder: Path, effects: dict[str, float], seed: int, **more: Any) -> dict[str, Any]:
    make_case(folder, effects, seed, "rich", **more)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return content(folder, jobs=2)


def scored(title: str, rows: Sequence[tuple[str, dict[str, Any], bool]]) -> float:
    """Print a table of cases; the share that is right."""
    print(f"\n{title}")
    for name, found, right in rows:
        told = found["verdict"]
        names = ", ".join(told["effects"]) or "-"
        rest = f" | {', '.join(told['candidates'])}" if told["candidates"] else ""
        closed = found["shrink"]["closable_closed"]
        share = "" if closed is None else f"{closed:.3f}"
        mark = "right" if right else "WRONG"
        print(f"  {mark}  {name:<38} {told['status']:<10} {share:>6}  {names}{rest}")
    share = sum(right for *_, right in rows) / len(rows)
    print(f"  {100.0 * share:.0f} % of {len(rows)}")
    return share


def exact(found: dict[str, Any], *effects: str) -> bool:
    told = found["verdict"]
    return told["status"] == "identified" and set(told["effects"]) == set(effects)


@pytest.mark.parametrize(("strength", "least"), [(1.0, 0.9), (0.25, 0.85), (0.1, 0.8)])
def test_each_effect_alone(strength: float, least: float, tmp_path: Path) -> None:
    rows = []
    for seed, effect in enumerate(VOCABULARY, start=200):
        found = verdict(tmp_path / effect, {effect: strength}, seed)
        rows.append((effect, found, exact(found, effect)))
    assert scored(f"one effect, {strength:g} of ordinary size", rows) >= least


def test_pairs(tmp_path: Path) -> None:
    rows = []
    for seed, pair in enumerate(PAIRS, start=300):
        found = verdict(tmp_path / "+".join(pair), dict.fromkeys(pair, 1.0), seed)
        rows.append((" + ".join(pair), found, exact(found, *pair)))
    assert scored("two effects of ordinary size", rows) >= 0.75


def test_nothing_to_find_in_white_and_coloured_noise(tmp_path: Path) -> None:
    rows = []
    for seed, ar in enumerate((0.0, 0.0, 0.5, 0.9, 0.98, 0.98), start=400):
        found = verdict(tmp_path / str(seed), {}, seed, noise_ar=ar)
        rows.append((f"noise with AR(1) {ar:g}", found, found["verdict"]["status"] == "no_gap"))
    assert scored("nothing to find", rows) == 1.0


def test_disturbances_outside_the_vocabulary(tmp_path: Path) -> None:
    rows = []
    for seed, name in enumerate(OUTSIDE, start=500):
        found = verdict(tmp_path / name, {name: 1.0}, seed)
        rows.append((name, found, found["verdict"]["status"] == "unknown"))
    assert scored("outside the vocabulary", rows) >= 0.8


def test_smaller_effects_leave_smaller_gaps(tmp_path: Path) -> None:
    """The claim of the tables: the strengths differ by what the case shows."""
    gaps = [
        verdict(tmp_path / str(s), {"backlash": s}, 9)["gap"]["rms_um"] for s in (1.0, 0.25, 0.1)
    ]
    assert all(b < a for a, b in pairwise(gaps))
