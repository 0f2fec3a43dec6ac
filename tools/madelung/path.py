"""The signal path in physical units, discretised for the C core.

Every effect that the firmware can run is a block of the chain (mdl_chain.h). Here its parameters
are in units; the coefficients for a sample time are computed in double, exact for an input that
is linear between samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from madelung.blocks import UNLIMITED_V, Block, blocks_from_json
from madelung.core import Chain, Core, Precision, Predictor
from madelung.model import MARGIN_SHARE, Model
from madelung.yang2015 import Yang, YangParams, discretise_yang

Array = NDArray[np.float64]
SHAPE_ORDER = 4
FLAT = ((0.0,) * SHAPE_ORDER,) * SHAPE_ORDER
SLEW_SUBSTEPS = 4
RATE_SUBSTEPS = 4
MODE_SUBSTEPS = (2, 8)
MODE_STEP_SHARE = 0.1
"""Of a mode's period: a substep is no longer, within the bounds above."""
BELOW_1 = 1 - 2**-24
"""The float below 1, which in a decay stands for the law of the square."""
VELOCITY_SAMPLES = 0.5
"""Least time constant of the velocity filter of the rate block, in (sub)samples."""
LEAN_MIN = 1e-6
"""Of a load, below which it does not act: its terms would be nothing but rounding."""
TINY = 1e-37
"""Coefficients below this are 0: the DSP takes denormal floats for zero."""


@dataclass(frozen=True)
class Mode:
    """A flexure mode: natural frequency (Hz), damping ratio, share of the static displacement."""

    fn_hz: float
    zeta: float
    share: float = 1.0


@dataclass(frozen=True)
class CreepMode:
    """A mode of the creep ladder: time constant (s), share of the displacement."""

    tau_s: float
    gain: float


