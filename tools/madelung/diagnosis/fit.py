"""Fitting a hypothesis: f0 and the effects' parameters together, in free-run simulation.

The displacement is linear in f0's coefficients, also behind linear blocks, so their regressors
are runs of the same chain with unit coefficients. Every other column is a finite step. Residuals
are whitened by the noise model, so that a sum of squares of N is what noise alone would leave.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.polynomial import Legendre, Polynomial
from numpy.typing import NDArray

from madelung.diagnosis.case import Trace
from madelung.diagnosis.effects.form import Form, Param, Scales
from madelung.diagnosis.effects.sensor import beyond
from madelung.diagnosis.noise import Noise
from madelung.path import Runner, SignalPath

Array = NDArray[np.float64]
FINITE_STEP = 1e-3
ITERATIONS = 12
RESAMPLE_STEPS = 4
END_SHARE = 1e-3
COST_TOLERANCE = 0.05
EXCESS_TOLERANCE = 1e-4
"""A fit ends when the cost falls by less than the first, or by this share of its excess."""
_NO_COLUMNS: Array = np.empty((0, 0))
Columns = Callable[[Form | None], Array]
"""Of a form, or of f0 (None): its columns, (p, N), or none."""


@dataclass(frozen=True)
class Fit:
    """A fitted hypothesis.

    Attributes
    ----------
    forms
        The effects' models.
    values
        Their parameters, in units.
    beta
        (degree + 1,): f0(0), then the coefficients of the basis, um.
    cost
        Sum of squares of whitened residuals plus priors.
    residual
        (N,) whitened, zero where rows are left out.
    jacobian
        (p, N) whitened columns at the solution (beta first), or empty.
    covariance
        (p, p) in search coordinates (log where a parameter is searched so).
    """

    forms: tuple[Form, ...]
    values: dict[str, float]
    beta: Array
    cost: float
    residual: Array
    jacobian: Array = field(default_factory=lambda: np.empty((0, 0)))
    covariance: Array = field(default_factory=lambda: np.empty((0, 0)))

    @property
    def effects(self) -> frozenset[str]:
        """Names of the effects."""
        return frozenset(f.effect for f in self.forms)

    @property
    def params(self) -> list[Param]:
        """Parameters of all forms, in order."""
        return [p for f in self.forms for p in f.params]

    def columns(self, form: Form | None) -> Array:
        """Of the jacobian, a form's (None: f0's), (p, N); none where it has no part in the fit."""
        row = self.beta.size
        if form is None:
            return self.jacobian[:row]
        for own in self.forms:
            if own is form:
                return self.jacobian[row : row + len(own.params)]
            row += len(own.params)
        return self.jacobian[:0]


class Problem:
    """The records to be explained, the noise, and how a hypothesis is simulated and fitted.

    Parameters
    ----------
    flashed
        The path whose blocks act beside f0 in every hypothesis, but for those that an effect of
        the hypothesis sets. Default: none.

    Attributes
    ----------
    used
        By record, the rows that a fit sees, (n,).
    slices
        By record, its place among the residuals, which hold every row.
    rows
        How many rows are used.
    """

    def __init__(
        self,
        traces: Sequence[Trace],
        noise: Noise,
        scales: Scales,
        degree: int,
        flashed: SignalPath | None = None,
    ) -> None:
        self.flashed = flashed or SignalPath(scales.u_min_V, scales.range_V, ())
        self.traces = tuple(traces)
        self.noise = noise
        self.scales = scales
        self.degree = degree
        self._local = threading.local()
        self.used = [_fitted_rows(t) for t in self.traces]
        ends = np.cumsum([t.u_V.size for t in self.traces])
        self.slices = [
            slice(int(e) - t.u_V.size, int(e)) for e, t in zip(ends, self.traces, strict=True)
        ]
        self.rows = int(sum(u.sum() for u in self.used))
        self.basis = _basis(degree, scales.range_V)

    def with_traces(self, traces: Sequence[Trace]) -> Problem:
        """The same problem on other records."""
        return Problem(traces, self.noise, self.scales, self.degree, self.flashed)

    @property
    def runner(self) -> Runner:
        """Of this thread."""
        if not hasattr(self._local, "runner"):
            self._local.runner = Runner(self.scales.u_min_V, self.scales.range_V)
        runner: Runner = self._local.runner
        return runner

    def path(self, forms: Iterable[Form], values: dict[str, float], beta: Array) -> SignalPath:
        """The signal path of a hypothesis."""
        path = self.flashed.but(f0=self.f0(beta))
        for form in forms:
            if form.path is not None:
                path = form.path(path, values)
        return path

    def f0(self, beta: Array) -> tuple[float, ...]:
        """Coefficients of f0 in ascending powers of x, um / V^k."""
        c = beta[1:] @ self.basis
        c[0] += beta[0]
        return tuple(float(v) for v in c)

    def displacement(
        self, forms: Sequence[Form], values: dict[str, float], path: SignalPath
    ) -> list[Array]:
        """Behind the signal path, by record, um; sensor forms do not act, but for resampling."""
        past = [f for f in forms if f.history is not None]
        places = [f.resample for f in forms if f.resample is not None]
        out = []
        earlier = path.but(gain=1.0, offset_um=0.0)  # the sensor's calibration changed afterwards
        for t in self.traces:
            history = _history(past, t, values)
            if t.role == "identify":
                out.append(self.runner.run(earlier, t.u_V, t.step_s, history))
            elif places:
                out.append(self._resampled(path, t, history, places[0](t, values)))
            else:
                out.append(self.runner.run(path, t.u_V, t.step_s, history))
        return out

    def _resampled(self, path: SignalPath, trace: Trace, history: Array, places: Array) -> Array:
        """The displacement at fractional samples, from a run in finer steps."""
        n = trace.u_V.size
        fine = np.arange((n - 1) * RESAMPLE_STEPS + 1) / RESAMPLE_STEPS
        u = np.interp(fine, np.arange(n), trace.u_V)
        # The blocks' own steps stay about as they are: finer ones would pass for an effect.
        substeps = max(1, round(path.substeps(trace.step_s) / RESAMPLE_STEPS))
        kept = self._local.__dict__.setdefault("fine", {})
        key = (path, history.tobytes())  # the places change alone, from start to start
        record = (trace.role, trace.name)
        if kept.get(record, (None,))[0] != key:
            y = self.runner.run(path, u, trace.step_s / RESAMPLE_STEPS, history, substeps)
            kept[record] = (key, y)
        y = kept[record][1]
        seen = np.interp(places, fine, y) + beyond(places, n, (y[-1] - y[-2]) * RESAMPLE_STEPS)
        return np.asarray(seen, np.float64)

    def measured(
        self, forms: Sequence[Form], values: dict[str, float], displaced: list[Array]
    ) -> list[Array]:
        """What the sensor shows of a displacement, by record, um."""
        out = []
        for trace, y in zip(self.traces, displaced, strict=True):
            for form in forms:
                if form.measure is not None:
                    y = form.measure(y, trace, values)
            out.append(y)
        return out

    def simulate(self, fit: Fit) -> list[Array]:
        """The displacement that a hypothesis predicts, by record, um."""
        return self._seen(fit.forms, fit.values, fit.beta)

    def _seen(self, forms: Sequence[Form], values: dict[str, float], beta: Array) -> list[Array]:
        path = self.path(forms, values, beta)
        return self.measured(forms, values, self.displacement(forms, values, path))

    def whiten(self, values: Sequence[Array]) -> Array:
        """Whitened, with zeros where rows are left out, (N,)."""
        parts = [
            self.noise.whiten(t.filled(v), t.step_s) * use
            for v, t, use in zip(values, self.traces, self.used, strict=True)
        ]
        return np.concatenate(parts)

    def residual(self, y: Sequence[Array]) -> Array:
        """Whitened difference of the measured and a simulated displacement."""
        return self.whiten([t.y_um - v for t, v in zip(self.traces, y, strict=True)])

    def excess(self, residual: Array) -> Array:
        """By record: sum of squares less what noise leaves."""
        return np.array(
            [
                float(residual[s] @ residual[s]) - float(use.sum())
                for s, use in zip(self.slices, self.used, strict=True)
            ]
        )

    def energy_um2(self, fit: Fit) -> float:
        """Sum of squares of what a hypothesis leaves on the rows that are used, um^2."""
        errors = [t.y_um - y for t, y in zip(self.traces, self.simulate(fit), strict=True)]
        return float(sum(e[u] @ e[u] for e, u in zip(errors, self.used, strict=True)))

    def excess_per_row(self, residual: Array) -> Array:
        """By record: `excess` over the number of rows that are used."""
        rows = np.array([max(int(use.sum()), 1) for use in self.used], np.float64)
        return np.asarray(self.excess(residual) / rows)

    def at(self, beta: Array) -> Fit:
        """f0 alone, as given, without a fit."""
        whole = np.zeros(self.degree + 1)
        whole[: beta.size] = beta
        return self._evaluate((), {}, whole)

    def beta_of(self, f0: Sequence[float]) -> Array:
        """The basis's coefficients of a polynomial, (degree + 1,).

        Raises
        ------
        ValueError
            Its degree is above the problem's.
        """
        c = np.zeros(self.degree + 1)
        if len(f0) > c.size:
            raise ValueError(f"f0 has degree {len(f0) - 1}, above {self.degree}")
        c[: len(f0)] = f0
        tail = np.linalg.solve(self.basis[:, 1:].T, c[1:])
        return np.concatenate([[c[0]], tail])

    # -- columns ------------------------------------------------------------------------------

    def _columns_f0(
        self, forms: Sequence[Form], values: dict[str, float], beta: Array, y: list[Array]
    ) -> list[Array]:
        """Whitened columns of f0's coefficients."""
        path = self.path(forms, values, beta)
        columns = []
        if path.dead_band_um > 0:  # not linear: finite steps
            step = FINITE_STEP * self.scales.stroke_um
            for k in range(beta.size):
                moved = beta.copy()
                moved[k] += step
                columns.append(self.change(forms, values, moved, y) / step)
            return columns
        zero = self.measured(forms, values, [np.zeros_like(t.u_V) for t in self.traces])
        bare = path.but(damping_um=0.0, bouc_um=0.0, shape=None, offset_um=0.0)
        for unit in np.eye(self.degree + 1):
            run = self.displacement(forms, values, bare.but(f0=self.f0(unit)))
            seen = self.measured(forms, values, run)
            columns.append(self.whiten([a - b for a, b in zip(seen, zero, strict=True)]))
        return columns

    def change(
        self, forms: Sequence[Form], values: dict[str, float], beta: Array, y: list[Array]
    ) -> Array:
        """Whitened change of the simulated displacement from y."""
        moved = self._seen(forms, values, beta)
        return self.whiten([a - b for a, b in zip(moved, y, strict=True)])

    def columns_of(
        self,
        form: Form,
        forms: Sequence[Form],
        values: dict[str, float],
        beta: Array,
        displaced: list[Array],
        y: list[Array],
    ) -> list[Array]:
        """Whitened columns of a form's parameters, in search coordinates."""
        columns = []
        for p in form.params:
            step, moved = _stepped(p, values)
            if form.measure is not None:
                seen = self.measured(forms, moved, displaced)
                change = self.whiten([a - b for a, b in zip(seen, y, strict=True)])
            else:
                change = self.change(forms, moved, beta, y)
            columns.append(change / step)
        return columns

    # -- fits ---------------------------------------------------------------------------------

    def fit(
        self,
        forms: Sequence[Form],
        values: dict[str, float],
        beta: Array,
        iterations: int = ITERATIONS,
        near: Fit | None = None,
        rough: bool = False,
    ) -> Fit:
        """Levenberg-Marquardt from a start, within the parameters' bounds.

        The columns are computed at the start, carried along by Broyden's secant update, and
        computed again where a step fails or before the search ends; f0's, which change little,
        once.

        Parameters
        ----------
        near
            A fit with its jacobian: its columns serve at the start for what both have in common.
        rough
            They serve for f0 to the end.
        """
        forms = tuple(forms)
        fit = self._evaluate(forms, _clipped(forms, values), beta)
        if not np.isfinite(fit.cost):
            return fit
        damping = 1e-4
        jacobian, covariance = fit.jacobian, fit.covariance
        if near is not None:
            jacobian = self._jacobian(fit, near.columns)
        fresh, secant, whole = False, True, rough
        made = 0
        while made < iterations:
            if not fresh and (jacobian.size == 0 or not secant):
                f0 = jacobian[: beta.size] if whole else _NO_COLUMNS  # once, then carried along
                jacobian = self._jacobian(fit, partial(_f0_alone, f0))
                fresh = whole = True
            better, damping, covariance = self._step(fit, jacobian, damping, 8 if fresh else 2)
            tolerance = max(COST_TOLERANCE, EXCESS_TOLERANCE * (fit.cost - self.rows))
            done = better is None or fit.cost - better.cost < tolerance
            made += int(fresh or not done)
            if better is not None:
                if not done:
                    jacobian = _secant(jacobian, fit, better)
                fit = better
            if done and fresh:
                break
            secant, fresh = not done, False
        return replace(fit, jacobian=jacobian, covariance=covariance)

    def _evaluate(self, forms: tuple[Form, ...], values: dict[str, float], beta: Array) -> Fit:
        residual = self.residual(self._seen(forms, values, beta))
        prior = _prior_rows(forms, values)[0]
        cost = float(residual @ residual + prior @ prior)
        return Fit(forms, values, beta, cost if np.isfinite(cost) else np.inf, residual)

    def _jacobian(self, fit: Fit, have: Columns = lambda _: _NO_COLUMNS) -> Array:
        """Columns at a fit; ``have`` gives those that will do as they are."""
        path = self.path(fit.forms, fit.values, fit.beta)
        displaced = self.displacement(fit.forms, fit.values, path)
        y = self.measured(fit.forms, fit.values, displaced)
        jacobian = np.empty((fit.beta.size + len(fit.params), fit.residual.size))
        row = 0
        for form in (None, *fit.forms):
            own: Sequence[Array] | Array = have(form)
            if len(own) == 0:
                own = (
                    self._columns_f0(fit.forms, fit.values, fit.beta, y)
                    if form is None
                    else self.columns_of(form, fit.forms, fit.values, fit.beta, displaced, y)
                )
            jacobian[row : row + len(own)] = own
            row += len(own)
        return jacobian

    def _step(
        self, fit: Fit, jacobian: Array, damping: float, tries: int
    ) -> tuple[Fit | None, float, Array]:
        prior, slopes = _prior_rows(fit.forms, fit.values)
        k = fit.beta.size
        normal = jacobian @ jacobian.T
        normal[k:, k:] += slopes.T @ slopes
        gradient = jacobian @ fit.residual
        gradient[k:] -= slopes.T @ prior
        size = np.sqrt(np.maximum(np.diag(normal), 1e-30))
        scaled = normal / np.outer(size, size)
        covariance = np.linalg.pinv(scaled, rcond=1e-13, hermitian=True) / np.outer(size, size)
        for _ in range(tries):
            lifted = scaled + damping * np.eye(size.size)
            move = np.linalg.solve(lifted, gradient / size) / size
            values = _moved(fit.forms, fit.values, move[k:])
            trial = self._evaluate(fit.forms, values, fit.beta + move[:k])
            if trial.cost < fit.cost:
                return trial, max(damping / 10, 1e-9), covariance
            damping = max(damping * 10, 1e-7)
        return None, damping, covariance


