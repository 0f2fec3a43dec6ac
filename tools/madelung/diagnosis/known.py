"""What the case already knows: given parameters, excluded effects, the amplifier's monitor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from madelung.diagnosis.case import Case, Trace
from madelung.diagnosis.effects import forms
from madelung.diagnosis.effects.form import Form, Param, Scales
from madelung.diagnosis.effects.mechanics import CREEP_TAU_S
from madelung.diagnosis.fit import Fit, Problem
from madelung.diagnosis.noise import Noise
from madelung.diagnosis.parameters import reported
from madelung.diagnosis.vocabulary import EFFECTS
from madelung.diagnosis.which import GAIN_MIN, RIVAL_GAIN, Engine, unlikeliness

MONITORED = ("saturation", "slew_limit", "amplifier_lag")
"""Effects that show between the command and the amplifier's monitor, and nowhere else."""
FOLLOWS_MIN = 0.5
"""Correlation of a monitor with the command, below which it measures something else."""
MISSED_SHARE = 1e-3
"""Of the range, rms, that a monitor may differ from what is fitted to it."""
_RENAMED = {"fn_hz": "fn1_hz", "zeta": "zeta1"}


def known_forms(case: Case, problem: Problem, start: Fit) -> tuple[list[Form], dict[str, float]]:
    """Forms of the known effects with the known parameters fixed, and start values.

    Of laws that know the same parameters the one that the records show: another would leave what
    a second effect is then called for.

    Parameters
    ----------
    start
        f0 alone: tells y(u_min), which a gain and an offset refer to.
    """
    given = _given(case, float(start.beta[0]))
    laws = _laws(given, problem.scales)
    chosen = {effect: own[0] for effect, own in laws.items()}
    values: dict[str, float] = {}
    for form in chosen.values():
        values |= form.starts(problem.scales)[0] | {k: given[k] for k in form.keys if k in given}
    for effect, own in laws.items():
        if len(own) > 1:
            others = [f for f in chosen.values() if f.effect != effect]
            fits = [problem.fit((*others, law), values, start.beta) for law in own]
            prices = [fit.cost + unlikeliness(fit) for fit in fits]
            chosen[effect] = own[int(np.argmin(prices))]
    if "offset_um" in given:  # with these effects y(u_min) may be another
        fit = problem.fit(tuple(chosen.values()), values, start.beta)
        given = _given(case, float(fit.beta[0]))
        chosen["gain_offset"] = _laws(given, problem.scales)["gain_offset"][0]
        values["offset_um"] = given["offset_um"]
    return list(chosen.values()), values


def _given(case: Case, at_u_min_um: float) -> dict[str, float]:
    """What is known, in the forms' own keys."""
    given = {_RENAMED.get(k, k): v for k, v in case.known.items()}
    if "creep_per_decade" in given:
        share = given.pop("creep_per_decade") / 2
        given |= {f"creep_{i}": share for i in range(len(CREEP_TAU_S))}
    if "gain" in given or "offset_um" in given:
        given = {"gain": 1.0, "offset_um": 0.0} | given
        given["offset_um"] -= (given["gain"] - 1.0) * at_u_min_um
    if given.get("knee_V") == 0.0:
        del given["knee_V"]  # clips hard
    return given


def _laws(given: Mapping[str, float], scales: Scales) -> dict[str, list[Form]]:
    """By effect its simplest forms that know the most of what is given, with that fixed."""
    laws: dict[str, list[Form]] = {}
    for form in forms(scales):
        if told := len(set(form.keys) & set(given)):
            own = laws.get(form.effect, [])
            most = len(set(own[0].keys) & set(given)) if own else 0
            if told > most:
                laws[form.effect] = [form]
            elif told == most and set(form.keys) == set(own[0].keys):
                own.append(form)
    return {
        effect: [replace(f, params=tuple(_fixed(p, given) for p in f.params)) for f in own]
        for effect, own in laws.items()
    }


