"""Cao & Li 2019 (Sensors 19, 352), rules 1-4 and eq. (5) taken literally. Slow, float64.

Nothing is shared with the C core: the curves are nested functions down to f0, the turning points
a plain list A_0, A_1, ..., A_m, and surpassed ones are taken off its end one pair at a time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise

Curve = Callable[[float], float]
Point = tuple[float, float]


def polynomial(c: Sequence[float]) -> Curve:
    """f0 of eq. (9), coefficients in ascending powers, as a plain sum of powers."""
    return lambda x: math.fsum(ck * x**k for k, ck in enumerate(c))


def broken_line(points: Sequence[Point]) -> Curve:
    """f0 as the line through points (x, y); its first and last segments are continued."""
    segments = list(pairwise(points))

    def f0(x: float) -> float:
        (xa, ya), (xb, yb) = next((s for s in segments if x < s[1][0]), segments[-1])
        return ya + (yb - ya) * (x - xa) / (xb - xa)

    return f0


def next_curve(f: Curve, x_before: float, x_turn: float) -> Curve:
    """Eq. (5): f_k of f_(k-1), x_A(k-1) and x_Ak.

    As printed, the intervals of even and odd k have changed places: an ascending curve (k even)
    holds for x_Ak < x < x_A(k-1), a descending one for x_A(k-1) < x < x_Ak.
    """
    ends = f(x_before) + f(x_turn)
    return lambda x: ends - f(x_before + x_turn - x)


class Trajectory:
    """The trajectory of one input, started at A_0 = (0, f0(0)) as if it had turned there.

    `points` holds A_0, A_1, ..., A_m as (x, y). At and below the minimum it is empty, and the
    trajectory is on the descending curve that starts at A_0' = (range, f0(range)).
    """

    def __init__(self, f0: Curve, range_volts: float) -> None:
        self._range = range_volts
        self._descending = next_curve(f0, 0.0, range_volts)
        self._x2, self._x1, self._y1 = -math.inf, 0.0, f0(0.0)
        self.points: list[Point] = [(self._x1, self._y1)]
        self._curves = [f0]

    def step(self, x: float) -> float:
        """The output for the input x."""
        if x == self._x1:
            return self._y1
        if (x - self._x1) * (self._x1 - self._x2) < 0:  # inequality (10)
            self._record()
        while self._has_surpassed(x):  # rule 3
            del self.points[-2:], self._curves[-2:]
        y = self._curves[-1](x) if self._curves else self._descending(x)
        self._x2, self._x1, self._y1 = self._x1, x, y
        return y

    def run(self, inputs: Iterable[float]) -> tuple[list[float], list[int]]:
        """Outputs, and the number of turning points after each input."""
        pairs = [(self.step(float(x)), len(self.points)) for x in inputs]
        return [y for y, _ in pairs], [n for _, n in pairs]

    def _record(self) -> None:
        f, x_before = (
            (self._curves[-1], self.points[-1][0])
            if self.points
            else (self._descending, self._range)
        )
        self._curves.append(next_curve(f, x_before, self._x1))
        self.points.append((self._x1, self._y1))

    def _has_surpassed(self, x: float) -> bool:
        if len(self.points) < 2:
            return False
        ascending = len(self.points) % 2 == 1
        x_before = self.points[-2][0]
        return x >= x_before if ascending else x <= x_before
