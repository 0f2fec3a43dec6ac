"""Where the gap lies: planted gaps are found, and every share can be computed by a reader."""

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from madelung.diagnosis.case import Trace
from madelung.diagnosis.noise import Noise
from madelung.diagnosis.regions import (
    BRANCHES,
    Region,
    branches,
    nesting,
    part,
    sentence,
    since_turn_s,
)
from madelung.diagnosis.where import locate
from madelung.records import Record

Array = NDArray[np.float64]
SCHEMA = Path("../shared/contracts/diagnosis.schema.json")
ENDS = (0.0, 40.0)
NOISE = Noise(0.01, 0.0, 0.01, 10_000, known=True)
GAP = 0.2


def trace_of(name: str, u: Array, step_s: float = 1e-3, start_s: float = 0.0) -> Trace:
    t = start_s + np.arange(u.size) * step_s
    y = 0.1 * u
    use = np.ones(u.size, np.bool_)
    return Trace(name, "train", step_s, u, y, use, np.arange(u.size), Record(name, t, u, y))


def triangle(seconds: float = 20.0, hz: float = 0.5, step_s: float = 1e-3) -> Array:
    phase = np.arange(round(seconds / step_s)) * step_s * hz % 1.0
    return 40.0 * (1.0 - np.abs(1.0 - 2.0 * phase))


def decaying(seconds: float = 20.0) -> Array:
    t = np.arange(round(seconds * 1000)) * 1e-3
    return 20.0 - 20.0 * np.cos(2 * np.pi * 0.7 * t) * np.exp(-t / 8.0)


def sweep(seconds: float = 10.0) -> Array:
    t = np.arange(round(seconds * 1000)) * 1e-3
    return 20.0 - 15.0 * np.cos(2 * np.pi * (0.2 * t + 1.5 * t * t))


def campaign() -> list[Trace]:
    return [
        trace_of("triangle", triangle()),
        trace_of("decaying", decaying(), start_s=100.0),
        trace_of("sweep", sweep()),
    ]


def white(traces: list[Trace], seed: int = 1) -> list[Array]:
    rng = np.random.default_rng(seed)
    return [NOISE.rms_um * rng.standard_normal(t.u_V.size) for t in traces]


def planted(where: Callable[[Trace], NDArray[np.bool_]]) -> tuple[list[Trace], list[Array]]:
    """A gap of random sign, so that it has no frequency, where a condition holds."""
    traces = campaign()
    rng = np.random.default_rng(9)
    gaps = [
        noise + GAP * rng.choice([-1.0, 1.0], noise.size) * where(trace)
        for trace, noise in zip(traces, white(traces), strict=True)
    ]
    return traces, gaps


def found_on(axis: str, traces: list[Trace], gaps: list[Array]) -> Region:
    regions = {r.axis: r for r in locate(traces, gaps, NOISE, ENDS)}
    assert axis in regions, sorted(regions)
    return regions[axis]


# -- what a reader computes, row by row -------------------------------------------------------


def read_nesting(u: Array, low: float) -> tuple[list[int], list[list[float]]]:
    """Madelung's rules with a stack: depth, and the turning points, after each row."""
    stack = [low]
    rising, last = True, u[0]
    depths, stacks = [], []
    for now in u:
        if now > last:
            if not rising or not stack:
                stack.append(last)
            rising = True
            while len(stack) >= 2 and now >= stack[-2]:
                del stack[-2:]
        elif now < last:
            if rising:
                stack.append(last)
            rising = False
            while len(stack) >= 2 and now <= stack[-2]:
                del stack[-2:]
            if now <= low:
                stack = []
        last = now
        depths.append(len(stack))
        stacks.append(list(stack))
    return depths, stacks


def read_since_turn(u: Array, step_s: float) -> list[float]:
    turn, sense, out = 0, 1.0, []
    for k in range(u.size):
        move = 0.0 if k == 0 else float(np.sign(u[k] - u[k - 1]))
        if move not in (0.0, sense):
            turn, sense = k - 1, move
        out.append((k - turn) * step_s)
    return out


