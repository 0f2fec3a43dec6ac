"""OUT of a diagnosis: diagnosis.json, models, predictions, pictures and the page."""

from __future__ import annotations

import json
import platform
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from madelung import __version__
from madelung.blocks import Block
from madelung.diagnosis.case import Case, Trace
from madelung.diagnosis.diagnose import Diagnosis
from madelung.diagnosis.holdout import Prediction
from madelung.diagnosis.parameters import reported
from madelung.diagnosis.pictures import View, draw
from madelung.diagnosis.report import write_report
from madelung.errors import InputError
from madelung.export import default_scaling, write_params
from madelung.files import write_atomically
from madelung.model import Model
from madelung.path import SignalPath, augmented_model
from madelung.records import write_columns

STALE_S = 3600.0


def write(out: Path, case: Case, found: Diagnosis, command: str, seed: int) -> dict[str, Any]:
    """Write everything, whole or not at all; returns the content of diagnosis.json.

    Raises
    ------
    InputError
        The folder cannot be made or written.
    """
    content = found.content | {
        "case": {"device": case.device, "u_min_V": case.u_min_V, "u_max_V": case.u_max_V},
        "records": [_file(t) for t in (case.identify, *case.train, *case.holdout)],
        "seed": seed,
        "command": command,
        "versions": {
            "madelung": __version__,
            "python": platform.python_version(),
            "numpy": np.__version__,
            "scipy": scipy.__version__,
        },
    }
    with _folder(out) as part:
        write_atomically(part / "diagnosis.json", json.dumps(content, indent=1, allow_nan=False))
        _write_models(part, case, found)
        (part / "holdout").mkdir()
        for p in found.predictions:
            if p.trace.role == "holdout":
                write_columns(part / "holdout" / f"{p.trace.name}.csv", _columns(p))
        views = [_view(p) for p in found.predictions]
        draw(part, views, found.noise, content)
        write_report(part, content, views, found.noise)
    return content


def _file(trace: Trace) -> dict[str, Any]:
    """A record that was read, for who wants to know what the diagnosis rests on."""
    return {
        "file": Path(trace.record.name).name,
        "role": trace.role,
        "rows": trace.record.t_s.size,
        "rate_hz": 1.0 / trace.step_s,
        "seconds": trace.u_V.size * trace.step_s,
    }


@contextmanager
def _folder(out: Path) -> Iterator[Path]:
    """A folder beside ``out`` whose content takes its place when the block ends well."""
    prefix = f".{out.name}.madelung-"
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        _remove_stale(out.parent, prefix)
        part = Path(tempfile.mkdtemp(prefix=prefix, dir=out.parent))
    except OSError as error:
        raise InputError(f"{out}: cannot be made: {error.strerror}") from error
    try:
        yield part
        part.chmod(0o755)
        if out.is_dir():
            _exchange(part, out)
        else:
            part.replace(out)
    except OSError as error:
        raise InputError(f"{out}: cannot be written: {error.strerror or error}") from error
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _remove_stale(folder: Path, prefix: str) -> None:
    """What killed runs left; writing takes seconds, so none of a living one is an hour old."""
    with suppress(OSError):  # tidying is not what was asked for
        for old in folder.iterdir():
            if old.name.startswith(prefix) and time.time() - old.lstat().st_mtime > STALE_S:
                shutil.rmtree(old, ignore_errors=True)


def _exchange(part: Path, out: Path) -> None:
    """Put a result in the place of an earlier one; what is not of a diagnosis stays."""
    for new in part.iterdir():
        old = out / new.name
        if old.is_dir() and not old.is_symlink():
            shutil.rmtree(old)
        new.replace(old)


def _write_models(out: Path, case: Case, found: Diagnosis) -> None:
    ends = (case.u_min_V, case.u_max_V)
    path = found.problem.path((), {}, found.baseline.beta)
    flashed = augmented_model(path, ends[1])
    plain = Model("madelung", *ends, f0=path.f0)
    (flashed if flashed.blocks else plain).save(out / "model_baseline.json")
    augmented = _augmented(found, ends)
    augmented.save(out / "model_augmented.json")
    write_params(augmented, default_scaling(augmented), out / "firmware")


def _augmented(found: Diagnosis, ends: tuple[float, float]) -> Model:
    """The accepted hypothesis as a model: what an open loop can run, and what it cannot."""
    best = found.best
    full = found.problem.fit(best.forms, best.values, best.beta, 1)
    path = found.problem.path(best.forms, best.values, best.beta)
    beside = {
        form.effect: {k: v["value"] for k, v in reported(form.effect, full, found.problem).items()}
        for form in best.forms
        if form.path is None
    }
    path = _calibrated(path, **beside.pop("gain_offset", {}))
    names = {f.effect: f.name for f in best.forms}
    start = beside.pop("initial_state", None)
    kept = [Block(effect, names[effect], values) for effect, values in beside.items()]
    return augmented_model(path, ends[1], names, start, kept)


def _calibrated(path: SignalPath, gain: float = 1.0, offset_um: float = 0.0) -> SignalPath:
    """The path behind one more change of the sensor's calibration."""
    return path.but(gain=gain * path.gain, offset_um=gain * path.offset_um + offset_um)


def _columns(p: Prediction) -> dict[str, Any]:
    """Every row of the file, on its own time stamps."""
    record, rows = p.trace.record, p.trace.rows
    assert record.y is not None
    return {
        "t_s": record.t_s,
        "u_V": record.u_V,
        "y_um": record.y,
        "baseline_um": p.baseline_um[rows],
        "augmented_um": p.augmented_um[rows],
    }


def _view(p: Prediction) -> View:
    t = p.trace
    start = float(t.record.t_s[0])
    return View(t.name, t.role, start + t.t_s, t.u_V, t.y_um, p.baseline_um, p.augmented_um)
