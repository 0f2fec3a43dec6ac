"""Which effects explain the gap: a search over hypotheses, and what may be said of the result.

Every hypothesis refits f0. A search by beam adds one effect at a time. An effect is accepted when
the cost falls by more than chance, counted only where the richer hypothesis comes down to the
noise, and when it removes a visible share of what was unexplained. What cannot be told apart from
the accepted set is kept as an alternative.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from madelung.diagnosis.effects.form import Form
from madelung.diagnosis.effects.mechanics import creep_tau_s
from madelung.diagnosis.effects.sensor import line_form
from madelung.diagnosis.fit import ITERATIONS, Fit, Probe, Problem
from madelung.diagnosis.lines import lines_hz, peaks, steady, steady_hz
from madelung.diagnosis.noise import proven_fall
from madelung.diagnosis.vocabulary import EFFECTS

Array = NDArray[np.float64]
Progress = Callable[[str], None]
T = TypeVar("T")
S = TypeVar("S")

GAIN_MIN = 120.0
"""Fall of the cost, in units of the noise, below which nothing is accepted."""
GAIN_FURTHER = 300.0
GAIN_BESIDE_CLEAN = 1000.0
FURTHER_SHARE = 1e-3
FURTHER_CLEAN_SHARE = 1e-4
"""An effect that joins others must show more clearly, most where these are many or leave no more
than the noise is known to be, and be more than this share of the whole gap (the second, where it
removes nearly all that the others left): no model is so right that what it leaves is nothing but
noise."""
RIVAL_SHARE = 0.5
LINEAR_SHARE = 0.95
NEAR_SHARE = 0.2
"""Of what the best removes, the shares that a rival must promise before it is fitted, which for a
linear one is all it can do, and that it may still leave after a rough fit, to be fitted to the end
even if it is not the best.
"""
HOPEFUL_SHARE = 0.5
"""Of the least gain, below which no other form of an effect is tried."""
RIVAL_GAIN = 12.0
"""By which a rival's cost may be higher, in units of the noise, and the data not rule it out."""
HOPELESS = 4000.0
"""A fit whose cost is higher by this has no weight, under any noise."""
UNLIKELY_GAIN = 20.0
UNLIKELY_SHARE = 0.5
"""A model that is unlikely beforehand must show more by the first, in units of the noise; as long
as others may be missing, it must leave less than this share of what a usual one leaves."""
GAIN_PER_PARAM = 3.0
SCREEN_MIN = 15.0
SCREEN_SHARE = 1e-3
VISIBLE_SHARE = 0.03
REMAINDER_SHARE = 0.4
"""What is accepted removes more than the first share of the gap, and more than the second of what
was unexplained, both in the same record or in all together."""
REMAINDER_MAX = 0.05
MOST_SHARE = 0.7
"""Where less than the first share of the gap is left, which a verdict allows, what joins removes
the second of that: less is what a model that is not quite right leaves to others."""
SHARE_FLOOR = 25.0
"""Excess that shares are taken of at least."""
CLEAN_SHARE = 0.9
CLEAN_VISIBLE = 5e-4
"""An effect that removes nearly all that was unexplained may be so small a part of the gap, ..."""
STIFF_PARAMS = 2
"""... if it has no more parameters and is no unlikely model: these may fit what another does not do
quite right."""
EXACT_SHARE = 0.95
"""Of what is more than noise, that nothing but the cause removes."""
BEAM = 3
FRONT_RATIO = 20.0
FITS_MAX = 9
FORMS_MAX = 2
"""Of one effect that are fitted beside others."""
FINE_MAX = 5
SIZE_MAX = 3
PAIR = 2
ENOUGH_SHARE = 0.01
"""Of the gap, that may be left when no more is looked for beside two effects, and rivals alone."""
ROUGH_ITERATIONS = 3
LOST_ITERATIONS = 4
STARTS_PER_TRY = 12
TRIES_MAX = 4
RIVALS_MAX = 4
RIVAL_PRICE = 200.0
"""Above the best's score, where a hypothesis is no longer fitted to all rows to the end."""
HOPELESS_SHARE = 0.5
NEARLY_SHARE = 0.3
"""Of the gap, above which no form of an effect would do that only refines another."""
EXCHANGES_MAX = 3
EXCHANGE_LEFT = 0.8
"""An exchange that leaves more than this share of the excess is the last one of its effect."""
EXCHANGE_FORMS = 3
EXCHANGE_TRIES = 2
EXCHANGE_SLACK = 0.3
"""A form that is this share of the excess worse after a few steps is not fitted to the end."""
LINES = "periodic_disturbance"
BENT = frozenset({"asymmetry", "non_masing"})
"""Loops that are not symmetric bend minor loops too: one effect, not two (diagnose.md)."""
MORE_RATIO = 1.3
MUCH_MORE_RATIO = 10.0
"""Of what fewer rows showed, above which another search is worth it; after a hopeless one."""
WEIGHTY_SHARE = 0.2
"""Of what stays unexplained, that an effect must explain to be named beside it."""
DAMPING_SHARE = 0.95
SLEW_SHARE = 0.95
CREEP_FAST_S = 0.05
CREEP_SLOW_SHARE = 0.3
"""Of the displacement that follows late, later than the time above: it is log-like in time."""
STRETCH_ROWS = 64
OUTSIDE_SHARE = 0.01
"""Of what an effect explains, that a curve must explain more in its place: that much it takes from
any model that is not quite right."""
OUTSIDE_LEFT = 0.3
"""Share of the accepted effects' excess that what is outside the vocabulary may leave."""
EXCESS_MIN = 0.05
SPOTLESS_EXCESS = 0.01
"""Excess over the noise, as a share of it, that is taken for structure; and below which no other
form of an effect is tried."""


