"""The Python side of the core: `core.Predictor`, `model`, `files`."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from madelung import core
from madelung.core import Predictor
from madelung.errors import InputError
from madelung.files import replacing, write_atomically
from madelung.model import Model, load_model, model_from_json

PAPER = Model("madelung", 0.0, 40.0, f0=(0.58517, 0.086444, 0.0011949, -6.1876e-06))
LINE = Model("major_curve", -5.0, 5.0, breakpoints=((0.0, 0.0), (4.0, 1.0), (10.0, 4.0)))


# core.Predictor


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_predictor_returns_the_numbers_of_its_build(precision: core.Precision) -> None:
    """dtype and shape; 2-D and read-only input; f0 at the ends."""
    u = np.array([[0.0, 40.0], [20.0, 0.0]])
    u.flags.writeable = False
    y, status, count = Predictor(PAPER, precision).run_with_status(u)
    assert y.dtype == precision
    assert y.shape == status.shape == count.shape == (4,)
    c0, c1, c2, c3 = PAPER.f0
    assert y[[0, 1, 3]] == pytest.approx([c0, c0 + 40 * (c1 + 40 * (c2 + 40 * c3)), c0], rel=1e-6)
    assert count.tolist() == [1, 1, 2, 0]


def test_predictor_runs_a_major_curve() -> None:
    """x = u - u_min on the broken line."""
    assert Predictor(LINE).run([-5.0, -3.0, -1.0, 5.0]).tolist() == [0.0, 0.5, 1.0, 4.0]


def test_an_empty_run_changes_nothing() -> None:
    """No samples in, none out."""
    predictor = Predictor(PAPER)
    before = predictor.save()
    assert predictor.run([]).size == 0
    assert predictor.save().tobytes() == before.tobytes()


@pytest.mark.parametrize(
    ("model", "reason"),
    [
        (replace(PAPER, u_max_V=0.0), "a parameter is out of its range"),
        (replace(PAPER, u_max_V=-1.0), "a parameter is out of its range"),
        (replace(PAPER, f0=(0.0,) * 9), "a parameter is out of its range"),
        (replace(PAPER, f0=(0.0, 1e39)), "a value is not finite"),
        (replace(PAPER, u_min_V=-1e39), "a value is not finite"),
        (replace(PAPER, u_max_V=1e39), "a value is not finite"),
        (replace(PAPER, f0=(np.nan,)), "a value is not finite"),
        (replace(LINE, breakpoints=LINE.breakpoints[::-1]), "a parameter is out of its range"),
        (replace(LINE, breakpoints=((0.0, 0.0),)), "a parameter is out of its range"),
        (
            replace(LINE, breakpoints=tuple((x / 10, 0.0) for x in range(101))),
            "an array is too long",
        ),
        # Two breakpoints that are one float.
        (
            replace(LINE, breakpoints=((0.0, 0.0), (5.0, 1.0), (5.00000001, 2.0), (10.0, 4.0))),
            "a parameter is out of its range",
        ),
    ],
)
@pytest.mark.filterwarnings("error")
def test_predictor_refuses_a_model(model: Model, reason: str) -> None:
    """What the core refuses comes back as its reason, without warnings of numpy."""
    with pytest.raises(InputError, match=f"^the model cannot be run: {reason}"):
        Predictor(model)


@pytest.mark.filterwarnings("error")
def test_predictor_refuses_a_command_that_float_cannot_hold() -> None:
    """1e300 V is an infinity in float; the double build clamps it."""
    y, status, _ = Predictor(PAPER, "float32").run_with_status([20.0, 1e300])
    assert status.tolist() == [0, -1]
    assert y[1] == y[0]
    assert Predictor(PAPER, "float64").run_with_status([1e300])[1].tolist() == [2]


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (lambda s: [], "not one that the model can be in"),
        (lambda s: s[:-1], "not one that the model can be in"),
        (lambda s: [*s, 0.0], "not one that the model can be in"),
        (lambda s: [*s[:-1], np.nan], "not finite"),
    ],
)
def test_predictor_refuses_a_state(damage: Callable[[Any], list[float]], reason: str) -> None:
    """A damaged state is refused and changes nothing."""
    predictor = Predictor(PAPER)
    predictor.run([30.0, 10.0, 20.0])
    before = predictor.save()
    with pytest.raises(InputError, match=f"^the state cannot be resumed: .*{reason}"):
        predictor.resume(damage(before))
    assert predictor.save().tobytes() == before.tobytes()


def test_a_missing_library_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The sentence says what to do."""
    monkeypatch.setattr(core, "_HERE", tmp_path)
    core.load.cache_clear()
    try:
        with pytest.raises(InputError, match=r"libmdl_f32\.so is missing: run `make`"):
            Predictor(PAPER)
    finally:
        core.load.cache_clear()