class Probe:
    """What further columns would explain of a fitted hypothesis.

    What depends on the hypothesis alone is computed once, for all the columns that are tried.

    Parameters
    ----------
    problem, base
        The hypothesis; its jacobian is needed.
    """

    def __init__(self, problem: Problem, base: Fit) -> None:
        self.problem = problem
        self.base = base
        path = problem.path(base.forms, base.values, base.beta)
        self._displaced = problem.displacement(base.forms, base.values, path)
        self._y = problem.measured(base.forms, base.values, self._displaced)
        norm = np.sqrt(np.maximum(np.einsum("ij,ij->i", base.jacobian, base.jacobian), 1e-300))
        self._unit = base.jacobian / norm[:, None]
        self._inverse = np.linalg.pinv(self._unit @ self._unit.T, rcond=1e-12, hermitian=True)

    def signature(self, form: Form, start: dict[str, float]) -> list[Array]:
        """Whitened columns that a form would add, from one start."""
        problem, base = self.problem, self.base
        forms = (*base.forms, form)
        values = base.values | start
        if form.linear:
            return problem.columns_of(form, forms, values, base.beta, self._displaced, self._y)
        if form.measure is not None:
            seen = problem.measured(forms, values, self._displaced)
            return [problem.whiten([a - b for a, b in zip(seen, self._y, strict=True)])]
        return self.difference(forms, values)

    def difference(self, forms: Sequence[Form], values: dict[str, float]) -> list[Array]:
        """Whitened change, as one column, when these forms take the place of the fit's."""
        return [self.problem.change(forms, values, self.base.beta, self._y)]

    def gain(self, columns: list[Array]) -> float:
        """How much the cost would fall along columns, what is fitted already refitted with them."""
        return self._explained(columns, self.base.residual)

    def amplitude(self, column: Array) -> float:
        """By how much a column is to be scaled, so that the cost falls most along it."""
        score, left = self._along(column)
        return score / left if left > 0.0 else 0.0

    def fall(self, columns: list[Array]) -> float:
        """How much the cost falls when the sum of columns is added as it is."""
        score, left = self._along(np.sum(columns, axis=0))
        return 2 * score - left

    def _along(self, column: Array) -> tuple[float, float]:
        """Of a column behind the refit: its product with the residual, its squared length."""
        cross = self._unit @ column
        residual = self.base.residual
        score = column @ residual - cross @ self._inverse @ (self._unit @ residual)
        return float(score), float(column @ column - cross @ self._inverse @ cross)

    def energy(self, column: Array) -> float:
        """Squared length of a column behind the refit of what is fitted already."""
        return self._explained([column], column)

    def _explained(self, columns: list[Array], residual: Array) -> float:
        c = np.array(columns)
        size = np.sqrt(np.einsum("ij,ij->i", c, c))
        if not np.all(np.isfinite(size)):
            return 0.0
        c = c[size > 1e-12] / size[size > 1e-12, None]
        if c.size == 0:
            return 0.0
        cross = self._unit @ c.T
        left = c @ c.T - cross.T @ self._inverse @ cross
        score = c @ residual - cross.T @ self._inverse @ (self._unit @ residual)
        keep = np.diag(left) > 1e-7
        if not keep.any():
            return 0.0
        solved = np.linalg.lstsq(left[np.ix_(keep, keep)], score[keep], rcond=1e-10)[0]
        return float(score[keep] @ solved)


