"""Prediction: every row of a record, what is compared, and the command that writes it."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from madelung.core import Predictor
from madelung.errors import InputError
from madelung.identify import percent
from madelung.model import Model
from madelung.predict import Prediction, predict, summary
from madelung.records import Record, make_record, write_record

MODEL = Model("madelung", 0.0, 40.0, f0=(0.58517, 0.086444, 0.0011949, -6.1876e-06))
STROKE = 40 * 0.086444 + 40**2 * 0.0011949 - 40**3 * 6.1876e-06
MADELUNG = Path(sys.executable).with_name("madelung")


def wandering(rows: int = 4000, low: float = 0.0, high: float = 40.0) -> np.ndarray:
    t = np.arange(rows) / rows
    u = np.sin(40.0 * t) + np.sin(63.0 * t) + np.sin(97.0 * t)
    return low + (high - low) * (u - u.min()) / np.ptp(u)


def record_of(u: np.ndarray, y: np.ndarray | None = None, **more: np.ndarray) -> Record:
    columns = {"t_s": np.arange(u.size) * 0.01, "u_V": u, **more}
    return make_record("r", columns if y is None else {**columns, "y_um": y})


def test_it_is_the_core_in_the_firmwares_float() -> None:
    u = wandering()
    found = predict(MODEL, record_of(u))
    expected, _, turns = Predictor(MODEL, "float32").run_with_status(u)
    np.testing.assert_array_equal(found.predicted.astype(np.float32), expected)
    np.testing.assert_array_equal(found.turning_points, turns)
    assert found.error.size == 0 and found.warnings == ()
    reference = predict(MODEL, record_of(u), "float64")
    np.testing.assert_array_equal(reference.predicted, Predictor(MODEL, "float64").run(u))
    assert 0.0 < np.abs(reference.predicted - found.predicted).max() < 1e-5


def offset(u: np.ndarray, **options: object) -> Prediction:
    y = Predictor(MODEL, "float64").run(u) + np.arange(u.size) * 1e-3
    return predict(MODEL, record_of(u, y), "float64", **options)  # type: ignore[arg-type]


def test_error_is_measured_less_predicted_on_the_asked_rows() -> None:
    u = wandering()
    np.testing.assert_allclose(offset(u).error, np.arange(4000) * 1e-3, atol=1e-9)
    window = offset(u, from_s=10.0, to_s=20.0)
    np.testing.assert_allclose(window.error, np.arange(1000, 2001) * 1e-3, atol=1e-9)
    assert window.predicted.size == 4000


def test_running_record_is_compared_once_it_was_at_both_ends() -> None:
    u = 20.0 + 20.0 * np.sin(np.arange(1000) * 2.0 * np.pi / 200)
    whole = Predictor(MODEL, "float64").run(np.concatenate(([0.0, 35.0, 3.0], u)))[3:]
    found = predict(MODEL, record_of(u, whole), "float64", running=True)
    rest = predict(MODEL, record_of(u, whole), "float64")
    assert np.flatnonzero(found.scored)[0] == pytest.approx(150, abs=15)
    assert np.abs(found.error).max() < 1e-9 < 0.01 < np.abs(rest.error).max()


def test_faulty_rows_are_predicted_but_not_compared() -> None:
    u = wandering()
    y = Predictor(MODEL, "float64").run(u)
    y[1000:1100] = y[1000]
    found = predict(MODEL, record_of(u, y), "float64")
    assert np.abs(found.error).max() < 1e-9 and np.isfinite(found.predicted).all()
    assert any("y is stuck" in w for w in found.warnings)


def test_beyond_the_range_warns_up_to_15_percent_and_then_refuses() -> None:
    near = predict(MODEL, record_of(wandering(low=-3.0, high=44.0)))
    assert len(near.warnings) == 1 and "outside 0 to 40 V: f0 extrapolated" in near.warnings[0]
    far = wandering(high=39.0)
    far[123] = 46.1
    with pytest.raises(InputError, match=r"row 125: the command 46.1 V is more than 15 % outside"):
        predict(MODEL, record_of(far))


def test_units_must_agree_and_something_must_be_left() -> None:
    u = wandering()
    y = Predictor(MODEL).run(u)
    with pytest.raises(InputError, match="y is in V, the model gives um"):
        predict(MODEL, record_of(u, y_V=y))
    volts = Model("madelung", 0.0, 40.0, f0=MODEL.f0, extra={"y_unit": "V"})
    assert list(predict(volts, record_of(u, y_V=y)).columns())[2:] == ["y_V", "predicted_V"]
    with pytest.raises(InputError, match="no row is left"):
        offset(u, from_s=1e6)


def test_a_value_in_another_unit_than_its_header_says_is_warned_of() -> None:
    u = wandering()
    y = Predictor(MODEL, "float64").run(u)
    for factor, said in ((1000.0, "1000"), (1e-3, "0.001"), (120.0, "120"), (50.0, ""), (0.02, "")):
        warnings = predict(MODEL, record_of(u, factor * y)).warnings
        expected = [f"r: y moves {said} times as far as the model says: check the unit"]
        assert [w for w in warnings if "unit" in w] == (expected if said else []), factor
    small = 20.0 + 1e-3 * (u - 20.0)
    noise = 0.01 * np.random.default_rng(1).standard_normal(u.size)
    assert predict(MODEL, record_of(small, y.mean() + noise)).warnings == ()
    in_nm = 1000.0 * Predictor(MODEL, "float64").run(0.02 * u)
    assert "y moves 1000 times" in predict(MODEL, record_of(0.02 * u, in_nm)).warnings[0]


def test_a_share_is_written_without_an_exponent_and_with_its_sign() -> None:
    shares = {30.0: "100", 29.9: "100", 29.0: "97", -30.0: "-100", 37.2: "124", 3e4: "100000"}
    shares |= {-0.000201: "-0.00067", 0.0105: "0.035", 0.0: "0"}
    for value, said in shares.items():
        assert percent(value, 30.0) == f"{said} % of the stroke"
    u = wandering()
    y = Predictor(MODEL, "float64").run(u)
    said = summary(predict(MODEL, record_of(u, y - 0.1), "float64"))[1]
    share = f"{100 * 0.1 / STROKE:.2g} % of the stroke)"
    assert f"rms 0.1 um ({share}, largest 0.1 um ({share} at" in said
    assert said.endswith(f"mean -0.1 um (-{share}")
    far = summary(predict(MODEL, record_of(u, y + 31234.0), "float64"))[1]
    assert "mean 31200 um (" in far and "e+" not in far


def madelung(*args: object) -> tuple[int, str, str]:
    done = subprocess.run([MADELUNG, *map(str, args)], capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


@pytest.fixture
def files(tmp_path: Path) -> Path:
    u = wandering()
    MODEL.save(tmp_path / "m.json")
    write_record(tmp_path / "r.csv", record_of(u, Predictor(MODEL, "float64").run(u) + 0.1))
    write_record(tmp_path / "u.csv", record_of(u))
    return tmp_path


def test_command_writes_every_row_and_says_how_good_it_is(files: Path) -> None:
    out, plot = files / "o.csv", files / "p.png"
    code, said, warned = madelung(
        "predict", files / "m.json", files / "r.csv", "-o", out, "--plot", plot
    )
    assert (code, warned) == (0, "")
    frame = pd.read_csv(out)
    assert list(frame.columns) == ["t_s", "u_V", "y_um", "predicted_um"] and len(frame) == 4000
    np.testing.assert_allclose(frame.y_um - frame.predicted_um, 0.1, atol=1e-5)
    assert f"rms 0.1 um ({100 * 0.1 / STROKE:.2g} % of the stroke)" in said
    assert plot.read_bytes()[:4] == b"\x89PNG"


def test_command_without_y_predicts_and_draws_all_the_same(files: Path) -> None:
    out, plot = files / "o.csv", files / "p.png"
    code, said, _ = madelung(
        "predict", files / "m.json", files / "u.csv", "-o", out, "--reference", "--plot", plot
    )
    assert code == 0 and "nothing measured" in said and plot.exists()
    assert out.read_text().startswith("t_s,u_V,predicted_um\n")


def test_command_refuses_in_one_line_with_code_2_and_leaves_nothing(files: Path) -> None:
    before = sorted(p.name for p in files.iterdir())
    (files / "bad.json").write_text("{}")
    m, r, out = files / "m.json", files / "r.csv", files / "o.csv"
    for args in [
        ("predict", m, r),
        ("predict", m, "-o", out),
        ("predict", m, r, "-o", files / "none" / "o.csv"),
        ("predict", m, r, "-o", files),
        ("predict", m, r, "-o", out, "--plot", "x.pdf"),
        ("predict", m, r, "-o", out, "--from", "soon"),
        ("predict", m, r, "-o", out, "--bogus"),
        ("predict", m, files, "-o", out),
        ("predict", m, m, "-o", out),
        ("predict", r, r, "-o", out),
        ("predict", files / "bad.json", r, "-o", out),
        ("bogus",),
        (),
    ]:
        code, said, error = madelung(*args)
        assert code == 2 and said == "" and error.count("\n") == 1, (args, said, error)
        assert error.startswith("madelung: ")
    assert sorted(p.name for p in files.iterdir()) == sorted([*before, "bad.json"])


def test_help_is_no_error() -> None:
    for args in (["--help"], ["identify", "--help"], ["predict", "--help"], ["--version"]):
        code, said, error = madelung(*args)
        assert code == 0 and said and error == "", args


def test_interrupted_command_leaves_nothing(files: Path) -> None:
    u = np.tile(wandering(), 100)
    write_record(files / "long.csv", record_of(u))
    before = sorted(p.name for p in files.iterdir())
    started = subprocess.Popen(
        [MADELUNG, "predict", files / "m.json", files / "long.csv", "-o", files / "o.csv"],
        stderr=subprocess.PIPE,
        text=True,
        # A shell starts what runs in the background without SIGINT, and so are its children.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    while len(list(files.iterdir())) == len(before) and started.poll() is None:
        time.sleep(0.01)  # until the temporary file of the output is there
    started.send_signal(2)
    _, error = started.communicate(timeout=60)
    assert (started.returncode, error) == (1, "madelung: interrupted\n")
    assert sorted(p.name for p in files.iterdir()) == before


def test_what_is_read_is_not_written_over(tmp_path: Path) -> None:
    record, model = tmp_path / "r.csv", tmp_path / "m.json"
    write_record(record, record_of(wandering(), wandering()))
    MODEL.save(model)
    before = record.read_bytes(), model.read_bytes()
    for command in (["predict", model, record, "-o", record], ["identify", record, "-o", record]):
        done = subprocess.run([MADELUNG, *command], capture_output=True, text=True)
        assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert (record.read_bytes(), model.read_bytes()) == before


def test_a_link_to_itself_is_refused_in_one_line(tmp_path: Path) -> None:
    loop = tmp_path / "loop"
    loop.symlink_to(loop)
    command = [MADELUNG, "predict", loop, loop, "-o", tmp_path / "o"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "symbolic link" in done.stderr and len(done.stderr.strip().splitlines()) == 1
