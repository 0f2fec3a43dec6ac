"""What makes the stage of a trial deviate, by which of several laws, and how strongly.

The laws are physics as the literature has it, or as an engineer would write it down, not the
candidate models of the diagnosis. Ordinary sizes (strength 1) are one to three per cent of the
stroke at the rates of the training records, within what real devices show.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from madelung.sim_effects import OUTSIDE, Parameters, Scene


@dataclass(frozen=True)
class Draw:
    """What a law's parameters are drawn from.

    Attributes
    ----------
    rng, scene
        See `madelung.sim_effects`.
    strength
        1: ordinary size.
    seconds
        Length of a typical training record, s.
    """

    rng: np.random.Generator
    strength: float
    scene: Scene
    seconds: float

    def size(self, low: float = 0.01, high: float = 0.03) -> float:
        """Share of stroke or range, of the strength."""
        return float(self.strength * self.rng.uniform(low, high))

    def sign(self) -> float:
        """1 or -1."""
        return 1.0 if self.rng.uniform() < 0.5 else -1.0

    @property
    def range_V(self) -> float:
        """Width of the drive's range, V."""
        return self.scene.u_max_V - self.scene.u_min_V

    def late_s(self) -> float:
        """The time in which a fast command moves by `size` of its range, s."""
        return self.size() * self.range_V / self.scene.fast_V_per_s


Law = Callable[[Draw], Parameters]


def _delay(d: Draw) -> Parameters:
    return {"delay_s": min(d.late_s(), 3e-3 * d.strength)}


def _clip(knee_law: int | None) -> Law:
    def law(d: Draw) -> Parameters:
        cuts = d.rng.uniform(0.03, 0.10, 2) * d.strength * d.range_V
        ends = d.rng.integers(3)
        limits = {}
        if ends != 1:
            limits["high_V"] = d.scene.u_max_V - cuts[0]
        if ends != 0:
            limits["low_V"] = d.scene.u_min_V + cuts[1]
        if knee_law is None:
            return limits
        knee_V = d.rng.uniform(0.4, 1.0) * float(cuts.min())
        return limits | {"knee_V": knee_V, "knee_law": float(knee_law)}

    return law


def _slew(equal: bool) -> Law:
    def law(d: Draw) -> Parameters:
        share = 1.0 - d.strength * d.rng.uniform(0.2, 0.5)
        limit = {"slew_V_per_s": share * d.scene.highest_V_per_s}
        return limit if equal else limit | {"slew_fall": d.rng.uniform(0.85, 0.97)}

    return law


def _corner_hz(d: Draw) -> float:
    return float(np.clip(1.0 / (2.0 * np.pi * d.late_s()), 5.0 / d.strength, 800.0))


def _one_pole(d: Draw) -> Parameters:
    return {"corner_hz": _corner_hz(d)}


def _capacitive_load(d: Draw) -> Parameters:
    return {"corner_hz": _corner_hz(d), "droop": d.rng.uniform(0.1, 0.4)}


def _two_poles(d: Draw) -> Parameters:
    corner_hz = _corner_hz(d)
    if corner_hz > 250.0:  # the second would be faster than anything that is simulated
        return {"corner_hz": corner_hz}
    return {"corner_hz": corner_hz, "corner2_hz": corner_hz * d.rng.uniform(8.0, 12.0)}


def _sine_bow(d: Draw) -> Parameters:
    return {"bow_um": d.sign() * d.size() * d.scene.stroke_um}


def _exponential(d: Draw) -> Parameters:
    return {
        "exponential_um": d.sign() * d.size() * d.scene.stroke_um,
        "exponential": d.rng.uniform(1.0, 2.5),
    }


def _elbow(d: Draw) -> Parameters:
    return {"elbow_um": d.sign() * d.size() * d.scene.stroke_um}