def read_shares(region: Region, traces: list[Trace], gaps: list[Array]) -> tuple[float, float]:
    """Energy share and enrichment of a region, from the module's words alone."""
    used = np.concatenate([g[t.use] for t, g in zip(traces, gaps, strict=True)])
    mean = used.mean()
    energy = held = rows = inside = 0.0
    for trace, gap in zip(traces, gaps, strict=True):
        g = np.where(trace.use, gap - mean, 0.0)
        energy += (g**2).sum()
        if region.axis == "frequency":
            f = np.abs(np.fft.fftfreq(g.size, trace.step_s))
            band = (f >= float(region.low)) & (f <= float(region.high or 0.0))
            held += (np.abs(np.fft.fft(g))[band] ** 2).sum() / g.size
            inside += band.mean() * trace.use.sum()
        else:
            mask = read_mask(region, trace) & trace.use
            held += (g[mask] ** 2).sum()
            inside += mask.sum()
        rows += trace.use.sum()
    return held / energy, held / energy / (inside / rows)


def read_mask(region: Region, trace: Trace) -> NDArray[np.bool_]:
    u = trace.u_V
    if region.axis == "record":
        return np.full(u.size, trace.name == region.low)
    if region.axis == "branch":
        return np.array([b == region.low for b in read_branches(u)])
    values = {
        "time": lambda: trace.record.t_s,
        "input": lambda: u,
        "rate": lambda: np.abs(np.gradient(u, trace.step_s)),
        "nesting": lambda: np.array(read_nesting(u, ENDS[0])[0]),
        "since_turn": lambda: np.array(read_since_turn(u, trace.step_s)),
    }[region.axis]()
    mask = (values >= float(region.low)) & (values <= float(region.high or 0.0))
    return mask & (trace.name == region.record) if region.axis == "time" else mask


def read_branches(u: Array) -> list[str]:
    near = 0.02 * (ENDS[1] - ENDS[0])
    low, high = ENDS[0] + near, ENDS[1] - near
    depths, stacks = read_nesting(np.clip(u, low, high), low)
    out, sense = [], "rising"
    for k in range(u.size):
        if k and u[k] != u[k - 1]:
            sense = "rising" if u[k] > u[k - 1] else "falling"
        major = depths[k] < 2 or (depths[k] == 2 and stacks[k][1] >= high)
        out.append(f"{'major' if major else 'minor'}_{sense}")
    return out


# -- axes -------------------------------------------------------------------------------------


@pytest.mark.parametrize("u", [triangle(), decaying(), sweep(), decaying()[700:]])
def test_axes_are_what_a_reader_computes(u: Array) -> None:
    np.testing.assert_array_equal(nesting(u, ENDS), read_nesting(u, ENDS[0])[0])
    assert [BRANCHES[i] for i in branches(u, ENDS)] == read_branches(u)
    np.testing.assert_allclose(since_turn_s(u, 1e-3), read_since_turn(u, 1e-3), atol=1e-9)


def test_branches_of_a_walk_by_hand() -> None:
    u = np.array([0.0, 10, 20, 15, 12, 18, 25, 40, 40, 30, 20, 26, 10, 0, 0, 5])
    names = [BRANCHES[i] for i in branches(u, ENDS)]
    assert names[:3] == ["major_rising"] * 3
    assert names[3:5] == ["minor_falling"] * 2
    assert names[5] == "minor_rising"
    assert names[6:9] == ["major_rising"] * 3  # wiped out above 20; rest keeps the sense
    assert names[9:11] == ["major_falling"] * 2
    assert names[11] == "minor_rising"
    assert names[12:15] == ["major_falling"] * 3
    assert names[15] == "major_rising"


