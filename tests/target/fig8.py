"""Captures the emulated board's timing pin for Fig. 8: our core, and the paper's algorithm.

Run: fig8.py FOLDER; writes ours.vcd, paper.vcd and their inputs, codes.csv.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import inputs
import machines
import numpy as np

IMAGES = {"ours": "firmware.elf", "paper": "paper.elf"}


def main(folder: Path) -> None:
    """Run both images on the same codes."""
    # 12 comparisons with the whole output to compute: all codes nested, then a jump to code 1.
    codes = np.concatenate((inputs.ladder(), inputs.nested(inputs.CODES - 1), [1]))
    folder.mkdir(parents=True, exist_ok=True)
    np.savetxt(folder / "codes.csv", codes, "%d", header="code", comments="")
    for name, image in IMAGES.items():
        with TemporaryDirectory() as run:
            machines.run_firmware(Path(run), codes, image)
            (folder / f"{name}.vcd").write_bytes((Path(run) / "pin.vcd").read_bytes())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
