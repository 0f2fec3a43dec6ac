"""`madelung diagnose` from a case folder to OUT: verdicts, options, what it leaves alone."""

import codecs
import json
import os
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from diagnose_cases import (
    STAGE,
    change,
    commands,
    content,
    cut,
    named,
    parameters,
    run,
    tell,
    written,
)

from madelung.blocks import Block
from madelung.campaigns import Commands
from madelung.diagnosis.case import load_case
from madelung.diagnosis.vocabulary import EFFECTS
from madelung.errors import InputError
from madelung.model import Model, load_model
from madelung.predict import predict
from madelung.records import read_record
from madelung.waveforms import Command, Waveform

SCHEMA = Path(__file__).parents[3] / "shared" / "contracts" / "diagnosis.schema.json"
FILES = (
    "diagnosis.json",
    "report.html",
    "model_baseline.json",
    "model_augmented.json",
    "firmware/mdl_params.h",
    "firmware/mdl_params.c",
    "holdout/multisine.csv",
    "holdout/steps.csv",
)

Diagnosis = dict[str, Any]


@pytest.fixture(scope="module")
def patch() -> Iterator[pytest.MonkeyPatch]:
    with pytest.MonkeyPatch.context() as patched:
        yield patched


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("diagnose")


@pytest.fixture(scope="module")
def labels(folder: Path) -> Diagnosis:
    """Of the case with creep, which most tests look at."""
    return written(folder / "creep", "creep")


@pytest.fixture(scope="module")
def found(patch: pytest.MonkeyPatch, folder: Path, labels: Diagnosis) -> Diagnosis:
    return run(patch, folder / "creep", folder / "out", "--jobs", "2")


@pytest.fixture(scope="module")
def quiet(folder: Path) -> Path:
    """A case with nothing to find."""
    written(folder / "quiet")
    return folder / "quiet"


def few(*names: str) -> Commands:
    """Some of the small case's records, and identify."""
    return {k: v for k, v in commands().items() if k in ("identify", *names)}


def copy(case: Path, folder: Path) -> Path:
    return Path(shutil.copytree(case, folder / "case"))


# -- what comes back ----------------------------------------------------------------------------


def test_the_cause_is_named_with_its_size(found: Diagnosis, labels: Diagnosis) -> None:
    assert found["verdict"]["status"] == "identified"
    assert found["verdict"]["effects"] == ["creep"]
    true = labels["parameters"]["creep"]["creep_per_decade"]
    assert parameters(found, "creep")["creep_per_decade"] == pytest.approx(true, rel=0.05)
    assert found["shrink"]["closable_closed"] > 0.98
    assert found["gap"]["noise_floor_um"] == pytest.approx(STAGE.noise_um, rel=0.4)


def test_parameters_are_those_of_the_accepted_hypothesis(found: Diagnosis) -> None:
    effects = found["verdict"]["effects"]
    first = found["ranking"][: len(effects)]
    assert {entry["effect"] for entry in first} == set(effects)
    assert all(entry["effects"] == effects for entry in first)


