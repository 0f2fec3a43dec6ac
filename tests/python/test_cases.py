"""Every effect of the simulated stage against what it is defined to do, and whole cases."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cryptography.fernet import Fernet
from numpy.typing import NDArray
from typer.testing import CliRunner

from madelung.campaigns import Campaign
from madelung.cli import app
from madelung.errors import InputError
from madelung.records import read_record
from madelung.sealing import seal, unseal
from madelung.sim_effects import EFFECTS, LATE, OUTSIDE, VOCABULARY, Effects
from madelung.stage import Stage, make_case, simulate
from madelung.waveforms import Command, Waveform

Floats = NDArray[np.float64]

LINEAR = Stage(hysteresis_share=0.0, noise_um=0.0, adc_bits=0, dac_bits=0, headroom_share=2.0)
"""30 um over 40 V."""
REAL = replace(LINEAR, hysteresis_share=0.13)
SINE = Command(Waveform.SINE, 2.0, 2000.0, hz=50.0)
LOOP = Command(seconds=20.0, rate_hz=200.0, hz=0.1)
STEP = Command(Waveform.STAIRCASE, 24.0, 500.0, dwell_s=12.0, turns=1, u_min_V=0.0, u_max_V=20.0)
"""15 um, at 12 s."""


def response(stage: Stage, command: Command, effects: Effects | None = None) -> Floats:
    y = simulate(stage, command, 0, effects or Effects()).y
    assert y is not None
    return y


def line(y: Floats, command: Command, hz: float) -> complex:
    """Complex amplitude of a line in the second half of a record, after transients."""
    t = command.time_s[command.samples // 2 :]
    wave = np.exp(-2j * np.pi * hz * t)
    return complex(2.0 * np.mean((y[command.samples // 2 :] - y.mean()) * wave))


def test_without_effects_the_whole_path_is_the_hysteresis() -> None:
    np.testing.assert_allclose(response(REAL, LOOP), simulate(REAL, LOOP).y, atol=1e-6)


def test_delay_shifts() -> None:
    fine = replace(SINE, seconds=0.1, rate_hz=20000.0)
    late = response(REAL, fine, Effects(delay_s=0.0004))
    np.testing.assert_allclose(late[8:], response(REAL, fine)[:-8], atol=1e-3)
    assert np.all(late[:8] == late[0])


@pytest.mark.parametrize(("knee", "law"), [(0.0, 0), (3.0, 0), (3.0, 1), (3.0, 2)])
def test_saturation_clips_at_both_ends(knee: float, law: int) -> None:
    effects = Effects(high_V=36.0, low_V=2.0, knee_V=knee, knee_law=law)
    y = response(LINEAR, LOOP, effects) * 40.0 / 30.0
    assert y.max() == pytest.approx(36.0, abs=0.1 if knee == 0.0 else 1.0)
    assert y.min() == pytest.approx(2.0, abs=0.1 if knee == 0.0 else 1.0)
    assert y.max() <= 36.0 + 1e-6 and y.min() >= 2.0 - 1e-6
    middle = np.abs(LOOP.at(LOOP.time_s) - 20.0) < 10.0
    np.testing.assert_allclose(y[middle], LOOP.at(LOOP.time_s)[middle], atol=1e-6)


def test_slew_limit_bounds_the_rate() -> None:
    y = response(LINEAR, SINE, Effects(slew_V_per_s=3000.0)) * 40.0 / 30.0
    rate = np.abs(np.diff(y)) * SINE.rate_hz
    assert rate.max() == pytest.approx(3000.0, rel=0.01)
    assert np.abs(np.diff(SINE.at(SINE.time_s))).max() * SINE.rate_hz > 6000.0
    slower = response(LINEAR, SINE, Effects(slew_V_per_s=3000.0, slew_fall=0.8)) * 40.0 / 30.0
    assert np.diff(slower).min() * SINE.rate_hz == pytest.approx(-2400.0, rel=0.01)


def test_lag_is_a_pole_at_its_corner() -> None:
    ratio = line(response(LINEAR, SINE, Effects(corner_hz=50.0)), SINE, 50.0) / line(
        response(LINEAR, SINE), SINE, 50.0
    )
    assert ratio == pytest.approx(1.0 / (1.0 + 1.0j), abs=5e-3)


def test_lag_into_a_capacitance_is_slower_at_high_voltage() -> None:
    low, high = (replace(SINE, u_min_V=a, u_max_V=a + 2.0) for a in (0.0, 38.0))
    droop = Effects(corner_hz=50.0, droop=0.4)
    at_low, at_high = (
        np.angle(line(response(LINEAR, c, droop), c, 50.0) / line(response(LINEAR, c), c, 50.0))
        for c in (low, high)
    )
    assert at_low == pytest.approx(-np.arctan(0.8), abs=0.02)
    assert at_high == pytest.approx(-np.arctan(1.2), abs=0.02)


def test_mode_swings_at_its_frequency_and_passes_slow_motion() -> None:
    effects = Effects(fn_hz=100.0, zeta=0.02, mode_share=0.7)
    ratio = line(response(LINEAR, SINE, effects), SINE, 50.0) / line(
        response(LINEAR, SINE), SINE, 50.0
    )
    mode = 1.0 / (1.0 - 0.25 + 2j * 0.02 * 0.5)
    assert ratio == pytest.approx(0.3 + 0.7 * mode, abs=5e-3)
    settled = response(LINEAR, STEP, effects)[-500:]
    np.testing.assert_allclose(settled, 15.0, atol=1e-3)


@pytest.mark.parametrize(("tilt", "elements"), [(0.0, 0), (0.1, 0), (0.0, 3)])
def test_creep_between_one_and_ten_seconds_is_what_was_asked(tilt: float, elements: int) -> None:
    creep = Effects(creep_per_decade=0.02, creep_tilt=tilt, creep_elements=elements)
    y = response(LINEAR, STEP, creep)
    at = 6000 + np.array([500, 5000])
    assert np.diff(y[at])[0] == pytest.approx(0.02 * 15.0, rel=0.01)
    np.testing.assert_allclose(y[:6000], 0.0, atol=1e-9)


def test_backlash_is_a_dead_band_of_its_full_width() -> None:
    y = response(LINEAR, LOOP, Effects(dead_band_um=0.5))
    plain = response(LINEAR, LOOP)
    assert y[900] == pytest.approx(plain[900], abs=1e-6)
    assert y[1500] - plain[1500] == pytest.approx(0.5, abs=1e-6)
    assert y[1003] == y[1000]


def width(y: Floats, command: Command) -> float:
    """Opening of the first cycle at mid-range, um."""
    quarter = round(command.rate_hz / command.hz / 4.0)
    return float(y[3 * quarter] - y[quarter])


@pytest.mark.parametrize(
    "effects",
    [
        Effects(widen_V=3.0, widen_power=0.8, reference_V_per_s=800.0),
        Effects(widen_V=3.0, widen_power=0.0, reference_V_per_s=800.0),
        Effects(damping_um=0.5, reference_V_per_s=800.0),
    ],
)
def test_rate_dependence_widens_fast_loops_alone(effects: Effects) -> None:
    fast = Command(seconds=0.2, rate_hz=5000.0, hz=10.0)
    slow = replace(LOOP, seconds=10.0)
    more = width(response(REAL, fast, effects), fast) - width(response(REAL, fast), fast)
    less = width(response(REAL, slow, effects), slow) - width(response(REAL, slow), slow)
    assert more > 0.4 and abs(less) < (0.1 if effects.widen_power else 0.2) * more


def mirror(y: Floats) -> float:
    """By how much the first cycle is off its central mirror, um."""
    cycle = y[:2001]
    return float(np.abs(cycle[:1001] + cycle[1000:] - cycle[0] - cycle[1000]).max() / 2.0)


def off_masing(effects: Effects) -> float:
    """By how much a rise from mid-range deviates from the major one, um."""
    middle = replace(LOOP, u_min_V=10.0, u_max_V=30.0, hz=0.2)
    major = response(REAL, LOOP, effects)[:501]
    after_turn = response(REAL, middle, effects)[1000:1501]
    return float(np.abs(after_turn - after_turn[0] - (major - major[0])).max())


@pytest.mark.parametrize(
    "effects",
    [
        Effects(bow_um=0.6),
        Effects(exponential_um=0.6, exponential=2.0),
        Effects(elbow_um=0.6),
        Effects(density_odd=0.6),
    ],
)
def test_asymmetry_breaks_the_central_symmetry(effects: Effects) -> None:
    assert mirror(response(REAL, LOOP)) < 1e-5
    assert mirror(response(REAL, LOOP, effects)) > 0.3


@pytest.mark.parametrize(
    "effects",
    [
        Effects(density_even=0.6),
        Effects(density_core=1.0),
        Effects(bouc_wen=0.3),
        Effects(bouc_wen=1.0, bouc_wen_power=2.0, bouc_wen_gamma=0.5),
    ],
)
def test_non_masing_keeps_the_major_loop_symmetric_and_bends_minor_ones(effects: Effects) -> None:
    assert mirror(response(REAL, LOOP, effects)) < (1e-3 if effects.bouc_wen else 1e-5)
    assert off_masing(Effects()) < 1e-5
    assert off_masing(effects) > 0.1


def test_bouc_wen_keeps_stroke_and_loop_width() -> None:
    y = response(REAL, LOOP, Effects(bouc_wen=1.0))
    assert y[1000] - y[0] == pytest.approx(30.0, abs=1e-4)
    assert width(y, LOOP) == pytest.approx(0.13 * 30.0, rel=0.02)
    assert width(response(REAL, LOOP), LOOP) == pytest.approx(0.13 * 30.0, rel=0.02)


@pytest.mark.parametrize("physics", ["relays", "slides"])
@pytest.mark.parametrize(
    "shape", [{"loop_decay": 3.0}, {"loop_dead_zone": 0.2}, {"loop_heap": 2.0, "loop_decay": 0.0}]
)
def test_every_base_obeys_madelungs_rules(physics: str, shape: dict) -> None:
    stage = replace(REAL, physics=physics, **shape)
    major = simulate(stage, LOOP).y
    minor = simulate(stage, replace(LOOP, u_min_V=10.0, u_max_V=30.0, hz=0.2)).y
    assert major is not None and minor is not None
    branch = minor[1000:1501] - minor[1000]
    np.testing.assert_allclose(branch, major[:501] - major[0], atol=1e-5)
    assert mirror(major) < 1e-5


def test_initial_state_is_wiped_out_where_the_record_passes_the_peak() -> None:
    command = replace(LOOP, u_min_V=10.0)
    unknown = response(REAL, command, Effects(start_peak_V=30.0))
    gap = unknown - response(REAL, command)
    u = command.at(command.time_s)
    first_rise = np.arange(u.size) <= 1000
    assert gap[0] > 0.3 and np.all(np.abs(gap[first_rise & (u >= 30.1)]) < 1e-6)
    assert np.abs(gap[1001:]).max() < 1e-6


def test_sensor_effects() -> None:
    stage = replace(REAL, y_min_um=5.0)
    plain = response(stage, LOOP)
    t = LOOP.time_s
    scaled = response(stage, LOOP, Effects(gain=1.03, offset_um=0.2))
    np.testing.assert_allclose(scaled, 1.03 * (plain - 5.0) + 5.2, atol=1e-5)
    drift = response(stage, LOOP, Effects(drift_um_per_s=0.01, drift_um=0.3, drift_tau_s=4.0))
    np.testing.assert_allclose(drift - plain, 0.01 * t + 0.3 * (1.0 - np.exp(-t / 4.0)), atol=1e-5)
    swing = response(stage, LOOP, Effects(swing_um=0.2, swing_period_s=30.0, swing_phase=1.0))
    turn = 2.0 * np.pi * t / 30.0
    np.testing.assert_allclose(swing - plain, 0.2 * (np.sin(turn + 1) - np.sin(1)), atol=1e-5)
    hum = response(stage, LOOP, Effects(freq_hz=50.0, amp_um=0.1)) - plain
    assert abs(line(hum, LOOP, 50.0)) == pytest.approx(0.1, rel=1e-3)


def test_clock_skew_is_the_true_motion_at_another_time() -> None:
    command = replace(SINE, hz=1.0, rate_hz=500.0)
    skewed = response(LINEAR, command, Effects(skew_ppm=800.0))
    true = 0.75 * command.at(command.time_s * (1.0 + 800e-6))
    np.testing.assert_allclose(skewed, true, atol=1e-3)
    assert np.abs(skewed - response(LINEAR, command)).max() > 0.05


def test_stuck_bit_is_always_set() -> None:
    stage = replace(REAL, adc_bits=12)
    y = response(stage, LOOP, Effects(stuck_bit=4))
    codes = np.rint((y - stage.reading_um[0]) / stage.adc_step_um).astype(int)
    assert np.all(codes & 16)


def test_monitor_shows_the_drive(tmp_path: Path) -> None:
    make_case(
        tmp_path / "case",
        {"saturation": {"high_V": 30.0}},
        stage=REAL,
        every={"identify": LOOP, "train/loop": LOOP},
        monitor=True,
    )
    record = read_record(tmp_path / "case/train/loop.csv")
    assert record.u_meas_V is not None and record.u_V.max() == 40.0
    np.testing.assert_allclose(record.u_meas_V, np.minimum(record.u_V, 30.0), atol=1e-3)


NOISY = replace(REAL, noise_um=0.008, adc_bits=12, dac_bits=12, headroom_share=0.6)
SMALL = {
    "identify": LOOP,
    "train/bias": Command(Waveform.SINES, 6.0, 200.0, 12.0, 30.0, lines_hz=(0.4, 1.1)),
    "train/fast": Command(Waveform.MULTISINE, 2.0, 2000.0, hz=0.5, band_hz=(1.0, 80.0)),
    "train/steps": Command(Waveform.STEPS, 6.0, 500.0, rise_s=0.004, u_min_V=4.0, u_max_V=36.0),
}


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("cases") / "plain"
    make_case(path, None, stage=NOISY, every=SMALL)
    return path


@pytest.fixture(scope="module")
def nothing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("cases") / "nothing"
    make_case(path, None, seed=2, campaign="short")
    return path


@pytest.mark.parametrize("name", list(EFFECTS))
def test_each_effect_changes_training_records_and_acts_when_the_contract_says(
    name: str, plain: Path, tmp_path: Path
) -> None:
    sizes = []
    for strength in (1.0, 0.1):
        case = tmp_path / f"{strength}"
        labels = make_case(case, {name: strength}, stage=NOISY, every=SMALL)
        sizes.append(max(v for k, v in labels["deviation_um"].items() if "train" in k))
        same = (case / "identify.csv").read_bytes() == (plain / "identify.csv").read_bytes()
        assert same or name not in LATE
        for path in case.glob("train/*.csv"):
            untouched = read_record(plain / path.relative_to(case))
            np.testing.assert_array_equal(read_record(path).u_V, untouched.u_V)
    assert sizes[0] > labels["noise_um"]
    assert sizes[1] < 0.7 * sizes[0]
    wanted = "effects" if name in VOCABULARY else "outside"
    assert labels[wanted] == [name] and labels["parameters"][name]


def test_records_of_a_case_reach_both_ends_and_keep_the_contract(nothing: Path) -> None:
    case = json.loads((nothing / "case.json").read_text())
    identify = read_record(nothing / "identify.csv")
    assert (identify.u_V.min(), identify.u_V.max()) == (case["u_min_V"], case["u_max_V"])
    assert len(list(nothing.glob("train/*.csv"))) == 5
    assert len(list(nothing.glob("holdout/*.csv"))) == 3
    assert all(read_record(p).t_s.size >= 1000 for p in nothing.rglob("*.csv"))
    assert {p.suffix for p in nothing.rglob("*.*")} == {".csv", ".json"}


@pytest.mark.parametrize("campaign", [Campaign.SLOW, Campaign.SINE])
def test_poor_campaigns(campaign: Campaign, tmp_path: Path) -> None:
    labels = make_case(tmp_path / "case", {"delay": 1.0}, campaign=campaign)
    assert 2 <= len(labels["deviation_um"]) - 1 <= 4


def test_pairs_act_together_and_are_reproducible(tmp_path: Path) -> None:
    effects = {"creep": {"creep_per_decade": 0.02}, "delay": 0.25}
    one, two = (
        make_case(tmp_path / name, effects, seed=7, campaign="short") for name in ("one", "two")
    )
    assert one == two and one["effects"] == ["creep", "delay"]
    assert one["parameters"]["creep"] == {"creep_per_decade": 0.02}
    for path in (tmp_path / "one").rglob("*.csv"):
        other = tmp_path / "two" / path.relative_to(tmp_path / "one")
        assert path.read_bytes() == other.read_bytes()


@pytest.mark.parametrize("effects", [{"cree": 1.0}, {"creep": 0.0}, {"creep": {"delay_s": 1.0}}])
def test_bad_effects_leave_no_case(effects: dict, tmp_path: Path) -> None:
    with pytest.raises(InputError):
        make_case(tmp_path / "case", effects)
    assert list(tmp_path.iterdir()) == []


def test_a_case_is_never_overwritten(nothing: Path) -> None:
    with pytest.raises(InputError, match="exists already"):
        make_case(nothing)


def test_vocabulary_and_outside_do_not_overlap() -> None:
    assert len(VOCABULARY) == 15 and not VOCABULARY.keys() & OUTSIDE.keys()


def test_sealed_labels_open_with_their_key_alone(tmp_path: Path) -> None:
    path = tmp_path / "case.sealed.json"
    key, commitment = seal({"effects": ["creep"]}, path)
    assert "creep" not in path.read_text() and commitment in path.read_text()
    assert unseal(path, key) == {"effects": ["creep"]}
    other_key, _ = seal({"effects": ["delay"]}, tmp_path / "other.json")
    for wrong in (other_key, "nonsense"):
        with pytest.raises(InputError, match="key does not open"):
            unseal(path, wrong)
    path.write_text(path.read_text().replace(commitment, "0" * 64))
    with pytest.raises(InputError, match="committed"):
        unseal(path, key)


def run(*told: str) -> str:
    result = CliRunner().invoke(app, ["simulate", *told])
    if result.exception is not None:
        raise result.exception
    return result.output


def test_a_key_is_never_taken_for_an_option(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keys = [b"-" + 42 * b"A" + b"=", Fernet.generate_key()]
    while keys[1].startswith(b"-"):
        keys[1] = Fernet.generate_key()
    drawn = iter(keys)
    monkeypatch.setattr(Fernet, "generate_key", lambda: next(drawn))
    key, _ = seal({"effects": []}, tmp_path / "sealed.json")
    assert key == keys[1].decode()


def test_command_writes_a_sealed_case(tmp_path: Path) -> None:
    case = tmp_path / "trial"
    said = run("--case", str(case), "--campaign", "sine", "--effect", "random", "--seal")
    key = said.split("key, kept nowhere else:")[1].strip()
    labels = unseal(tmp_path / "trial.sealed.json", key)
    assert len(labels["effects"]) == 1 and labels["effects"][0] in VOCABULARY
    assert sorted(p.name for p in tmp_path.iterdir()) == ["trial", "trial.sealed.json"]
    assert CliRunner().invoke(app, ["unseal", f"{case}.sealed.json", key]).exit_code == 0


def test_command_draws_as_many_as_asked(tmp_path: Path) -> None:
    told = ["--campaign", "sine", "--effect", "creep", "--effect", "random", "--strength", "0.5"]
    run("--case", str(tmp_path / "a"), *told, "--seed", "3", "--noise-ar", "0.9")
    labels = json.loads((tmp_path / "a.labels.json").read_text())
    assert len(labels["effects"]) == 2 and "creep" in labels["effects"]
    run("--case", str(tmp_path / "b"), "--campaign", "sine", "--effect", "none")
    assert json.loads((tmp_path / "b.labels.json").read_text())["effects"] == []


def test_command_simulates_an_effect_in_one_record(tmp_path: Path) -> None:
    told = ["--waveform", "steps", "--rate", "2000", "--effect", "resonance", "--seed", "1"]
    assert "fn_hz" in run(*told, "-o", str(tmp_path / "ring.csv"))
    assert np.ptp(read_record(tmp_path / "ring.csv").y) > 25.0


@pytest.mark.parametrize("waveform", ["multisine", "steps", "decaying"])
def test_command_writes_the_next_experiment(waveform: str, tmp_path: Path) -> None:
    wanted = {"waveform": waveform, "seconds": 20.0, "rate_hz": 500.0, "why": "it tells them apart"}
    wanted |= {"u_min_V": 2.0, "u_max_V": 30.0, "f_low_hz": 0.2, "f_high_hz": 25.0}
    diagnosis = tmp_path / "diagnosis.json"
    diagnosis.write_text(json.dumps({"next_experiment": wanted}))
    run("--from", str(diagnosis), "-o", str(tmp_path / "next.csv"))
    record = read_record(tmp_path / "next.csv")
    assert record.y is None and record.t_s.size == 10000
    assert 2.0 <= record.u_V.min() < 3.0 and 29.0 < record.u_V.max() <= 30.0


@pytest.mark.parametrize("text", ["", "{}", '{"next_experiment": null}'])
def test_command_needs_a_next_experiment(text: str, tmp_path: Path) -> None:
    (diagnosis := tmp_path / "diagnosis.json").write_text(text)
    with pytest.raises(InputError, match=r"no next experiment|not a JSON file"):
        run("--from", str(diagnosis), "-o", str(tmp_path / "next.csv"))


@pytest.mark.parametrize(
    "told",
    [
        [],
        ["--case", "x", "-o", "y"],
        ["--case", "x", "--rate", "100"],
        ["--case", "x", "--effect", "none", "--effect", "creep"],
        ["--case", "x", "--effect", "creep", "--effect", "creep"],
        ["-o", "y", "--seal"],
        ["--from", "missing.json", "-o", "y"],
        ["--from", "missing.json", "--case", "x"],
    ],
)
def test_command_refuses_what_does_not_fit(
    told: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError):
        run(*told)
    assert list(tmp_path.iterdir()) == []
