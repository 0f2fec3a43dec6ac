"""Every block of the signal path: float against double over 10^6 samples, double against formulas.

The references share no code with the core: scipy's lsim (exact for input that is linear between
samples), numpy's polynomials, and solutions that can be written down.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from itertools import pairwise

import numpy as np
import pytest
from numpy.polynomial import polynomial
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.signal import lfilter, lsim

from madelung.core import Precision
from madelung.errors import InputError
from madelung.path import (
    CreepMode,
    Mode,
    Runner,
    SignalPath,
    augmented_model,
    discretise,
    mode_coefficients,
    predictor,
)

Array = NDArray[np.float64]
STEP_S = 1e-4
RANGE_V = 100.0
PATH = SignalPath(0.0, RANGE_V, (0.3, 0.08, 2e-4, -1e-6))
LINE = SignalPath(0.0, RANGE_V, (0.0, 1.0))
"""y = x: no hysteresis, so that a block stands alone."""
SHAPE = (
    (0.10, 0.0, 0.05, 0.0),
    (0.0, 0.05, 0.0, 0.0),
    (-0.03, 0.0, 0.0, 0.0),
    (0.0, 0.0, 0.0, 0.02),
)
RATE = {"power": 0.7, "v_ref_V_per_s": 5000.0}
TAUS_S = (0.01, 0.1, 1.0, 10.0, 100.0, 600.0)
BLOCKS = {
    "none": PATH,
    "degree 7": PATH.but(f0=(0.3, 0.08, 2e-4, -1e-6, 3e-9, -2e-11, 1e-13, -3e-16)),
    "hard saturation": PATH.but(high_V=90.0, low_V=5.0),
    "soft saturation": PATH.but(high_V=90.0, low_V=5.0, knee_V=2.0),
    "rounded saturation": PATH.but(high_V=90.0, low_V=5.0, knee_V=20.0, knee_power=2.5),
    "parabolic saturation": PATH.but(high_V=90.0, low_V=5.0, knee_V=20.0, parabolic=1.0),
    "saturation, not at rest": PATH.but(high_V=90.0, low_V=5.0, rest_free=1.0),
    "slew limit": PATH.but(slew_V_per_s=5000.0),
    "unequal slew limit": PATH.but(slew_V_per_s=5000.0, slew_fall_V_per_s=3000.0),
    "slew limit with a knee": PATH.but(slew_V_per_s=5000.0, slew_knee_V=2.0),
    "lag": PATH.but(corner_hz=50.0),
    "lag of a load": PATH.but(corner_hz=50.0, corner_lean=0.3),
    "a pole behind": PATH.but(behind_hz=50.0),
    "shape": PATH.but(shape=SHAPE),
    "damping": PATH.but(damping_um=-0.1, **RATE),
    "widening": PATH.but(widening=0.2, **RATE),
    "thresholds": PATH.but(threshold_V=2.0, **RATE),
    "damping with a knee": PATH.but(damping_um=-0.1, v_knee=0.05, **RATE),
    "widening with a knee": PATH.but(widening=0.2, v_knee=0.05, **RATE),
    "damping of a smooth command": PATH.but(damping_um=-0.1, smooth=0.7, **RATE),
    "widening with the speed": PATH.but(widening=0.2, of_speed=1.0, **RATE),
    "thresholds of the speed": PATH.but(threshold_V=2.0, of_speed=1.0, **RATE),
    "loops that swell with the speed": PATH.but(swelling=0.2, of_speed=1.0, **RATE),
    "stops that swell with the speed": PATH.but(swelling=0.2, lean=0.3, of_speed=1.0, **RATE),
    "loops that swell with the velocity": PATH.but(swelling=0.2, **RATE),
    "wider minor loops": PATH.but(loop_share=0.2, loop_slope=-0.1),
    "wider minor loops and a shape": PATH.but(shape=SHAPE, loop_share=-0.2, loop_slope=0.3),
    "viscous operators": PATH.but(relax_s=1e-3),
    "viscous operators by the square": PATH.but(relax_per_V_s=300.0),
    "creep": PATH.but(creep=tuple(CreepMode(tau, 0.01) for tau in TAUS_S)),
    "mode": PATH.but(modes=(Mode(300.0, 0.01),)),
    "two modes": PATH.but(modes=(Mode(300.0, 0.01, 0.9), Mode(3.0, 0.001, 0.1))),
    "Bouc and Wen": PATH.but(bouc_um=-0.4, bouc_V=20.0, bouc_power=1.7, bouc_gamma=0.2),
    "envelopes": PATH.but(rise_V=8.0, rise_skew=0.3, fall_V=3.0, fall_skew=-0.6, follow=0.4),
    "backlash": PATH.but(dead_band_um=0.05),
    "backlash with a spring": PATH.but(dead_band_um=0.05, spring_share=0.2),
    "backlash of a rough contact": PATH.but(dead_band_um=0.05, spread=0.4),
    "delay": PATH.but(delay_s=3.4e-4),
    "delay of less than a sample": PATH.but(delay_s=3.4e-5),
    "gain and offset": PATH.but(gain=1.03, offset_um=0.2),
}


OTHERS = (
    "hard saturation",
    "soft saturation",
    "parabolic saturation",
    "mode",
    "delay of less than a sample",
)
VISCOUS = ("viscous operators", "viscous operators by the square")
"""One law, and beside no widening."""
ALL = {
    "all": {"relax_s": 0.0, "relax_per_V_s": 0.0},
    "all with viscous operators": {"widening": 0.0, "relax_per_V_s": 0.0, "of_speed": 0.0},
    "all with viscous operators by the square": {"widening": 0.0, "relax_s": 0.0},
}
"""What is left out of all blocks."""


def all_blocks(name: str) -> SignalPath:
    """Every block at once that can be."""
    path = PATH
    for own in (vars(p) for name, p in BLOCKS.items() if name not in OTHERS):
        path = path.but(**{k: v for k, v in own.items() if v != getattr(PATH, k)})
    return path.but(**ALL[name])


def long_command(n: int) -> Array:
    """n samples at 10 kHz on the codes of a 12-bit converter, as floats."""
    t = np.arange(n) * STEP_S
    u = 50 - 30 * np.cos(2 * np.pi * 1.3 * t) - 4 * np.cos(2 * np.pi * 293 * t)
    u -= 15 * np.sin(2 * np.pi * 37 * t) * np.sin(2 * np.pi * 0.03 * t)
    codes = np.clip(np.rint(u / RANGE_V * 4095), 0, 4095).astype(np.float32)
    return (codes * np.float32(RANGE_V / 4095)).astype(np.float64)


@pytest.mark.parametrize("name", [*BLOCKS, *ALL])
def test_float_stays_within_a_tenth_of_an_adc_step_of_double(name: str) -> None:
    """Over 10^6 samples (all together: fewer), rounding of the coefficients included."""
    model = augmented_model(BLOCKS.get(name) or all_blocks(name), RANGE_V)
    u = long_command(200_000 if name in ALL else 1_000_000)
    y32, y64 = (
        predictor(model, precision, STEP_S, 0.0).run(u).astype(np.float64)
        for precision in ("float32", "float64")
    )
    stroke = predictor(augmented_model(PATH, RANGE_V), "float64", STEP_S, 0.0).run([RANGE_V])
    step_um = float(stroke[0] - PATH.f0[0]) / 4096
    assert np.ptp(y64) > 1000 * step_um
    assert np.abs(y32 - y64).max() < 0.1 * step_um


def run(path: SignalPath, u: Array, step_s: float = STEP_S) -> Array:
    """In double."""
    return Runner(path.u_min_V, path.range_V).run(path, u, step_s)


def command(n: int = 4000) -> tuple[Array, Array]:
    """Time and a smooth command from 0 V with some 5, 40 and 200 Hz in it."""
    t = np.arange(n) * STEP_S
    u = 45 - 40 * np.cos(2 * np.pi * 5 * t) - 4 * np.cos(2 * np.pi * 40 * t)
    return t, u - np.cos(2 * np.pi * 200 * t)


def ramps(v_V_per_s: float) -> tuple[Array, Array]:
    """Up to 80 V and down again at a constant rate; slope of each sample."""
    n = round(80.0 / v_V_per_s / STEP_S)
    up = np.linspace(0.0, 80.0, n + 1)
    return np.concatenate([up, up[-2::-1]]), np.repeat([1.0, -1.0], [n + 1, n])


def test_hysteresis_of_degree_7_is_its_polynomial() -> None:
    path = BLOCKS["degree 7"]
    u = np.concatenate(
        [np.linspace(0, 90, 500), np.linspace(90, 20, 400), np.linspace(20, 80, 300)]
    )
    f = [polynomial.polyval(v, path.f0) - path.f0[0] for v in (u, 90 - u, u - 20)]
    top = path.f0[0] + f[0][499]
    low = top - f[1][899]
    expected = np.concatenate([path.f0[0] + f[0][:500], top - f[1][500:900], low + f[2][900:]])
    np.testing.assert_allclose(run(path, u), expected, rtol=0, atol=1e-13)


THIRTEEN = (
    0.3,
    *(0.7 ** (k - 1) * (-1) ** (k // 2) * 0.08 / 90.0 ** (k - 1) for k in range(1, 14)),
)


def test_hysteresis_of_degree_13_is_its_polynomial_in_double_alone() -> None:
    """The tools fit with it; the firmware's degree ends at 7."""
    path = PATH.but(f0=THIRTEEN)
    u = np.concatenate([np.linspace(0, 90, 500), np.linspace(90, 20, 400)])
    top = polynomial.polyval(90.0, THIRTEEN)
    down = top - polynomial.polyval(90.0 - u[500:], THIRTEEN) + THIRTEEN[0]
    expected = np.concatenate([polynomial.polyval(u[:500], THIRTEEN), down])
    np.testing.assert_allclose(run(path, u), expected, rtol=0, atol=1e-12)
    with pytest.raises(InputError, match="f0: a parameter is out of its range"):
        Runner(0.0, RANGE_V, "float32").run(path, u, STEP_S)


