"""The signal paths that the machines run: params.py FOLDER writes them as C.

The first has every block, and goes into FOLDER itself; the others, with what cannot be on beside
that, go into folders of their names.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

from madelung.export import Scaling, write_params
from madelung.path import CreepMode, Mode, SignalPath, augmented_model
from madelung.yang2015 import Yang

RATE_HZ = 10_000
PATH = SignalPath(
    0.0,
    40.0,
    (0.58517, 0.086444, 0.0011949, -6.1876e-06),
    shape=tuple(tuple(0.01 * (k - j) for j in range(4)) for k in range(4)),
    loop_share=0.2,
    loop_slope=-0.1,
    high_V=37.0,
    low_V=1.0,
    knee_V=2.7,
    knee_power=2.3,
    slew_V_per_s=9000.0,
    slew_fall_V_per_s=6000.0,
    corner_hz=321.0,
    corner_lean=0.15,
    behind_hz=432.0,
    damping_um=-0.02,
    widening=0.1,
    threshold_V=0.3,
    swelling=0.05,
    lean=0.2,
    power=0.7,
    v_ref_V_per_s=3000.0,
    v_knee=0.04,
    of_speed=1.0,
    smooth=0.8,
    rise_V=1.7,
    rise_skew=0.4,
    fall_V=0.9,
    fall_skew=-0.7,
    follow=0.3,
    bouc_um=-0.3,
    bouc_V=9.0,
    bouc_power=1.6,
    bouc_gamma=0.2,
    creep=(CreepMode(0.01, 0.02), CreepMode(600.0, 0.01)),
    modes=(Mode(312.3, 0.012, 0.9), Mode(1234.5, 0.03, 0.1)),
    dead_band_um=0.03,
    spread=0.3,
    spring_share=0.2,
    delay_s=3.21e-4,
    gain=1.03,
    offset_um=-0.12,
    yang=Yang(
        thresholds_V=(4.0, 9.0, 17.5, 28.0),
        weights=(0.031, 0.017, 0.011, 0.009),
        a1=-1.1e-6,
        a2=0.07,
        at_zero_um=0.21,
        k=(0.99, -2e-4, 3e-8),
        c=(0.01, -3e-4),
        m=(0.9, 1e-5),
        hz_max=2500.0,
        center_um=1.7,
        harmonics=5,
        velocity_tau_s=2e-4,
        beta_s=1e-5,
    ),
)
MODEL = replace(augmented_model(PATH, 40.0), yang=PATH.yang)
_SOFT = PATH.but(
    knee_power=0.0,
    parabolic=1.0,
    rest_free=1.0,
    slew_knee_V=0.4,
    widening=0.0,
    of_speed=0.0,
    yang=None,
).but(shape=None, loop_share=0.0, loop_slope=0.0)
OTHERS = {"viscous": _SOFT.but(relax_s=1.1e-3), "by_square": _SOFT.but(relax_per_V_s=230.0)}

if __name__ == "__main__":
    folder = Path(sys.argv[1])
    scaling = Scaling(RATE_HZ, (0.0, 40.0), (0.0, 6.0))
    write_params(MODEL, scaling, folder)
    for name, path in OTHERS.items():
        write_params(augmented_model(path, 40.0), scaling, folder / name)
