"""Damaged files, wrong types and strange options for every command; nothing is left half done.

`make test` runs fixed seeds; `make fuzz SECONDS=600` goes on with new ones. A failure names its
seed, and FUZZ_SEED=seed runs it again.
"""

from __future__ import annotations

import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import Any, get_args

import h5py
import numpy as np
import pandas as pd
import pytest
import scipy.io
import typer
from typer.testing import CliRunner

from madelung.cli import app, main
from madelung.errors import InputError

CASES = 150
FAILURES_MAX = 20
CASE_S = 120
MEMORY = 12 * 2**30

COMMANDS: dict[str, Any] = typer.main.get_command(app).commands  # type: ignore[attr-defined]
WRITES = ("output", "plot", "html", "case")
"""Options that name what is written; every other path is read."""
SLOW = {"reproduce"}
"""Takes no file; its own tests run it."""

WORDS = [
    *(
        "",
        "nan",
        "inf",
        "-inf",
        "1e999",
        "1e308",
        "-1e308",
        "1e-320",
        "-0",
        "0",
        "-1",
        "12",
        "null",
    ),
    *("true", "[]", "{}", '"', "1,5", "1_000", "0x10", "\u0663", "\u00b5", "t_s", "u_V", "y_kg"),
    *("9" * 400, "a" * 5000, "\n", "\r", ",", ";", "\0", "../../x", "[[[[[[[["),
]
NUMBERS = ["nan", "inf", "-inf", "1e308", "-1e308", "1e-300", "0", "-0.0", "-1", "1", "2.5", "7"]
NUMBERS += ["40", "1e6", "1e12", "9" * 30, "x", ""]


# -- files --------------------------------------------------------------------------------------


def write_inputs(folder: Path) -> None:
    """Good inputs of every kind."""
    n = 600
    u = 20.0 - 20.0 * np.cos(np.arange(n) / n * 6.0 * np.pi)
    y = 0.1 * u + 0.001 * u**2 + 0.001 * np.random.default_rng(0).normal(size=n)
    columns = {"t_s": np.arange(n) * 0.01, "u_V": u, "y_um": y}
    pd.DataFrame(columns).to_csv(folder / "r.csv", index=False)
    scipy.io.savemat(folder / "r.mat", columns, do_compression=True)
    scipy.io.savemat(folder / "plain.mat", {"record": columns})
    for name in ("r.h5", "hdf.mat"):
        with h5py.File(folder / name, "w", userblock_size=512 if name == "hdf.mat" else 0) as file:
            for key, values in columns.items():
                file.create_dataset(f"run/{key}", data=values).attrs["MATLAB_class"] = b"double"
    for name in ("r.mf4", "r.tdms"):
        (folder / name).write_bytes(bytes(range(256)) * 9)
    write_json = {
        "model": {"kind": "madelung", "f0": [0.6, 0.09, 0.001]},
        "major": {"kind": "major_curve", "breakpoints": [[0, 0], [10, 1], [40, 6]]},
        "yang": {
            "kind": "yang2015",
            "thresholds_V": [0.0, 10.0],
            "weights": [0.1, 0.05],
            "a1": 1e-5,
            "k": [1.0, -1e-3],
            "c": [0.0, -0.01],
            "m": [0.9],
            "hz_max": 50.0,
        },
    }
    for name, told in write_json.items():
        whole = {"schema": "madelung.model/1", "u_min_V": 0.0, "u_max_V": 40.0, **told}
        (folder / f"{name}.json").write_text(json.dumps(whole))
    stage = {"u_max_V": 40.0, "stroke_um": 20.0, "elements": 50, "physics": "relays"}
    (folder / "stage.json").write_text(json.dumps(stage))
    wanted = {"waveform": "multisine", "seconds": 2.0, "rate_hz": 100.0, "u_min_V": 0.0}
    wanted |= {"u_max_V": 40.0, "f_low_hz": 0.5, "f_high_hz": 10.0}
    (folder / "diagnosis.json").write_text(json.dumps({"next_experiment": wanted}))
    sealed = {"schema": "madelung.sealed/1", "sha256": "0" * 64, "token": "gAAAAAB" + "x" * 80}
    (folder / "sealed.json").write_text(json.dumps(sealed))
    case = folder / "case"
    for name in ("train", "holdout"):
        (case / name).mkdir(parents=True)
        shutil.copy(folder / "r.csv", case / name / "r.csv")
    shutil.copy(folder / "r.csv", case / "identify.csv")
    (case / "case.json").write_text(json.dumps({"device": "d", "u_min_V": 0.0, "u_max_V": 40.0}))


