"""Play operators against the trajectory, and the state of the model of Yang et al."""

from __future__ import annotations

import numpy as np
import pytest
from cases import PRECISIONS
from hypothesis import given
from hypothesis import strategies as st
from reference.play import major_curve, play

from madelung.core import Precision, Predictor
from madelung.model import Model, yang_model
from madelung.path import predictor
from madelung.yang2015 import Yang

CODES = st.lists(st.integers(0, 255), min_size=1, max_size=60)
STEPS = st.lists(st.integers(1, 40), min_size=0, max_size=6)
EXACT = [k / 64.0 for k in range(1, 65)]


@st.composite
def operators(draw: st.DrawFn) -> Yang:
    """Thresholds from 0, below 1, and weights; all exact in float."""
    thresholds = np.cumsum([0, *draw(STEPS)]) / 256.0
    some = st.lists(st.sampled_from(EXACT), min_size=thresholds.size, max_size=thresholds.size)
    return Yang(tuple(thresholds.tolist()), tuple(draw(some)))


@given(operators(), CODES, st.sampled_from(PRECISIONS))
def test_one_side_operators_are_the_trajectory(
    yang: Yang, codes: list[int], precision: Precision
) -> None:
    """Cao & Li 2019, eqs. (15) to (17): f0 is the broken line of the operators."""
    x = np.array(codes) / 256.0
    weight, threshold = np.array(yang.weights), np.array(yang.thresholds_V)
    curve = Model("major_curve", 0.0, 1.0, breakpoints=tuple(major_curve(weight, threshold, 1.0)))
    ours = Predictor(yang_model(yang, 0.0, 1.0), precision).run(x)
    np.testing.assert_allclose(ours, play(x, weight, threshold), atol=1e-12)
    size = np.finfo(precision).eps * weight.sum() * (len(codes) + 1)
    np.testing.assert_allclose(ours, Predictor(curve, precision).run(x), atol=16.0 * size)


@given(operators(), CODES, st.sampled_from(PRECISIONS))
def test_two_side_operators_are_odd(yang: Yang, codes: list[int], precision: Precision) -> None:
    model = yang_model(yang.but(two_side=True, a1=0.125, a2=0.5), -1.0, 1.0)
    u = (np.array(codes) - 128.0) / 128.0
    one, other = Predictor(model, precision), Predictor(model, precision)
    np.testing.assert_array_equal(one.run(u), -other.run(-u))


FULL = Yang(
    (0.125, 0.25),
    (0.5, 0.25),
    a2=1.0,
    k=(0.9, -1e-3),
    c=(-0.01, -1e-3),
    m=(0.8,),
    hz_max=400.0,
    center_um=0.4,
    harmonics=3,
)


@given(CODES, CODES, st.sampled_from(PRECISIONS))
def test_two_halves_equal_one_whole(
    first: list[int], second: list[int], precision: Precision
) -> None:
    """The state, with frequency and amplitude found so far, is saved and resumed."""
    model = yang_model(FULL, 0.0, 1.0)
    one, other = (predictor(model, precision, 1e-3, 0.0) for _ in range(2))
    whole = one.run(np.array([*first, *second]) / 256.0)
    half = other.run(np.array(first) / 256.0)
    resumed = predictor(model, precision, 1e-3, 0.0)
    resumed.resume(other.save())
    rest = resumed.run(np.array(second) / 256.0)
    assert np.append(half, rest).tobytes() == whole.tobytes()
    assert resumed.save().tobytes() == one.save().tobytes()


@given(CODES, st.sampled_from([np.nan, np.inf, -np.inf]), st.sampled_from(PRECISIONS))
def test_what_is_not_finite_leaves_no_trace(
    codes: list[int], bad: float, precision: Precision
) -> None:
    made = predictor(yang_model(FULL, 0.0, 1.0), precision, 1e-3, 0.0)
    made.run(np.array(codes) / 256.0)
    before = made.save()
    assert made.run_with_status([bad])[1][0] == -1
    assert made.save().tobytes() == before.tobytes()


@pytest.mark.parametrize("precision", PRECISIONS)
def test_any_input_gives_finite_displacements(precision: Precision) -> None:
    """Random jumps, far outside the range too, at every frequency that can be found."""
    u = np.random.default_rng(6).normal(0.5, 1.0, 20_000)
    made = predictor(yang_model(FULL, 0.0, 1.0), precision, 1e-3, 0.0)
    y, status, _ = made.run_with_status(u)
    assert np.isfinite(y).all() and (status >= 0).all() and np.abs(y).max() < 100.0
