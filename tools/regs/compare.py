"""Compares firmware/bsp_f28335/f28335_regs.h and the linker regions with TI's files.

Usage: compare.py C2000WARE_DIR, the folder that holds device_support/f2833x. Needs gcc. Exit code 0
when all agree, 1 when a value differs, 2 when TI's files are missing.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from regs.linker_cmd import Region, parse_memory, parse_placement  # noqa: E402


def ti_bases(device: Path) -> dict[str, int]:
    """Word address of each of TI's register structures, by the name of its variable."""
    cmd = (device / "headers/cmd/DSP2833x_Headers_nonBIOS.cmd").read_text(errors="replace")
    regions = {r.name: r for r in parse_memory(cmd)}
    placed = parse_placement(cmd)
    source = (device / "headers/source/DSP2833x_GlobalVariableDefs.c").read_text(errors="replace")
    pragmas = re.findall(r'#pragma DATA_SECTION\((\w+),\s*"(\w+)"\)', source)
    return {name: regions[placed[section]].origin for name, section in pragmas if section in placed}


def ti_memory(device: Path) -> list[Region]:
    """The memory of the F28335 as TI's linker command file for flash has it."""
    return parse_memory((device / "common/cmd/F28335.cmd").read_text(errors="replace"))


def outside(ours: Iterable[Region], theirs: list[Region]) -> list[str]:
    """Of our regions those whose words do not all lie in regions of TI's that have the same use."""
    use = {"RAM": ("RAMM", "RAML"), "FLASH": ("FLASH",), "BEGIN": ("BEGIN",), "RESET": ("RESET",)}
    found = []
    for region in ours:
        prefixes = next(v for k, v in use.items() if region.name.startswith(k))
        covered = {w for r in theirs if r.name.startswith(prefixes) for w in r.words()}
        if region.name == "BEGIN" and region.origin == 0:
            covered = {0, 1}  # boot to RAM: TI's other file, 28335_RAM_lnk.cmd
        if not covered.issuperset(region.words()):
            found.append(f"region {region.name} is not where TI's F28335.cmd has such memory")
    return found


def compare_registers(device: Path) -> int:
    """Build compare.c with TI's headers and run it: 0 when all agree."""
    bases = ti_bases(device)
    adc_cal = next(r for r in ti_memory(device) if r.name == "ADC_CAL")
    text = "".join(f"#define base_{name} 0x{at:X}uL\n" for name, at in bases.items())
    with tempfile.TemporaryDirectory() as folder:
        header = Path(folder) / "ti_bases.h"
        header.write_text(text + f"#define base_ADC_CAL 0x{adc_cal.origin:X}uL\n")
        program = Path(folder) / "compare"
        includes = [
            Path(folder),
            ROOT / "firmware/bsp_f28335",
            ROOT / "host_sim/board",
            device / "headers/include",
            device / "headers/source",
        ]
        build = ["gcc", "-std=gnu99", "-w", "-DMDL_FAKE_REGISTERS", "-o", str(program)]
        build += [f"-I{i}" for i in includes] + [str(ROOT / "tools/regs/compare.c")]
        subprocess.run(build, check=True)
        return subprocess.run([str(program)], check=False).returncode


def main(arguments: list[str]) -> int:
    """Compare and say what was found."""
    device = Path(arguments[0] if arguments else "") / "device_support/f2833x"
    if not (device / "headers/include/DSP2833x_Device.h").is_file():
        print(
            "TI's headers (device_support/f2833x) are missing: download C2000Ware from ti.com "
            "and say make bsp-regs C2000WARE_DIR=/path/to/its/folder",
            file=sys.stderr,
        )
        return 2
    differs = compare_registers(device)
    for image in ("ram", "flash"):
        ours = parse_memory((ROOT / f"linker/f28335_{image}.cmd").read_text())
        wrong = outside(ours, ti_memory(device))
        differs |= len(wrong) > 0
        print(
            f"linker/f28335_{image}.cmd: {len(ours)} regions, {len(wrong)} not in TI's memory map"
        )
        for line in wrong:
            print(f"  {line}")
    return int(differs != 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
