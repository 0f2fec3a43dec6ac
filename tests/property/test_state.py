"""The state of the C core: carried on, saved, reset, refused, full. To the bit, in both builds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from cases import PRECISIONS, Case, Reals, cases_with_codes, spiral
from hypothesis import given
from hypothesis import strategies as st

from madelung.core import Precision, Predictor, Status, n_u
from madelung.errors import InputError
from madelung.model import MARGIN_SHARE, Model

REFUSED = -1
NOT_FINITE = st.sampled_from([np.nan, -np.nan, np.inf, -np.inf])
PAPER = Model("madelung", 0.0, 40.0, f0=(0.58517, 0.086444, 0.0011949, -6.1876e-06))
"""Cao & Li 2019, eq. (20)."""


def same_bits(a: Predictor, b: Predictor) -> bool:
    """Whether two predictors are in the same state."""
    return a.save().tobytes() == b.save().tobytes()


@given(cases_with_codes(overshoot=0.3), st.data())
def test_two_half_runs_equal_one_whole_run(
    drawn: tuple[Case, list[int]], data: st.DataObject
) -> None:
    """In the same predictor, and in a new one that resumes the saved state."""
    case, codes = drawn
    u = case.volts(codes)
    cut = data.draw(st.integers(0, len(codes)))
    whole, halves, resumed = (case.predictor() for _ in range(3))
    y, status, count = whole.run_with_status(u)
    first = halves.run(u[:cut])
    resumed.resume(halves.save())
    assert same_bits(resumed, halves)
    for second in (halves, resumed):
        y_2, status_2, count_2 = second.run_with_status(u[cut:])
        assert np.append(first, y_2).tobytes() == y.tobytes()
        assert status_2.tolist() == status[cut:].tolist()
        assert count_2.tolist() == count[cut:].tolist()
        assert same_bits(second, whole)


@given(cases_with_codes(overshoot=0.3), NOT_FINITE)
def test_reset_equals_a_fresh_predictor(drawn: tuple[Case, list[int]], refused: float) -> None:
    """Whatever came before."""
    case, codes = drawn
    u = case.volts(codes)
    used, fresh = case.predictor(), case.predictor()
    used.run([*u, refused])
    used.reset()
    assert same_bits(used, fresh)
    assert used.run(u).tobytes() == fresh.run(u).tobytes()


@given(cases_with_codes(overshoot=0.3), st.data())
def test_refused_samples_leave_the_state(
    drawn: tuple[Case, list[int]], data: st.DataObject
) -> None:
    """NaN and infinity repeat the last output; every other sample is as if they were not there."""
    case, codes = drawn
    u = case.volts(codes)
    at = data.draw(st.lists(st.integers(0, u.size), min_size=1, max_size=6))
    mixed = np.insert(u, at, [data.draw(NOT_FINITE) for _ in at])
    refused = ~np.isfinite(mixed)
    predictor, clean = case.predictor(), case.predictor()
    y, status, _ = predictor.run_with_status(mixed)
    y_clean, status_clean, _ = clean.run_with_status(u)
    assert y[~refused].tobytes() == y_clean.tobytes()
    assert status[~refused].tolist() == status_clean.tolist()
    assert (status[refused] == REFUSED).all()
    last = np.append(case.predictor().run(case.volts([0])), y[:-1])
    assert y[refused].tobytes() == last[refused].tobytes()
    assert same_bits(predictor, clean)


@given(cases_with_codes(overshoot=0.12))
def test_minus_zero_is_zero(drawn: tuple[Case, list[int]]) -> None:
    """At u_min = 0 a command of -0 V is the minimum."""
    case, codes = drawn
    case = replace(case, model=replace(case.model, u_min_V=0.0, u_max_V=case.model.range_V))
    u = case.volts([0, *codes, 0])
    plus, minus = case.predictor(), case.predictor()
    y = plus.run(u)
    assert minus.run(np.where(u == 0, -u, u)).tobytes() == y.tobytes()
    assert same_bits(plus, minus)


@given(cases_with_codes(overshoot=0.5))
def test_inputs_outside_the_range(drawn: tuple[Case, list[int]]) -> None:
    """Extrapolated up to the margin, then clamped to its edge; the status says which."""
    case, codes = drawn
    case = replace(case, model=replace(case.model, u_min_V=0.0, u_max_V=case.model.range_V))
    real = np.dtype(case.precision).type
    u = np.append(case.volts(codes), [np.finfo(real).max, np.finfo(real).min]).astype(real)
    high = real(case.model.range_V)
    margin = real(MARGIN_SHARE * case.model.range_V)
    expected = np.select(
        [(u < -margin) | (u > high + margin), (u < 0) | (u > high)],
        [Status.CLAMPED, Status.EXTRAPOLATED],
        Status.OK,
    )
    free, clipped = case.predictor(), case.predictor()
    y, status, _ = free.run_with_status(u)
    assert status.tolist() == expected.tolist()
    assert clipped.run(np.clip(u, -margin, high + margin)).tobytes() == y.tobytes()
    assert same_bits(free, clipped)


@given(st.integers(-3000, 3000), st.integers(1, 15000), st.sampled_from(PRECISIONS))
def test_both_ends_are_inside_the_range(low: int, width: int, build: Precision) -> None:
    """Whatever the rounding of the ends in float: u_min to u_max is not reported as outside."""
    u_min, u_max = low / 100, (low + width) / 100
    line = ((0.0, 0.0), (u_max - u_min, 1.0))
    for model in (
        Model("madelung", u_min, u_max, f0=(0.0, 1.0)),
        Model("major_curve", u_min, u_max, breakpoints=line),
    ):
        assert not Predictor(model, build).run_with_status([u_min, u_max, u_min])[1].any()


@pytest.mark.parametrize("build", PRECISIONS)
def test_nested_codes_equal_the_literal_recursion(build: Precision) -> None:
    """Inwards through all 8-bit codes, to the deepest memory, and outwards again."""
    inwards = spiral(list(range(256)))
    Case(PAPER, 8, build).assert_equals_literal(inwards)
    Case(PAPER, 8, build).assert_equals_literal(inwards + inwards[::-1])


@pytest.mark.parametrize(("build", "bits"), [*product(PRECISIONS, range(8, 13)), ("float64", 16)])
def test_all_codes_nested_fit_the_memory(build: Precision, bits: int) -> None:
    """The proof in mdl_traj.h: N_u codes never need more than N_u turning points."""
    case = Case(PAPER, bits, build)
    codes = 2**bits
    assert codes <= n_u(build)
    inwards = spiral(list(range(codes)))
    predictor = case.predictor()
    _, status, count = predictor.run_with_status(case.volts(inwards))
    assert not status.any()
    assert count.tolist() == [1, *range(1, codes)]
    # From below, the codes nest with one turning point less: the first fall empties the memory.
    predictor.run(case.volts([codes - 1, 0]))
    _, status, count = predictor.run_with_status(case.volts(spiral(list(range(codes))[::-1])[2:]))
    assert not status.any()
    assert count[-1] == codes - 2
    _, status, count = predictor.run_with_status(case.volts(inwards[::-1]))
    assert not status.any()
    assert count[-1] == 0


@pytest.mark.parametrize("bits", range(8, 13))
def test_float_stays_close_to_double_at_full_depth(bits: int) -> None:
    """The bound of `Case.tolerance` with every code nested."""
    case, reference = Case(PAPER, bits, "float32"), Case(PAPER, bits, "float64")
    u = case.volts(spiral(list(range(2**bits))))
    y, _, count = case.predictor().run_with_status(u)
    y_reference = reference.predictor().run(u)
    assert (np.abs(y - y_reference) <= case.tolerance(case.x(u), y_reference, count)).all()


@pytest.mark.parametrize("build", PRECISIONS)
def test_a_full_memory_goes_on_with_its_innermost_curve(build: Precision) -> None:
    """Off the code grid: said in the status, and over once an outer point is surpassed."""
    capacity = n_u(build)
    nested = np.array(spiral(list(range(capacity + 201))), build) * (40 / (capacity + 201))
    # A_0 ... A_(capacity - 1) are held from input `capacity` on.
    until_full, excess = np.split(nested, [capacity + 1])
    outwards = until_full[:-1][::-1]
    full, clean = Predictor(PAPER, build), Predictor(PAPER, build)
    _, status, count = full.run_with_status(until_full)
    assert not status.any()
    assert count[-1] == capacity
    clean.run(until_full)
    assert same_bits(full, clean)
    y, status, count = full.run_with_status(excess)
    rising = np.diff(excess, prepend=until_full[-1]) > 0
    assert (status[rising] == Status.MEMORY_FULL).all()
    assert not status[~rising].any()
    assert (count == capacity).all()
    assert full.run(excess[::-1]).tobytes() == y[::-1].tobytes()
    resumed = Predictor(PAPER, build)
    resumed.resume(full.save())
    y_clean = clean.run(outwards)
    for predictor in (full, resumed):
        y, status, count = predictor.run_with_status(outwards)
        assert y.tobytes() == y_clean.tobytes()
        assert not status.any()
        assert count.tolist() == list(range(capacity))[::-1]
        assert same_bits(predictor, clean)


def damaged(state: Reals, head: int) -> Iterator[list[float]]:
    """A saved state with one number changed, cut short, or with more behind it."""
    values = state.tolist()
    for i in (0, 1, *range(head, len(values))):
        near = [values[i] + d for d in (-1.0, -0.5, 0.5, 1.0)]
        far = [-(2.0**99), 2.0**99, 65536.0, np.nan, np.inf, -np.inf]
        for value in (*near, *far, *values[head:]):
            yield [*values[:i], value, *values[i + 1 :]]
    yield from (values[:length] for length in (0, head - 1, *range(head, len(values))))
    yield from (values + [0.0] * more for more in (1, 2, 4))


@pytest.mark.parametrize("build", PRECISIONS)
@pytest.mark.parametrize(
    "codes",
    [[], [255, -20], [200, 20, 180, 40, 160, 60, 140, 80], [200, 20, 180, 40, 160, 60, 140]],
    ids=["at rest", "below the minimum", "falling", "rising"],
)
def test_a_damaged_state_is_refused_or_possible(codes: list[int], build: Precision) -> None:
    """Refused without a trace, or it is a state that the model can be in, and goes on from it."""
    case = Case(PAPER, 8, build)
    predictor, other = case.predictor(), case.predictor()
    predictor.run(case.volts(codes))
    other.run(case.volts([100, 30, 70]))
    before = other.save()
    state = predictor.save()
    refused = 0
    for hostile in damaged(state, state.size - case.trajectory(predictor).size):
        try:
            other.resume(hostile)
        except InputError:
            refused += 1
            assert other.save().tobytes() == before.tobytes()
            continue
        assert (other.save() == np.array(hostile, build)).all()
        assert_is_possible(case, other)
        other.resume(before)
    assert refused > 0


def assert_is_possible(case: Case, predictor: Predictor) -> None:
    """Its turning points are nested around the last input and lie between the margins."""
    left = [x for x, _ in case.turning_points(predictor)[::2]]
    right = [x for x, _ in case.turning_points(predictor)[1::2]]
    here = float(case.trajectory(predictor)[2])
    margin = 1.000001 * MARGIN_SHARE * case.model.range_V
    ascending = [*left, here, *right[::-1]]
    assert ascending == sorted(ascending)
    assert len(set(left)) == len(left)
    assert len(set(right)) == len(right)
    assert -margin <= ascending[0] <= 0
    assert ascending[-1] <= case.model.range_V + margin
