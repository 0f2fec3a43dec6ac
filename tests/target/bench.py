"""Prints what a step costs beside the paper's algorithm, compiled alike: time, memory, stack.

The assembly of the hot path goes to build/target/hot_path.s.
"""

from __future__ import annotations

import subprocess
import sys
from typing import Literal

import inputs
import numpy as np
from machines import BUILD, UNIT, Machine, run
from numpy.typing import NDArray

from madelung.reproduce import searched

Algorithm = Literal["reference", "ours"]
MACHINES: tuple[Machine, ...] = ("mps2", "avr")
CALLED = {"mps2": "Cortex-M4F", "avr": "AVR"}
DEGREES = (3, 5)
INPUTS = {
    "worst": inputs.worst,
    "partial": inputs.partial,
    "random": inputs.random,
    "noisy": inputs.noisy,
    "smooth": inputs.smooth,
}
ALL_BLOCKS = 0x8DFF
"""Every block of tests/target/params.py, and its shape."""
TOOLS = {"mps2": "arm-none-eabi-", "avr": "avr-"}
HOT = ("mdl_traj_step", "rising_3", "falling_3", "wipe_up", "cao2019_step")


def cost(
    machine: Machine, algorithm: Algorithm, codes: inputs.Codes, degree: int
) -> NDArray[np.void]:
    """Rows of one run, their cost without the pin's own."""
    volts = inputs.volts(codes)
    empty = np.median(run(machine, "nothing", volts[:20])["cost"])
    rows = run(machine, algorithm, volts, degree).copy()
    rows["cost"] -= np.uint32(empty)
    return rows


def print_cost(machine: Machine, degree: int) -> dict[str, int]:
    """One line per input, then what holds over all of them; returns the deepest stacks, bytes."""
    print(f"\n{CALLED[machine]}, {UNIT[machine]} a step, f0 of degree {degree}")
    print("input         mean: paper   ours  ratio   most: paper   ours  ratio")
    most = dict.fromkeys(("reference", "ours"), 0)
    stack = dict(most)
    for name, codes in INPUTS.items():
        told = [f"{name:12}"]
        runs = {a: cost(machine, a, codes(), degree) for a in ("reference", "ours")}
        for how in (np.mean, np.max):
            papers, ours = (float(how(runs[a]["cost"])) for a in ("reference", "ours"))
            told.append(f"{papers:12.0f} {ours:6.0f} {ours / papers:6.2f}")
        for a, rows in runs.items():
            most[a] = max(most[a], int(rows["cost"].max()))
            stack[a] = max(stack[a], int(rows["stack"].max()))
        print("  ".join(told))
    ratio = most["ours"] / most["reference"]
    print(f"over all      {'':25}  {most['reference']:12} {most['ours']:6} {ratio:6.2f}")
    return stack


def print_lines(machine: Machine, degree: int) -> None:
    """Intercept and slope over the comparisons p of the paper's search, means by p."""
    codes = np.concatenate((inputs.ladder(), inputs.nested(inputs.CODES - 1), [1]))
    for algorithm, name in (("reference", "paper"), ("ours", "ours")):
        rows = cost(machine, algorithm, codes, degree)
        p = searched(inputs.volts(codes).astype(float), rows["count"].astype(np.int64))
        mean = [rows["cost"][p == k].mean() for k in range(1, p.max() + 1)]
        slope, start = np.polyfit(range(1, p.max() + 1), mean, 1)
        print(f"mean over p   {name:5} {start:6.0f} {'-' if slope < 0 else '+'} {abs(slope):.1f} p")


def print_host() -> None:
    """Nanoseconds a sample on this PC."""
    print("\nThis PC, ns a sample (least of 41 runs of 200,000 samples)")
    print("input    degree      paper   ours  ratio   ten play operators")
    path = BUILD / "host.bin"
    for name in ("random", "noisy", "smooth"):
        inputs.volts(INPUTS[name](200_000)).tofile(path)  # type: ignore[call-arg]
        for degree in DEGREES:
            command = [BUILD / "host", path, str(degree)]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            ours, papers, play = map(float, done.stdout.split())
            print(
                f"{name:8} {degree:6} {papers:10.1f} {ours:6.1f} {ours / papers:6.2f} {play:20.1f}"
            )


def sections(path: str, machine: Machine) -> dict[str, int]:
    """Bytes of code with constants (flash), and of data (RAM), after `size`."""
    command = [f"{TOOLS[machine]}size", "-A", path]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    found = {"flash": 0, "RAM": 0}
    for line in done.stdout.splitlines():
        match line.split():
            case [name, size, _] if name.startswith((".text", ".rodata", ".data")):
                found["flash"] += int(size)
                if name.startswith(".data"):
                    found["RAM"] += int(size)
            case [name, size, _] if name.startswith(".bss"):
                found["RAM"] += int(size)
    return found


def symbols(machine: Machine) -> dict[str, int]:
    """Bytes of the variables of the machine's image by name."""
    command = [f"{TOOLS[machine]}nm", "-S", BUILD / f"{machine}.elf"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    rows = [line.split() for line in done.stdout.splitlines()]
    return {row[3]: int(row[1], 16) for row in rows if len(row) == 4 and row[2] in "bBdD"}


def print_memory(stacks: dict[Machine, dict[str, int]]) -> None:
    """Flash, RAM and the deepest stack."""
    print("\nBytes               flash: paper   ours   RAM: paper   ours (turning points)", end="")
    print("   stack: paper   ours  all blocks")
    for machine in MACHINES:
        flash = [
            sections(str(BUILD / f"{machine}-{a}.o"), machine)["flash"]
            for a in ("reference", "ours")
        ]
        size = symbols(machine)
        held = size["left"] + size["right"]
        ram = [held + size["reference"], held + size["traj"] + size["major"]]
        # Deepest for inputs beyond the range on both sides, which the paper's does not take.
        beyond = np.float32(1.2) * inputs.volts(inputs.noisy(2000)) - np.float32(4.0)
        chain = run(machine, "chain", beyond, ALL_BLOCKS)["stack"].max()
        stack = stacks[machine]
        stack["ours"] = max(stack["ours"], *run(machine, "ours", beyond, DEGREES[-1])["stack"])
        print(
            f"{CALLED[machine]:14} {flash[0]:17} {flash[1]:6} {ram[0]:12} {ram[1]:6} ({held})"
            f" {stack['reference']:21} {stack['ours']:6} {chain:11}"
        )
    whole = sections(str(BUILD / "firmware.elf"), "mps2")
    print(f"The whole firmware, Cortex-M4F: flash {whole['flash']}, RAM {whole['RAM']}")


def write_assembly() -> None:
    """What most steps run, and the paper's, of the Cortex-M4F."""
    out = BUILD / "hot_path.s"
    command = [f"{TOOLS['mps2']}objdump", "-d", "--no-show-raw-insn", BUILD / "mps2.elf"]
    told = [
        subprocess.run(
            [*command, f"--disassemble={name}"], capture_output=True, text=True, check=True
        ).stdout.partition("section .text:")[2]
        for name in HOT
    ]
    out.write_text("".join(told), encoding="utf-8")
    print(f"\nThe assembly of {', '.join(HOT)}: {out.relative_to(BUILD.parents[1])}")


def main() -> int:
    """The whole comparison."""
    stacks: dict[Machine, dict[str, int]] = {}
    for machine in MACHINES:
        for degree in DEGREES:
            stacks[machine] = print_cost(machine, degree)
            print_lines(machine, degree)
    print_memory(stacks)
    print_host()
    write_assembly()
    return 0


if __name__ == "__main__":
    sys.exit(main())