# model


@pytest.mark.parametrize("model", [PAPER, LINE, replace(PAPER, extra={"date": "2019-01-16"})])
def test_a_saved_model_is_loaded_as_it_was(model: Model, tmp_path: Path) -> None:
    """Also its further keys."""
    model.save(tmp_path / "model.json")
    assert load_model(tmp_path / "model.json") == model
    assert json.loads((tmp_path / "model.json").read_text())["schema"] == "madelung.model/1"


def test_a_model_that_json_cannot_hold_is_not_written(tmp_path: Path) -> None:
    """NaN is no JSON: the old file stays."""
    path = tmp_path / "model.json"
    PAPER.save(path)
    with pytest.raises(ValueError, match="JSON"):
        replace(PAPER, extra={"rms_um": np.nan}).save(path)
    assert load_model(path) == PAPER
    assert list(tmp_path.iterdir()) == [path]


POLYNOMIAL = PAPER.to_json()
BROKEN_LINE = LINE.to_json()
POINTS = [[0, 0], [4, 1], [10, 4]]


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        ([], "is not a JSON object"),
        (None, "is not a JSON object"),
        ({}, "schema is None"),
        (POLYNOMIAL | {"schema": "madelung.model/2"}, "schema is 'madelung.model/2'"),
        (POLYNOMIAL | {"schema": ["madelung.model/1"]}, "schema is"),
        (POLYNOMIAL | {"kind": "preisach"}, "kind is 'preisach'"),
        (POLYNOMIAL | {"kind": None}, "kind is None"),
        (POLYNOMIAL | {"kind": {}}, "kind is {}"),
        (POLYNOMIAL | {"u_min_V": None}, "u_min_V must hold finite numbers, found None"),
        (POLYNOMIAL | {"u_min_V": "0"}, "u_min_V must hold finite numbers, found '0'"),
        (POLYNOMIAL | {"u_min_V": True}, "u_min_V must hold finite numbers, found True"),
        (POLYNOMIAL | {"u_max_V": [40]}, "u_max_V must hold finite numbers"),
        (POLYNOMIAL | {"u_max_V": np.nan}, "u_max_V must hold finite numbers, found nan"),
        (POLYNOMIAL | {"u_max_V": np.inf}, "u_max_V must hold finite numbers, found inf"),
        (POLYNOMIAL | {"u_max_V": 10**400}, "u_max_V must hold finite numbers, found 10"),
        (POLYNOMIAL | {"u_min_V": 40.0}, r"u_max_V \(40\) must be above u_min_V \(40\)"),
        (POLYNOMIAL | {"u_min_V": 41}, "must be above"),
        (POLYNOMIAL | {"u_min_V": -1e308, "u_max_V": 1e308}, "must be above"),
        (POLYNOMIAL | {"f0": None}, "f0 must be a list"),
        (POLYNOMIAL | {"f0": {"0": 1.0}}, "f0 must be a list"),
        (POLYNOMIAL | {"f0": []}, "f0 has 0 coefficients, 1 to 8"),
        (POLYNOMIAL | {"f0": [0.0] * 9}, "f0 has 9 coefficients, 1 to 8"),
        (POLYNOMIAL | {"f0": [0.0, "x"]}, "f0 must hold finite numbers, found 'x'"),
        (POLYNOMIAL | {"f0": [[0.0]]}, "f0 must hold finite numbers"),
        (POLYNOMIAL | {"f0": [-np.inf]}, "f0 must hold finite numbers"),
        (BROKEN_LINE | {"breakpoints": None}, "breakpoints must be a list of 2 to 64"),
        (BROKEN_LINE | {"breakpoints": POINTS[:1]}, "breakpoints must be a list of 2 to 64"),
        (BROKEN_LINE | {"breakpoints": [[0, 0]] * 65}, "breakpoints must be a list of 2 to 64"),
        (BROKEN_LINE | {"breakpoints": [0, 10]}, "breakpoints must be a list"),
        (BROKEN_LINE | {"breakpoints": [[0, 0], [10]]}, "breakpoints must be pairs"),
        (BROKEN_LINE | {"breakpoints": [[0, 0], [10, None]]}, "breakpoints must hold finite"),
        (BROKEN_LINE | {"breakpoints": [[1, 0], [10, 1]]}, "must start at x = 0 and ascend"),
        (BROKEN_LINE | {"breakpoints": [*POINTS[:2], *POINTS[1:]]}, "must start at x = 0"),
        (BROKEN_LINE | {"breakpoints": POINTS[:2]}, r"the last breakpoint \(4 V\) must be u_max_V"),
    ],
)
def test_a_bad_model_is_refused(data: object, reason: str) -> None:
    """In one short sentence."""
    with pytest.raises(InputError, match=reason) as caught:
        model_from_json(data)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 120


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "is not a JSON file"),
        (b"u_V,y_um\n0,0\n", "is not a JSON file"),
        (b'{"schema": "madelung.model/1"', "is not a JSON file"),
        (b"\xff\xfe\x00", "is not a JSON file"),
        (b"[" * 100_000, "is not a JSON file"),
        (b'{"u_min_V": 1' + b"0" * 5000 + b"}", "is not a JSON file"),
        (b"{}", "schema is None"),
    ],
)
def test_a_bad_model_file_is_named(content: bytes, reason: str, tmp_path: Path) -> None:
    """The sentence starts with the file."""
    path = tmp_path / "model.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match=f"^{path}: .*{reason}"):
        load_model(path)


