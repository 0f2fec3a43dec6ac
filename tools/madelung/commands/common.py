"""What the commands share: progress, the time window, and how they speak."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

import typer

from madelung.errors import InputError


def working(doing: str) -> AbstractContextManager[object]:
    """A spinner on stderr while something long runs; nothing when stderr is no terminal."""
    import sys

    if not sys.stderr.isatty():
        return nullcontext()
    from rich.console import Console

    return Console(stderr=True).status(doing)


def keep_inputs(inputs: Iterable[Path], *outputs: Path | None) -> None:
    """Refuse to write over what is read."""
    read = {_real(path) for path in inputs}
    for output in outputs:
        if output is not None and _real(output) in read:
            raise InputError(f"{output}: is read by this command; write to another file")


def _real(path: Path) -> Path:
    try:
        return path.resolve()
    except RuntimeError as error:
        raise InputError(f"{path}: a symbolic link that leads back to itself") from error


def window(from_s: float | None, to_s: float | None) -> tuple[float, float]:
    """The options --from and --to, s; without them all of time."""
    first = -float("inf") if from_s is None else from_s
    last = float("inf") if to_s is None else to_s
    for option, value in (("--from", first), ("--to", last)):
        if value != value:
            raise InputError(f"{option} is not a number: give seconds of the record's time")
    if not last > first:
        raise InputError(f"--to ({last:g} s) must be after --from ({first:g} s)")
    return first, last


def say(warnings: Iterable[str], result: Iterable[str]) -> None:
    """Warnings on stderr, the result on stdout, a line each."""
    for line in warnings:
        typer.echo(f"madelung: warning: {line}", err=True)
    for line in result:
        typer.echo(line)