def test_a_rest_is_no_turn() -> None:
    u = np.array([0.0, 1, 2, 2, 2, 3, 2, 2, 1])
    np.testing.assert_allclose(since_turn_s(u, 0.5) / 0.5, [0, 1, 2, 3, 4, 5, 1, 2, 3])


# -- planted gaps -----------------------------------------------------------------------------


def test_high_input() -> None:
    traces, gaps = planted(lambda t: t.u_V > 35.0)
    first = locate(traces, gaps, NOISE, ENDS)[0]
    assert (first.axis, first.side, first.low) == ("input", "above", 35.0)
    assert first.energy_share > 0.95
    assert "above 35 V" in sentence(first)


def test_high_rate() -> None:
    traces, gaps = planted(lambda t: np.abs(np.gradient(t.u_V, t.step_s)) > 1000.0)
    region = found_on("rate", traces, gaps)
    assert region.side == "above" and 900.0 < float(region.low) < 1100.0
    assert region.energy_share > 0.9 and region.enrichment > 3.0


@pytest.mark.parametrize("name", BRANCHES)
def test_branch(name: str) -> None:
    traces, gaps = planted(lambda t: branches(t.u_V, ENDS) == BRANCHES.index(name))
    region = found_on("branch", traces, gaps)
    assert (region.low, region.high) == (name, None)
    assert region.energy_share > 0.95


def test_deep_nesting() -> None:
    traces, gaps = planted(lambda t: nesting(t.u_V, ENDS) >= 12)
    first = locate(traces, gaps, NOISE, ENDS)[0]
    region = found_on("nesting", traces, gaps)
    assert (region.side, region.low) == ("above", 12.0)
    assert region.energy_share > 0.95
    assert first.axis in ("nesting", "time")


def test_soon_after_a_turn() -> None:
    traces, gaps = planted(lambda t: since_turn_s(t.u_V, t.step_s) < 0.05)
    region = found_on("since_turn", traces, gaps)
    assert region.side == "below" and 0.045 < float(region.high or 0.0) < 0.055
    assert "ms after a turn" in sentence(region)


def test_late_in_a_record_by_its_own_clock() -> None:
    traces, gaps = planted(lambda t: (t.t_s > 15.0) & (t.name == "decaying"))
    region = found_on("time", traces, gaps)
    assert (region.record, region.side, region.low) == ("decaying", "above", 115.0)
    assert region.to_json()["record"] == "decaying"


def test_one_record() -> None:
    traces, gaps = planted(lambda t: np.full(t.u_V.size, t.name == "sweep"))
    assert found_on("record", traces, gaps).low == "sweep"


def test_a_line_is_a_narrow_band_and_comes_first() -> None:
    traces = campaign()
    gaps = [
        g + 0.05 * np.sin(2 * np.pi * 50.0 * t.t_s + 1.0)
        for t, g in zip(traces, white(traces), strict=True)
    ]
    first = locate(traces, gaps, NOISE, ENDS)[0]
    assert first.axis == "frequency" and first.side == "between"
    assert 48.0 < float(first.low) < 50.0 < float(first.high or 0.0) < 52.0
    assert first.energy_share == pytest.approx(0.00125 / (0.00125 + NOISE.rms_um**2), rel=0.02)


def test_a_line_below_the_noise_is_found() -> None:
    traces = campaign()
    gaps = [
        g + 0.002 * np.sin(2 * np.pi * 50.0 * t.t_s)
        for t, g in zip(traces, white(traces), strict=True)
    ]
    assert [r.axis for r in locate(traces, gaps, NOISE, ENDS)] == ["frequency"]


def test_low_frequency_is_no_news_where_the_stage_moves() -> None:
    traces = [trace_of("triangle", triangle())]
    gaps = [0.02 * traces[0].u_V + white(traces)[0]]
    assert "frequency" not in [r.axis for r in locate(traces, gaps, NOISE, ENDS)]


