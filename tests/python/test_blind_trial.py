"""A trial from deal to card: sealed, bound, answered once, resumed after a kill."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnose_cases import STAGE, commands
from typer.testing import CliRunner

from madelung import cli
from madelung.blind.answer import answer, diagnose_files
from madelung.blind.rivals import pick
from madelung.blind.trial import Trial, case_seed, check_answers, deal, open_labels
from madelung.errors import InputError
from madelung.stage import make_case

FAKE = """
import sys, time
from pathlib import Path
from madelung.blind.answer import answer
from madelung.blind.trial import Trial

def fake(files, seed, log=Path(sys.argv[2])):
    with log.open("a") as told:
        told.write(files["case.json"].decode() + "\\n")
    time.sleep(0.3)
    return {"status": "answered", "seconds": 0.3, "said": files["case.json"].decode()}

if __name__ == "__main__":
    folder = Path(sys.argv[1])
    answer(Trial(folder, folder), int(sys.argv[3]), answerer=fake)
"""
CASES = 12


def small(folder: Path, *names: str) -> Path:
    """A folder of small cases and their labels, none sealed."""
    folder.mkdir()
    for index, name in enumerate(names):
        effects = {} if name == "none" else {name: 1.0}
        case = folder / f"case_{name}"
        labels = make_case(case, effects, index, stage=STAGE, every=commands())
        (folder / f"case_{name}.labels.json").write_text(json.dumps(labels))
    return folder


def said(*told: str) -> str:
    result = CliRunner().invoke(cli.app, ["blind", *told])
    if result.exception is not None:
        raise result.exception
    return result.output


@pytest.fixture(scope="module")
def dealt(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    folder = tmp_path_factory.mktemp("dealt") / "trial"
    return folder, deal(folder, 3, 5, 1, 5000, 1)[0]


@pytest.fixture
def trial(dealt: tuple[Path, str], tmp_path: Path) -> Trial:
    """The dealt trial, with results of its own."""
    return Trial(dealt[0], tmp_path)


def fake_answers(trial: Trial) -> None:
    (trial.results / "answers").mkdir()
    for case in trial.cases:
        told = {"status": "failed", "error": "fake", "seconds": 1.0}
        trial.answer(case.name).write_text(json.dumps(told))


def test_a_trial_shows_no_label(dealt: tuple[Path, str]) -> None:
    folder, key = dealt
    opened = open_labels(Trial(folder, folder), key)
    labels = opened["cases"]
    assert opened["seed"] == 5 and len(labels) == 4
    assert [label["kind"] for label in labels.values()].count("left_out") == 1
    assert sorted(labels) == sorted(case.name for case in Trial(folder, folder).cases)
    acting = {name for label in labels.values() for name in label["size"]}
    for path in folder.rglob("*.*"):
        if path.is_file() and path.suffix != ".csv":
            text = path.read_text()
            excluded = json.loads(text).get("exclude", []) if path.name == "case.json" else []
            assert not any(name in text for name in acting - set(excluded))


def test_the_dealers_commitments_bind(dealt: tuple[Path, str], tmp_path: Path) -> None:
    import shutil

    folder, key = dealt
    for name, match in (("cases/case_1/identify.csv", "cases"), ("sealed/labels.json", "labels")):
        copy = tmp_path / match
        shutil.copytree(folder, copy)
        path = copy / name
        path.write_text(path.read_text().replace("1", "2", 1 if match == "cases" else 40))
        with pytest.raises(InputError, match=match):
            open_labels(Trial(copy, copy), key)
    with pytest.raises(InputError, match="key does not open"):
        open_labels(Trial(folder, folder), "nonsense")


def test_nothing_opens_before_the_answers_are_committed(trial: Trial, dealt: Any) -> None:
    told = ["open", str(trial.folder), "--key", dealt[1], "-o", str(trial.results)]
    with pytest.raises(InputError, match="nothing is opened before"):
        said(*told)
    fake_answers(trial)
    with pytest.raises(InputError, match="nothing is opened before"):
        said(*told)
    answer(trial, 1)  # nothing is left to answer: commits
    assert "4 cases" in said(*told)
    assert (trial.results / "card.html").exists()
    with pytest.raises(InputError, match="answered once"):
        answer(trial, 1)


def test_changed_answers_are_refused(trial: Trial) -> None:
    fake_answers(trial)
    answer(trial, 1)
    check_answers(trial)
    path = trial.answer("case_2")
    path.write_text(path.read_text().replace("fake", "better"))
    with pytest.raises(InputError, match="not those that were committed"):
        check_answers(trial)


def started(script: Path, folder: Path, log: Path, workers: int = 2) -> subprocess.Popen[bytes]:
    told = [sys.executable, str(script), str(folder), str(log), str(workers)]
    return subprocess.Popen(told, stderr=subprocess.DEVNULL)


def written(answers: Path) -> dict[str, int]:
    """When each answer was written; a file half written (a dotfile, which glob lists) is none."""
    found = [p for p in answers.glob("*.json") if not p.name.startswith(".")]
    return {p.name: p.stat().st_mtime_ns for p in found}


def test_a_killed_answerer_goes_on_where_it_was(tmp_path: Path) -> None:
    script, folder, log = tmp_path / "fake.py", tmp_path / "trial", tmp_path / "log"
    script.write_text(FAKE)
    names = [f"case_{i:02d}" for i in range(CASES)]
    for name in names:
        (folder / name).mkdir(parents=True)
        (folder / name / "case.json").write_text(json.dumps(name))
    first = started(script, folder, log)
    answers = folder / "answers"
    while len(written(answers)) < 3:
        assert first.poll() is None
        time.sleep(0.02)
    os.kill(first.pid, signal.SIGKILL)
    first.wait()
    kept = written(answers)
    assert 3 <= len(kept) < CASES and not (folder / "answers.json").exists()
    (answers / ".madelung-half.json").write_text("{")
    assert started(script, folder, log).wait(60) == 0
    done = {p.stem: json.loads(p.read_text()) for p in answers.iterdir()}
    assert sorted(done) == names
    assert all(json.loads(told["said"]) == name for name, told in done.items())
    assert written(answers).items() >= kept.items()
    asked = [json.loads(line) for line in log.read_text().splitlines()]
    assert set(asked) == set(names)
    assert all(asked.count(Path(name).stem) == 1 for name in kept)
    assert sorted(check_answers(Trial(folder, folder))["cases"]) == names


def test_a_running_cluster_answers_the_same(tmp_path: Path) -> None:
    from distributed import LocalCluster

    folder = tmp_path / "trial"
    for name in ("a", "b"):
        (folder / name).mkdir(parents=True)
        (folder / name / "case.json").write_text("{}")  # refused, and quickly
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0") as cluster:
        answer(Trial(folder, folder), 1, cluster.scheduler_address)
    assert sorted(check_answers(Trial(folder, folder))["cases"]) == ["a", "b"]
    with pytest.raises(InputError, match="no Dask scheduler"):
        answer(Trial(folder, tmp_path), 1, "tcp://127.0.0.1:9")


def test_bad_cases_are_answers_too() -> None:
    told = diagnose_files({"case.json": b"{}"}, 0)
    assert told["status"] == "refused" and told["error"].startswith("case.json: u_min_V")


def test_cases_of_others_are_answered_and_scored(tmp_path: Path) -> None:
    folder = small(tmp_path / "cases", "gain_offset", "none")
    results = tmp_path / "results"
    assert "2 cases answered" in said("answer", str(folder), "-o", str(results), "--workers", "1")
    told = json.loads((results / "answers" / "case_gain_offset.json").read_text())
    assert (
        told["status"] == "answered" and told["holdout"]["after_um"] < told["holdout"]["before_um"]
    )
    said("open", str(folder), "-o", str(results), "--labels", str(folder))
    card = json.loads((results / "card.json").read_text())
    assert card["right"]["hits"] == 2
    page = (results / "card.html").read_text()
    assert "http" not in page.replace("http-equiv", "") and page.count("data:image/png") == 3


def test_seeds_of_trials_meet_no_other() -> None:
    seeds = {case_seed(s, i) for s in (10_000, 10_001) for i in range(1000)}
    assert len(seeds) == 2000 and min(seeds) > 10**9


@pytest.mark.parametrize(
    "told",
    [
        ["answer", "nothing"],
        ["answer", "empty"],
        ["answer", "empty", "--workers", "0"],
        ["open", "nothing", "--key", "x"],
        ["deal", "-o", "empty"],
        ["deal", "-o", "nowhere/t", "--cases", "1"],
        ["deal", "-o", "t", "--cases", "0"],
        [],
    ],
)
def test_bad_input_is_one_line(
    told: list[str], tmp_path: Path, monkeypatch: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["madelung", "blind", *told])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == 2
    said = capsys.readouterr().err
    assert said.startswith("madelung: ") and said.count("\n") == 1
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["empty"]


@pytest.mark.parametrize("labels", ["[]", "{}", '{"a": 1}', '{"a": {"effects": "creep"}}', "{"])
def test_bad_labels_are_refused(labels: str, trial: Trial) -> None:
    fake_answers(trial)
    answer(trial, 1)
    (path := trial.results / "labels.json").write_text(labels)
    with pytest.raises(InputError, match=r"labels\.json"):
        said("open", str(trial.folder), "-o", str(trial.results), "--labels", str(path))
    assert not (trial.results / "card.html").exists()


def test_keys_stay_outside_the_trial(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="keep key and labels apart"):
        said("deal", "-o", str(tmp_path / "t"), "--key-file", str(tmp_path / "t" / "key"))
    assert list(tmp_path.iterdir()) == []


def test_rivals_pick_what_resembles_the_gap() -> None:
    t = np.arange(4000) / 500.0
    u = 20.0 + 15.0 * np.sin(2.0 * np.pi * t) + 4.0 * np.sin(14.0 * np.pi * t)
    noises = 0.01 * np.random.default_rng(0).standard_normal((20, t.size))
    late = pick([(u, u, noises[0] - 0.001 * np.gradient(u, t), 0.002)])
    assert late["bic"] in (["delay"], ["amplifier_lag"]) and late["correlation"]
    alarms = [pick([(u, u, noise, 0.002)])["bic"] for noise in noises]
    assert alarms.count([]) >= 10  # BIC picks from many templates