def test_hard_saturation_clips() -> None:
    u = command()[1]
    expected = np.clip(u, 10.0, 70.0)
    found = run(LINE.but(high_V=70.0, low_V=10.0), u)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13)


def test_soft_saturation_is_a_softplus_at_each_end() -> None:
    """mdl_softplus promises 3e-9 in double."""
    u, knee = command()[1], 2.0
    expected = u - knee * np.logaddexp(0.0, (u - 70.0) / knee)
    expected += knee * np.logaddexp(0.0, (10.0 - u) / knee)
    found = run(LINE.but(high_V=70.0, low_V=10.0, knee_V=knee), u)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7)


@pytest.mark.parametrize("power", [1.0, 2.0, 2.5, 8.0, 32.0])
def test_rounded_saturation_follows_its_formula(power: float) -> None:
    u, knee = command()[1], 15.0

    def followed(excess: Array) -> Array:
        e = np.maximum(excess, 0.0) / knee
        return knee * e / (1 + e**power) ** (1 / power)

    low, high = 10.0 + knee, 70.0 - knee
    expected = np.clip(u, low, high) + followed(u - high) - followed(low - u)
    found = run(LINE.but(high_V=70.0, low_V=10.0, knee_V=knee, knee_power=power), u)
    np.testing.assert_allclose(found, expected, rtol=0, atol=5e-7)


def test_parabolic_saturation_follows_its_formula() -> None:
    u, knee = command()[1], 15.0

    def followed(excess: Array) -> Array:
        x = np.clip(excess, 0.0, 2 * knee)
        return x - x**2 / (4 * knee)

    low, high = 10.0 + knee, 70.0 - knee
    expected = np.clip(u, low, high) + followed(u - high) - followed(low - u)
    found = run(LINE.but(high_V=70.0, low_V=10.0, knee_V=knee, parabolic=1.0), u)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_a_smooth_commands_velocity_is_that_at_the_sample() -> None:
    """Linear between samples it would be that of half a step before."""
    t = np.arange(4000) * STEP_S
    w = 2 * np.pi / (60 * STEP_S)
    u, v = 50.0 - 40.0 * np.cos(w * t), 40.0 * w * np.sin(w * t)
    errors = []
    for smooth in (0.0, 1.0):
        damped = PATH.but(damping_um=-0.1, smooth=smooth, power=1.0, v_ref_V_per_s=5000.0)
        found = run(damped, u) - run(PATH.but(substeps_min=4), u)
        errors.append(np.abs(found[60:] + 0.1 * v[60:] / 5000.0).max() / np.abs(found).max())
    assert errors[0] > 0.04
    assert errors[1] < 0.02