def _fixed(p: Param, given: Mapping[str, float]) -> Param:
    return replace(p, low=given[p.key], high=given[p.key]) if p.key in given else p


def contradicted(case: Case, engine: Engine, best: Fit) -> list[str]:
    """Known parameters whose records say something else, beside what was accepted."""
    problem = engine.problem
    free = {(f.effect, f.name): f for f in forms(problem.scales)}
    said = []
    for own in best.forms:
        if not set(EFFECTS[own.effect].keys) & set(case.known):
            continue
        others = tuple(f for f in best.forms if f is not own)
        held = problem.fit((*others, own), best.values, best.beta)
        loose = problem.fit((*others, free[own.effect, own.name]), held.values, held.beta)
        if engine.gain(held, loose) > GAIN_MIN:
            told = reported(own.effect, loose, problem)
            said += [
                f"{key} = {case.known[key]:g} is given, and contradicted: "
                f"the records are explained better by {entry['value']:.4g}"
                for key, entry in told.items()
                if key in case.known and not entry["ci95"][0] <= case.known[key] <= entry["ci95"][1]
            ]
    return said


def monitor_fault(case: Case) -> str | None:
    """Why the records' monitor says nothing, if they have one and it does not."""
    pairs = [(t.u_V, t.u_meas_V) for t in (case.identify, *case.train) if t.u_meas_V is not None]
    if not pairs:
        return None
    if all(np.array_equal(u, m) for u, m in pairs):
        return "u_meas_V is u_V itself, no measurement: left out"
    u, m = (np.concatenate(columns) for columns in zip(*pairs, strict=True))
    if np.ptp(m) == 0.0 or np.corrcoef(u, m)[0, 1] < FOLLOWS_MIN:
        return "u_meas_V does not follow u_V: left out"
    return None


def _has_monitor(case: Case) -> bool:
    told = all(t.u_meas_V is not None for t in (case.identify, *case.train))
    return told and monitor_fault(case) is None


def monitored(
    case: Case, problem: Problem, jobs: int
) -> tuple[list[Form], dict[str, float], set[str]]:
    """What happens between command and monitor: the same search, on voltages.

    Returns
    -------
    The forms, their values, and the effects that this settles, found or not.
    """
    if not _has_monitor(case):
        return [], {}, set()
    traces = [_as_displacement(t) for t in problem.traces]
    rest = np.concatenate([np.diff(t.y_um - t.u_V, 2) for t in traces])
    white = max(float(np.median(np.abs(rest))) / 0.6745 / np.sqrt(6), 1e-6 * problem.scales.range_V)
    scales = replace(problem.scales, stroke_um=problem.scales.range_V)
    volts = Problem(traces, Noise(white, 0.0, 1.0, rest.size, True), scales, 1)
    # The monitor may be sampled by the sensor's clock, which need not be the command's.
    # A delay shows in it where the drive is late, not where the sensor is.
    tried = {*MONITORED, "delay", "clock_skew"}
    free = [f for f in forms(scales) if f.effect in tried]
    start = volts.fit((), {}, np.array([case.u_min_V, case.range_V / 2]))
    engine = Engine(volts, free, jobs, lambda _: None, lines=False)
    found = engine.search(start)
    best = found.best
    open_ = any(engine.gain(f, best) < RIVAL_GAIN for f in engine.alternatives(found))
    missed_V = white * float(np.sqrt(np.mean(best.residual**2)))
    told = engine.is_enough(best, found.null) or missed_V < MISSED_SHARE * scales.range_V
    if open_ or best.effects & case.exclude or not told:
        return [], {}, set()
    settled = [f for f in best.forms if f.effect != "clock_skew"]
    values = {p.key: best.values[p.key] for f in settled for p in f.params}
    return settled, values, {*MONITORED, *best.effects} - {"clock_skew"}


def _as_displacement(trace: Trace) -> Trace:
    assert trace.u_meas_V is not None
    return replace(trace, y_um=trace.u_meas_V)


assert set(MONITORED) <= set(EFFECTS)