def damage(rng: random.Random, content: bytes) -> bytes:
    """Content with one to three faults."""
    for _ in range(rng.randint(1, 3)):
        content = rng.choice(DAMAGES)(rng, content)
    return content


def _cut(rng: random.Random, content: bytes) -> bytes:
    return content[: rng.randint(0, len(content))]


def _flip(rng: random.Random, content: bytes) -> bytes:
    changed = bytearray(content)
    for _ in range(rng.choice([1, 4, 64])):
        if changed:
            changed[rng.randrange(len(changed))] = rng.randrange(256)
    return bytes(changed)


def _head_flip(rng: random.Random, content: bytes) -> bytes:
    return _flip(rng, content[:600]) + content[600:]


def _repeat(rng: random.Random, content: bytes) -> bytes:
    a, b = sorted(rng.randint(0, len(content)) for _ in range(2))
    return content[:b] + content[a:b] * rng.choice([1, 2, 20]) + content[b:]


def _remove(rng: random.Random, content: bytes) -> bytes:
    a, b = sorted(rng.randint(0, len(content)) for _ in range(2))
    return content[:a] + content[b:]


def _word(rng: random.Random, content: bytes) -> bytes:
    """A cell, a number or a JSON value becomes something else."""
    at = rng.randint(0, len(content))
    ends = [i for i in (content.find(c, at) for c in (b",", b"\n", b"}", b"]")) if i >= 0]
    starts = [content.rfind(c, 0, at) + 1 for c in (b",", b"\n", b":", b"[")]
    word = rng.choice(WORDS).encode()
    return content[: max(starts)] + word + content[min(ends, default=len(content)) :]


def _nothing(rng: random.Random, content: bytes) -> bytes:
    return rng.choice([b"", b"\n", b"{}", b"\xef\xbb\xbf", b"\0" * 1000])


def _deep(rng: random.Random, content: bytes) -> bytes:
    return b"[" * rng.choice([10, 100_000])


def _long(rng: random.Random, content: bytes) -> bytes:
    return content.splitlines(keepends=True)[0] + b"1,2,3\n" * 300_000 if content else content


DAMAGES: list[Callable[[random.Random, bytes], bytes]] = [_cut, _flip, _head_flip, _repeat]
DAMAGES += [_remove, _word, _word, _word, _nothing, _deep, _long]


def strange_path(rng: random.Random, folder: Path) -> Path:
    """A path that cannot be read, or written, as a file."""
    link = folder / "loop.csv"
    if not link.is_symlink():
        link.symlink_to(link)
        (folder / "dangling.csv").symlink_to(folder / "none" / "x.csv")
        (folder / "locked.csv").touch(mode=0o000)
    names = ["none.csv", "none/none.json", "r.csv/x.csv", "loop.csv", "dangling.csv", "locked.csv"]
    names += ["case", "", "x" * 300 + ".csv", "\udcff.csv", "two\nlines.mat", "r"]
    return rng.choice([*(folder / n for n in names), Path("/dev/null"), Path("/proc/self/mem")])


def input_path(rng: random.Random, folder: Path, good: str) -> Path:
    """A damaged copy of a good input, one of another kind under its name, or a strange path."""
    kind = rng.random()
    if kind < 0.1:
        return strange_path(rng, folder)
    if kind < 0.4:
        return folder / good
    path = folder / f"damaged_{good}"
    other = sorted(p.name for p in folder.iterdir() if p.is_file() and p.name in FILES)
    source = folder / (rng.choice(other) if kind < 0.5 else good)
    if (folder / good).is_dir():
        shutil.rmtree(path, ignore_errors=True)
        shutil.copytree(folder / good, path)
        within = rng.choice(sorted(p for p in path.rglob("*") if p.is_file()))
        within.write_bytes(damage(rng, within.read_bytes()))
    else:
        path.write_bytes(damage(rng, source.read_bytes()))
    return path


RECORDS = ["r.csv", "r.csv", "r.mat", "plain.mat", "hdf.mat", "r.h5", "r.mf4", "r.tdms"]
FILES = {
    *RECORDS,
    "model.json",
    "major.json",
    "yang.json",
    "stage.json",
    "diagnosis.json",
    "sealed.json",
}
GOOD = {
    "record": RECORDS,
    "records": RECORDS,
    "model": ["model.json", "major.json", "yang.json"],
    "stage": ["stage.json"],
    "from_diagnosis": ["diagnosis.json"],
    "sealed": ["sealed.json"],
    "case": ["case"],
}


# -- command lines ------------------------------------------------------------------------------