@dataclass(frozen=True)
class SignalPath:
    """Parameters of all blocks; the defaults switch every one off.

    Attributes
    ----------
    u_min_V, range_V
        Identified range of the command.
    f0
        Coefficients of the major ascending curve, um / V^k, ascending, at most degree 7.
    shape
        (4, 4), um: terms s'^j m'^k, row k - 1, column j - 1 (mdl_shape.h).
    loop_share, loop_slope
        Share by which minor loops are wider, l_0 and l_1 of mdl_shape.h.
    rise_V, rise_skew, fall_V, fall_skew, follow
        Envelopes of a generalised play (mdl_envelope.h).
    high_V, low_V, knee_V, knee_power, parabolic, rest_free
        Saturation of the drive; a power, or 1 for a parabola, makes another knee (mdl_drive.h).
    slew_V_per_s, slew_fall_V_per_s, slew_knee_V
        Slew limit, 0: none; for falling commands, 0: the same; the lag at which the rate
        saturates, 0: hard, else both ways are equal.
    corner_hz, corner_lean, behind_hz
        Amplifier lag, 0: none; share by which its time constant is larger at u_max than in the
        middle, as of a load whose capacitance grows with the voltage, and smaller at u_min; a pole
        behind the hysteresis, 0: none.
    damping_um, widening, threshold_V, swelling, lean, power, v_ref_V_per_s, v_knee,
    velocity_tau_s
        Rate dependence (mdl_rate.h); the knee is in units of the reference, the last filters the
        velocity.
    of_speed
        1: all but the damping go with the filtered speed, 0: with the filtered velocity.
    relax_s, relax_per_V_s
        Viscous operators (mdl_plays.h): tau, or k, of which only one may be set; 0: none.
    smooth
        The command between samples, 0: linear, 1: a parabola (mdl_chain.h); with rate dependence.
    bouc_um, bouc_V, bouc_power, bouc_gamma
        A part by Bouc and Wen (mdl_bouc.h): size, reach, n, gamma.
    creep, modes
        Creep ladder, flexure modes.
    dead_band_um, spread, spring_share
        Backlash, full width; share of it by which a rough contact's widths differ at most; share of
        the displacement that a spring carries across the gap.
    delay_s, substeps_min
        Pure delay; steps per sample in which the command is taken as linear, at least.
    gain, offset_um
        Sensor: y' = gain (y - y(u_min)) + y(u_min) + offset.
    yang
        The model that stands in the trajectory's place, if it does.
    """

    u_min_V: float
    range_V: float
    f0: tuple[float, ...]
    shape: tuple[tuple[float, ...], ...] | None = None
    loop_share: float = 0.0
    loop_slope: float = 0.0
    rise_V: float = 0.0
    rise_skew: float = 0.0
    fall_V: float = 0.0
    fall_skew: float = 0.0
    follow: float = 0.0
    high_V: float = UNLIMITED_V
    low_V: float = -UNLIMITED_V
    knee_V: float = 0.0
    knee_power: float = 0.0
    parabolic: float = 0.0
    rest_free: float = 0.0
    slew_V_per_s: float = 0.0
    slew_fall_V_per_s: float = 0.0
    slew_knee_V: float = 0.0
    corner_hz: float = 0.0
    corner_lean: float = 0.0
    behind_hz: float = 0.0
    damping_um: float = 0.0
    widening: float = 0.0
    threshold_V: float = 0.0
    swelling: float = 0.0
    lean: float = 0.0
    power: float = 1.0
    v_ref_V_per_s: float = 1.0
    v_knee: float = 0.0
    velocity_tau_s: float = 0.0
    of_speed: float = 0.0
    relax_s: float = 0.0
    relax_per_V_s: float = 0.0
    smooth: float = 0.0
    bouc_um: float = 0.0
    bouc_V: float = 1.0
    bouc_power: float = 1.0
    bouc_gamma: float = 0.0
    creep: tuple[CreepMode, ...] = field(default=())
    modes: tuple[Mode, ...] = field(default=())
    dead_band_um: float = 0.0
    spread: float = 0.0
    spring_share: float = 0.0
    delay_s: float = 0.0
    substeps_min: int = 1
    gain: float = 1.0
    offset_um: float = 0.0
    yang: Yang | None = None

    def but(self, **changes: Any) -> SignalPath:
        """A copy with some parameters changed."""
        return replace(self, **changes)

    def substeps(self, step_s: float) -> int:
        """Steps per sample: slew limit and rate dependence need more than one.

        So do flexure modes and a pole behind the hysteresis, which feel that a branch is curved
        between samples, and the more so the fewer samples a period has.
        """
        least, most = MODE_SUBSTEPS
        behind = [*(m.fn_hz for m in self.modes), *([self.behind_hz] if self.behind_hz else [])]
        wanted = int(np.ceil(max(behind, default=0.0) * step_s / MODE_STEP_SHARE))
        needed = (
            (SLEW_SUBSTEPS, self.slew_V_per_s > 0),
            (RATE_SUBSTEPS, self.has_rate),
            (min(max(least, wanted), most), bool(behind)),
        )
        return max(1, int(self.substeps_min), *(n for n, on in needed if on))

    @property
    def has_rate(self) -> bool:
        """Whether the rate block acts."""
        sizes = (self.damping_um, self.widening, self.threshold_V, self.swelling)
        return any((*sizes, self.relax_s, self.relax_per_V_s))


def lag_coefficients(tau_s: float, step_s: float) -> tuple[float, float]:
    """``decay``, ``ramp`` of mdl_lag.h for a pole with time constant tau."""
    decay = -np.expm1(-step_s / tau_s)
    return float(decay), float(decay * tau_s / step_s)


