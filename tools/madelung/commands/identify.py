"""``madelung identify``: a model from measured loops."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from madelung.errors import InputError


class Kind(StrEnum):
    """Kinds of model that can be asked for."""

    MADELUNG = "madelung"
    YANG2015 = "yang2015"


def identify(
    records: Annotated[
        list[Path],
        typer.Argument(
            metavar="RECORD",
            help="CSV, .mat or .h5 with t_s, u_V, y_um: a slow triangle or sine over the whole "
            "range, two cycles or more. Several records of one device are averaged. For yang2015: "
            "steady sines of one amplitude at several frequencies, four cycles or more each.",
        ),
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="Write the model here, JSON.")],
    degree: Annotated[
        str, typer.Option(help="Of the polynomial f0, 0 to 7, or auto: by cross-validation.")
    ] = "auto",
    kind: Annotated[Kind, typer.Option("--model", help="Kind of the model.")] = Kind.MADELUNG,
    operators: Annotated[int, typer.Option(help="yang2015: number of play operators.")] = 10,
    harmonics: Annotated[
        int, typer.Option(help="yang2015: 1 for a model of sines, 9 for one of triangles.")
    ] = 1,
    u_min: Annotated[
        float | None, typer.Option(help="Lowest command, V (default: the lowest recorded).")
    ] = None,
    u_max: Annotated[
        float | None, typer.Option(help="Highest command, V (default: the highest recorded).")
    ] = None,
    from_s: Annotated[
        float | None, typer.Option("--from", help="Fit only rows from this time on, s.")
    ] = None,
    to_s: Annotated[
        float | None, typer.Option("--to", help="Fit only rows up to this time, s.")
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the fit here, PNG.")] = None,
    html: Annotated[
        Path | None, typer.Option(help="Write the fit here as an interactive page, HTML.")
    ] = None,
) -> None:
    """Identify a model from slow loops over the whole range.

    The descending branch is mapped onto the ascending one by central symmetry, and a polynomial is
    fitted to both (Cao & Li 2019, section 2.3). A record that does not begin at its lowest voltage
    begins in mid motion: its first full swing is left out.

    yang2015: the play operators from the slowest record, then k, c and m from every record and as
    polynomials of the frequency (Yang et al. 2015, section 4.2).
    """
    if kind is Kind.YANG2015:
        if degree != "auto" or html is not None or (u_min, u_max) != (None, None):
            raise InputError("--degree, --html, --u-min and --u-max are for --model madelung")
        window_s = (from_s, to_s)
        return _identify_yang(records, output, operators, harmonics, window_s, plot)
    wanted = _degree(degree)

    from madelung.commands.common import keep_inputs, say, window, working
    from madelung.identify import identify as run
    from madelung.identify import summary
    from madelung.records import read_record

    keep_inputs(records, output, plot, html)
    with working("reading"):
        read = [read_record(path) for path in records]
    with working("identifying"):
        found = run(read, wanted, u_min, u_max, *window(from_s, to_s))
    if plot is not None:
        from madelung.plots import draw_identification

        with working("drawing"):
            draw_identification(plot, found)
    if html is not None:
        from madelung.pages import write_identification

        with working("drawing"):
            write_identification(html, found)
    found.model.save(output)
    say(found.warnings, [str(output), *summary(found)])


def _identify_yang(
    records: list[Path],
    output: Path,
    operators: int,
    harmonics: int,
    window_s: tuple[float | None, float | None],
    plot: Path | None,
) -> None:
    from madelung.commands.common import keep_inputs, say, window, working
    from madelung.records import read_record
    from madelung.yang2015_identify import identify_yang, summary

    keep_inputs(records, output, plot)
    with working("reading"):
        read = [read_record(path) for path in records]
    with working("identifying"):
        found = identify_yang(read, operators, harmonics, *window(*window_s))
    if plot is not None:
        from madelung.yang2015_plots import draw_rates

        with working("drawing"):
            draw_rates(plot, found)
    found.model.save(output)
    say(found.warnings, [str(output), *summary(found)])


def _degree(text: str) -> int | None:
    if text == "auto":
        return None
    if text not in list("01234567"):
        raise InputError(f"--degree is {text!r}: give 0 to 7, or auto")
    return int(text)
