"""``madelung timing``: how long the firmware computes, from a capture of its pin."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def timing(
    capture: Annotated[
        Path,
        typer.Argument(
            help="The pin over time: VCD (sigrok, PulseView, the emulated board), or CSV as "
            "Saleae's Logic exports it. High while a sample is computed."
        ),
    ],
    pin: Annotated[
        str | None, typer.Option(help="The channel of the pin, if the capture has several.")
    ] = None,
    record: Annotated[
        Path | None,
        typer.Option(
            help="The inputs of these cycles, one each, from rest on: CSV with a column `code`, or "
            "a record with u_V, whose lowest voltage is taken for u_min. Gives the comparisons p."
        ),
    ] = None,
    budget: Annotated[
        str | None,
        typer.Option(help="Exit with code 1 if the longest computation takes longer: 10us."),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Write the result here, JSON.")
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(help="Draw the pin about the longest cycle, and time against p, here, PNG."),
    ] = None,
) -> None:
    """Time per cycle, its maximum and the input that causes it, jitter and missed cycles."""
    import json

    from madelung.commands.common import keep_inputs, say, working
    from madelung.files import write_atomically
    from madelung.timing import analyse, parse_time, read_capture, read_inputs, summary

    keep_inputs([capture, *([] if record is None else [record])], output, plot)
    budget_s = None if budget is None else parse_time(budget)
    with working("reading"):
        read = read_capture(capture, pin)
        inputs = None if record is None else read_inputs(record)
    found = analyse(read, inputs)
    if plot is not None:
        from madelung.timing_plot import draw_timing

        with working("drawing"):
            draw_timing(plot, found)
    if output is not None:
        write_atomically(output, json.dumps(found.to_json(budget_s), indent=1) + "\n")
    say([], summary(found, budget_s))
    if budget_s is not None and found.maximum_s > budget_s:
        raise SystemExit(1)
