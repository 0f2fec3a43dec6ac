"""What can make the simulated actuator differ from the baseline predictor, and how strongly.

The names and keys are those of the diagnosis's vocabulary, and a few disturbances outside it.
The physics is in `madelung.stage` and host_sim.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from madelung.errors import InputError

Parameters = dict[str, float]


@dataclass(frozen=True)
class Effects:
    """Parameters of all effects; the defaults switch every one off. Units stand in the names.

    Attributes
    ----------
    delay_s, high_V, low_V, knee_V, knee_law, slew_V_per_s, slew_fall, corner_hz, corner2_hz,
    droop
        Input box. knee_V: how far below the limit the drive begins to clip; 0: hard; the knee is
        that of tanh (knee_law 0), x / sqrt(1 + x^2) (1) or 1 - exp(-x) (2). slew_fall: limit
        while falling over that while rising. corner2_hz: a second pole, below 5 kHz. droop: the
        amplifier's load is a capacitance that grows by this share over the range.
    bow_um, exponential_um, exponential, elbow_um, density_odd
        Asymmetry: a bow over the drive, a sine or of (exp(k v) - 1) / (exp(k) - 1); a one-sided
        dead zone behind the hysteresis, from mid-range on; or a relay density that is tilted
        towards one end (-1 to 1).
    density_even, density_core, bouc_wen, bouc_wen_power, bouc_wen_gamma
        Non-Masing: a relay density that is waved (-1 to 1) or heaped (-1 to 10) about mid-range;
        or Bouc-Wen's hysteresis for this share of the loop's width, with its power and gamma over
        beta.
    widen_V, widen_power, damping_um, reference_V_per_s
        Rate dependence: relays switch later by widen_V * (rate / reference)^power, for power 0 by
        widen_V * log(1 + 10 rate / reference) / log(11); the displacement lags by
        damping_um * asinh(10 rate / reference) / asinh(10).
    start_peak_V, start_dip_V
        Initial state: where the drive turned before the record, and where it turned after that.
    creep_per_decade, creep_tilt, creep_elements
        Creep between 1 s and 10 s after a step, share of the step; the spectrum over the time
        constant goes with tau^tilt (0: log t, else a power of t); creep_elements: a ladder of so
        few elements, 0: many.
    dead_band_um, dead_band_spread
        Backlash, full width; of two faces, wider and narrower by this share.
    fn_hz, zeta, mode_share, fn2_hz, zeta2, mode2_share
        Flexure modes and how much of the motion each carries.
    gain, offset_um
        Sensor.
    drift_um_per_s, drift_um, drift_tau_s, swing_um, swing_period_s, swing_phase
        Drift: linear, an exponential approach to drift_um, and a sine that begins at 0.
    freq_hz, amp_um, harmonic_um, freq2_hz, amp2_um
        Periodic disturbance, its second harmonic, and another line.
    skew_ppm
        Clock skew.
    walk_um
        Outside: a random walk of this rms after 10 s.
    stuck_bit
        Outside: a bit of the sensor's converter that always reads 1; bit 0 is the last. -1: none.
    heating_um
        Outside: thermal expansion at the power of full swings at reference_V_per_s, with a time
        constant of 6 s.
    impulse_um
        Outside: size of impulses that hit one sample in 200.
    fringe_um, fringe_period_um
        Outside: an interferometer's cyclic error.
    fading_per_s
        Outside: the sensor's gain changes by this share a second.
    jitter_s
        Outside: rms by which each reading is taken too early or too late.
    missed_share
        Outside: share of the commands that the converter misses.
    """

    delay_s: float = 0.0
    high_V: float = np.inf
    low_V: float = -np.inf
    knee_V: float = 0.0
    knee_law: float = 0
    slew_V_per_s: float = np.inf
    slew_fall: float = 1.0
    corner_hz: float = np.inf
    corner2_hz: float = np.inf
    droop: float = 0.0
    bow_um: float = 0.0
    exponential_um: float = 0.0
    exponential: float = 1.0
    elbow_um: float = 0.0
    density_odd: float = 0.0
    density_even: float = 0.0
    density_core: float = 0.0
    bouc_wen: float = 0.0
    bouc_wen_power: float = 1.0
    bouc_wen_gamma: float = 0.0
    widen_V: float = 0.0
    widen_power: float = 1.0
    damping_um: float = 0.0
    reference_V_per_s: float = 1000.0
    start_peak_V: float = -np.inf
    start_dip_V: float = np.inf
    creep_per_decade: float = 0.0
    creep_tilt: float = 0.0
    creep_elements: float = 0
    dead_band_um: float = 0.0
    dead_band_spread: float = 0.0
    fn_hz: float = 300.0
    zeta: float = 0.05
    mode_share: float = 0.0
    fn2_hz: float = 600.0
    zeta2: float = 0.05
    mode2_share: float = 0.0
    gain: float = 1.0
    offset_um: float = 0.0
    drift_um_per_s: float = 0.0
    drift_um: float = 0.0
    drift_tau_s: float = 5.0
    swing_um: float = 0.0
    swing_period_s: float = 100.0
    swing_phase: float = 0.0
    freq_hz: float = 50.0
    amp_um: float = 0.0
    harmonic_um: float = 0.0
    freq2_hz: float = 50.0
    amp2_um: float = 0.0
    skew_ppm: float = 0.0
    walk_um: float = 0.0
    stuck_bit: float = -1
    heating_um: float = 0.0
    impulse_um: float = 0.0
    fringe_um: float = 0.0
    fringe_period_um: float = 1.0
    fading_per_s: float = 0.0
    jitter_s: float = 0.0
    missed_share: float = 0.0

    def at_identification(self) -> Effects:
        """Without what began after the baseline was identified."""
        late = {key for name in LATE for key in EFFECTS[name].keys}
        off: dict[str, Any] = {f.name: f.default for f in fields(self) if f.name in late}
        return replace(self, **off)

    @property
    def fastest_hz(self) -> float:
        """The fastest pole that acts, Hz, but for corner2_hz; 0 when none does."""
        poles = [f for f, share in self.modes_hz if share]
        return max([*poles, self.corner_hz if np.isfinite(self.corner_hz) else 0.0])

    @property
    def modes_hz(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """(natural frequency in Hz, share) of both modes."""
        return ((self.fn_hz, self.mode_share), (self.fn2_hz, self.mode2_share))


@dataclass(frozen=True)
class Scene:
    """What the sizes of effects are measured against.

    Attributes
    ----------
    u_min_V, u_max_V, stroke_um
        Of the stage.
    loss_share
        Share of the stroke that the relays carry.
    fast_V_per_s
        The rate that the training records reach in a twentieth of the time.
    highest_V_per_s
        Their highest rate.
    bias_V
        A voltage at which some record starts.
    density_um
        Of a unit of density_odd, density_even, density_core and bouc_wen: the largest deviation
        from a model with Madelung's rules, um.
    adc_step_um
        Of the sensor's converter.
    """

    u_min_V: float
    u_max_V: float
    stroke_um: float
    loss_share: float
    fast_V_per_s: float
    highest_V_per_s: float
    bias_V: float
    density_um: dict[str, float]
    adc_step_um: float


@dataclass(frozen=True)
class Effect:
    """Keys of an effect's parameters, and how they are drawn for a strength (1: ordinary)."""

    keys: tuple[str, ...]
    draw: Callable[[np.random.Generator, float, Scene], Parameters]


