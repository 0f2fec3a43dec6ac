"""Writes the cost of a step on an emulated pin against the comparisons p, for Fig. 8.

Run: fig8.py OUT.json; `madelung reproduce cao2019 --timing OUT.json` reads it.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import inputs
import machines
import numpy as np
from numpy.typing import NDArray

from madelung.reproduce import searched

NAMES = {"mps2": "emulated Cortex-M4F", "avr": "emulated AVR"}


def costs(machine: machines.Machine, algorithm: str, degree: int = 3) -> list[dict[str, Any]]:
    """Mean, least and most cost of a step for every number of comparisons p."""
    # 12 comparisons with the whole output to compute: all codes nested, then a jump to code 1.
    x = inputs.volts(np.concatenate((inputs.ladder(), inputs.nested(4095), [1])))
    rows = machines.run(machine, algorithm, x, degree)
    empty = int(np.median(machines.run(machine, "nothing", x[:20])["cost"]))
    cost: NDArray[np.int64] = rows["cost"].astype(np.int64) - empty
    p = searched(x.astype(np.float64), rows["count"].astype(np.int64))
    points = []
    for k in range(1, int(p.max()) + 1):
        these = cost[p == k]
        points.append(
            {
                "p": int(k),
                "mean": float(these.mean()),
                "least": int(these.min()),
                "most": int(these.max()),
            }
        )
    return points


if __name__ == "__main__":
    told = [
        {
            "machine": NAMES[machine],
            "unit": machines.UNIT[machine],
            "algorithms": {name: costs(machine, name) for name in ("reference", "ours")},
        }
        for machine in ("mps2", "avr")
    ]
    Path(sys.argv[1]).write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
