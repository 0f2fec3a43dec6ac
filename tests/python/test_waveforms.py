"""Commands: ranges, frequencies, the shape of the paper's test signal."""

from dataclasses import replace

import numpy as np
import pytest

from madelung.errors import InputError
from madelung.waveforms import Command, Waveform

RANDOM_LEVELS = (Waveform.STEPS, Waveform.CODES, Waveform.WALK)


@pytest.mark.parametrize("waveform", list(Waveform))
def test_stays_in_its_range_and_reaches_both_ends(waveform: Waveform) -> None:
    u = (command := Command(waveform, 40.0, 500.0, -20.0, 130.0)).at(command.time_s)
    assert u.shape == (20000,)
    assert u.min() >= -20.0 - 1e-9 and u.max() <= 130.0 + 1e-9
    slack = 10.0 if waveform in RANDOM_LEVELS else 0.5
    assert u.min() < -20.0 + slack and u.max() > 130.0 - slack


@pytest.mark.parametrize("waveform", list(Waveform))
def test_is_a_function_of_time_not_of_the_samples(waveform: Waveform) -> None:
    command = Command(waveform, 10.0, 100.0)
    fine = command.at(np.arange(10000) / 1000.0)
    np.testing.assert_allclose(fine[::10], command.at(command.time_s), atol=1e-9)


@pytest.mark.parametrize(
    "waveform", [Waveform.SINES, Waveform.MULTISINE, Waveform.NOISE, *RANDOM_LEVELS]
)
def test_the_seed_decides(waveform: Waveform) -> None:
    def values(seed: int) -> np.ndarray:
        command = Command(waveform, 5.0, 100.0, seed=seed)
        return command.at(command.time_s)

    np.testing.assert_array_equal(values(3), values(3))
    assert np.abs(values(3) - values(4)).max() > 1.0


def test_decaying_is_the_papers_figure_12() -> None:
    command = Command(Waveform.DECAYING, 23.0, 1000.0, hz=1 / 3)
    u = command.at(command.time_s)
    assert u[1500] == pytest.approx(40.0) and u[3000] == pytest.approx(0.0, abs=1e-9)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(u))) != 0) + 1
    peaks = u[turns][u[turns] > 18.0]
    falling, growing = peaks[1:8], peaks[8:]
    assert np.all(np.diff(falling) < 0.0) and np.all(np.diff(growing) > 0.0)
    assert peaks.size == 1 + 7 + 6


def test_multisine_has_power_at_its_lines_alone() -> None:
    command = Command(Waveform.MULTISINE, 20.0, 200.0, hz=0.1, band_hz=(1.0, 30.0))
    amplitude = np.abs(np.fft.rfft(command.at(command.time_s))) / 2000.0
    lines = np.arange(20, 601, 2)
    assert np.ptp(amplitude[lines]) < 1e-3 * amplitude[lines].mean()
    rest = np.delete(amplitude, np.append(lines, 0))
    assert rest.max() < 1e-4 * amplitude[lines].mean()


def test_rounded_turns_where_decaying_does() -> None:
    decaying = Command(Waveform.DECAYING, 23.0, 1000.0, hz=1 / 3)
    straight, rounded = (
        c.at(c.time_s) for c in (decaying, replace(decaying, waveform=Waveform.ROUNDED))
    )
    turns = np.flatnonzero(np.diff(np.sign(np.diff(straight))) != 0) + 1
    np.testing.assert_allclose(rounded[turns], straight[turns], atol=0.05)
    assert np.all(np.abs(np.diff(rounded)[turns]) < 5e-3)


def test_chirp_sweeps_its_band() -> None:
    command = Command(Waveform.CHIRP, 10.0, 1000.0, band_hz=(1.0, 50.0))
    u = command.at(command.time_s) - 20.0
    crossings = np.flatnonzero(np.diff(np.sign(u)) != 0)
    half_periods = np.diff(crossings) / 1000.0
    assert 0.5 / half_periods[0] == pytest.approx(1.0, rel=0.4)
    assert 0.5 / half_periods[-10:].mean() == pytest.approx(50.0, rel=0.1)


def test_noise_is_low_passed() -> None:
    command = Command(Waveform.NOISE, 50.0, 200.0, band_hz=(0.0, 5.0))
    power = np.abs(np.fft.rfft(command.at(command.time_s) - 20.0)) ** 2
    assert power[1:250].sum() > 20.0 * power[500:].sum()


def test_steps_rise_in_the_time_given() -> None:
    command = Command(Waveform.STEPS, 5.0, 1000.0, dwell_s=0.5, rise_s=0.1)
    u = command.at(command.time_s).reshape(10, 500)
    np.testing.assert_allclose(u[:, 100:], u[:, 100:101] * np.ones(400))
    assert u[1, 50] == pytest.approx((u[0, -1] + u[1, -1]) / 2.0)


@pytest.mark.parametrize(
    "wrong",
    [
        {"seconds": 0.0},
        {"rate_hz": float("nan")},
        {"u_min_V": 40.0},
        {"seconds": 1e6, "rate_hz": 1e5},
        {"rise_s": 1.0},
        {"turns": 0},
        {"hz": 101.0},
        {"waveform": "decaying", "hz": 101.0},
        {"waveform": "multisine", "band_hz": (0.5, 200.0)},
        {"waveform": "multisine", "band_hz": (0.51, 0.52)},
        {"waveform": "sines", "lines_hz": ()},
        {"waveform": "chirp", "band_hz": (0.0, 50.0)},
        {"waveform": "noise", "seconds": 1e4, "band_hz": (0.0, 50.0)},
    ],
)
def test_bad_values_are_refused(wrong: dict) -> None:
    with pytest.raises(InputError):
        Command(**wrong)
