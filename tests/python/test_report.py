"""The report of a diagnosis: its sentences, the page, the terminal and the pictures."""

import base64
import io
import json
import re
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image
from report_cases import HOSTILE, NOISE, changed, diagnosis, entry, hostile, untested, views
from rich.console import Console
from test_report_figures import PLANNED

from madelung.diagnosis import pictures
from madelung.diagnosis.pictures import NAMES, View, draw, in_percent, in_percents
from madelung.diagnosis.report import (
    LINES_MAX,
    sentence_of_shrink,
    sentence_of_verdict,
    split_unit,
    terminal,
    write_report,
)

SCHEMA = Path("../shared/contracts/diagnosis.schema.json")


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the four pictures, of records with hostile names."""
    out = tmp_path_factory.mktemp("drawn")
    d = diagnosis()
    d["where"] += [{**d["where"][0], "axis": "record", "low": HOSTILE, "high": None}]
    draw(out, views(), NOISE, d)
    return out


def text_of(d: dict[str, Any], width: int) -> str:
    console = Console(file=io.StringIO(), width=width, force_terminal=False)
    console.print(terminal(d))
    out = console.file
    assert isinstance(out, io.StringIO)
    return out.getvalue()


class Page(HTMLParser):
    """Collects tags with attributes, and text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        self.text += data


def page_of(out: Path, d: dict[str, Any]) -> Page:
    write_report(out, d)
    return Page((out / "report.html").read_text(encoding="utf-8"))


# -- sentences --------------------------------------------------------------------------------


def test_the_diagnosis_of_these_tests_fits_the_contract() -> None:
    if not SCHEMA.exists():
        pytest.skip("the contract is not here")
    import jsonschema

    jsonschema.validate(diagnosis(), json.loads(SCHEMA.read_text(encoding="utf-8")))


@pytest.mark.parametrize(
    ("d", "said"),
    [
        (diagnosis(), "The causes of the gap are delay and creep (confidence 97 %; 0.4 % of"),
        (changed("identified", effects=["slew_limit"]), "The cause of the gap is slew limit ("),
        (
            changed("ambiguous", candidates=["delay", "amplifier_lag", "resonance"]),
            "The cause is delay, amplifier lag or resonance: this data cannot tell them apart",
        ),
        (
            changed("ambiguous", candidates=["creep", "drift"], effects=["gain_offset"]),
            "Gain offset is part of it in any case.",
        ),
        (
            changed("unknown", candidates=["creep"], remainder_share=0.31),
            "No effect of the list explains the gap: 31.0 % of the gap's energy stays unexplained",
        ),
        (changed("unknown", candidates=["creep"]), "What is proven all the same: creep."),
        (changed("no_gap"), "There is no gap that this campaign could show: the baseline misses"),
        (
            untested(good_enough_below_percent=5.0),
            "Good enough: the gap is 2.1 % of the stroke, below the 5 % that --tolerance allows.",
        ),
    ],
)
def test_verdict_in_a_sentence(d: dict[str, Any], said: str) -> None:
    assert said in sentence_of_verdict(d)


def test_shares_have_equal_digits_and_no_negative_zero() -> None:
    assert in_percents([0.96, 0.9, 1.022]) == ["96 %", "90 %", "102 %"]
    assert in_percents([0.9966, 0.995, 0.998]) == ["99.7 %", "99.5 %", "99.8 %"]
    assert in_percents([-0.0001, -0.0004, 0.0002]) == ["0.0 %", "0.0 %", "0.0 %"]
    assert in_percents([-0.004, -0.1, 0.1]) == ["0 %", "-10 %", "10 %"]
    assert in_percents([None, 0.5]) == ["-", "50 %"]
    told = [in_percent(share) for share in (None, -0.004, -0.3, 0.984, 0.998, 1.012, 1.027)]
    assert told == ["-", "0 %", "-30 %", "98 %", "99.8 %", "101.2 %", "103 %"]


def test_a_holdout_that_shows_no_gap_is_said_to_be_none_of_the_cause() -> None:
    d = changed("identified", effects=["slew_limit"])
    d["shrink"] |= {"rms_before_um": 0.0103, "closable_closed": 0.9, "closable_closed_ci95": None}
    quiet = "; the hold-out does not excite the cause."
    assert sentence_of_shrink(d).endswith(f"90 % of what can be closed is closed{quiet}")
    d["shrink"]["closable_closed"] = None
    assert sentence_of_shrink(d).endswith(f"nothing there can be closed{quiet}")
    assert quiet in " ".join(text_of(d, 300).split())
    assert "excite" not in sentence_of_shrink(d | {"gap": {**d["gap"], "rms_um": 0.0103}})
    d["verdict"]["status"] = "no_gap"
    assert "excite" not in sentence_of_shrink(d)


