"""Models, code sequences and tolerances that the property tests draw."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray
from reference.literal import Trajectory, broken_line, polynomial

from madelung.core import Precision, Predictor
from madelung.model import Model

Reals = NDArray[np.floating[Any]]

BITS = (2, 3, 5, 8, 12, 16)
"""Few codes make coincidences (equal turning points, returns to the minimum) frequent."""

PRECISIONS: tuple[Precision, ...] = ("float32", "float64")


@dataclass(frozen=True)
class Case:
    """A model, its converter and the build under test."""

    model: Model
    bits: int
    precision: Precision

    def predictor(self) -> Predictor:
        """A fresh predictor."""
        return Predictor(self.model, self.precision)

    def volts(self, codes: list[int]) -> Reals:
        """Commands of codes, in the numbers of the build."""
        step = self.model.range_V / (2**self.bits - 1)
        u_volts: Reals = (self.model.u_min_V + np.array(codes) * step).astype(self.precision)
        return u_volts

    def x(self, u_volts: Reals) -> NDArray[np.float64]:
        """u - u_min as the build computes it, without a further error."""
        return (u_volts - np.dtype(self.precision).type(self.model.u_min_V)).astype(float)

    def trajectory(self, predictor: Predictor) -> Reals:
        """The saved trajectory (see mdl_traj_save), which comes last in a saved predictor."""
        before = self.predictor().save().size - 6  # A_0 alone is held: 4 + 2 reals
        return predictor.save()[before:]

    def turning_points(self, predictor: Predictor) -> list[tuple[float, float]]:
        """A_0, A_1, ... as (x, y) that a predictor holds."""
        saved = self.trajectory(predictor).tolist()
        pairs, falling = int(saved[0]), int(saved[1])
        points = list(zip(saved[4::2], saved[5::2], strict=True))
        left, right = points[: pairs + 1 - falling], points[pairs + 1 - falling :]
        chained = list(chain.from_iterable(zip(left, right, strict=False)))
        return chained if falling else [*chained, left[-1]]

    def literal(self) -> Trajectory:
        """The literal recursion with the parameters that the build holds after rounding."""
        return Trajectory(*self._f0())

    def tolerance(
        self, x: NDArray[np.float64], y: Reals, count: NDArray[np.uint32]
    ) -> NDArray[np.float64]:
        """How far the build's outputs may lie from the exact outputs y for inputs x, um.

        With M >= |f0| and >= |x f0'| / degree on all arguments, Y >= |y|, unit roundoff e and
        degree n, one link of the chain y = y_A + (f0(x - x_A) - f0(0)) adds at most: argument
        n e M, Horner 2 n e M, difference 2 e M, sum e Y. A broken line has 1 e M for its argument
        and 6 e M for its own arithmetic. y_A carries the links before it, one per turning
        point; the second-order terms lie within the roundings up.
        """
        e = float(np.finfo(self.precision).eps) / 2
        reach = max(x.max(), self.model.range_V) - min(x.min(), 0.0)
        if self.model.kind == "madelung":
            magnitude = sum(abs(c) * reach**k for k, c in enumerate(self.model.f0))
            operations = 3 * (len(self.model.f0) - 1) + 4
        else:
            x_volts, y_um = np.array(self.model.breakpoints).T
            slope = np.abs(np.diff(y_um) / np.diff(x_volts)).max()
            magnitude = np.abs(y_um).max() + slope * reach
            operations = 10
        link = np.float64(e * (operations * magnitude + 2 * np.abs(y).max()))
        return link * (count + 1)

    def assert_equals_literal(self, codes: list[int]) -> None:
        """Outputs, counts and stored turning points of one run."""
        u = self.volts(codes)
        x = self.x(u)
        predictor, literal = self.predictor(), self.literal()
        y, _, count = predictor.run_with_status(u)
        y_literal, count_literal = map(np.array, literal.run(x))
        assert count.tolist() == count_literal.tolist()
        tolerance = self.tolerance(x, y_literal, count)
        assert (np.abs(y - y_literal) <= tolerance).all()
        points = np.array(self.turning_points(predictor)).reshape(-1, 2)
        points_literal = np.array(literal.points).reshape(-1, 2)
        assert points[:, 0].tolist() == points_literal[:, 0].tolist()
        assert (np.abs(points[:, 1] - points_literal[:, 1]) <= tolerance.max()).all()

    def _f0(self) -> tuple[Callable[[float], float], float]:
        def held(values: object) -> NDArray[np.float64]:
            return np.asarray(values, self.precision).astype(float)

        range_volts = self.model.range_as(np.dtype(self.precision).type)
        if self.model.kind == "madelung":
            return polynomial(held(self.model.f0).tolist()), range_volts
        points = held(self.model.breakpoints)
        points[-1, 0] = range_volts
        return broken_line(points.tolist()), range_volts


def polynomials() -> st.SearchStrategy[Model]:
    """Models of degree 0 to 7; f0 need not ascend, the construction does not ask for it."""
    share = st.integers(-1000, 1000).map(lambda i: i / 100)  # um over the whole range
    return st.builds(
        lambda u_min, range_V, shares: Model(
            "madelung",
            u_min,
            u_min + range_V,
            f0=tuple(a / range_V**k for k, a in enumerate(shares)),
        ),
        st.sampled_from([0.0, -20.0, 12.3]),
        st.sampled_from([0.7, 1.0, 40.0, 150.0]),
        st.lists(share, min_size=1, max_size=8),
    )


@st.composite
def broken_lines(draw: st.DrawFn) -> Model:
    """Models with 2 to 64 breakpoints."""
    u_min = draw(st.sampled_from([0.0, -20.0, 12.3]))
    inner = draw(st.sets(st.integers(1, 254), max_size=62))
    range_V = draw(st.sampled_from([1.0, 40.0]))
    x = [i / 255 * range_V for i in (0, *sorted(inner), 255)]
    y = draw(st.lists(st.integers(-1000, 1000), min_size=len(x), max_size=len(x)))
    points = tuple((a, b / 100) for a, b in zip(x, y, strict=True))
    return Model("major_curve", u_min, u_min + range_V, breakpoints=points)


def spiral(codes: list[int]) -> list[int]:
    """Ascending codes, reordered from the outermost pair to the innermost."""
    return list(chain.from_iterable(zip(codes, reversed(codes), strict=True)))[: len(codes)]


def inputs(low: int, high: int) -> st.SearchStrategy[list[int]]:
    """Codes of [low, high]: random ones, spirals inwards and outwards, one after the other."""
    code = st.integers(low, high)
    inwards = st.sets(code, min_size=1, max_size=40).map(lambda s: spiral(sorted(s)))
    pieces = st.lists(code, min_size=1, max_size=30) | inwards | inwards.map(lambda s: s[::-1])
    return st.lists(pieces, min_size=1, max_size=4).map(lambda p: list(chain.from_iterable(p)))


def cases() -> st.SearchStrategy[Case]:
    """Any model on any converter, in both builds."""
    return st.builds(
        Case, polynomials() | broken_lines(), st.sampled_from(BITS), st.sampled_from(PRECISIONS)
    )


@st.composite
def cases_with_codes(draw: st.DrawFn, overshoot: float = 0.0) -> tuple[Case, list[int]]:
    """A case and codes; with overshoot, codes beyond both ends by this share of the range."""
    case = draw(cases())
    top = 2**case.bits - 1
    beyond = round(overshoot * top)
    return case, draw(inputs(-beyond, top + beyond))
