"""What to do about each effect: mend, switch on in the firmware, recalibrate, record again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Kind = Literal["hardware", "firmware", "calibration", "record"]

KINDS: dict[Kind, str] = {
    "hardware": "Hardware",
    "firmware": "Firmware",
    "calibration": "Calibration",
    "record": "Record again",
}
"""As an engineer reads them, the ones that remove a cause before those that predict it."""


@dataclass(frozen=True)
class Action:
    """One thing to do."""

    kind: Kind
    what: str


def _actions(**texts: str) -> tuple[Action, ...]:
    return tuple(Action(kind, texts[kind]) for kind in KINDS if kind in texts)


ACTIONS: dict[str, tuple[Action, ...]] = {
    "delay": _actions(
        hardware="look for buffers in the converters and the sensor's filter",
        firmware="switch the delay block on",
    ),
    "saturation": _actions(
        hardware="stay inside the amplifier's range, or raise its supply",
        firmware="switch the saturation block on",
    ),
    "slew_limit": _actions(
        hardware="lower the rate, or use a stronger amplifier",
        firmware="switch the slew block on",
    ),
    "amplifier_lag": _actions(
        hardware="use a faster amplifier",
        firmware="switch the lag block on",
    ),
    "asymmetry": _actions(firmware="use the model with the shape terms"),
    "rate_dependence": _actions(
        firmware="switch the rate block on",
        record="else identify at the working rate",
    ),
    "non_masing": _actions(firmware="use the model with the shape terms"),
    "initial_state": _actions(
        firmware="resume a saved state",
        record="drive once to an end of the range before each record",
    ),
    "creep": _actions(firmware="switch the creep block on"),
    "backlash": _actions(
        hardware="mend the coupling, or preload it",
        firmware="switch the backlash block on",
    ),
    "resonance": _actions(
        hardware="stay below the mode, or add damping",
        firmware="switch the mode block on",
    ),
    "gain_offset": _actions(
        calibration="recalibrate the sensor, or identify again",
    ),
    "drift": _actions(
        hardware="let the stage warm up, hold the temperature",
        record="take the drift out of the record, or record for a shorter time",
    ),
    "periodic_disturbance": _actions(
        hardware="find the source at these frequencies: mains, fans, pumps, ground loops",
    ),
    "clock_skew": _actions(hardware="use one clock for both command and measurement"),
}
"""By effect."""
