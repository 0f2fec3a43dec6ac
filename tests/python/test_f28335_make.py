"""`make firmware`, `make flash` and `make bsp-regs`: what they say without TI's tools, and the
command lines they would give to them."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MODEL = ["-v28", "-ml", "-mt", "--float_support=fpu32", "--abi=coffabi"]

RECORDER = """#!/bin/sh
# Stands in for one of TI's tools: notes its arguments, one call a line, and makes its output file.
echo "$@" >>"$(dirname "$0")/../calls"
for argument in "$@"; do
    case "$argument" in --output_file=*) : >"${argument#--output_file=}" ;; esac
done
"""


def put_recorder(path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(RECORDER)
    path.chmod(0o755)


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A copy of what the recipes use: no test writes into the work tree's build folder."""
    copy = tmp_path / "tree"
    for name in ("firmware", "linker", "tools/regs"):
        shutil.copytree(ROOT / name, copy / name)
    for name in ("tools/f28335.sh", "tools/apt.sh", "Makefile"):
        shutil.copy(ROOT / name, copy / name)
    return copy


def make(tree: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    keep = {k: v for k, v in os.environ.items() if not k.startswith(("MAKE", "MFLAGS", "TI_"))}
    return subprocess.run(
        ["make", "--no-print-directory", *arguments],
        cwd=tree,
        env=keep,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize(
    ("target", "missing", "source"),
    [
        ("firmware", "cl2000", "C2000-CGT from ti.com"),
        ("flash", "dslite.sh", "UNIFLASH from ti.com"),
        ("bsp-regs", "device_support/f2833x", "C2000Ware from ti.com"),
    ],
)
def test_without_tis_tools_one_sentence_says_what_is_missing_and_whence_it_comes(
    tree: Path, target: str, missing: str, source: str
) -> None:
    done = make(tree, target)
    assert done.returncode == 2
    said = [line for line in done.stderr.splitlines() if not line.startswith("make: ***")]
    assert len(said) == 1 and missing in said[0] and source in said[0]
    assert not (tree / "build").exists()


def test_flash_asks_for_the_target_and_for_the_image(tree: Path, tmp_path: Path) -> None:
    put_recorder(tmp_path / "ti/uniflash/dslite.sh")
    uniflash = f"UNIFLASH={tmp_path}/ti/uniflash"
    done = make(tree, "flash", uniflash)
    assert done.returncode == 2 and "CCXML=" in done.stderr
    (tmp_path / "board.ccxml").touch()
    done = make(tree, "flash", uniflash, f"CCXML={tmp_path}/board.ccxml")
    assert done.returncode == 2 and "make firmware" in done.stderr
    assert not (tmp_path / "ti/calls").exists()


def test_flash_gives_the_image_to_dslite(tree: Path, tmp_path: Path) -> None:
    put_recorder(tmp_path / "ti/uniflash/dslite.sh")
    (tmp_path / "board.ccxml").touch()
    image = tree / "build/f28335/madelung_flash.out"
    image.parent.mkdir(parents=True)
    image.touch()
    done = make(tree, "flash", f"UNIFLASH={tmp_path}/ti/uniflash", f"CCXML={tmp_path}/board.ccxml")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "ti/calls").read_text().split() == [
        f"--config={tmp_path}/board.ccxml",
        "--flash",
        "--verify",
        "build/f28335/madelung_flash.out",
    ]


def test_firmware_compiles_every_source_once_and_links_two_images(
    tree: Path, tmp_path: Path
) -> None:
    put_recorder(tmp_path / "cgt/bin/cl2000")
    done = make(tree, "firmware", f"TI_CGT={tmp_path}/cgt")
    assert done.returncode == 0, done.stderr
    calls = [line.split() for line in (tmp_path / "cgt/calls").read_text().splitlines()]
    compiles = [c for c in calls if "--compile_only" in c]
    links = [c for c in calls if "--run_linker" in c]
    assert len(compiles) + len(links) == len(calls) and len(links) == 2
    assert all(c[: len(MODEL)] == MODEL for c in calls)
    sources = {str(p.relative_to(tree)) for p in (tree / "firmware").glob("*/*.c")}
    sources = {s for s in sources if "bsp_mps2" not in s}
    sources.add("firmware/bsp_f28335/f28335_start.asm")
    assert sorted(c[-1] for c in compiles) == sorted(sources)
    check_compiles(compiles, tmp_path)
    check_links(links, len(sources), tmp_path)


def check_compiles(compiles: list[list[str]], tmp_path: Path) -> None:
    """C99, the include path, and what must not run before the copy to RAM stays in place."""
    in_place = {"main.c", "f28335_board.c", "f28335_start.asm"}
    for call in compiles:
        assert ("--ramfunc=on" in call) == (Path(call[-1]).name not in in_place)
        if call[-1].endswith(".c"):
            assert "--c99" in call
            folders = [a.partition("=")[2] for a in call if a.startswith("--include_path=")]
            assert folders[-1] == f"{tmp_path}/cgt/include"
            assert folders[:4] == [f"firmware/{d}" for d in ("core", "hal", "app", "bsp_f28335")]


def check_links(links: list[list[str]], objects: int, tmp_path: Path) -> None:
    """Every object, one command file, the library behind them, stack and entry."""
    for call, image in zip(sorted(links, key=str), ("flash", "ram"), strict=True):
        assert sum(a.endswith(".obj") for a in call) == objects
        assert [a for a in call if a.endswith(".cmd")] == [f"linker/f28335_{image}.cmd"]
        for option in ("--entry_point=code_start", "--stack_size=0x380", "--rom_model"):
            assert option in call
        assert call[-2:] == [f"--search_path={tmp_path}/cgt/lib", "--library=rts2800_fpu32.lib"]
        assert f"--output_file=build/f28335/madelung_{image}.out" in call


def test_firmware_builds_nothing_twice_and_passes_defines_on(tree: Path, tmp_path: Path) -> None:
    put_recorder(tmp_path / "cgt/bin/cl2000")
    arguments = [f"TI_CGT={tmp_path}/cgt", "FIRMWARE_DEFINES=-DF28335_DAC_XINTF"]
    assert make(tree, "firmware", *arguments).returncode == 0
    before = (tmp_path / "cgt/calls").read_text()
    assert before.count("-DF28335_DAC_XINTF") == before.count("--c99") > 10
    assert make(tree, "firmware", *arguments).returncode == 0
    assert (tmp_path / "cgt/calls").read_text() == before


@pytest.mark.parametrize("defines", [[], ["-DF28335_DAC_XINTF"]])
def test_the_branch_for_the_dsp_is_c(defines: list[str]) -> None:
    """Not the fake's: TI's keywords are taken out, and gcc checks the rest."""
    sources = sorted((ROOT / "firmware/bsp_f28335").glob("*.c"))
    keywords = ["-D__cregister=", "-D__interrupt=", "-D__TMS320C28XX__"]
    include = [f"-I{ROOT}/firmware/{d}" for d in ("core", "hal", "app", "bsp_f28335")]
    # Addresses are integers that a PC's pointers are wider than; pragmas are TI's.
    quiet = ["-Wno-int-to-pointer-cast", "-Wno-pointer-to-int-cast", "-Wno-unknown-pragmas"]
    flags = ["-std=gnu99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", *quiet]
    done = subprocess.run(
        ["gcc", *flags, *keywords, *include, *defines, *map(str, sources)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