def _fitted_rows(trace: Trace) -> NDArray[np.bool_]:
    """The rows that are used; of a train record not its very end.

    A sensor's clock that is fast shows there what follows the record, and no model knows.
    """
    if trace.role != "train":
        return trace.use
    rows: NDArray[np.bool_] = trace.use.copy()
    rows[rows.size - int(np.ceil(END_SHARE * rows.size)) :] = False
    return rows


def _history(past: list[Form], trace: Trace, values: dict[str, float]) -> Array:
    if trace.role == "identify" or not past:
        return np.empty(0)
    history = past[0].history
    assert history is not None
    return history(trace, values)


def _basis(degree: int, range_V: float) -> Array:
    """Rows: shifted Legendre polynomials of x / range that vanish at x = 0, in powers of x."""
    rows = np.zeros((degree, degree + 1))
    for k in range(1, degree + 1):
        c = Legendre.basis(k, domain=[0.0, range_V]).convert(kind=Polynomial).coef
        rows[k - 1, : c.size] = c
        rows[k - 1, 0] = 0.0
    return rows


def _stepped(p: Param, values: dict[str, float]) -> tuple[float, dict[str, float]]:
    """A finite step in search coordinates, inside the bounds, and the values there."""
    step = FINITE_STEP if p.log else FINITE_STEP * p.scale
    value = values[p.key]
    moved = value * float(np.exp(step)) if p.log else value + step
    if moved > p.high:
        step = -step
        moved = value * float(np.exp(step)) if p.log else value + step
    return step, values | {p.key: moved}


