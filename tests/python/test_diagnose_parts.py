"""The parts of the diagnosis: noise floor, simulation and fit of each form, thresholds."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from madelung.diagnosis.case import Trace
from madelung.diagnosis.diagnose import best_with
from madelung.diagnosis.effects import forms
from madelung.diagnosis.effects.form import Form, Scales
from madelung.diagnosis.effects.outside import outside_forms
from madelung.diagnosis.effects.sensor import line_form
from madelung.diagnosis.fit import Fit, Problem
from madelung.diagnosis.holdout import (
    TRAIN_BLOCKS,
    Prediction,
    cross_validated,
    region_shrink,
    shrink,
)
from madelung.diagnosis.lines import driven, peaks, steady
from madelung.diagnosis.noise import Noise, estimate_noise, proven_fall
from madelung.diagnosis.parameters import reported
from madelung.diagnosis.regions import Region
from madelung.diagnosis.verdict import Verdict, judge
from madelung.diagnosis.which import Engine, Outsider, Search, _plausible
from madelung.path import CreepMode, Mode, Runner, SignalPath
from madelung.records import make_record

Floats = NDArray[np.float64]

NOISE_UM = 0.02
F0 = (0.3, 0.22, 0.0035, -2.0e-05)
PATH = SignalPath(0.0, 40.0, F0)
RNG = np.random.default_rng


def trace(name: str, u_V: Floats, y_um: Floats, step_s: float, role: str = "train") -> Trace:
    rows = np.arange(u_V.size)
    record = make_record(name, {"t_s": rows * step_s, "u_V": u_V, "y_um": y_um})
    return Trace(name, role, step_s, u_V, y_um, np.ones(u_V.size, bool), rows, record)


def sensor_noise(n: int, ar: float, step_s: float, seed: int) -> Floats:
    """Of rms 1; ar is the correlation of samples 5 ms apart."""
    a = ar ** (step_s / 0.005)
    white = RNG(seed).standard_normal(n + 2000)
    return np.asarray(lfilter([np.sqrt(1.0 - a * a)], [1.0, -a], white)[2000:])


def loop(seconds: float = 60.0, hz: float = 0.1, rate_hz: float = 200.0) -> Floats:
    phase = np.arange(round(seconds * rate_hz)) * hz / rate_hz % 1.0
    return 40.0 * (1.0 - np.abs(2.0 * phase - 1.0))


# -- noise --------------------------------------------------------------------------------------


def slow_loop(ar: float, seed: int = 0, extra: Callable[[Floats], Floats] = np.zeros_like) -> Trace:
    u = loop()
    y = Runner(0.0, 40.0).run(PATH, u, 0.005) + extra(u)
    return trace("identify", u, y + NOISE_UM * sensor_noise(u.size, ar, 0.005, seed), 0.005)


@pytest.mark.parametrize("ar", [0.0, 0.5, 0.9, 0.98])
def test_noise_is_recovered_and_whitened_at_every_rate(ar: float) -> None:
    noise = estimate_noise(slow_loop(ar))
    assert noise.known
    assert noise.rms_um == pytest.approx(NOISE_UM, rel=0.25 if ar > 0.95 else 0.05)
    if ar:
        assert noise.coloured_um > 5.0 * noise.white_um or ar < 0.9
        if ar >= 0.9:
            assert noise.tau_s == pytest.approx(-0.005 / np.log(ar), rel=0.4)
    for rate_hz in (100.0, 200.0, 1000.0):
        fresh = NOISE_UM * sensor_noise(20_000, ar, 1.0 / rate_hz, 7)
        white = noise.whiten(fresh, 1.0 / rate_hz)
        # A fast colour is hardly seen at 200 Hz: what is left at 1 kHz is an extrapolation.
        off = 0.06 if rate_hz <= 200.0 else 0.12
        assert white.std() == pytest.approx(1.0, abs=off), rate_hz
        assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < off, rate_hz


def test_two_colours_are_whitened_from_the_first_row_on() -> None:
    noise = Noise(0.004, 0.01, 0.03, 1000, True, slow_um=0.01, slow_tau_s=1.0)
    t = np.arange(400) * 0.005
    lag = np.abs(np.subtract.outer(t, t))
    covariance = 0.004**2 * np.eye(t.size)
    covariance += 0.01**2 * (np.exp(-lag / 0.03) + np.exp(-lag))
    records = RNG(3).standard_normal((2000, t.size)) @ np.linalg.cholesky(covariance).T
    white = noise.whiten(records, 0.005)
    assert white.std(axis=0)[:20] == pytest.approx(np.ones(20), abs=0.1)
    assert np.cov(white.T) == pytest.approx(np.eye(t.size), abs=0.12)


def test_a_second_colour_is_found_where_there_is_one() -> None:
    u = loop()
    slow = lfilter([np.sqrt(1.0 - 0.995**2)], [1.0, -0.995], RNG(2).standard_normal(u.size + 2000))
    y = Runner(0.0, 40.0).run(PATH, u, 0.005) + 0.03 * slow[2000:]
    noise = estimate_noise(
        trace("identify", u, y + NOISE_UM * sensor_noise(u.size, 0.5, 0.005, 1), 0.005)
    )
    assert len(noise.parts) == 2
    assert noise.rms_um == pytest.approx(np.hypot(0.03, NOISE_UM), rel=0.25)
    assert estimate_noise(slow_loop(0.9)).slow_um == 0.0


@pytest.mark.parametrize("seconds", [20.0, 37.0])
def test_the_way_through_a_dead_band_at_the_start_is_not_noise(seconds: float) -> None:
    # Engaged in the rising sense: the first ascent is another than all later ones.
    dead = PATH.but(dead_band_um=0.8)
    for hz in (0.1, 0.1003):  # the second: no whole number of samples in a cycle
        u = loop(seconds, hz)
        y = Runner(0.0, 40.0).run(dead, u, 0.005)
        y += NOISE_UM * sensor_noise(u.size, 0.5, 0.005, 3)
        noise = estimate_noise(trace("identify", u, y, 0.005, "identify"))
        assert noise.known
        assert noise.rms_um == pytest.approx(NOISE_UM, rel=0.1)


def test_a_loud_first_ascent_of_slow_noise_is_noise() -> None:
    # Five or so independent rows in an ascent: now and then it is the loudest by far.
    powers = [estimate_noise(slow_loop(0.995, seed).head(4500)).rms_um ** 2 for seed in range(20)]
    assert np.mean(powers) == pytest.approx(NOISE_UM**2, rel=0.4)


def test_gaps_on_one_branch_do_not_cost_the_first_ascent() -> None:
    whole = slow_loop(0.0)
    falls = np.gradient(whole.u_V) < 0
    gappy = replace(whole, use=~falls | (RNG(1).random(falls.size) < 0.2))
    assert estimate_noise(gappy).samples == estimate_noise(whole).samples
    assert estimate_noise(gappy).rms_um == pytest.approx(NOISE_UM, rel=0.1)


def test_the_noise_may_be_larger_where_little_was_seen_of_it() -> None:
    few, many = (estimate_noise(slow_loop(0.98).head(n)) for n in (4500, 12_000))
    freq = np.array([0.02, 0.3, 3.0, 80.0])
    for noise in (few, many):
        upper = noise.upper(freq, 0.005)
        assert (upper >= 1.0).all() and upper[0] > upper[2]
    assert (few.upper(freq, 0.005) > many.upper(freq, 0.005)).all()


def test_a_fall_counts_less_where_the_noise_is_in_doubt() -> None:
    sure = Noise(1.0, 0.0, 1.0, 1000, True)
    doubted = replace(sure, lowest_hz=1.0)
    t = np.arange(20_000) * 0.005
    rest = list(RNG(1).standard_normal((3, t.size)))
    for hz, share in ((0.05, 0.2), (20.0, 1.0)):
        before = [r + 0.2 * np.sin(2.0 * np.pi * hz * t) for r in rest]
        steps = [0.005] * 3
        whole, cautious = (proven_fall(n, before, rest, steps) for n in (sure, doubted))
        assert whole == pytest.approx(3 * 0.02 * t.size, rel=0.35)
        assert cautious < 1.01 * share * whole


def test_noise_alone_gives_no_more_than_what_falls() -> None:
    """A fit of few low terms takes all there is at the lowest frequencies: no proof."""
    noise = Noise(1.0, 0.0, 1.0, 1000, True, lowest_hz=1.0)
    terms = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, 5000), 5).T
    base = np.linalg.qr(terms.T)[0]
    for seed in range(20):
        before = list(RNG(seed).standard_normal((3, 5000)))
        after = [r - base @ (base.T @ r) for r in before]
        fall = sum(float(b @ b - a @ a) for b, a in zip(before, after, strict=True))
        assert proven_fall(noise, before, after, [0.005] * 3) < 1.01 * fall


def test_noise_is_no_more_than_every_record_leaves() -> None:
    doubled = Noise(1.0, 0.0, 1.0, 1000, True)
    t = np.arange(20_000) * 0.005
    rest = list(0.5 * RNG(1).standard_normal((3, t.size)))
    before = [r + 0.1 * np.sin(2.0 * np.pi * 20.0 * t) for r in rest]
    steps = [0.005] * 3
    assert proven_fall(doubled, before, rest, steps) == pytest.approx(3 * 0.02 * t.size, rel=0.15)
    louder = [rest[0], rest[1], 4.0 * rest[2]]  # one record in which it may be as loud as said
    told = proven_fall(doubled, before, louder, steps) - proven_fall(doubled, rest, louder, steps)
    assert told < 0.4 * 3 * 0.02 * t.size


def test_a_fall_counts_less_where_every_record_keeps_more_than_the_noise() -> None:
    noise = Noise(1.0, 0.0, 1.0, 1000, True)
    t = np.arange(20_000) * 0.005
    slow = [4.0 * sensor_noise(t.size, 0.999, 0.005, s) for s in range(4)]
    after = [np.zeros_like(t), *slow[1:]]
    fall = proven_fall(noise, slow, after, [0.005] * 4)
    assert fall < 0.1 * float(slow[0] @ slow[0])


def test_what_repeats_or_trends_is_not_noise() -> None:
    plain = estimate_noise(slow_loop(0.0)).rms_um
    bent = estimate_noise(slow_loop(0.0, extra=lambda u: 0.5 * np.sin(u) + 0.1 * u)).rms_um
    warm = estimate_noise(slow_loop(0.0, extra=lambda u: np.linspace(0.0, 1.0, u.size))).rms_um
    assert bent == pytest.approx(plain, rel=0.02)
    assert warm == pytest.approx(plain, rel=0.05)


def test_one_cycle_alone_gives_a_guess_that_says_so() -> None:
    for ar in (0.0, 0.9):
        noise = estimate_noise(slow_loop(ar).head(2000))
        assert not noise.known
        assert noise.rms_um == pytest.approx(NOISE_UM, rel=0.15)
    assert noise.coloured_um > 5.0 * noise.white_um


def test_spectrum_is_that_of_the_samples() -> None:
    noise = Noise(0.01, 0.02, 0.1, 1000, known=True)
    freq = np.fft.fftfreq(2**16, 0.01)
    assert np.mean(noise.spectrum(freq, 0.01)) == pytest.approx(noise.rms_um**2, rel=1e-3)


# -- forms and fit ------------------------------------------------------------------------------


def swings(rate_hz: float = 1000.0, seconds: float = 3.0) -> Floats:
    t = np.arange(round(rate_hz * seconds)) / rate_hz
    slow = np.cos(2.0 * np.pi * 0.5 * t) + 0.5 * np.cos(2.0 * np.pi * 7.3 * t)
    u = slow + 0.3 * np.cos(2.0 * np.pi * 31.0 * t)
    return 40.0 * (u - u.min()) / np.ptp(u)


SLOW = loop(10.0, 0.2)
FAST = swings()
BIASED = 12.0 + 18.0 * np.abs(np.sin(np.arange(2000) * 2.0 * np.pi * 1.3 / 500.0))
SCALES = Scales(0.0, 40.0, 13.0, float(np.abs(np.diff(FAST)).max()) * 1000.0, 1e-3, 10.0, 12.0)


def records(path: SignalPath = PATH, noise_um: float = 0.003) -> list[Trace]:
    runner = Runner(0.0, 40.0)

    def one(name: str, u: Floats, step_s: float, seed: int, role: str = "train") -> Trace:
        y = runner.run(path, u, step_s)
        return trace(name, u, y + noise_um * RNG(seed).standard_normal(u.size), step_s, role)

    return [
        one("identify", SLOW, 0.005, 1, "identify"),
        one("fast", FAST, 0.001, 2),
        one("biased", BIASED, 0.002, 3),
    ]


def problem(traces: list[Trace]) -> Problem:
    return Problem(traces, Noise(0.003, 0.0, 1.0, 1000, known=True), SCALES, 3)


PLAIN = problem(records())
BETA = PLAIN.beta_of(F0)
FORMS = [*forms(SCALES), line_form((50.0, 100.0), ("fast", "biased"), SCALES)]


def acting(form: Form) -> dict[str, float]:
    """Parameters with which a form acts."""
    start = form.starts(SCALES)[0]
    fill = {"start_peak_V": 35.0, "fn1_hz": 200.0, "zeta1": 0.05, "high_V": 36.0, "low_V": 4.0}
    for p in form.params:
        if p.key in fill:
            start[p.key] = fill[p.key]
        elif p.key not in start or (start[p.key] == p.null and form.linear):
            start[p.key] = p.null + 0.01 * p.scale
    return start


def named(form: Form) -> str:
    return f"{form.effect}: {form.name}"


def output(form: Form, values: dict[str, float], beta: Floats = BETA) -> Floats:
    fit = Fit((form,), values, beta, 0.0, np.empty(0))
    return np.concatenate(PLAIN.simulate(fit))


@pytest.mark.parametrize("form", FORMS, ids=named)
def test_every_parameter_of_every_form_acts(form: Form) -> None:
    values = acting(form)
    before = output(form, values)
    plain = np.concatenate(PLAIN.simulate(PLAIN.at(BETA)))
    assert np.abs(before - plain).max() > 1e-4
    for p in form.params:
        moved = values[p.key] * 1.05 if p.log else values[p.key] + 0.01 * p.scale
        assert p.low <= moved <= p.high, p.key
        change = np.abs(output(form, values | {p.key: moved}) - before).max()
        assert change > 1e-7, p.key


@pytest.mark.parametrize("form", FORMS, ids=named)
def test_columns_of_f0_are_differences(form: Form) -> None:
    values = acting(form)
    jacobian = PLAIN._jacobian(PLAIN.fit((form,), values, BETA, 0))
    for k in range(BETA.size):
        moved = BETA.copy()
        moved[k] += 0.013
        change = (output(form, values, moved) - output(form, values)) / 0.013
        whole = PLAIN.whiten([change[s] for s in PLAIN.slices])
        np.testing.assert_allclose(jacobian[k], whole, atol=2e-3 * np.abs(whole).max())


TRUTH = {
    "delay": (PATH.but(delay_s=4e-4), {"delay_s": 4e-4}),
    "saturation": (PATH.but(high_V=37.0, low_V=1.5), {"high_V": 37.0, "low_V": 1.5}),
    "slew_limit": (PATH.but(slew_V_per_s=600.0), {"slew_V_per_s": 600.0}),
    "amplifier_lag": (PATH.but(corner_hz=60.0), {"corner_hz": 60.0}),
    "backlash": (PATH.but(dead_band_um=0.08), {"dead_band_um": 0.08}),
    "asymmetry": (
        PATH.but(rise_V=1.6, rise_skew=0.4, follow=0.3),
        {"rise_V": 1.6, "rise_skew": 0.4, "follow": 0.3},
    ),
    "non_masing": (
        PATH.but(bouc_um=-0.6, bouc_V=9.0, bouc_power=1.4, bouc_gamma=0.2),
        {"bouc_um": -0.6, "bouc_V": 9.0},
    ),
    "rate_dependence": (
        PATH.but(
            threshold_V=0.5,
            power=0.8,
            v_ref_V_per_s=0.3 * SCALES.rate_max_V_per_s,
            velocity_tau_s=1e-3,
        ),
        {"threshold_V": 0.5, "power": 0.8},
    ),
}


def best_of(traces: list[Trace], effect: str, keys: set[str]) -> Fit:
    """The form of an effect with these parameters, fitted from the best of its starts."""
    posed = problem(traces)
    form = next(f for f in FORMS if f.effect == effect and keys <= set(f.keys) and not f.refines)
    rough = [posed.fit((form,), s, BETA, 2) for s in form.starts(SCALES)]
    best = min(rough, key=lambda f: f.cost)
    return posed.fit((form,), best.values, best.beta)


@pytest.mark.parametrize("effect", TRUTH)
def test_fit_comes_back_to_the_parameters(effect: str) -> None:
    path, truth = TRUTH[effect]
    fit = best_of(records(path), effect, set(truth))
    assert fit.cost < 1.05 * PLAIN.rows
    for key, value in truth.items():
        assert fit.values[key] == pytest.approx(value, rel=0.02), key


def test_values_of_other_forms_do_not_act_on_a_fit() -> None:
    old = next(f for f in FORMS if "v_knee" in f.keys and "threshold_V" in f.keys)
    new = next(
        f for f in FORMS if f.keys == tuple(k for k in old.keys if k not in ("v_knee", "smooth"))
    )
    fit = PLAIN.fit((new,), acting(old), BETA, 0)
    assert set(fit.values) == set(new.keys)


def test_columns_of_another_fit_lead_to_the_same_place() -> None:
    path, truth = TRUTH["amplifier_lag"]
    posed = problem(records(path))
    null = posed.fit((), {}, BETA)
    lag = next(f for f in FORMS if f.effect == "amplifier_lag" and not f.refines)
    start = {"corner_hz": 0.5 * truth["corner_hz"]}
    own, borrowed = (posed.fit((lag,), start, null.beta, near=near) for near in (None, null))
    assert null.columns(None).shape[0] == BETA.size and null.columns(lag).size == 0
    assert borrowed.values["corner_hz"] == pytest.approx(own.values["corner_hz"], rel=1e-4)
    assert borrowed.cost == pytest.approx(own.cost, abs=0.5)


def later(change: Callable[[Floats, Floats], Floats]) -> list[Trace]:
    """Records whose displacement, not that of identify, is changed: f(y, t)."""
    first, *rest = records()
    return [first, *(replace(t, y_um=change(t.y_um, t.t_s)) for t in rest)]


def test_fit_of_the_sensors_effects_against_formulas() -> None:
    gain = best_of(later(lambda y, _: 1.03 * y - 0.05), "gain_offset", {"gain"})
    assert gain.values["gain"] == pytest.approx(1.03, abs=5e-4)
    assert gain.values["offset_um"] == pytest.approx(-0.05, abs=2e-3)
    skewed = later(lambda y, t: np.interp(t * (1.0 + 800e-6), t, y))
    skew = best_of(skewed, "clock_skew", {"skew_ppm"})
    assert skew.values["skew_ppm"] == pytest.approx(800.0, rel=0.03)
    drift = best_of(
        later(lambda y, t: y + 0.02 * t + 0.1 * (1.0 - np.exp(-t / 0.5))), "drift", {"settle_s"}
    )
    assert drift.values["settle_um"] == pytest.approx(0.1, rel=0.1)
    assert drift.values["settle_s"] == pytest.approx(0.5, rel=0.1)
    hum = best_of(
        later(lambda y, t: y + 0.04 * np.sin(2.0 * np.pi * 50.0 * t + 1.0)),
        "periodic_disturbance",
        {"freq0_hz"},
    )
    assert hum.values["freq0_hz"] == pytest.approx(50.0, abs=0.02)
    size = np.hypot(hum.values["cos0:fast"], hum.values["sin0:fast"])
    assert size == pytest.approx(0.04, rel=0.02)


@pytest.mark.parametrize(("share1", "first"), [(0.6, 310.0), (-0.01, 500.0)])
def test_the_lowest_mode_that_carries_something_is_told_first(share1: float, first: float) -> None:
    form = called("two modes")
    values = dict(zip(form.keys, (310.0, 0.01, share1, 500.0, 0.02, 0.4), strict=True))
    fit = PLAIN.fit((form,), values, BETA, 0)
    told = reported("resonance", fit, PLAIN)
    assert list(told) == ["fn_hz", "zeta", "share1", "fn2_hz", "zeta2", "share2"]
    assert told["fn_hz"]["value"] == first
    assert {told["zeta"]["value"], told["zeta2"]["value"]} == {0.01, 0.02}


@pytest.mark.parametrize(("unsteady", "least"), [(0.0, 1.0), (0.01, 5.0)])
def test_an_interval_covers_the_truth_where_what_is_left_is_no_white_noise(
    unsteady: float, least: float
) -> None:
    """A gain that is another in each eighth of a record: no model's, yet its mean is asked for."""
    covered, halves = 0, []
    for seed in range(30):

        def moved(y: Floats, _: Floats, seed: int = seed) -> Floats:
            own = np.repeat(RNG(1000 * seed + y.size).normal(1.03, unsteady, 8), -(-y.size // 8))
            return own[: y.size] * y + 0.003 * RNG(seed).standard_normal(y.size)

        posed = problem(later(moved))
        fit = posed.fit((called("gain and offset"),), {"gain": 1.0, "offset_um": 0.0}, BETA)
        told = reported("gain_offset", fit, posed)["gain"]["ci95"]
        covered += told[0] <= 1.03 <= told[1]
        halves.append((told[1] - told[0]) / 2)
    curved = 1.96 * np.sqrt(np.diag(fit.covariance)[BETA.size])
    assert covered >= 25
    assert least * curved < np.median(halves)
    assert np.median(halves) < 3.0 * curved or unsteady


# -- how far ------------------------------------------------------------------------------------


def test_cross_validation_is_what_refits_without_a_block_miss() -> None:
    posed = problem(records(noise_um=0.3))
    full = posed.fit((), {}, BETA, 3)
    full = posed.fit((), {}, full.beta, 1)
    energy, rows = 0.0, 0
    for i, t in enumerate(posed.traces):
        if t.role != "train":
            continue
        rows += int(posed.used[i].sum())  # the very end, which no fit sees, does not count
        for block in np.array_split(np.arange(t.u_V.size), TRAIN_BLOCKS):
            use = t.use.copy()
            use[block] = False
            others = [replace(x, use=use) if k == i else x for k, x in enumerate(posed.traces)]
            again = posed.with_traces(others).fit((), {}, full.beta, 3)
            missed = ((t.y_um - posed.simulate(again)[i]) * posed.used[i])[block]
            energy += float(missed @ missed)
    assert cross_validated(posed, full)[0] == pytest.approx(energy / rows, rel=1e-4)


def test_rms_of_a_region_is_that_of_its_rows() -> None:
    u = swings(seconds=1.0)
    low = u < 20.0
    t = trace("later", u, np.where(low, 0.5, 0.1) * np.sign(np.sin(np.arange(u.size))), 1e-3)
    made = Prediction(t, np.zeros_like(u), 0.5 * t.y_um)
    region = Region("input", 0.0, 20.0, "V", 0.9, 2.0)
    found = region_shrink([region], [made], (0.0, 40.0))[0]
    assert found["rms_before_um"] == pytest.approx(0.5, rel=1e-6)
    assert found["rms_after_um"] == pytest.approx(0.25, rel=1e-6)


def test_lines_are_projected_out_of_the_share_alone() -> None:
    n = 4000
    t = np.arange(n) * 1e-3
    hum = 0.3 * np.sin(2.0 * np.pi * 50.0 * t + 1.0)
    noise = 0.01 * RNG(1).standard_normal(n)
    made = Prediction(
        trace("later", 20.0 + np.sin(t), hum + noise + 0.1 * np.sin(9.0 * t), 1e-3),
        np.zeros(n),
        0.1 * np.sin(9.0 * t),
    )
    told = shrink([made], Noise(0.01, 0.0, 1.0, 1000, True), [50.0], 0)
    assert told["rms_after_um"] == pytest.approx(0.3 / np.sqrt(2.0), rel=0.01)
    assert told["rms_after_um"] == told["records"][0]["rms_after_um"]
    assert told["closable_closed"] == pytest.approx(1.0, abs=0.01)


def test_a_floor_that_is_not_well_known_widens_the_interval_of_the_share() -> None:
    n = 4000
    t = np.arange(n) * 1e-3
    made = Prediction(
        trace(
            "later", 20.0 + np.sin(t), 0.01 * RNG(1).standard_normal(n) + 0.02 * np.sin(9 * t), 1e-3
        ),
        np.zeros(n),
        0.02 * np.sin(9 * t),
    )
    vague = ((0.2e-4**2,),)  # of white_um^2 = 1e-4, a fifth of it
    sure, unsure = (
        shrink([made], Noise(0.01, 0.0, 1.0, 10**6, True, covariance=c), [], 0)[
            "closable_closed_ci95"
        ]
        for c in ((), vague)
    )
    assert unsure[1] - unsure[0] > 1.5 * (sure[1] - sure[0])


def test_the_floor_is_no_more_than_what_is_left() -> None:
    n = 2000
    u = 20.0 + np.sin(np.arange(n) * 0.01)
    y = 0.01 * RNG(2).standard_normal(n) + 0.01 * np.sin(np.arange(n) * 0.05)
    made = Prediction(trace("later", u, y, 1e-3), np.zeros(n), y - 0.01 * RNG(2).standard_normal(n))
    vague = Noise(0.01, 0.0, 1.0, 1000, known=False)
    low, high = shrink([made], vague, [], 0)["closable_closed_ci95"]
    assert 0.5 < low < 1.0 and high < 1.2


def closed_share(y: np.ndarray, left: np.ndarray) -> tuple[float, float, float]:
    """Of what can be closed, with the ends of its interval; known noise of 0.01 um."""
    made = Prediction(trace("later", 20.0 + y, y, 1e-3), np.zeros(y.size), y - left)
    told = shrink([made], Noise(0.01, 0.0, 1.0, 1000, True), [], 0)
    low, high = told["closable_closed_ci95"]
    return low, told["closable_closed"], high


def test_a_share_above_one_lies_in_its_interval() -> None:
    """What is left is by chance less than the floor."""
    n = 4000
    left = 0.0095 * RNG(3).standard_normal(n)
    low, share, high = closed_share(0.01 * np.sin(np.arange(n) * 0.05) + left, left)
    assert low < share < high and share > 1.0


def test_a_gap_in_a_single_block_leaves_its_share_certain() -> None:
    n = 4000
    left = 0.01 * RNG(4).standard_normal(n)
    step = np.where(np.arange(n) // 50 == 20, 1.0, 0.0)
    low, share, high = closed_share(step + left, left)
    assert 0.98 < low < share < high < 1.02


def test_the_noises_uncertainty_does_not_depend_on_the_unit() -> None:
    shares = []
    for unit in (1.0, 1e-3):
        u = loop()
        y = Runner(0.0, 40.0).run(PATH, u, 0.005) + 0.02 * sensor_noise(u.size, 0.9, 0.005, 3)
        shares.append(estimate_noise(trace("slow", u, unit * y, 0.005, "identify")).power_error())
    assert shares[1] == pytest.approx(shares[0], rel=0.2)


# -- search -------------------------------------------------------------------------------------


def test_a_line_above_half_a_records_rate_is_found_where_it_is() -> None:
    """Without an anti-alias filter 134.7 Hz stand at 65.3 Hz in a record of 200 Hz."""
    noise = Noise(0.003, 0.0, 1.0, 1000, known=True)
    traces = []
    for name, rate_hz, seed in (("slow", 200.0, 1), ("fast", 500.0, 2), ("slow too", 200.0, 3)):
        t = np.arange(2000) / rate_hz
        y = 0.003 * RNG(seed).standard_normal(t.size) + 0.004 * np.sin(2 * np.pi * 134.7 * t + seed)
        traces.append(trace(name, 20 + t, y, 1 / rate_hz))
    posed = Problem(traces, noise, SCALES, 3)
    found = peaks(posed, np.concatenate([t.y_um for t in traces]) / 0.003)
    assert len(found) == 1
    assert found[0] == pytest.approx(134.7, abs=0.05)
    alone = Problem(traces[:1], noise, SCALES, 3)  # nothing tells it from its alias
    assert peaks(alone, traces[0].y_um / 0.003)[0] == pytest.approx(65.3, abs=0.05)


def test_a_slow_line_is_seen_beside_a_short_fast_record_in_which_it_is_wide() -> None:
    records = [("fast", 8000, 20e3), ("slow", 7000, 200.0), ("middle", 7000, 1e3)]
    lined = [
        trace(
            name,
            np.linspace(0.0, 40.0, n),
            np.sin(2 * np.pi * 17.9 * np.arange(n) / hz + 1.0),
            1 / hz,
        )
        for name, n, hz in records
    ]
    assert peaks(problem(lined), np.concatenate([t.y_um for t in lined]))[0] == pytest.approx(
        17.9, abs=0.02
    )


def test_an_effect_that_joins_others_must_be_more_than_their_models_errors() -> None:
    engine = Engine(PLAIN, FORMS, 1, lambda _: None)
    white = standing(form("delay"), 1.0)
    n = white.residual.size
    wave = np.sqrt(2 / n) * np.sin(np.arange(n) * 0.05)
    much, old, cleaner = (
        replace(white, residual=white.residual + np.sqrt(fall) * wave)
        for fall in (0.8 * n, 0.1 * n, 0.04 * n)
    )
    new = replace(white, forms=(form("delay"), form("backlash")))
    clear, vast = (
        replace(standing(None, 1.0), residual=np.sqrt(e / n) * np.ones(n)) for e in (5e4, 5e7)
    )
    assert engine.accepted(old, new, clear)
    assert not engine.accepted(old, new, vast)
    assert engine.accepted(much, new, vast), "all of it, however small a part of the gap"
    assert not engine.accepted(cleaner, new, clear), "the others leave no more than noise"


def test_an_effect_removes_most_of_what_a_verdict_would_allow() -> None:
    engine = Engine(PLAIN, FORMS, 1, lambda _: None)
    sizes = [t.u_V.size for t in PLAIN.traces]
    fast = np.repeat([t.name == "fast" for t in PLAIN.traces], sizes)

    def leaving(one: float, other: float, *effects: str) -> Fit:
        """So much more than noise in one record and in the others, as a share of it."""
        white = standing(None, 1.0)
        residual = np.sqrt(1.0 + np.where(fast, one, other)) * white.residual
        return replace(white, forms=tuple(form(e) for e in effects), residual=residual)

    old = leaving(0.6, 0.3, "delay")
    part, most = (leaving(0.1, left, "delay", "backlash") for left in (0.3, 0.05))
    little, much = leaving(5.0, 30.0), leaving(5.0, 5.0)  # the old one leaves 2.6 of it, 9 percent
    assert not engine.accepted(old, part, little)
    assert engine.accepted(old, most, little)
    assert engine.accepted(old, part, much)


# -- thresholds of the verdict ------------------------------------------------------------------


def standing(form_of: Form | None, size: float) -> Fit:
    """A hypothesis that leaves white residuals of this size over the noise."""
    forms_ = () if form_of is None else (form_of,)
    residual = size * RNG(4).standard_normal(sum(t.u_V.size for t in PLAIN.traces))
    values = {} if form_of is None else acting(form_of)
    return Fit(forms_, values, BETA, float(residual @ residual), residual)


def verdict(best: Fit, *others: Fit, gap_excess: float = 1e6) -> Verdict:
    null = standing(None, 15.0) if best.forms else best
    fits = {f.effects: f for f in (null, *others, best)}
    engine = Engine(PLAIN, FORMS, 1, lambda _: None)
    engine.fits.update(fits)
    return judge(engine, Search(null, best, fits), gap_excess)


def form(effect: str) -> Form:
    return next(f for f in FORMS if f.effect == effect)


def test_noise_alone_is_no_gap() -> None:
    found = verdict(standing(None, 1.0), gap_excess=0.0)
    assert (found.status, found.effects, found.candidates) == ("no_gap", [], [])


def test_what_is_outdone_by_something_without_a_name_is_unknown() -> None:
    null = standing(None, 1.01)
    engine = Engine(PLAIN, FORMS, 1, lambda _: None)
    search = Search(null, null, {null.effects: null})
    told = judge(engine, search, 1e6, Outsider(standing(None, 1.0), 400.0))
    assert (told.status, told.effects) == ("unknown", []) and told.confidence > 0.5


def test_an_effect_must_be_proven_against_f0_alone_after_others_were_dropped() -> None:
    """A pair may be accepted at once; neither of the two is for that."""
    null = standing(None, 1.0)
    n = null.residual.size
    wave = np.sqrt(2 / n) * np.sin(np.arange(n) * 0.05)
    null = replace(null, residual=null.residual + np.sqrt(230.0) * wave)
    both = replace(
        standing(form("delay"), 1.0),
        forms=(form("delay"), form("backlash")),
        values=acting(form("delay")) | acting(form("backlash")),
    )
    engine = Engine(PLAIN, FORMS, 1, lambda _: None)
    engine.fits = {null.effects: null, both.effects: both}
    left = engine._pruned(both, null)
    assert not left.effects or engine.accepted(null, left, null)


def called(name: str) -> Form:
    return next(f for f in FORMS if f.name == name)


def test_what_is_learned_of_one_effect_serves_it_beside_others() -> None:
    """A second mode that was found beside the wrong effect is tried beside the right one."""
    one, two = called("one mode"), called("two modes")

    class Pupil(Engine):
        def _refined(self, fit: Fit, null: Fit) -> Fit:
            forms_ = tuple(two if f is one else f for f in fit.forms)
            return replace(standing(None, 2.0), forms=forms_, values=acting(two) | fit.values)

        def again(self, fit: Fit, iterations: int = 9) -> Fit:
            assert all(fit.values[k] == acting(two)[k] for k in two.keys)
            return replace(standing(None, 1.0), forms=fit.forms, values=fit.values)

    def pair(size: float, effect: str) -> Fit:
        values = acting(one) | acting(form(effect))
        return replace(standing(None, size), forms=(one, form(effect)), values=values)

    null = standing(None, 90.0)
    ranked = [pair(3.0, "rate_dependence"), pair(4.0, "delay"), standing(form("creep"), 5.0)]
    best = Pupil(PLAIN, FORMS, 1, lambda _: None)._with_better_forms(ranked, null, 1)
    assert [f.effects for f in best] == [ranked[i].effects for i in (1, 0, 2)]
    assert best[0].forms == (two, form("delay"))


def test_the_next_best_are_refined_too_while_the_best_leaves_too_much() -> None:
    refined = []

    class Noted(Engine):
        def _refined(self, fit: Fit, null: Fit) -> Fit:
            refined.append(fit.effects)
            return fit

    engine = Noted(PLAIN, FORMS, 1, lambda _: None)
    ranked = [standing(form(e), s) for e, s in (("delay", 3.0), ("creep", 4.0), ("drift", 5.0))]
    null = standing(None, 9.0)
    engine._with_better_forms(ranked, null, 2)
    assert refined == [{"delay"}, {"creep"}]
    refined.clear()
    engine._with_better_forms([standing(form("delay"), 1.0), *ranked[1:]], null, 2)
    assert refined == [{"delay"}]


def test_creep_that_is_over_at_once_joins_nothing() -> None:
    ladder = called("ladder, a mode a decade")
    lags, creeps = ({**ladder.null(), "creep_1": 0.02, "creep_7": late} for late in (0.004, 0.02))
    assert not _plausible(replace(standing(ladder, 1.0), values=lags), "creep")
    assert _plausible(replace(standing(ladder, 1.0), values=creeps), "creep")


def test_columns_of_f0_are_right_behind_flashed_blocks() -> None:
    flashed = PATH.but(gain=1.1, offset_um=0.5, corner_hz=40.0, creep=(CreepMode(0.5, 0.05),))
    posed = Problem(records(), PLAIN.noise, SCALES, 3, flashed)
    y = posed.simulate(posed.at(BETA))
    columns = posed._columns_f0((), {}, BETA, y)
    for k, column in enumerate(columns):
        moved = BETA + 1e-3 * (np.arange(BETA.size) == k)
        finite = posed.change((), {}, moved, y) / 1e-3
        np.testing.assert_allclose(column, finite, rtol=0, atol=1e-6 * np.abs(finite).max())


@pytest.mark.parametrize("name", [f.name for f in FORMS if f.effect == "amplifier_lag"])
def test_a_pole_takes_the_place_of_the_flashed_one_wherever_that_stands(name: str) -> None:
    flashed = PATH.but(corner_hz=70.0, behind_hz=80.0)
    made = called(name).path
    assert made is not None
    path = made(flashed, acting(called(name)) | {"corner_hz": 50.0})
    assert sorted((path.corner_hz, path.behind_hz)) == [0.0, 50.0]


class Climber(Engine):
    """Goes up, and drops what has become superfluous, as it is told; notes where it set out."""

    def __init__(self, ups: list[Fit], downs: list[Fit]) -> None:
        super().__init__(PLAIN, FORMS, 1, lambda _: None)
        self.ups, self.downs = iter(ups), iter(downs)
        self.bases: list[frozenset[str]] = []

    def _ascended(self, null: Fit, best: Fit) -> Fit:
        self.bases.append(best.effects)
        return next(self.ups)

    def _pruned(self, fit: Fit, null: Fit) -> Fit:
        return next(self.downs)


def test_the_search_goes_on_from_what_is_left_of_effects_that_became_superfluous() -> None:
    def leaving(size: float, *effects: str) -> Fit:
        return replace(standing(None, size), forms=tuple(form(e) for e in effects))

    null, one = leaving(9.0), leaving(3.0, "resonance")
    detour, other, both = (leaving(2.0, "resonance", e) for e in ("drift", "creep", "saturation"))

    def climbed(ups: list[Fit], downs: list[Fit]) -> tuple[list[frozenset[str]], Fit]:
        climber = Climber(ups, downs)
        return climber.bases, climber.search(null).best

    bases, best = climbed([detour, both], [one, both])
    assert (bases, best) == ([null.effects, one.effects], both)
    bases, best = climbed([detour, other], [one, one])
    assert (bases, best) == ([null.effects, one.effects], one), "not in a circle"
    clean = leaving(1.0, "resonance")
    assert climbed([detour], [clean]) == ([null.effects], clean), "enough"
    assert climbed([detour], [null]) == ([null.effects], null), "nothing is left"


def test_a_known_effect_asks_no_more_of_the_first_that_joins_it() -> None:
    given = form("delay")
    fixed = replace(given, params=tuple(replace(p, low=1e-4, high=1e-4) for p in given.params))
    engine = Engine(PLAIN, FORMS, 1, lambda _: None)
    alone, known, fitted = (
        replace(standing(None, 1.0), forms=forms_) for forms_ in ((), (fixed,), (given,))
    )
    assert engine._gain_min(known) == engine._gain_min(alone) < engine._gain_min(fitted)


def test_clean_effect_without_rivals_is_identified() -> None:
    found = verdict(standing(form("delay"), 1.0), standing(form("backlash"), 3.0))
    assert (found.status, found.effects) == ("identified", ["delay"])
    assert found.confidence > 0.9


def test_rivals_that_fit_as_well_are_listed() -> None:
    found = verdict(
        standing(form("delay"), 1.0),
        standing(form("amplifier_lag"), 1.0001),
        standing(form("backlash"), 3.0),
    )
    assert found.status == "ambiguous"
    assert set(found.candidates) == {"delay", "amplifier_lag"}
    assert found.confidence > 0.5


def test_a_variant_that_is_unlikely_beforehand_is_no_rival_as_long_as_it_is_no_better() -> None:
    behind = standing(called("one pole behind the hysteresis"), 1.0)
    found = verdict(standing(form("delay"), 1.0), behind)
    assert (found.status, found.effects) == ("identified", ["delay"]) and found.confidence > 0.9
    assert verdict(behind, standing(form("delay"), 1.0)).status == "ambiguous"


def test_never_more_than_four_candidates() -> None:
    twins = ("amplifier_lag", "backlash", "creep", "resonance", "saturation", "drift")
    found = verdict(standing(form("delay"), 1.0), *(standing(form(t), 1.0) for t in twins))
    assert found.status == "ambiguous" and len(found.candidates) == 4


def test_remainder_above_a_twentieth_is_unknown() -> None:
    left = 3.0 * (FAST.size + BIASED.size)  # of residuals twice the noise
    best = standing(form("delay"), 2.0)
    assert verdict(best, gap_excess=left / 0.2).status == "unknown"
    assert verdict(best, gap_excess=left / 0.2).candidates == ["delay"]
    small = verdict(best, gap_excess=left / 0.01)
    assert small.status == "identified"
    assert small.remainder_share == pytest.approx(0.01, rel=0.2)


def test_an_accepted_effect_has_the_parameters_of_the_accepted_hypothesis() -> None:
    best, other = standing(form("delay"), 1.0), standing(form("backlash"), 3.0)
    both = replace(standing(form("delay"), 0.9), forms=(form("delay"), form("resonance")))
    engine = Engine(PLAIN, FORMS, 1, lambda _: None)
    search = Search(other, best, {f.effects: f for f in (best, other, both)})
    assert engine.score(both) < engine.score(best)
    assert best_with("delay", engine, search) is best
    assert best_with("resonance", engine, search) is both


def test_a_line_is_left_out_of_every_record_but_its_own() -> None:
    y = np.zeros(100)
    lines = line_form((50.0,), ("fast",), PLAIN.scales)
    values = lines.starts(PLAIN.scales)[0] | {"cos0:fast": 1.0}
    assert lines.measure is not None
    for role, largest in (("train", 1.0), ("holdout", 0.0), ("identify", 0.0)):
        seen = lines.measure(
            y, trace("fast", np.arange(100.0), np.arange(100.0), 0.001, role), values
        )
        assert np.abs(seen).max() == largest


def test_a_line_at_half_a_records_rate_is_fitted_and_counts_as_steady() -> None:
    """There its sine cannot be seen, and its amplitude not known."""
    given = records()
    truth = {t.name: 0.1 * np.cos(2 * np.pi * 250.0 * t.t_s + 1.2) for t in given[1:]}
    disturbed = [replace(t, y_um=t.y_um + truth.get(t.name, 0.0)) for t in given]
    seen = problem(disturbed)
    lines = line_form((250.0,), ("fast", "biased"), SCALES)
    fit = seen.fit((lines,), lines.starts(SCALES)[0], BETA)
    assert fit.cost < 1.1 * seen.rows
    assert np.hypot(fit.values["cos0:fast"], fit.values["sin0:fast"]) == pytest.approx(0.1, rel=0.1)
    assert abs(fit.values["sin0:biased"]) < 0.1
    assert steady(seen, fit)


def test_lines_are_looked_for_again_where_more_rows_tell_them_apart() -> None:
    """A short part of the records had one of 37 Hz at 41, where it can be wedged for good."""
    given = records()
    hum = [replace(t, y_um=t.y_um + 0.3 * np.sin(2 * np.pi * 37.0 * t.t_s)) for t in given[1:]]
    seen = problem([given[0], *hum])
    engine = Engine(seen, FORMS, 1, lambda _: None)
    wrong = line_form((41.0,), ("fast", "biased"), SCALES)
    wedged = seen.fit((wrong,), wrong.starts(SCALES)[0], BETA)
    right = engine._with_lines_again(wedged)
    assert right.effects == wedged.effects
    assert right.values["freq0_hz"] == pytest.approx(37.0, abs=0.01)
    assert right.cost < 1.1 * seen.rows < wedged.cost
    assert engine._with_lines_again(right).cost == pytest.approx(right.cost, rel=1e-3)
    without = seen.fit((form("delay"),), acting(form("delay")), BETA)
    assert engine._with_lines_again(without) is without


def test_a_false_line_goes_when_what_caused_it_joins() -> None:
    """A true one of 40 Hz, and one of 90 Hz that only one record shows."""
    given = records()
    size = {"fast": (0.1, 0.1), "biased": (0.1, 0.0)}

    def disturbed(t: Trace) -> Trace:
        wave = [np.sin(2 * np.pi * f * t.t_s) for f in (40.0, 90.0)]
        return replace(t, y_um=t.y_um + np.dot(size[t.name], wave))

    seen = problem([given[0], *(disturbed(t) for t in given[1:])])
    engine = Engine(seen, FORMS, 1, lambda _: None)
    both = line_form((40.0, 90.0), ("fast", "biased"), SCALES)
    fit = seen.fit((form("delay"), both), acting(form("delay")) | both.starts(SCALES)[0], BETA)
    assert not steady(seen, fit)
    left = engine._without_false_lines(fit)
    assert left.effects == fit.effects and steady(seen, left)
    assert [left.values[k] for k in left.values if k.startswith("freq")] == pytest.approx(
        [40.0], abs=0.01
    )
    assert engine._without_false_lines(left) is left


def test_what_slow_records_show_folded_to_the_bottom_is_a_drift_and_no_line() -> None:
    def one(name: str, hz: float, size: float) -> Trace:
        t = np.arange(6000) / hz
        y = size * (1.0 - np.exp(-t / 2.0)) + 0.003 * RNG(int(hz)).standard_normal(t.size)
        return trace(name, 20.0 + np.sin(t), y, 1 / hz)

    records = [one("slow", 500.0, 0.3), one("middle", 1000.0, 0.3), one("fast", 5000.0, 0.0)]
    posed = problem(records)
    lines = line_form((2000.0,), tuple(t.name for t in records), SCALES)
    assert not steady(posed, posed.fit((lines,), lines.starts(SCALES)[0], np.zeros(4)))


def test_a_line_of_the_command_is_no_disturbance_where_a_model_may_be_wrong_by_it() -> None:
    t = np.arange(8000) * 1e-3
    sine = trace("sine", 20.0 + 15.0 * np.sin(2 * np.pi * 10.0 * t), t, 1e-3)
    broad = trace("broad", 20.0 + 5.0 * RNG(3).standard_normal(t.size), t, 1e-3)
    assert driven(sine, 10.0, 1.0)
    assert not driven(sine, 10.0, 10.0), "larger than any model's error"
    assert not driven(sine, 13.0, 0.1)
    assert not driven(broad, 10.0, 0.01), "every frequency is as good as its neighbours"


def test_two_causes_of_which_neither_shows_alone_are_found_together() -> None:
    """A mode that rings only where the slew limit lets it explains nothing without it."""
    path = PATH.but(slew_V_per_s=12e3, modes=(Mode(365.0, 0.019),))

    def one(name: str, u: Floats, step_s: float, seed: int, role: str = "train") -> Trace:
        y = Runner(0.0, 40.0).run(path, u, step_s)
        return trace(name, u, y + 0.003 * RNG(seed).standard_normal(u.size), step_s, role)

    given = [
        one("identify", SLOW, 0.005, 1, "identify"),
        *(
            one(name, np.repeat(RNG(seed).uniform(2.0, 38.0, 8), 350), 2e-4, seed)
            for name, seed in (("steps", 5), ("more", 6))
        ),
    ]
    rate = max(float(np.abs(np.diff(t.u_V)).max()) / t.step_s for t in given)
    scales = replace(SCALES, rate_max_V_per_s=rate, step_min_s=2e-4)
    posed = Problem(given, Noise(0.003, 0.0, 1.0, 1000, known=True), scales, 3)
    found = Engine(posed, forms(scales), 1, lambda _: None).search(posed.fit((), {}, BETA))
    assert found.best.effects == {"slew_limit", "resonance"}
    assert found.best.values["fn1_hz"] == pytest.approx(365.0, rel=0.001)
    assert found.best.values["slew_V_per_s"] == pytest.approx(12e3, rel=0.001)


def made(path: SignalPath, more: Callable[[Trace], Floats]) -> Problem:
    """A slow loop, and two records of ramps between random turning points with more um added."""
    ramps = np.interp(np.arange(3000) / 60.0, np.arange(51), RNG(4).uniform(1.0, 39.0, 51))

    def one(name: str, u: Floats, seed: int, role: str = "train") -> Trace:
        y = Runner(0.0, 40.0).run(path, u, 0.005) + 0.003 * RNG(seed).standard_normal(u.size)
        t = trace(name, u, y, 0.005, role)
        return t if role == "identify" else replace(t, y_um=y + more(t))

    given = [one("identify", SLOW, 0, "identify"), one("ramps", ramps, 1)]
    given.append(one("back", ramps[::-1].copy(), 2))
    rate = max(float(np.abs(np.diff(t.u_V)).max()) / t.step_s for t in given)
    scales = replace(SCALES, rate_max_V_per_s=rate, step_min_s=0.005, length_max_s=15.0)
    return Problem(given, Noise(0.003, 0.0, 1.0, 1000, known=True), scales, 3)


@pytest.mark.parametrize(("taus_s", "better"), [((0.32, 3.2), True), ((0.1, 1.0, 10.0), False)])
def test_a_ladder_of_finer_steps_is_taken_where_it_scores_better(
    taus_s: tuple[float, ...], better: bool
) -> None:
    crept = PATH.but(creep=tuple(CreepMode(tau, 0.02) for tau in taus_s))
    posed = made(crept, lambda t: np.zeros(t.u_V.size))
    engine = Engine(posed, forms(posed.scales), 1, lambda _: None)
    coarse = next(f for f in engine.forms if f.name == "ladder, a mode a decade")
    fit = posed.fit((coarse,), coarse.null(), BETA)
    found = engine.finest(Search(posed.fit((), {}, BETA), fit, {})).best
    assert (found.forms[0].name == "ladder, two modes a decade") == better
    assert (found.cost < fit.cost - 100.0) == better


def search(posed: Problem) -> tuple[Engine, Search]:
    engine = Engine(posed, forms(posed.scales), 1, lambda _: None)
    return engine, engine.search(posed.fit((), {}, BETA))


def test_the_records_tell_the_size_that_a_fit_starts_from() -> None:
    bent = PATH.but(bouc_um=0.05, bouc_V=6.0, bouc_power=1.2, bouc_gamma=0.2)
    _, found = search(made(bent, lambda t: np.zeros(t.u_V.size)))
    assert found.best.effects == {"non_masing"}
    assert found.best.values["bouc_um"] == pytest.approx(0.05, rel=0.2)


@pytest.mark.parametrize("parabolic", [0.0, 1.0])
def test_of_knees_that_fit_about_as_well_the_nearer_is_taken(parabolic: float) -> None:
    """Both leave next to nothing, but their widths mean different things."""
    clipped = PATH.but(high_V=36.0, knee_V=0.8, parabolic=parabolic)
    posed = made(clipped, lambda t: np.zeros(t.u_V.size))
    engine = Engine(posed, forms(posed.scales), 1, lambda _: None)
    start = {"high_V": 36.0, "knee_V": 0.8}
    for law in (called("soft, high end"), called("parabolic, high end")):
        nearest = engine.nearest_law(posed.fit((law,), start, BETA), "saturation")
        assert nearest.forms[0].name == ("parabolic" if parabolic else "soft") + ", high end"
        assert nearest.values["knee_V"] == pytest.approx(0.8, rel=0.05)


@pytest.mark.parametrize(("share", "unseats"), [(0.03, False), (0.6, True)])
def test_curves_unseat_a_model_only_where_it_is_clearly_wrong(share: float, unseats: bool) -> None:
    """A drift, and what differs from record to record."""

    def moved(t: Trace) -> Floats:
        z = t.t_s / t.t_s[-1]
        return z + share * (z - z**2) * (1.0 if t.name == "ramps" else -1.0)

    engine, found = search(made(PATH, moved))
    outsider = engine.outsider(found, outside_forms(engine.problem.scales, engine.problem.traces))
    assert found.best.effects == {"drift"}
    assert (outsider is not None) == unseats


def test_where_much_is_left_no_form_is_too_fine_to_be_tried() -> None:
    """Thresholds that grow as the logarithm of the speed; viscous operators are no such thing."""
    law = {"power": 0.1, "v_knee": 0.05, "v_ref_V_per_s": 30.0, "of_speed": 1.0}
    grown = PATH.but(widening=0.4, velocity_tau_s=0.01, **law)
    engine, found = search(made(grown, lambda t: 0.02 * t.t_s))
    assert found.best.effects == {"rate_dependence", "drift"}
    assert found.best.cost < 1.2 * engine.problem.rows


def test_of_a_lines_images_the_lowest_is_taken() -> None:
    """13.7 Hz lies beside a stronger line, as short records show it; slow ones also show images."""

    def one(name: str, hz: float, rows: int) -> Trace:
        t = np.arange(rows) / hz
        y = 0.27 * np.sin(2 * np.pi * 23.7 * t) + 0.18 * np.sin(2 * np.pi * 13.7 * t + 1.0)
        y += lfilter([0.003], [1.0, -0.99], RNG(rows).standard_normal(rows))
        return trace(name, 20.0 + np.sin(t), y, 1 / hz)

    records = [
        one("slow", 200.0, 6000),
        one("middle", 1000.0, 6001),
        one("fast", 2e4, 5600),
        one("faster", 2e4, 5601),
    ]
    found = peaks(problem(records), np.concatenate([t.y_um for t in records]) / 0.003)
    assert found[:2] == pytest.approx([23.7, 13.7], abs=0.02)


def test_a_fast_clock_shows_at_a_records_end_what_follows_it() -> None:
    """Four rows of 6000, of a command that moves: no model knows them, and none is to be bent."""
    n, skew = 6000, 700e-6
    t = np.arange(n + 10) * 1e-3
    u = 20.0 - 19.0 * np.cos(2 * np.pi * 7.3 * t)
    y = np.interp(t[:n] * (1 + skew), t, Runner(0.0, 40.0).run(PATH, u, 1e-3))
    fast = trace("fast", u[:n], y + 0.003 * RNG(8).standard_normal(n), 1e-3)
    posed = problem([records()[0], fast])
    form = next(f for f in FORMS if f.name == "command linear between samples" and f.resample)
    fit = posed.fit((form,), {"skew_ppm": 600.0}, BETA)
    assert fit.values["skew_ppm"] == pytest.approx(700.0, rel=0.01)
    assert fit.cost < 1.1 * posed.rows
    seen = posed.simulate(fit)[1]
    assert np.abs(seen - y)[-4:].max() < 0.2 * np.abs(np.diff(y)).max()


def test_a_search_among_forms_ends_where_each_comes_nearer_somewhere(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A gain counts in the noise that the new one leaves: of two both may gain on the other."""
    skewed = records(PATH.but(rise_V=1.6, follow=0.3))
    engine = Engine(problem(skewed), FORMS, 1, lambda _: None)
    null = engine.problem.fit((), {}, BETA)
    lag = engine.problem.fit((form("amplifier_lag"),), {"corner_hz": 300.0}, BETA)
    monkeypatch.setattr(Engine, "gain", lambda *_: 1e6)
    assert engine._refined(lag, null).effects == {"amplifier_lag"}
