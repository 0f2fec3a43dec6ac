"""``madelung export``: a model becomes the firmware's parameters."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer


def export(
    model: Annotated[
        Path, typer.Argument(help="model.json of `madelung identify` or `madelung diagnose`.")
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder for mdl_params.h and mdl_params.c.")
    ],
    rate: Annotated[int, typer.Option(help="Sample rate of the firmware, Hz.")] = 10_000,
    input_min: Annotated[
        float | None, typer.Option(help="Drive voltage at ADC code 0, V (default: u_min_V).")
    ] = None,
    input_max: Annotated[
        float | None, typer.Option(help="Drive voltage at ADC code 4095, V (default: u_max_V).")
    ] = None,
    output_min: Annotated[
        float | None, typer.Option(help="Displacement at DAC code 0, um (default: least of f0).")
    ] = None,
    output_max: Annotated[
        float | None, typer.Option(help="Displacement at DAC code 4095, um (default: most of f0).")
    ] = None,
) -> None:
    """Write a model as C data for the firmware: mdl_params.h and mdl_params.c."""
    from madelung.commands.common import say
    from madelung.export import default_scaling, fitting, write_params
    from madelung.model import load_model

    loaded = load_model(model)
    scaling = default_scaling(loaded, rate)
    u_low, u_high = scaling.input_V
    y_low, y_high = scaling.output_um
    scaling = replace(
        scaling,
        input_V=(
            u_low if input_min is None else input_min,
            u_high if input_max is None else input_max,
        ),
        output_um=(
            y_low if output_min is None else output_min,
            y_high if output_max is None else output_max,
        ),
    )
    write_params(loaded, scaling, output)
    left_out = [f"not in the firmware: {line}" for line in fitting(loaded, rate)[1]]
    say(left_out, [f"{output / 'mdl_params.c'}: {rate} Hz"])