def _sign(rng: np.random.Generator) -> float:
    return 1.0 if rng.uniform() < 0.5 else -1.0


def _delay(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    return {"delay_s": strength * rng.uniform(0.3e-3, 1.0e-3)}


def _saturation(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    cut = strength * rng.uniform(0.03, 0.10, 2) * (scene.u_max_V - scene.u_min_V)
    ends = rng.integers(3)
    limits = {}
    if ends != 1:
        limits["high_V"] = scene.u_max_V - cut[0]
    if ends != 0:
        limits["low_V"] = scene.u_min_V + cut[1]
    return limits | {"knee_V": float(rng.choice([0.0, 0.7])) * float(cut.min())}


def _slew_limit(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    share = 1.0 - strength * (1.0 - rng.uniform(0.5, 0.8))
    return {"slew_V_per_s": share * scene.highest_V_per_s}


def _amplifier_lag(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    return {"corner_hz": rng.uniform(30.0, 150.0) / strength}


def _asymmetry(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    size = strength * rng.uniform(0.01, 0.04) * scene.stroke_um * _sign(rng)
    if rng.uniform() < 0.5:
        return {"bow_um": size}
    return {"density_odd": _limited(size / scene.density_um["density_odd"], 1.0)}


def _non_masing(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    size = strength * rng.uniform(0.01, 0.04) * scene.stroke_um
    if rng.uniform() < 0.5:
        unit = scene.density_um["density_even"]
        return {"density_even": _limited(_sign(rng) * size / unit, 1.0)}
    return {"density_core": _limited(size / scene.density_um["density_core"], 10.0)}


def _limited(value: float, limit: float) -> float:
    return float(np.clip(value, -limit, limit))


def _rate_dependence(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    share = strength * rng.uniform(0.01, 0.04)
    reference = {"reference_V_per_s": scene.fast_V_per_s}
    if rng.uniform() < 0.5:
        return {"damping_um": share * scene.stroke_um} | reference
    widen = share * (scene.u_max_V - scene.u_min_V) / scene.loss_share
    return {"widen_V": widen, "widen_power": rng.uniform(0.6, 1.0)} | reference


def _initial_state(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    # What a swing leaves behind goes with its square.
    share = np.sqrt(strength) * rng.uniform(0.6, 1.0)
    return {"start_peak_V": scene.bias_V + share * (scene.u_max_V - scene.bias_V)}


def _creep(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    return {
        "creep_per_decade": strength * rng.uniform(0.01, 0.03),
        "creep_tilt": rng.uniform(-0.1, 0.1),
    }


def _backlash(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    return {"dead_band_um": strength * rng.uniform(0.005, 0.02) * scene.stroke_um}


def _resonance(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    fn = rng.uniform(150.0, 800.0)
    zeta = np.exp(rng.uniform(np.log(0.01), np.log(0.1), 2))
    one = {"fn_hz": fn, "zeta": float(zeta[0]), "mode_share": strength}
    if rng.uniform() < 0.7:
        return one
    second = {"fn2_hz": fn * rng.uniform(1.5, 2.5), "zeta2": float(zeta[1])}
    return one | second | {"mode_share": 0.8 * strength, "mode2_share": 0.2 * strength}


def _gain_offset(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    return {
        "gain": 1.0 + _sign(rng) * strength * rng.uniform(0.02, 0.05),
        "offset_um": _sign(rng) * strength * rng.uniform(0.005, 0.02) * scene.stroke_um,
    }


def _drift(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    size = _sign(rng) * strength * rng.uniform(0.01, 0.03) * scene.stroke_um
    linear = rng.uniform()
    return {
        "drift_um_per_s": linear * size / 15.0,
        "drift_um": (1.0 - linear) * size,
        "drift_tau_s": rng.uniform(2.0, 10.0),
    }


def _periodic_disturbance(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    amplitude = strength * rng.uniform(0.003, 0.01) * scene.stroke_um
    frequency = 50.0 if rng.uniform() < 0.5 else rng.uniform(20.0, 90.0)
    harmonic = 0.3 * amplitude if rng.uniform() < 0.3 else 0.0
    return {"freq_hz": frequency, "amp_um": amplitude, "harmonic_um": harmonic}


def _clock_skew(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    return {"skew_ppm": _sign(rng) * strength * rng.uniform(100.0, 1000.0)}


def _random_walk(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    return {"walk_um": strength * rng.uniform(0.01, 0.03) * scene.stroke_um}


def _stuck_bit(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    size = strength * rng.uniform(0.01, 0.04) * scene.stroke_um
    return {"stuck_bit": max(0.0, float(np.rint(np.log2(size / scene.adc_step_um))))}


def _self_heating(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    size = strength * rng.uniform(0.02, 0.05) * scene.stroke_um
    return {"heating_um": size, "reference_V_per_s": scene.fast_V_per_s}


def _impulses(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    return {"impulse_um": strength * rng.uniform(0.01, 0.05) * scene.stroke_um}


def _fringes(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    return {
        "fringe_um": strength * rng.uniform(0.003, 0.01) * scene.stroke_um,
        "fringe_period_um": rng.uniform(0.08, 0.15) * scene.stroke_um,
    }


def _fading_gain(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    return {"fading_per_s": _sign(rng) * strength * rng.uniform(0.002, 0.006)}


def _jitter(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    size_V = strength * rng.uniform(0.01, 0.03) * (scene.u_max_V - scene.u_min_V)
    return {"jitter_s": size_V / scene.fast_V_per_s}


def _missed_commands(rng: np.random.Generator, strength: float, scene: Scene) -> Parameters:
    return {"missed_share": min(strength * rng.uniform(0.1, 0.3), 0.5)}


VOCABULARY: dict[str, Effect] = {
    "delay": Effect(("delay_s",), _delay),
    "saturation": Effect(("high_V", "low_V", "knee_V", "knee_law"), _saturation),
    "slew_limit": Effect(("slew_V_per_s", "slew_fall"), _slew_limit),
    "amplifier_lag": Effect(("corner_hz", "corner2_hz", "droop"), _amplifier_lag),
    "asymmetry": Effect(
        ("bow_um", "exponential_um", "exponential", "elbow_um", "density_odd"), _asymmetry
    ),
    "rate_dependence": Effect(
        ("widen_V", "widen_power", "damping_um", "reference_V_per_s"), _rate_dependence
    ),
    "non_masing": Effect(
        ("density_even", "density_core", "bouc_wen", "bouc_wen_power", "bouc_wen_gamma"),
        _non_masing,
    ),
    "initial_state": Effect(("start_peak_V", "start_dip_V"), _initial_state),
    "creep": Effect(("creep_per_decade", "creep_tilt", "creep_elements"), _creep),
    "backlash": Effect(("dead_band_um", "dead_band_spread"), _backlash),
    "resonance": Effect(
        ("fn_hz", "zeta", "mode_share", "fn2_hz", "zeta2", "mode2_share"), _resonance
    ),
    "gain_offset": Effect(("gain", "offset_um"), _gain_offset),
    "drift": Effect(
        (
            "drift_um_per_s",
            "drift_um",
            "drift_tau_s",
            "swing_um",
            "swing_period_s",
            "swing_phase",
        ),
        _drift,
    ),
    "periodic_disturbance": Effect(
        ("freq_hz", "amp_um", "harmonic_um", "freq2_hz", "amp2_um"), _periodic_disturbance
    ),
    "clock_skew": Effect(("skew_ppm",), _clock_skew),
}
"""The effects that a diagnosis can name."""

OUTSIDE: dict[str, Effect] = {
    "random_walk": Effect(("walk_um",), _random_walk),
    "stuck_bit": Effect(("stuck_bit",), _stuck_bit),
    "self_heating": Effect(("heating_um", "reference_V_per_s"), _self_heating),
    "impulses": Effect(("impulse_um",), _impulses),
    "fringes": Effect(("fringe_um", "fringe_period_um"), _fringes),
    "fading_gain": Effect(("fading_per_s",), _fading_gain),
    "jitter": Effect(("jitter_s",), _jitter),
    "missed_commands": Effect(("missed_share",), _missed_commands),
}
"""Disturbances that it cannot name: the right verdict is `unknown`."""

EFFECTS = VOCABULARY | OUTSIDE

LATE = (
    "initial_state",
    "gain_offset",
    "drift",
    "periodic_disturbance",
    "clock_skew",
    "random_walk",
    "stuck_bit",
    "impulses",
    "fringes",
    "fading_gain",
    "jitter",
    "missed_commands",
)
"""What began after identify.csv was recorded."""


def draw_effects(
    wanted: Mapping[str, float | Parameters], rng: np.random.Generator, scene: Scene
) -> tuple[Effects, dict[str, Parameters]]:
    """Parameters of the effects wanted.

    Parameters
    ----------
    wanted
        Effect to its strength (1: ordinary size), or to parameters by their names in `Effects`.

    Returns
    -------
    All parameters, and those of each effect wanted.

    Raises
    ------
    InputError
        An unknown effect or parameter, or a strength that is not positive.
    """
    drawn: dict[str, Parameters] = {}
    for name, told in wanted.items():
        if name not in EFFECTS:
            raise InputError(f"no effect {name!r}; known are {', '.join(EFFECTS)}")
        effect = EFFECTS[name]
        if isinstance(told, dict):
            if not told.keys() <= set(effect.keys):
                raise InputError(f"{name} has the parameters {', '.join(effect.keys)}")
            drawn[name] = {k: float(v) for k, v in told.items()}
        elif told > 0.0:
            drawn[name] = {k: float(v) for k, v in effect.draw(rng, told, scene).items()}
        else:
            raise InputError(f"the strength of {name} is {told:g}: it must be above 0")
    together: dict[str, Any] = {k: v for one in drawn.values() for k, v in one.items()}
    return Effects(**together), drawn
