"""What the interactive figures hold: decimated records, and what the page's pictures hold, too."""

import base64
from typing import Any

import numpy as np
import pytest
from report_cases import NOISE, changed, diagnosis, views

from madelung.diagnosis.figures import DARK, ROWS_MAX, figures, records
from madelung.diagnosis.pictures import View
from madelung.plots import extremes
from madelung.waveforms import planned

PLANNED = {
    "waveform": "multisine",
    "rate_hz": 2000.0,
    "seconds": 20.0,
    "f_low_hz": 0.5,
    "f_high_hz": 90.0,
    "u_min_V": 10.0,
    "u_max_V": 30.0,
    "why": "phase tells",
}


@pytest.mark.parametrize("size", [1, 2, 999, 1000, 1001, 12_345, 1_000_003])
@pytest.mark.parametrize("channels", [1, 3])
def test_decimation_keeps_extremes_of_every_channel(size: int, channels: int) -> None:
    rng = np.random.default_rng(size)
    values = [rng.standard_normal(size) for _ in range(channels)]
    rows = extremes(*values, points=1000)
    assert (np.diff(rows) > 0).all() and rows[0] == 0 and rows[-1] == size - 1
    assert rows.size <= max(1000, 1000 + 2 * channels + 2)
    for v in values:
        assert v[rows].min() == v.min() and v[rows].max() == v.max()


@pytest.mark.parametrize("at", [0, 17, 500_000, 999_999])
def test_decimation_keeps_a_single_row(at: int) -> None:
    quiet, spike = np.zeros(1_000_000), np.zeros(1_000_000)
    spike[at] = -1.0
    assert at in extremes(quiet, spike, points=1000)


def unpacked(record: dict[str, Any], channel: str) -> np.ndarray:
    kind = "<i4" if channel == "row" else "<f4"
    return np.frombuffer(base64.b64decode(record[channel]), kind)


def test_a_long_record_is_thinned_and_short_ones_are_whole() -> None:
    short, other = views()
    n = 400_000
    t = np.arange(n) * 1e-4 + 7.0
    error = np.zeros(n)
    error[123_457] = 3.0
    long = View("long", "holdout", t, np.sin(t), np.cos(t) + error, np.cos(t), np.cos(t) + error)
    held = {r["name"]: r for r in records([short, other, long])}
    rows = unpacked(held["long"], "row")
    assert 10_000 < rows.size <= ROWS_MAX - 12_000 + 10
    assert held["long"]["size"] == n and 123_457 in rows
    np.testing.assert_allclose(unpacked(held["long"], "u"), np.sin(t)[rows], atol=1e-6)
    assert held["long"]["start_s"] + held["long"]["step_s"] * rows[-1] == pytest.approx(t[-1])
    low, high = held["long"]["worst_s"]
    assert low <= t[123_457] <= high
    assert unpacked(held["sweep"], "row").tolist() == list(range(6000))


def test_many_records_share_the_page() -> None:
    one = views()[0]
    held = records([one] * 100)
    assert len(held) == 40
    assert sum(unpacked(r, "row").size for r in held) <= ROWS_MAX + 40 * 10


def test_every_figure_is_there_and_their_colours_know_the_dark() -> None:
    d = changed("ambiguous", candidates=["creep", "drift"]) | {"next_experiment": PLANNED}
    drawn = figures(views(), NOISE, d)
    assert set(drawn) == {"time", "loops", "map", "turn", "spectrum", "ranking", "next"}
    for figure in drawn.values():
        assert figure["layout"]["font"]["color"] in DARK
        assert figure["layout"]["paper_bgcolor"] in DARK


def test_without_records_there_is_only_what_the_diagnosis_tells() -> None:
    assert set(figures([], None, diagnosis())) == {"ranking"}
    assert figures([], None, diagnosis() | {"ranking": []}) == {}
    assert set(figures([], None, diagnosis() | {"next_experiment": {"do": "rest"}})) == {"ranking"}


def test_the_next_command_is_the_one_that_simulate_writes() -> None:
    drawn = figures([], None, diagnosis() | {"next_experiment": PLANNED})["next"]["data"][0]
    command = planned(PLANNED)
    u = command.at(command.time_s)
    assert (min(drawn["y"]), max(drawn["y"])) == pytest.approx((u.min(), u.max()), rel=1e-4)
    np.testing.assert_allclose(command.at(np.array(drawn["x"])), drawn["y"], rtol=1e-4)


def test_spectrum_and_profile_show_the_error_and_the_floor() -> None:
    t = np.arange(20_000) * 1e-3
    rng = np.random.default_rng(1)
    u = 20.0 - 20.0 * np.cos(2 * np.pi * 0.5 * t)
    noise = 0.01 * rng.standard_normal(t.size)
    view = View("x", "train", t, u, 0.1 * u + noise, 0.1 * u - np.sin(2 * np.pi * 40 * t), 0.1 * u)
    drawn = figures([view], NOISE, diagnosis())
    floor, before, after = (np.array(trace["y"]) for trace in drawn["spectrum"]["data"])
    freq = np.array(drawn["spectrum"]["data"][0]["x"])
    assert freq[np.argmax(before)] == pytest.approx(40.0, rel=0.05)
    assert np.median(after[freq > 5] / floor[freq > 5]) == pytest.approx(1.0, abs=0.1)
    assert floor == pytest.approx(0.01 * np.sqrt(2e-3), rel=1e-3)
    _, before, after = (np.array(trace["y"]) for trace in drawn["turn"]["data"])
    assert np.sqrt(np.mean(before**2)) == pytest.approx(np.sqrt(0.5), rel=0.1)
    assert after == pytest.approx(0.01, rel=0.5)


def test_shares_of_the_ranking_stand_beside_it() -> None:
    drawn = figures([], None, diagnosis())["ranking"]
    told = drawn["layout"]["annotations"]
    assert [(a["y"], a["text"]) for a in told[1:3]] == [("delay", "99.8 %"), ("creep", "99.8 %")]
    assert all(a["x"] == 1.0 and a["xanchor"] == "left" for a in told)
    assert not any("text" in trace for trace in drawn["data"])


def test_ranking_shows_intervals_where_there_are_any() -> None:
    d = diagnosis()
    d["ranking"][0]["rms_um_ci95"] = [0.008, 0.013]
    named = figures([], None, d)["ranking"]["data"][0]
    assert named["y"] == ["delay", "creep"] and named["name"] == "in the verdict"
    assert named["error_x"]["arrayminus"] == pytest.approx([0.0021, 0.0])
    assert named["error_x"]["array"] == pytest.approx([0.0029, 0.0])
