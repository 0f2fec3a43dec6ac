"""The model of Yang et al.: model.json, predict, export, identify, and the paper reproduced."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from madelung.cli import app
from madelung.core import Predictor
from madelung.errors import InputError
from madelung.export import default_scaling, params_source
from madelung.model import Model, load_model, model_from_json, yang_model
from madelung.path import SignalPath, discretise, predictor
from madelung.records import Record, write_record
from madelung.reproduce import Row, play_model, verdict
from madelung.reproduce_yang import (
    AMPLITUDE_V,
    CITATION,
    EFFECTS,
    FIGURES,
    HIGH_V,
    LINEAR,
    LOW_V,
    NAMES,
    PUBLISHED,
    SINES_HZ,
    YangReproduction,
    reproduce_yang,
    write,
)
from madelung.yang2015 import PLAYS_MAX, Yang, polynomial, spectrum, weights_of_harmonics
from madelung.yang2015_identify import (
    YangIdentification,
    errors,
    identify_yang,
    sine_of,
    summary,
)

RATE_HZ = 50_000.0
TABLE_1 = Yang(
    tuple((np.arange(10) / 10.0).tolist()),
    (0.0789, 0.2268, 0.1928, 0.2019, 0.1995, 0.2001, 0.2, 0.2, 0.1999, 0.2005),
)
"""Of Cao & Li 2019."""


def sine(hz: float, cycles: int = 8, rate_hz: float = RATE_HZ) -> np.ndarray:
    t = np.arange(round(cycles * rate_hz / hz)) / rate_hz
    return 70.0 - AMPLITUDE_V * np.cos(2.0 * np.pi * hz * t)


def record(yang: Yang, hz: float, noise_um: float = 0.0, cycles: int = 8) -> Record:
    """What a model gives for a sine, with noise."""
    rate_hz = min(RATE_HZ, 500.0 * hz)
    u = sine(hz, cycles, rate_hz)
    y = predictor(yang_model(yang, LOW_V, HIGH_V), "float64", 1.0 / rate_hz, u[0]).run(u)
    y = y + np.random.default_rng(int(hz)).normal(0.0, noise_um, u.size)
    return Record(f"{hz:g} Hz", np.arange(u.size) / rate_hz, u, y)


# -- the model --------------------------------------------------------------------------------


@pytest.mark.parametrize(("precision", "atol"), [("float32", 5e-7), ("float64", 2e-15)])
def test_with_table_1_of_cao_and_li_it_equals_the_trajectory(precision: str, atol: float) -> None:
    x = np.random.default_rng(8).random(3000)
    ours = Predictor(yang_model(TABLE_1, 0.0, 1.0), precision).run(x)  # type: ignore[arg-type]
    trajectory = Predictor(play_model(), precision).run(x)  # type: ignore[arg-type]
    np.testing.assert_allclose(ours, trajectory, atol=atol)


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_with_k_1_and_c_0_it_is_eq_4_to_the_bit(precision: str) -> None:
    alone = yang_model(PUBLISHED.rate_independent.but(center_um=3.3), LOW_V, HIGH_V)
    u = np.random.default_rng(4).uniform(LOW_V, HIGH_V, 3000)
    slow = Predictor(alone, precision).run(u)  # type: ignore[arg-type]
    fast = predictor(alone, precision, 1e-5, u[0]).run(u)  # type: ignore[arg-type]
    np.testing.assert_array_equal(slow, fast)


def test_eq_4_and_eq_8_by_numpy() -> None:
    """On one rising branch the operators are max(u - r, 0) and the velocity is constant."""
    yang = PUBLISHED.but(hz=300.0, amplitude_V=AMPLITUDE_V, velocity_tau_s=1e-9)
    u = np.linspace(LOW_V, HIGH_V, 1001)
    y = predictor(yang_model(yang, LOW_V, HIGH_V), "float64", 1.0 / RATE_HZ, LOW_V).run(u)
    r, p = np.array(yang.thresholds_V), np.array(yang.weights)
    alone = yang.a1 * u**3 + yang.a2 * u + np.maximum(u[:, None] - r, 0.0) @ p
    k, c, m = (float(polynomial(b, [300.0])[0]) for b in (yang.k, yang.c, yang.m))
    rate = (u[1] - u[0]) * RATE_HZ / (2.0 * np.pi * 300.0 * AMPLITUDE_V)
    np.testing.assert_allclose(y[50:], k * alone[50:] + c * rate**m, rtol=1e-6)


@pytest.mark.parametrize("hz", [10.0, 100.0, 733.0, 1500.0])
def test_found_on_line_is_nearly_as_good_as_given(hz: float) -> None:
    """Frequency and amplitude of 16-bit codes come from the turning points."""
    u = np.rint(sine(hz) / 200.0 * 65535.0) / 65535.0 * 200.0
    given = PUBLISHED.but(hz=hz, amplitude_V=AMPLITUDE_V)
    y = [
        predictor(yang_model(yang, LOW_V, HIGH_V), "float32", 1.0 / RATE_HZ, u[0]).run(u)
        for yang in (given, PUBLISHED)
    ]
    steady = slice(round(2.0 * RATE_HZ / hz), None)
    assert errors(y[0][steady], y[1][steady])[0] < 1.0


def test_quantised_velocity_does_not_blow_up() -> None:
    """12-bit codes at 100 kHz: a code step in one sample is 3000 V/s and more."""
    u = sine(10.0, 4, 1e5)
    yang = PUBLISHED.but(hz=10.0, amplitude_V=AMPLITUDE_V, c=(1.0,), velocity_tau_s=1e-3)
    model = yang_model(yang, LOW_V, HIGH_V)
    codes = LOW_V + np.rint((u - LOW_V) / 100.0 * 4095.0) * (100.0 / 4095.0)
    smooth, stepped = (predictor(model, "float64", 1e-5, LOW_V).run(v) for v in (u, codes))
    assert np.abs(stepped - smooth).max() < 0.06, "of a damping of 1 um"


def test_harmonics_are_eqs_15_and_16() -> None:
    t = np.linspace(0.0, 1.0, 2001)
    i = np.arange(1, 10)
    total = np.sin(2.0 * np.pi * t[:, None] * i) @ spectrum(9)
    triangle = 4.0 * np.abs(np.mod(t - 0.25, 1.0) - 0.5) - 1.0
    assert np.abs(total - triangle).max() < 0.05
    np.testing.assert_allclose(weights_of_harmonics(9).sum(), 1.0)
    np.testing.assert_array_equal(weights_of_harmonics(1), [1.0])


def test_every_field_comes_back_from_a_file(tmp_path: Path) -> None:
    yang = PUBLISHED.but(
        two_side=True, center_um=1.5, at_zero_um=-2.0, harmonics=9, hz=100.0, amplitude_V=50.0
    ).but(velocity_tau_s=1e-5, beta_s=1e-4)
    idle = Yang(yang.thresholds_V, yang.weights)
    assert all(getattr(yang, k) != v for k, v in vars(idle).items() if k not in TABLES)
    model = yang_model(yang, LOW_V, HIGH_V, {"source": "test"})
    model.save(tmp_path / "m.json")
    assert load_model(tmp_path / "m.json") == model


TABLES = ("thresholds_V", "weights")


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"thresholds_V": [2.0, 1.0]}, "2 thresholds_V and 10 weights"),
        ({"thresholds_V": [*range(9), 3.0]}, "must ascend"),
        ({"thresholds_V": [-1.0, *range(9)]}, "must ascend, from 0"),
        ({"weights": [1.0] * (PLAYS_MAX + 1)}, "at most 32 numbers"),
        ({"weights": [float("nan")] * 10}, "finite"),
        ({"k": None}, "k must be a list"),
        ({"m": [1.0] * 5}, "at most 4"),
        ({"harmonics": 10}, "harmonics = 10 must be 1 to 9"),
        ({"harmonics": 1.5}, "whole number"),
        ({"two_side": 1}, "true or false"),
        ({"hz": -1.0}, "hz = -1"),
    ],
)
def test_bad_parameters_are_refused(change: dict[str, object], match: str) -> None:
    data = yang_model(PUBLISHED, LOW_V, HIGH_V).to_json() | change
    with pytest.raises(InputError, match=match):
        model_from_json(data)


@pytest.mark.parametrize("m", [(0.0,), (-1.0,), (5.0,), (1.0, -1e-3)])
def test_a_power_out_of_range_is_refused_by_the_core(m: tuple[float, ...]) -> None:
    with pytest.raises(InputError, match=r"Yang et al\.: a parameter is out of its range"):
        Predictor(
            Model("madelung", LOW_V, HIGH_V, f0=(0.0,)),
            "float32",
            discretise(SignalPath(LOW_V, 100.0, (0.0,), yang=PUBLISHED.but(m=m)), 1e-4),
        )


# -- predict and export -----------------------------------------------------------------------


def test_predict_and_export_take_it(tmp_path: Path) -> None:
    model, data, out = (tmp_path / name for name in ("m.json", "r.csv", "out.csv"))
    yang_model(PUBLISHED, LOW_V, HIGH_V).save(model)
    write_record(data, record(PUBLISHED, 400.0))
    result = CliRunner().invoke(app, ["predict", str(model), str(data), "-o", str(out)])
    assert result.exit_code == 0, result.output
    assert "largest" in result.stdout and "turning points" not in result.stdout
    found = np.genfromtxt(out, delimiter=",", names=True)
    np.testing.assert_allclose(found["predicted_um"], found["y_um"], atol=5e-6)
    result = CliRunner().invoke(app, ["export", str(model), "-o", str(tmp_path / "fw")])
    assert result.exit_code == 0, result.output
    text = (tmp_path / "fw" / "mdl_params.c").read_text(encoding="utf-8")
    assert ".blocks = MDL_BLOCK_YANG" in text and ".yang = &yang" in text


def test_predict_says_where_it_extrapolates(tmp_path: Path) -> None:
    model, data = tmp_path / "m.json", tmp_path / "r.csv"
    yang_model(PUBLISHED.but(hz_max=300.0), LOW_V, HIGH_V).save(model)
    write_record(data, record(PUBLISHED, 400.0))
    args = ["predict", str(model), str(data), "-o", str(tmp_path / "out.csv")]
    result = CliRunner().invoke(app, args)
    assert "harmonics above 300 Hz: the model extrapolated" in result.stderr


def test_diagnose_refuses_it(tmp_path: Path) -> None:
    model = tmp_path / "m.json"
    yang_model(PUBLISHED, LOW_V, HIGH_V).save(model)
    args = ["diagnose", str(tmp_path), "-o", str(tmp_path / "out"), "--model", str(model)]
    refused = CliRunner().invoke(app, args)
    assert isinstance(refused.exception, InputError) and "kind yang2015" in str(refused.exception)


def test_exported_displacements_fit_the_dac() -> None:
    model = yang_model(PUBLISHED, LOW_V, HIGH_V)
    y = Predictor(model).run([LOW_V, HIGH_V])
    low, high = default_scaling(model).output_um
    assert low <= y[0] + 1e-6 and high >= y[1] - 1e-6
    assert params_source(model, default_scaling(model)).count("static const mdl_yang_params") == 1


# -- identification ---------------------------------------------------------------------------


@pytest.fixture(scope="module")
def own() -> YangIdentification:
    """From records that the published model itself has made, at 10 Hz eq. (4) alone."""
    plant = PUBLISHED.but(center_um=3.7)
    slow = record(PUBLISHED.rate_independent, 10.0, 1e-4)
    fast = [record(plant, hz, 1e-4) for hz in (1200.0, 400.0, 800.0, 150.0)]
    return identify_yang([fast[0], slow, *fast[1:]])


def test_its_own_parameters_are_found(own: YangIdentification) -> None:
    yang = own.model.yang
    assert yang is not None
    assert [round(r.sine.hz) for r in own.rates] == [10, 150, 400, 800, 1200]
    np.testing.assert_allclose(yang.weights[:7], PUBLISHED.weights[:7], atol=2e-4)
    for rate in own.rates[1:]:
        k, c, m = (
            polynomial(b, [rate.sine.hz])[0] for b in (PUBLISHED.k, PUBLISHED.c, PUBLISHED.m)
        )
        np.testing.assert_allclose(rate.value[:2], (k, c), atol=0.012)
        assert abs(rate.value[2] - m) < 0.05
        assert rate.e_max < 1.0
    assert yang.center_um == pytest.approx(3.7, abs=0.05)
    assert all(r.half_width[0] > 0.0 and r.half_width[0] < 0.02 for r in own.rates)


def test_m_is_left_out_where_the_damping_is_small(own: YangIdentification) -> None:
    assert [r.m_counts for r in own.rates] == [False, True, True, True, True]
    assert "10 Hz: " in summary(own)[2] and "left out" in summary(own)[2]


def test_operators_that_never_move_are_said_to_be_unseen(own: YangIdentification) -> None:
    """The threshold of p_10 is the largest input; that of p_9 is wider than the swing."""
    assert own.unseen == (9, 10)
    assert any("9, 10 of 10 do not move" in w and "cannot be seen" in w for w in own.warnings)
    yang = own.model.yang
    assert yang is not None and yang.weights[8:] == (0.0, 0.0)
    u = sine(10.0)
    heavy = yang.but(weights=(*yang.weights[:9], 1e3))
    with_p_10, without = (Predictor(yang_model(y, LOW_V, HIGH_V)).run(u) for y in (heavy, yang))
    np.testing.assert_array_equal(with_p_10, without)


def test_least_squares_is_the_optimum_of_the_swarms_loss(own: YangIdentification) -> None:
    assert own.loss["least squares"] < own.loss["swarm"] < 1e-3
    assert (own.swarm[:10] >= 0.0).all()


def test_identification_repeats_to_the_bit() -> None:
    records = [record(PUBLISHED, hz, 1e-3) for hz in (10.0, 300.0)]
    first, second = (identify_yang(records, operators=4) for _ in range(2))
    assert first.model.to_json() == second.model.to_json()
    assert first.model.yang is not None and len(first.model.yang.weights) == 4


def test_what_is_no_steady_sine_is_refused() -> None:
    good = record(PUBLISHED, 100.0)
    t = good.t_s
    triangle = LOW_V + 100.0 * (1.0 - np.abs(1.0 - 2.0 * np.mod(100.0 * t, 1.0)))
    chirp = 70.0 - 50.0 * np.cos(2.0 * np.pi * 100.0 * t * (1.0 + 5.0 * t))
    for bad, match in [
        (replace(good, u_V=triangle), "no sine"),
        (replace(good, u_V=chirp), "differ in length"),
        (record(PUBLISHED, 100.0, cycles=3), "whole cycles: record 4"),
        (replace(good, y=None), "no column y_um"),
    ]:
        with pytest.raises(InputError, match=match):
            sine_of(bad)
    with pytest.raises(InputError, match="no sound rows"):
        sine_of(good, from_s=1.0)
    with pytest.raises(InputError, match="use one unit"):
        identify_yang([good, replace(good, y_unit="V")])
    for wrong in ({"operators": 0}, {"operators": 33}, {"harmonics": 10}):
        with pytest.raises(InputError, match="are possible"):
            identify_yang([good], **wrong)


def test_command_identifies_and_draws(tmp_path: Path) -> None:
    paths = []
    for hz in (10.0, 200.0, 600.0):
        paths.append(tmp_path / f"{hz:g}.csv")
        write_record(paths[-1], record(PUBLISHED, hz, 1e-3))
    model, plot = tmp_path / "m.json", tmp_path / "p.png"
    args = ["identify", "--model", "yang2015", "--harmonics", "9", *map(str, paths)]
    result = CliRunner().invoke(app, [*args, "-o", str(model), "--plot", str(plot)])
    assert result.exit_code == 0, result.output
    assert "cannot be seen" in result.stderr and "600 Hz: k " in result.stdout
    yang = load_model(model).yang
    assert yang is not None and yang.harmonics == 9 and yang.hz_max == pytest.approx(600.0)
    assert len(yang.k) == 3 and len(yang.m) == 2, "no more coefficients than records"
    assert yang.center_um == pytest.approx(0.0, abs=0.1), "k scales all of it, as in the paper"
    assert plot.read_bytes()[:4] == b"\x89PNG"
    again = CliRunner().invoke(
        app, [*args, "-o", str(model), "--degree", "3"], catch_exceptions=True
    )
    assert isinstance(again.exception, InputError)


# -- the paper --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def found() -> YangReproduction:
    return reproduce_yang()


def row(found: YangReproduction, what: str) -> Row:
    (one,) = [r for r in found.rows if what in r.what and "all three models" not in r.what]
    return one


def test_nothing_that_can_be_compared_differs(found: YangReproduction) -> None:
    assert [r.what for r in found.rows if r.agrees is False] == []
    assert sum(bool(r.agrees) for r in found.rows) >= 15
    assert all(r.note for r in found.rows if r.agrees is None)


def test_published_parameters_are_those_of_the_tables(found: YangReproduction) -> None:
    """k and m beyond the band, by hand from Table 2."""
    assert row(found, "k and m at 4500 Hz").ours == "k = -14.1, m = 24.9"
    assert row(found, "thresholds r_i").ours.startswith("0.06 to 0.60")


def test_the_order_of_the_three_models_is_the_papers(found: YangReproduction) -> None:
    for hz in SINES_HZ[1:]:
        by = {name: found.sines[hz][name].error for name in NAMES}
        assert by["proposed"][1] < min(by[n][1] for n in NAMES[:2]), hz
    at_300 = found.sines[300.0]["rate-independent"].error
    assert 8.0 < at_300[0] < 15.0 and 5.0 < at_300[1] < 10.0, "near the paper's 11.1 and 7.2 %"
    worst = np.max([found.sines[hz]["proposed"].error for hz in SINES_HZ], axis=0)
    assert worst[0] < 6.5 and worst[1] < 3.0, "the paper's bounds"


def test_a_clamp_helps_where_the_polynomials_extrapolate(found: YangReproduction) -> None:
    by = found.triangles[500.0]
    assert by["clamped"].error[1] < 0.9 * by["literal"].error[1]
    for name in NAMES[:2]:
        assert by["clamped"].error[1] < 0.5 * by[name].error[1]
    low = found.triangles[100.0]
    assert low["literal"].error[1] == pytest.approx(low["clamped"].error[1], rel=0.02)


def test_linear_dynamics_behind_the_hysteresis_have_no_such_limit(found: YangReproduction) -> None:
    assert found.multisine["proposed"].error[1] > 10.0
    assert found.triangles[500.0]["clamped"].error[1] > 2.0
    for by in (found.multisine, *found.triangles.values()):
        assert by[LINEAR].error[0] < 1.0
    mode = found.path.modes[0]
    assert found.path.corner_hz == pytest.approx(EFFECTS.corner_hz, rel=0.03)
    assert mode.fn_hz == pytest.approx(EFFECTS.fn_hz, rel=0.01)


def test_table_and_figures_are_written(tmp_path: Path, found: YangReproduction) -> None:
    out = tmp_path / "out"
    write(out, found)
    names = {p.name for p in out.iterdir()}
    assert names == {f"{f}.png" for f in FIGURES} | {"table.md", "table.json"}
    told = json.loads((out / "table.json").read_text(encoding="utf-8"))
    assert told["paper"] == CITATION and [r["verdict"] for r in told["rows"]] == [
        verdict(r) for r in found.rows
    ]


def test_command_prints_every_row(
    tmp_path: Path, found: YangReproduction, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("madelung.reproduce_yang.reproduce_yang", lambda: found)
    result = CliRunner().invoke(app, ["reproduce", "yang2015"])
    assert result.exit_code == 0, result.output
    for r in found.rows:
        assert not r.note or r.note in result.stdout
    refused = CliRunner().invoke(app, ["reproduce", "yang2015", "--timing", "x"])
    assert isinstance(refused.exception, InputError)


def test_the_readme_shows_what_is_computed(found: YangReproduction) -> None:
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    for what, shown in [
        ("rate-independent at 300 Hz", "rate-independent model, 300 Hz"),
        ("dynamic thresholds at 1500 Hz", "dynamic thresholds, 1500 Hz"),
        ("proposed, 10 to 1500 Hz", "proposed, sines of 10 to 1500 Hz, at most"),
        ("triangle of 500 Hz, e_max", "proposed, triangle of 500 Hz, e_max"),
    ]:
        one = next(r for r in found.rows if what in r.what and r.where != "section 6")
        assert f"| {shown} | {one.paper.removeprefix('exceeds ')} | {one.ours} |" in readme
    for hz in (100, 250):
        clamped, _, _ = row(found, f"triangle of {hz} Hz").ours.partition(" held")
        assert f"triangle of {hz} Hz, e_max | {row(found, f'triangle of {hz} Hz').paper}" in readme
        assert f"| {clamped} |" in readme
    proposed, _, linear = row(found, "multisine of 10 to 500 Hz").ours.partition("; ")
    assert f"| {proposed.removeprefix('proposed ')} |" in readme
    assert f"| {linear.removeprefix(LINEAR + ' ')} |" in readme