def mode_coefficients(fn_hz: float, zeta: float, step_s: float) -> tuple[Array, Array]:
    """``phi`` (2, 2) less the unit matrix, and ``gamma`` (2,) of mdl_mode.h."""
    x = 2 * np.pi * fn_hz * step_s
    root = np.sqrt(complex(zeta**2 - 1)) or 1e-6j  # critical damping: next to it
    e1, e2 = np.expm1(x * (-zeta + np.array([root, -root])))  # the poles' decays less 1
    cosine, sine = ((e1 + e2) / 2).real, ((e1 - e2) / (2 * root)).real
    phi = np.array([[cosine + zeta * sine, sine], [-sine, cosine - zeta * sine]])
    gamma = np.array([[2 * zeta, 1.0], [-1.0, 0.0]]) @ phi[:, 0] / x  # -A^-1 (Phi - I) (1, 0) / h
    return phi, gamma


def delay_coefficients(delay_s: float, step_s: float, smooth: bool = True) -> tuple[int, Array]:
    """Whole samples and the four weights of mdl_delay.h.

    Third-order Lagrange where the displacement is smooth; between two neighbours where it has a
    kink at every sample of the command, which a longer interpolation would blur.
    """
    samples = delay_s / step_s
    whole = max(int(np.floor(samples)) - 1, 0)
    at = samples - whole
    nodes = np.arange(4.0)
    if not smooth:
        return whole, np.maximum(1.0 - np.abs(at - nodes), 0.0)
    weights = [np.prod([(at - n) / (k - n) for n in nodes if n != k]) for k in nodes]
    return whole, np.array(weights)


def discretise(path: SignalPath, step_s: float, substeps: int | None = None) -> Chain:
    """The blocks of a signal path for a sample time; what does nothing stays off.

    ``substeps`` is given where it is not to be the path's own.
    """
    n = substeps or path.substeps(step_s)
    inner_s = step_s / n
    return Chain(
        substeps=n,
        smooth=_flushed(path.smooth) if path.has_rate else 0.0,
        shape=path.shape or (FLAT if any(_loop(path)) else None),
        loop=_loop(path),
        saturation=_saturation(path),
        slew=_slew(path, inner_s) if path.slew_V_per_s else None,
        lag=_loaded(path.corner_hz, path.corner_lean, inner_s),
        behind=_pole(path.behind_hz, inner_s),
        rate=_rate(path, inner_s) if path.has_rate else None,
        envelope=_envelope(path) if path.rise_V > 0 or path.fall_V > 0 else None,
        bouc=(path.bouc_um, 1 / path.bouc_V, path.bouc_power, path.bouc_gamma)
        if path.bouc_um
        else None,
        creep=tuple((*_lag(m.tau_s, inner_s), m.gain) for m in path.creep),
        modes=tuple(_mode(m, inner_s) for m in path.modes),
        backlash=(path.dead_band_um, path.spread, path.spring_share) if path.dead_band_um else None,
        delay=_delay(path, inner_s) if path.delay_s > 0 else None,
        gain=(path.gain, path.offset_um) if path.gain != 1.0 or path.offset_um != 0.0 else None,
        yang=_yang(path, path.yang, inner_s) if path.yang is not None else None,
    )


def _yang(path: SignalPath, yang: Yang, step_s: float) -> YangParams:
    u_max_V = path.u_min_V + path.range_V
    return discretise_yang(yang, path.u_min_V, u_max_V, MARGIN_SHARE * path.range_V, step_s)


def _saturation(path: SignalPath) -> tuple[float, ...] | None:
    limited = path.high_V < UNLIMITED_V or path.low_V > -UNLIMITED_V
    if not limited:
        return None
    knee = (path.knee_V, path.knee_power, path.parabolic)
    return path.high_V, path.low_V, *knee, path.rest_free


def _pole(corner_hz: float, step_s: float) -> tuple[float, float] | None:
    return _lag(1 / (2 * np.pi * corner_hz), step_s) if corner_hz else None


