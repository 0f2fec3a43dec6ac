"""The report in a real browser: Debian's chromium and chromium-driver, without a screen.

tests/python/report_*.png are screenshots, a quarter of their size, that somebody has looked at;
the .json beside them is where everything stands. Both are compared coarsely: a layout that breaks
or a figure that is empty is told, a font that draws differently is not. To renew them, look at the
new picture that the failing test names.
"""

import base64
import io
import json
import re
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnose_cases import run, written
from PIL import Image
from report_cases import HOSTILE, NOISE, changed, diagnosis, hostile, views
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.select import Select
from selenium.webdriver.support.wait import WebDriverWait
from test_report_figures import PLANNED

from madelung.diagnosis.compare import write_comparison
from madelung.diagnosis.pictures import View, draw
from madelung.diagnosis.report import write_report

CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
pytestmark = pytest.mark.skipif(
    not (CHROMIUM and DRIVER), reason="needs chromium and chromium-driver: make test installs them"
)
LAPTOP, PHONE = (1366, 768), (400, 800)
VERDICTS = {
    "identified": diagnosis(),
    "ambiguous": changed(
        "ambiguous",
        effects=["gain_offset"],
        candidates=["delay", "amplifier_lag", "resonance", "slew_limit"],
    )
    | {"next_experiment": PLANNED},
    "unknown": changed("unknown", candidates=["creep"], remainder_share=0.4)
    | {"next_experiment": PLANNED | {"waveform": "steps"}},
    "no_gap": changed("no_gap") | {"where": [], "ranking": [], "warnings": []},
    "hostile": hostile(),
}


