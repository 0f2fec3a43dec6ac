"""The measured actuator picma_p885, where its record is at hand: how good, and what is left."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from madelung.errors import InputError
from madelung.identify import identify, stroke_of
from madelung.model import Model
from madelung.predict import predict
from madelung.records import Record, read_record

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"
PICMA = DATA / "picma_p885" / "model_vi_do.csv"
MIRROR = DATA / "cubespec_fsm"
CYCLE = 200
"""Rows in a period of 1 s."""

MISSING = "the measured record is missing, it is no part of the repository: ../shared/data/{}"
needs_picma = pytest.mark.skipif(
    not PICMA.exists(), reason=MISSING.format("picma_p885/model_vi_do.csv")
)


@pytest.fixture(scope="module")
def record() -> Record:
    return read_record(PICMA)


@pytest.fixture(scope="module")
def model(record: Record) -> Model:
    return identify([record], from_s=1.0, to_s=10.0).model


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def split(error: np.ndarray) -> dict[str, float]:
    """Root mean squares whose squares add up to that of the error, shape (cycles, CYCLE).

    Half a period later the command is mirrored about the middle of its range: what a centrally
    symmetric model could follow changes its sign there, what is asymmetric does not.
    """
    drift = error.mean(axis=1, keepdims=True)
    shape = (error - drift).mean(axis=0)
    mirrored = np.roll(shape, CYCLE // 2)
    return {
        "all": rms(error),
        "asymmetry of the loop": rms((shape + mirrored) / 2.0),
        "drift of the cycles' means": rms(drift),
        "rounded ends, and other symmetric misfit": rms((shape - mirrored) / 2.0),
        "differences between cycles (noise)": rms(error - drift - shape),
    }


@needs_picma
def test_prediction_of_the_rest_and_where_it_fails(record: Record, model: Model) -> None:
    found = predict(model, record, running=True, from_s=10.0, to_s=39.999)
    error = found.error.reshape(30, CYCLE)
    parts = split(error)
    stroke = stroke_of(model)
    lines = [
        f"{name:<42}{size:.3f} um rms, {100 * size / stroke:.2f} % of the stroke"
        for name, size in parts.items()
    ]
    print("", *lines, sep="\n")
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert "\n".join(lines) in readme
    assert 0.03 * stroke > np.abs(error).max() > 0.01 * stroke
    whole = parts.pop("all")
    assert whole == pytest.approx(np.sqrt(sum(p**2 for p in parts.values())))
    assert list(parts.values()) == sorted(parts.values(), reverse=True)
    # The last part is what nobody can predict: the noise that identification saw.
    assert parts.popitem()[1] == pytest.approx(model.extra["noise_um"], rel=0.15)


@needs_picma
def test_warm_up_is_left_out_without_being_told(record: Record, model: Model) -> None:
    """The first swing is 4 um off; fitted from the very beginning, f0 stays what it is."""
    whole = identify([record], to_s=10.0).model
    assert record.y is not None
    assert abs(record.y[0] - predict(model, record).predicted[0]) > 4.0
    x = np.linspace(0.0, 3.6, 50)
    first, second = (np.polynomial.Polynomial(m.f0)(x) for m in (model, whole))
    assert np.abs(first - second).max() < 0.1


@needs_picma
def test_readme_shows_what_the_commands_print(tmp_path: Path) -> None:
    madelung = Path(sys.executable).with_name("madelung")
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    for args in (
        ["identify", PICMA, "-o", tmp_path / "m.json", "--from", "1", "--to", "10"],
        ["predict", tmp_path / "m.json", PICMA, "-o", tmp_path / "o.csv", "--running", "--from=10"],
    ):
        done = subprocess.run([madelung, *args], capture_output=True, text=True, check=True)
        assert done.stdout.partition("\n")[2] in readme
    assert "not centrally symmetric" in " ".join(identify([read_record(PICMA)]).warnings)


@pytest.mark.skipif(not MIRROR.exists(), reason=MISSING.format("cubespec_fsm"))
def test_the_mirror_with_three_inputs_is_refused_with_the_reason() -> None:
    for path in sorted(MIRROR.glob("*.csv")):
        with pytest.raises(InputError, match=r"3 input columns .* cannot explain"):
            read_record(path)
