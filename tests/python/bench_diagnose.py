"""Prints how long `madelung diagnose` takes, and its memory, on cases of 10^5 and 10^6 rows."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from madelung.campaigns import commands
from madelung.stage import Stage, make_case

CASES = (
    ("delay",),
    ("creep", "resonance"),
    ("rate_dependence",),
    ("rate_dependence", "drift"),
)
LONGER = (1, 10)
"""How often as long as the rich campaign."""
STAGE = Stage()
JOBS = 2


def write(folder: Path, effects: tuple[str, ...], longer: int) -> int:
    """A case of the rich campaign; its rows."""
    rng = np.random.default_rng(1)
    every = {
        name: told if name == "identify" else replace(told, seconds=told.seconds * longer)
        for name, told in commands("rich", STAGE.u_min_V, STAGE.u_max_V, rng).items()
    }
    make_case(folder, dict.fromkeys(effects, 1.0), 1, stage=STAGE, every=every)
    return sum(len(p.read_bytes().splitlines()) - 1 for p in folder.rglob("*.csv"))


def main() -> None:
    """One line a case."""
    print(f"madelung diagnose --jobs {JOBS}, {os.cpu_count()} cores")
    print(f"{'rows':>9} {'wall s':>7} {'processor s':>11} {'MB':>6}  effects: verdict")
    with tempfile.TemporaryDirectory() as folder:
        for longer in LONGER:
            for effects in CASES:
                case, out = (Path(folder) / name for name in ("case", "out"))
                rows = write(case, effects, longer)
                madelung = str(Path(sys.executable).with_name("madelung"))
                call = [madelung, "diagnose", str(case), "-o", str(out)]
                began = time.perf_counter()
                done = subprocess.Popen([*call, "--jobs", str(JOBS)], stdout=subprocess.PIPE)
                told = done.stdout.read().decode() if done.stdout else ""
                _, _, used = os.wait4(done.pid, 0)
                wall = time.perf_counter() - began
                said = next((s.strip() for s in told.splitlines() if "cause" in s), "?")
                print(
                    f"{rows:9} {wall:7.1f} {used.ru_utime + used.ru_stime:11.1f} "
                    f"{used.ru_maxrss / 1024:6.0f}  {' + '.join(effects)}: {said}",
                    flush=True,
                )
                for path in (case, out):
                    shutil.rmtree(path)


if __name__ == "__main__":
    main()