def _loaded(corner_hz: float, lean: float, step_s: float) -> tuple[float, ...] | None:
    """The pole in the middle of the range, and the terms that make those at both ends of it."""
    middle = _pole(corner_hz, step_s)
    if middle is None or abs(lean) < LEAN_MIN:
        return middle and (*middle, *[0.0] * 5)
    tau_s = 1 / (2 * np.pi * corner_hz)
    w = np.array([-z * lean / (1 + z * lean) for z in (-1, 1)])
    ends = [lag_coefficients(tau_s * (1 + z * lean), step_s) for z in (-1, 1)]
    rises = np.array(ends) - lag_coefficients(tau_s, step_s)
    slope, bend = np.linalg.solve(np.column_stack([w, w**2]), rises)
    return (*middle, lean, *(_flushed(float(t)) for t in (*slope, *bend)))


def _lag(tau_s: float, step_s: float) -> tuple[float, float]:
    decay, ramp = lag_coefficients(tau_s, step_s)
    return _flushed(decay), _flushed(ramp)


def _slew(path: SignalPath, step_s: float) -> tuple[float, float, float, float, float]:
    rise_V = path.slew_V_per_s * step_s
    if path.slew_knee_V == 0.0:
        return rise_V, (path.slew_fall_V_per_s or path.slew_V_per_s) * step_s, 0.0, 0.0, 0.0
    steps = max(rise_V / path.slew_knee_V, 1e-6)
    early = 0.5 + steps / 12 if steps < 1e-3 else -1 / np.expm1(-steps) - 1 / steps
    return rise_V, rise_V, path.slew_knee_V, _flushed(float(np.exp(-steps))), float(early)


def _rate(path: SignalPath, step_s: float) -> tuple[float, ...]:
    tau_s = max(path.velocity_tau_s, VELOCITY_SAMPLES * step_s)
    scale = -1.0 / (tau_s * path.v_ref_V_per_s)
    return (
        *_lag(tau_s, step_s),
        scale,
        path.power,
        path.v_knee,
        _flushed(path.v_knee**path.power),
        path.damping_um,
        path.widening,
        path.threshold_V,
        path.swelling,
        path.lean,
        path.of_speed,
        *_relax(path.relax_s, path.relax_per_V_s, step_s),
    )


def _loop(path: SignalPath) -> tuple[float, float]:
    return path.loop_share, path.loop_slope


def _envelope(path: SignalPath) -> tuple[float, ...]:
    return (1 / path.range_V, *(getattr(path, k) for k in _ENVELOPE))


def _relax(tau_s: float, per_V_s: float, step_s: float) -> tuple[float, float, float]:
    """``decay``, ``early``, ``pull`` of mdl_plays.h; k goes before tau."""
    if per_V_s:
        return 1.0, 0.0, per_V_s * step_s
    if not tau_s:
        return 0.0, 0.0, 0.0
    h = step_s / tau_s
    # 1 / h - e^-h / (1 - e^-h), by its series where digits would cancel
    early = 1 / h + 1 / np.expm1(-h) + 1 if h > 1e-3 else 0.5 - h / 12
    return _flushed(min(float(np.exp(-h)), BELOW_1)), float(early), 0.0


def _mode(mode: Mode, step_s: float) -> tuple[float, ...]:
    phi, gamma = mode_coefficients(mode.fn_hz, mode.zeta, step_s)
    return (*(_flushed(float(v)) for v in (*phi.ravel(), *gamma)), mode.share)


def _delay(path: SignalPath, step_s: float) -> tuple[int, tuple[float, ...]]:
    smooth = path.substeps_min == 1 or bool(path.modes)
    whole, weights = delay_coefficients(path.delay_s, step_s, smooth)
    return whole, tuple(_flushed(float(w)) for w in weights)


def _flushed(value: float) -> float:
    return value if abs(value) >= TINY else 0.0