def _moved(forms: Sequence[Form], values: dict[str, float], move: Array) -> dict[str, float]:
    params = [p for f in forms for p in f.params]
    out = dict(values)
    for p, m in zip(params, move, strict=True):
        if p.log:
            v = values[p.key] * float(np.exp(np.clip(m, -1.5, 1.5)))
        else:
            v = values[p.key] + float(m)
        out[p.key] = float(min(max(v, p.low), p.high))
    return out


def _f0_alone(f0: Array, form: Form | None) -> Array:
    """`Columns` of f0 that are known."""
    return f0 if form is None else _NO_COLUMNS


def _secant(jacobian: Array, old: Fit, new: Fit) -> Array:
    """Broyden's update, in place: the columns (p, N), corrected along the step that was made."""
    moves = [
        float(np.log(new.values[p.key] / old.values[p.key]))
        if p.log
        else new.values[p.key] - old.values[p.key]
        for p in new.params
    ]
    move = np.concatenate([new.beta - old.beta, moves])
    size2 = np.einsum("ij,ij->i", jacobian, jacobian)  # steps count by what they change
    weighted = move * size2
    length = float(move @ weighted)
    if length <= 0:
        return jacobian
    missed = old.residual - new.residual - move @ jacobian
    for row, share in zip(jacobian, weighted / length, strict=True):
        row += share * missed
    return jacobian


def _clipped(forms: Sequence[Form], values: dict[str, float]) -> dict[str, float]:
    """Within their bounds; those of other forms are dropped."""
    own = {p.key: values[p.key] for f in forms for p in f.params}
    return _moved(forms, own, np.zeros(sum(len(f.params) for f in forms)))


def _prior_rows(forms: Sequence[Form], values: dict[str, float]) -> tuple[Array, Array]:
    """Values and slopes (rows, params) of the priors."""
    params = [p for f in forms for p in f.params]
    index = {p.key: i for i, p in enumerate(params)}
    null = {p.key: p.null for p in params}
    rows = [row for f in forms for row in f.priors]
    slopes = np.zeros((len(rows), len(params)))
    for r, row in enumerate(rows):
        for key, weight in row.items():
            slopes[r, index[key]] = weight
    offset = np.array([values[p.key] - null[p.key] for p in params])
    return slopes @ offset, slopes
