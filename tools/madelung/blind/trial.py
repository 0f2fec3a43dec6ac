"""A trial on disk: cases, sealed labels and the commitments that bind dealer and answerer.

::

    TRIAL/cases/<case>/      what the diagnosis is given (contract: diagnose.md)
    TRIAL/sealed/labels.json labels and salt, encrypted
    TRIAL/commitment.txt     SHA-256 of labels and salt, and of the cases
    TRIAL/answers/<case>.json, TRIAL/answers.json

A folder that holds cases itself, from wherever, is a trial without sealed labels.
"""

from __future__ import annotations

import hashlib
import json
import platform
import secrets
import shutil
import subprocess
import tempfile
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from importlib import metadata
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from madelung.blind.deal import deal_case
from madelung.errors import InputError
from madelung.files import read_json, write_atomically
from madelung.sealing import seal, unseal

SEED_MIN = 10_000
"""Trials have seeds from here on; those below are for tuning."""
_PACKAGES = ("numpy", "scipy", "statsmodels", "ruptures", "pandas", "cffi", "distributed")


@dataclass(frozen=True)
class Trial:
    """Where things are; results: where answers and cards go."""

    folder: Path
    results: Path

    @property
    def cases(self) -> list[Path]:
        """Folders of the cases, sorted.

        Raises
        ------
        InputError
            There is none.
        """
        own = self.folder / "cases"
        parent = own if own.is_dir() else self.folder
        found = sorted(path.parent for path in parent.glob("*/case.json"))
        if not found:
            raise InputError(f"{self.folder}: holds no case (a folder with case.json)")
        return found

    @property
    def sealed(self) -> Path:
        """The encrypted labels."""
        return self.folder / "sealed" / "labels.json"

    @property
    def commitment(self) -> Path:
        """What the dealer committed to."""
        return self.folder / "commitment.txt"

    @property
    def committed(self) -> Path:
        """What the answerer committed to."""
        return self.results / "answers.json"

    def answer(self, case: str) -> Path:
        """The answer to a case."""
        return self.results / "answers" / f"{case}.json"


def deal(
    folder: Path, cases: int, seed: int | None, left_out: int, rows_max: int, workers: int
) -> tuple[str, dict[str, str]]:
    """Deal a trial into a new folder, whole or not at all.

    Parameters
    ----------
    cases, left_out
        How many; with the cause in the diagnosis's library, and taken out of it.
    seed
        None: drawn.

    Returns
    -------
    The key to the labels, which is kept nowhere, and the commitments (`commitments`).

    Raises
    ------
    InputError
        The folder exists or cannot be written.
    """
    if folder.exists():
        raise InputError(f"{folder}: exists already; name a new folder")
    seed = SEED_MIN + secrets.randbits(40) if seed is None else seed
    total = cases + left_out
    order = np.random.default_rng([seed, 0]).permutation(total)
    names = [f"case_{i + 1:0{len(str(total))}d}" for i in range(total)]
    try:
        part = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.resolve().parent))
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error.strerror}") from error
    try:
        (part / "cases").mkdir()
        (part / "sealed").mkdir()
        with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
            labels = list(
                pool.map(
                    deal_case,
                    [part / "cases" / name for name in names],
                    [case_seed(seed, i) for i in range(total)],
                    [bool(place >= cases) for place in order],
                    [rows_max] * total,
                )
            )
        sealed = {
            "seed": seed,
            "versions": versions(),
            "cases": dict(zip(names, labels, strict=True)),
        }
        key, labels_hash = seal(sealed, part / "sealed" / "labels.json")
        bound = {"labels_sha256": labels_hash, "cases_sha256": _hash_of_cases(Trial(part, part))}
        told = "".join(f"{name} {value}\n" for name, value in bound.items())
        write_atomically(part / "commitment.txt", told)
        part.chmod(0o755)
        part.rename(folder)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return key, bound


def case_seed(seed: int, index: int) -> int:
    """Seed of a case of a trial: of 64 bits, so that it meets no other."""
    words = np.random.SeedSequence([seed, 1, index]).generate_state(2, np.uint32)
    return int(words[0]) << 32 | int(words[1])


