"""The diagnosis of a case, from its records to the content of diagnosis.json."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from madelung.diagnosis.case import Case, Trace
from madelung.diagnosis.effects import forms
from madelung.diagnosis.effects.form import Scales
from madelung.diagnosis.effects.outside import OUTSIDE, outside_forms
from madelung.diagnosis.experiment import next_experiment
from madelung.diagnosis.fit import Fit, Problem
from madelung.diagnosis.holdout import (
    CLOSABLE_MIN,
    Prediction,
    cross_validated,
    predict,
    region_shrink,
    shrink,
)
from madelung.diagnosis.known import contradicted, known_forms, monitor_fault, monitored
from madelung.diagnosis.lines import lines_hz
from madelung.diagnosis.noise import Noise, estimate_noise
from madelung.diagnosis.parameters import Z95, reported
from madelung.diagnosis.regions import Region
from madelung.diagnosis.verdict import Verdict, detectable, judge, train_excess
from madelung.diagnosis.vocabulary import EFFECTS, SIZES
from madelung.diagnosis.where import locate
from madelung.diagnosis.which import Engine, Outsider, Progress, Search
from madelung.model import DEGREE_MAX, Model
from madelung.path import path_of

Array = NDArray[np.float64]

SCHEMA = "madelung.diagnosis/1"
DEGREE_MIN = 3
DEGREE_RICH = 13
"""Of f0 in the search: a bend that the firmware's degrees cannot follow is no effect."""
DEGREE_MORE = 2
"""Train records may show so much more of f0's bend than the slow loop did."""
SEARCH_ROWS = 24_000
FURTHER_ROWS = 112_000
"""The search runs on the heads of longer records; from its result it goes on with more rows, if
these show more; and what it comes to is fitted to all rows."""
BEYOND_SHARE = 1e-4
"""Of the range, by which a command may leave it without a word: the rounding of its columns."""


@dataclass(frozen=True)
class Options:
    """What the user chose."""

    jobs: int = 2
    seed: int = 0
    model: Model | None = None
    tolerance_percent: float | None = None
    check: bool = False


@dataclass(frozen=True)
class Diagnosis:
    """The result.

    Attributes
    ----------
    content
        Of diagnosis.json.
    problem, baseline, best
        On the train records: what was fitted, the predictor diagnosed, the accepted hypothesis.
    predictions
        Of train and hold-out records.
    regions
        Where the gap lies.
    """

    content: dict[str, Any]
    problem: Problem
    noise: Noise
    baseline: Fit
    best: Fit
    predictions: list[Prediction]
    regions: list[Region]


def diagnose(case: Case, options: Options, progress: Progress = lambda _: None) -> Diagnosis:
    """Say where the gap lies, which effects cause it and how far it shrinks.

    The hold-out's displacement enters nothing but ``shrink``.
    """
    noise = estimate_noise(case.identify)
    scales = _scales(case)
    progress("identifying the baseline")
    alone = Problem([case.identify], noise, scales, DEGREE_RICH)
    by_degree = _degrees(alone)
    rich = min(by_degree, key=lambda d: by_degree[d][0])
    if options.model is not None:
        rich = max(rich, len(options.model.f0) - 1)
    degree = min(rich + DEGREE_MORE, DEGREE_MAX if rich <= DEGREE_MAX else DEGREE_RICH)
    flashed = None if options.model is None else path_of(options.model)
    problem = Problem([case.identify, *case.train], noise, scales, degree, flashed)
    baseline = _baseline(problem, options.model, by_degree)
    gap = _train_gap(problem, baseline)
    good = _good_enough(gap, options)
    heads = problem.with_traces(_heads(problem.traces, SEARCH_ROWS))
    engine, search, outsider = _search(problem, heads, case, baseline, options, progress, good)
    rough = Engine(heads, engine.forms, 1, progress)
    verdict = judge(engine, search, train_excess(problem, baseline), outsider)
    beside = {*verdict.effects, *verdict.candidates}
    if verdict.status == "unknown":
        weighty = engine.weighty(search)
        again = judge(engine, weighty, train_excess(problem, baseline), outsider)
        if again.status == "unknown":  # fewer effects are judged less strictly
            search, verdict = weighty, again
    if good:
        verdict = Verdict("no_gap", [], [], 1.0, 0.0, [])
    elif options.check:
        verdict = replace(verdict, confidence=0.0)
    best = baseline if options.check or good else search.best
    problem, shown, best = _as_flashed(problem, baseline, best)
    progress("predicting the hold-out records")
    predictions = _predictions(problem, case, shown, best)
    held = [p for p in predictions if p.trace.role == "holdout"]
    lines = lines_hz(best)
    regions = locate(
        case.train,
        [p.trace.y_um - p.baseline_um for p in predictions if p.trace.role == "train"],
        noise,
        (case.u_min_V, case.u_max_V),
        options.seed,
    )
    content = {
        "schema": SCHEMA,
        "gap": gap,
        "where": [r.to_json() for r in regions],
        "verdict": _verdict_json(verdict),
        "ranking": [] if options.check else _ranking(engine, heads, search, baseline),
        "shrink": shrink(held, noise, lines, options.seed)
        | {
            "regions": region_shrink(regions, held, (case.u_min_V, case.u_max_V)),
            "set_aside": list(case.set_aside),
        },
        "data_faults": case.faults,
        "detectable": detectable(rough, search.null, list(engine.forms)),
        "detectable_units": {e: SIZES[e][0] for e in EFFECTS},
        "checked": options.check,
        "good_enough_below_percent": options.tolerance_percent if good else None,
        "next_experiment": None if options.check or good else next_experiment(verdict, scales),
        "warnings": [
            *case.warnings,
            *_left_out(options.model),
            *([] if options.check or good else contradicted(case, rough, search.best)),
            *_warnings(case, noise, beside, outsider),
            *([] if options.check or good else _unseen(verdict)),
        ],
        "noise": {
            "white_um": noise.white_um,
            "coloured_um": noise.coloured_um,
            "correlation_s": noise.tau_s,
            "slow_um": noise.slow_um,
            "slow_correlation_s": noise.slow_tau_s,
            "from_cycles": noise.known,
        },
    }
    return Diagnosis(content, problem, noise, shown, best, predictions, regions)


