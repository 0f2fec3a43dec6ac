"""The firmware as an image on the emulated Cortex-M4F: interrupt, converters and timing pin."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import inputs
import numpy as np
import pytest
from machines import ROOT, run_firmware
from numpy.typing import NDArray

from madelung.core import Predictor
from madelung.model import load_model

MODEL = load_model(ROOT / "firmware" / "app" / "model.json")


def volts(codes: NDArray[np.int64]) -> NDArray[np.float32]:
    """Volts of ADC codes, rounded as `mdl_app_volts` does."""
    return codes.astype(np.float32) * np.float32(MODEL.range_V / 4095)


def dac_codes(y_um: NDArray[np.float32]) -> NDArray[np.float32]:
    """Codes of displacements, rounded as `mdl_app_dac_code` does; the DAC spans the major loop."""
    ends = np.polynomial.polynomial.polyval([0.0, MODEL.range_V], MODEL.f0)
    per_um = np.float32(4095.0 / (ends[1] - ends[0]))
    return np.floor(np.clip((y_um - np.float32(ends[0])) * per_um + np.float32(0.5), 0, 4095))


def test_the_firmware_gives_the_bits_of_the_pc(tmp_path: Path) -> None:
    ramp = np.arange(inputs.CODES)
    codes = np.concatenate([ramp, ramp[::-1], inputs.worst(), inputs.random(200_000)])
    dac = run_firmware(tmp_path, codes, "probed.elf")
    probe = np.fromfile(tmp_path / "probe.bin", [("y_um", "<f4"), ("status", "<i4")])
    y, status, count = Predictor(MODEL, "float32").run_with_status(volts(codes))
    np.testing.assert_array_equal(probe["y_um"].view(np.int32), y.view(np.int32))
    np.testing.assert_array_equal(probe["status"], status)
    np.testing.assert_array_equal(dac, dac_codes(y))
    assert count.max() == inputs.CODES - 1


def test_the_pin_rises_once_a_sample_and_falls_when_it_is_done(tmp_path: Path) -> None:
    codes = inputs.noisy(2000)
    run_firmware(tmp_path, codes)
    vcd = (tmp_path / "pin.vcd").read_text()
    edges = np.array(re.findall(r"^#(\d+)\n([01])!$", vcd, re.MULTILINE), dtype=np.int64)
    assert edges[0].tolist() == [0, 0]
    rises, falls = edges[1::2, 0], edges[2::2, 0]
    assert set(edges[1::2, 1]) == {1} and set(edges[2::2, 1]) == {0}
    assert rises.size == falls.size == codes.size
    assert np.unique(np.diff(rises)).tolist() == [10_000]  # 10 kHz at 10 ns an instruction
    assert (falls > rises).all() and (falls - rises).max() < 1000


def test_a_run_without_codes_ends_before_the_clock_starts(tmp_path: Path) -> None:
    with pytest.raises(subprocess.CalledProcessError):
        run_firmware(tmp_path, [])
    assert not (tmp_path / "pin.vcd").exists()
