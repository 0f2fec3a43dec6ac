"""`madelung export`: the C that it writes computes what the core computes from the model."""

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from madelung.blocks import Block
from madelung.cli import app
from madelung.core import Predictor, Status
from madelung.errors import InputError
from madelung.export import (
    CREEP_MODES_MAX,
    DELAY_WHOLE_MAX,
    MODES_MAX,
    Scaling,
    default_scaling,
    literal,
    volts_per_code,
    write_params,
)
from madelung.model import Model, load_model
from madelung.path import CreepMode, Mode, SignalPath, augmented_model, predictor

ROOT = Path(__file__).resolve().parents[2]
PAPER = load_model(ROOT / "firmware/app/model.json")
EIGHT = (0.5, 0.25, -3e-3, 1e-4, 3.3e-6, -1e-8, 7e-11, 1.1e-13)
MODELS = {
    "paper": PAPER,
    "constant": Model("madelung", 0.0, 10.0, f0=(1.5,), extra={"source": "a */ b /* c \\ µ"}),
    "degree 7, bipolar": Model("madelung", -20.0, 130.0, f0=EIGHT),
    "major curve": Model(
        "major_curve", -5.0, 5.0, breakpoints=((0.0, 0.1), (0.3, 0.2), (3.1, 1.0), (10.0, 4.7))
    ),
}
PATH = SignalPath(-20.0, 150.0, (0.3, 0.08, 2e-4, -1e-6))
SHAPE = tuple(tuple(0.01 * (k - j) for j in range(4)) for k in range(4))
CREEP = tuple(CreepMode(10.0**k, 0.01) for k in range(-3, 4))
BLOCKS = {
    "saturation": {"high_V": 101.3, "low_V": -3.7, "knee_V": 1.1},
    "one hard end": {"high_V": 101.3},
    "a low end, not at rest": {"low_V": -3.7, "rest_free": 1.0},
    "rounded saturation": {"high_V": 101.3, "low_V": -3.7, "knee_V": 11.1, "knee_power": 2.3},
    "parabolic saturation": {"high_V": 101.3, "low_V": -3.7, "knee_V": 11.1, "parabolic": 1.0},
    "slew limit": {"slew_V_per_s": 12345.0},
    "unequal slew limit": {"slew_V_per_s": 12345.0, "slew_fall_V_per_s": 9876.0},
    "slew limit with a knee": {"slew_V_per_s": 12345.0, "slew_knee_V": 0.3},
    "lag": {"corner_hz": 543.2},
    "lag of a load": {"corner_hz": 543.2, "corner_lean": 0.21},
    "a pole behind": {"behind_hz": 654.3},
    "envelopes": {
        "rise_V": 7.7,
        "rise_skew": 0.3,
        "fall_V": 3.3,
        "fall_skew": -0.6,
        "follow": 0.4,
    },
    "damping": {"damping_um": -0.05, "velocity_tau_s": 3e-4, "power": 0.7, "v_ref_V_per_s": 1e5},
    "widening": {"widening": 0.5, "power": 1.3, "v_ref_V_per_s": 1e5},
    "swelling": {"swelling": 0.3, "lean": 0.2, "power": 0.4, "v_ref_V_per_s": 1e5, "of_speed": 1.0},
    "wider minor loops": {"loop_share": 0.2, "loop_slope": -0.1},
    "thresholds": {"threshold_V": 1.7, "power": 0.4, "v_ref_V_per_s": 1e5},
    "a law with a knee": {"widening": 0.5, "power": 0.4, "v_ref_V_per_s": 1e5, "v_knee": 0.03},
    "a smooth command": {"damping_um": -0.1, "smooth": 0.8},
    "a law of the speed": {"threshold_V": 1.7, "v_ref_V_per_s": 1e5, "of_speed": 1.0},
    "viscous operators": {"relax_s": 1.23e-3},
    "viscous operators by the square": {"relax_per_V_s": 321.0},
    "shape": {"shape": SHAPE},
    "creep": {"creep": CREEP},
    "modes": {"modes": (Mode(312.3, 0.0123, 0.91), Mode(1234.5, 0.03, 0.09))},
    "backlash": {"dead_band_um": 0.0321},
    "backlash with a spring": {"dead_band_um": 0.0321, "spring_share": 0.4},
    "backlash of a rough contact": {"dead_band_um": 0.0321, "spread": 0.3},
    "delay": {"delay_s": 3.21e-4},
    "gain and offset": {"gain": 1.0321, "offset_um": -0.123},
}
TOGETHER = {k: v for block in BLOCKS.values() for k, v in block.items()}
ALL = {
    "all blocks": TOGETHER | {"relax_s": 0.0, "relax_per_V_s": 0.0, "parabolic": 0.0},
    "all blocks, viscous": TOGETHER | {"widening": 0.0, "relax_per_V_s": 0.0, "parabolic": 0.0},
    "all blocks, viscous by the square": TOGETHER
    | {"widening": 0.0, "relax_s": 0.0, "knee_power": 0.0},
}
AUGMENTED = {
    name: augmented_model(PATH.but(**fields), 130.0)
    for name, fields in (BLOCKS | {"no block": {}} | ALL).items()
}
RATE_HZ = 10_000
RUN = r"""
#include <stdio.h>
#include "mdl_params.h"
static mdl_tp_side left, right;
int main(void)
{
    static mdl_chain chain;
    unsigned i;
    if (mdl_chain_init(&chain, &mdl_params.chain, &left, &right) != MDL_OK) {
        return 1;
    }
    for (i = 0; i < 20000; i++) {
        unsigned code = i < 4096 ? i : (i * 2654435761u) >> 20;
        mdl_real_bits u, y;
        mdl_status status;
        u.real = mdl_params.u_zero_volts + (mdl_real)code * mdl_params.volts_per_code;
        status = mdl_chain_step(&chain, u.real, &y.real);
        printf("%ld %ld %d\n", (long)u.bits, (long)y.bits, (int)status);
    }
    return 0;
}
"""


