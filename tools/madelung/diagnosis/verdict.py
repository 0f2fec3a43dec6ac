"""What may be said of a search's result: identified, ambiguous, unknown or no gap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from madelung.diagnosis.case import Trace
from madelung.diagnosis.effects.form import Form, Scales
from madelung.diagnosis.fit import Fit, Probe, Problem
from madelung.diagnosis.which import (
    EXCESS_MIN,
    GAIN_MIN,
    GAIN_PER_PARAM,
    HOPELESS,
    PAIR,
    REMAINDER_MAX,
    RIVAL_GAIN,
    Engine,
    Outsider,
    Search,
    unlikeliness,
)

Array = NDArray[np.float64]
Status = Literal["identified", "ambiguous", "unknown", "no_gap"]

CANDIDATES_MAX = 4
RIVAL_EXCESS = 1.3
CLEAR_EXCESS = 0.1
"""A rival is set aside when its cost is clearly higher (`RIVAL_GAIN`); where the best leaves more
than the second over the noise, per row, its excess must also be larger by the first factor."""
REMAINDER_MANY = 0.01
"""Share of the gap that may stay unexplained beside more than a pair of effects, whose sum may as
well be a curve through something else; beside fewer it is `REMAINDER_MAX`."""
CONFIDENCE_MAX = 0.99
LINE_PERIODS = 3
"""Periods of a disturbance that a record must hold at least."""
LARGER_SHARE = 0.05
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


def judge(
    engine: Engine, search: Search, gap_excess: float, outsider: Outsider | None = None
) -> Verdict:
    """Decide the status.

    The confidence is the share that what is named has among all hypotheses tried (`_posterior`),
    times what the distance of the remainder from its threshold is worth (`_odds`); at most
    `CONFIDENCE_MAX`, because causes that no hypothesis holds cannot be excluded.

    Parameters
    ----------
    gap_excess
        `train_excess` of the baseline.
    outsider
        What explains the records and may not be named.
    """
    problem, best = engine.problem, search.best
    left = max(train_excess(problem, best), 0.0)
    allowed = _allowed([t for t in problem.traces if t.role == "train"], problem)
    share = left / max(gap_excess, 1.0)
    named = best.effects - search.null.effects
    most = REMAINDER_MAX if len(named) <= PAIR else REMAINDER_MANY
    clean = max(allowed / max(left, 1.0), most / max(share, 1e-9))
    effects = sorted(best.effects)
    if clean < 1:
        return Verdict("unknown", [], effects, _capped(_odds(1 / clean)), share, [])
    if outsider is not None and not effects:
        sure = _odds(max(outsider.gain / GAIN_MIN, 1.0))
        return Verdict("unknown", [], [], _capped(sure), min(share, 1.0), [])
    if left <= allowed and gap_excess <= allowed:
        share = 0.0
    weights = _posterior(engine, search)
    if not effects:
        sure = weights[best.effects] * _odds(allowed / max(left, 1.0))
        return Verdict("no_gap", [], [], _capped(sure), min(share, 1.0), [])
    rivals = _rivals(engine, search)
    possible = [best, *rivals]
    sure = sum(weights[f.effects] for f in possible) * _odds(clean)
    common = frozenset.intersection(*(f.effects for f in possible))
    contested: list[str] = []
    for fit in possible if rivals else []:
        contested += [n for n in sorted(fit.effects - common) if n not in contested]
    status: Status = "ambiguous" if rivals else "identified"
    candidates = contested[:CANDIDATES_MAX]
    return Verdict(status, sorted(common), candidates, _capped(sure), share, rivals)


def train_excess(problem: Problem, fit: Fit) -> float:
    """Whitened sum of squares less the rows, train records only."""
    excess = problem.excess(fit.residual)
    return float(sum(e for e, t in zip(excess, problem.traces, strict=True) if t.role == "train"))


def _allowed(traces: Sequence[Trace], problem: Problem) -> float:
    """Excess of records that may still be noise, whose level is not known better."""
    return sum(
        (EXCESS_MIN + LEVEL_ERRORS * problem.noise.level_error(t.step_s)) * int(t.use.sum())
        for t in traces
    )


def _rivals(engine: Engine, search: Search) -> list[Fit]:
    """Hypotheses of no more effects that the data cannot tell from the best."""
    best, problem = search.best, engine.problem
    found = []
    for fit in engine.alternatives(search):
        close = engine.gain(fit, best) + unlikeliness(fit) - unlikeliness(best) < RIVAL_GAIN
        left, least = (f.cost - problem.rows for f in (fit, best))
        alike = least > CLEAR_EXCESS * problem.rows and left < RIVAL_EXCESS * least
        if close or alike:
            found.append(fit)
    return found[: CANDIDATES_MAX - 1]


def _posterior(engine: Engine, search: Search) -> dict[frozenset[str], float]:
    """Share of each set of effects among all tried.

    Gains count under the least favourable noise. One effect more is beforehand so unlikely that a
    gain at the threshold of acceptance makes it even. Larger sets than the accepted one have not
    been accepted, because what they explain is too small a part of the gap to tell from an error
    of the models: together they keep a share of `LARGER_SHARE` at most.
    """
    best = search.best
    logs = {best.effects: 0.0}
    for key, fit in search.fits.items():
        if key == best.effects:
            continue
        if fit.cost > best.cost + HOPELESS:
            logs[key] = -HOPELESS
            continue
        better = fit.cost < best.cost
        gain = engine.gain(best, fit) if better else -engine.gain(fit, best)
        extra = len(fit.params) - len(best.params)
        price = GAIN_MIN * (len(fit.forms) - len(best.forms)) + GAIN_PER_PARAM * extra
        price += unlikeliness(fit) - unlikeliness(best)
        logs[key] = (gain - price) / 2
    larger = {key for key in logs if len(key) > len(best.effects)}
    top = max(v for key, v in logs.items() if key not in larger)
    weights = {key: float(np.exp(min(v - top, 0.0))) for key, v in logs.items()}
    kept = sum(w for key, w in weights.items() if key not in larger)
    beyond = sum(weights[key] for key in larger)
    shrunk = min(1.0, LARGER_SHARE * kept / max(beyond, 1e-300))
    weights |= {key: shrunk * weights[key] for key in larger}
    whole = sum(weights.values())
    return {key: w / whole for key, w in weights.items()}


def _odds(ratio: float) -> float:
    """Probability to be on the right side of a threshold: half at it, 0.9 at three times it."""
    return ratio**2 / (1 + ratio**2)


def _capped(probability: float) -> float:
    return float(min(probability, CONFIDENCE_MAX))


def detectable(engine: Engine, null: Fit, forms: list[Form]) -> dict[str, float | None]:
    """Smallest size of each effect that would be accepted; what it is: `vocabulary.SIZES`.

    None where no size within the parameter's bounds would be.
    """
    probe = Probe(engine.problem, engine.problem.fit(null.forms, null.values, null.beta, 1))
    out: dict[str, float | None] = {}
    for form in forms:
        if not form.refines and form.effect not in out:
            out[form.effect] = _smallest(probe, form)
    out["periodic_disturbance"] = _smallest_line(engine.problem)
    return out


def _smallest_line(problem: Problem) -> float | None:
    """Amplitude of a line, where the noise is strongest, um."""
    trains = [t for t in problem.traces if t.role == "train"]
    wanted = GAIN_MIN + GAIN_PER_PARAM * (1 + 2 * len(trains))
    told = 0.0
    for t in trains:
        lowest = np.array([LINE_PERIODS / (t.u_V.size * t.step_s)])
        told += int(t.use.sum()) / (2 * float(problem.noise.spectrum(lowest, t.step_s)[0]))
    return float(np.sqrt(wanted / told)) if told > 0 else None


def _smallest(probe: Probe, form: Form) -> float | None:
    """Size at which the signature's energy is the gain that an effect must have."""
    wanted = GAIN_MIN + GAIN_PER_PARAM * len(form.params)
    if form.linear:
        columns = probe.signature(form, form.null())
        column = np.sum(columns, axis=0) if form.effect == "creep" else columns[0]
        energy = probe.energy(column)
        return float(np.sqrt(wanted / energy)) if energy > 1e-9 else None
    first, *others = form.params
    base = form.starts(probe.problem.scales)[0] | {p.key: p.null for p in others if not p.log}
    zero, largest = _span(form, probe.problem.scales)
    if largest == 0.0:
        return None
    ends = (np.log(first.low if first.log else 1e-6 * abs(largest)), np.log(abs(largest)))

    def margin(log_size: float) -> float:
        value = zero + float(np.copysign(np.exp(log_size), largest))
        energy = probe.energy(probe.signature(form, base | {first.key: value})[0])
        return float(np.log(max(energy, 1e-12) / wanted))

    at_ends = [margin(end) for end in ends]
    if max(at_ends) < 0:
        return None
    if min(at_ends) > 0:
        return float(np.exp(ends[int(np.argmin(at_ends))]))
    return float(np.exp(brentq(margin, *ends, xtol=0.03, maxiter=30, disp=False)))


def _span(form: Form, s: Scales) -> tuple[float, float]:
    """Value of the first parameter without effect, and how far it can go from there, with sign."""
    p = form.params[0]
    top = s.u_min_V + s.range_V
    if form.effect == "saturation":
        return top, p.low - top
    if form.effect == "initial_state":
        return s.u_min_V, s.range_V
    return 0.0, max(p.high, p.low, key=abs)
