"""Cao & Li 2019 reproduced: every row, and that the rows are computed."""

import json
from pathlib import Path

import numpy as np
import pytest
from reference.play import play as reference_play
from typer.testing import CliRunner

from madelung.cli import app
from madelung.core import Predictor
from madelung.errors import InputError
from madelung.reproduce import (
    CITATION,
    EQ_20,
    FIGURES,
    THRESHOLD,
    WEIGHT,
    Reproduction,
    Row,
    fig_12_signal,
    load_cost,
    nested_codes,
    play,
    reproduce,
    search_comparisons,
    searched,
)


@pytest.fixture(scope="module")
def found() -> Reproduction:
    return reproduce()


def row(found: Reproduction, where: str, what: str) -> Row:
    (one,) = [r for r in found.rows if r.where == where and what in r.what]
    return one


def numbers(text: str) -> list[float]:
    return [float(v) for v in text.split(",")]


def test_example_1_is_x_squared_within_its_errors(found: Reproduction) -> None:
    ours = row(found, "Example 1", "f0")
    assert ours.agrees and numbers(ours.paper) == [1.0005, -0.0008, 0.0002]
    np.testing.assert_allclose(numbers(ours.ours), [1.0, 0.0, 0.0], atol=5e-3)
    assert ours.ours != ours.paper


def test_example_2_agrees_on_eight_kinds_of_signal_to_float_precision(
    found: Reproduction,
) -> None:
    assert len({c.name for c in found.example_2}) == 8
    for one in found.example_2:
        assert one.within and one.off["float32"] < 5e-7 and one.off["float64"] < 1e-15
        assert np.ptp(one.x) > 0.9, "the signal uses the range"
        np.testing.assert_allclose(one.ours, one.play, atol=5e-7)


def test_the_stages_backlash_is_the_papers_operator() -> None:
    x = np.random.default_rng(3).random(500)
    np.testing.assert_allclose(
        play(x, WEIGHT, THRESHOLD), reference_play(x, WEIGHT, THRESHOLD), atol=1e-14
    )


def test_fig_12_is_what_the_text_says() -> None:
    t, u = fig_12_signal()
    assert u.max() == 40.0 and u[0] == u[-1] == 0.0
    at = {s: int(np.argmin(np.abs(t - s))) for s in (1.5, 3.0, 13.4)}
    assert u[at[1.5]] == 40.0 and u[at[3.0]] == 0.0
    turns = np.flatnonzero(np.diff(np.sign(np.diff(u)))) + 1
    swings = np.abs(np.diff(u[np.concatenate(([0], turns, [u.size - 1]))]))
    assert turns[np.argmin(swings)] == at[13.4], "the smallest swing ends at 13.4 s"
    speed = np.abs(np.diff(u)) * 200.0
    np.testing.assert_allclose(speed, 40.0 / 1.5, rtol=0.1)


def test_turning_points_are_those_of_fig_14(found: Reproduction) -> None:
    rows = [r for r in found.rows if r.where == "Fig. 14"]
    assert len(rows) == 6 and all(r.agrees for r in rows)
    assert found.turning_points.max() == 14 and found.turning_points[-1] == 0


def test_worst_case_takes_twelve_comparisons(found: Reproduction) -> None:
    ours = row(found, "eqs. (18), (19)", "comparisons")
    assert ours.agrees and ours.ours.startswith("12 counted, 12 by")
    assert row(found, "section 2.2", "most left").ours == "2048"
    assert sorted(nested_codes(4096)) == list(range(1, 4096))
    held = Predictor(EQ_20).run_with_status(nested_codes(4096) * (40.0 / 4095.0))[2]
    assert held[-1] == 4095 and (np.diff(held.astype(int)) == 1).all()


@pytest.mark.parametrize("m", [1, 2, 3, 7, 8, 100, 2047, 2048])
def test_counted_comparisons_are_those_of_a_plain_binary_search(m: int) -> None:
    counts = []
    for place in range(m + 1):
        left, right, made = 0, m, 0
        while left < right:
            mid, made = (left + right) // 2, made + 1
            left, right = (mid + 1, right) if mid < place else (left, mid)
        assert right == place
        counts.append(made)
    assert search_comparisons(m) == max(counts)


def test_what_needs_the_papers_actuator_is_said_to_be_not_reproducible(
    found: Reproduction,
) -> None:
    error = row(found, "Fig. 13", "largest error")
    assert error.agrees is None and "not reproducible" in error.note
    most = np.abs(found.predicted.error).max()
    assert error.ours.startswith(f"{most:.2g} um") and 0.01 < most < 0.12


def test_memory_and_parameters(found: Reproduction) -> None:
    table = [r for r in found.rows if r.where == "Table 2"]
    assert [r.ours.partition(" (")[0] for r in table] == ["32 KB", "512 KB", "2 MB", "128 MB"]
    assert [r.paper.partition(" (")[0] for r in table] == ["16 KB", "256 KB", "1.5 MB", "96 MB"]
    for r in table:
        assert f"entries give {r.paper.partition(' (')[0]}" in r.note
    assert row(found, "section 3.3", "parameters").ours == "4, 20"