FLAGS = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Wdouble-promotion"]
FLAGS += ["-Werror", *(f"-I{ROOT}/firmware/{d}" for d in ("core", "hal", "app"))]


def scaling(model: Model) -> Scaling:
    return Scaling(RATE_HZ, default_scaling(model).input_V, (-1.0, 10.0))


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """The core's objects."""
    folder = tmp_path_factory.mktemp("core")
    sources = sorted((ROOT / "firmware/core").glob("*.c"))
    subprocess.run(
        ["gcc", *FLAGS, "-O1", "-ffp-contract=off", "-c", *sources], cwd=folder, check=True
    )
    return sorted(folder.glob("*.o"))


def run_exported(model: Model, folder: Path, core: list[Path]) -> np.ndarray:
    """Bits of u, bits of y and status, from C that was compiled with the exported parameters."""
    write_params(model, scaling(model), folder)
    (folder / "run.c").write_text(RUN)
    build = ["gcc", *FLAGS, "-O1", "-ffp-contract=off", f"-I{folder}", "-o", "run"]
    subprocess.run([*build, "run.c", "mdl_params.c", *core], cwd=folder, check=True)
    out = subprocess.run([folder / "run"], capture_output=True, text=True, check=True).stdout
    return np.array(out.split(), np.int64).reshape(-1, 3)


@pytest.mark.parametrize("name", [*MODELS, *AUGMENTED])
def test_exported_c_and_the_model_give_the_same_bits(
    name: str, core: list[Path], tmp_path: Path
) -> None:
    model = MODELS.get(name) or AUGMENTED[name]
    rows = run_exported(model, tmp_path, core)
    u, y = (rows[:, i].astype(np.int32).view(np.float32) for i in (0, 1))
    made = predictor(model, "float32", 1 / RATE_HZ, float(u[0]))
    expected, status, _ = made.run_with_status(u)
    np.testing.assert_array_equal(y.view(np.int32), expected.view(np.int32))
    np.testing.assert_array_equal(rows[:, 2], status)
    assert not rows[:, 2].any()  # no code leaves the identified range


@pytest.mark.parametrize("name", BLOCKS)
def test_every_block_changes_what_is_computed(name: str) -> None:
    """So that the comparison above compares something."""
    k = np.arange(4000)
    u = 55 - 75 * np.cos(k * 0.03) * np.exp(-k / 8000)
    with_block, without = (
        predictor(AUGMENTED[n], "float32", 1 / RATE_HZ, -20.0).run(u) for n in (name, "no block")
    )
    assert np.abs(with_block - without).max() > 0.005