_FIELDS = {
    "delay": ("delay_s", "substeps_min"),
    "saturation": ("high_V", "low_V", "knee_V", "knee_power", "parabolic", "rest_free"),
    "slew_limit": ("slew_V_per_s", "slew_fall_V_per_s", "slew_knee_V"),
    "amplifier_lag": ("corner_hz", "corner_lean", "behind_hz"),
    "rate_dependence": (
        "damping_um",
        "widening",
        "threshold_V",
        "swelling",
        "lean",
        "power",
        "v_ref_V_per_s",
        "v_knee",
        "velocity_tau_s",
        "of_speed",
        "relax_s",
        "relax_per_V_s",
        "smooth",
    ),
    "backlash": ("dead_band_um", "spread", "spring_share"),
    "gain_offset": ("gain", "offset_um"),
}
"""Fields of `SignalPath` that are the parameters of an effect, under the same names."""
_BOUC = ("bouc_um", "bouc_V", "bouc_power", "bouc_gamma")
_ENVELOPE = ("rise_V", "rise_skew", "fall_V", "fall_skew", "follow")
_LOOP = ("loop_share", "loop_slope")
_BESIDE = {"asymmetry": _ENVELOPE, "non_masing": (*_BOUC, *_LOOP)}
"""What else an effect of the shape may be, under the same names."""
_SHAPED = {"asymmetry": (1, 3), "non_masing": (2, 4)}
"""Powers of the middle: odd ones break the central symmetry, even ones bend minor loops alone."""
_SECONDARY = (
    "rise_skew",
    "fall_skew",
    "follow",
    "bouc_V",
    "bouc_power",
    "bouc_gamma",
    "knee_V",
    "knee_power",
    "parabolic",
    "rest_free",
    "slew_fall_V_per_s",
    "slew_knee_V",
    "power",
    "v_ref_V_per_s",
    "v_knee",
    "velocity_tau_s",
    "of_speed",
    "smooth",
    "lean",
    "spread",
    "spring_share",
    "corner_lean",
    "substeps_min",
)
"""Parameters that do nothing by themselves."""


def _acts(path: SignalPath, idle: SignalPath, keys: Sequence[str]) -> bool:
    return any(getattr(path, k) != getattr(idle, k) for k in keys if k not in _SECONDARY)


def path_to_blocks(path: SignalPath, models: Mapping[str, str] | None = None) -> tuple[Block, ...]:
    """The effects of a signal path that act, with their parameters in units.

    Parameters
    ----------
    models
        By effect: the name of its physical model, for people.
    """
    names = models or {}
    idle = SignalPath(path.u_min_V, path.range_V, path.f0)
    found: dict[str, dict[str, Any]] = {}
    for effect, keys in _FIELDS.items():
        if _acts(path, idle, keys):
            found[effect] = {k: float(getattr(path, k)) for k in keys}
    for effect, rows in _SHAPED.items():
        shape = np.zeros((SHAPE_ORDER, SHAPE_ORDER)) if path.shape is None else np.array(path.shape)
        terms = {(k, j): float(shape[k - 1, j - 1]) for k in rows for j in range(1, 5)}
        beside = _BESIDE[effect] if _acts(path, idle, _BESIDE[effect]) else ()
        if any(terms.values()) or beside:
            found[effect] = {f"g{k}{j}_um": g for (k, j), g in terms.items()}
            found[effect] |= {k: getattr(path, k) for k in beside}
    if path.creep:
        found["creep"] = {"modes": [asdict(m) for m in path.creep]}
    if path.modes:
        found["resonance"] = {"modes": [asdict(m) for m in path.modes]}
    blocks = [{"effect": e, "model": names.get(e, ""), "parameters": p} for e, p in found.items()]
    return blocks_from_json(blocks)


def path_of(model: Model) -> SignalPath:
    """The signal path of any model but a ``major_curve``; initial_state is not part of it."""
    fields: dict[str, Any] = {"yang": model.yang}
    shape = np.zeros((SHAPE_ORDER, SHAPE_ORDER))
    for block in model.blocks:
        p = block.parameters
        if block.effect in _FIELDS:
            fields |= p
        elif block.effect in _SHAPED:
            for k in _SHAPED[block.effect]:
                shape[k - 1] = [p[f"g{k}{j}_um"] for j in range(1, SHAPE_ORDER + 1)]
            fields |= {k: p[k] for k in _BESIDE[block.effect] if k in p}
        elif block.effect == "creep":
            fields["creep"] = tuple(CreepMode(**m) for m in p["modes"])
        elif block.effect == "resonance":
            fields["modes"] = tuple(Mode(**m) for m in p["modes"])
    if shape.any():
        fields["shape"] = tuple(map(tuple, shape.tolist()))
    return SignalPath(model.u_min_V, model.range_V, model.f0, **fields)