def _by_density(key: str, limit: float, both: bool) -> Law:
    def law(d: Draw) -> Parameters:
        sign = d.sign() if both else 1.0
        value = sign * d.size() * d.scene.stroke_um / d.scene.density_um[key]
        return {key: float(np.clip(value, -limit, limit))}

    return law


def _bouc_wen(d: Draw) -> Parameters:
    share = d.size() * d.scene.stroke_um / d.scene.density_um["bouc_wen"]
    return {
        "bouc_wen": min(share, 1.0),
        "bouc_wen_power": d.rng.uniform(1.0, 2.0),
        "bouc_wen_gamma": d.rng.uniform(-0.3, 0.5),
    }


def _widening(power: tuple[float, float]) -> Law:
    def law(d: Draw) -> Parameters:
        return {
            "widen_V": d.size() * d.range_V / d.scene.loss_share,
            "widen_power": d.rng.uniform(*power),
            "reference_V_per_s": d.scene.fast_V_per_s,
        }

    return law


def _damping(d: Draw) -> Parameters:
    return {
        "damping_um": d.size() * d.scene.stroke_um,
        "reference_V_per_s": d.scene.fast_V_per_s,
    }


def _peak(d: Draw) -> Parameters:
    # What a swing leaves behind goes with its square.
    share = np.sqrt(d.strength) * d.rng.uniform(0.6, 1.0)
    return {"start_peak_V": d.scene.bias_V + share * (d.scene.u_max_V - d.scene.bias_V)}


def _peak_and_dip(d: Draw) -> Parameters:
    share = np.sqrt(d.strength) * d.rng.uniform(0.3, 0.6)
    dip_V = d.scene.bias_V - share * (d.scene.bias_V - d.scene.u_min_V)
    return _peak(d) | {"start_dip_V": dip_V}


def _creep(tilt: float, elements: int) -> Law:
    def law(d: Draw) -> Parameters:
        told = {"creep_per_decade": d.size()}
        if tilt:
            told["creep_tilt"] = d.rng.uniform(-tilt, tilt)
        return told | ({"creep_elements": float(elements)} if elements else {})

    return law


def _one_face(d: Draw) -> Parameters:
    return {"dead_band_um": d.size(0.007, 0.025) * d.scene.stroke_um}


def _two_faces(d: Draw) -> Parameters:
    return _one_face(d) | {"dead_band_spread": d.rng.uniform(0.05, 0.2)}


def _mode_hz(d: Draw) -> float:
    content_hz = d.scene.fast_V_per_s / (np.pi * 0.6 * d.range_V)
    return float(np.clip(content_hz * d.rng.uniform(3.0, 7.0), 20.0, 800.0))


def _one_mode(d: Draw) -> Parameters:
    zeta = np.exp(d.rng.uniform(np.log(0.008), np.log(0.1)))
    return {"fn_hz": _mode_hz(d), "zeta": float(zeta), "mode_share": d.strength}


def _two_modes(d: Draw) -> Parameters:
    first = _one_mode(d)
    return first | {
        "fn2_hz": first["fn_hz"] * d.rng.uniform(1.5, 2.5),
        "zeta2": d.rng.uniform(0.01, 0.08),
        "mode_share": 0.8 * d.strength,
        "mode2_share": 0.2 * d.strength,
    }


def _calibration(gain: bool, offset: bool) -> Law:
    def law(d: Draw) -> Parameters:
        told = {}
        if gain:
            told["gain"] = 1.0 + d.sign() * d.size(0.02, 0.05)
        if offset:
            told["offset_um"] = d.sign() * d.size() * d.scene.stroke_um
        return told

    return law


def _linear_drift(d: Draw) -> Parameters:
    return {"drift_um_per_s": d.sign() * d.size() * d.scene.stroke_um / d.seconds}


def _warming(d: Draw) -> Parameters:
    return {
        "drift_um": d.sign() * d.size() * d.scene.stroke_um,
        "drift_tau_s": d.rng.uniform(0.15, 0.7) * d.seconds,
    }


