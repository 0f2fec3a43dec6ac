"""``madelung diagnose``: why a predictor and a measured actuator differ."""

from __future__ import annotations

import os
import shlex
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from madelung.errors import InputError

if TYPE_CHECKING:
    from madelung.diagnosis.case import Case
    from madelung.model import Model


def diagnose(
    case: Annotated[
        Path,
        typer.Argument(help="Folder with case.json, identify.csv, train/*.csv, holdout/*.csv."),
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for the results.")],
    jobs: Annotated[int, typer.Option(min=1, max=64, help="Hypotheses fitted side by side.")] = 2,
    seed: Annotated[int, typer.Option(min=0, help="Of the intervals' resampling.")] = 0,
    model: Annotated[
        Path | None,
        typer.Option(help="Diagnose this model.json, not one identified from identify.csv."),
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(min=0.0, help="Good enough below this gap, percent of the stroke, rms."),
    ] = None,
    check: Annotated[
        bool,
        typer.Option(
            "--check", help="Fit no effect; say the smallest size that the data would show."
        ),
    ] = False,
) -> None:
    """Find where the gap between prediction and measurement lies, its causes, how far it shrinks.

    The hold-out records are used for nothing but measuring the shrinkage.
    """
    from rich.console import Console

    from madelung.diagnosis.case import load_case
    from madelung.diagnosis.diagnose import Options
    from madelung.diagnosis.diagnose import diagnose as run
    from madelung.diagnosis.output import write
    from madelung.diagnosis.report import terminal
    from madelung.model import load_model

    _keep_records(case, output)
    err = Console(stderr=True)
    with err.status("reading the case") as status:
        told = status.update if err.is_terminal else lambda _: None
        flashed = None if model is None else load_model(model)
        if flashed is not None and flashed.kind in ("major_curve", "yang2015"):
            raise InputError(f"{model}: is of kind {flashed.kind}; --model needs a polynomial f0")
        loaded = load_case(case, flashed is not None)
        if flashed is not None:
            loaded = _as_flashed(loaded, flashed, model)
        found = run(loaded, Options(jobs, seed, flashed, tolerance, check), told)
        told("drawing and writing")
        again = ["madelung", "diagnose", str(case), "-o", str(output), "--seed", str(seed)]
        again += [] if model is None else ["--model", str(model)]
        again += [] if tolerance is None else ["--tolerance", f"{tolerance:g}"]
        again += ["--check"] if check else []
        content = write(output, loaded, found, shlex.join(again), seed)
    for warning in content["warnings"]:
        typer.echo(f"madelung: warning: {warning}", err=True)
    Console().print(terminal(content))
    typer.echo(str(output / "report.html"))


def _keep_records(case: Path, output: Path) -> None:
    """Refuse a folder for the results that holds measured records."""
    if os.path.realpath(output) in {os.path.realpath(case / p) for p in ("", "train", "holdout")}:
        raise InputError(f"{output}: holds the case's records: give another folder for the results")
    parts = ("case.json", "holdout", "diagnosis.json")
    held = {n for n in parts if os.path.exists(output / n)}  # noqa: PTH110 - any name is asked
    if "case.json" in held:
        raise InputError(f"{output}: holds a case: give another folder for the results")
    if "holdout" in held and "diagnosis.json" not in held:
        raise InputError(f"{output}: its holdout is of no diagnosis: give another folder")


def _as_flashed(case: Case, model: Model, path: Path | None) -> Case:
    """The case over the range of the model that was flashed."""
    from madelung.identify import check_unit, stroke_of
    from madelung.model import MARGIN_SHARE

    ends = (model.u_min_V - case.u_min_V, model.u_max_V - case.u_max_V)
    if max(map(abs, ends)) > MARGIN_SHARE * case.range_V:
        raise InputError(
            f"{path}: is of {model.u_min_V:g}..{model.u_max_V:g} V, "
            f"the case of {case.u_min_V:g}..{case.u_max_V:g} V"
        )
    y_um = case.identify.y_um[case.identify.use]
    moved = float(y_um.max() - y_um.min())
    said = check_unit(f"{case.identify.record.name}: y", moved, stroke_of(model))
    warnings = [*case.warnings, *said]
    return replace(case, u_min_V=model.u_min_V, u_max_V=model.u_max_V, warnings=warnings)
