"""``madelung predict``: a model run over a record."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def predict(
    model: Annotated[Path, typer.Argument(help="model.json, as `madelung identify` writes it.")],
    record: Annotated[
        Path,
        typer.Argument(
            help="CSV, .mat or .h5 with t_s, u_V and, where measured, y_um. It begins at rest."
        ),
    ],
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="Write t_s,u_V,(y_um,)predicted_um here, CSV."),
    ],
    reference: Annotated[
        bool,
        typer.Option("--reference", help="Compute in float64 instead of the firmware's float."),
    ] = False,
    running: Annotated[
        bool,
        typer.Option(
            "--running",
            help="The record begins in mid motion: compare only after it was at both of its ends.",
        ),
    ] = False,
    from_s: Annotated[
        float | None, typer.Option("--from", help="Compare only rows from this time on, s.")
    ] = None,
    to_s: Annotated[
        float | None, typer.Option("--to", help="Compare only rows up to this time, s.")
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(help="Draw loop, displacement, error and turning points here, PNG."),
    ] = None,
) -> None:
    """Predict the displacement for every row of a record, and compare where it was measured.

    It computes what the firmware computes, bit for bit, unless --reference is given.
    """
    from madelung.commands.common import keep_inputs, say, window, working
    from madelung.model import load_model
    from madelung.predict import predict as run
    from madelung.predict import summary
    from madelung.records import read_record, write_columns

    keep_inputs([model, record], output, plot)
    loaded = load_model(model)
    with working("reading"):
        read = read_record(record)
    with working("predicting"):
        found = run(
            loaded, read, "float64" if reference else "float32", running, *window(from_s, to_s)
        )
    if plot is not None:
        from madelung.plots import draw_prediction

        with working("drawing"):
            draw_prediction(plot, found)
    with working("writing"):
        write_columns(output, found.columns())
    say(found.warnings, [str(output), *summary(found)])
