"""Answers to a trial: every case diagnosed by itself, in processes that see nothing else."""

from __future__ import annotations

import json
import logging
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from madelung.blind.trial import Trial, commit_answers, versions
from madelung.errors import InputError
from madelung.files import read_json, write_atomically

Files = dict[str, bytes]
"""A case: path within its folder to content."""
Answerer = Callable[[Files, int], dict[str, Any]]
"""Case and seed to answer."""
_IN_FLIGHT = 2
"""Cases that are on their way to each worker."""


def diagnose_files(files: Files, seed: int) -> dict[str, Any]:
    """Diagnose a case that comes as its files; whatever happens is an answer.

    Returns
    -------
    ``status`` (``answered``, ``refused``: bad input, ``failed``), ``seconds``; where answered
    ``diagnosis`` (content of diagnosis.json), ``holdout`` (rows, rms before and after, um, as the
    predictions give it), ``rivals`` (see `madelung.blind.rivals.pick`); else ``error``.
    """
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        case = Path(folder) / "case"
        for name, content in files.items():
            path = case / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        try:
            told = {"status": "answered"} | _diagnosed(case, seed)
        except InputError as error:
            told = {"status": "refused", "error": str(error).replace(f"{case}/", "")}
        except Exception as error:  # a fault of ours: the trial goes on and counts it
            told = {"status": "failed", "error": f"{type(error).__name__}: {error}"}
    return told | {"seconds": round(time.perf_counter() - began, 3)}


def _diagnosed(case: Path, seed: int) -> dict[str, Any]:
    from madelung.blind.rivals import pick
    from madelung.diagnosis.case import load_case
    from madelung.diagnosis.diagnose import Options, diagnose

    found = diagnose(load_case(case), Options(jobs=1, seed=seed))
    train, holdout = (
        [p for p in found.predictions if p.trace.role == role] for role in ("train", "holdout")
    )
    off = [
        np.stack([p.baseline_um - p.trace.y_um, p.augmented_um - p.trace.y_um])[:, p.trace.use]
        for p in holdout
    ]
    before, after = np.concatenate([np.zeros((2, 0)), *off], axis=1)
    gaps = [
        (t.u_V[t.use], p.baseline_um[t.use], (t.y_um - p.baseline_um)[t.use], t.step_s)
        for p in train
        for t in (p.trace,)
    ]
    return {
        "diagnosis": json.loads(json.dumps(found.content, allow_nan=False)),
        "holdout": {
            "rows": before.size,
            "before_um": _rms(before),
            "after_um": _rms(after),
        },
        "rivals": pick(gaps),
    }


def _rms(values: np.ndarray[Any, Any]) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def answer(
    trial: Trial,
    workers: int,
    scheduler: str | None = None,
    seed: int = 0,
    answerer: Answerer = diagnose_files,
    told: Callable[[int, int], None] = lambda done, total: None,
) -> str:
    """Answer every case that has no answer yet, then commit to all answers.

    Each answer is written whole, as soon as it is there: after a kill, the next call goes on.

    Parameters
    ----------
    workers
        Processes on this machine.
    scheduler
        Address of a running Dask cluster, ``tcp://...``, instead; it needs madelung, but none of
        the trial's files.
    answerer
        Runs on the workers.
    told
        Is told the cases done, and all.

    Returns
    -------
    The SHA-256 of all answers.

    Raises
    ------
    InputError
        The answers are committed already, the scheduler cannot be reached, or a file cannot be
        written.
    """
    if trial.committed.exists():
        raise InputError(f"{trial.committed}: exists: a trial is answered once")
    cases = trial.cases
    folder = trial.results / "answers"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror}") from error
    for stale in folder.glob(".madelung-*"):  # of an answer that was being written
        stale.unlink()
    left = [case for case in cases if not trial.answer(case.name).exists()]
    told(len(cases) - len(left), len(cases))
    own = versions()
    if left:
        with _client(min(workers, len(left)), scheduler) as client:
            for done, (case, found) in enumerate(_answers(client, left, answerer, seed), 1):
                whole = {"case": case.name} | dict(found) | {"versions": own}
                write_atomically(trial.answer(case.name), json.dumps(whole, indent=1) + "\n")
                told(len(cases) - len(left) + done, len(cases))
    answers = [read_json(trial.answer(case.name)) for case in cases]
    sources = {str(a.get("versions", own)["source"]) for a in answers}  # a resumed trial may mix
    return commit_answers(trial, {"seed": seed, "versions": own, "sources": sorted(sources)})


def _answers(
    client: Any, cases: list[Path], answerer: Answerer, seed: int
) -> Iterator[tuple[Path, Mapping[str, Any]]]:
    """Answers as they come; few cases are on their way at a time."""
    from distributed import KilledWorker, as_completed

    def submitted(case: Path) -> Any:
        files = {str(p.relative_to(case)): p.read_bytes() for p in case.rglob("*") if p.is_file()}
        future = client.submit(answerer, files, seed, pure=False)
        place[future.key] = case
        return future

    place: dict[str, Path] = {}
    waiting = iter(cases)
    threads = max(sum(client.nthreads().values()), 1)
    pending = as_completed([submitted(c) for c in islice(waiting, _IN_FLIGHT * threads)])
    for future in pending:
        try:
            found = future.result()
        except KilledWorker as error:
            found = {"status": "failed", "error": str(error), "seconds": 0.0}
        yield place.pop(future.key), found
        for case in islice(waiting, 1):
            pending.add(submitted(case))


@contextmanager
def _client(workers: int, scheduler: str | None) -> Iterator[Any]:
    """A client of a running cluster, or of one on this machine with a process for each worker."""
    from distributed import Client, LocalCluster

    if scheduler is not None:
        try:
            client = Client(scheduler, timeout=20)
        except (OSError, ValueError) as error:
            raise InputError(f"{scheduler}: no Dask scheduler can be reached there") from error
        with client:
            yield client
        return
    with (
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            memory_limit=None,
            dashboard_address=":0",
            silence_logs=logging.ERROR,
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client