def test_at_a_kink_a_smooth_command_is_linear() -> None:
    u = np.interp(np.arange(600), [0, 100, 300, 500, 599], [0.0, 90.0, 10.0, 70.0, 40.0])
    law = {"damping_um": -0.1, "widening": 0.1, **RATE}
    np.testing.assert_allclose(
        run(PATH.but(smooth=1.0, **law), u), run(PATH.but(**law), u), rtol=0, atol=1e-9
    )


def test_free_of_a_saturation_the_hysteresis_starts_on_the_major_curve() -> None:
    u = command()[1]
    clipped = PATH.but(high_V=90.0, low_V=5.0, rest_free=1.0)
    np.testing.assert_allclose(run(clipped, u), run(PATH, np.clip(u, 5.0, 90.0)), rtol=0, atol=1e-9)


def test_behind_a_saturation_the_hysteresis_has_not_been_beyond() -> None:
    """It rests where the drive stands at u_min, on the curve from where it stands at u_max."""
    u = np.concatenate([np.linspace(0, 60, 300), np.linspace(60, 0, 300), np.linspace(0, 100, 300)])
    u = np.append(u, np.linspace(100, 30, 300))

    def swing(x: Array | float) -> Array:
        return np.asarray(polynomial.polyval(x, PATH.f0) - PATH.f0[0])

    drive = np.clip(u, 5.0, 90.0)
    top = PATH.f0[0] + swing(90.0)
    rest = top - swing(85.0)
    up = rest + swing(drive - 5.0)
    down = up[299] - swing(60.0 - drive[300:600])
    expected = np.concatenate([up[:300], down, up[600:900], top - swing(90.0 - drive[900:])])
    found = run(BLOCKS["hard saturation"], u)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
    assert abs(rest - polynomial.polyval(5.0, PATH.f0)) > 0.01


def test_a_saturation_acts_on_the_history_too() -> None:
    u = command()[1] + 5.0
    path = BLOCKS["hard saturation"]
    found = Runner(0.0, RANGE_V).run(path, u, STEP_S, [95.0, 2.0])
    np.testing.assert_array_equal(found, run(path, u))  # the whole drive is its rest's history
    found = Runner(0.0, RANGE_V).run(path, u, STEP_S, [95.0, 30.0])
    np.testing.assert_array_equal(found, Runner(0.0, RANGE_V).run(path, u, STEP_S, [90.0, 30.0]))


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("name", ["hard saturation", "rounded saturation"])
def test_a_predictor_rests_where_a_runner_does(name: str, precision: Precision) -> None:
    u = command()[1]
    path = BLOCKS[name]
    made = predictor(augmented_model(path, RANGE_V), precision, STEP_S, float(u[0]))
    np.testing.assert_array_equal(made.run(u), Runner(0.0, RANGE_V, precision).run(path, u, STEP_S))


@pytest.mark.parametrize("per_step", [0.05, 0.5, 5.0])
def test_a_lag_turns_between_samples(per_step: float) -> None:
    """Against the same command in 200 steps a sample: what it missed at a turn would stay."""
    n, corner_hz = 200, 1 / (2 * np.pi * per_step * STEP_S)
    corners = np.random.default_rng(3).uniform(5.0, 95.0, 41)
    u = np.interp(np.arange(401) / 10.0, np.arange(41), corners)
    fine = np.interp(np.arange(400 * n + 1) / n, np.arange(401), u)
    for path in (PATH, PATH.but(bouc_um=0.3, bouc_V=9.0, bouc_power=1.5)):
        lagged = path.but(corner_hz=corner_hz)
        error = run(lagged, u) - run(lagged, fine, STEP_S / n)[::n]
        assert np.abs(error).max() < 0.01 * np.abs(run(lagged, u) - run(path, u)).max()


@pytest.mark.parametrize("corner_hz", [0.02, 0.1, 1.0])
def test_of_a_slow_lag_a_turn_between_samples_is_as_good_in_float(corner_hz: float) -> None:
    u = np.random.default_rng(5).uniform(0.0, 100.0, 3000)
    path = PATH.but(corner_hz=corner_hz)
    runs = [Runner(0.0, RANGE_V, p).run(path, u, 1e-4) for p in ("float32", "float64")]
    assert np.abs(np.subtract(*runs)).max() < 1e-4


def test_slew_limit_turns_a_step_into_a_ramp() -> None:
    u = np.repeat([0.0, 60.0, 20.0], [3, 300, 300])
    t = np.arange(u.size) * STEP_S
    up = np.minimum(60.0, 4000.0 * np.maximum(t - t[2], 0.0))
    down = np.maximum(20.0, 60.0 - 4000.0 * (t - t[302]))
    expected = np.where(np.arange(u.size) < 303, up, down)
    found = run(LINE.but(slew_V_per_s=4000.0), u)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


def test_slew_limit_may_fall_at_another_rate() -> None:
    u = np.repeat([0.0, 60.0, 20.0], [3, 300, 600])
    t = np.arange(u.size) * STEP_S
    up = np.minimum(60.0, 4000.0 * np.maximum(t - t[2], 0.0))
    down = np.maximum(20.0, 60.0 - 1000.0 * (t - t[302]))
    expected = np.where(np.arange(u.size) < 303, up, down)
    found = run(LINE.but(slew_V_per_s=4000.0, slew_fall_V_per_s=1000.0), u)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("knee_V", [0.003, 0.1, 1.0, 30.0])