def test_the_schema_of_the_contract(found: Diagnosis) -> None:
    import jsonschema

    if not SCHEMA.exists():
        pytest.skip(f"no schema at {SCHEMA}")
    schema = json.loads(SCHEMA.read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.Draft202012Validator(schema).validate(found)
    assert {e["effect"] for e in found["ranking"]} <= set(EFFECTS)
    for entry in found["ranking"]:
        for key, p in entry["parameters"].items():
            assert p["ci95"][0] <= p["value"] <= p["ci95"][1], (entry["effect"], key)


def test_every_file_of_the_contract_is_there(found: Diagnosis, folder: Path) -> None:
    for name in FILES:
        assert (folder / "out" / name).stat().st_size > 0, name
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    assert "<html" in page and "creep" in page
    assert 'src="http' not in page and 'href="http' not in page


def test_holdout_predictions_have_every_row(found: Diagnosis, folder: Path) -> None:
    for name in ("multisine", "steps"):
        told = pd.read_csv(folder / "creep" / "holdout" / f"{name}.csv")
        made = pd.read_csv(folder / "out" / "holdout" / f"{name}.csv")
        assert list(made) == ["t_s", "u_V", "y_um", "baseline_um", "augmented_um"]
        assert len(made) == len(told) and np.isfinite(made.to_numpy()).all()
        np.testing.assert_allclose(made[["t_s", "u_V", "y_um"]], told, atol=1e-6)
        score = next(r for r in found["shrink"]["records"] if r["name"] == name)
        for column, key in (("baseline_um", "rms_before_um"), ("augmented_um", "rms_after_um")):
            error = made["y_um"] - made[column]
            assert np.sqrt(np.mean(error**2)) == pytest.approx(score[key], rel=1e-3)


def test_the_models_give_the_predictions(found: Diagnosis, folder: Path) -> None:
    record = read_record(folder / "creep" / "holdout" / "steps.csv")
    made = pd.read_csv(folder / "out" / "holdout" / "steps.csv")
    for name, column in (("baseline", "baseline_um"), ("augmented", "augmented_um")):
        model = load_model(folder / "out" / f"model_{name}.json")
        again = predict(model, record, "float64").predicted
        np.testing.assert_allclose(again, made[column], atol=0.3 * STAGE.noise_um)


def test_the_same_seed_gives_the_same_bytes_whatever_the_jobs(
    found: Diagnosis, folder: Path, patch: pytest.MonkeyPatch
) -> None:
    files = [folder / "out" / n for n in FILES if n != "report.html"]
    before = [f.read_bytes() for f in files]
    run(patch, folder / "creep", folder / "out", "--jobs", "1", "--seed", "0")
    assert [f.read_bytes() for f in files] == before


def test_noise_in_place_of_the_holdouts_y_changes_the_score_alone(
    found: Diagnosis, folder: Path, patch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    case = copy(folder / "creep", tmp_path)
    rng = np.random.default_rng(1)
    for path in (case / "holdout").iterdir():
        change(path, y_um=lambda f: rng.normal(10.0, 5.0, len(f)).round(6))
    noise = run(patch, case, tmp_path / "out")
    own = {"shrink", "command", "warnings", "data_faults"}
    assert {k: v for k, v in noise.items() if k not in own} == {
        k: v for k, v in found.items() if k not in own
    }
    assert noise["shrink"]["rms_after_um"] > 100 * found["shrink"]["rms_after_um"]
    for name in ("multisine", "steps"):
        a, b = (
            pd.read_csv(f / "holdout" / f"{name}.csv") for f in (folder / "out", tmp_path / "out")
        )
        columns = ["t_s", "u_V", "baseline_um", "augmented_um"]
        pd.testing.assert_frame_equal(a[columns], b[columns], check_exact=True)
    for name in ("model_baseline.json", "model_augmented.json"):
        assert (tmp_path / "out" / name).read_bytes() == (folder / "out" / name).read_bytes()


# -- verdicts -----------------------------------------------------------------------------------


def test_nothing_to_find(quiet: Path) -> None:
    found = content(quiet)
    assert found["verdict"]["status"] == "no_gap"
    assert named(found) == set()
    assert found["shrink"]["closable_closed"] is None
    assert any("detectable" in w for w in found["warnings"])


def test_coloured_noise_is_no_cause(tmp_path: Path) -> None:
    every = commands() | {"identify": Command(hz=0.1, seconds=60.0)}
    written(tmp_path / "case", noise_um=0.02, noise_ar=0.9, every=every)
    found = content(tmp_path / "case")
    assert found["verdict"]["status"] == "no_gap"
    assert found["gap"]["noise_floor_um"] == pytest.approx(0.02, rel=0.25)


@pytest.mark.parametrize(("ar", "seed"), [(0.95, 2), (0.98, 5)])
def test_a_short_slow_loop_in_coloured_noise_makes_no_cause(
    ar: float, seed: int, tmp_path: Path
) -> None:
    """The loop's few cycles show less of f0's bend than the train records do."""
    written(tmp_path / "case", noise_um=0.02, noise_ar=ar, seed=seed)
    found = content(tmp_path / "case")
    assert found["verdict"]["status"] == "no_gap", found["ranking"]


def test_what_the_vocabulary_lacks_is_unknown(tmp_path: Path) -> None:
    written(tmp_path / "case", "impulses", every=few("train/decaying", "holdout/steps"))
    found = content(tmp_path / "case")
    assert found["verdict"]["status"] == "unknown"
    assert found["verdict"]["effects"] == []
    assert found["verdict"]["remainder_share"] > 0.05
    assert found["next_experiment"]["waveform"] == "multisine"


@pytest.mark.parametrize(
    ("outside", "said"),
    [("fading_gain", "the sensor's gain moves in time"), ("self_heating", "")],
)
def test_a_disturbance_without_a_name_is_not_given_another(
    outside: str, said: str, tmp_path: Path
) -> None:
    """Drift and gain explain most of either; not as much as what acts."""
    written(tmp_path / "case", outside)
    found = content(tmp_path / "case")
    assert found["verdict"]["status"] == "unknown"
    assert found["verdict"]["effects"] == []
    assert found["verdict"]["remainder_share"] > 0.05
    assert said in " ".join(found["warnings"])


@pytest.mark.parametrize(
    ("effects", "proven"), [(["jitter"], []), (["jitter", "creep"], ["creep"])]
)
def test_beside_what_has_no_name_only_what_explains_much_is_proven(
    effects: list[str], proven: list[str], tmp_path: Path
) -> None:
    """A part of any disturbance that is no noise looks like some effect."""
    written(tmp_path / "case", *effects, seed=77)
    verdict = content(tmp_path / "case")["verdict"]
    assert verdict["status"] == "unknown"
    assert verdict["candidates"] == proven


def test_an_effect_that_is_ruled_out_is_not_named_and_no_other_for_it(tmp_path: Path) -> None:
    written(tmp_path / "case", "delay")
    tell(tmp_path / "case", exclude=["delay"])
    found = content(tmp_path / "case")
    assert found["verdict"]["status"] == "unknown"
    assert named(found) == set()
    assert any("explained better" in w and "delay" in w for w in found["warnings"])
    assert "delay" not in {e["effect"] for e in found["ranking"]}


def test_range_below_zero_and_starts_at_a_bias(tmp_path: Path) -> None:
    stage = replace(STAGE, u_min_V=-20.0, u_max_V=130.0, y_min_um=2.0)
    every = {k: v for k, v in commands(stage).items() if k != "train/decaying"}
    made = written(tmp_path / "case", "gain_offset", stage=stage, every=every)
    found = content(tmp_path / "case")
    assert found["verdict"]["effects"] == ["gain_offset"]
    for key, value in made["parameters"]["gain_offset"].items():
        assert parameters(found, "gain_offset")[key] == pytest.approx(value, rel=0.05), key


def test_short_records(tmp_path: Path) -> None:
    names = ("train/decaying", "train/multisine", "holdout/multisine")
    every = {
        k: v if k == "identify" else replace(v, seconds=v.seconds / 4)
        for k, v in few(*names).items()
    }
    written(tmp_path / "case", "gain_offset", every=every)
    found = content(tmp_path / "case")
    assert "gain_offset" in named(found) and len(found["verdict"]["candidates"]) <= 4


def test_a_single_sine_keeps_the_truth_among_the_candidates(tmp_path: Path) -> None:
    sine = Command(Waveform.SINE, 4.0, 250.0, 8.0, 32.0, hz=3.0)
    every = few() | {"train/sine": sine, "holdout/sine": replace(sine, hz=2.0)}
    written(tmp_path / "case", "delay", every=every)
    found = content(tmp_path / "case")
    verdict = found["verdict"]
    assert verdict["status"] in ("identified", "ambiguous")
    assert "delay" in named(found) and len(verdict["candidates"]) <= 4
    if verdict["status"] == "ambiguous":
        assert found["next_experiment"]["rate_hz"] > 0.0


def test_slow_records_cannot_show_a_delay(tmp_path: Path) -> None:
    every = few("train/bias", "train/decaying", "holdout/steps")
    written(tmp_path / "case", effects={"delay": {"delay_s": 1e-5}}, every=every)
    found = content(tmp_path / "case")
    assert found["verdict"]["status"] == "no_gap"
    assert found["detectable"]["delay"] > 1e-5


# -- options of the command and of case.json ----------------------------------------------------


def test_check_fits_nothing(
    folder: Path, labels: Diagnosis, patch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    found = run(patch, folder / "creep", tmp_path / "out", "--check")
    assert found["ranking"] == [] and found["verdict"]["effects"] == []
    assert found["checked"] and found["next_experiment"] is None
    sizes = found["detectable"]
    assert set(sizes) == set(EFFECTS)
    for effect in ("delay", "backlash", "gain_offset", "clock_skew"):
        assert sizes[effect] > 0.0, effect
    assert sizes["backlash"] < 0.02 * STAGE.stroke_um


def test_sizes_that_can_be_seen_do_not_depend_on_where_the_range_lies(
    quiet: Path, tmp_path: Path
) -> None:
    below = replace(STAGE, u_min_V=-60.0, u_max_V=-20.0)
    written(tmp_path / "case", stage=below, every=commands(below))
    here, there = (content(c, check=True)["detectable"] for c in (quiet, tmp_path / "case"))
    assert set(here) == set(EFFECTS)
    for effect, size in here.items():
        assert there[effect] == pytest.approx(size, rel=0.05), effect


@pytest.mark.parametrize(("share", "named_effects"), [(0.4, set()), (2.5, {"backlash"})])
def test_a_size_that_can_be_seen_is_seen(
    share: float, named_effects: set[str], quiet: Path, tmp_path: Path
) -> None:
    size = content(quiet, check=True)["detectable"]["backlash"]
    written(tmp_path / "case", effects={"backlash": {"dead_band_um": share * size}})
    assert named(content(tmp_path / "case")) == named_effects


def test_more_rows_make_smaller_effects_detectable(quiet: Path, tmp_path: Path) -> None:
    case = copy(quiet, tmp_path)
    for name in ("bias", "decaying", "steps"):
        (case / "train" / f"{name}.csv").unlink()
    one, all_of_them = (content(c, check=True)["detectable"] for c in (case, quiet))
    for effect in ("asymmetry", "gain_offset", "creep", "clock_skew"):
        assert all_of_them[effect] < one[effect], effect


def test_model_is_diagnosed_as_flashed(
    folder: Path, found: Diagnosis, patch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    own = load_model(folder / "out" / "model_baseline.json")
    flashed = Model("madelung", own.u_min_V, own.u_max_V, f0=tuple(1.1 * c for c in own.f0))
    flashed.save(tmp_path / "model.json")
    made = run(
        patch,
        folder / "creep",
        tmp_path / "out",
        "--model",
        str(tmp_path / "model.json"),
        "--check",
    )
    np.testing.assert_allclose(
        load_model(tmp_path / "out" / "model_baseline.json").f0[: len(own.f0)], flashed.f0
    )
    assert made["gap"]["rms_um"] > 0.04 * STAGE.stroke_um > found["gap"]["rms_um"]


def test_the_blocks_of_a_flashed_model_act_in_its_diagnosis(
    folder: Path, found: Diagnosis, patch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    mended = folder / "out" / "model_augmented.json"
    made = run(patch, folder / "creep", tmp_path / "out", "--model", str(mended))
    assert made["verdict"]["status"] == "no_gap"
    assert made["gap"]["rms_um"] < 0.1 * found["gap"]["rms_um"]
    again, flashed = (load_model(p) for p in (tmp_path / "out" / "model_baseline.json", mended))
    assert [b.parameters for b in again.blocks] == [b.parameters for b in flashed.blocks] != []


def test_an_effect_that_is_found_takes_the_place_of_the_flashed_block(
    folder: Path, patch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    mended = load_model(folder / "out" / "model_augmented.json")
    (creep,) = mended.blocks
    weaker = [m | {"gain": 0.6 * m["gain"]} for m in creep.parameters["modes"]]
    replace(mended, blocks=(replace(creep, parameters={"modes": weaker}),)).save(tmp_path / "m")
    made = run(patch, folder / "creep", tmp_path / "out", "--model", str(tmp_path / "m"))
    assert made["verdict"]["effects"] == ["creep"]
    (told,) = load_model(tmp_path / "out" / "model_augmented.json").blocks
    gains = [sum(m["gain"] for m in b.parameters["modes"]) for b in (told, creep)]
    assert gains[0] == pytest.approx(gains[1], rel=0.05)


def test_a_calibration_joins_the_one_that_was_flashed(
    quiet: Path, patch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    run(patch, quiet, tmp_path / "plain", "--check")
    own = load_model(tmp_path / "plain" / "model_baseline.json")
    wrong = Block("gain_offset", "", {"gain": 1.2, "offset_um": 0.5})
    replace(own, kind="augmented", blocks=(wrong,)).save(tmp_path / "m")
    made = run(patch, quiet, tmp_path / "out", "--model", str(tmp_path / "m"))
    assert made["verdict"]["effects"] == ["gain_offset"]
    (left,) = load_model(tmp_path / "out" / "model_augmented.json").blocks
    assert left.parameters["gain"] == pytest.approx(1.0, abs=0.002)
    assert left.parameters["offset_um"] == pytest.approx(0.0, abs=0.01)


def test_a_start_that_is_not_taken_from_the_flashed_model_is_said(
    quiet: Path, patch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    start = Block("initial_state", "", {"start_peak_V": 0.5 * STAGE.u_max_V})
    f0 = (0.0, 1.0, 0.0, 0.0)
    Model("augmented", STAGE.u_min_V, STAGE.u_max_V, f0=f0, blocks=(start,)).save(tmp_path / "m")
    made = run(patch, quiet, tmp_path / "out", "--model", str(tmp_path / "m"), "--check")
    assert any("initial_state is left out" in w for w in made["warnings"])


def test_a_flashed_model_in_another_unit_is_warned_of(
    quiet: Path, patch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    f0 = (0.0, 1e-3 * STAGE.stroke_um / STAGE.range_V)
    Model("madelung", STAGE.u_min_V, STAGE.u_max_V, f0=f0).save(tmp_path / "m")
    made = run(patch, quiet, tmp_path / "out", "--model", str(tmp_path / "m"), "--check")
    (said,) = [w for w in made["warnings"] if "check the unit" in w]
    assert "identify.csv: y moves 1000 times as far as the model says" in said


def test_tolerance_stops_when_good_enough(folder: Path, found: Diagnosis) -> None:
    percent = found["gap"]["percent_of_stroke"]
    enough = content(folder / "creep", tolerance_percent=1.1 * percent)
    assert enough["verdict"]["effects"] == [] and enough["ranking"] == []
    assert enough["gap"] == found["gap"]
    assert enough["good_enough_below_percent"] == 1.1 * percent
    # Nothing was looked for: no claim of what could not be seen, no excitation that is missing.
    assert enough["next_experiment"] is None and enough["warnings"] == found["warnings"]
    assert found["good_enough_below_percent"] is None


def test_the_monitor_settles_the_input_box(tmp_path: Path) -> None:
    every = few("train/decaying", "train/multisine", "holdout/multisine")
    made = written(tmp_path / "case", "amplifier_lag", monitor=True, every=every)
    found = content(tmp_path / "case")
    assert "amplifier_lag" in found["verdict"]["effects"]
    assert not {"saturation", "slew_limit"} & named(found)
    true = made["parameters"]["amplifier_lag"]["corner_hz"]
    assert parameters(found, "amplifier_lag")["corner_hz"] == pytest.approx(true, rel=0.03)


def test_the_monitor_settles_a_delay_of_the_drive(tmp_path: Path) -> None:
    """Not as the lag that it may be taken for where a delay is not thought of."""
    late_s = written(tmp_path / "case", "delay")["parameters"]["delay"]["delay_s"]
    for path in (tmp_path / "case").rglob("*.csv"):
        change(path, u_meas_V=lambda f: np.interp(f["t_s"] - late_s, f["t_s"], f["u_V"]))
    found = content(tmp_path / "case")
    assert named(found) == {"delay"}


def test_what_is_excluded_is_not_named_as_another_by_the_monitor(tmp_path: Path) -> None:
    written(tmp_path / "case", "amplifier_lag", monitor=True)
    tell(tmp_path / "case", exclude=["amplifier_lag"])
    found = content(tmp_path / "case")
    assert found["verdict"]["status"] == "unknown"
    assert found["verdict"]["effects"] == []


@pytest.mark.parametrize("kind", ["noise", "zero", "copy"])
def test_a_monitor_that_measures_something_else_is_left_out(kind: str, tmp_path: Path) -> None:
    written(tmp_path / "case", "saturation", every=few("train/decaying", "holdout/steps"))
    rng = np.random.default_rng(3)
    for path in (tmp_path / "case").rglob("*.csv"):
        made = {
            "noise": lambda f: 10.0 * rng.standard_normal(len(f)),
            "zero": lambda f: np.zeros(len(f)),
            "copy": lambda f: f["u_V"],
        }
        change(path, u_meas_V=made[kind])
    found = content(tmp_path / "case")
    assert named(found) == {"saturation"}
    assert any("u_meas_V" in w and "left out" in w for w in found["warnings"])


def test_a_sound_monitor_clears_the_amplifier(tmp_path: Path) -> None:
    every = few("train/decaying", "train/multisine", "holdout/multisine")
    written(tmp_path / "case", "gain_offset", monitor=True, every=every)
    found = content(tmp_path / "case")
    assert found["verdict"]["effects"] == ["gain_offset"]
    assert not {"saturation", "slew_limit", "amplifier_lag"} & set(found["detectable"])


def test_running_records_may_begin_in_mid_motion(quiet: Path, tmp_path: Path) -> None:
    case = copy(quiet, tmp_path)
    cut(case / "train" / "bias.csv", 0.8)
    assert content(case, check=True)["gap"]["max_um"] > 10 * STAGE.noise_um
    tell(case, running=["bias.csv"])
    found = content(case)
    assert found["verdict"]["status"] == "no_gap"
    assert found["gap"]["rms_um"] < 1.3 * STAGE.noise_um


def test_known_parameters_that_the_records_contradict_are_told(tmp_path: Path) -> None:
    every = few("train/decaying", "train/multisine", "holdout/multisine")
    made = written(tmp_path / "case", "gain_offset", every=every)
    right = made["parameters"]["gain_offset"]["gain"]
    tell(tmp_path / "case", known={"gain": 2.0 * right - 1.0})
    found = content(tmp_path / "case")
    assert parameters(found, "gain_offset")["gain"] == pytest.approx(2.0 * right - 1.0)
    (said,) = [w for w in found["warnings"] if "contradicted" in w]
    assert said.startswith("gain = ")
    assert float(said.rsplit(" ", 1)[1]) == pytest.approx(right, abs=0.1 * abs(right - 1.0))


def test_known_parameters_are_kept_and_excluded_effects_are_not_tried(tmp_path: Path) -> None:
    every = few("train/decaying", "train/multisine", "holdout/multisine")
    made = written(tmp_path / "case", "gain_offset", every=every)
    told = made["parameters"]["gain_offset"]
    tell(tmp_path / "case", known=told, exclude=["creep"])
    found = content(tmp_path / "case")
    assert named(found) == {"gain_offset"}
    assert parameters(found, "gain_offset")["gain"] == told["gain"]
    assert parameters(found, "gain_offset")["offset_um"] == pytest.approx(
        told["offset_um"], abs=1e-3
    )
    assert found["shrink"]["closable_closed"] > 0.99
    assert not any("contradicted" in w for w in found["warnings"])
    assert not {"gain_offset", "creep"} & set(found["detectable"])


@pytest.mark.parametrize("effect", ["delay", "clock_skew", "saturation"])
def test_what_is_known_to_the_last_digit_calls_for_no_second_cause(
    tmp_path: Path, effect: str
) -> None:
    """Of its laws the records' own is taken: what another would leave looks like an effect."""
    made = written(tmp_path / "case", effect)
    told = made["parameters"][effect]
    known = {k: v for k, v in told.items() if k in EFFECTS[effect].keys}
    tell(tmp_path / "case", known={"knee_V": 0.0} | known if effect == "saturation" else known)
    found = content(tmp_path / "case")
    assert named(found) == {effect}
    assert found["shrink"]["closable_closed"] > 0.95
    assert not any("contradicted" in w for w in found["warnings"])


def test_long_records_are_searched_in_steps_and_fitted_to_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As if a tenth of the rows were enough to search, and a third to go on."""
    labels = written(tmp_path / "case", "backlash")
    whole = content(tmp_path / "case")
    for limit, rows in (("SEARCH_ROWS", 1200), ("FURTHER_ROWS", 3000)):
        monkeypatch.setattr(f"madelung.diagnosis.diagnose.{limit}", rows)
    stepwise = content(tmp_path / "case")
    assert named(stepwise) == named(whole) == {"backlash"}
    told = labels["parameters"]["backlash"]["dead_band_um"]
    assert parameters(stepwise, "backlash")["dead_band_um"] == pytest.approx(told, rel=0.05)


def test_results_are_not_written_over_the_case(
    quiet: Path, patch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case = copy(quiet, tmp_path)
    before = {p: p.read_bytes() for p in case.rglob("*") if p.is_file()}
    for out in (case, case / "train", case / "holdout"):
        with pytest.raises(SystemExit) as end:
            run(patch, case, out, "--check")
        assert end.value.code == 2 and "holds the case's records" in capsys.readouterr().err
    assert {p: p.read_bytes() for p in case.rglob("*") if p.is_file()} == before


def test_results_take_the_place_of_earlier_ones_and_of_nothing_else(
    quiet: Path, patch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case, out = copy(quiet, tmp_path), tmp_path / "out"
    run(patch, case, out, "--check")
    (out / "notes.txt").write_text("mine")
    was = sorted(p.stem for p in (out / "holdout").iterdir())
    (case / "holdout" / f"{was[0]}.csv").rename(case / "holdout" / "other.csv")
    run(patch, case, out, "--check")
    assert sorted(p.stem for p in (out / "holdout").iterdir()) == sorted([*was[1:], "other"])
    assert (out / "notes.txt").read_text() == "mine"
    (out / "diagnosis.json").unlink()
    with pytest.raises(SystemExit) as end:
        run(patch, case, out, "--check")
    assert end.value.code == 2 and "of no diagnosis" in capsys.readouterr().err


def test_what_a_killed_run_left_is_removed_and_nothing_else(
    quiet: Path, patch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    names = (".out.madelung-stale", ".out.madelung-young", ".out.mine", ".other.madelung-old")
    for name in names:
        (tmp_path / name).mkdir()
        (tmp_path / name / "diagnosis.json").touch()
        if "young" not in name:
            os.utime(tmp_path / name, (0, 0))
    run(patch, copy(quiet, tmp_path), tmp_path / "out", "--check")
    assert {p.name for p in tmp_path.iterdir()} == {"case", "out", *names[1:]}


def test_model_of_another_range_is_refused(
    quiet: Path, patch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "model.json"
    Model("madelung", STAGE.u_min_V, 2.0 * STAGE.u_max_V, f0=(0.0, 1.0, 0.0, 0.0)).save(model)
    with pytest.raises(SystemExit) as end:
        run(patch, quiet, tmp_path / "out", "--model", str(model))
    said = capsys.readouterr().err
    assert end.value.code == 2 and str(model) in said and "the case of" in said


def test_a_record_in_both_folders_and_a_byte_order_mark(quiet: Path, tmp_path: Path) -> None:
    case = copy(quiet, tmp_path)
    head = (case / "case.json").read_bytes()
    (case / "case.json").write_bytes(codecs.BOM_UTF8 + head)
    name = sorted((case / "train").iterdir())[0].name
    shutil.copy(case / "train" / name, case / "holdout" / "again.csv")
    stem = Path(name).stem
    assert f"holdout/again is train/{stem} again: its score proves nothing" in (
        load_case(case).warnings
    )


def test_records_that_leave_the_identified_range_are_named(quiet: Path, tmp_path: Path) -> None:
    case = copy(quiet, tmp_path)
    assert not [w for w in content(case, check=True)["warnings"] if "extrapolated" in w]
    wider = 1.08 * STAGE.u_max_V
    for name in ("train/decaying.csv", "holdout/multisine.csv"):
        frame = pd.read_csv(case / name)
        frame.loc[100:139, "u_V"] = wider
        frame.to_csv(case / name, index=False)
    said = [w for w in content(case, check=True)["warnings"] if "extrapolated" in w]
    assert [w.split(" leaves ")[0] for w in said] == ["decaying (train)", "multisine (holdout)"]
    assert all("on 40 rows" in w for w in said)


def test_a_suffix_in_capitals_is_read(quiet: Path, tmp_path: Path) -> None:
    case = copy(quiet, tmp_path)
    for path in [*case.glob("train/*.csv")]:
        path.rename(path.with_suffix(".CSV"))
    assert len(load_case(case).train) == len([*case.glob("train/*.CSV")])


def test_hidden_files_are_no_records(quiet: Path, tmp_path: Path) -> None:
    case = copy(quiet, tmp_path)
    (case / "train" / "._steps.csv").write_bytes(b"\0\5\26\7")
    assert len(load_case(case).train) == len([*case.glob("train/*.csv")]) - 1


@pytest.mark.parametrize("ends_V", [(0.0, 80.0), (-10.0, 40.0), (-10_000.0, 60_000.0)])
def test_a_range_that_the_slow_loop_does_not_reach_is_refused(
    ends_V: tuple[float, float], quiet: Path, tmp_path: Path
) -> None:
    case = copy(quiet, tmp_path)
    tell(case, u_min_V=ends_V[0], u_max_V=ends_V[1])
    with pytest.raises(InputError, match=r"identify.csv: reaches 0 to 40 V of .* 15 % at most"):
        load_case(case)
    load_case(case, flashed=True)  # f0 is the model's: no need to see both ends


@pytest.mark.parametrize(("u_max_V", "said"), [(40.2, False), (41.0, True), (46.0, True)])
def test_a_slow_loop_that_stays_a_little_short_is_no_bad_input(
    u_max_V: float, said: bool, quiet: Path, tmp_path: Path
) -> None:
    case = copy(quiet, tmp_path)
    tell(case, u_max_V=u_max_V)
    assert any("extrapolated at the ends" in w for w in load_case(case).warnings) is said


def test_without_holdout_whole_records_are_set_aside(quiet: Path, tmp_path: Path) -> None:
    case = copy(quiet, tmp_path)
    shutil.rmtree(case / "holdout")
    found = content(case)
    assert found["shrink"]["set_aside"] == ["steps"]
    assert [r["name"] for r in found["shrink"]["records"]] == ["steps"]
    assert f"{case / 'holdout'}: is missing: steps set aside as hold-out" in found["warnings"]
    (case / "holdout").mkdir()
    empty = f"{case / 'holdout'}: holds no record: "
    assert f"{empty}steps set aside as hold-out" in load_case(case).warnings
    for name in ("bias", "decaying", "multisine"):
        (case / "train" / f"{name}.csv").unlink()
    assert f"{empty}how far the gap shrinks cannot be checked" in load_case(case).warnings


# -- faults of the data -------------------------------------------------------------------------


def lose(path: Path, share: float, burst: int, rng: np.random.Generator) -> None:
    """Drop a share of a record's rows, so many in a row."""
    frame = pd.read_csv(path)
    kept = np.ones(len(frame), bool)
    while kept.mean() > 1.0 - share:
        at = int(rng.integers(1, len(frame) - burst))
        kept[at : at + burst] = False
    kept[-1] = True
    frame[kept].to_csv(path, index=False)


@pytest.mark.parametrize(("share", "burst"), [(0.05, 1), (0.2, 1), (0.4, 1), (0.05, 40), (0.2, 40)])
@pytest.mark.parametrize("effect", [None, "gain_offset"])
def test_missing_rows_change_no_verdict(
    effect: str | None, share: float, burst: int, tmp_path: Path
) -> None:
    written(tmp_path / "case", *([effect] if effect else []))
    rng = np.random.default_rng(5)
    for path in sorted((tmp_path / "case").rglob("*.csv")):
        lose(path, share, burst, rng)
    found = content(tmp_path / "case")
    assert named(found) == ({effect} if effect else set()), found["verdict"]
    assert {f["kind"] for f in found["data_faults"]} == {"gap"}


@pytest.mark.parametrize("share", [0.2, 0.4])
def test_duplicates_and_jitter_change_no_verdict(share: float, quiet: Path, tmp_path: Path) -> None:
    case = copy(quiet, tmp_path)
    rng = np.random.default_rng(5)
    for path in sorted(case.rglob("*.csv")):
        frame = pd.read_csv(path)
        twice = np.sort(np.append(np.arange(len(frame)), rng.integers(len(frame), size=20)))
        width = share * frame["t_s"].diff().median()
        shaken = frame["t_s"] + width * rng.uniform(-1.0, 1.0, len(frame))
        frame.assign(t_s=shaken).iloc[twice].to_csv(path, index=False)
    found = content(case)
    assert found["verdict"]["status"] == "no_gap"
    assert {f["kind"] for f in found["data_faults"]} == {"duplicate", "jitter"}
    shaken = [f["record"] for f in found["data_faults"] if f["kind"] == "jitter"]
    assert len(shaken) == len([*case.rglob("*.csv")]), "once per record"


def test_one_absurd_value_is_named_and_changes_no_verdict(
    found: Diagnosis, folder: Path, tmp_path: Path
) -> None:
    case = copy(folder / "creep", tmp_path)
    change(case / "train" / "decaying.csv", y_um=lambda f: f["y_um"].where(f.index != 99, 1e6))
    spoilt = content(case)
    assert {"record": "decaying", "rows": [101, 101], "kind": "outlier"} in spoilt["data_faults"]
    assert spoilt["verdict"]["effects"] == found["verdict"]["effects"]
    assert spoilt["gap"]["rms_um"] == pytest.approx(found["gap"]["rms_um"], rel=0.01)


@pytest.mark.parametrize(
    ("place", "named", "column", "times"),
    [
        ("train", "y_um", "y_nm", 1e-3),
        ("train", "u_V", "u_mV", 1e3),
        ("holdout", "y_um", "y_mm", 1e3),
    ],
)
def test_a_record_in_another_unit_than_its_header_says_is_named(
    place: str, named: str, column: str, times: float, quiet: Path, tmp_path: Path
) -> None:
    case = copy(quiet, tmp_path)
    path = case / place / "steps.csv"
    pd.read_csv(path).rename(columns={named: column}).to_csv(path, index=False)
    (warning,) = load_case(case).warnings
    told, _, rest = warning.removeprefix(f"{path}: y moves ").partition(" times as far per volt")
    assert float(told) == pytest.approx(times, rel=0.5) and "is a unit wrong" in rest


def test_values_many_strokes_away_are_named(quiet: Path, tmp_path: Path) -> None:
    case = copy(quiet, tmp_path)
    path = case / "train" / "decaying.csv"
    change(path, y_um=lambda f: f["y_um"] + 400.0 * (f.index // 10 == 30))
    (warning,) = load_case(case).warnings
    assert warning.startswith(f"{path}: row 302: y is 4") and "10 strokes away" in warning


# -- bad input ----------------------------------------------------------------------------------


def blank(path: Path) -> None:
    change(path, y_um=lambda f: f["y_um"].where(f.index != 700))


def backwards(path: Path) -> None:
    change(path, t_s=lambda f: f["t_s"].to_numpy()[::-1])


def outside(path: Path) -> None:
    change(path, u_V=lambda f: f["u_V"] + 60.0 * (f.index == 300))


def without_y(path: Path) -> None:
    pd.read_csv(path).drop(columns="y_um").to_csv(path, index=False)


def header_alone(path: Path) -> None:
    pd.read_csv(path).head(0).to_csv(path, index=False)


BAD = {
    "NaN": ("train/decaying.csv", blank, "decaying.csv: row 702"),
    "time": ("holdout/steps.csv", backwards, "steps.csv: row 3"),
    "range": ("train/decaying.csv", outside, "15 %"),
    "no identify": ("identify.csv", Path.unlink, "identify.csv: is missing"),
    "no y": ("train/bias.csv", without_y, "y_um"),
    "no json": ("case.json", Path.unlink, "case.json: cannot be read"),
    "bad json": ("case.json", lambda p: p.write_text("{"), "case.json: is not a JSON file"),
    "empty": ("train/bias.csv", lambda p: p.write_text(""), "bias.csv"),
    "no rows": ("train/bias.csv", header_alone, "bias.csv: 0 rows are too few: at least 100"),
    "no train": ("train", shutil.rmtree, "train: holds no record"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_ends_in_one_line(
    name: str,
    quiet: Path,
    patch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    case = copy(quiet, tmp_path)
    place, spoil, said = BAD[name]
    spoil(case / place)
    with pytest.raises(SystemExit) as end:
        run(patch, case, tmp_path / "out")
    told = capsys.readouterr().err.strip()
    assert end.value.code == 2
    assert "\n" not in told and said in told
    assert [p.name for p in tmp_path.iterdir()] == ["case"]


def test_a_misspelt_key_of_case_json_is_named(quiet: Path, tmp_path: Path) -> None:
    case = copy(quiet, tmp_path)
    tell(case, exlude=["delay"])
    assert f"{case / 'case.json'}: no key is named 'exlude': ignored" in load_case(case).warnings


@pytest.mark.parametrize(
    "keys",
    [
        {"u_min_V": 50.0},
        {"u_max_V": "40"},
        {"device": 5},
        {"adc_bits": "12"},
        {"adc_bits": -3},
        {"dac_bits": 1.5},
        {"dac_bits": True},
        {"y_unit": "nm"},
        {"exclude": ["magic"]},
        {"known": {"speed": 1.0}},
        {"known": {"zeta": -1.0}},
        {"known": {"delay_s": float("nan")}},
        {"known": {"corner_hz": "60"}},
        {"known": {"fn_hz": True}},
        {"known": {"freq_hz": 50.0}},
        {"known": {"low_V": 30.0, "high_V": 20.0}},
        {"known": {"knee_V": 0.0}},
        {"known": {"high_V": 20.0, "knee_V": 1e-9}},
        {"known": [0.1]},
        {"running": ["nobody"]},
    ],
)
def test_bad_case_json_is_refused(
    keys: dict[str, Any],
    quiet: Path,
    patch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    case = copy(quiet, tmp_path)
    tell(case, **keys)
    with pytest.raises(SystemExit) as end:
        run(patch, case, tmp_path / "out")
    told = capsys.readouterr().err.strip()
    assert end.value.code == 2 and "\n" not in told
    assert "case.json" in told and next(iter(keys)) in told
    assert not (tmp_path / "out").exists()