def _day(d: Draw) -> Parameters:
    return {
        "swing_um": d.size() * d.scene.stroke_um,
        "swing_period_s": d.rng.uniform(1.0, 5.0) * d.seconds,
        "swing_phase": d.rng.uniform(0.0, 2.0 * np.pi),
    }


def _hum(d: Draw) -> Parameters:
    amplitude_um = d.size(0.004, 0.012) * d.scene.stroke_um
    harmonic_um = d.rng.uniform(0.1, 0.4) * amplitude_um
    return {
        "freq_hz": float(d.rng.choice([50.0, 60.0])),
        "amp_um": amplitude_um,
        "harmonic_um": harmonic_um if d.rng.uniform() < 0.5 else 0.0,
    }


def _vibration(d: Draw) -> Parameters:
    high = d.rng.uniform() < 0.3
    return {
        "freq_hz": d.rng.uniform(105.0, 400.0) if high else d.rng.uniform(12.0, 95.0),
        "amp_um": d.size(0.004, 0.012) * d.scene.stroke_um,
    }


def _two_vibrations(d: Draw) -> Parameters:
    first = _vibration(d)
    return first | {
        "freq2_hz": d.rng.uniform(12.0, 95.0),
        "amp2_um": d.rng.uniform(0.3, 1.0) * first["amp_um"],
    }


def _skew(d: Draw) -> Parameters:
    ppm = 1e6 * d.late_s() / d.seconds
    return {"skew_ppm": d.sign() * min(ppm, 3000.0 * d.strength)}


LAWS: dict[str, dict[str, Law]] = {
    "delay": {"pure": _delay},
    "saturation": {
        "hard": _clip(None),
        "tanh": _clip(0),
        "algebraic": _clip(1),
        "exponential": _clip(2),
    },
    "slew_limit": {"equal": _slew(True), "slower fall": _slew(False)},
    "amplifier_lag": {
        "one pole": _one_pole,
        "capacitive load": _capacitive_load,
        "two poles": _two_poles,
    },
    "asymmetry": {
        "sine": _sine_bow,
        "exponential": _exponential,
        "one-sided dead zone": _elbow,
        "tilted density": _by_density("density_odd", 1.0, True),
    },
    "rate_dependence": {
        "power": _widening((0.5, 1.0)),
        "log": _widening((0.0, 0.0)),
        "lag of asinh": _damping,
    },
    "non_masing": {
        "waved density": _by_density("density_even", 1.0, True),
        "heaped density": _by_density("density_core", 10.0, False),
        "Bouc-Wen": _bouc_wen,
    },
    "initial_state": {"peak": _peak, "peak and dip": _peak_and_dip},
    "creep": {"log": _creep(0.0, 0), "power": _creep(0.2, 0), "ladder": _creep(0.0, 4)},
    "backlash": {"play": _one_face, "two faces": _two_faces},
    "resonance": {"one mode": _one_mode, "two modes": _two_modes},
    "gain_offset": {
        "both": _calibration(True, True),
        "gain": _calibration(True, False),
        "offset": _calibration(False, True),
    },
    "drift": {"linear": _linear_drift, "exponential": _warming, "sine": _day},
    "periodic_disturbance": {"hum": _hum, "vibration": _vibration, "two lines": _two_vibrations},
    "clock_skew": {"constant": _skew},
}
"""Effect to its laws by name."""


def draw_law(effect: str, draw: Draw) -> tuple[str, Parameters]:
    """A law of an effect, or of a disturbance outside the vocabulary, and its parameters."""
    if effect in OUTSIDE:
        told = OUTSIDE[effect].draw(draw.rng, draw.strength, draw.scene)
        return effect, {k: float(v) for k, v in told.items()}
    laws = LAWS[effect]
    name = str(draw.rng.choice(list(laws)))
    return name, {k: float(v) for k, v in laws[name](draw).items()}