def test_a_parameter_that_the_case_fixes_has_no_interval() -> None:
    d = diagnosis()
    key, entry = next(iter(d["ranking"][0]["parameters"].items()))
    entry |= {"ci95": [entry["value"]] * 2, "fixed": True}
    assert " (fixed)" in text_of(d, 300), key


def test_how_far_in_a_sentence() -> None:
    d = diagnosis()
    assert sentence_of_shrink(d) == (
        "On the hold-out records the error goes from 0.11 to 0.0102 um rms; the noise floor is "
        "0.01 um: 99.7 % (95 %: 99.5 % to 99.8 %) of what can be closed is closed."
    )
    d["shrink"] |= {"closable_closed": 1.027, "closable_closed_ci95": [0.97, 1.08]}
    assert sentence_of_shrink(d).endswith(
        ": 103 % (95 %: 97 % to 108 %) of what can be closed is closed; above 100 %: less is left "
        "than the noise floor, which is an estimate."
    )
    d["shrink"] |= {"closable_closed": 1.0004, "closable_closed_ci95": [0.9996, 1.0004]}
    assert sentence_of_shrink(d).endswith(
        ": 100.0 % (95 %: 100.0 % to 100.0 %) of what can be closed is closed."
    )
    d["shrink"] |= {"closable_closed": None, "closable_closed_ci95": None}
    assert sentence_of_shrink(d).endswith("nothing there can be closed.")
    d["shrink"]["records"] = []
    assert "no hold-out record" in sentence_of_shrink(d)


@pytest.mark.parametrize(
    ("key", "split"),
    [
        ("slew_V_per_s", ("slew", "V/s")),
        ("relax_per_V_s", ("relax", "1/(V s)")),
        ("delay_s", ("delay", "s")),
        ("fn_hz", ("fn", "Hz")),
        ("dead_band_um", ("dead band", "um")),
        ("creep_per_decade", ("creep", "of the step per decade of time")),
        ("zeta", ("zeta", "")),
        ("freq_hz_2", ("freq 2", "Hz")),
        ("gain_at_0.0316_s", ("gain at 0.0316 s", "of the step")),
        ("share1", ("share of mode 1", "of the displacement")),
    ],
)
def test_units_of_keys(key: str, split: tuple[str, str]) -> None:
    assert split_unit(key) == split


# -- terminal ---------------------------------------------------------------------------------


@pytest.mark.parametrize("width", [50, 80, 160])
def test_at_most_twenty_lines(width: int) -> None:
    d = diagnosis()
    d["where"] = d["where"] * 6
    d["where"][1]["sentence"] = d["where"][2]["sentence"] = "something is odd " * 20
    d["next_experiment"] = {"waveform": "multisine", "rate_hz": 2000.0, "why": "phase tells"}
    lines = text_of(d, width).rstrip("\n").split("\n")
    assert 5 < len(lines) <= LINES_MAX
    assert max(map(len, lines)) <= width


def test_terminal_tells_what_matters() -> None:
    d = diagnosis()
    d["next_experiment"] = {"waveform": "steps", "rate_hz": 200.0, "why": "creep and drift differ"}
    text = " ".join(text_of(d, 100).split())
    assert "83 % of the gap lies where the command moves faster than 500 V/s" in text
    assert "delay: delay = 0.4 ms (95 %: 0.36 to 0.44)" in text
    assert "switch the creep block on" in text
    assert "Next experiment: creep and drift differ: waveform steps, rate 200 Hz" in text
    assert "Data faults: 1 in one record" in text


@pytest.mark.parametrize("width", [60, 80, 100])
def test_the_first_parameter_of_every_cause_goes_before_the_others(width: int) -> None:
    d = diagnosis()
    d["verdict"]["effects"] = ["creep", "delay"]
    gains = {f"gain_at_{t}_s": 0.01 for t in (0.00316, 0.01, 0.0316, 0.1, 0.316, 1, 3.16, 10)}
    d["ranking"][1] = entry("creep", 0.0101, 0.998, creep_per_decade=0.012, **gains)
    text = text_of(d, width)
    assert text.index("creep: creep") < text.index("delay: delay") < text.index("gain at 0.00316 s")
    assert "Data faults: 1" in text and len(text.splitlines()) <= LINES_MAX