class Browser:
    """A window without a screen, and what it is asked in these tests."""

    def __init__(self) -> None:
        options = webdriver.ChromeOptions()
        options.binary_location = str(CHROMIUM)
        for told in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu"):
            options.add_argument(told)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(options, Service(str(DRIVER)))
        self.driver.execute_cdp_cmd("Performance.enable", {"timeDomain": "threadTicks"})

    def do(self, script: str, *told: Any) -> Any:
        return self.driver.execute_script(script, *told)

    def when(self, script: str) -> None:
        """Wait until a script returns something true."""
        WebDriverWait(self.driver, 30, 0.05).until(lambda d: d.execute_script(script))

    def open(self, page: Path, size: tuple[int, int] = LAPTOP, scheme: str = "light") -> None:
        """Open a page and wait until all is drawn."""
        self.medium(size, scheme)
        self.driver.get_log("performance")
        self.driver.get(page.as_uri())
        self.when("return document.documentElement.dataset.drawn || !document.scripts.length")

    def busy_s(self) -> float:
        """Processor time of the page's thread until now: a loaded machine stretches time only."""
        found = self.driver.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]
        return float(next(m["value"] for m in found if m["name"] == "ThreadTime"))

    def medium(self, size: tuple[int, int], scheme: str, kind: str = "") -> None:
        metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        media = {"media": kind, "features": features}
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", media)

    def requests(self) -> set[str]:
        """Addresses asked for since the page was opened."""
        events = [json.loads(e["message"])["message"] for e in self.driver.get_log("performance")]
        sent = [e["params"] for e in events if e["method"] == "Network.requestWillBeSent"]
        return {p["request"]["url"] for p in sent}

    def complaints(self) -> list[str]:
        """What stands in the console."""
        return [str(entry["message"]) for entry in self.driver.get_log("browser")]

    def boxes(self) -> list[list[Any]]:
        """Left, top, width and height, px, of what the page consists of."""
        return self.do(
            "return [...document.querySelectorAll('header, .answer, .facts section, h2, .plot,"
            " .scroll')].map(e => [e.id || e.textContent.trim().split('\\n')[0].slice(0, 30), e])"
            ".map(([name, e]) => [name, e.getBoundingClientRect()])"
            ".map(([name, r]) => [name, r.x, r.y + scrollY, r.width, r.height])"
            ".map(([name, ...numbers]) => [name, ...numbers.map(Math.round)])"
        )

    def picture(self) -> Image.Image:
        """The page from its top, all of its length, a quarter as large."""
        told = {"captureBeyondViewport": True, "format": "png"}
        shot = self.driver.execute_cdp_cmd("Page.captureScreenshot", told)
        whole = Image.open(io.BytesIO(base64.b64decode(shot["data"]))).convert("RGB")
        return whole.resize((whole.width // 4, whole.height // 4), Image.Resampling.BOX)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    made = Browser()
    yield made
    made.driver.quit()


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Reports of every verdict, written when they are first asked for."""

    def page(verdict: str) -> Path:
        out = tmp_path_factory.getbasetemp() / verdict
        if not out.exists():
            out.mkdir()
            write_report(out, VERDICTS[verdict], views(), NOISE)
        return out / "report.html"

    return page


def test_every_verdict_is_drawn_without_complaint_or_network(
    browser: Browser, pages: Callable[[str], Path]
) -> None:
    for verdict, told in VERDICTS.items():
        page = pages(verdict)
        browser.open(page)
        assert browser.complaints() == [], verdict
        asked = {url for url in browser.requests() if not url.startswith(("data:", "blob:"))}
        assert asked == {page.as_uri()}, verdict
        drawn = browser.do(
            "return [...document.querySelectorAll('.plot')].map(p =>"
            " [p.id, p.querySelectorAll('.main-svg').length > 0,"
            "  (Plotly.validate(p.data, (({legend, ...rest}) => rest)(p.layout)) || [])"
            "  .map(v => v.msg)])"  # it stumbles over any legend
        )
        expected = {"time", "loops", "map", "turn", "spectrum"}
        expected |= {"ranking"} if told["ranking"] else set()
        expected |= {"next"} if "waveform" in (told["next_experiment"] or {}) else set()
        assert {name for name, *_ in drawn} == expected, verdict
        assert all(ok and not faults for _, ok, faults in drawn), drawn


def test_the_answer_stands_on_the_first_screen_and_nothing_overflows(
    browser: Browser, pages: Callable[[str], Path]
) -> None:
    for verdict in ("identified", "ambiguous", "unknown", "no_gap"):
        browser.open(pages(verdict))
        place = "document.getElementById('first').getBoundingClientRect()"
        assert browser.do(f"return {place}.bottom") <= LAPTOP[1], verdict
        told = browser.driver.find_element(By.ID, "first").text
        for heading in ("Where the gap lies", "How far it shrinks", "What to do", "noise floor"):
            assert heading in told
        assert browser.do("return document.documentElement.scrollWidth") <= LAPTOP[0], verdict
    for size in ((800, 600), PHONE):
        browser.medium(size, "light")
        browser.when(f"return document.getElementById('spectrum').layout.width < {size[0]}")
        assert browser.do("return document.documentElement.scrollWidth") <= size[0], size


def test_nothing_hides_words_of_a_figure_or_a_cell(
    browser: Browser, pages: Callable[[str], Path]
) -> None:
    browser.open(pages("ambiguous"))
    hidden = (
        "const box = e => e.getBoundingClientRect(), seen = e => e && box(e).width > 0,"
        " over = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom"
        " && b.top < a.bottom;"
        "return [...document.querySelectorAll('.plot')].filter(p => {"
        " const icons = p.querySelector('.modebar');"
        " return seen(icons) && [...p.querySelectorAll('.legend, .infolayer text')]"
        " .some(e => seen(e) && over(box(icons), box(e))); }).map(p => p.id)"
    )
    for size in (LAPTOP, (1000, 700), (800, 600), PHONE):
        browser.medium(size, "light")
        browser.when(f"return document.getElementById('spectrum').layout.width < {size[0]}")
        time.sleep(0.5)  # the figures follow the width after a tenth of a second
        assert browser.do(hidden) == [], size
    badges = (
        "return [...document.querySelectorAll('.kind')].map(e =>"
        " [e.getBoundingClientRect(), e.nextElementSibling.getBoundingClientRect()])"
        ".map(([kind, text]) => text.left > kind.left ? text.left - kind.right : 99)"
    )
    browser.medium((1300, 700), "light")
    assert min(browser.do(badges)) >= 6
    browser.medium(PHONE, "light")
    # On a phone every cell of what the page tells is within the screen.
    every = "return [...document.querySelectorAll('{}')]"
    cut = every.format(".scroll") + ".filter(e => e.scrollWidth > e.clientWidth).length"
    assert browser.do(cut) == 0
    heights = every.format(".scroll td") + ".map(e => e.offsetHeight)"
    assert max(browser.do(heights)) < 70
    assert browser.do("return document.documentElement.scrollWidth") <= PHONE[0]


def test_axes_of_less_than_a_decade_are_labelled(browser: Browser, tmp_path: Path) -> None:
    t = np.arange(6000) * 1e-3
    u = 20.0 - 20.0 * np.cos(2 * np.pi * 10.0 * t)
    y = 0.1 * u + 0.01 * np.random.default_rng(4).standard_normal(t.size)
    near = [View("r", role, t, u, y, y - 0.03 * np.sign(u - 20), 0.1 * u) for role in ("train",)]
    d = diagnosis()
    d["gap"]["rms_um"] = 0.03
    for entry in d["ranking"]:
        entry["rms_um"] = 0.012
    write_report(tmp_path, d, near, NOISE)
    browser.open(tmp_path / "report.html")
    labels = browser.do(
        "return [...document.querySelectorAll('.plot')].flatMap(p => ['xaxis', 'yaxis']"
        ".map(a => [p.id, a, p._fullLayout[a]])).filter(([, , a]) => a.type === 'log')"
        ".map(([id, name, a]) => [id, name, a._vals.filter(v => v.text.trim()).length])"
    )
    assert len(labels) == 6 and all(count >= 2 for *_, count in labels), labels


def test_hostile_names_are_shown_and_not_run(
    browser: Browser, pages: Callable[[str], Path]
) -> None:
    browser.open(pages("hostile"))
    shown = HOSTILE.replace("\x1b", "\N{REPLACEMENT CHARACTER}")
    assert browser.driver.title == f"Diagnosis of {shown}"
    assert browser.driver.find_element(By.TAG_NAME, "h1").text == f"Diagnosis of {shown}"
    record = Select(browser.driver.find_element(By.ID, "record"))
    assert record.options[0].text.startswith(shown)
    labels = browser.do(
        "return [...document.querySelectorAll('#ranking text')].map(t => t.textContent)"
    )
    assert shown[:60].strip() in labels, labels
    assert browser.do("return document.querySelectorAll('img, a[onclick]').length") == 0
    assert browser.complaints() == []


def trace(plot: str, number: int, axis: str) -> str:
    return f"document.getElementById('{plot}').data[{number}].{axis}"


def test_zoom_of_time_and_loops_is_linked_and_keys_reach_it(
    browser: Browser, pages: Callable[[str], Path]
) -> None:
    browser.open(pages("identified"))
    layout = "document.getElementById('{}').layout.{}"
    browser.do("Plotly.relayout('time', {'xaxis.range': [1, 2]})")
    browser.when(f"return {trace('loops', 0, 'x')}.length < 2000")
    assert browser.do(f"return {trace('loops', 0, 'x')}.length") == pytest.approx(1000, abs=1)
    browser.do("Plotly.relayout('loops', {'xaxis.range': [10, 20], 'yaxis.range': [1, 2]})")
    browser.when(f"return {layout.format('time', 'yaxis3.range')}[1] === 20")
    assert browser.do(f"return {layout.format('time', 'yaxis.range')}") == [1, 2]
    browser.driver.find_element(By.ID, "whole").click()
    browser.when(f"return {trace('loops', 0, 'x')}.length > 2000")
    browser.when(f"return {layout.format('loops', 'xaxis.autorange')} === true")
    browser.driver.find_element(By.ID, "worst").click()
    browser.when(f"return {trace('loops', 0, 'x')}.length < 2000")

    # Records are chosen, and the time is moved, with keys alone.
    record = browser.driver.find_element(By.ID, "record")
    reached = []
    browser.do("document.querySelector('main').setAttribute('tabindex', -1);")
    browser.do("document.querySelector('main').focus()")
    for _ in range(12):
        browser.driver.switch_to.active_element.send_keys(Keys.TAB)
        reached.append(browser.driver.switch_to.active_element.get_attribute("id"))
    assert [r for r in reached if r][:5] == ["record", "whole", "worst", "time", "loops"]
    hostile_first = Select(record).first_selected_option.text
    record.send_keys(Keys.ARROW_DOWN)
    browser.when("return document.getElementById('record').value === '1'")
    assert Select(record).first_selected_option.text != hostile_first
    plot = browser.driver.find_element(By.ID, "time")
    before = browser.do(f"return {layout.format('time', 'xaxis.range')}")
    plot.send_keys("+")
    browser.when(f"return {layout.format('time', 'xaxis.range')}[0] > {before[0] + 1e-6}")
    narrow = browser.do(f"return {layout.format('time', 'xaxis.range')}")
    plot.send_keys(Keys.ARROW_RIGHT)
    browser.when(f"return {layout.format('time', 'xaxis.range')}[0] > {narrow[0] + 1e-6}")
    plot.send_keys(Keys.HOME)
    browser.when(f"return {layout.format('time', 'xaxis.autorange')} === true")
    assert browser.complaints() == []


def luminance(colour: str) -> float:
    red, green, blue = (int(v) / 255 for v in re.findall(r"\d+", colour)[:3])
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def test_dark_is_dark_and_paper_is_white(browser: Browser, pages: Callable[[str], Path]) -> None:
    paper = (
        "return [getComputedStyle(document.body).backgroundColor,"
        " document.querySelector('#time .main-svg').style.background]"
    )
    browser.open(pages("identified"), scheme="light")
    assert min(map(luminance, browser.do(paper))) > 0.9
    browser.medium(LAPTOP, "dark")
    browser.when("return document.getElementById('time').layout.font.color === '#e6e6e6'")
    assert max(map(luminance, browser.do(paper))) < 0.1
    # Printed from the dark it is light, and no figure is wider than the paper.
    browser.do(
        "window.seen = []; addEventListener('beforeprint', () => document.querySelectorAll('.plot')"
        ".forEach(p => seen.push([p.layout.width, p.layout.paper_bgcolor])))"
    )
    pdf = base64.b64decode(browser.driver.print_page())
    seen = browser.do("return seen")
    assert len(seen) == 6 and all(w <= 690 and c == "#ffffff" for w, c in seen)
    assert 3 <= len(re.findall(rb"/Type\s*/Page\b", pdf)) <= 9
    browser.when("return document.getElementById('time').layout.font.color === '#e6e6e6'")
    assert browser.complaints() == []


def test_a_million_rows_open_within_two_seconds(browser: Browser, tmp_path: Path) -> None:
    t = np.arange(1_000_000) * 1e-4
    rng = np.random.default_rng(5)
    u = 20.0 - 20.0 * np.cos(2 * np.pi * 0.5 * t)
    y = 0.1 * u + 0.01 * rng.standard_normal(t.size)
    y[700_001] += 2.0
    long = [View(r, r, t, u, y, 0.1 * u + 0.05 * np.sin(t), 0.1 * u) for r in ("train", "holdout")]
    draw(tmp_path, long, NOISE, diagnosis())
    write_report(tmp_path, diagnosis() | {"next_experiment": PLANNED}, long, NOISE)
    page = tmp_path / "report.html"
    assert page.stat().st_size < 5e6
    took = []
    for _ in range(3):
        before = browser.busy_s()
        browser.open(page)
        took.append(browser.busy_s() - before)
    assert min(took) < 2.0, took
    spike = f"Math.max(...{trace('time', 4, 'y')})"
    assert browser.do(f"return {spike}") == pytest.approx(2.0, abs=0.05)


def test_a_diagnosis_as_the_command_writes_it(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(tmp_path / "case", "backlash")
    out = tmp_path / "out"
    content = run(monkeypatch, tmp_path / "case", out, "--check", "--jobs", "1")
    browser.open(out / "report.html")
    assert browser.complaints() == []
    text = browser.driver.find_element(By.TAG_NAME, "main").text
    assert content["command"] in text and "multisine.csv" in text and "holdout" in text
    write_comparison(tmp_path / "page.html", [out, out])
    browser.open(tmp_path / "page.html")
    assert browser.complaints() == []
    assert browser.do("return document.documentElement.scrollWidth") <= LAPTOP[0]


def ink(picture: Image.Image, x: float, y: float, width: float, height: float) -> float:
    """How much a part of a quarter-size picture differs from one colour."""
    part = picture.crop(tuple(int(v / 4) for v in (x, y, x + width, y + height)))
    return float(np.asarray(part, np.float64).std()) + 1.0


@pytest.mark.parametrize(
    ("name", "size", "scheme", "kind"),
    [
        ("light", LAPTOP, "light", ""),
        ("dark", LAPTOP, "dark", ""),
        ("phone", PHONE, "light", ""),
        ("print", (720, 1020), "light", "print"),
    ],
)
def test_looks_as_it_did(
    name: str,
    size: tuple[int, int],
    scheme: str,
    kind: str,
    browser: Browser,
    pages: Callable[[str], Path],
    tmp_path: Path,
) -> None:
    browser.open(pages("ambiguous"), size, scheme)
    browser.medium(size, scheme, kind)
    time.sleep(0.5)  # the figures follow the width after a tenth of a second
    boxes, picture = browser.boxes(), browser.picture()
    shown = Path(__file__).parent / f"report_{name}.png"
    layout = shown.with_suffix(".json")
    picture.quantize(64).save(tmp_path / shown.name, optimize=True)
    (tmp_path / layout.name).write_text(json.dumps(boxes))
    said = (
        f"look at {tmp_path / shown.name}; if it is good, copy it and its .json to {shown.parent}"
    )
    assert shown.exists() and layout.exists(), said
    kept, before = Image.open(shown).convert("RGB"), json.loads(layout.read_text())
    assert [b[0] for b in boxes] == [b[0] for b in before], said
    for (what, x, y, width, height), (_, *old) in zip(boxes, before, strict=True):
        assert [x, width] == pytest.approx([old[0], old[2]], abs=0.03 * size[0]), (what, said)
        assert y == pytest.approx(old[1], rel=0.1, abs=40), (what, said)
        assert height == pytest.approx(old[3], rel=0.3, abs=25), (what, said)
        assert 0.5 < ink(picture, x, y, width, height) / ink(kept, *old) < 2.0, (what, said)
