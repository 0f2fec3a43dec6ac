"""`madelung export`: the C that it writes computes what the core computes from the model."""

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from madelung.cli import app
from madelung.core import Predictor, Status
from madelung.errors import InputError
from madelung.export import Scaling, default_scaling, literal, volts_per_code, write_params
from madelung.model import Model, load_model

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


def scaling(model: Model) -> Scaling:
    default = default_scaling(model)
    return Scaling(10_000, default.input_V, (-1.0, 10.0))


def run_exported(model: Model, folder: Path) -> np.ndarray:
    """Bits of u, bits of y and status, from C that was compiled with the exported parameters."""
    write_params(model, scaling(model), folder)
    (folder / "run.c").write_text(RUN)
    include = [f"-I{folder}", *(f"-I{ROOT}/firmware/{d}" for d in ("core", "hal", "app"))]
    core = sorted(map(str, (ROOT / "firmware/core").glob("*.c")))
    flags = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Wdouble-promotion"]
    flags += ["-Werror", "-O1", "-ffp-contract=off", *include]
    build = ["gcc", *flags, "-o", "run", "run.c", "mdl_params.c", *core]
    subprocess.run(build, cwd=folder, check=True)
    out = subprocess.run([folder / "run"], capture_output=True, text=True, check=True).stdout
    return np.array(out.split(), np.int64).reshape(-1, 3)


@pytest.mark.parametrize("name", MODELS)
def test_exported_c_and_the_model_give_the_same_bits(name: str, tmp_path: Path) -> None:
    rows = run_exported(MODELS[name], tmp_path)
    u, y = (rows[:, i].astype(np.int32).view(np.float32) for i in (0, 1))
    expected, status, _ = Predictor(MODELS[name]).run_with_status(u)
    np.testing.assert_array_equal(y.view(np.int32), expected.view(np.int32))
    np.testing.assert_array_equal(rows[:, 2], status)
    assert not rows[:, 2].any()  # no code leaves the identified range


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
    assert found["rate_hz"] == 2500
    assert found["u_zero_volts"] == -10.0
    assert found["volts_per_code"] == pytest.approx(60.0 / 4095.0, rel=1e-7)
    assert found["y_zero_um"] == -2.0
    assert found["codes_per_um"] == pytest.approx(4095.0 / 8.19, rel=1e-7)


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