def test_a_slew_limit_with_a_knee_follows_its_equation(knee_V: float) -> None:
    """dv/dt = S tanh((u - v) / knee) on a sine of about the limit and a step, by small steps."""
    t = np.arange(1200) * STEP_S
    u = np.where(t < 0.04, 30.0 - 30.0 * np.cos(2 * np.pi * 30.0 * t), 10.0)

    def rate(at: float, v: NDArray[np.float64]) -> NDArray[np.float64]:
        return 5000.0 * np.tanh((np.interp(at, t, u) - v) / knee_V)

    exact = solve_ivp(rate, (0.0, t[-1]), u[:1], "Radau", t, rtol=1e-8, atol=1e-8, max_step=STEP_S)
    found = run(LINE.but(slew_V_per_s=5000.0, slew_knee_V=knee_V), u)
    np.testing.assert_allclose(found[:400], exact.y[0][:400], rtol=0, atol=5000.0 * STEP_S / 100)
    # Within the sample of the jump the lag passes the knee in an unknown part of a substep.
    np.testing.assert_allclose(found, exact.y[0], rtol=0, atol=5000.0 * STEP_S / 8)


def test_a_knee_is_a_lag_of_slow_commands() -> None:
    u = 5e-3 * command()[1]
    lag = LINE.but(corner_hz=5000.0 / 2.0 / (2 * np.pi))
    found = run(LINE.but(slew_V_per_s=5000.0, slew_knee_V=2.0), u)
    np.testing.assert_allclose(found, run(lag, u), rtol=0, atol=2e-3 * np.ptp(u))


def test_slew_limit_lets_slow_commands_pass() -> None:
    u = command()[1]
    np.testing.assert_allclose(run(LINE.but(slew_V_per_s=1e4), u), u, rtol=0, atol=1e-10)


def test_lag_is_one_pole() -> None:
    t, u = command()
    tau = 1 / (2 * np.pi * 50.0)
    expected = lsim(([1.0], [tau, 1.0]), u, t)[1]
    np.testing.assert_allclose(run(LINE.but(corner_hz=50.0), u), expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("every", "share"), [(1, 1e-3), (10, 5e-3)])
@pytest.mark.parametrize("lean", [-0.3, 0.1, 0.4])
def test_lag_of_a_load_that_grows_with_the_voltage(lean: float, every: int, share: float) -> None:
    """dv/dt = (u - v) / tau(v), integrated by another solver; also in steps that are not short."""
    t, u = (x[::every] for x in command())
    tau = 1 / (2 * np.pi * 50.0)

    def slope(now: float, v: Array) -> Array:
        grown = 1 + lean * (2 * v / RANGE_V - 1)
        return (np.interp(now, t, u) - v) / (tau * grown)

    exact = solve_ivp(slope, (t[0], t[-1]), [u[0]], t_eval=t, rtol=1e-8, max_step=STEP_S)
    found = run(LINE.but(corner_hz=50.0, corner_lean=lean), u, every * STEP_S)
    without = run(LINE.but(corner_hz=50.0), u, every * STEP_S)
    assert np.abs(found - exact.y[0]).max() < share * np.abs(u - exact.y[0]).max()
    assert np.abs(without - exact.y[0]).max() > 5 * share * np.abs(u - exact.y[0]).max()


def test_a_load_that_hardly_grows_is_none() -> None:
    u = command()[1]
    plain = run(LINE.but(corner_hz=50.0), u)
    for lean in (1e-200, 1e-9, -1e-7):
        np.testing.assert_array_equal(run(LINE.but(corner_hz=50.0, corner_lean=lean), u), plain)


def test_a_pole_behind_filters_what_the_hysteresis_gives() -> None:
    t, u = command()
    tau = 1 / (2 * np.pi * 50.0)
    fine = np.interp(np.arange(2 * u.size - 1) / 2, np.arange(u.size), u)  # of two substeps
    y = run(PATH, fine)
    expected = y[0] + lsim(([1.0], [tau, 1.0]), y - y[0], np.arange(y.size) * t[1] / 2)[1]
    found = run(PATH.but(behind_hz=50.0), u)
    np.testing.assert_allclose(found, expected[::2], rtol=0, atol=1e-9)


def test_creep_is_a_ladder_of_poles() -> None:
    """At 10 Hz for 400 s."""
    t = np.arange(4000) * 0.1
    u = 60.0 * (t >= 1.0) - 20.0 * (t > 200.0)
    expected = u + sum(0.01 * lsim(([1.0], [tau, 1.0]), u, t)[1] for tau in TAUS_S)
    path = LINE.but(creep=BLOCKS["creep"].creep)
    np.testing.assert_allclose(run(path, u, 0.1), expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("rate_hz", [100.0, 10_000.0])
def test_modes_are_second_order_systems(rate_hz: float) -> None:
    """Also in a record that is far slower than the mode."""
    t = np.arange(4000) / rate_hz
    u = 40 - 40 * np.cos(2 * np.pi * 0.003 * rate_hz * t)
    expected = np.zeros_like(u)
    for fn, zeta, share in ((300.0, 0.01, 0.9), (700.0, 0.05, 0.1)):
        w = 2 * np.pi * fn
        expected += share * lsim(([w**2], [1.0, 2 * zeta * w, w**2]), u, t)[1]
    path = LINE.but(modes=(Mode(300.0, 0.01, 0.9), Mode(700.0, 0.05, 0.1)))
    np.testing.assert_allclose(run(path, u, 1 / rate_hz), expected, rtol=0, atol=1e-8)


def test_a_mode_near_half_the_rate_feels_how_the_hysteresis_bends_between_samples() -> None:
    """A step over one sample: as finer steps show it."""
    path = PATH.but(modes=(Mode(1050.0, 0.007),))
    u = np.repeat([2.0, 38.0, 10.0], 300)
    ramps = np.interp(np.arange((u.size - 1) * 16 + 1) / 16, np.arange(u.size), u)
    exact = run(path, ramps, 1 / 2500.0 / 16)[::16]
    found = run(path, u, 1 / 2500.0)
    ringing = np.std(exact[310:600] - exact[590])
    assert np.std(found - exact) < 0.003 * ringing
    assert path.substeps(1 / 2500.0) > path.substeps(1 / 40e3) == 2


@pytest.mark.parametrize("zeta", [0.0, 0.7, 1.0, 1.0 + 1e-9, 1.3, 10.0])
@pytest.mark.parametrize("rate_hz", [1000.0, 10_000.0])
def test_modes_of_any_damping(zeta: float, rate_hz: float) -> None:
    """Also where the two poles are real, and where they meet."""
    t = np.arange(2000) / rate_hz
    u = 40 - 40 * np.cos(2 * np.pi * 0.003 * rate_hz * t)
    w = 2 * np.pi * 300.0
    expected = lsim(([w**2], [1.0, 2 * zeta * w, w**2]), u, t)[1]
    found = run(LINE.but(modes=(Mode(300.0, zeta),)), u, 1 / rate_hz)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7)