def test_drift_is_low_frequency_and_late() -> None:
    traces = [trace_of("triangle", triangle())]
    gaps = [0.2 * np.exp(traces[0].t_s - 20.0) + white(traces)[0]]
    late, slow = found_on("time", traces, gaps), found_on("frequency", traces, gaps)
    assert late.side == "above" and late.high == pytest.approx(20.0, abs=0.1)
    assert late.energy_share > 0.7 and late.enrichment > 5.0
    assert slow.side == "below" and float(slow.high or 0.0) < 2.0


# -- shares -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "where",
    [
        lambda t: t.u_V > 33.0,
        lambda t: np.abs(np.gradient(t.u_V, t.step_s)) > 700.0,
        lambda t: (since_turn_s(t.u_V, t.step_s) < 0.04) & (t.u_V < 20.0),
        lambda t: (nesting(t.u_V, ENDS) >= 9) & (t.name == "decaying"),
    ],
)
def test_a_reader_gets_the_same_shares(where: Callable[[Trace], NDArray[np.bool_]]) -> None:
    traces, gaps = planted(where)
    rng = np.random.default_rng(3)
    traces = [dataclasses.replace(t, use=rng.random(t.u_V.size) > 0.05) for t in traces]
    gaps = [np.where(t.use, g + 0.3, 1e3) for t, g in zip(traces, gaps, strict=True)]
    regions = locate(traces, gaps, NOISE, ENDS)
    assert len(regions) >= 3
    for region in regions:
        share, enrichment = read_shares(region, traces, gaps)
        assert region.energy_share == pytest.approx(share, rel=2e-3), region
        assert region.enrichment == pytest.approx(enrichment, rel=2e-3), region


def test_part_holds_the_share() -> None:
    traces, gaps = planted(lambda t: since_turn_s(t.u_V, t.step_s) < 0.05)
    mean = np.concatenate(gaps).mean()
    whole = sum(((g - mean) ** 2).sum() for g in gaps)
    regions = locate(traces, gaps, NOISE, ENDS)
    assert {"since_turn", "frequency"} & {r.axis for r in regions}
    for region in regions:
        held = sum(
            (part(region, t, g - mean, ENDS) ** 2).sum() for t, g in zip(traces, gaps, strict=True)
        )
        assert held / whole == pytest.approx(region.energy_share, rel=1e-9)


def test_intervals_hold_the_shares_and_exclude_chance() -> None:
    traces, gaps = planted(lambda t: t.u_V > 30.0)
    for region in locate(traces, gaps, NOISE, ENDS):
        low, high = region.energy_share_ci95
        assert 0.0 <= low <= region.energy_share <= high <= 1.0
        low, high = region.enrichment_ci95
        assert 1.0 < low <= region.enrichment <= high


# -- what is not reported ---------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(8))
def test_white_noise_lies_nowhere(seed: int) -> None:
    traces = campaign()
    assert locate(traces, white(traces, seed), NOISE, ENDS) == []


@pytest.mark.parametrize("tau_s", [0.02, 0.25])
def test_coloured_noise_lies_nowhere(tau_s: float) -> None:
    noise = Noise(0.004, 0.01, tau_s, 10_000, known=True)
    a = np.exp(-1e-3 / tau_s)
    for seed in range(6):
        rng = np.random.default_rng(seed)
        gaps = [
            0.004 * rng.standard_normal(t.u_V.size)
            + 0.01
            * lfilter([np.sqrt(1 - a * a)], [1.0, -a], rng.standard_normal(t.u_V.size + 5000))[
                5000:
            ]
            for t in campaign()
        ]
        assert locate(campaign(), gaps, noise, ENDS) == []


