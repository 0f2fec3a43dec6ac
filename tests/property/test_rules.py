"""Madelung's rules and what follows from them, on the C core in both builds.

Where the model promises the same numbers, the same bits are asked for.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import chain, pairwise

import numpy as np
from cases import Case, cases, cases_with_codes, inputs
from hypothesis import given
from hypothesis import strategies as st


def monotone_way(a: int, b: int) -> st.SearchStrategy[list[int]]:
    """Any codes on the way from a to b, also with rests, both ends included."""
    way = st.lists(st.integers(min(a, b), max(a, b)), max_size=6)
    return way.map(lambda w: [a, *sorted(w, reverse=b < a), b])


@given(cases_with_codes(overshoot=0.12), st.data())
def test_rate_independence(drawn: tuple[Case, list[int]], data: st.DataObject) -> None:
    """Rests and further samples on monotone pieces change no output at the old samples."""
    case, codes = drawn
    ways = [data.draw(monotone_way(a, b)) for a, b in pairwise(codes)]
    old = np.cumsum([0, *map(len, ways)])
    finer = [*chain.from_iterable(ways), codes[-1]]
    predictor, resampled = case.predictor(), case.predictor()
    y = predictor.run(case.volts(codes))
    assert resampled.run(case.volts(finer))[old].tobytes() == y.tobytes()
    assert resampled.save().tobytes() == predictor.save().tobytes()


@given(cases_with_codes(overshoot=0.12), st.data())
def test_return_point_memory(drawn: tuple[Case, list[int]], data: st.DataObject) -> None:
    """Whatever happens between a turning point and here leaves no trace once back (rule 2)."""
    case, codes = drawn
    turn, here = codes[-2:] if len(codes) > 1 else (0, codes[-1])
    predictor = case.predictor()
    y = predictor.run(case.volts([turn, *codes]))
    before = predictor.save()
    excursion = data.draw(inputs(min(turn, here), max(turn, here)))
    back = predictor.run(case.volts([*excursion, here]))
    assert back[-1:].tobytes() == y[-1:].tobytes()
    assert predictor.save().tobytes() == before.tobytes()


@given(cases_with_codes(overshoot=0.12))
def test_wiping_out(drawn: tuple[Case, list[int]]) -> None:
    """What was surpassed is forgotten: the turning points that are left make the state (rule 3)."""
    case, codes = drawn
    top = 2**case.bits - 1
    u = case.volts([0, top, *codes])
    volts_of = dict(zip(case.x(u).tolist(), u.tolist(), strict=True))
    predictor, replayed = case.predictor(), case.predictor()
    predictor.run(u)
    held = [volts_of[x] for x, _ in case.turning_points(predictor)]
    replayed.run([u[1], *held, u[-1]])
    assert replayed.save().tobytes() == predictor.save().tobytes()


@given(cases(), st.data())
def test_congruency(case: Case, data: st.DataObject) -> None:
    """Loops between the same inputs after different histories differ by an offset only."""
    code = st.integers(0, 2**case.bits - 1)
    a, b = data.draw(code), data.draw(code)
    loop = [a, b, *data.draw(monotone_way(a, b)), *data.draw(monotone_way(b, a))]
    runs = []
    for _ in range(2):
        history = data.draw(inputs(0, 2**case.bits - 1))
        runs.append(case.predictor().run(case.volts([*history, *loop]))[-len(loop) + 2 :])
    shapes = [run.astype(float) - float(run[0]) for run in runs]
    tolerance = 4 * np.finfo(case.precision).eps * np.abs(runs).max()
    assert np.abs(shapes[0] - shapes[1]).max() <= tolerance


@given(cases(), st.data())
def test_central_symmetry_of_loops(case: Case, data: st.DataObject) -> None:
    """A closed loop's falling branch is its rising branch turned by 180 degrees (rule 4)."""
    # Without an offset of the command the mirrored codes are mirrored volts but for one rounding.
    case = replace(case, model=replace(case.model, u_min_V=0.0, u_max_V=case.model.range_V))
    top = 2**case.bits - 1
    history = data.draw(inputs(0, top))
    a, b = sorted([data.draw(st.integers(0, top)), data.draw(st.integers(0, top))])
    rising = data.draw(monotone_way(a, b))
    falling = [a + b - code for code in rising]
    u = case.volts([*history, a, b, a, *rising, *falling])
    y, _, count = case.predictor().run_with_status(u)
    up, down = np.split(y[-2 * len(rising) :].astype(float), 2)
    tolerance = 4 * case.tolerance(case.x(u), y, count).max()
    assert np.abs(up + down - up[0] - down[0]).max() <= tolerance