def augmented_model(
    path: SignalPath,
    u_max_V: float,
    models: Mapping[str, str] | None = None,
    start: Mapping[str, float] | None = None,
    not_in_firmware: Sequence[Block] = (),
    extra: Mapping[str, Any] | None = None,
) -> Model:
    """A model of kind ``augmented`` from a signal path.

    Parameters
    ----------
    models
        By effect: the name of its physical model.
    start
        Parameters of initial_state: ``start_peak_V``, which the records' history has been to, and
        ``start_dip_V``, to which it then went back, if it did.
    not_in_firmware
        Effects that no open-loop predictor can run.
    extra
        Further keys of the file.

    Raises
    ------
    InputError
        A parameter is not finite or out of its range.
    """
    blocks = path_to_blocks(path, models)
    if start is not None:
        name = (models or {}).get("initial_state", "")
        blocks += blocks_from_json(
            [{"effect": "initial_state", "model": name, "parameters": dict(start)}]
        )
    return Model(
        "augmented",
        path.u_min_V,
        u_max_V,
        f0=path.f0,
        blocks=blocks,
        not_in_firmware=tuple(not_in_firmware),
        extra=dict(extra or {}),
    )


def predictor(model: Model, precision: Precision, step_s: float, start_V: float) -> Predictor:
    """A model's predictor with its blocks, for a record.

    Parameters
    ----------
    step_s
        Sample time of the record, s.
    start_V
        First command of the record, V; it follows the history of initial_state, if there is one.

    Raises
    ------
    InputError
        The core refuses a parameter, or has too little memory for a block.
    """
    made = Predictor(model, precision, discretise(path_of(model), step_s))
    for block in model.blocks:
        if block.effect == "initial_state":
            p = block.parameters
            made.lead([max(p["start_peak_V"], start_V), min(p["start_dip_V"], start_V)])
    return made


class Runner(Core):
    """Runs signal paths over records in the C core.

    Parameters
    ----------
    u_min_V, range_V
        Identified range of the command.
    precision
        ``float64`` for fits, ``float32`` for what the firmware computes.
    """

    def __init__(self, u_min_V: float, range_V: float, precision: Precision = "float64") -> None:
        super().__init__(precision)
        self._make_polynomial(u_min_V, range_V, MARGIN_SHARE * range_V, [0.0])

    def run(
        self,
        path: SignalPath,
        u_V: ArrayLike,
        step_s: float,
        history_V: ArrayLike = (),
        substeps: int | None = None,
    ) -> Array:
        """Displacement in um, (n,), from rest; history_V is run through the hysteresis first.

        In float64 a delay below one sample is interpolated between samples on both sides of the
        moment: one sample more is run, and the displacement shifted back by it. The firmware
        cannot look ahead, so float32 does not.
        """
        ahead = int(self._dtype == np.float64 and 0 < path.delay_s < step_s)
        self._lib.batch_clear_blocks(self._batch)  # of the path before, which may not pass
        self._set_f0(path.f0)
        late = path.but(delay_s=path.delay_s + step_s) if ahead else path
        self._set_blocks(discretise(late, step_s, substeps))
        u_V = np.asarray(u_V)
        u = self._array(np.append(u_V, u_V[-1:]) if ahead else u_V)
        past = self._array(history_V)
        y = np.empty_like(u)
        none = self._ffi.NULL
        self._lib.batch_reset(self._batch)
        self._lib.batch_history(self._batch, self._pointer(past), past.size)
        self._lib.batch_run(self._batch, self._pointer(u), self._pointer(y), none, none, u.size)
        return y[ahead:].astype(np.float64, copy=False)