def test_only_used_rows_of_train_records_count_and_the_mean_does_not() -> None:
    traces, gaps = planted(lambda t: t.u_V > 35.0)
    expected = [r.to_json() for r in locate(traces, gaps, NOISE, ENDS)]
    other = dataclasses.replace(trace_of("other", triangle()), role="holdout")
    shifted = [*[g + 7.0 for g in gaps], np.full(other.u_V.size, 1e3)]
    got = [r.to_json() for r in locate([*traces, other], shifted, NOISE, ENDS)]
    for a, b in zip(got, expected, strict=True):
        assert a["sentence"] == b["sentence"]
        assert a["energy_share"] == pytest.approx(b["energy_share"], rel=1e-9)


def test_an_even_gap_is_reported_by_what_there_is() -> None:
    traces = [trace_of("triangle", triangle())]
    rng = np.random.default_rng(5)
    gaps = [0.3 * rng.standard_normal(traces[0].u_V.size)]
    assert len(locate(traces, gaps, NOISE, ENDS)) == 1


def test_nothing_to_locate() -> None:
    traces = campaign()
    assert locate([], [], NOISE) == []
    assert locate(traces, [np.zeros(t.u_V.size) for t in traces], NOISE) == []
    unused = [dataclasses.replace(t, use=np.zeros(t.u_V.size, np.bool_)) for t in traces]
    assert locate(unused, white(traces), NOISE) == []


# -- what is told -----------------------------------------------------------------------------


def test_json_is_the_schemas_and_the_same_for_a_seed() -> None:
    traces, gaps = planted(lambda t: (t.u_V > 30.0) & (t.name == "decaying"))
    told = [r.to_json() for r in locate(traces, gaps, NOISE, ENDS, seed=4)]
    again = [r.to_json() for r in locate(traces, gaps, NOISE, ENDS, seed=4)]
    assert json.dumps(told, allow_nan=False) == json.dumps(again)
    assert 1 <= len(told) <= 6
    assert len({r["axis"] for r in told}) == len(told)
    if SCHEMA.exists():
        import jsonschema

        items = json.loads(SCHEMA.read_text(encoding="utf-8"))["properties"]["where"]
        jsonschema.validate(told, items)


@pytest.mark.parametrize(
    ("region", "said"),
    [
        (
            Region("frequency", 60.0, 500.0, "Hz", "above", energy_share=0.83, sample_share=0.09),
            "83 % of the gap lies above 60 Hz, in 9 % of the spectrum",
        ),
        (
            Region("since_turn", 0.0, 0.005, "s", "below", energy_share=0.999, sample_share=0.0031),
            "over 99 % of the gap lies within 5 ms after a turn of the command, "
            "in 0.3 % of the samples",
        ),
        (
            Region("nesting", 3.0, 9.0, "", "above", energy_share=0.5, sample_share=0.25),
            "50 % of the gap lies where 3 or more turning points are held, in 25 % of the samples",
        ),
        (
            Region("nesting", 1.0, 1.0, "", "between", energy_share=0.5, sample_share=0.25),
            "50 % of the gap lies where 1 turning point is held, in 25 % of the samples",
        ),
        (
            Region("nesting", 0.0, 1.0, "", "below", energy_share=0.5, sample_share=0.25),
            "50 % of the gap lies where at most 1 turning point is held, in 25 % of the samples",
        ),
        (
            Region("branch", "minor_falling", None, "", "at", energy_share=0.6, sample_share=0.2),
            "60 % of the gap lies on falling branches of minor loops, in 20 % of the samples",
        ),
        (
            Region("time", 30.0, 60.0, "s", "above", "hold", energy_share=0.7, sample_share=0.1),
            "70 % of the gap lies after 30 s in the record hold, in 10 % of the samples",
        ),
        (
            Region("rate", 0.0, 2.5, "V/s", "below", energy_share=0.7, sample_share=0.0001),
            "70 % of the gap lies where the command moves slower than 2.5 V/s, "
            "in under 0.1 % of the samples",
        ),
    ],
)
def test_sentences(region: Region, said: str) -> None:
    assert sentence(region) == said
