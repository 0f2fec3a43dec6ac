"""Builds the images for the emulated machines and runs them."""

from __future__ import annotations

import subprocess
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

ROOT = Path(__file__).parents[2]
BUILD = ROOT / "build" / "target"
PACKAGES = (
    "gcc-avr avr-libc libsimavr-dev libelf-dev gcc-arm-none-eabi libnewlib-arm-none-eabi"
    " qemu-system-arm"
).split()

Machine = Literal["avr", "mps2"]
UNIT = {"avr": "cycles", "mps2": "instructions"}
ALGORITHMS = ("ours", "reference", "play", "nothing", "chain")
ROW = np.dtype(
    [("y_um", "<f4"), ("status", "<i2"), ("count", "<u2"), ("cost", "<u4"), ("stack", "<u4")]
)
"""A sample: output, status, turning points, cost and bytes of stack between the pin's edges."""

SHIFT = 10
TICKS_PER_INSTRUCTION = 2**SHIFT / 40
"""`-icount shift=10` makes an instruction 1024 ns long; SysTick ticks every 40 ns."""
QEMU = [
    *"qemu-system-arm -M mps2-an386 -display none -monitor none -serial none".split(),
    *f"-semihosting-config enable=on,target=native -icount shift={SHIFT},sleep=off".split(),
]


@cache
def build() -> None:
    """Build all images."""
    subprocess.run([ROOT / "tools" / "apt.sh", *PACKAGES], check=True)
    make = ["make", "--no-print-directory", "-s", "-f", "tests/target/target.mk"]
    subprocess.run(make, cwd=ROOT, check=True)


def qemu(image: str, folder: Path) -> None:
    """Run an image of build/target until it ends; its files are in this folder."""
    subprocess.run(
        [*QEMU, "-kernel", BUILD / image],
        cwd=folder,
        check=True,
        timeout=600,
        stdin=subprocess.DEVNULL,
    )


def run_firmware(folder: Path, codes: ArrayLike, image: str = "firmware.elf") -> NDArray[np.uint16]:
    """Run the firmware in this folder on codes of the ADC, shape (n,); gives those of the DAC.

    The folder then holds pin.vcd, and after a run of probed.elf probe.bin.
    """
    build()
    np.asarray(codes, "<u2").tofile(folder / "codes.bin")
    qemu(image, folder)
    return np.fromfile(folder / "dac.bin", "<u2")


def run(machine: Machine, algorithm: str, x_volts: ArrayLike, *more: int) -> NDArray[np.void]:
    """Run one algorithm over x, shape (n,), in volts; gives n rows of `ROW`.

    ``ours`` and ``reference`` take one more word, the degree of f0; ``chain`` the blocks that act
    and, above 16 bits, which path of params.py it is.
    """
    build()
    head = np.array([ALGORITHMS.index(algorithm), *more], "<u4").tobytes()
    data = head + np.asarray(x_volts, "<f4").tobytes()
    if machine == "avr":
        command = [BUILD / "avr_run", BUILD / "avr.elf"]
        out = subprocess.run(command, input=data, stdout=subprocess.PIPE, check=True, timeout=600)
        return np.frombuffer(out.stdout, ROW)
    with TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "input.bin").write_bytes(data)
        qemu("mps2.elf", folder)
        rows = np.fromfile(folder / "output.bin", ROW)
    rows["cost"] = np.rint(rows["cost"] / TICKS_PER_INSTRUCTION)
    return rows