def test_what_is_exported_compiles_for_16_bit_integers(tmp_path: Path) -> None:
    subprocess.run([ROOT / "tools/apt.sh", "gcc-avr", "avr-libc"], check=True)
    write_params(AUGMENTED["all blocks"], scaling(PAPER), tmp_path)
    build = ["avr-gcc", "-mmcu=atmega1284p", *FLAGS, "-fsyntax-only", "mdl_params.c"]
    subprocess.run(build, cwd=tmp_path, check=True)


def exported(model: Model, folder: Path) -> str:
    write_params(model, scaling(model), folder)
    return (folder / "mdl_params.c").read_text()


@pytest.mark.parametrize(
    ("fields", "told", "bit"),
    [
        ({"delay_s": 0.0123}, "delay_s = 0.0123", "DELAY"),
        ({"creep": tuple(CreepMode(1.0 + k, 0.01) for k in range(13))}, "tau_s = 13", "CREEP"),
        ({"modes": (Mode(1, 0.1), Mode(20, 0.1), Mode(33, 0.1))}, "fn_hz = 33", "MODES"),
    ],
)
def test_a_block_that_does_not_fit_stands_as_a_comment(
    fields: dict[str, object], told: str, bit: str, core: list[Path], tmp_path: Path
) -> None:
    """And the rest runs."""
    model = augmented_model(PATH.but(corner_hz=50.0, **fields), 130.0)
    text = exported(model, tmp_path)
    comment, code = text.split("#include", 1)
    assert told in comment.split("not in this firmware:")[1] and "mdl_config.h" in comment
    assert f"MDL_BLOCK_{bit}" not in code and "MDL_BLOCK_LAG" in code
    y = run_exported(model, tmp_path, core)[:, 1]
    lag_alone = tmp_path / "lag"
    lag_alone.mkdir()
    kept = augmented_model(PATH.but(corner_hz=50.0), 130.0)
    np.testing.assert_array_equal(y, run_exported(kept, lag_alone, core)[:, 1])


def test_a_delay_of_fine_steps_is_kept_in_whole_ones_where_those_fit(tmp_path: Path) -> None:
    model = augmented_model(PATH.but(delay_s=0.004, substeps_min=8), 130.0)
    text = exported(model, tmp_path)
    assert ".whole = 39u" in text and ".substeps = 1u" in text


def test_what_no_firmware_can_run_stands_as_a_comment(tmp_path: Path) -> None:
    drift = Block("drift", "linear */ x", {"drift_um_per_s": 0.0123})
    model = augmented_model(
        PATH,
        130.0,
        {"initial_state": "unknown peak"},
        {"start_peak_V": 77.5},
        not_in_firmware=[drift],
    )
    comment, code = exported(model, tmp_path).split("#include", 1)
    assert "initial_state, unknown peak: start_peak_V = 77.5" in comment
    assert "drift, linear * / x: drift_um_per_s = 0.0123" in comment
    assert "blocks" not in code


def test_the_limits_are_those_of_the_core() -> None:
    text = (ROOT / "firmware/core/mdl_config.h").read_text()
    limits = {k: int(v) for k, v in re.findall(r"#define MDL_(\w+_MAX) (\d+)", text)}
    assert (limits["DELAY_MAX"] - 4, limits["CREEP_MODES_MAX"]) == (
        DELAY_WHOLE_MAX,
        CREEP_MODES_MAX,
    )
    assert limits["MODES_MAX"] == MODES_MAX


def test_the_committed_parameters_are_those_of_the_committed_model(tmp_path: Path) -> None:
    write_params(PAPER, default_scaling(PAPER), tmp_path)
    for name in ("mdl_params.h", "mdl_params.c"):
        assert (tmp_path / name).read_bytes() == (ROOT / "firmware/app" / name).read_bytes()


def test_the_committed_model_is_eq_20_of_the_paper() -> None:
    assert PAPER.f0 == (0.58517, 0.086444, 0.0011949, -6.1876e-06)
    assert (PAPER.u_min_V, PAPER.u_max_V) == (0.0, 40.0)


@given(st.floats(width=32, allow_nan=False, allow_infinity=False, allow_subnormal=False))
def test_a_literal_names_exactly_one_float(value: float) -> None:
    text = literal(value, "value")
    assert re.fullmatch(r"-?\d(\.\d+)?(e[+-]\d+)?f|-?\d+\.\d+f", text)
    assert np.float32(text[:-1]).tobytes() == np.float32(value).tobytes()


