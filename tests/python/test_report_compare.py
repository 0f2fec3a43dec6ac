"""`madelung report`: several diagnoses on one page."""

import json
from pathlib import Path
from typing import Any

import pytest
from report_cases import HOSTILE, changed, diagnosis, entry, hostile, untested
from test_report import Page
from typer.testing import CliRunner

from madelung.cli import app
from madelung.diagnosis.compare import write_comparison
from madelung.errors import InputError


def repaired() -> dict[str, Any]:
    """Creep is left, smaller; a resonance has come."""
    d = diagnosis()
    d["verdict"]["effects"] = ["creep", "resonance"]
    d["gap"] |= {"rms_um": 0.05, "percent_of_stroke": 0.9}
    d["ranking"] = [
        entry("creep", 0.0101, 0.998, creep_per_decade=0.011),
        entry("resonance", 0.0101, 0.998, fn_hz=420.0, zeta=0.02),
    ]
    return d


def kept(folder: Path, d: dict[str, Any]) -> Path:
    folder.mkdir(parents=True)
    (folder / "diagnosis.json").write_text(json.dumps(d))
    return folder


def page_of(tmp_path: Path, *outs: Path) -> Page:
    write_comparison(tmp_path / "page.html", outs)
    return Page((tmp_path / "page.html").read_text(encoding="utf-8"))


def test_before_and_after_in_sentences(tmp_path: Path) -> None:
    before, after = kept(tmp_path / "before", diagnosis()), kept(tmp_path / "after", repaired())
    (before / "report.html").write_text("<p>")
    page = page_of(tmp_path, before, after)
    text = " ".join(page.text.split())
    for said in (
        "From before to after",
        "The gap of the training records goes from 0.12 to 0.05 um rms (2.1 to 0.9 % of the",
        "Delay is gone. Before: delay = 0.4 ms (95 %: 0.36 to 0.44). Now it would show from: "
        "12 us, shift.",
        "Creep stays. Before: creep = 0.012 of the step per decade of time (95 %: 0.0108 to",
        "Resonance is new. fn = 420 Hz (95 %: 378 to 462).",
        "creep: creep",
        "stage 4",
    ):
        assert said in text, said
    assert [a["href"] for t, a in page.tags if t == "a"] == ["before/report.html"]
    assert [t for t, _ in page.tags].count("svg") == 2
    assert "script" not in {t for t, _ in page.tags}


def test_a_batch(tmp_path: Path) -> None:
    told = [
        diagnosis(),
        changed("ambiguous", candidates=["delay", "amplifier_lag"]),
        changed("unknown", candidates=["creep"], remainder_share=0.4),
        changed("no_gap"),
    ]
    told[3]["shrink"] |= {"records": [], "closable_closed": None}
    outs = [kept(tmp_path / f"{i}" / "out", d) for i, d in enumerate(told)]
    page = page_of(tmp_path, *outs)
    assert [a["class"] for t, a in page.tags if t == "section"] == [
        f"card {d['verdict']['status']}" for d in told
    ]
    assert "From" not in page.text
    for i in range(4):  # folders of the same name are told by their path
        assert f"{i}/out" in page.text
    assert "candidate" in page.text and "found" in page.text


def test_a_huge_error_leaves_the_other_bars_to_be_seen(tmp_path: Path) -> None:
    told = [diagnosis() for _ in range(3)]
    told[1]["shrink"] |= {"rms_before_um": 300.0}
    page = page_of(tmp_path, *(kept(tmp_path / f"{i}", d) for i, d in enumerate(told)))
    bars = [
        (a["class"], (a["style"] or "").removeprefix("--w:"))
        for t, a in page.tags
        if t == "span" and (a.get("class") or "").startswith("bar before")
    ]
    assert bars == [
        ("bar before", "20.00%"),
        ("bar before cut", "100.00%"),
        ("bar before", "20.00%"),
    ]
    assert "300 um" in page.text and "longer than is shown" in page.text


@pytest.mark.parametrize("why", [{"checked": True}, {"good_enough_below_percent": 5.0}])
def test_what_was_not_looked_for_is_not_gone(why: dict[str, Any], tmp_path: Path) -> None:
    outs = [kept(tmp_path / "a", diagnosis()), kept(tmp_path / "b", untested(**why))]
    page = page_of(tmp_path, *outs)
    assert f"card {next(iter(why)).removesuffix('_below_percent')}" in [
        a["class"] for t, a in page.tags if t == "section"
    ]
    assert "not tested; would show from: 12 us, shift" in page.text
    assert "Delay was not looked for again. Before: delay = 0.4 ms" in page.text
    assert "Unknown cause" not in page.text and " is gone" not in page.text
    back = page_of(tmp_path, *reversed(outs))
    assert "Delay is found; it was not looked for before. delay = 0.4 ms" in back.text


def test_hostile_names_are_shown_and_not_run(tmp_path: Path) -> None:
    page = page_of(tmp_path, kept(tmp_path / "<b>", hostile()), kept(tmp_path / "b", diagnosis()))
    assert not {"script", "img", "b"} & {t for t, _ in page.tags}
    assert HOSTILE.replace("\x1b", "\N{REPLACEMENT CHARACTER}") in page.text


def damaged() -> dict[str, Any]:
    d = diagnosis()
    d["ranking"][0]["parameters"]["delay_s"] = {"value": "x", "ci95": ["y", "z"]}
    return d


@pytest.mark.parametrize(
    "text",
    [
        *("", "[]", "{}", '{"verdict": 1}'),
        json.dumps(diagnosis() | {"gap": None}),
        json.dumps(damaged()),
    ],
)
def test_what_is_no_diagnosis_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "diagnosis.json").write_text(text)
    with pytest.raises(InputError, match=r"diagnosis\.json: is not a"):
        write_comparison(tmp_path / "page.html", [tmp_path])
    assert not (tmp_path / "page.html").exists()


def test_the_command(tmp_path: Path) -> None:
    outs = [kept(tmp_path / "a", diagnosis()), kept(tmp_path / "b", repaired())]
    page = tmp_path / "page.html"
    done = CliRunner().invoke(app, ["report", *map(str, outs), "-o", str(page)])
    assert done.exit_code == 0
    assert done.output.splitlines()[0].startswith("a: The causes of the gap are delay and creep")
    assert page.exists()
    for wrong in (
        ["report", str(tmp_path / "none"), "-o", str(page)],
        ["report", str(outs[0]), "-o", str(tmp_path / "page.txt")],
        ["report", str(outs[0]), "-o", str(outs[0] / "report.html")],
    ):
        assert isinstance(CliRunner().invoke(app, wrong).exception, InputError)
