"""Prints what a step costs on the emulated machines: the paper's algorithm, ours, and the ratio."""

from __future__ import annotations

import inputs
import numpy as np
from machines import UNIT, Machine, run

INPUTS = {
    "worst": inputs.worst,
    "random": inputs.random,
    "noisy": inputs.noisy,
    "smooth": inputs.smooth,
}


def cost(machine: Machine, algorithm: str, codes: inputs.Codes) -> np.ndarray:
    """Cost of every step, without the pin's own."""
    volts = inputs.volts(codes)
    empty = np.median(run(machine, "nothing", volts[:20])["cost"])
    return np.asarray(run(machine, algorithm, volts)["cost"] - empty)


def main() -> None:
    """One line per machine and input."""
    machines: tuple[Machine, ...] = ("mps2", "avr")
    print("machine  input    unit           mean: paper   ours  ratio   most: paper   ours  ratio")
    for machine in machines:
        for name, codes in INPUTS.items():
            papers, ours = (cost(machine, a, codes()) for a in ("reference", "ours"))
            print(
                f"{machine:8} {name:8} {UNIT[machine]:12}"
                f" {papers.mean():13.0f} {ours.mean():6.0f} {ours.mean() / papers.mean():6.2f}"
                f" {papers.max():13.0f} {ours.max():6.0f} {ours.max() / papers.max():6.2f}"
            )


if __name__ == "__main__":
    main()