@pytest.mark.parametrize("value", [1e39, -4e38, 1e-39, float("nan"), float("inf")])
def test_what_no_float_of_the_dsp_can_hold_is_refused(value: float) -> None:
    with pytest.raises(InputError, match=r"c\[3\] = .* float"):
        literal(value, "c[3]")


@given(st.floats(-200.0, 200.0, width=32), st.floats(0.25, 300.0, width=32))
def test_full_scale_stays_in_the_range_and_close_to_its_end(u_min: float, span: float) -> None:
    model = Model("madelung", u_min, u_min + span, f0=(0.0, 1.0))
    factor = np.float32(volts_per_code(model, (model.u_min_V, model.u_max_V)))
    low = np.float32(u_min)
    top = (low + np.float32(4095) * factor) - low
    assert top <= np.float32(u_min + span) - low
    assert top >= span - 4 * max(np.spacing(np.float32(abs(u_min) + span)), 4095 * 2**-23 * factor)
    status = Predictor(model).run_with_status([low + np.float32(4095) * factor])[1]
    assert status[0] == Status.OK


def invoke(*arguments: str | Path) -> tuple[int, str]:
    done = CliRunner().invoke(app, ["export", *map(str, arguments)])
    if isinstance(done.exception, InputError):
        return 2, str(done.exception)
    return done.exit_code, done.output


def test_the_command_takes_rate_and_ranges(tmp_path: Path) -> None:
    model = tmp_path / "model.json"
    PAPER.save(model)
    code, said = invoke(
        *(model, "-o", tmp_path / "new", "--rate", "2500", "--input-min", "-10"),
        *("--input-max", "50", "--output-min", "-2", "--output-max", "6.19"),
    )
    assert code == 0 and "2500 Hz" in said
    text = (tmp_path / "new/mdl_params.c").read_text()
    found = {k: float(v) for k, v in re.findall(r"\.(\w+) = (-?[\d.e+-]+)[fu]", text)}
    assert found["rate_hz"] == 2500 and " * For 2500 samples a second, whatever" in text
    assert found["u_zero_volts"] == -10.0
    assert found["volts_per_code"] == pytest.approx(60.0 / 4095.0, rel=1e-7)
    assert found["y_zero_um"] == -2.0
    assert found["codes_per_um"] == pytest.approx(4095.0 / 8.19, rel=1e-7)


def test_the_command_says_what_the_firmware_cannot_run(tmp_path: Path) -> None:
    drift = Block("drift", "", {"drift_um_per_s": 0.5})
    fields = {"delay_s": 0.01, "corner_hz": 50.0}
    model = augmented_model(PATH.but(**fields), 130.0, not_in_firmware=[drift])
    model.save(tmp_path / "model.json")
    code, said = invoke(tmp_path / "model.json", "-o", tmp_path / "new")
    assert code == 0
    warned = [line for line in said.splitlines() if "not in the firmware" in line]
    assert len(warned) == 2
    assert "delay: delay_s = 0.01" in warned[0] and "99 samples" in warned[0]
    assert "drift: drift_um_per_s = 0.5: no open-loop predictor" in warned[1]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--rate", "0"], "sample rate"),
        (["--rate", "200001"], "sample rate"),
        (["--input-min", "40"], "input range must ascend"),
        (["--output-max", "-1"], "output range must ascend"),
        (["--input-max", "nan"], "input range must ascend"),
        (["--output-max", "1e42"], "codes per um"),
    ],
)
def test_bad_options_are_refused_and_nothing_is_written(
    options: list[str], words: str, tmp_path: Path
) -> None:
    code, said = invoke(ROOT / "firmware/app/model.json", "-o", tmp_path / "new", *options)
    assert code == 2 and words in said and "\n" not in said
    assert not (tmp_path / "new").exists()


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    code, said = invoke(ROOT / "firmware/app/model.json", "-o", tmp_path / "file")
    assert code == 2 and "cannot be made" in said


def test_a_model_without_stroke_needs_an_output_range(tmp_path: Path) -> None:
    model = tmp_path / "model.json"
    MODELS["constant"].save(model)
    code, said = invoke(model, "-o", tmp_path / "new")
    assert code == 2 and "output range" in said
