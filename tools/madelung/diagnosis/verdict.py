"""What may be said of a search's result: identified, ambiguous, unknown or no gap."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from madelung.diagnosis.fit import Fit, Probe, Problem
from madelung.diagnosis.forms import Form
from madelung.diagnosis.which import EXCESS_MIN, GAIN_MIN, Engine, Search

Array = NDArray[np.float64]
Status = Literal["identified", "ambiguous", "unknown", "no_gap"]

CANDIDATES_MAX = 4
RIVAL_GAIN = 20.0
"""A rival is set aside when its cost is higher by this, in units of the noise, and ..."""
RIVAL_EXCESS = 1.3
"""... its excess over the noise is larger by this factor."""
REMAINDER_MAX = 0.05
LEVEL_ERRORS = 3.0
"""Standard errors of the noise's level that a remainder may lie above it and be noise."""


@dataclass(frozen=True)
class Verdict:
    """Status and what it rests on; see the contract."""

    status: Status
    effects: list[str]
    candidates: list[str]
    confidence: float
    remainder_share: float
    rivals: list[Fit]


def judge(engine: Engine, search: Search, gap_excess: float) -> Verdict:
    """Decide the status.

    Parameters
    ----------
    gap_excess
        `train_excess` of the baseline.
    """
    problem = engine.problem
    best = search.best
    left = train_excess(problem, best)
    share = max(left, 0.0) / max(gap_excess, 1.0)
    allowed = sum(
        (EXCESS_MIN + LEVEL_ERRORS * problem.noise.level_error(t.step_s)) * int(t.use.sum())
        for t in problem.traces
        if t.role == "train"
    )
    structured = left > allowed
    effects = sorted(best.effects)
    if structured and share > REMAINDER_MAX:
        return Verdict("unknown", [], effects, _confidence(share / REMAINDER_MAX), share, [])
    if not effects:
        return Verdict("no_gap", [], [], _confidence(allowed / max(left, 1.0)), min(share, 1.0), [])
    rivals = _rivals(engine, search)
    if rivals:
        contested: list[str] = []
        for fit in [best, *rivals]:
            for name in sorted(fit.effects - frozenset.intersection(best.effects, *_sets(rivals))):
                if name not in contested:
                    contested.append(name)
        agreed = sorted(frozenset.intersection(best.effects, *_sets(rivals)))
        confidence = 1 / (1 + len(rivals))
        return Verdict("ambiguous", agreed, contested[:CANDIDATES_MAX], confidence, share, rivals)
    return Verdict("identified", effects, [], _certainty(engine, search), share, [])


def train_excess(problem: Problem, fit: Fit) -> float:
    """Whitened sum of squares less the rows, train records only."""
    excess = problem.excess(fit.residual)
    return float(sum(e for e, t in zip(excess, problem.traces, strict=True) if t.role == "train"))


def _sets(fits: list[Fit]) -> list[frozenset[str]]:
    return [f.effects for f in fits]


def _rivals(engine: Engine, search: Search) -> list[Fit]:
    """Hypotheses of no more effects that the data cannot tell from the best."""
    best = search.best
    floor = engine.problem.rows
    found = []
    for fit in sorted(search.fits.values(), key=engine.score):
        if fit.effects == best.effects or not fit.effects or len(fit.forms) > len(best.forms):
            continue
        if fit.effects <= best.effects:
            continue
        close = engine.gain(fit, best) < RIVAL_GAIN
        alike = fit.cost - floor < RIVAL_EXCESS * max(best.cost - floor, 0.0)
        if close or alike:
            found.append(fit)
    return found[: CANDIDATES_MAX - 1]


def _certainty(engine: Engine, search: Search) -> float:
    """From how far the nearest rival, and the hypothesis without one of the effects, lie behind."""
    best = search.best
    behind = [
        engine.gain(f, best)
        for f in search.fits.values()
        if f.effects != best.effects and len(f.forms) <= len(best.forms)
    ]
    nearest = min(behind, default=0.0)
    return _confidence(max(nearest, 0.0) / RIVAL_GAIN)


def _confidence(ratio: float) -> float:
    """0.5 at the threshold, towards 0.99 well beyond it."""
    return float(0.5 + 0.49 * (1 - np.exp(-max(ratio - 1.0, 0.0) / 3)))


def detectable(engine: Engine, null: Fit, forms: list[Form]) -> dict[str, float | None]:
    """Smallest size of each effect, in its first parameter's unit, that would be accepted.

    Along the effect's signature the cost falls with the square of its size; where the size is not
    the parameter itself (a corner, a limit), the starts of the search are interpolated.
    """
    probe = Probe(engine.problem, engine.problem.fit(null.forms, null.values, null.beta, 1))
    out: dict[str, float | None] = {}
    for form in forms:
        if form.refines or form.effect in out:
            continue
        out[form.effect] = _smallest(probe, form)
    return out


def _smallest(probe: Probe, form: Form) -> float | None:
    starts = form.starts(probe.problem.scales)
    key = form.params[0].key
    if form.linear:
        strength = probe.energy(probe.signature(form, form.null())[0])
        return float(np.sqrt(GAIN_MIN / strength)) if strength > 1e-9 else None
    sizes, strengths = [], []
    for start in starts:
        if any(start[k] != v for k, v in starts[0].items() if k != key):
            continue
        sizes.append(start[key])
        strengths.append(probe.energy(probe.signature(form, start)[0]))
    if not sizes or max(strengths) <= 1e-9:
        return None
    if len(sizes) == 1:  # an amplitude: the gain goes with its square
        return abs(sizes[0]) * float(np.sqrt(GAIN_MIN / strengths[0]))
    order = np.argsort(strengths)
    x = np.log(np.abs(np.array(sizes)[order]))
    z = np.log(np.maximum(np.array(strengths)[order], 1e-9))
    if z[-1] < np.log(GAIN_MIN):
        return None
    if z[0] < np.log(GAIN_MIN):
        return float(np.exp(np.interp(np.log(GAIN_MIN), z, x)))
    slope = (x[1] - x[0]) / max(z[1] - z[0], 1e-9)  # beyond the weakest start
    return float(np.exp(x[0] + slope * (np.log(GAIN_MIN) - z[0])))