@pytest.mark.parametrize("fn_hz", [0.1, 30.0, 3000.0])
@pytest.mark.parametrize("zeta", [0.0, 0.02, 0.999, 1.0, 1.001, 3.0, 10.0])
def test_a_mode_is_exact_between_samples(fn_hz: float, zeta: float) -> None:
    """Against the exponential of its matrix."""
    w = 2 * np.pi * fn_hz
    system = np.zeros((3, 3))
    system[:2, :2] = [[0.0, w], [-w, -2 * zeta * w]]
    system[0, 2] = -1.0 / STEP_S
    exact = expm(system * STEP_S)
    phi, gamma = mode_coefficients(fn_hz, zeta, STEP_S)
    np.testing.assert_allclose(phi, exact[:2, :2] - np.eye(2), rtol=0, atol=1e-11)
    np.testing.assert_allclose(gamma, exact[:2, 2], rtol=0, atol=1e-11)


@pytest.mark.parametrize("spring_share", [0.0, 0.2, 1.0])
def test_backlash_loses_its_dead_band_at_every_turn(spring_share: float) -> None:
    """But for what a spring carries across."""
    u = np.concatenate(
        [np.linspace(0, 80, 200), np.linspace(80, 30, 200), np.linspace(30, 70, 200)]
    )
    rise, fall = u[:200] - 2.0, np.minimum(78.0, u[200:400] + 2.0)
    expected = np.concatenate([rise, fall, np.maximum(32.0, u[400:] - 2.0)])
    expected += spring_share * (u - expected)
    found = run(LINE.but(dead_band_um=4.0, spring_share=spring_share), u)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("spread", [0.3, 1.0])
def test_a_rough_contact_is_the_mean_of_plays(spread: float) -> None:
    """Of widths that lie evenly about the dead band."""
    u = np.concatenate([np.linspace(5, 80, 200), np.linspace(80, 30, 200), np.linspace(30, 70, 99)])
    widths = 4.0 * (1.0 + spread * (np.arange(1, 16, 2) / 8.0 - 1.0))
    each = [run(LINE.but(dead_band_um=float(w)), u) for w in widths]
    found = run(LINE.but(dead_band_um=4.0, spread=spread), u)
    np.testing.assert_allclose(found, np.mean(each, axis=0), rtol=0, atol=1e-12)


@pytest.mark.parametrize("delay_s", [2.3e-5, 3.4e-4, 1e-3, 5e-3])
def test_delay_shifts_a_sine(delay_s: float) -> None:
    """Third-order interpolation of 20 Hz at 10 kHz is off by 40 V * (0.0126)^4 at most."""
    t = np.arange(4000) * STEP_S
    u = 40 - 40 * np.cos(2 * np.pi * 20 * t)
    expected = 40 - 40 * np.cos(2 * np.pi * 20 * np.maximum(t - delay_s, 0.0))
    found = run(LINE.but(delay_s=delay_s), u)
    late = t > delay_s + 5 * STEP_S
    late[-1] = False  # a delay of less than a sample would look beyond the end
    np.testing.assert_allclose(found[late], expected[late], rtol=0, atol=2e-6)


@pytest.mark.parametrize("delay_s", [1.3e-4, 3.7e-4, 1.6e-3])
def test_delay_of_a_linear_command_keeps_its_kinks(delay_s: float) -> None:
    step_s, fine = 1e-3, 50
    u = 50 + 30 * np.sin(np.arange(400) * 1.9) * np.cos(np.arange(400) * 0.013)
    t = np.arange(400) * step_s
    fine_s = np.arange(-fine, 399 * fine + 1) * step_s / fine
    runner = Runner(0.0, RANGE_V)
    exact = runner.run(PATH, np.interp(fine_s, t, u), step_s / fine)
    linear = runner.run(PATH.but(delay_s=delay_s, substeps_min=4), u, step_s)
    expected = np.interp(t - delay_s, fine_s, exact)
    assert np.abs(linear - expected).max() < 2e-3 * np.ptp(expected)


def test_gain_and_offset_turn_about_the_minimum() -> None:
    u = command()[1]
    y = run(PATH, u)
    expected = 1.03 * (y - PATH.f0[0]) + PATH.f0[0] + 0.2
    np.testing.assert_allclose(run(BLOCKS["gain and offset"], u), expected, rtol=0, atol=1e-12)


def test_shape_adds_a_polynomial_in_swing_and_middle() -> None:
    def swing(a: Array | float, b: Array | float) -> Array:
        s, m = (np.subtract(b, a)) / RANGE_V, np.add(a, b) / RANGE_V - 1
        padded = np.pad(np.array(SHAPE), ((1, 0), (1, 0)))  # no power 0
        whole = polynomial.polyval(np.subtract(b, a), PATH.f0) - PATH.f0[0]
        return np.asarray(whole + polynomial.polyval2d(m, s, padded))

    u = np.concatenate(
        [np.linspace(0, 90, 300), np.linspace(90, 25, 300), np.linspace(25, 85, 300)]
    )
    up = PATH.f0[0] + swing(0.0, u[:300])
    down = up[-1] - swing(u[300:600], 90.0)
    expected = np.concatenate([up, down, down[-1] + swing(25.0, u[600:])])
    np.testing.assert_allclose(run(BLOCKS["shape"], u), expected, rtol=0, atol=1e-12)


