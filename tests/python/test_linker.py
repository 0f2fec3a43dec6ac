"""The F28335's memory: regions, what lies in them, and whether it fits.

All numbers are 16-bit words. Sizes of C objects are the host's bytes over two: exact for arrays of
floats and 32-bit keys, too large where there are pointers or enumerations; never too small.
"""

import subprocess
import sys
from itertools import combinations
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from regs.linker_cmd import Region, parse_load, parse_memory, parse_placement  # noqa: E402

IMAGES = ["ram", "flash"]
RAM = [range(0x50, 0x400), range(0x400, 0x800), range(0x8000, 0x10000)]
BOOT_ROM_STACK = range(0x02, 0x50)
CSM = range(0x33FF80, 0x33FFF6)
PASSWORDS = range(0x33FFF8, 0x340000)
SECTIONS = {
    *("codestart", ".text", ".cinit", ".pinit", ".switch", ".econst", ".TI.ramfunc"),
    *("mdl_left", "mdl_right", "mdl_record", ".ebss", ".stack", ".reset"),
}
CODE_WORDS = 0x1E00
"""Room that must stay for code in L0-L3: twice the 3700 words that gcc -O2 makes of the sources
for a Cortex-M4F. What cl2000 makes of them is not known."""


def command_file(image: str) -> str:
    return (ROOT / f"linker/f28335_{image}.cmd").read_text()


def regions(image: str) -> dict[str, Region]:
    return {r.name: r for r in parse_memory(command_file(image))}


def overlaps(a: range, b: range) -> bool:
    return a.start < b.stop and b.start < a.stop


@pytest.fixture(scope="module")
def words(tmp_path_factory: pytest.TempPathFactory) -> dict[str, int]:
    """Sizes of what the program owns."""
    names = ["mdl_tp_side", "mdl_app_record", "mdl_app", "mdl_app_params"]
    folder = tmp_path_factory.mktemp("sizes")
    rows = "".join(f'printf("{n} %lu\\n", (unsigned long)sizeof({n}));' for n in names)
    source = f'#include <stdio.h>\n#include "mdl_app.h"\nint main(void) {{ {rows} return 0; }}\n'
    (folder / "sizes.c").write_text(source)
    include = [f"-I{ROOT}/firmware/{d}" for d in ("core", "hal", "app")]
    subprocess.run(["gcc", "-std=c99", *include, "-o", "sizes", "sizes.c"], cwd=folder, check=True)
    out = subprocess.run([folder / "sizes"], capture_output=True, text=True, check=True).stdout
    return {name: int(size) // 2 for name, size in map(str.split, out.splitlines())}


@pytest.mark.parametrize("image", IMAGES)
def test_regions_do_not_overlap(image: str) -> None:
    found = regions(image)
    assert len(found) == len(parse_memory(command_file(image)))
    for a, b in combinations(found.values(), 2):
        assert not overlaps(a.words(), b.words()), f"{a.name} and {b.name}"


@pytest.mark.parametrize("image", IMAGES)
def test_ram_regions_are_ram_and_leave_the_boot_roms_stack_alone(image: str) -> None:
    for region in regions(image).values():
        assert not overlaps(region.words(), BOOT_ROM_STACK), region.name
        if region.name.startswith("RAM"):
            assert any(region.origin >= r.start and region.end <= r.stop for r in RAM), region.name


@pytest.mark.parametrize("image", IMAGES)
def test_nothing_touches_the_code_security_module_or_its_passwords(image: str) -> None:
    for region in regions(image).values():
        assert not overlaps(region.words(), CSM), region.name
        assert not overlaps(region.words(), PASSWORDS), region.name


@pytest.mark.parametrize(("image", "origin"), [("ram", 0x000000), ("flash", 0x33FFF6)])
def test_the_program_starts_where_the_boot_rom_jumps_to(image: str, origin: int) -> None:
    begin = regions(image)[parse_placement(command_file(image))["codestart"]]
    assert (begin.origin, begin.length) == (origin, 2)


@pytest.mark.parametrize("image", IMAGES)
def test_every_section_has_a_region_that_exists(image: str) -> None:
    placed = parse_placement(command_file(image))
    assert set(placed) == SECTIONS
    assert set(placed.values()) <= set(regions(image))


def test_what_flash_must_load_lies_in_flash_and_the_ram_image_needs_none() -> None:
    placed = parse_placement(command_file("flash"))
    for section in (".text", ".cinit", ".pinit", ".switch", ".econst"):
        assert placed[section] == "FLASHA"
    assert parse_load(command_file("flash")) == {".TI.ramfunc": "FLASHA"}
    assert placed[".TI.ramfunc"] == "RAML03"
    assert parse_load(command_file("ram")) == {}
    assert not any(name.startswith("FLASH") for name in regions("ram"))


@pytest.mark.parametrize("image", IMAGES)
def test_the_turning_points_fill_l4_to_l7_exactly(image: str, words: dict[str, int]) -> None:
    placed = parse_placement(command_file(image))
    left, right = (regions(image)[placed[s]] for s in ("mdl_left", "mdl_right"))
    assert left.length == right.length == words["mdl_tp_side"] == 0x2000
    assert (left.origin, left.end, right.end) == (0xC000, right.origin, 0x10000)
    assert [s for s, r in placed.items() if r in (left.name, right.name)] == [
        "mdl_left",
        "mdl_right",
    ]


@pytest.mark.parametrize("image", IMAGES)
def test_data_leave_room_for_code_and_stack(image: str, words: dict[str, int]) -> None:
    placed = parse_placement(command_file(image))
    assert placed["mdl_record"] == placed[".ebss"] == placed[".TI.ramfunc"] == "RAML03"
    data = words["mdl_app_record"] + words["mdl_app"] + words["mdl_app_params"]
    print(f"{image}: data {data} words of {regions(image)['RAML03'].length}")
    assert data + CODE_WORDS <= regions(image)["RAML03"].length
    assert placed[".stack"] == "RAMM1"
    assert regions(image)["RAMM1"].length >= 0x380  # --stack_size in f28335.mk


def test_a_parser_that_finds_nothing_would_not_pass() -> None:
    text = "MEMORY { A : origin = 0x10, length = 0x20 /* B : origin = 0x30, length = 0x1 */ }\n"
    text += "SECTIONS { .x : > A\n .y : { *(.y) } LOAD = A, RUN = B }"
    assert parse_memory(text) == [Region("A", 0x10, 0x20)]
    assert parse_placement(text) == {".x": "A", ".y": "B"}
    assert parse_load(text) == {".y": "A"}
