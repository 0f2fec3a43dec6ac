"""``madelung blind``: trials of the diagnosis on cases whose labels are sealed."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Annotated

import typer

from madelung.errors import InputError

app = typer.Typer(help="Try the diagnosis on cases whose labels are sealed, and score it.")

_WORKERS = typer.Option(min=1, max=256, help="Processes on this machine (default: its cores).")
_FOLDER = typer.Argument(help="The trial, or a folder that holds cases.")
_RESULTS = typer.Option("--output", "-o", help="Folder for answers and card (default: the trial).")


@app.command()
def deal(
    output: Annotated[Path, typer.Option("--output", "-o", help="New folder for the trial.")],
    cases: Annotated[int, typer.Option(min=1, max=100_000, help="How many cases.")] = 60,
    left_out: Annotated[
        int,
        typer.Option(
            min=0,
            max=100_000,
            help="How many more, whose cause is taken out of the diagnosis's library: they must "
            "come out unknown.",
        ),
    ] = 0,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0, help="Decides everything; below 10000: for tuning, no trial (default: drawn)."
        ),
    ] = None,
    rows: Annotated[
        int,
        typer.Option(min=5000, max=100_000, help="Most rows of a case's training records."),
    ] = 100_000,
    key_file: Annotated[
        Path | None,
        typer.Option(help="File for the key, outside the trial, instead of printing it."),
    ] = None,
    workers: Annotated[int | None, _WORKERS] = None,
) -> None:
    """Simulate cases, each with a cause, two, none, or one that has no name; seal the labels."""
    from madelung.blind.trial import deal as run
    from madelung.files import write_atomically

    if key_file is not None and output.resolve() in key_file.resolve().parents:
        raise InputError(f"{key_file}: lies in the trial: keep key and labels apart")
    if key_file is not None and key_file.exists():
        raise InputError(f"{key_file}: exists already: it may be another trial's key")
    key, bound = run(output, cases, seed, left_out, rows, workers or os.cpu_count() or 1)
    typer.echo(f"{output}: {cases + left_out} cases")
    for name, value in bound.items():
        typer.echo(f"{name}: {value}")
    if key_file is None:
        typer.echo(f"key, kept nowhere else: {key}")
    else:
        write_atomically(key_file, f"{key}\n")
        typer.echo(f"{key_file}: the key")


@app.command()
def answer(
    trial: Annotated[Path, _FOLDER],
    output: Annotated[Path | None, _RESULTS] = None,
    workers: Annotated[int | None, _WORKERS] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(help="A running Dask cluster instead of this machine: tcp://host:port."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of every diagnosis.")] = 0,
) -> None:
    """Diagnose every case and commit to the answers. Killed, the next call goes on."""
    import time

    from rich.console import Console
    from rich.progress import Progress

    from madelung.blind.answer import answer as run
    from madelung.blind.trial import Trial

    began = time.perf_counter()
    counts: list[int] = []
    err = Console(stderr=True)
    with Progress(console=err, transient=True, disable=not err.is_terminal) as progress:
        bar = progress.add_task("cases", total=None)

        def told(done: int, total: int) -> None:
            counts.append(done)
            progress.update(bar, completed=done, total=total)

        bound = run(
            Trial(trial, output or trial),
            workers or os.cpu_count() or 1,
            scheduler,
            seed,
            told=told,
        )
    minutes = (time.perf_counter() - began) / 60.0
    new = counts[-1] - counts[0]
    typer.echo(f"{counts[-1]} cases answered, {new} now: {new / minutes:.1f} cases per minute")
    typer.echo(f"SHA-256 of the answers: {bound}")


@app.command(name="open")
def open_(
    trial: Annotated[Path, _FOLDER],
    key: Annotated[
        str | None, typer.Option(help="The key that was printed, or the file that holds it.")
    ] = None,
    labels: Annotated[
        Path | None,
        typer.Option(
            help='Labels that are not sealed: JSON, case to {"effects": [...]}, or a folder of '
            "<case>.labels.json."
        ),
    ] = None,
    output: Annotated[Path | None, _RESULTS] = None,
) -> None:
    """Check both commitments, score the answers, write card.html and card.json."""
    from rich.console import Console

    from madelung.blind.card import terminal, write_card
    from madelung.blind.score import read_answers, score
    from madelung.blind.trial import Trial, check_answers, open_labels, read_labels

    place = Trial(trial, output or trial)
    committed = check_answers(place)
    told = {"answers": committed["sha256"]} | {k: committed[k] for k in ("versions", "sources")}
    if labels is not None and key is None:
        truth = read_labels(labels)
    elif key is not None and labels is None:
        opened = open_labels(place, _key(key))
        truth = opened["cases"]
        told |= {"seed": opened["seed"], "labels": json.loads(place.sealed.read_text())["sha256"]}
    else:
        raise InputError("give either --key, for sealed labels, or --labels")
    card = score(truth, read_answers(place, truth)) | {"commitments": told}
    write_card(place.results, card)
    Console().print(terminal(card))
    typer.echo(str(place.results / "card.html"))


def _key(told: str) -> str:
    """A key, or what is in the file that holds it."""
    path = Path(told)
    try:
        return path.read_text(encoding="utf-8").strip() if path.is_file() else told
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