def command_line(rng: random.Random, folder: Path) -> list[str]:
    """A command with what it needs, and some of its options."""
    name = rng.choice(sorted(COMMANDS.keys() - SLOW))
    args = [name]
    for param in COMMANDS[name].params:
        needed = param.required or param.name == "output"
        if param.name == "help" or rng.random() > (0.97 if needed else 0.08):
            continue
        if param.param_type_name == "option":
            args.append(param.opts[0])
        if not getattr(param, "is_flag", False):
            args += [value(rng, folder, name, param) for _ in range(max(1, param.nargs))]
    if name == "simulate" and rng.random() < 0.9:
        args += ["--seconds", "0.5"]
    if name == "diagnose":
        args += ["--check", "--jobs", "1"]
    return args


def value(rng: random.Random, folder: Path, command: str, param: Any) -> str:
    """What a parameter is given."""
    out = folder / "out"
    annotation = param.type_descriptor.annotation
    kinds = get_args(annotation) or (annotation,)
    if issubclass(kinds[0], Enum):
        return rng.choice([*(member.value for member in kinds[0]), "nonsense"])
    if Path in kinds:
        if param.name in WRITES and not (command == "diagnose" and param.name == "case"):
            if rng.random() < 0.1:
                return str(strange_path(rng, out))
            plain = {"plot": "p.png", "html": "p.html", "case": "new"}.get(param.name, "o")
            return str(out / plain)
        return str(input_path(rng, folder, rng.choice(GOOD.get(param.name, sorted(FILES)))))
    if str in kinds and rng.random() < 0.7:
        return rng.choice(["auto", "0", "3", "7", "random", "none", "creep", "delay", "x" * 40])
    return rng.choice(NUMBERS)


# -- running ------------------------------------------------------------------------------------


class HangError(Exception):
    """A case took longer than CASE_S."""


@contextmanager
def limited() -> Iterator[None]:
    """Memory and time run out as an exception, not as the machine's."""

    def hang(*_: object) -> None:
        raise HangError

    memory = resource.getrlimit(resource.RLIMIT_AS)
    before = signal.signal(signal.SIGALRM, hang)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, memory[1]))
    signal.alarm(CASE_S)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
        resource.setrlimit(resource.RLIMIT_AS, memory)


def snapshot(folder: Path) -> dict[str, bytes]:
    """All files below a folder."""
    return {
        str(p.relative_to(folder)): p.read_bytes()
        for p in folder.rglob("*")
        if p.is_file() and not p.is_symlink()
    }


def check_whole(name: str, content: bytes) -> None:
    """What was written is a whole file of its kind."""
    suffix = Path(name).suffix
    if suffix == ".json" or content[:1] == b"{":
        json.loads(content)
    elif suffix == ".png":
        assert content[:4] == b"\x89PNG" and content[-8:-4] == b"IEND"
    elif suffix == ".html":
        assert content.rstrip().endswith(b"</html>")
    else:
        assert content.endswith(b"\n")


def run_case(seed: int, folder: Path, capfd: Any, monkeypatch: Any) -> None:
    """One command line; it ends with 0 or 2 and keeps what was there, or replaces it whole."""
    rng = random.Random(seed)
    shutil.rmtree(folder / "out", ignore_errors=True)
    (folder / "out").mkdir()
    (folder / "out" / "r.csv").write_text("what was there\n")
    strange_path(rng, folder / "out")
    before = snapshot(folder / "out")
    args = command_line(rng, folder)
    said = f"FUZZ_SEED={seed}: madelung {' '.join(args)!r}"
    monkeypatch.setattr(sys, "argv", ["madelung", *args])
    monkeypatch.chdir(folder / "out")
    capfd.readouterr()
    try:
        with limited(), warnings.catch_warnings(record=True) as noted:
            warnings.simplefilter("always")
            main()
        code: Any = 0
    except SystemExit as error:
        code = error.code
    except BaseException as error:
        raise AssertionError(f"{said}: {type(error).__name__}: {error}") from error
    lines = capfd.readouterr().err.splitlines()
    after = snapshot(folder / "out")
    assert code in (0, None, 2), f"{said}: exit code {code}"
    shown = [n for n in noted if not issubclass(n.category, DeprecationWarning)]
    assert not shown, f"{said}: Python warns: {shown[0].message}"
    if code == 2:
        assert len(lines) == 1 and lines[0].startswith("madelung: "), f"{said}: {lines}"
        assert after == before, f"{said}: left {sorted(after.keys() - before.keys())}"
    else:
        assert all(line.startswith("madelung: warning: ") for line in lines), f"{said}: {lines}"
        assert not [n for n in after if Path(n).name.startswith(".")], f"{said}: {sorted(after)}"
        for name in (n for n in after if after[n] != before.get(n)):
            try:
                check_whole(name, after[name])
            except (AssertionError, ValueError) as error:
                raise AssertionError(f"{said}: {name} is not whole") from error


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    place = tmp_path / "fuzz"
    place.mkdir()
    write_inputs(place)
    return place


