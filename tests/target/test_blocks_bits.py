"""Every block of the signal path gives the same bits on AVR, Cortex-M4F and PC."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import inputs
import numpy as np
import pytest
from machines import Machine, run
from params import MODEL, OTHERS, PATH, RATE_HZ

from madelung.core import Chain, Predictor
from madelung.path import discretise

NAMES = "saturation slew lag rate creep modes backlash delay gain yang bouc envelope behind".split()
"""Fields of `Chain` in the order of the bits MDL_BLOCK_..."""
SHAPE = 0x8000
OFF: dict[str, Any] = {name: getattr(Chain(), name) for name in [*NAMES, "shape"]}
MASKS = {name: 1 << k for k, name in enumerate(NAMES)} | {"shape": SHAPE}
ALL = sum(MASKS.values())
MASKS |= {"all": ALL - MASKS["yang"], "all around yang": ALL}
CASES = {name: (0, mask) for name, mask in MASKS.items()} | {
    f"{name} of {path}": (k, MASKS[name] - (MASKS[name] & SHAPE))
    for k, path in enumerate(OTHERS, 1)
    for name in ("saturation", "slew", "rate", "all")
}
"""By name: which of params.py's paths, and the blocks that act."""


def volts() -> np.ndarray:
    """Smooth, then with noise, then jumps."""
    codes = np.concatenate([inputs.smooth(400), inputs.noisy(400), inputs.random(100)])
    return inputs.volts(codes)


def on_the_pc(path: int, mask: int) -> tuple[np.ndarray, np.ndarray]:
    chain = discretise([PATH, *OTHERS.values()][path], 1 / RATE_HZ)
    on = {name for name, bit in MASKS.items() if mask & bit}
    chain = replace(chain, **{name: off for name, off in OFF.items() if name not in on})
    y, _, count = Predictor(MODEL, "float32", chain).run_with_status(volts())
    return y, count


@pytest.mark.parametrize("machine", ["avr", "mps2"])
@pytest.mark.parametrize("name", CASES)
def test_a_block_gives_the_same_bits_everywhere(name: str, machine: Machine) -> None:
    path, mask = CASES[name]
    rows = run(machine, "chain", volts(), path << 16 | mask)
    y, count = on_the_pc(path, mask)
    np.testing.assert_array_equal(rows["y_um"].view(np.int32), y.view(np.int32))
    np.testing.assert_array_equal(rows["count"], count)


@pytest.mark.parametrize("name", CASES)
def test_every_block_changes_the_output(name: str) -> None:
    path, mask = CASES[name]
    assert np.abs(on_the_pc(path, mask)[0] - on_the_pc(path, 0)[0]).max() > 0.001
