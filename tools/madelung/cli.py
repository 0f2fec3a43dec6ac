"""The command ``madelung``."""

from __future__ import annotations

import sys

import typer
from typer.exceptions import TyperException

from madelung import __version__
from madelung.commands import blind
from madelung.commands.diagnose import diagnose
from madelung.commands.export import export
from madelung.commands.identify import identify
from madelung.commands.predict import predict
from madelung.commands.report import report
from madelung.commands.reproduce import reproduce
from madelung.commands.simulate import simulate, unseal
from madelung.commands.timing import timing
from madelung.errors import InputError

app = typer.Typer(
    help="Predict a piezo actuator's displacement open loop, and find out why reality differs.",
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


app.command()(identify)
app.command()(predict)
app.command()(reproduce)
app.command()(diagnose)
app.command()(report)
app.command()(export)
app.command()(simulate)
app.command()(unseal)
app.command()(timing)
app.add_typer(blind.app, name="blind")


def main() -> None:
    """Run the command; exit code 0 done, 2 bad input or usage (one line), 1 anything else."""
    try:
        interrupted = app(prog_name="madelung", standalone_mode=False)
    except (InputError, TyperException) as error:
        print(f"madelung: {_one_line(error)}", file=sys.stderr)
        sys.exit(2)
    if interrupted:
        print("madelung: interrupted", file=sys.stderr)
        sys.exit(1)


def _one_line(error: InputError | TyperException) -> str:
    if isinstance(error, InputError):
        return " ".join(str(error).split())
    context = getattr(error, "ctx", None)
    command = context.command_path if context else "madelung"
    message = " ".join(error.format_message().split()).removesuffix(".")
    return f"{message}: see `{command} --help`"


if __name__ == "__main__":
    main()