def commitments(trial: Trial) -> dict[str, str]:
    """What commitment.txt says: ``labels_sha256`` and ``cases_sha256``.

    Raises
    ------
    InputError
        It cannot be read, or says something else.
    """
    try:
        text = trial.commitment.read_text(encoding="utf-8")
        told = dict(line.split() for line in text.splitlines())
    except (OSError, ValueError) as error:
        raise InputError(f"{trial.commitment}: is not a trial's commitment") from error
    if told.keys() != {"labels_sha256", "cases_sha256"}:
        raise InputError(f"{trial.commitment}: is not a trial's commitment")
    return told


def commit_answers(trial: Trial, told: dict[str, Any]) -> str:
    """Bind all answers: write answers.json, with what else is told; the SHA-256 of it all."""
    content = told | {"cases": _hashes(trial)}
    bound = _hash(content)
    whole = {"schema": "madelung.answers/1", "sha256": bound} | content
    write_atomically(trial.committed, json.dumps(whole, indent=1) + "\n")
    return bound


def check_answers(trial: Trial) -> dict[str, Any]:
    """What answers.json holds, after checking that no answer has changed since.

    Raises
    ------
    InputError
        The answers are not committed, or not those that were.
    """
    if not trial.committed.exists():
        raise InputError(f"{trial.committed}: is missing: nothing is opened before it is answered")
    content = read_json(trial.committed)
    if not isinstance(content, dict) or not {"versions", "sources"} <= content.keys():
        raise InputError(f"{trial.committed}: does not bind answers")
    body = {k: v for k, v in content.items() if k not in ("schema", "sha256")}
    if content.get("sha256") != _hash(body) or body.get("cases") != _hashes(trial):
        raise InputError(f"{trial.results / 'answers'}: are not those that were committed to")
    return content


def open_labels(trial: Trial, key: str) -> dict[str, Any]:
    """Seed, versions and cases (name to label), after checking both of the dealer's commitments.

    Raises
    ------
    InputError
        The key does not fit, or labels or cases are not those that were committed to.
    """
    bound = commitments(trial)
    if _hash_of_cases(trial) != bound["cases_sha256"]:
        raise InputError(f"{trial.folder / 'cases'}: are not those that were committed to")
    if read_json(trial.sealed).get("sha256") != bound["labels_sha256"]:
        raise InputError(f"{trial.sealed}: the labels are not those that were committed to")
    return unseal(trial.sealed, key)


def read_labels(path: Path) -> dict[str, Any]:
    """Labels that are not sealed: one JSON object by case, or a folder of <case>.labels.json.

    Raises
    ------
    InputError
        They cannot be read, or a label names no effects.
    """
    if path.is_dir():
        files = sorted(path.glob("*.labels.json"))
        labels = {file.name.removesuffix(".labels.json"): read_json(file) for file in files}
    else:
        labels = read_json(path)
        labels = labels.get("cases", labels) if isinstance(labels, dict) else {}
    if not labels:
        raise InputError(f"{path}: holds no labels")
    for name, label in labels.items():
        if not isinstance(label, dict) or not isinstance(label.get("effects"), list):
            raise InputError(f'{path}: the label of {name} has no list "effects"')
    return dict(labels)


def versions() -> dict[str, str]:
    """Of everything that an answer depends on; ``source``: SHA-256 of code and libraries."""
    root = Path(__file__).parents[1]
    source = [*root.rglob("*.py"), *root.glob("_lib/*.so")]
    told = {"python": platform.python_version(), "source": _hash_of(source, root)}
    commit = subprocess.run(
        ["git", "rev-parse", "HEAD"], cwd=root, capture_output=True, text=True, check=False
    )
    if commit.returncode == 0:
        told["commit"] = commit.stdout.strip()
    return told | {name: metadata.version(name) for name in ("madelung", *_PACKAGES)}


def _hash_of_cases(trial: Trial) -> str:
    files = [path for case in trial.cases for path in case.rglob("*") if path.is_file()]
    return _hash_of(files, trial.folder)


def _hash_of(files: Iterable[Path], root: Path) -> str:
    return _hash({str(p.relative_to(root)): _hash_of_file(p) for p in files})


def _hashes(trial: Trial) -> dict[str, str]:
    answers = (trial.results / "answers").glob("*.json")
    return {path.stem: _hash_of_file(path) for path in sorted(answers)}


def _hash_of_file(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _hash(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