def test_minor_loops_are_wider_by_their_size() -> None:
    """The deviation from the chord between two turning points grows; loops close."""

    def f0(x: Array | float) -> Array:
        return np.asarray(polynomial.polyval(x, PATH.f0) - PATH.f0[0])

    def branch(q: Array, swing: float, from_um: float, to_um: float) -> Array:
        """From a turning point to the one at which the loop closes, q volts away from it."""
        more = 1 + (0.3 - 0.2 * swing / RANGE_V) * (1 - swing / RANGE_V)
        chord = q / swing
        bent = f0(q) - chord * f0(swing)
        return from_um + chord * (to_um - from_um) + np.sign(to_um - from_um) * more * bent

    u = np.concatenate([np.linspace(0, 90, 91), np.linspace(89, 25, 65), np.linspace(26, 90, 65)])
    up = PATH.f0[0] + f0(u[:91])
    down = branch(90.0 - u[91:156], 90.0, up[-1], up[0])
    again = branch(u[156:] - 25.0, 65.0, down[-1], up[-1])
    found = run(PATH.but(loop_share=0.3, loop_slope=-0.2), u)
    np.testing.assert_allclose(found, np.concatenate([up, down, again]), rtol=0, atol=1e-12)


def test_loops_swell_about_the_chord_of_the_major_loop() -> None:
    u = command()[1]
    path = PATH.but(power=1.0, v_ref_V_per_s=5000.0, velocity_tau_s=1e-3, of_speed=1.0)
    y = run(path.but(damping_um=-1e-12), u)
    decay = np.exp(-STEP_S / 1e-3)
    speed = lfilter([1 - decay], [1, -decay], np.abs(np.diff(u, prepend=u[0]))) / STEP_S
    chord = PATH.f0[0] + u / RANGE_V * (polynomial.polyval(RANGE_V, PATH.f0) - PATH.f0[0])
    for lean in (0.0, 0.3):
        found = run(path.but(swelling=0.2, lean=lean), u)
        line = chord + lean * (chord - 0.5 * (PATH.f0[0] + polynomial.polyval(RANGE_V, PATH.f0)))
        np.testing.assert_allclose(found, y + 0.2 * speed / 5000.0 * (y - line), rtol=0, atol=1e-9)


@pytest.mark.parametrize("v_V_per_s", [100.0, 2000.0])
def test_damping_adds_a_power_of_the_rate(v_V_per_s: float) -> None:
    """Once the velocity's filter has settled."""
    u, sign = ramps(v_V_per_s)
    added = -0.1 * (v_V_per_s / 5000.0) ** 0.7 * sign
    found = run(PATH.but(damping_um=-0.1, **RATE), u) - run(PATH, u)
    settled = settled_rows(sign)
    np.testing.assert_allclose(found[settled], added[settled], rtol=2e-8, atol=1e-12)


@pytest.mark.parametrize("v_V_per_s", [100.0, 2000.0])
@pytest.mark.parametrize(("power", "v_knee"), [(0.7, 0.05), (0.1, 0.01), (1.5, 2.0)])
def test_a_law_with_a_knee_follows_its_formula(
    v_V_per_s: float, power: float, v_knee: float
) -> None:
    u, sign = ramps(v_V_per_s)
    law = (v_V_per_s / 5000.0 + v_knee) ** power - v_knee**power
    path = PATH.but(damping_um=-0.1, power=power, v_ref_V_per_s=5000.0, v_knee=v_knee)
    found = run(path, u) - run(PATH, u)
    settled = settled_rows(sign)
    np.testing.assert_allclose(found[settled], -0.1 * law * sign[settled], rtol=0, atol=1e-8)


def substepped(u: Array) -> tuple[Array, Array]:
    """A command between its samples, and the rises of its parts: the rate block takes four."""
    parts = np.linspace(u[:-1], u[1:], 4, endpoint=False, axis=1).ravel()
    fine = np.append(parts, u[-1])
    return fine, np.diff(fine, prepend=fine[0])


def sizes(rises: Array, step_s: float, tau_s: float, of_speed: float) -> Array:
    """Of the velocity behind a pole, or the speed behind it, V/s."""
    v = (np.abs(rises) if of_speed else rises) / step_s
    found = np.zeros_like(v)
    for i in range(1, v.size):
        settled = -np.expm1(-step_s / tau_s)
        found[i] = found[i - 1] + settled * (v[i] - found[i - 1])
    return np.abs(found)


def operators() -> tuple[Array, Array]:
    """Half widths and weights of 32 with f0, at knots of a 33rd of the range."""
    knots = np.linspace(0.0, RANGE_V, 34)
    return knots[1:-1] / 2, np.diff(polynomial.polyval(knots, PATH.f0), 2) / knots[1]


@pytest.mark.parametrize("of_speed", [0.0, 1.0])
@pytest.mark.parametrize(("v_knee", "tau_s"), [(0.0, 0.0), (0.05, 0.0), (0.05, 1e-3)])
def test_widening_is_a_loop_over_plays_with_growing_thresholds(
    v_knee: float, tau_s: float, of_speed: float
) -> None:
    u = command()[1]
    half, weights = operators()
    fine, rises = substepped(u)
    inner_s = STEP_S / 4
    v = sizes(rises, inner_s, tau_s or inner_s / 2, of_speed) / 5000.0
    grow = 0.2 * ((v + v_knee) ** 0.7 - v_knee**0.7)
    still = grown = half
    held = np.empty(fine.size)
    for i, x in enumerate(fine):
        still = np.clip(still, x - half, x + half)
        wide = half * (1 + grow[i])
        grown = np.clip(grown, x - wide, x + wide)
        held[i] = weights @ (still - grown)
    path = PATH.but(widening=0.2, v_knee=v_knee, velocity_tau_s=tau_s, of_speed=of_speed, **RATE)
    assert np.ptp(held) > 0.02
    np.testing.assert_allclose(run(path, u), run(PATH, u) - held[::4], rtol=0, atol=1e-8)


@pytest.mark.parametrize("of_speed", [0.0, 1.0])
@pytest.mark.parametrize("v_knee", [0.0, 0.05])
def test_thresholds_are_a_play_of_the_rate_in_front(v_knee: float, of_speed: float) -> None:
    """On a parabola, without the first operator; the speed stays where the command turns."""
    u = command()[1]
    fine, rises = substepped(u)
    inner_s = STEP_S / 4
    v = sizes(rises, inner_s, 1e-3, of_speed) / 5000.0
    later = 2.0 * ((v + v_knee) ** 0.7 - v_knee**0.7)
    x = np.zeros(fine.size)
    for i in range(1, fine.size):
        x[i] = np.clip(x[i - 1], fine[i] - later[i], fine[i] + later[i])
    bare = PATH.but(f0=(0.3, 0.0, 8e-4))
    path = bare.but(threshold_V=2.0, v_knee=v_knee, velocity_tau_s=1e-3, of_speed=of_speed, **RATE)
    turns = run(bare, x, inner_s)
    np.testing.assert_allclose(run(path, u), turns[::4], rtol=0, atol=1e-8)