def test_a_model_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    """Missing, or a folder."""
    with pytest.raises(InputError, match="nothing: cannot be read: No such file"):
        load_model(tmp_path / "nothing")
    with pytest.raises(InputError, match="cannot be read: Is a directory"):
        load_model(tmp_path)


# files


def test_a_file_is_replaced_whole(tmp_path: Path) -> None:
    """UTF-8, the mode that the umask leaves, nothing else in the folder; a long name is fine."""
    path = tmp_path / ("m" * 250 + ".json")
    path.write_text("old", encoding="utf-8")
    umask = os.umask(0o027)
    try:
        write_atomically(path, "0.1 µm\n")
    finally:
        os.umask(umask)
    assert path.read_bytes() == "0.1 µm\n".encode()
    assert path.stat().st_mode & 0o777 == 0o640
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, InputError])
def test_a_failed_write_leaves_the_old_file(error: type[BaseException], tmp_path: Path) -> None:
    """And nothing half-written, also when there was no file before."""
    old, new = tmp_path / "old.csv", tmp_path / "new.csv"
    old.write_text("old", encoding="utf-8")
    for path in (old, new):
        with pytest.raises(error), replacing(path) as part:
            part.write_text("half", encoding="utf-8")
            assert part.suffix == ".csv"
            assert part.parent == tmp_path
            raise error
    assert list(tmp_path.iterdir()) == [old]
    assert old.read_text(encoding="utf-8") == "old"


def test_a_link_stays_and_its_file_is_replaced(tmp_path: Path) -> None:
    """Also when the file is in another folder, or not there yet."""
    folder = tmp_path / "folder"
    folder.mkdir()
    link = tmp_path / "link.json"
    link.symlink_to(folder / "model.json")
    for text in ("first", "second"):
        write_atomically(link, text)
        assert link.is_symlink()
        assert (folder / "model.json").read_text(encoding="utf-8") == text
    assert len(list(tmp_path.iterdir())) == 2


def test_what_is_no_regular_file_is_refused(tmp_path: Path) -> None:
    """A folder, a pipe, a missing folder, a file as a folder: said, and left alone."""
    folder, pipe, file = tmp_path / "folder", tmp_path / "pipe", tmp_path / "file"
    folder.mkdir()
    os.mkfifo(pipe)
    file.write_text("", encoding="utf-8")
    for path in (folder, pipe, tmp_path / "no" / "file.csv", file / "file.csv"):
        with pytest.raises(InputError, match=f"^{path}: cannot be written: "):
            write_atomically(path, "text")
    assert pipe.is_fifo()
    assert sorted(tmp_path.iterdir()) == [file, folder, pipe]
    assert list(folder.iterdir()) == []


def test_a_replacement_that_fails_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """For instance on a file system that has become read-only."""

    def refuse(self: Path, target: Path) -> Path:
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(Path, "replace", refuse)
    with pytest.raises(InputError, match="cannot be written: Read-only file system"):
        write_atomically(tmp_path / "model.json", "{}")
    assert list(tmp_path.iterdir()) == []


def test_blas_is_held_to_one_thread_before_numpy_is_loaded() -> None:
    told = (
        "import os, sys, madelung.commands; "
        "sys.exit('numpy' in sys.modules or os.environ['OPENBLAS_NUM_THREADS'] != '1')"
    )
    bare = {k: v for k, v in os.environ.items() if not k.endswith("_NUM_THREADS")}
    assert subprocess.run([sys.executable, "-c", told], env=bare).returncode == 0
