"""``madelung reproduce``: a paper's results beside ours."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from madelung.errors import InputError

if TYPE_CHECKING:
    from madelung.reproduce import Row


class Paper(StrEnum):
    """Papers that can be reproduced."""

    CAO2019 = "cao2019"
    YANG2015 = "yang2015"


def reproduce(
    paper: Annotated[
        Paper,
        typer.Argument(
            help="cao2019: Cao & Li, Sensors 2019, 19, 352. yang2015: Yang, Li, Gu & Zhu, a "
            "modified Prandtl-Ishlinskii model for rate-dependent hysteresis."
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="Write table.md, table.json and the figures here, PNG (folder)."
        ),
    ] = None,
    timing: Annotated[
        list[Path] | None,
        typer.Option(
            help="cao2019: times by p for Fig. 8, from `madelung timing --record -o`; repeatable."
        ),
    ] = None,
) -> None:
    """Compute a paper's results, and print them beside the paper's.

    agrees: ours confirms the paper's. differs: it does not, and the note says why. not comparable:
    it depends on something that only the authors have.
    """
    rows = _yang2015(output, timing) if paper is Paper.YANG2015 else _cao2019(output, timing)
    _print(rows)
    if output is not None:
        typer.echo(str(output))


def _cao2019(output: Path | None, timing: list[Path] | None) -> tuple[Row, ...]:
    from madelung.commands.common import working
    from madelung.reproduce import load_cost, reproduce, write

    costs = tuple(map(load_cost, timing or []))
    with working("computing"):
        found = reproduce(costs)
    if output is not None:
        with working("drawing"):
            write(output, found)
    return found.rows


def _yang2015(output: Path | None, timing: list[Path] | None) -> tuple[Row, ...]:
    from madelung.commands.common import working
    from madelung.reproduce import make_folder
    from madelung.reproduce_yang import reproduce_yang, write

    if timing:
        raise InputError("--timing is for cao2019")
    if output is not None:
        make_folder(output)
    with working("computing"):
        found = reproduce_yang()
    if output is not None:
        with working("drawing"):
            write(output, found)
    return found.rows


def _print(rows: tuple[Row, ...]) -> None:
    from rich.console import Console
    from rich.table import Table

    from madelung.reproduce import verdict

    console = Console()
    if not console.is_terminal:
        console = Console(width=140)
    table = Table("where", "what", "paper", "ours", "", show_edge=False)
    for row in rows:
        table.add_row(row.where, row.what, row.paper, row.ours, verdict(row))
    console.print(table)
    for row in rows:
        if row.note:
            typer.echo(f"{row.where}, {row.what}: {row.note}")