@pytest.mark.parametrize(
    ("law", "behind_V"),
    [
        ({"relax_s": 1e-6}, 500.0 * 1e-6),
        ({"relax_s": 2.5e-5}, 500.0 * 2.5e-5),
        ({"relax_s": 2e-4}, 500.0 * 2e-4),
        ({"relax_per_V_s": 1e9}, (500.0 / 1e9) ** 0.5),
        ({"relax_per_V_s": 1e6}, (500.0 / 1e6) ** 0.5),
        ({"relax_per_V_s": 2e4}, (500.0 / 2e4) ** 0.5),
    ],
)
def test_viscous_operators_lag_behind_a_ramp_as_their_law_says(
    law: dict[str, float], behind_V: float
) -> None:
    """By tau v or sqrt(v / k), whatever the sample time, once the last of them has settled."""
    up = np.arange(2001) * 0.05
    found = run(PATH, np.append(up, up[::-1])) - run(PATH.but(**law), np.append(up, up[::-1]))
    expected = operators()[1].sum() * behind_V
    np.testing.assert_allclose(found[[2000, -1]], [expected, -expected], 1e-7)


def viscous(u: Array, rate: Callable[[Array], Array], parts: int = 64) -> Array:
    """What operators hold back whose distance o shrinks at this rate: the midpoint rule."""
    half, weights = operators()
    still = at = half
    step_s = STEP_S / parts
    held = np.zeros(u.size)
    for i in range(1, u.size):
        x = np.linspace(u[i - 1], u[i], 2 * parts + 1)
        for k in range(parts):
            o = at - np.clip(at, x[2 * k] - half, x[2 * k] + half)
            mid = at - rate(o) * step_s / 2
            o = mid - np.clip(mid, x[2 * k + 1] - half, x[2 * k + 1] + half)
            at = at - rate(o) * step_s
        still = np.clip(still, u[i] - half, u[i] + half)
        held[i] = weights @ (still - at)
    return held


@pytest.mark.parametrize(
    ("law", "rate"),
    [
        ({"relax_s": 1e-3}, lambda o: o / 1e-3),
        ({"relax_s": 1e-4}, lambda o: o / 1e-4),
        ({"relax_per_V_s": 300.0}, lambda o: 300.0 * o * np.abs(o)),
        ({"relax_per_V_s": 5000.0}, lambda o: 5000.0 * o * np.abs(o)),
    ],
)
def test_viscous_operators_solve_their_equation(
    law: dict[str, float], rate: Callable[[Array], Array]
) -> None:
    """Where an operator starts or turns within a step is all that is lost: less in finer steps."""
    u = command(700)[1]
    u = np.concatenate([u, np.full(100, u[-1]), np.linspace(u[-1], 70.0, 100)])
    held = viscous(u, rate)
    assert np.ptp(held) > 0.004
    for substeps, error in ((4, 1e-3), (32, 5e-5)):
        found = Runner(0.0, RANGE_V).run(PATH.but(**law), u, STEP_S, substeps=substeps)
        assert np.abs(run(PATH, u) - held - found).max() < error * np.ptp(held)


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("per_V_s", [300.0, 1e6, 1e10])
def test_viscous_operators_settle_behind_a_lag(per_V_s: float, precision: Precision) -> None:
    """At 0 V its rises have no least size."""
    u = np.repeat([60.0, 0.0, 30.0], [5, 3000, 300])
    lag = PATH.but(corner_hz=50.0)
    runner = Runner(0.0, RANGE_V, precision)
    plain, found = (runner.run(p, u, STEP_S) for p in (lag, lag.but(relax_per_V_s=per_V_s)))
    np.testing.assert_allclose(found, plain, rtol=0, atol=0.2)  # finite


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_viscous_operators_of_any_time_constant_run(precision: Precision) -> None:
    """The fastest as if there were none, the slowest as if they were stuck."""
    u = command()[1]
    ends = [1e-300, 1e-9, 1e6]
    made = [augmented_model(PATH.but(relax_s=tau), RANGE_V) for tau in ends]
    fast, faster, stuck = (predictor(m, precision, STEP_S, 0.0).run(u) for m in made)
    plain = predictor(augmented_model(PATH, RANGE_V), precision, STEP_S, 0.0).run(u)
    for found in (fast, faster):
        np.testing.assert_allclose(found, plain, rtol=0, atol=1e-5)
    assert np.ptp(stuck) < 0.99 * np.ptp(plain)
    for tau in ends:
        rate = discretise(PATH.but(relax_s=tau), STEP_S).rate
        assert rate is not None and np.float32(rate[10]) < 1.0


@pytest.mark.parametrize("share", [1e-6, 1e-4, 9.9e-4, 1.01e-3, 0.1, 2.0, 80.0])
def test_linear_operators_follow_earlier_by_what_the_sample_time_asks(share: float) -> None:
    """By tau / h - e^(-h / tau) / (1 - e^(-h / tau)) samples, here in more digits."""
    rate = discretise(PATH.but(relax_s=STEP_S / 4 / share), STEP_S).rate
    assert rate is not None
    h = np.longdouble(share)
    decay, early, pull = rate[12:]
    series = 0.5 - h / 12 + h**3 / 720
    exact = series if share < 1e-5 else 1 / h + 1 / np.expm1(-h) + 1
    assert decay == pytest.approx(float(np.exp(-h)), rel=1e-12) and pull == 0.0
    assert early == pytest.approx(float(exact), abs=1e-9)