# -- baseline and gap ---------------------------------------------------------------------------


def _scales(case: Case) -> Scales:
    traces = [case.identify, *case.train]
    # Rates, lengths and starts of the train records; the stroke of the slow loop.
    return Scales(
        u_min_V=case.u_min_V,
        range_V=case.range_V,
        stroke_um=max(float(np.ptp(case.identify.y_um)), 1e-9),
        rate_max_V_per_s=max(float(np.abs(np.diff(t.u_V)).max()) / t.step_s for t in traces),
        step_min_s=min(t.step_s for t in traces),
        length_max_s=max(t.u_V.size * t.step_s for t in traces),
        start_max_V=max(float(t.u_V[0]) for t in case.train),
    )


def _degrees(problem: Problem) -> dict[int, tuple[float, Array]]:
    """By degree of f0 on the slow loop: BIC and the coefficients."""
    start = np.zeros(problem.degree + 1)
    fit = problem.fit((), {}, start)
    gram = fit.jacobian @ fit.jacobian.T
    target = gram @ fit.beta + fit.jacobian @ fit.residual
    costs = {}
    for degree in range(DEGREE_MIN, problem.degree + 1):
        n = degree + 1
        beta = np.asarray(np.linalg.lstsq(gram[:n, :n], target[:n], rcond=1e-13)[0], np.float64)
        explained = 2 * beta @ target[:n] - beta @ gram[:n, :n] @ beta
        costs[degree] = (-explained + n * np.log(problem.rows), beta)
    return costs


def _baseline(
    problem: Problem, model: Model | None, by_degree: dict[int, tuple[float, Array]]
) -> Fit:
    """The predictor that is diagnosed, as a hypothesis without effects on all records."""
    if model is not None:
        return problem.at(problem.beta_of(model.f0))
    best = min((d for d in by_degree if d <= DEGREE_MAX), key=lambda d: by_degree[d][0])
    return problem.at(by_degree[best][1])


def _as_flashed(problem: Problem, baseline: Fit, best: Fit) -> tuple[Problem, Fit, Fit]:
    """The same with an f0 of a degree that the firmware runs."""
    if problem.degree <= DEGREE_MAX:
        return problem, baseline, best
    n = DEGREE_MAX + 1
    small = Problem(problem.traces, problem.noise, problem.scales, DEGREE_MAX, problem.flashed)
    same = small.at(baseline.beta[:n])
    return (
        small,
        same,
        same if best is baseline else small.fit(best.forms, best.values, best.beta[:n]),
    )