def test_the_next_experiment_is_told_beside_four_candidates() -> None:
    four = ["delay", "amplifier_lag", "resonance", "rate_dependence"]
    d = changed("ambiguous", candidates=four)
    d["ranking"] = [entry(e, 0.01, 0.99, size=1.0) for e in four]
    d["next_experiment"] = PLANNED | {"why": "phase and gain over frequency tell them apart"}
    assert "Next experiment: phase and gain" in text_of(d, 60)


def test_a_check_tells_sizes_and_no_verdict(tmp_path: Path) -> None:
    d = untested(checked=True)
    text = " ".join(text_of(d, 100).split())
    assert text.startswith("Checked only, no effect was fitted: the baseline misses")
    assert "Could be seen from:" in text and "delay 12 us" in text
    assert "unexplained" not in text and "How far" not in text
    page = page_of(tmp_path, d)
    assert "without --check" in page.text and "How far it shrinks" not in page.text
    assert "Checked only" in page.text and ("div", {"class": "answer checked"}) in page.tags


def test_good_enough_claims_no_more_than_that(tmp_path: Path) -> None:
    d = untested(good_enough_below_percent=5.0)
    assert "How far" not in text_of(d, 100)
    page = page_of(tmp_path, d)
    assert ("div", {"class": "answer good_enough"}) in page.tags
    assert "Good enough" in page.text and "without --tolerance" in page.text
    for claim in ("no gap", "No gap", "predicts what was measured", "How far it shrinks"):
        assert claim not in page.text, claim


def test_hostile_names_do_not_steer_the_terminal() -> None:
    d = diagnosis()
    d["where"][0]["sentence"] = HOSTILE
    d["next_experiment"] = {"waveform": HOSTILE, "why": "[bold]x[/bold]"}
    text = text_of(d, 200)
    assert "\x1b" not in text
    assert "[bold]x[/bold]" in text


# -- page -------------------------------------------------------------------------------------


def test_page_tells_everything(tmp_path: Path) -> None:
    d = diagnosis()
    page = page_of(tmp_path, d)
    for said in (
        sentence_of_verdict(d),
        d["where"][0]["sentence"],
        sentence_of_shrink(d),
        "switch the creep block on",
        "look for buffers in the converters",
        "0.36 to 0.44",
        "slew limit",
        "rate ≥ 500 V/s",
        "12 us",
        "not at any size",
        "7 to 19",
        "madelung diagnose CASE_DIR -o OUT_DIR --seed 5",
        "stage 4",
        "for 10000 samples a second (another rate: madelung export model_augmented.json --rate",
    ):
        assert said in page.text, said


def test_creep_is_not_told_beyond_the_longest_record(tmp_path: Path) -> None:
    d = diagnosis()
    gains = {"gain_at_10_s": 0.01, "gain_at_100_s": 0.01}
    d["ranking"][1] = entry("creep", 0.0101, 0.998, creep_per_decade=0.012, **gains)
    d["records"] = [
        {"file": "a.csv", "role": "train", "rows": 6000, "rate_hz": 200.0, "seconds": 30.0}
    ]
    page = page_of(tmp_path, d).text
    for told in (page, text_of(d, 100)):
        assert "gain at 10 s" in told and "gain at 100 s" not in told
    assert "share of a step that creeps in with that time constant" in page


def test_the_place_stands_beside_the_cause(tmp_path: Path) -> None:
    d = diagnosis()
    write_report(tmp_path, d)
    page = unescape((tmp_path / "report.html").read_text(encoding="utf-8"))
    answer = page[page.index('class="answer') : page.index('class="facts"')]
    assert sentence_of_verdict(d) in answer and d["where"][0]["sentence"] in answer


def test_page_holds_its_pictures_and_needs_nothing_else(drawn: Path) -> None:
    page = page_of(drawn, diagnosis())
    sources = [a["src"] or "" for tag, a in page.tags if tag == "img"]
    held = [base64.b64decode(s.removeprefix("data:image/png;base64,")) for s in sources]
    assert held == [(drawn / f"{name}.png").read_bytes() for name in NAMES]
    html = (drawn / "report.html").read_text(encoding="utf-8")
    assert "http:" not in html and "https:" not in html and "url(" not in html
    assert not [tag for tag, _ in page.tags if tag in ("link", "iframe", "object")]
    assert not [a for tag, a in page.tags if tag == "script" and "src" in a]


