"""The trajectory gives the same bits on AVR, Cortex-M4F and PC."""

from __future__ import annotations

import inputs
import numpy as np
import pytest
from machines import Machine, run
from params import MODEL

from madelung.core import Predictor

SAMPLES = {"avr": 15_000, "mps2": 200_000}


def codes(machine: Machine) -> inputs.Codes:
    """Up and down over all 4096 codes, all of them nested and wiped, then random ones."""
    ramp = np.arange(inputs.CODES)
    every = np.concatenate([ramp, ramp[::-1], inputs.worst()])
    return np.concatenate([every, inputs.random(SAMPLES[machine] - every.size)])


@pytest.mark.parametrize("machine", ["avr", "mps2"])
def test_the_trajectory_gives_the_same_bits_everywhere(machine: Machine) -> None:
    volts = inputs.volts(codes(machine))
    rows = run(machine, "ours", volts)
    y, status, count = Predictor(MODEL, "float32").run_with_status(volts)
    np.testing.assert_array_equal(rows["y_um"].view(np.int32), y.view(np.int32))
    np.testing.assert_array_equal(rows["status"], status)
    np.testing.assert_array_equal(rows["count"], count)
    assert count.max() == inputs.CODES - 1


@pytest.mark.parametrize("machine", ["avr", "mps2"])
def test_the_papers_algorithm_agrees_to_rounding(machine: Machine) -> None:
    volts = inputs.volts(inputs.noisy(4000))
    ours, papers = (run(machine, name, volts)["y_um"] for name in ("ours", "reference"))
    np.testing.assert_allclose(ours, papers, atol=2e-5)