def _train_gap(problem: Problem, baseline: Fit) -> dict[str, float]:
    error = _train_error(problem, baseline)
    rms = float(np.sqrt(np.mean(error**2)))
    return {
        "rms_um": rms,
        "max_um": float(np.abs(error).max()),
        "percent_of_stroke": 100 * rms / problem.scales.stroke_um,
        "noise_floor_um": problem.noise.rms_um,
    }


def _train_error(problem: Problem, fit: Fit) -> Array:
    """Measured less predicted on the used rows of the train records, um."""
    y = problem.simulate(fit)
    return np.concatenate(
        [(t.y_um - v)[t.use] for t, v in zip(problem.traces, y, strict=True) if t.role == "train"]
    )


def _good_enough(gap: dict[str, float], options: Options) -> bool:
    """Whether the gap is below the tolerance that was asked for."""
    asked = options.tolerance_percent
    return asked is not None and gap["percent_of_stroke"] < asked


# -- search -------------------------------------------------------------------------------------


def _search(
    problem: Problem,
    heads: Problem,
    case: Case,
    baseline: Fit,
    options: Options,
    progress: Progress,
    good: bool,
) -> tuple[Engine, Search, Outsider | None]:
    """The result, its engine, and what may not be named and explains more."""
    fixed, values = known_forms(case, heads, baseline)
    given, measured, settled = monitored(case, heads, options.jobs)
    values = measured | values
    base = (*fixed, *(f for f in given if f.effect not in {k.effect for k in fixed}))
    barred = {*case.exclude, *settled, *(f.effect for f in fixed)}
    every = forms(problem.scales)
    free = [f for f in every if f.effect not in barred]
    if options.check or good:
        engine = Engine(problem, free, options.jobs, progress)
        null = problem.fit(base, values, baseline.beta)
        return engine, Search(null, null, {null.effects: null}), None
    lines = "periodic_disturbance" not in barred
    rough = Engine(heads, free, options.jobs, progress, lines)
    found = rough.search(heads.fit(base, values, baseline.beta))
    engine, search = rough, found
    longer = problem.with_traces(_heads(problem.traces, FURTHER_ROWS))
    for more in (longer, problem):
        if more.rows > engine.problem.rows:
            start = more.fit(base, values, search.null.beta)
            engine, search = _on_more(more, engine, search, start, more.rows <= longer.rows)
    search = engine.finest(search)
    progress("comparing with what is outside the vocabulary")
    # What the user rules out gets no name, but no other is named for it either.
    ruled_out = [f for f in every if f.effect in case.exclude and not f.refines]
    others = [*outside_forms(problem.scales, problem.traces), *ruled_out]
    best = search.best if engine is rough else rough.shown(search.best, found.null)
    outsider = rough.outsider(
        replace(found, best=best), others, "periodic_disturbance" in case.exclude
    )
    return engine, engine.proven(search, outsider) if outsider else search, outsider


def _on_more(
    problem: Problem, rough: Engine, found: Search, start: Fit, on: bool
) -> tuple[Engine, Search]:
    """The search's result and its rivals, fitted to more rows; and on where these show more."""
    rough.progress(f"fitting to {problem.rows} rows")
    engine = Engine(problem, rough.forms, rough.jobs, rough.progress, rough.lines)
    hopeless = bool(found.best.forms) and rough.is_hopeless(found.best, found.null)
    seen = rough.problem.excess_per_row(found.best.residual) if on else None
    return engine, engine.resume(start, found, rough.score, seen, hopeless)


def _heads(traces: Sequence[Trace], rows: int) -> list[Trace]:
    """Beginnings of the records, so that all together have about so many rows that are used."""
    used = [int(t.use.sum()) for t in traces]
    if sum(used) <= rows * 1.3:
        return list(traces)
    share = rows / len(traces)
    spare = sum(max(share - n, 0.0) for n in used)
    limit = int(share + spare / max(sum(n > share for n in used), 1))
    return [
        t if n <= limit else t.head(int(np.searchsorted(np.cumsum(t.use), limit)) + 1)
        for t, n in zip(traces, used, strict=True)
    ]


# -- what is told -------------------------------------------------------------------------------


def _verdict_json(verdict: Verdict) -> dict[str, Any]:
    return {
        "status": verdict.status,
        "effects": verdict.effects,
        "candidates": verdict.candidates,
        "confidence": verdict.confidence,
        "remainder_share": verdict.remainder_share,
    }