def test_hostile_names_are_shown_and_not_run(tmp_path: Path) -> None:
    write_report(tmp_path, hostile(), views(), NOISE)
    page = Page((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert [t for t, _ in page.tags].count("script") == 3
    assert {t for t, _ in page.tags} <= set(
        "html head meta title style body header nav main section h1 h2 h3 div span p a ul li table "
        "tr th td figure img figcaption code label select button noscript script".split()
    )
    assert not [a for _, a in page.tags if any(k.startswith("on") for k in a)]
    assert page.text.count("<script>alert(1)</script>") >= 10
    assert "\x1b" not in page.text and "{{7*7}}" in page.text


def test_huge_texts_are_cut(tmp_path: Path) -> None:
    d = diagnosis()
    d["case"] = {"device": "x" * 1_000_000, "y" * 1_000_000: 1.0}
    d["warnings"] = ["z" * 1_000_000]
    page = page_of(tmp_path, d)
    assert len(page.text) < (tmp_path / "report.html").stat().st_size < 2.5e6
    assert "x" * 100 in page.text and "x" * 3000 not in page.text


@pytest.mark.parametrize("status", ["ambiguous", "unknown"])
def test_page_of_every_verdict(tmp_path: Path, status: str) -> None:
    d = changed(status, candidates=["creep", "drift"])
    page = page_of(tmp_path, d)
    assert sentence_of_verdict(d) in page.text
    assert ("div", {"class": f"answer {status}"}) in page.tags
    assert "take the drift out of the record" in page.text


def test_page_and_pictures_of_next_to_nothing(tmp_path: Path) -> None:
    d = changed("no_gap") | {"where": [], "ranking": [], "data_faults": [], "detectable": {}}
    nothing = {"records": [], "closable_closed": None, "closable_closed_ci95": None, "regions": []}
    d["shrink"] |= nothing
    draw(tmp_path, views()[:1], NOISE, d)
    page = page_of(tmp_path, d)
    assert sentence_of_verdict(d) in page.text
    assert len([t for t, _ in page.tags if t == "img"]) == len(NAMES)
    assert "Ranking" not in page.text


# -- pictures ---------------------------------------------------------------------------------


def test_same_input_same_bytes_and_no_dates(drawn: Path, tmp_path: Path) -> None:
    d = diagnosis()
    d["where"] += [{**d["where"][0], "axis": "record", "low": HOSTILE, "high": None}]
    draw(tmp_path, views(), NOISE, d)
    for folder in (drawn, tmp_path):
        write_report(folder, d)
    for name in (*(f"{n}.png" for n in NAMES), "report.html"):
        assert (drawn / name).read_bytes() == (tmp_path / name).read_bytes()
    for name in NAMES:
        assert set(Image.open(drawn / f"{name}.png").info) <= {"dpi"}
    html = (drawn / "report.html").read_text(encoding="utf-8")
    assert not re.search(r"20\d\d-\d\d-\d\d", html)


def figures_of(d: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> dict[str, Figure]:
    """The pictures of a diagnosis before they are saved, laid out, by their name."""
    held: dict[str, Figure] = {}
    monkeypatch.setattr(pictures, "save_figure", lambda path, f: held.update({path.stem: f}))
    draw(Path(), views(), NOISE, d)
    for figure in held.values():
        figure.canvas.draw()
    return held


def test_legends_and_shares_hide_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = figures_of(diagnosis(), monkeypatch)
    for name, figure in drawn.items():
        frames = [axes.get_window_extent() for axes in figure.axes]
        legends = [*figure.legends, *filter(None, (axes.get_legend() for axes in figure.axes))]
        assert legends
        said = [*legends, *(drawn["ranking"].axes[0].texts if name == "ranking" else [])]
        for text in said:
            box = text.get_window_extent().shrunk(0.9, 0.8)
            assert not any(box.overlaps(frame) for frame in frames), (name, text)


def test_a_ranking_of_nothing_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    axes = figures_of(diagnosis() | {"ranking": []}, monkeypatch)["ranking"].axes[0]
    assert not axes.axison and "Nothing to rank" in axes.texts[0].get_text()


def test_a_picture_shows_a_single_bad_row_of_a_long_record(tmp_path: Path) -> None:
    t = np.arange(200_000) * 1e-4
    u = 20.0 - 20.0 * np.cos(2 * np.pi * 0.5 * t)
    error = np.zeros(t.size)
    error[123_457] = 1.0
    view = View("long", "holdout", t, u, 0.1 * u, 0.1 * u - error, 0.1 * u)
    draw(tmp_path, [view], NOISE, diagnosis())
    pixels = np.asarray(Image.open(tmp_path / "gap.png").convert("RGB"), np.int16)
    rest = pixels[pixels.shape[0] // 3 : 2 * pixels.shape[0] // 3]
    spike = (np.abs(rest - [0xD5, 0x5E, 0x00]).sum(axis=2) < 200).any(axis=1)
    assert spike.sum() > 0.4 * rest.shape[0]
