"""What the README shows is run, and prints what the README says."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
from matplotlib.image import imread

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def block(language: str, holding: str) -> str:
    """The one code block of a language that holds a text."""
    found = [b for b in re.findall(rf"```{language}\n(.*?)```", README, re.S) if holding in b]
    assert len(found) == 1
    return str(found[0])


def said_displacements() -> list[float]:
    match = re.search(r"Both print ([\d.]+), ([\d.]+) and ([\d.]+) um", README)
    assert match
    return [float(v) for v in match.groups()]


def test_python_snippet_prints_what_the_readme_says() -> None:
    done = subprocess.run(
        [sys.executable, "-c", block("python", "Predictor")],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    printed = np.fromstring(done.stdout.strip(" []\n"), sep=" ")
    np.testing.assert_allclose(printed, said_displacements(), atol=6e-5)


def test_c_snippet_prints_what_the_readme_says(tmp_path: Path) -> None:
    source, program = tmp_path / "snippet.c", tmp_path / "snippet"
    source.write_text(block("c", "mdl_chain_step"), encoding="utf-8")
    firmware = ROOT / "firmware"
    subprocess.run(
        [
            *("gcc", "-std=c99", "-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Werror"),
            *(f"-I{firmware / folder}" for folder in ("core", "hal", "app")),
            *("-o", program, source, firmware / "app" / "mdl_params.c"),
            *sorted((firmware / "core").glob("*.c")),
        ],
        check=True,
    )
    done = subprocess.run([program], capture_output=True, text=True, check=True)
    np.testing.assert_allclose([float(v) for v in done.stdout.split()], said_displacements())


def test_demo_prints_what_the_readme_says(tmp_path: Path) -> None:
    done = subprocess.run(
        ["tools/demo.sh", tmp_path], cwd=ROOT, capture_output=True, text=True, check=True
    )
    printed = done.stdout.replace(str(tmp_path), "demo-out")
    hint = "copy what `make demo` prints and its predict.png (to tools/docs) into the README"
    assert block("text", "nested triangles") in printed, hint
    named = re.findall(r"\b[a-z]+\.(?:csv|json|png)\b", printed.partition("Files are in")[2])
    assert sorted(named) == sorted(p.name for p in tmp_path.iterdir()) and len(named) == 6
    shown, drawn = imread(ROOT / "tools/docs/predict.png"), imread(tmp_path / "predict.png")
    assert shown.shape == drawn.shape and np.abs(shown - drawn).mean() < 0.01


def test_the_diagnosis_prints_what_the_readme_says(tmp_path: Path) -> None:
    command = block("sh", "demo_diagnosis.sh").split()
    done = subprocess.run(
        [command[0], tmp_path, command[2]], cwd=ROOT, capture_output=True, text=True, check=True
    )
    number = re.compile(r"\d+(?:\.\d+)?")
    printed, *parts = (
        " ".join(text.split())
        for text in (done.stdout, *block("text", "== Unsealed").split("...\n"))
    )
    for part in filter(None, parts):
        shape = number.sub(lambda _: r"(\d+(?:\.\d+)?)", re.escape(part).replace(r"\.", "."))
        found = re.search(shape, printed)
        assert found, f"copy what {' '.join(command)} prints into the README: {part}"
        said = [float(v) for v in number.findall(part)]
        np.testing.assert_allclose([float(v) for v in found.groups()], said, rtol=0.02)


def test_what_the_readme_names_exists() -> None:
    for target in re.findall(r"\]\(([\w./]+)\)", README):
        assert (ROOT / target).exists(), target
    for folder in re.findall(r"^\| (`.+?) \|", README, re.M):
        for name in re.findall(r"`([\w/]+)`", folder):
            assert (ROOT / name).is_dir(), name
    targets = (ROOT / "Makefile").read_text(encoding="utf-8")
    for name in re.findall(r"^make (\w+)", README, re.M):
        assert f"\n{name}:" in targets
