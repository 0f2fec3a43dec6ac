"""The simulated actuator: its loops, converters, sensor, and the command that writes records."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from madelung.cli import app
from madelung.errors import InputError
from madelung.records import read_record
from madelung.stage import Hysteresis, Stage, load_stage, simulate
from madelung.waveforms import Command, Waveform

KINDS = ["relays", "slides"]
SLOW = Command(seconds=20.0, rate_hz=200.0)


def width_share(u: np.ndarray, y: np.ndarray) -> float:
    """Opening of one loop, up and down, at the middle of its range over its height."""
    top = int(np.argmax(u))
    middle = (u.min() + u.max()) / 2.0
    up = np.interp(middle, u[: top + 1], y[: top + 1])
    down = np.interp(middle, u[: top - 1 : -1], y[: top - 1 : -1])
    return float((down - up) / np.ptp(y))


def swing(low: float, high: float) -> np.ndarray:
    up = np.linspace(low, high, 1001)
    return np.concatenate((up, up[-2::-1]))


@pytest.mark.parametrize("physics", KINDS)
def test_loop_has_the_stroke_and_width_asked_for(physics: str) -> None:
    stage = Stage(-20.0, 130.0, 45.0, 0.12, y_min_um=3.0, physics=physics)
    u = swing(-20.0, 130.0)
    y = Hysteresis(stage).run(u)
    assert y[0] == pytest.approx(3.0) and y[1000] == pytest.approx(48.0)
    assert y[-1] == pytest.approx(3.0)
    assert width_share(u, y) == pytest.approx(0.12, abs=1e-3)


@pytest.mark.parametrize("physics", KINDS)
def test_small_swings_are_nearly_linear(physics: str) -> None:
    hysteresis = Hysteresis(Stage(physics=physics))
    hysteresis.run(np.append(np.linspace(0.0, 22.0, 500), 18.0))
    u = swing(18.0, 22.0)
    assert 0.015 < width_share(u, hysteresis.run(u)) < 0.03


@pytest.mark.parametrize("physics", KINDS)
def test_loop_is_symmetric_rate_independent_and_wipes_out(physics: str) -> None:
    stage = Stage(physics=physics)
    up, down = np.split(Hysteresis(stage).run(swing(0.0, 40.0)), [1001])
    np.testing.assert_allclose(down, 30.0 - up[1:], atol=1e-9)
    slow = Hysteresis(stage).run(np.repeat(swing(0.0, 40.0), 3))
    np.testing.assert_allclose(slow[1::3], np.append(up, down), atol=1e-9)
    direct = Hysteresis(stage)
    nested = Hysteresis(stage)
    nested.run([30.0, 5.0, 25.0, 10.0, 20.0, 35.0])
    direct.run([35.0])
    np.testing.assert_allclose(nested.run([12.0, 22.0]), direct.run([12.0, 22.0]), atol=1e-9)


def test_both_kinds_agree_where_both_are_exact() -> None:
    u = Command(Waveform.SINES, 20.0, 500.0).at(np.arange(0.0, 20.0, 0.002))
    relays, slides = (Hysteresis(Stage(physics=p)).run(u) for p in KINDS)
    assert np.abs(relays - slides).max() < 0.01


def test_record_is_on_the_converters_codes() -> None:
    record = simulate(Stage(noise_um=0.0, dac_bits=8, adc_bits=8), SLOW)
    codes = record.u_V * 255 / 40.0
    np.testing.assert_allclose(codes, np.rint(codes), atol=1e-4)
    assert np.unique(record.y).size <= 256


@pytest.mark.parametrize("ar", [0.0, 0.9])
def test_noise_has_the_rms_and_colour_asked_for(ar: float) -> None:
    command = Command(seconds=60.0, rate_hz=400.0)
    noisy, clean = (
        simulate(Stage(noise_um=n, noise_ar=ar, adc_bits=0), command, seed=2).y for n in (0.05, 0.0)
    )
    assert noisy is not None and clean is not None
    noise = noisy - clean
    assert noise.std() == pytest.approx(0.05, rel=0.1)
    assert np.corrcoef(noise[:-2], noise[2:])[0, 1] == pytest.approx(ar, abs=0.05)


def test_pink_noise_has_equal_power_in_every_octave_whatever_the_rate() -> None:
    for rate_hz in (2000.0, 8000.0):
        command = Command(seconds=100.0, rate_hz=rate_hz)
        noisy, clean = (
            simulate(Stage(noise_um=n, noise_pink=True, adc_bits=0), command, seed=2).y
            for n in (0.05, 0.0)
        )
        assert noisy is not None and clean is not None
        power = np.abs(np.fft.rfft(noisy - clean)) ** 2
        octaves = [power[100 * 2**k : 200 * 2**k].sum() for k in range(6)]
        assert np.ptp(octaves) < 0.5 * np.mean(octaves)


def test_sensor_saturates_drops_and_sticks() -> None:
    clipped = simulate(Stage(adc_max_um=20.0, noise_um=0.0), SLOW).y
    assert clipped is not None and clipped.max() == 20.0
    dropped = simulate(Stage(drop_share=0.1), SLOW, seed=1)
    assert 0.85 < dropped.t_s.size / SLOW.samples < 0.95
    assert {f.kind for f in dropped.faults} == set()
    stuck = simulate(Stage(stuck_share=0.1, adc_bits=0), SLOW, seed=1).y
    assert stuck is not None and 0.05 < np.mean(np.diff(stuck) == 0.0) < 0.15


def test_seed_and_switches_are_independent() -> None:
    same, again, other = (simulate(Stage(), SLOW, seed=s).y for s in (1, 1, 2))
    np.testing.assert_array_equal(same, again)
    assert not np.array_equal(same, other)
    dropped = simulate(Stage(drop_share=0.2), SLOW, seed=1)
    kept = np.rint(dropped.t_s * 200.0).astype(int)
    np.testing.assert_array_equal(dropped.y, same[kept])


def test_command_beyond_the_drive_is_refused() -> None:
    with pytest.raises(InputError, match="0 to 41 V"):
        simulate(Stage(), Command(u_max_V=41.0))


@pytest.mark.parametrize(
    "text", ["{", "[]", '{"stroke": 3}', '{"stroke_um": -1}', '{"stroke_um": "a"}']
)
def test_bad_stage_files_are_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "stage.json"
    path.write_text(text)
    with pytest.raises(InputError, match=r"stage\.json"):
        load_stage(path)


def test_command_writes_the_same_record_for_the_same_seed(tmp_path: Path) -> None:
    stage = tmp_path / "stage.json"
    stage.write_text(json.dumps({"u_min_V": -10.0, "u_max_V": 30.0, "stroke_um": 15.0}))
    told = ["simulate", "--stage", str(stage), "--waveform", "decaying", "--hz", "0.5"]
    for name in ("a", "b"):
        result = CliRunner().invoke(app, [*told, "--seed", "3", "-o", str(tmp_path / name)])
        assert result.exit_code == 0, result.output
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    record = read_record(tmp_path / "a")
    assert record.u_V.min() == -10.0 and record.u_V.max() == 30.0
    assert record.y is not None and np.ptp(record.y) == pytest.approx(15.0, abs=0.2)


def test_command_leaves_nothing_behind_when_it_fails(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["simulate", "--seconds", "-1", "-o", str(tmp_path / "x.csv")])
    assert isinstance(result.exception, InputError)
    assert list(tmp_path.iterdir()) == []