def test_comparisons_of_a_record_are_those_of_the_papers_search() -> None:
    """Nested turns, then jumps: the search runs among the points held when the input arrives."""
    x = np.array([0.9, 0.1, 0.8, 0.2, 0.7, 0.7, 0.05, 0.0])
    count = np.array([1, 2, 3, 4, 5, 5, 2, 0])
    # 0.7 rises among two right points; to 0.05 it falls among A_0, 0.1, 0.2, and to 0 among A_0.
    among = [0, 1, 1, 2, 2, 0, 3, 1]
    most = [0, 1, 1, 2, 2, 0, 2, 1]
    got = searched(x, count)
    assert [0 if m == 0 else search_comparisons(m) for m in among] == most
    assert (got <= most).all() and (got[[1, 2, 6, 7]] == [1, 1, 2, 1]).all() and got[5] == 0


TIMING = {
    "capture": "board.vcd",
    "by_p": [
        {"p": p, "cycles": 9, "mean_s": (50 + p) * 1e-8, "max_s": (80 + 3 * p) * 1e-8}
        for p in (0, 1, 2, 4)
    ],
}
"""Of what `madelung timing` writes, all that Fig. 8 needs; p = 0 makes no comparison."""


def test_fig_8_takes_the_times_of_a_capture(tmp_path: Path) -> None:
    path = tmp_path / "timing.json"
    path.write_text(json.dumps(TIMING), encoding="utf-8")
    rows = [r for r in reproduce((load_cost(path),)).rows if r.where == "Fig. 8"]
    assert rows[2].what == "time of a step, capture board"
    assert rows[2].ours == "0.80 + 0.030 p us at most; mean 0.51 to 0.54 us"
    assert "0.57 + 0.19 p us" in rows[2].paper and rows[2].agrees is None
    assert [(r.paper, r.ours) for r in rows[:2]] == [("2.80 us", "2.85 us"), ("1.23 us", "1.33 us")]


def test_without_a_capture_fig_8_says_that_nothing_was_measured(found: Reproduction) -> None:
    assert row(found, "Fig. 8", "time of a step").ours == "not measured"


@pytest.mark.parametrize(
    "text", ["", "{}x", "[1]", '{"by_p": 1}', json.dumps(TIMING).replace('"p": 4', '"p": 2')[:-9]]
)
def test_refuses_what_is_no_timing(tmp_path: Path, text: str) -> None:
    path = tmp_path / "timing.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"timing\.json: (is not a JSON|holds no times)"):
        load_cost(path)
    with pytest.raises(InputError, match="cannot be read"):
        load_cost(tmp_path)


def test_command_writes_table_and_figures(tmp_path: Path, found: Reproduction) -> None:
    out = tmp_path / "out"
    result = CliRunner().invoke(app, ["reproduce", "cao2019", "-o", str(out)])
    assert result.exit_code == 0, result.output
    assert "not comparable" in result.stdout and "2048" in result.stdout
    names = {p.name for p in out.iterdir()}
    assert names == {f"{f}.png" for f in FIGURES} | {"table.md", "table.json"}
    told = json.loads((out / "table.json").read_text(encoding="utf-8"))
    assert told["paper"] == CITATION and len(told["rows"]) == len(found.rows)
    assert [r["ours"] for r in told["rows"]] == [r.ours for r in found.rows], "repeatable"
    assert all((out / f"{f}.png").read_bytes()[:4] == b"\x89PNG" for f in FIGURES)
    table = (out / "table.md").read_text(encoding="utf-8").splitlines()
    assert len([line for line in table if line.startswith("| ")]) == len(found.rows) + 1


def test_the_readme_shows_what_is_computed(found: Reproduction) -> None:
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    shown = readme.partition("## Papers reproduced")[2].partition("\n## ")[0]
    assert f"| {row(found, 'Example 1', 'f0').ours} (" in shown
    assert row(found, "Example 2, Fig. 7", "float").ours.partition(" of")[0] in shown
    assert f"stage: {row(found, 'Fig. 13', 'error').ours.partition(' (')[0]} |" in shown
    assert f"| {row(found, 'Fig. 14, eq. (18)', 'comparisons').ours} |" in shown
    for r in found.rows:
        if r.where == "Fig. 8" and "text" in r.what:
            assert f"{r.paper} and {r.ours} at p = " in shown


def test_command_refuses_a_folder_that_cannot_be_made(tmp_path: Path) -> None:
    result = CliRunner().invoke(
        app, ["reproduce", "cao2019", "-o", str(tmp_path / "a" / "b")], standalone_mode=False
    )
    assert "cannot be written" in str(result.exception)
    assert list(tmp_path.iterdir()) == []
