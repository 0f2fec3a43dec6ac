"""Captures of the timing pin: what is read from them, what is computed, and what is refused."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from madelung.errors import InputError
from madelung.reproduce import nested_codes, searched
from madelung.timing import analyse, parse_time, read_capture, read_inputs, summary

MADELUNG = Path(sys.executable).with_name("madelung")
HEAD = "$timescale 10 ns $end\n$var wire 1 ! pin $end\n$enddefinitions $end\n"
PERIOD_NS = 100_000


def vcd(high_ns: np.ndarray, rises_ns: np.ndarray) -> str:
    """The pin in units of 10 ns, low at first."""
    lines = [
        f"#{r // 10}\n1!\n#{(r + h) // 10}\n0!" for r, h in zip(rises_ns, high_ns, strict=True)
    ]
    return HEAD + "#0\n0!\n" + "\n".join(lines) + "\n"


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [str(MADELUNG), "timing", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def made(tmp_path: Path, high_ns: np.ndarray) -> Path:
    path = tmp_path / "pin.vcd"
    rises = PERIOD_NS * np.arange(1, high_ns.size + 1)
    path.write_text(vcd(high_ns, rises))
    return path


def codes_and_p() -> tuple[np.ndarray, np.ndarray]:
    """All codes nested, one jump that wipes all, and the comparisons of every step."""
    codes = np.append(nested_codes(4096), 0)
    count = np.minimum(np.arange(1, codes.size + 1), 4095)
    count[-1] = 0
    return codes, searched(codes.astype(float), count)


def test_computation_period_and_worst_cycle(tmp_path: Path) -> None:
    found = analyse(read_capture(made(tmp_path, np.array([1000, 1500, 2430, 1500, 990]))))
    assert found.computation_s.tolist() == [1e-6, 1.5e-6, 2.43e-6, 1.5e-6, 9.9e-7]
    assert (found.maximum_s, found.worst, found.period_s) == (2.43e-6, 2, 1e-4)
    assert (found.jitter_rms_s, found.jitter_peak_s, found.missed) == (0.0, 0.0, 0)
    assert found.p is None and found.line_s is None


def test_jitter_and_missed_cycles(tmp_path: Path) -> None:
    periods = np.array([100_000, 100_030, 99_970, 300_000, 100_000, 200_000, 100_000])
    rises = np.cumsum(np.append(50_000, periods))
    path = tmp_path / "pin.vcd"
    path.write_text(vcd(np.full(rises.size, 1000), rises))
    found = analyse(read_capture(path))
    assert found.missed == 2 + 1
    assert found.jitter_peak_s == pytest.approx(30e-9)
    assert found.jitter_rms_s == pytest.approx(30e-9 * np.sqrt(2 / 5))


def test_the_papers_line_comes_back_from_a_board_that_keeps_it(tmp_path: Path) -> None:
    codes, p = codes_and_p()
    path = made(tmp_path, 570 + 190 * p)
    record = tmp_path / "codes.csv"
    record.write_text("code\n" + "\n".join(map(str, codes)) + "\n")
    out = tmp_path / "timing.json"
    done = run(path, "--record", record, "-o", out)
    assert done.returncode == 0, done.stderr
    told = json.loads(out.read_text())
    assert told["line_s"]["at_p_0"] == pytest.approx(0.57e-6)
    assert told["line_s"]["per_comparison"] == pytest.approx(0.19e-6)
    assert told["worst"]["p"] == p.max() == 12
    assert told["worst"]["input_code"] == codes[p.argmax()]
    assert [row["p"] for row in told["by_p"]] == sorted(set(p.tolist()))
    assert sum(row["cycles"] for row in told["by_p"]) == codes.size == told["cycles"]
    assert "line: 0.57 + 0.19 p us" in done.stdout
    assert "2.80 us at p = 12" in done.stdout and "1.23 us at p = 4" in done.stdout


def test_a_record_in_volts_gives_the_same_p_as_codes(tmp_path: Path) -> None:
    codes, p = codes_and_p()
    path = made(tmp_path, np.full(codes.size, 1000))
    record = tmp_path / "record.csv"
    lines = [f"{i * 1e-4:.4f},{-20 + code * 0.01:.2f}" for i, code in enumerate(codes)]
    record.write_text("t_s,u_V\n" + "\n".join(lines) + "\n")
    found = analyse(read_capture(path), read_inputs(record))
    assert found.inputs is not None and found.inputs[1] == "V"
    np.testing.assert_array_equal(found.p, p)


def test_sigrok_writes_changes_on_one_line_and_pin_chooses_the_channel(tmp_path: Path) -> None:
    path = tmp_path / "sigrok.vcd"
    path.write_text(
        "$date today $end\n$version libsigrok 0.5.2 $end\n$comment\n  Acquisition at 24 MHz\n$end\n"
        "$timescale 1 ns $end\n$scope module libsigrok $end\n$var wire 1 ! D0 $end\n"
        '$var wire 1 " D1 $end\n$upscope $end\n$enddefinitions $end\n'
        '#0 1! 0"\n#1000 1"\n#2500 0" 0!\n#11000 1"\n#12000 0"\n#21000 1!  1"\n#22250 0"\n#31000\n'
    )
    with pytest.raises(InputError, match=r"--pin.*libsigrok\.D0, libsigrok\.D1"):
        read_capture(path)
    for name in ("D1", "libsigrok.D1"):
        found = analyse(read_capture(path, name))
        assert found.computation_s.tolist() == [1.5e-6, 1e-6, 1.25e-6]
        assert found.capture.resolution_s == 1e-9
    with pytest.raises(InputError, match="no channel 'D2'"):
        read_capture(path, "D2")


@pytest.mark.parametrize(
    "header", ["Time [s],Channel 0,Channel 1", "Time[s], Channel 0, Channel 1"]
)
def test_saleae_writes_a_row_per_change_of_any_channel(tmp_path: Path, header: str) -> None:
    path = tmp_path / "digital.csv"
    rows = [(0.0, 1, 0), (1e-4, 1, 1), (1.015e-4, 1, 0), (1.6e-4, 0, 0), (2e-4, 0, 1)]
    rows += [(2.02e-4, 0, 0), (3e-4, 0, 1), (3.01e-4, 1, 1), (3.02e-4, 1, 0), (4e-4, 1, 1)]
    path.write_text(header + "\n" + "\n".join(f"{t:.9f},{a},{b}" for t, a, b in rows) + "\n")
    found = analyse(read_capture(path, "Channel 1"))  # the cycle that is still on is left out
    np.testing.assert_allclose(found.computation_s, [1.5e-6, 2e-6, 2e-6], atol=1e-15)
    assert found.period_s == pytest.approx(1e-4)


def test_a_capture_that_begins_and_ends_within_a_cycle(tmp_path: Path) -> None:
    whole = [(100, 110), (200, 212), (300, 311)]
    changes = "".join(f"#{rise}\n1!\n#{fall}\n0!\n" for rise, fall in whole)
    path = tmp_path / "pin.vcd"
    path.write_text(f"{HEAD}#0\nx!\n#3\n1!\n#9\n0!\n{changes}#400\n1!\n")
    capture = read_capture(path)
    # What is known first is high: that cycle began before the capture.
    assert (capture.rises.tolist(), capture.falls.tolist()) == (
        [10.0 * rise for rise, _ in whole],
        [10.0 * fall for _, fall in whole],
    )


def test_the_budget_decides_the_exit_code(tmp_path: Path) -> None:
    path = made(tmp_path, np.array([1000, 2430, 1000, 1000]))
    assert run(path, "--budget", "10us").returncode == 0
    assert run(path, "--budget", "2.43us").returncode == 0
    over = run(path, "--budget", "2.42 us")
    assert over.returncode == 1
    assert "does not fit in the budget of 2.42 us" in over.stdout and over.stderr == ""


@pytest.mark.parametrize(
    ("text", "seconds"),
    [("10us", 1e-5), ("0.5 ms", 5e-4), ("800ns", 8e-7), ("2µs", 2e-6), ("1e-3s", 1e-3)],
)
def test_times_with_units(text: str, seconds: float) -> None:
    assert parse_time(text) == seconds


@pytest.mark.parametrize("text", ["10", "us", "-1us", "0us", "10 parsec", "1e999s", "nan s"])
def test_what_is_no_time_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="10us"):
        parse_time(text)


GOOD = HEAD + "#0\n0!\n#10\n1!\n#20\n0!\n#30\n1!\n#40\n0!\n#50\n1!\n#60\n0!\n"
BAD = {
    "empty.vcd": ("", "whole VCD"),
    "text.vcd": ("hello world\n", "whole VCD"),
    "cut_head.vcd": (HEAD[:40] + "\n", "whole VCD"),
    "cut_change.vcd": (GOOD[:-2], "is cut off"),
    "no_timescale.vcd": (GOOD.replace("$timescale 10 ns $end\n", ""), "no [$]timescale"),
    "odd_timescale.vcd": (GOOD.replace("10 ns", "7 hours"), "whole VCD"),
    "no_pin.vcd": (GOOD.replace("$var wire 1 ! pin $end\n", ""), "channels: none"),
    "low.vcd": (HEAD + "#0\n0!\n#100\n0!\n", "no edges, it is low"),
    "high.vcd": (HEAD + "#0\n1!\n#100\n", "no edges, it is high"),
    "nothing.vcd": (HEAD, "no edges"),
    "one_cycle.vcd": (HEAD + "#0\n0!\n#10\n1!\n#20\n0!\n#30\n", "holds 1 whole cycles"),
    "back.vcd": (GOOD.replace("#50", "#5"), "time runs back"),
    "unknown.vcd": (GOOD.replace("#30\n1!", "#30\nx!"), "neither 0 nor 1 at 300"),
    "empty.csv": ("", "cannot be read as CSV"),
    "no_time.csv": ("Channel 0\n1\n0\n", "'Time"),
    "no_unit.csv": ("Time,Channel 0\n0,1\n1,0\n", "'Time"),
    "odd_unit.csv": ("Time [h],Channel 0\n0,1\n1,0\n", "'Time"),
    "no_channel.csv": ("Time [s]\n0\n1\n", "channels: none"),
    "cut.csv": ("Time [s],Channel 0\n0.0,0\n0.1,1\n0.2,", "its last line does not end"),
    "gap.csv": ("Time [s],Channel 0\n0.0,0\n0.1,\n0.2,0\n", "row 3: is cut off"),
    "letters.csv": ("Time [s],Channel 0\n0.0,0\nsoon,1\n", "row 3: is cut off"),
    "constant.csv": ("Time [s],Channel 0\n0.0,0\n0.1,0\n", "no edges"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_captures_are_refused_in_one_line(tmp_path: Path, name: str) -> None:
    text, reason = BAD[name]
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(InputError, match=reason) as refusal:
        analyse(read_capture(path))
    assert str(path) in str(refusal.value)


def test_the_command_refuses_with_code_2_and_leaves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "cut.vcd"
    path.write_text(GOOD[:-2])
    out = tmp_path / "timing.json"
    done = run(path, "-o", out)
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.count("\n") == 1 and "cut.vcd" in done.stderr
    assert not out.exists()
    assert run(tmp_path / "missing.vcd").returncode == 2
    (tmp_path / "good.vcd").write_text(GOOD)
    assert run(tmp_path / "good.vcd", "-o", tmp_path / "good.vcd").returncode == 2


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("code\n1\n2\n", "3 whole cycles, the record 2 inputs"),
        ("code\n1\n2.5\n3\n", "row 3: code is not"),
        ("code\n1\n-2\n3\n", "row 3: code is not"),
        ("a,b\n1,2\n", "t_s"),
    ],
)
def test_inputs_that_do_not_fit_are_refused(tmp_path: Path, text: str, reason: str) -> None:
    (tmp_path / "good.vcd").write_text(GOOD)
    record = tmp_path / "record.csv"
    record.write_text(text)
    with pytest.raises(InputError, match=reason):
        analyse(read_capture(tmp_path / "good.vcd"), read_inputs(record))


def test_the_picture_is_drawn_with_and_without_inputs(tmp_path: Path) -> None:
    codes, p = codes_and_p()
    path = made(tmp_path, 570 + 190 * p)
    record = tmp_path / "codes.csv"
    record.write_text("code\n" + "\n".join(map(str, codes)) + "\n")
    for name, more in (("with", ["--record", record]), ("without", [])):
        picture = tmp_path / f"{name}.png"
        done = run(path, "--plot", picture, *more)
        assert done.returncode == 0, done.stderr
        assert picture.read_bytes().startswith(b"\x89PNG") and picture.stat().st_size > 5000


def test_a_hundred_thousand_cycles_are_read_in_seconds(tmp_path: Path) -> None:
    import time

    path = made(tmp_path, np.full(100_000, 1500))
    start = time.monotonic()
    found = analyse(read_capture(path))
    assert time.monotonic() - start < 20.0
    assert found.computation_s.size == 100_000
    assert next(summary(found)).startswith("100000 cycles, period 100 us")
