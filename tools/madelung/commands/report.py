"""``madelung report``: several diagnoses on one page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def report(
    diagnoses: Annotated[
        list[Path],
        typer.Argument(
            metavar="OUT...",
            help="Folders that `madelung diagnose` wrote, in the order of the page; two are told "
            "as before and after.",
        ),
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="The page to write, HTML.")],
) -> None:
    """Compare diagnoses on one page: before and after a repair, the devices of a batch."""
    from madelung.commands.common import keep_inputs
    from madelung.diagnosis.compare import write_comparison

    keep_inputs([d / name for d in diagnoses for name in ("diagnosis.json", "report.html")], output)
    for compared in write_comparison(output, diagnoses):
        typer.echo(f"{compared.name}: {compared.verdict}")
    typer.echo(str(output))