@pytest.mark.parametrize("v_V_per_s", [100.0, 2000.0])
def test_thresholds_switch_later_by_a_power_of_the_rate(v_V_per_s: float) -> None:
    """All but the one at 0, whose weight is f0'(0): on the rising branch."""
    u, sign = ramps(v_V_per_s)
    later = 2.0 * (v_V_per_s / 5000.0) ** 0.7
    found = run(PATH.but(threshold_V=2.0, **RATE), u)
    expected = polynomial.polyval(u - later, PATH.f0) + PATH.f0[1] * later
    rises = settled_rows(sign) & (sign > 0) & (u > later)
    np.testing.assert_allclose(found[rises], expected[rises], rtol=0, atol=1e-8)


def settled_rows(sign: Array) -> NDArray[np.bool_]:
    """Ten samples after a start or a turn."""
    rows = np.ones(sign.size, np.bool_)
    turn = int(np.argmax(sign < 0))
    rows[:10] = rows[turn : turn + 10] = False
    return rows


@pytest.mark.parametrize(
    "bad",
    [
        {"high_V": 1.0, "low_V": 2.0},
        {"widening": -0.1},
        {"widening": 0.1, "relax_s": 1e-3},
        {"relax_per_V_s": -1.0},
    ],
)
def test_a_path_that_no_chain_takes_spoils_no_other(bad: dict[str, float]) -> None:
    u = command()[1]
    runner = Runner(0.0, RANGE_V)
    with suppress(InputError):
        runner.run(PATH.but(**bad), u, STEP_S)
    np.testing.assert_array_equal(runner.run(PATH, u, STEP_S), run(PATH, u))


def test_the_part_by_bouc_and_wen_solves_its_equation() -> None:
    """The midpoint rule is off by 6e-4 of z at most; at rest behind the whole range."""

    def swing(z: float, a: float, b: float) -> float:
        def slope(_: float, z: Array) -> Array:
            return 1 - np.abs(z) ** 1.7 * (0.2 + np.sign(z * (b - a)))

        done = solve_ivp(slope, (a / 20, b / 20), [z], rtol=1e-9, atol=1e-11, max_step=0.02)
        return float(done.y[0, -1])

    levels = [0.0, 100.0, 0.0, 70.0, 20.0, 60.0, 35.0, 95.0]
    z = [0.0]
    for a, b in pairwise(levels):
        z.append(swing(z[-1], a, b))
    u = np.concatenate([np.linspace(a, b, 40) for a, b in pairwise(levels[2:])])
    found = run(BLOCKS["Bouc and Wen"], u) - run(PATH, u)
    expected = -0.4 * (np.array(z[3:]) - z[2])
    np.testing.assert_allclose(found[39::40], expected, rtol=0, atol=0.4 * 1e-3)


def plays_between_envelopes(path: SignalPath, u: Array, history: tuple[float, ...] = ()) -> Array:
    """A bank of generalised plays with the weights of f0, from rest at 0 V.

    A play of threshold r follows a rise along x - rise(x) - r and a fall along x + fall(x). Its
    weight is f0''(r) dr; that of the one without a threshold is f0'(0).
    """
    dr = RANGE_V / 1000
    r = (np.arange(1000) + 0.5) * dr
    weights = dr * polynomial.polyval(r, polynomial.polyder(path.f0, 2))
    r, weights = np.append(0.0, r), np.append(path.f0[1], weights)

    def lag(x: float, volts: float, skew: float) -> float:
        z = x / RANGE_V
        return volts * 4 * z * (1 - z) * (1 + skew * (2 * z - 1))

    at, found = np.zeros(r.size), np.zeros(len(history) + u.size)
    for i, x in enumerate([*history, *u]):
        low = x - lag(x, path.rise_V, path.rise_skew) - r
        at = np.maximum(low, np.minimum(x + lag(x, path.fall_V, path.fall_skew), at))
        first = path.f0[1] * path.follow * (x - at[0])  # a share of it that does not lag
        found[i] = path.f0[0] + weights @ at + first
    return found[len(history) :]


@pytest.mark.parametrize("follow", [0.0, 0.4, 1.0])
@pytest.mark.parametrize(
    "sizes",
    [
        {"rise_V": 8.0, "rise_skew": 0.3, "fall_V": 3.0, "fall_skew": -0.6},
        {"rise_V": 6.0, "rise_skew": -1.0},
        {"fall_V": 9.0, "fall_skew": 0.9},
    ],
)
def test_envelopes_in_front_make_a_bank_of_generalised_plays(
    sizes: dict[str, float], follow: float
) -> None:
    """Plays behind one that has the envelopes are plays with these envelopes, r further apart."""
    u = np.append(command()[1], np.linspace(3.0, 100.0, 300))
    path = PATH.but(**sizes, follow=follow)
    expected = plays_between_envelopes(path, u)
    assert np.abs(expected - run(PATH, u)).max() > 0.05
    np.testing.assert_allclose(run(path, u), expected, rtol=0, atol=2e-6)


def test_envelopes_act_on_the_history_too() -> None:
    u = command()[1] + 5.0
    path, history = BLOCKS["envelopes"], (95.0, 2.0, 60.0)
    found = Runner(0.0, RANGE_V).run(path, u, STEP_S, history)
    expected = plays_between_envelopes(path, u, history)
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-6)
    assert np.abs(found - run(path, u)).max() > 0.02


def test_equal_envelopes_keep_the_central_symmetry_and_others_do_not() -> None:
    """Of the major loop: half a turn about its middle."""
    up = np.linspace(0.0, 100.0, 401)
    even = PATH.but(rise_V=5.0, rise_skew=0.4, fall_V=5.0, fall_skew=-0.4)
    for path, is_symmetric in ((even, True), (even.but(fall_skew=0.4), False)):
        y = run(path, np.append(up, up[::-1]))
        rise, fall = y[:401], y[401:]
        off = np.abs(rise + fall - (y[0] + y[400])).max()
        assert off < 1e-12 if is_symmetric else off > 0.05


def test_history_leaves_its_turning_points() -> None:
    """As if the record had begun with them."""
    u = command()[1] + 5.0
    whole = run(PATH, np.concatenate([[0.0, 95.0], u]))[2:]
    found = Runner(0.0, RANGE_V).run(PATH, u, STEP_S, [95.0])
    np.testing.assert_allclose(found, whole, rtol=0, atol=1e-13)
    assert np.abs(found - run(PATH, u)).max() > 0.02