@dataclass(frozen=True)
class Search:
    """What the search found.

    Attributes
    ----------
    null
        f0 alone, fitted to all records.
    best
        The accepted hypothesis (possibly without any effect).
    fits
        The best fit of every set of effects that was fitted, by set.
    """

    null: Fit
    best: Fit
    fits: dict[frozenset[str], Fit]


@dataclass(frozen=True)
class Outsider:
    """What no verdict names, and explains the records better than the accepted effects.

    Attributes
    ----------
    fit
        The hypothesis, fitted to the rows that were searched.
    gain
        Over the accepted one.
    instead
        The effects in whose place it stands.
    """

    fit: Fit
    gain: float
    instead: frozenset[str] = frozenset()


class Engine:
    """Fits many hypotheses on a problem, side by side.

    Parameters
    ----------
    lines
        Whether a periodic disturbance is looked for.
    """

    def __init__(
        self,
        problem: Problem,
        forms: Sequence[Form],
        jobs: int,
        progress: Progress,
        lines: bool = True,
    ) -> None:
        self.lines = lines
        self.problem = problem
        self.forms = forms
        self.jobs = jobs
        self.progress = progress
        self.fits: dict[frozenset[str], Fit] = {}

    def search(self, start: Fit) -> Search:
        """From f0 alone to the set of effects that is accepted."""
        null = self._keep(start)
        found = self._climb(null, null)
        # What was given up after a rough fit may yet come as near.
        for fit in self.map(self.again, self._rivals(found, self.score)[0]):
            self._keep(fit)
        return found

    def resume(
        self,
        start: Fit,
        found: Search,
        price: Callable[[Fit], float],
        seen_before: Array | None = None,
        hopeless: bool = False,
    ) -> Search:
        """A smaller problem's result, fitted to these rows; and on where these show more.

        Parameters
        ----------
        start
            f0 alone on all rows.
        found
            On the smaller problem.
        price
            Ranks the smaller problem's fits.
        seen_before
            By record, what the smaller problem's result left there above the noise, per row: what
            is clearly more calls for another search.
            None: the search ends here, and rivals are near enough to be fitted in a few steps.
        hopeless
            The smaller problem's result explains little: only where these rows show a gap of
            another size another search is worth its time.
        """
        on = seen_before is not None and not hopeless
        null = self._keep(start)
        best = self._keep(self._with_lines_again(self.again(found.best)))
        near, far = self._rivals(found, price)
        again = self.map(lambda f: self.again(f, ITERATIONS if on else 2), near)
        again += self.map(lambda f: self.again(f, 1 if on else 0), far)
        for fit in again:  # in their order, not in that of the threads
            self._keep(fit)
        seen = self.problem.excess_per_row(best.residual)
        if seen_before is None or self.is_enough(best, null):
            more = False
        else:
            ratio = MUCH_MORE_RATIO if hopeless else MORE_RATIO
            more = bool(np.any(seen > ratio * np.maximum(seen_before, 0.0) + EXCESS_MIN))
        if more:
            return self._climb(null, self._refined(best, null))
        return Search(null, self._pruned(best, null), self.fits)

    def finest(self, found: Search) -> Search:
        """With the same laws in finer steps, where that scores better: they tell sizes better."""
        best = found.best
        for old in best.forms:
            for form in self.forms:
                if form.same_law and form.effect == old.effect and form is not old:
                    own = tuple(form if f is old else f for f in best.forms)
                    finer = self.again(replace(best, forms=own, values=form.null() | best.values))
                    if _plausible(finer, form.effect):
                        best = min(best, finer, key=self.score)
        return replace(found, best=self._keep(best))

    def _rivals(self, found: Search, price: Callable[[Fit], float]) -> tuple[list[Fit], list[Fit]]:
        """What more rows may not rule out of a smaller problem's fits; one of each other effect."""
        ranked = sorted(found.fits.values(), key=price)
        others = [f for f in ranked if f.effects not in (found.best.effects, found.null.effects)]
        limit = price(found.best) + RIVAL_PRICE
        near = [f for f in others if price(f) < limit and len(f.forms) <= len(found.best.forms)]
        near = near[:RIVALS_MAX]
        named = set(found.best.effects).union(*(f.effects for f in near))
        far = []
        # No larger ones first: they may be rivals.
        for fit in sorted(others, key=lambda f: len(f.forms) > len(found.best.forms)):
            if not fit.effects <= named:
                far.append(fit)
                named |= fit.effects
        return near, far

    def again(self, fit: Fit, iterations: int = ITERATIONS) -> Fit:
        """Fitted to this problem's rows, from another's solution."""
        return self._slim(self.problem.fit(fit.forms, fit.values, fit.beta, iterations))

    def shown(self, fit: Fit, null: Fit) -> Fit:
        """Of another problem's solution what these rows show."""
        return self._pruned(self.again(fit), null)

    def _climb(self, null: Fit, best: Fit) -> Search:
        """Up, and without what has become superfluous; on from there when that leaves too much."""
        came_by = {null.effects}
        while True:
            top = self._ascended(null, best)
            best = self._pruned(top, null)
            if best.effects in came_by | {top.effects} or self.is_enough(best, null):
                return Search(null, best, self.fits)
            came_by.add(best.effects)

    def _ascended(self, null: Fit, best: Fit) -> Fit:
        """With one effect more at a time, as long as each is accepted."""
        beam = [best]
        for size in range(len(best.forms) - len(null.forms) + 1, SIZE_MAX + 1):
            if size > PAIR and self.is_enough(best, null):
                break
            found = self._expand(beam, null)
            if not found:
                break
            ranked = self._front(found)
            hope = HOPEFUL_SHARE * self._gain_min(best)
            # One of two causes may prove nothing as long as the other hides it.
            alone = size == 1 and not self._is_clean(best)
            if self.gain(best, ranked[0]) > hope:
                if size == 1 or not self.is_hopeless(ranked[0], null):
                    ranked = self._with_better_forms(ranked, null, BEAM if size == PAIR else 1)
            elif not alone:
                break
            if self.accepted(best, ranked[0], null):
                best = ranked[0]
            elif not alone:
                break
            beam = self._front(ranked)[: BEAM if size == 1 else 1]
        return best

    def _with_better_forms(self, ranked: list[Fit], null: Fit, most: int) -> list[Fit]:
        """The best refined; so are others while it leaves too much, or as it taught to."""
        done: set[frozenset[str]] = set()
        while len(done) < most:
            best = next((f for f in ranked if f.effects not in done), None)
            if best is None or (best is not ranked[0] and self.is_enough(ranked[0], null)):
                break
            done.add(best.effects)
            new = self._refined(best, null)
            others = [f for f in ranked if f is not best]
            if new.forms != best.forms and not self._is_clean(new):
                others = self.map(partial(self._taught, by=new), others)
            ranked = sorted([new, *others], key=self.score)
        return ranked

    def _taught(self, fit: Fit, by: Fit) -> Fit:
        """With another hypothesis's forms of the effects that both have, if that is better."""
        own = {f.effect: f for f in by.forms}
        forms = tuple(own.get(f.effect, f) for f in fit.forms)
        if forms == fit.forms:
            return fit
        learned = {k: by.values[k] for f in forms if f.effect in own for k in f.keys}
        new = self.again(replace(fit, forms=forms, values=fit.values | learned))
        if not steady(self.problem, new) or not all(_plausible(new, e) for e in new.effects):
            return fit
        return min(fit, self._keep(new), key=self.score)

    def score(self, fit: Fit) -> float:
        """Cost with a price for each parameter, and for what is unlikely beforehand."""
        n = self.problem.rows
        price = len(fit.params) * float(np.log(n)) + unlikeliness(fit)
        return float(fit.cost / max(1.0, fit.cost / n) ** 0.5) + price

    def _keep(self, fit: Fit) -> Fit:
        slim = self._slim(fit)
        have = self.fits.get(fit.effects)
        if have is None or self.score(slim) < self.score(have):
            self.fits[fit.effects] = slim
        return slim

    def map(self, function: Callable[[S], T], items: Iterable[S]) -> list[T]:
        """The function of every item, side by side, in their order."""
        if self.jobs < 2:
            return [function(i) for i in items]
        with ThreadPoolExecutor(self.jobs) as pool:
            return list(pool.map(function, items))

    def _front(self, fits: list[Fit]) -> list[Fit]:
        """The best, and those that do not leave far more unexplained."""
        ranked = sorted(fits, key=self.score)
        limit = (
            FRONT_RATIO * max(ranked[0].cost - self.problem.rows, 0.0) + 0.05 * self.problem.rows
        )
        return [f for f in ranked if f.cost - self.problem.rows <= limit]

    def _refined(self, fit: Fit, null: Fit) -> Fit:
        """With other or richer forms of its effects, where these are better.

        The form that fits best alone need not fit best beside other effects. Where several leave
        a part, none is too fine to be tried.
        """
        for effect in sorted(fit.effects):
            tried: set[str] = set()  # two forms may each come nearer where the other does not
            for _ in range(EXCHANGES_MAX):
                if self._is_spotless(fit):
                    fit = self.nearest_law(fit, effect)
                    break
                before, fit = fit, self._with_another_form(fit, effect, null, tried)
                if self._excess(fit) > EXCHANGE_LEFT * self._excess(before):
                    break
        return fit

    def _is_spotless(self, fit: Fit) -> bool:
        return self._excess(fit) < SPOTLESS_EXCESS * self.problem.rows

    def nearest_law(self, fit: Fit, effect: str) -> Fit:
        """With the nearest of the effect's laws in the same parameters, which tells them best."""
        own = next(f for f in fit.forms if f.effect == effect)
        laws = [
            f
            for f in self.forms
            if f.effect == effect
            and set(f.keys) == set(own.keys)
            and not f.unlikely
            and f is not own
        ]

        def with_law(law: Form) -> Fit:
            forms = tuple(law if f is own else f for f in fit.forms)
            return self.problem.fit(forms, fit.values, fit.beta)

        best = min([fit, *self.map(with_law, laws)], key=lambda f: f.cost)
        return fit if best is fit or not _plausible(best, effect) else self._keep(best)

    def _with_another_form(self, fit: Fit, effect: str, null: Fit, tried: set[str]) -> Fit:
        """With another form of an effect in place of its own, if one is better; else as it is."""
        old = next(f for f in fit.forms if f.effect == effect)
        tried.add(old.name)
        rest = tuple(f for f in fit.forms if f is not old)
        every = _fitted(fit) > 1 and self._is_near(fit, null)  # of one, another may be missing
        forms = [
            f
            for f in self.forms
            if f.effect == effect
            and f.name not in tried
            and (every or not f.refines or set(old.keys) & set(f.keys))
        ]
        probe = Probe(self.problem, self.problem.fit(fit.forms, fit.values, fit.beta, 1))
        tries = [(f, start) for f in forms for start in self._starts_from(fit, f)]

        def worth(a_try: tuple[Form, dict[str, float]]) -> tuple[float, float]:
            change = probe.difference((*rest, a_try[0]), a_try[1])
            return probe.gain(change), probe.fall(change)

        def rough(a_try: tuple[Form, dict[str, float]]) -> Fit:
            form, start = a_try
            own = tuple(form if f is old else f for f in fit.forms)
            return self.problem.fit(own, start, fit.beta, ROUGH_ITERATIONS)

        chosen = _promising(tries, self.map(worth, tries))
        best = min(self.map(rough, chosen), key=lambda f: f.cost, default=fit)
        if best.cost > fit.cost + EXCHANGE_SLACK * abs(fit.cost - self.problem.rows):
            return fit
        new = self._slim(self.problem.fit(best.forms, best.values, best.beta))
        extra = max(len(new.params) - len(fit.params), 0)
        price = (GAIN_MIN if extra else 0.0) + GAIN_PER_PARAM * extra
        price += max(unlikeliness(new) - unlikeliness(fit), 0.0)
        proven = self.gain(fit, new) > price
        return self._keep(new) if proven and _plausible(new, effect) else fit

    def _starts_from(self, fit: Fit, form: Form) -> list[dict[str, float]]:
        """Of a form beside a fit's others: its own, and those with what both forms have."""
        others = {k: v for k, v in fit.values.items() if k not in form.keys}
        kept = {k: v for k, v in fit.values.items() if k in form.keys}
        own = [others | start for start in form.starts(self.problem.scales)]
        mixed = [start | kept for start in own if kept]
        return [s for s in (*own, *mixed) if all(k in s for k in form.keys)]

    # -- one level ----------------------------------------------------------------------------

    def _expand(self, beam: list[Fit], null: Fit) -> list[Fit]:
        found: dict[frozenset[str], Fit] = {}
        for parent in beam:
            whole = min(found.values(), key=self.score, default=parent)
            if self._is_clean(whole) and not parent.effects <= whole.effects:
                continue  # what explains everything is not looked for beside something else
            names = " + ".join(sorted(parent.effects)) or "f0 alone"
            self.progress(f"adding an effect to {names}")
            full = self.problem.fit(parent.forms, parent.values, parent.beta, iterations=2)
            # A child that is no better than this parent was not fitted well from another one.
            seen = {key for key, fit in found.items() if fit.cost < parent.cost}
            lines = self._lines(full) if self.lines else []
            free = [f for f in [*self.forms, *lines] if not f.refines]
            # Beside what leaves next to nothing only what may leave as little is of interest.
            goal = whole.cost if self.is_enough(whole, null) else None
            for fit in self._children(full, free, seen, goal):
                key = fit.effects
                if key not in found or self._is_preferred(fit, found[key]):
                    found[key] = fit
        return [self._keep(f) for f in found.values()]

    def _is_preferred(self, fit: Fit, other: Fit) -> bool:
        """Of the same effects: better, and by far if by a model that is unlikely beforehand.

        As long as another cause is hidden, a little better says nothing of the model.
        """
        if unlikeliness(fit) == unlikeliness(other):
            return self.score(fit) < self.score(other)
        usual, unusual = sorted((fit, other), key=unlikeliness)
        more, less = (max(self._excess(f), 0.0) for f in (usual, unusual))
        by_far = less < UNLIKELY_SHARE * more
        return fit is (unusual if by_far else usual)

    def is_enough(self, fit: Fit, null: Fit) -> bool:
        """Whether what is left is too little to look for what explains more."""
        return self._is_clean(fit) or self._excess(fit) < ENOUGH_SHARE * self._excess(null)

    def is_hopeless(self, fit: Fit, null: Fit) -> bool:
        """Whether so much is left that no other form of what is in it would help."""
        return self._excess(fit) > HOPELESS_SHARE * self._excess(null)

    def _is_near(self, fit: Fit, null: Fit) -> bool:
        """Whether most is explained, but not enough: a finer model may do it."""
        most = self._excess(fit) < NEARLY_SHARE * self._excess(null)
        return most and not self.is_enough(fit, null)

    def _excess(self, fit: Fit) -> float:
        """What a fit leaves in all records above the noise."""
        return float(self.problem.excess(fit.residual).sum())

    def _is_clean(self, fit: Fit) -> bool:
        """Whether no record has more than noise left."""
        return bool(np.all(self.problem.excess_per_row(fit.residual) < EXCESS_MIN))

    def _children(
        self,
        parent: Fit,
        forms: Sequence[Form],
        seen: Collection[frozenset[str]] = (),
        goal: float | None = None,
    ) -> list[Fit]:
        """Fits with one of these forms more, but for sets of effects that were seen.

        ``goal``: the cost that a form must come near to, as far as its start tells.
        """
        way = 0.0 if goal is None else parent.cost - goal
        free = [
            f
            for f in forms
            if f.effect not in parent.effects
            and not (f.effect in BENT and parent.effects & BENT)
            and parent.effects | {f.effect} not in seen
        ]
        probe = Probe(self.problem, parent)
        screened = self.map(lambda f: self._screen(probe, f), free)
        top = max((found[0][0] for found in screened if found), default=0.0)
        limit = max(SCREEN_MIN, SCREEN_SHARE * top)
        gains = {i: found[0][0] for i, found in enumerate(screened) if found}
        promised = {
            i: max(limit, (LINEAR_SHARE if free[i].linear else RIVAL_SHARE) * way) for i in gains
        }
        ranked = sorted((i for i in gains if gains[i] > promised[i]), key=lambda i: -gains[i])
        named = [free[i].effect for i in ranked]
        few = [
            i for n, i in enumerate(ranked) if named[:n].count(named[n]) < self._forms_max(parent)
        ]
        chosen = sorted(few[: self._fits_max(parent)])
        tries = [(free[i], start) for i in chosen for _, start in screened[i]]
        rough = self._best_of_each(
            self.map(
                lambda t: self.problem.fit(
                    (*parent.forms, t[0]),
                    parent.values | t[1],
                    parent.beta,
                    ROUGH_ITERATIONS,
                    parent,
                    rough=True,
                ),
                tries,
            )
        )
        if LINES in parent.effects:
            rough = self.map(self._without_false_lines, rough)
        rough = [f for f in rough if steady(self.problem, f) and _joins_plausibly(f, parent)]
        if not rough:
            return []
        near = self._front(rough)[:FINE_MAX]
        if goal is not None:
            near = [f for f in near if f is near[0] or f.cost < goal + NEAR_SHARE * way]
        fine = self.map(
            lambda f: self._slim(self.problem.fit(f.forms, f.values, f.beta, near=f)), near
        )
        fine = [f for f in fine if steady(self.problem, f) and _joins_plausibly(f, parent)]
        return [self._slim(f) for f in rough if not any(f is g for g in near)] + fine

    @staticmethod
    def _fits_max(parent: Fit) -> int:
        return FITS_MAX if _fitted(parent) else FITS_MAX + 6

    @staticmethod
    def _forms_max(parent: Fit) -> int:
        return FORMS_MAX if _fitted(parent) else FORMS_MAX + 3

    @staticmethod
    def _best_of_each(fits: list[Fit]) -> list[Fit]:
        """The best fit of every combination of forms, in order."""
        best: dict[tuple[str, ...], Fit] = {}
        for fit in fits:
            key = tuple(f"{f.effect}: {f.name}" for f in fit.forms)
            if key not in best or fit.cost < best[key].cost:
                best[key] = fit
        return list(best.values())

    @staticmethod
    def _slim(fit: Fit) -> Fit:
        return replace(fit, jacobian=np.empty((0, 0)))

    def _screen(self, probe: Probe, form: Form) -> list[tuple[float, dict[str, float]]]:
        """The most promising starts of a form, the best first; more where there are many."""
        starts = form.starts(self.problem.scales)
        columns = [probe.signature(form, start) for start in starts]
        found = [(probe.gain(c), i) for i, c in enumerate(columns)]
        found.sort(key=lambda f: (-f[0], f[1]))
        keep = min(1 + len(starts) // STARTS_PER_TRY, TRIES_MAX)
        chosen = found[:keep]
        if not form.linear:  # where the model is good as it stands, the way is short
            best = max(range(len(starts)), key=lambda i: (probe.fall(columns[i]), -i))
            chosen += [f for f in found[keep:] if f[1] == best]
        return [(g, _sized(form, starts[i], probe, columns[i])) for g, i in chosen if g > 0]

    def _lines(self, parent: Fit) -> list[Form]:
        found = peaks(self.problem, parent.residual)
        return [self._line_form(tuple(found[: k + 1])) for k in range(len(found))]

    def _line_form(self, freq_hz: tuple[float, ...]) -> Form:
        names = tuple(t.name for t in self.problem.traces if t.role != "identify")
        return line_form(freq_hz, names, self.problem.scales)

    def _without_false_lines(self, fit: Fit) -> Fit:
        """Without lines that were what another effect, which has joined them, explains."""
        kept = steady_hz(self.problem, fit)
        if not kept or kept == lines_hz(fit):
            return fit
        lines = self._line_form(kept)
        forms = tuple(lines if f.effect == LINES else f for f in fit.forms)
        start = fit.values | lines.starts(self.problem.scales)[0]
        return self.problem.fit(forms, start, fit.beta, ROUGH_ITERATIONS)

    def _with_lines_again(self, fit: Fit) -> Fit:
        """With its lines looked for again, if that is better: more rows tell them apart."""
        if LINES not in fit.effects or not self.lines:
            return fit
        rest = tuple(f for f in fit.forms if f.effect != LINES)
        bare = self.problem.fit(rest, {k: fit.values[k] for f in rest for k in f.keys}, fit.beta, 2)
        found = [fit]
        for lines in self._lines(bare):
            start = bare.values | lines.starts(self.problem.scales)[0]
            found.append(self._slim(self.problem.fit((*rest, lines), start, bare.beta)))
        return min((f for f in found if steady(self.problem, f)), key=self.score, default=fit)

    def alternatives(self, search: Search) -> list[Fit]:
        """Other hypotheses of no more effects than the best, by their score."""
        best = search.best
        found = [f for f in search.fits.values() if not f.effects <= best.effects]
        return sorted((f for f in found if len(f.forms) <= len(best.forms)), key=self.score)

    def outsider(
        self, search: Search, forms: Sequence[Form], lines: bool = False
    ) -> Outsider | None:
        """What explains the records better than the accepted effects, with no more models.

        Parameters
        ----------
        forms
            Of what no verdict names: one of them takes the place of one effect or of all.
        lines
            Whether a periodic disturbance is among that.
        """
        best, given = search.best, search.null.effects
        named = best.effects - given
        bases = {best.effects - {e} for e in named} | ({given} if named else set())
        better: list[Fit] = []
        for base in (self.fits[key] for key in sorted(bases & self.fits.keys(), key=sorted)):
            parent = self.problem.fit(base.forms, base.values, base.beta, iterations=2)
            more = self._lines(parent) if lines else []
            found = self._children(parent, [*forms, *more], goal=best.cost)
            better += [f for f in found if self._outdoes(f, best, parent)]
        if not better:
            return None
        nearest = min(better, key=self.score)
        return Outsider(nearest, self.gain(best, nearest), best.effects - nearest.effects)

    def proven(self, search: Search, outsider: Outsider) -> Search:
        """The search's result without the effects in whose place something outside explains more.

        ``outsider`` may come from a part of this problem's rows.
        """
        kept = search.null.effects | (search.best.effects - outsider.instead)
        rest = tuple(f for f in search.best.forms if f.effect in kept)
        start = self.fits.get(kept, replace(search.best, forms=rest))
        return replace(search, best=self._keep(self.again(start)))

    def _outdoes(self, other: Fit, best: Fit, base: Fit) -> bool:
        """Whether it comes clearly nearer; or, with fewer models, is not clearly farther off.

        ``base`` is what both have in common.
        """
        rows = self.problem.rows
        back = self.gain(other, best)
        price = GAIN_PER_PARAM * max(len(other.params) - len(best.params), 0)
        simpler = len(other.forms) < len(best.forms) and back + price < GAIN_FURTHER
        clearly = self.gain(best, other) - max(back, 0.0) > GAIN_MIN + price
        # Curves take from what a model does not do quite right; a cause leaves little.
        cause = all(f.effect in EFFECTS for f in other.forms)
        share = 0.0 if cause else OUTSIDE_SHARE * max(base.cost - best.cost, 0.0)
        if not simpler and not (clearly and best.cost - other.cost > share):
            return False
        return cause or other.cost - rows < max(
            OUTSIDE_LEFT * (best.cost - rows), EXCESS_MIN * rows
        )

    # -- acceptance ---------------------------------------------------------------------------

    def accepted(self, old: Fit, new: Fit, null: Fit) -> bool:
        """Whether the richer hypothesis is proven against the poorer one."""
        extra = len(new.params) - len(old.params)
        gain = self.gain(old, new)
        if gain < self._gain_min(old) + GAIN_PER_PARAM * max(extra, 1):
            return False
        visible, telling = self._shares(old, new, null)
        # One parameter that explains all there is may act but once, as a slew limit in one step.
        once = extra == 1 and telling[-1] > CLEAN_SHARE
        if not once and _spread_gain(old, new) < GAIN_MIN / 2:
            return False
        usual = unlikeliness(new) <= unlikeliness(old)
        if usual and gain > GAIN_BESIDE_CLEAN and self._is_exact(old, new, telling):
            return True
        if _fitted(old) and telling[-1] < MOST_SHARE and self._is_allowed(old, null):
            return False
        least = CLEAN_VISIBLE if usual and extra <= STIFF_PARAMS else VISIBLE_SHARE
        lone = FURTHER_SHARE if telling[-1] < CLEAN_SHARE else FURTHER_CLEAN_SHARE
        if _fitted(old) and visible[-1] < lone and self._removed(old, new, null) < lone:
            return False
        clean = (telling > CLEAN_SHARE) & (visible > least)
        large = (telling > REMAINDER_SHARE) & (visible > VISIBLE_SHARE)
        return bool(np.any(clean | large))

    def _is_exact(self, old: Fit, new: Fit, telling: Array) -> bool:
        """Whether it explains all that the poorer one leaves, and that is more than the noise.

        However small a part of the gap that is, no wrong model does so by accident.
        """
        all_of_it = telling[-1] > EXACT_SHARE and self._is_clean(new)
        return bool(all_of_it and not self._is_clean(old))

    def _is_allowed(self, fit: Fit, null: Fit) -> bool:
        """Whether it leaves so little of the gap that a verdict would allow it."""
        return self._excess(fit) < REMAINDER_MAX * self._excess(null)

    def _gain_min(self, old: Fit) -> float:
        """Least fall of the cost that one effect more must bring, but for its parameters' price."""
        others = _fitted(old)
        if not others:
            return GAIN_MIN
        clean = self._excess(old) < EXCESS_MIN * self.problem.rows
        return GAIN_BESIDE_CLEAN if clean or others > 1 else GAIN_FURTHER

    def _shares(self, old: Fit, new: Fit, null: Fit) -> tuple[Array, Array]:
        """What the richer hypothesis removes, by record and at last of all, as two shares.

        They are of the whole gap, and of what the poorer hypothesis left of it.
        """
        before, left, after = (self.problem.excess(f.residual) for f in (null, old, new))
        removed = left - after
        whole, rest = (np.maximum(e, 0.0) + SHARE_FLOOR for e in (before, left))
        visible, telling = (
            np.append(removed / of, removed.sum() / of.sum()) for of in (whole, rest)
        )
        return visible, telling

    def _removed(self, old: Fit, new: Fit, null: Fit) -> float:
        """Share that the richer hypothesis removes of what f0 alone leaves, by its energy in um^2.

        Where the noise is coloured, fast parts weigh most in the costs; here they do not.
        """
        before, left, after = (self.problem.energy_um2(f) for f in (null, old, new))
        return (left - after) / max(before, 1e-300)

    def gain(self, old: Fit, new: Fit) -> float:
        """Fall of the cost under the least favourable noise."""
        parts, steps = self.problem.slices, [t.step_s for t in self.problem.traces]
        before, after = ([f.residual[s] for s in parts] for f in (old, new))
        return proven_fall(self.problem.noise, before, after, steps)

    def p_value(self, old: Fit, new: Fit) -> float:
        """Of the gain by chance, with a price for the number of models tried."""
        extra = max(len(new.params) - len(old.params), 1)
        return float(min(1.0, len(self.forms) * chi2.sf(max(self.gain(old, new), 0.0), extra)))

    def weighty(self, search: Search) -> Search:
        """The result without effects that explain little beside what stays unexplained.

        What has no name is no noise: by chance a part of it looks like many an effect.
        """

        def is_light(smaller: Fit, fit: Fit) -> bool:
            left = self._excess(fit)
            return self._excess(smaller) - left < WEIGHTY_SHARE * left

        return replace(search, best=self._pruned(search.best, search.null, is_light))

    def _pruned(
        self, fit: Fit, null: Fit, is_needless: Callable[[Fit, Fit], bool] | None = None
    ) -> Fit:
        """Without effects that the others, or what the case gives, make superfluous.

        Or without those that are needless as told of a smaller fit and a larger one.
        """
        is_needless = is_needless or (lambda s, f: not self.accepted(s, f, null))
        while len(fit.forms) > len(null.forms):
            smaller = []
            for form in [f for f in fit.forms if f.effect not in null.effects]:
                rest = tuple(f for f in fit.forms if f is not form)
                if len(rest) == len(null.forms):
                    smaller.append(null)
                    continue
                values = {p.key: fit.values[p.key] for f in rest for p in f.params}
                key = frozenset(f.effect for f in rest)
                have = self.fits.get(key)
                limit = fit.cost + HOPELESS
                lost = have is not None and have.forms == rest and have.cost > limit
                # Also what was far off before: from here it may come to another place.
                tries = LOST_ITERATIONS if lost else ITERATIONS
                again = self._keep(self.problem.fit(rest, values, fit.beta, tries))
                if lost and again.cost < limit:
                    self._keep(self.problem.fit(rest, again.values, again.beta))
                smaller.append(self.fits[key])
            needless = [s for s in smaller if is_needless(s, fit)]
            if not needless:
                break
            fit = min(needless, key=self.score)
        return fit


def _promising(
    tries: list[tuple[Form, dict[str, float]]], worths: list[tuple[float, float]]
) -> list[tuple[Form, dict[str, float]]]:
    """The best starts of the forms that may gain most, and of the one that is best as it stands."""
    order = range(len(tries))
    by_gain, by_fall = (sorted(order, key=lambda i: -worths[i][k]) for k in (0, 1))
    forms = list(dict.fromkeys(tries[i][0].name for i in by_gain))[:EXCHANGE_FORMS]
    chosen = []
    for name in dict.fromkeys([*forms, *(tries[i][0].name for i in by_fall[:1])]):
        own = [[i for i in ranked if tries[i][0].name == name] for ranked in (by_gain, by_fall)]
        chosen += [*own[0][:EXCHANGE_TRIES], *own[1][:1]]
    return [tries[i] for i in dict.fromkeys(chosen)]


def _sized(
    form: Form, start: dict[str, float], probe: Probe, columns: list[Array]
) -> dict[str, float]:
    """A start of the size that the records ask for, as far as the form's bounds allow it."""
    size = next((p for p in form.params if p.key == form.size), None)
    if size is None:
        return start
    asked = start[size.key] * probe.amplitude(columns[0])
    within = float(np.clip(asked, size.low, size.high))
    return start | {size.key: within} if within != size.null else start


def unlikeliness(fit: Fit) -> float:
    """By how much a fit must be better than one by more usual models, in units of the noise."""
    return UNLIKELY_GAIN * sum(f.unlikely for f in fit.forms)


def _fitted(fit: Fit) -> int:
    """How many effects are not known to the last parameter."""
    return sum(any(p.low < p.high for p in f.params) for f in fit.forms)


def _joins_plausibly(fit: Fit, parent: Fit) -> bool:
    """Whether an effect that joins others acts, and is what its name says."""
    (new,) = fit.effects - parent.effects
    if all(fit.values[p.key] == p.null for f in fit.forms if f.effect == new for p in f.params):
        return False
    unlikely = any(f.unlikely for f in fit.forms if f.effect == new)
    return not (unlikely or _fitted(parent)) or _plausible(fit, new)


def _plausible(fit: Fit, effect: str) -> bool:
    """Whether an effect is what its name says.

    Beside another model that is not quite right, a mode at the bound of its damping is a filter,
    creep that goes back is a curve, and creep that is over at once is a lag. So is a soft slew
    limit at the bound of its rate.
    """
    if effect == "slew_limit" and "slew_knee_V" in fit.values:
        (slew,) = (p for p in fit.params if p.key == "slew_V_per_s")
        return fit.values[slew.key] < SLEW_SHARE * slew.high
    if effect == "resonance":
        dampings = [fit.values[p.key] / p.high for p in fit.params if p.key.startswith("zeta")]
        return max(dampings) < DAMPING_SHARE
    if effect == "creep":
        gains = {creep_tau_s(k): v for k, v in fit.values.items() if k.startswith("creep_")}
        slow = sum(v for tau_s, v in gains.items() if tau_s > CREEP_FAST_S)
        return slow > CREEP_SLOW_SHARE * sum(gains.values()) > 0
    return True


def _spread_gain(old: Fit, new: Fit) -> float:
    """Fall of the cost without the short stretch that falls most: no proof by one glitch."""
    fall = old.residual**2 - new.residual**2
    stretches = np.add.reduceat(fall, np.arange(0, fall.size, STRETCH_ROWS))
    most = int(np.argmax(stretches))
    around = slice(max(most - 1, 0), most + 2)  # a glitch may lie across two
    return float(stretches.sum() - stretches[around].sum())
