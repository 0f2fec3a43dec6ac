"""Augmented models: what the file holds, what is refused, and `madelung predict` on them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from madelung.blocks import Block
from madelung.cli import app
from madelung.errors import InputError
from madelung.model import Model, load_model, model_from_json
from madelung.path import (
    CreepMode,
    Mode,
    Runner,
    SignalPath,
    augmented_model,
    discretise,
    path_of,
    path_to_blocks,
)

PATH = SignalPath(-20.0, 160.0, (0.3, 0.08, 2e-4, -1e-6))
FIELDS: dict[str, dict[str, Any]] = {
    "delay": {"delay_s": 3.21e-4},
    "saturation": {
        "high_V": 101.3,
        "low_V": -3.7,
        "knee_V": 1.1,
        "parabolic": 1.0,
        "rest_free": 1.0,
    },
    "slew_limit": {"slew_V_per_s": 12345.0, "slew_fall_V_per_s": 9876.0, "slew_knee_V": 0.5},
    "amplifier_lag": {"corner_hz": 543.2, "corner_lean": 0.21, "behind_hz": 654.3},
    "asymmetry": {"shape": ((0.1, 0, 0, 0), (0, 0, 0, 0), (0, 0, 0.3, 0), (0, 0, 0, 0))},
    "rate_dependence": {"damping_um": -0.05, "power": 0.7, "v_ref_V_per_s": 1e4},
    "non_masing": {"shape": ((0, 0, 0, 0), (0, 0.2, 0, 0), (0, 0, 0, 0), (0.1, 0, 0, 0))},
    "creep": {"creep": (CreepMode(0.1, 0.01), CreepMode(600.0, 0.02))},
    "resonance": {"modes": (Mode(312.3, 0.0123, 0.91), Mode(1234.5, 0.03, 0.09))},
    "backlash": {"dead_band_um": 0.0321, "spread": 0.43, "spring_share": 0.21},
    "gain_offset": {"gain": 1.0321, "offset_um": -0.123},
}
BOTH_SHAPES = np.add(*(FIELDS[e]["shape"] for e in ("asymmetry", "non_masing"))).tolist()
FULL = PATH.but(**{k: v for fields in FIELDS.values() for k, v in fields.items()}).but(
    shape=tuple(map(tuple, BOTH_SHAPES)),
    substeps_min=5,
    widening=0.1,
    threshold_V=0.3,
    swelling=0.02,
    lean=0.31,
    loop_share=0.11,
    loop_slope=-0.07,
    v_knee=0.07,
    velocity_tau_s=2e-4,
    of_speed=1.0,
    smooth=0.6,
    rise_V=1.23,
    rise_skew=0.45,
    fall_V=0.67,
    fall_skew=-0.89,
    follow=0.12,
    bouc_um=0.021,
    bouc_V=23.0,
    bouc_power=1.5,
    bouc_gamma=0.2,
)
VISCOUS = ({"relax_s": 1.23e-3}, {"relax_per_V_s": 321.0})
ENVELOPES = (
    {"rise_V": 1.23, "rise_skew": -0.45, "follow": 0.6},
    {"fall_V": 0.67, "fall_skew": 1.0},
    {"rise_V": 1.23, "fall_V": 0.67},
)
SKEW = Block("clock_skew", "clock skew", {"skew_ppm": 120.0})
STEP_S = 1e-4


@pytest.mark.parametrize("effect", FIELDS)
def test_an_effect_is_one_block_and_comes_back(effect: str) -> None:
    path = PATH.but(**FIELDS[effect])
    (block,) = path_to_blocks(path, {effect: "its model"})
    assert (block.effect, block.model) == (effect, "its model")
    assert path_of(augmented_model(path, 140.0)) == path


@pytest.mark.parametrize("law", VISCOUS)
def test_viscous_operators_are_a_rate_dependence_and_come_back(law: dict[str, float]) -> None:
    path = PATH.but(**law)
    (block,) = path_to_blocks(path)
    assert block.effect == "rate_dependence"
    assert {k: v for k, v in block.parameters.items() if v} == law | {
        "power": 1.0,
        "v_ref_V_per_s": 1.0,
    }
    assert path_of(augmented_model(path, 140.0)) == path


@pytest.mark.parametrize("envelopes", ENVELOPES)
def test_envelopes_are_an_asymmetry_and_come_back(
    envelopes: dict[str, float], tmp_path: Path
) -> None:
    """Alone, and beside terms of the shape."""
    path = PATH.but(**envelopes)
    (block,) = path_to_blocks(path)
    assert block.effect == "asymmetry"
    assert {k: v for k, v in block.parameters.items() if v} == envelopes
    for one in (path, path.but(**FIELDS["asymmetry"])):
        augmented_model(one, 140.0).save(tmp_path / "model.json")
        assert path_of(load_model(tmp_path / "model.json")) == one


def test_all_effects_come_back_from_a_file(tmp_path: Path) -> None:
    assert [k for k, v in vars(FULL).items() if v == getattr(PATH, k)] == [
        "u_min_V",
        "range_V",
        "f0",
        "knee_power",  # a parabolic knee has none
        "relax_s",  # viscous operators do not widen
        "relax_per_V_s",
        "yang",  # a kind of model of its own
    ]
    model = augmented_model(
        FULL,
        140.0,
        {"creep": "ladder"},
        {"start_peak_V": 77.0},
        not_in_firmware=[SKEW],
        extra={"source": "case"},
    )
    model.save(tmp_path / "model.json")
    loaded = load_model(tmp_path / "model.json")
    assert loaded == model
    assert path_of(loaded) == FULL
    content = json.loads((tmp_path / "model.json").read_text())
    assert [b["effect"] for b in content["not_in_firmware"]] == ["clock_skew"]
    assert {b["effect"] for b in content["blocks"]} == {*FIELDS, "initial_state"}


def test_what_does_nothing_is_no_block() -> None:
    idle = PATH.but(knee_V=1.0, power=0.5, v_ref_V_per_s=3.0, substeps_min=4)
    idle = idle.but(knee_power=2.0, v_knee=0.1, slew_fall_V_per_s=500.0, spring_share=0.3)
    idle = idle.but(parabolic=1.0, velocity_tau_s=1e-3, of_speed=1.0, rest_free=1.0, smooth=1.0)
    idle = idle.but(rise_skew=0.5, fall_skew=-0.5, follow=1.0)
    assert path_to_blocks(idle) == ()
    without_rate = PATH.but(corner_hz=50.0, smooth=1.0)
    kept = path_of(augmented_model(without_rate, 140.0))
    assert discretise(without_rate, STEP_S) == discretise(kept, STEP_S)
    assert discretise(PATH, STEP_S) == discretise(path_of(augmented_model(PATH, 140.0)), STEP_S)


def test_parameters_that_are_not_given_have_their_defaults() -> None:
    data = BASE | {"blocks": [block("saturation", high_V=90), block("resonance", modes=[MODE])]}
    path = path_of(model_from_json(data))
    assert path == PATH.but(high_V=90.0, modes=(Mode(300.0, 0.02, 1.0),))
    path = path_of(model_from_json(BASE | {"blocks": [block("asymmetry", fall_V=3)]}))
    assert path == PATH.but(fall_V=3.0)
    assert discretise(path, STEP_S).envelope == (1 / 160.0, 0.0, 0.0, 3.0, 0.0, 0.0)


def test_a_slew_limit_of_one_rate_is_the_same_for_falling_commands() -> None:
    even, uneven = PATH.but(slew_V_per_s=500.0), PATH.but(slew_V_per_s=500.0, slew_fall_V_per_s=250)
    steps = [discretise(path, STEP_S).slew for path in (even, uneven)]
    assert steps == [(0.0125, 0.0125, 0.0, 0.0, 0.0), (0.0125, 0.00625, 0.0, 0.0, 0.0)]


MODE = {"fn_hz": 300, "zeta": 0.02}
BASE = augmented_model(PATH, 140.0).to_json()


def block(effect: str, **parameters: object) -> dict[str, Any]:
    return {"effect": effect, "model": "m", "parameters": parameters}


@pytest.mark.parametrize(
    ("blocks", "reason"),
    [
        (None, "blocks must be a list"),
        ({}, "blocks must be a list"),
        ([1], 'blocks must hold objects with "effect"'),
        ([{"effect": "delay"}], 'blocks must hold objects with "effect" and "parameters"'),
        ([block("preisach")], "'preisach' is no effect that the core runs"),
        ([block("drift", drift_um_per_s=1)], "'drift' is no effect that the core runs"),
        ([block("delay", delay_s=1), block("delay", delay_s=1)], "delay stands there twice"),
        ([block("delay")], "delay: delay_s must hold finite numbers, found None"),
        ([block("delay", delay_s=float("nan"))], "delay_s must hold finite numbers, found nan"),
        ([block("delay", delay_s=-1e-6)], "delay_s = -1e-06 must be 0 to 1000"),
        ([block("delay", delay_s=True)], "delay_s must hold finite numbers, found True"),
        ([block("delay", delay_ms=1)], "delay has no parameter 'delay_ms'"),
        ([block("saturation", high_V=1, low_V=2)], r"high_V must be above low_V \(2\)"),
        ([block("saturation", high_V=9, knee_V=1, knee_power=33)], "knee_power = 33 must be"),
        ([block("saturation", high_V=9, knee_V=1, knee_power=0.5)], "with a knee_power, 1 to 32"),
        ([block("saturation", high_V=9, knee_power=2)], "knee_V must be above 0"),
        ([block("saturation", high_V=9, low_V=1, knee_V=5, knee_power=2)], "at most 4$"),
        ([block("saturation", high_V=9, knee_V=1, parabolic=0.5)], "0.5 must be a whole number"),
        ([block("saturation", high_V=9, parabolic=1)], "with parabolic knee_V must be above 0"),
        ([block("saturation", high_V=9, low_V=1, knee_V=5, parabolic=1)], "at most 4$"),
        ([block("saturation", knee_V=1, knee_power=2, parabolic=1)], "has no knee_power"),
        ([block("slew_limit", slew_V_per_s=0)], "slew_V_per_s = 0 must be 1e-09"),
        ([block("slew_limit", slew_V_per_s=9, slew_fall_V_per_s=-1)], "= -1 must be 0"),
        ([block("amplifier_lag", corner_hz="50")], "corner_hz must hold finite numbers"),
        ([block("amplifier_lag")], "corner_hz or behind_hz must be above 0"),
        ([block("amplifier_lag", corner_lean=0.3)], "corner_hz or behind_hz must be above 0"),
        ([block("amplifier_lag", corner_hz=9, corner_lean=0.6)], "= 0.6 must be -0.5 to 0.5"),
        ([block("asymmetry", g21_um=1)], "asymmetry has no parameter 'g21_um'"),
        ([block("asymmetry", rise_V=-1)], "rise_V = -1 must be 0"),
        ([block("asymmetry", rise_V=1, rise_skew=1.1)], "rise_skew = 1.1 must be -1 to 1"),
        ([block("asymmetry", fall_V=float("nan"))], "fall_V must hold finite numbers"),
        ([block("asymmetry", fall_V=1, fall_skew=-1.1)], "fall_skew = -1.1 must be -1 to 1"),
        ([block("asymmetry", fall_V=1, follow=2)], "follow = 2 must be 0 to 1"),
        ([block("non_masing", rise_V=1)], "non_masing has no parameter 'rise_V'"),
        ([block("rate_dependence", damping_um=1)], "v_ref_V_per_s must hold finite"),
        ([block("rate_dependence", v_ref_V_per_s=1, power=5)], "power = 5 must be"),
        ([block("rate_dependence", v_ref_V_per_s=1, widening=-1)], "widening = -1 must be 0"),
        ([block("rate_dependence", v_ref_V_per_s=1, v_knee=-1)], "v_knee = -1 must be 0"),
        ([block("rate_dependence", v_ref_V_per_s=1, of_speed=2)], "of_speed = 2 must be 0 to 1"),
        ([block("rate_dependence", v_ref_V_per_s=1, relax_s=-1)], "relax_s = -1 must be 0"),
        ([block("rate_dependence", v_ref_V_per_s=1, relax_per_V_s=-1)], "= -1 must be 0"),
        (
            [block("rate_dependence", v_ref_V_per_s=1, relax_s=1, widening=0.1)],
            "only one of relax_s, relax_per_V_s, widening may be above 0",
        ),
        ([block("rate_dependence", v_ref_V_per_s=1, relax_s=1, relax_per_V_s=1)], "only one of"),
        ([block("creep", modes={})], "creep: modes must be a list"),
        ([block("creep", modes=[{"tau_s": 0, "gain": 1}])], "creep: tau_s = 0 must be"),
        ([block("resonance", modes=[MODE | {"zeta": -0.1}])], "zeta = -0.1 must be 0"),
        ([block("resonance", modes=[MODE | {"zeta": 10.1}])], "zeta = 10.1 must be 0"),
        ([block("backlash", dead_band_um=float("inf"))], "dead_band_um must hold finite"),
        (
            [block("backlash", dead_band_um=1, spring_share=1.1)],
            "spring_share = 1.1 must be 0 to 1",
        ),
    ],
)
def test_bad_blocks_are_refused(blocks: object, reason: str) -> None:
    with pytest.raises(InputError, match=reason) as caught:
        model_from_json(BASE | {"blocks": blocks})
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 120


@pytest.mark.parametrize("notes", [3, [{}], [block("drift", settle_s=None)]])
def test_bad_notes_are_refused(notes: object) -> None:
    with pytest.raises(InputError, match=r"not_in_firmware must|settle_s must hold finite"):
        model_from_json(BASE | {"not_in_firmware": notes})


# madelung predict


def command(n: int = 3000) -> np.ndarray:
    """On a grid that float holds exactly, from u_min."""
    u = 50 - 70 * np.cos(np.arange(n) * 0.02) - 3 * np.sin(np.arange(n) * 0.3)
    return np.clip(np.rint(u * 32) / 32, -20.0, 130.0)


def predict(model: Model, table: pd.DataFrame, folder: Path, *options: str) -> pd.DataFrame:
    model.save(folder / "model.json")
    table.to_csv(folder / "record.csv", index=False)
    files = [str(folder / name) for name in ("model.json", "record.csv")]
    out = str(folder / "out.csv")
    done = CliRunner().invoke(app, ["predict", *files, "-o", out, *options])
    if done.exception is not None:
        raise done.exception
    assert done.exit_code == 0
    (folder / "said.txt").write_text(done.output)
    return pd.read_csv(out)


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("path", [FULL, *(FULL.but(widening=0.0, **law) for law in VISCOUS)])
def test_predict_runs_every_block(path: SignalPath, precision: Any, tmp_path: Path) -> None:
    u = command()
    table = pd.DataFrame({"t_s": np.arange(u.size) * STEP_S, "u_V": u})
    options = ["--reference"] if precision == "float64" else []
    out = predict(augmented_model(path, 140.0), table, tmp_path, *options)
    expected = Runner(-20.0, 160.0, precision).run(path, u, STEP_S)
    # The sample time is read from rounded time stamps.
    np.testing.assert_allclose(out["predicted_um"], expected, rtol=0, atol=2e-6)


def test_predict_starts_from_the_history(tmp_path: Path) -> None:
    u = command() + 10.0
    table = pd.DataFrame({"t_s": np.arange(u.size) * STEP_S, "u_V": u})
    out = predict(augmented_model(PATH, 140.0, start={"start_peak_V": 139.0}), table, tmp_path)
    expected = Runner(-20.0, 160.0, "float32").run(PATH, u, STEP_S, [139.0])
    np.testing.assert_allclose(out["predicted_um"], expected, rtol=0, atol=1e-6)
    fresh = predict(augmented_model(PATH, 140.0), table, tmp_path)
    assert np.abs(fresh["predicted_um"] - out["predicted_um"]).max() > 0.02


def test_predict_bridges_missing_rows(tmp_path: Path) -> None:
    """The dynamics go on through a gap; every row of the file is predicted."""
    u, path = command(), PATH.but(corner_hz=20.0)
    rows = np.r_[0:900, 1300 : u.size]
    table = pd.DataFrame({"t_s": rows * STEP_S, "u_V": u[rows]})
    found = predict(augmented_model(path, 140.0), table, tmp_path)["predicted_um"]
    bridged = np.interp(np.arange(u.size), rows, u[rows])
    expected = Runner(-20.0, 160.0, "float32").run(path, bridged, STEP_S)[rows]
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-6)


def test_predict_refuses_a_record_that_misses_most_rows(tmp_path: Path) -> None:
    rows = np.r_[0:500, 2500:3000]
    table = pd.DataFrame({"t_s": rows * STEP_S, "u_V": command()[rows]})
    with pytest.raises(InputError, match="most rows are missing"):
        predict(augmented_model(PATH, 140.0), table, tmp_path)


def test_predict_says_what_it_leaves_out(tmp_path: Path) -> None:
    table = pd.DataFrame({"t_s": np.arange(3000) * STEP_S, "u_V": command()})
    predict(augmented_model(PATH, 140.0, not_in_firmware=[SKEW]), table, tmp_path)
    assert "knows of clock_skew, which no open-loop" in (tmp_path / "said.txt").read_text()


def test_predict_refuses_a_delay_that_the_build_cannot_hold(tmp_path: Path) -> None:
    table = pd.DataFrame({"t_s": np.arange(3000) * STEP_S, "u_V": command()})
    model = augmented_model(PATH.but(delay_s=0.02), 140.0)
    with pytest.raises(InputError, match="delay of 199 samples: an array is too long"):
        predict(model, table, tmp_path)
    predict(model, table, tmp_path, "--reference")
