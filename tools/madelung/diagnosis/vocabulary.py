"""The effects that a diagnosis can name (contract: diagnose.md)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Effect:
    """Name, box of the signal path, contract's parameter keys, what it is."""

    name: str
    box: str
    keys: tuple[str, ...]
    what: str


_ALL = (
    Effect(
        "delay",
        "input",
        ("delay_s",),
        "a pure time shift between command and displacement",
    ),
    Effect(
        "saturation",
        "input",
        ("high_V", "low_V", "knee_V"),
        "the amplifier or drive clips",
    ),
    Effect(
        "slew_limit",
        "input",
        ("slew_V_per_s",),
        "the amplifier's rate of change is limited",
    ),
    Effect(
        "amplifier_lag",
        "input",
        ("corner_hz",),
        "one real pole between command and displacement, its place unproven",
    ),
    Effect(
        "asymmetry",
        "hysteresis",
        (),
        "the major loop is not centrally symmetric",
    ),
    Effect(
        "rate_dependence",
        "hysteresis",
        (),
        "loops widen with the rate of the input",
    ),
    Effect(
        "non_masing",
        "hysteresis",
        (),
        "minor loops do not have the shape that the major loop dictates",
    ),
    Effect(
        "initial_state",
        "hysteresis",
        ("start_peak_V",),
        "the records start from a history that the predictor does not know",
    ),
    Effect(
        "creep",
        "creep",
        ("creep_per_decade",),
        "the displacement goes on moving after the input has stopped",
    ),
    Effect(
        "backlash",
        "mechanics",
        ("dead_band_um",),
        "a dead band between actuator and sensor target",
    ),
    Effect(
        "resonance",
        "mechanics",
        ("fn_hz", "zeta"),
        "a lightly damped flexure mode",
    ),
    Effect(
        "gain_offset",
        "sensor",
        ("gain", "offset_um"),
        "the calibration has changed since identification",
    ),
    Effect(
        "drift",
        "sensor",
        (),
        "a slow movement in time that does not depend on the input",
    ),
    Effect(
        "periodic_disturbance",
        "sensor",
        ("freq_hz", "amp_um"),
        "hum or vibration at fixed frequencies, not caused by the input",
    ),
    Effect(
        "clock_skew",
        "sensor",
        ("skew_ppm",),
        "the clocks of command and measurement run at different speed",
    ),
)

EFFECTS: dict[str, Effect] = {e.name: e for e in _ALL}
"""Every effect, in the order of the signal path."""

LIMITS: dict[str, tuple[float, float]] = {
    "delay_s": (0.0, 0.05),
    "slew_V_per_s": (1e-3, 1e9),
    "corner_hz": (0.01, 1e6),
    "creep_per_decade": (-0.02, 0.2),
    "dead_band_um": (0.0, 1e3),
    "fn_hz": (0.1, 1e5),
    "zeta": (1e-4, 0.999),
    "gain": (0.1, 10.0),
    "offset_um": (-1e4, 1e4),
    "skew_ppm": (-20_000.0, 20_000.0),
}
"""Between what parameters can be; those in volts depend on the case's range."""

SIZES: dict[str, tuple[str, str]] = {
    "delay": ("s", "shift"),
    "saturation": ("V", "cut off the upper end of the range"),
    "slew_limit": ("V/s", "highest limit"),
    "amplifier_lag": ("Hz", "highest corner"),
    "asymmetry": ("um", "first term of the shape"),
    "rate_dependence": ("um", "widening at a third of the highest rate"),
    "non_masing": ("um", "first term of the shape"),
    "initial_state": ("V", "unknown peak above the low end of the range"),
    "creep": ("", "share of a step per decade of time"),
    "backlash": ("um", "full width"),
    "resonance": ("Hz", "highest natural frequency"),
    "gain_offset": ("", "change of the gain"),
    "drift": ("um/s", "slope"),
    "periodic_disturbance": ("um", "amplitude"),
    "clock_skew": ("ppm", "difference of the clocks"),
}
"""Unit and meaning of an effect's size in `detectable`."""
