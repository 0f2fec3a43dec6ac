"""The C core against the literal recursion of eq. (5) and against play operators."""

from __future__ import annotations

import numpy as np
import pytest
from cases import PRECISIONS, Case, cases_with_codes, inputs
from hypothesis import given
from hypothesis import strategies as st
from reference.literal import Trajectory, broken_line, polynomial
from reference.play import Array, major_curve, play

from madelung.core import Precision
from madelung.model import Model

TABLE_1 = (
    np.array([0.0789, 0.2268, 0.1928, 0.2019, 0.1995, 0.2001, 0.2, 0.2, 0.1999, 0.2005]),
    np.arange(10) / 10,
)
"""Cao & Li 2019, Table 1: weights and thresholds."""


def test_the_literal_recursion_on_values_computed_by_hand() -> None:
    """f0 = x^2 on [0, 1] through the turns 1, 0.5, 0.75, beyond, and back to the minimum."""
    literal = Trajectory(polynomial([0.0, 0.0, 1.0]), 1.0)
    y, count = literal.run([0.25, 1.0, 0.5, 0.75, 0.625, 0.5, 0.25, 0.5, 1.0, 0.0, 0.5])
    up = 0.75 + 0.25**2  # from (0.5, 0.75) to x = 0.75
    down = up - 0.125**2  # from there to x = 0.625
    low = 1 - 0.75**2  # the major descending curve at x = 0.25
    assert y == [0.0625, 1.0, 0.75, up, down, 0.75, low, low + 0.0625, 1.0, 0.0, 0.25]
    assert count == [1, 1, 2, 3, 4, 2, 2, 3, 1, 0, 1]
    assert literal.points == [(0.0, 0.0)]


def test_the_literal_broken_line() -> None:
    """Values at, between and beyond the breakpoints."""
    f0 = broken_line([(0.0, 1.0), (1.0, 2.0), (2.0, 5.0)])
    assert [f0(x) for x in (-1.0, 0.0, 0.5, 1.0, 1.5, 2.0, 3.0)] == [0, 1, 1.5, 2, 3.5, 5, 8]


@given(cases_with_codes())
def test_equals_the_literal_recursion(drawn: tuple[Case, list[int]]) -> None:
    """On any codes, for any f0, within the rounding error of the build."""
    case, codes = drawn
    case.assert_equals_literal(codes)


@given(cases_with_codes(overshoot=0.12))
def test_equals_the_literal_recursion_outside_the_range(drawn: tuple[Case, list[int]]) -> None:
    """The major loop is continued on both sides, and inputs may turn there."""
    case, codes = drawn
    case.assert_equals_literal(codes)


def operators() -> st.SearchStrategy[tuple[Array, Array]]:
    """Weights and thresholds of 1 to 63 play operators on [0, 1]; the first threshold is 0."""
    inner = st.sets(st.integers(1, 255), max_size=62).map(lambda s: np.array([0, *sorted(s)]) / 256)
    return inner.flatmap(
        lambda r: st.lists(st.integers(-100, 1000), min_size=len(r), max_size=len(r)).map(
            lambda w: (np.array(w) / 1000, r)
        )
    )


T = np.linspace(0.0, 1.0, 2000)
SIGNALS = {
    "sine": 0.5 - 0.5 * np.cos(2 * np.pi * 3 * T),
    "fading and growing triangle": 0.5 + np.abs(2 * T - 1) * (np.abs((T * 40) % 2 - 1) - 0.5),
    "multisine": 0.5 + sum(np.sin(2 * np.pi * k * T + k * k) for k in (1, 3, 7, 19)) / 8,
    "steps": np.random.default_rng(1).random(2000),
    "walk out of the range": 0.5
    - 0.62 * np.cos(np.random.default_rng(2).normal(0, 0.3, 2000).cumsum()),
    "staircase with rests": np.round(0.5 - 0.5 * np.cos(2 * np.pi * 7 * T**2), 1),
}


def assert_equals_play(weight: Array, threshold: Array, x: Array, build: Precision) -> None:
    """One signal in volts on [0, 1] and a little beyond, in one build."""
    points = tuple(major_curve(weight, threshold, 1.0))
    case = Case(Model("major_curve", 0.0, 1.0, breakpoints=points), 12, build)
    u = x.astype(build)
    y, _, count = case.predictor().run_with_status(u)
    y_play = play(case.x(u), weight, threshold.astype(build).astype(float))
    # Twice the bound: here the breakpoints and weights are rounded on one side only.
    assert (np.abs(y - y_play) <= 2 * case.tolerance(x, y_play, count)).all()


@pytest.mark.parametrize("build", PRECISIONS)
@pytest.mark.parametrize("signal", SIGNALS)
def test_equals_the_ten_operators_of_the_paper(signal: str, build: Precision) -> None:
    """Simulation Example 2: Table 1, several kinds of input."""
    assert_equals_play(*TABLE_1, SIGNALS[signal], build)


@given(operators(), inputs(-10, 110), st.sampled_from(PRECISIONS))
def test_equals_any_play_operators(
    drawn: tuple[Array, Array], codes: list[int], build: Precision
) -> None:
    """Any thresholds, weights of either sign, and any turns, also beyond both ends."""
    assert_equals_play(*drawn, np.array(codes) / 100, build)