def _ranking(engine: Engine, heads: Problem, search: Search, baseline: Fit) -> list[dict[str, Any]]:
    """Per effect the best hypothesis that contains it, and what it leaves on the train records.

    The accepted one is told from all rows, the others from the heads that were searched.
    """
    entries = []
    names = sorted({e for key in search.fits for e in key})
    chosen = {name: best_with(name, engine, search) for name in names}
    gaps = {p: float(np.mean(_train_error(p, baseline) ** 2)) for p in {engine.problem, heads}}

    def refit(fit: Fit) -> tuple[Problem, Fit]:
        problem = engine.problem if fit is search.best else heads
        return problem, problem.fit(fit.forms, fit.values, fit.beta, 1)

    different = {f.effects: f for f in chosen.values()}
    refits = dict(zip(different, engine.map(refit, different.values()), strict=True))
    for name, fit in chosen.items():
        problem, full = refits[fit.effects]
        rest = search.fits.get(fit.effects - {name}, search.null)
        rms, ci95, closed = _out_of_sample(problem, full, gaps[problem])
        entries.append(
            {
                "effect": name,
                "effects": sorted(fit.effects),
                "models": [f.name for f in fit.forms],
                "rms_um": rms,
                "rms_um_ci95": ci95,
                "closable_closed": closed,
                "p_value": engine.p_value(rest, fit),
                "gain": engine.gain(rest, fit),
                "parameters": reported(name, full, problem),
                "score": engine.score(fit),
            }
        )
    entries.sort(key=lambda e: (e["effect"] not in search.best.effects, e["score"], e["effect"]))
    return entries


def best_with(effect: str, engine: Engine, search: Search) -> Fit:
    """The best hypothesis that contains an effect.

    For an accepted effect it is the accepted one: larger ones fit better by chance, and their
    parameters make up for each other.
    """
    if effect in search.best.effects:
        return search.best
    return min((f for f in search.fits.values() if effect in f.effects), key=engine.score)


def _out_of_sample(
    problem: Problem, full: Fit, gap2: float
) -> tuple[float, list[float], float | None]:
    """Cross-validated rms on the train records, its interval, and the share of the gap it closes.

    ``gap2`` is the mean square of the baseline's gap.
    """
    rms2, error = cross_validated(problem, full)
    ends = (max(rms2 + z * error, 0.0) for z in (-Z95, Z95))
    floor = problem.noise.rms_um**2
    closable = gap2 - floor
    closed = (gap2 - rms2) / closable if closable > CLOSABLE_MIN * floor else None
    return float(np.sqrt(rms2)), [float(np.sqrt(e)) for e in ends], closed


def _predictions(problem: Problem, case: Case, baseline: Fit, best: Fit) -> list[Prediction]:
    everything = problem.with_traces([*case.train, *case.holdout])
    return predict(everything, baseline, best)


def _told(outsider: Outsider, beside: set[str]) -> str:
    others = [f for f in outsider.fit.forms if f.effect not in beside]
    return ", ".join(f.name if f.effect == OUTSIDE else f.effect for f in others)


def _left_out(model: Model | None) -> list[str]:
    """Of a flashed model, what a diagnosis does not start from."""
    if model is None or all(b.effect != "initial_state" for b in model.blocks):
        return []
    return ["the model's initial_state is left out: records start at rest"]


def _beyond(case: Case, trace: Trace) -> str | None:
    """That a record leaves the identified range, and on how many rows."""
    slack = BEYOND_SHARE * case.range_V
    over = np.maximum(case.u_min_V - trace.u_V, trace.u_V - case.u_max_V)
    rows = int(np.sum(over > slack))
    if rows == 0:
        return None
    return (
        f"{trace.name} ({trace.role}) leaves {case.u_min_V:g} to {case.u_max_V:g} V "
        f"by up to {over.max():.3g} V on {rows} rows: f0 extrapolated"
    )


def _warnings(case: Case, noise: Noise, beside: set[str], outsider: Outsider | None) -> list[str]:
    said = []
    monitor = monitor_fault(case)
    if monitor is not None:
        said.append(monitor)
    if not noise.known:
        said.append("identify.csv repeats no cycle: the noise floor is a guess")
    said += filter(None, (_beyond(case, t) for t in (*case.train, *case.holdout)))
    if outsider is not None:
        said.append(
            f"not named, but the records are explained better by it: {_told(outsider, beside)}"
        )
    return said


def _unseen(verdict: Verdict) -> list[str]:
    if verdict.status != "no_gap":
        return []
    return [
        "effects below the sizes in diagnosis.json under `detectable` (in the report: What this "
        "campaign could not have seen) could not have been seen"
    ]
