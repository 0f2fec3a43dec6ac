"""The command ``madelung``."""

from __future__ import annotations

import sys

import typer

from madelung import __version__
from madelung.commands.export import export
from madelung.errors import InputError

app = typer.Typer(
    help="Predict a piezo actuator's displacement open loop, and find out why reality differs.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"madelung {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Print the version and exit."
    ),
) -> None:
    pass


app.command()(export)


def main() -> None:
    """Run the command; exit code 0 done, 2 bad input or usage (one line), 1 anything else."""
    try:
        app()
    except InputError as error:
        print(f"madelung: {error}".replace("\n", " "), file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
