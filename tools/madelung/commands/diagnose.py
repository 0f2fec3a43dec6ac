"""``madelung diagnose``: why a predictor and a measured actuator differ."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from madelung.errors import InputError


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

    err = Console(stderr=True)
    flashed = None if model is None else load_model(model)
    if flashed is not None and flashed.kind in ("major_curve", "yang2015"):
        raise InputError(f"{model}: is of kind {flashed.kind}; --model needs a polynomial f0")
    with err.status("reading the case") as status:
        told = status.update if err.is_terminal else lambda _: None
        loaded = load_case(case)
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