def seeds() -> Iterator[int]:
    """Fixed ones, one that is asked for, or new ones for as long as asked."""
    if "FUZZ_SEED" in os.environ:
        yield int(os.environ["FUZZ_SEED"])
        return
    yield from range(CASES)
    until = time.monotonic() + float(os.environ.get("FUZZ_SECONDS", "0"))
    seed = time.time_ns() // 1_000_000
    while time.monotonic() < until:
        yield (seed := seed + 1)


def test_every_command_survives_anything(
    folder: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    failures = []
    for seed in seeds():
        try:
            run_case(seed, folder, capfd, monkeypatch)
        except AssertionError as error:
            failures.append(str(error))
        if len(failures) == FAILURES_MAX:
            break
    assert not failures, "\n".join(failures)


@pytest.mark.parametrize(
    "args",
    [
        ["unseal", "deep.json", "key"],
        ["simulate", "-o", "out.csv", "--stage", "deep.json"],
        ["simulate", "-o", "out.csv", "--from", "deep.json"],
        ["predict", "deep.json", "r.csv", "-o", "out.csv"],
        ["export", "deep.json", "-o", "."],
    ],
)
def test_json_nested_too_deep_is_refused(
    folder: Path, args: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What the fuzzer has found."""
    (folder / "deep.json").write_text("[" * 100_000)
    monkeypatch.chdir(folder)
    result = CliRunner().invoke(app, args, standalone_mode=False)
    assert isinstance(result.exception, InputError) and "deep.json: " in str(result.exception)
    assert not (folder / "out.csv").exists()


@pytest.mark.parametrize(
    "args",
    [
        ["--u-max", "1e308"],
        ["--rate", "1e-300", "--seconds", "1e302"],
        ["--rate", "1e308", "--seconds", "20"],
    ],
)
def test_a_command_that_no_record_holds_is_refused(tmp_path: Path, args: list[str]) -> None:
    """What the fuzzer has found."""
    line = ["simulate", "-o", str(tmp_path / "out.csv"), *args]
    result = CliRunner().invoke(app, line, standalone_mode=False)
    assert isinstance(result.exception, InputError) and not list(tmp_path.iterdir())


# -- killed in mid write ------------------------------------------------------------------------

LIMITED = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, getattr(signal, sys.argv[1]))
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]),) * 2)
sys.argv[:3] = ["madelung"]
from madelung.cli import main
main()
"""
WRITING = {
    "identify": ["identify", "r.csv", "-o", "out/m.json", "--degree", "2"],
    "plot": ["identify", "r.csv", "-o", "out/m.json", "--degree", "2", "--plot", "out/p.png"],
    "predict": ["predict", "model.json", "r.csv", "-o", "out/p.csv"],
    "export": ["export", "model.json", "-o", "out"],
    "simulate": ["simulate", "-o", "out/s.csv"],
    "case": ["simulate", "--case", "out/new", "--campaign", "sine"],
}


@pytest.mark.parametrize("name", WRITING)
@pytest.mark.parametrize("ends", ["SIG_DFL", "SIG_IGN"])
def test_a_file_is_whole_or_as_before_when_writing_stops(
    folder: Path, name: str, ends: str
) -> None:
    """At a limit of the file's size the process is killed (SIG_DFL), or the write fails."""
    import matplotlib.font_manager  # noqa: F401 - fills its cache, which would hit the limit

    out = folder / "out"
    out.mkdir()
    args = WRITING[name]
    target = Path(args[-1]).name
    before = {target: b"what was there\n"} if "." in target else {}
    for file, content in before.items():
        (out / file).write_bytes(content)
    size = random.Random(name).randint(1, 200)
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, ends, str(size), *args],
        cwd=folder,
        capture_output=True,
        text=True,
    )
    after = snapshot(out)
    seen = {n: c for n, c in after.items() if not any(p[0] == "." for p in Path(n).parts)}
    assert seen == before
    if ends == "SIG_DFL":
        assert done.returncode == -signal.SIGXFSZ
    else:
        assert done.returncode == 2 and "Traceback" not in done.stderr, done.stderr
        assert after == before and len(done.stderr.splitlines()) == 1
