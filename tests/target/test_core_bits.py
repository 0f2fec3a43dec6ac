"""The trajectory gives the same bits on AVR, Cortex-M4F and PC."""

from __future__ import annotations

import re

import inputs
import numpy as np
import pytest
from machines import ROOT, Machine, run

from madelung.core import Predictor
from madelung.model import Model

SAMPLES = {"avr": 15_000, "mps2": 200_000}


def f0() -> tuple[float, ...]:
    """The coefficients in model.h."""
    text = (ROOT / "tests" / "target" / "model.h").read_text(encoding="utf-8")
    return tuple(float(c) for c in re.findall(r"(-?\d\.\d+e-?\d+)f", text))


def codes(machine: Machine) -> inputs.Codes:
    """Up and down over all 4096 codes, all of them nested and wiped, then random ones."""
    ramp = np.arange(inputs.CODES)
    every = np.concatenate([ramp, ramp[::-1], inputs.worst()])
    return np.concatenate([every, inputs.random(SAMPLES[machine] - every.size)])


@pytest.mark.parametrize("machine", ["avr", "mps2"])
@pytest.mark.parametrize("degree", [3, 7])
def test_the_trajectory_gives_the_same_bits_everywhere(machine: Machine, degree: int) -> None:
    volts = inputs.volts(codes(machine))
    rows = run(machine, "ours", volts, degree)
    model = Model("madelung", 0.0, inputs.RANGE_V, f0=f0()[: degree + 1])
    y, status, count = Predictor(model, "float32").run_with_status(volts)
    np.testing.assert_array_equal(rows["y_um"].view(np.int32), y.view(np.int32))
    np.testing.assert_array_equal(rows["status"], status)
    np.testing.assert_array_equal(rows["count"], count)
    assert count.max() == inputs.CODES - 1


@pytest.mark.parametrize("machine", ["avr", "mps2"])
def test_the_papers_algorithm_agrees_to_rounding(machine: Machine) -> None:
    volts = inputs.volts(inputs.noisy(4000))
    ours, papers = (run(machine, name, volts, 5)["y_um"] for name in ("ours", "reference"))
    np.testing.assert_allclose(ours, papers, atol=2e-5)
