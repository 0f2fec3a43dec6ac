"""Identification: f0 from loops, its degree, its uncertainty, and what is warned of."""

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.signal import lfilter
from typer.testing import CliRunner

from madelung.cli import app
from madelung.core import Predictor
from madelung.errors import InputError
from madelung.identify import identify, reproduce
from madelung.model import Model, load_model
from madelung.records import Record, make_record, write_record

PAPER = (0.58517, 0.086444, 0.0011949, -6.1876e-06)
"""Cao & Li 2019, eq. (20)."""
MODEL = Model("madelung", 0.0, 40.0, f0=PAPER)


def triangle(cycles: float, rows_per_cycle: int = 400, low: float = 0.0, high: float = 40.0):
    phase = np.arange(int(cycles * rows_per_cycle) + 1) / rows_per_cycle
    return low + (high - low) * (1.0 - np.abs(1.0 - 2.0 * np.mod(phase, 1.0)))


def measured(
    u: np.ndarray, noise: float = 0.0, ar: float = 0.0, seed: int = 0, model: Model = MODEL
) -> Record:
    y = Predictor(model, "float64").run(u)
    e = np.random.default_rng(seed).normal(size=u.size + 500) * noise
    e = lfilter([np.sqrt(1.0 - ar**2)], [1.0, -ar], e)[500:]
    return make_record("r", {"t_s": np.arange(u.size) * 0.01, "u_V": u, "y_um": y + e})


def curve_error(f0: tuple[float, ...], of: tuple[float, ...] = PAPER, range_V: float = 40.0):
    x = np.linspace(0.0, range_V, 201)
    return float(np.abs(Polynomial(f0)(x) - Polynomial(of)(x)).max())


@pytest.mark.parametrize("degree", [3, 5, 7])
@pytest.mark.parametrize(("low", "high"), [(0.0, 40.0), (-20.0, 130.0), (0.0, 0.5)])
def test_without_noise_f0_comes_back(degree: int, low: float, high: float) -> None:
    scale = 40.0 / (high - low)
    f0 = tuple(c * scale**k for k, c in enumerate(PAPER))
    model = Model("madelung", low, high, f0=f0)
    record = measured(triangle(2, low=low, high=high), model=model)
    found = identify([record], degree)
    assert curve_error(found.model.f0, f0, high - low) < 1e-9
    assert (found.model.u_min_V, found.model.u_max_V) == (low, high)
    assert found.warnings == ()


def test_it_is_the_fit_of_the_papers_reproduced_data() -> None:
    """Fig. 5 literally, with S of the fitted curve, is the same least squares."""
    u = triangle(2)
    found = identify([measured(u, 0.02)], 3)
    ends = Polynomial(found.model.f0)(0.0) + Polynomial(found.model.f0)(40.0)
    x_t, y_t = reproduce(found.x_V, found.y, found.rising, 40.0, ends)
    np.testing.assert_allclose(found.mapped, (x_t, y_t))
    assert x_t[~found.rising] == pytest.approx(40.0 - found.x_V[~found.rising])
    f0 = Polynomial(found.model.f0)
    expected = np.where(found.rising, 1.0, -1.0) * (found.y - found.fitted)
    np.testing.assert_allclose(y_t - f0(x_t), expected, atol=1e-9)
    literal = Polynomial.fit(x_t, y_t, 3).convert().coef
    assert curve_error(tuple(literal), found.model.f0) < 0.005
    assert curve_error(found.model.f0) < 0.01


def test_the_papers_example_1_comes_back() -> None:
    """Simulation Example 1: f0 = x^2 on [0, 1] under a sine, noisy; a degree of 2 is fitted."""
    model = Model("madelung", 0.0, 1.0, f0=(0.0, 0.0, 1.0))
    u = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(2001) / 500)
    found = identify([measured(u, 0.01, model=model)], 2)
    np.testing.assert_allclose(found.model.f0, (0.0, 0.0, 1.0), atol=0.006)


def test_degree_is_found_by_cross_validation() -> None:
    chosen = [
        identify([measured(triangle(4), 0.02, seed=s)]).model.extra["degree"] for s in range(10)
    ]
    assert chosen.count(3) >= 8 and min(chosen) >= 3
    line = Model("madelung", 0.0, 40.0, f0=(1.0, 0.5))
    assert identify([measured(triangle(4), 0.02, model=line)]).model.extra["degree"] == 1


@pytest.mark.parametrize(("cycles", "ar"), [(1, 0.0), (2, 0.0), (4, 0.0), (4, 0.9), (10, 0.9)])
def test_covariance_is_the_spread_of_repeated_identifications(cycles: int, ar: float) -> None:
    found = [identify([measured(triangle(cycles), 0.02, ar, s)], 3).model for s in range(60)]
    spread = np.std([m.f0 for m in found], axis=0)
    said = np.sqrt(np.mean([np.diag(m.extra["covariance"]) for m in found], axis=0))
    assert (said > 0.7 * spread).all() and (said < 1.6 * spread).all()


def test_noise_is_that_of_the_cycles_whatever_the_fit_leaves() -> None:
    for degree in (1, 3):
        noise = identify([measured(triangle(4), 0.02)], degree).noise
        assert noise.sigma == pytest.approx(0.02, rel=0.1)
        assert noise.source == "cycle-to-cycle differences"
    assert identify([measured(triangle(1), 0.02)], 3).noise.source == "residuals"


def test_several_records_are_averaged() -> None:
    records = [measured(triangle(2), 0.05, seed=s) for s in range(8)]
    together = identify(records, 3)
    alone = identify(records[:1], 3)
    assert together.model.extra["half_loops"] == 32
    ratio = np.sqrt(np.diag(together.model.extra["covariance"])) / np.sqrt(
        np.diag(alone.model.extra["covariance"])
    )
    assert (ratio < 0.5).all()


def nested() -> np.ndarray:
    """Both ends are reached, with inner loops on the way up and down."""
    corners = [0.0, 25.0, 10.0, 40.0, 15.0, 22.0, 18.0, 30.0, 0.0, 40.0, 0.0]
    parts = [np.linspace(a, b, 200)[1:] for a, b in pairwise(corners)]
    return np.concatenate(([0.0], *parts))


def test_outermost_loops_are_taken_from_any_record() -> None:
    found = identify([measured(nested())], 3)
    assert curve_error(found.model.f0) < 1e-9
    assert len(found.warnings) == 1 and "not monotone" in found.warnings[0]
    # Inner loops of another shape than f0 dictates must not bend f0.
    bent = measured(nested())
    assert bent.y is not None
    inner = np.zeros(bent.u_V.size, np.bool_)
    inner[205:390] = inner[805:1400] = True
    bent.y[inner] += 0.5
    assert curve_error(identify([bent], 3).model.f0) < 0.02


def test_a_record_in_mid_motion_loses_its_first_full_swing() -> None:
    u = np.concatenate((np.linspace(20.0, 40.0, 200), triangle(3.5)[200:]))
    record = measured(u)
    assert record.y is not None
    record.y[:400] += np.linspace(-3.0, 0.0, 400)
    found = identify([record], 3)
    assert curve_error(found.model.f0) < 1e-9 and found.model.extra["half_loops"] == 5


def test_time_window_and_small_swings_short_of_the_ends() -> None:
    u = np.concatenate((triangle(2), triangle(2, high=39.5)))
    record = measured(u)
    assert record.y is not None
    record.y[:400] += 1.0
    found = identify([record], 3, from_s=4.0)
    assert curve_error(found.model.f0) < 1e-9


def test_noisy_command_is_followed() -> None:
    u = triangle(4, 4000) + np.random.default_rng(3).normal(size=16001) * 0.05
    found = identify([measured(u, 0.01)], 3)
    assert any("u is noisy" in w for w in found.warnings)
    low = found.model.u_min_V
    assert curve_error(found.model.f0, tuple(Polynomial(PAPER)(Polynomial([low, 1.0])).coef)) < 0.02


def warned(record: Record, **options: float) -> str:
    return " | ".join(identify([record], 3, **options).warnings)


def test_asymmetry_is_measured_and_warned_of() -> None:
    record = measured(triangle(3), 0.005)
    assert record.y is not None
    bump = 0.2 * np.sin(np.pi * record.u_V / 40.0)
    rising = np.append(np.diff(record.u_V) > 0, False)
    record.y[rising] += bump[rising]
    found = identify([record])
    assert "not centrally symmetric" in found.warnings[-1]
    # The centre of symmetry is fitted too: it takes up the mean of the bump, 0.4 / pi.
    assert np.ptp(found.asymmetry) == pytest.approx(0.2, rel=0.05)
    assert found.model.extra["asymmetry_max_um"] == pytest.approx(0.4 / np.pi, rel=0.05)
    assert warned(measured(triangle(3), 0.005)) == ""


def test_faults_of_the_record_are_warned_of() -> None:
    assert "0 to 40 V of the range 0 to 42 V" in warned(measured(triangle(2)), u_max_V=42.0)
    assert "only rising" in warned(measured(triangle(0.5)))
    flat = np.clip(triangle(2, high=44.0), 0.0, 40.0)
    assert "highest value 40 V" in warned(measured(flat))
    clipped = measured(triangle(2), 0.002)
    assert clipped.y is not None
    y = np.minimum(clipped.y, 4.5)
    record = make_record("r", {"t_s": clipped.t_s, "u_V": clipped.u_V, "y_um": y})
    found = identify([record], 3)
    assert any("y is clipped" in w for w in found.warnings)
    assert curve_error(found.model.f0) < 0.01
    lagging = measured(triangle(3))
    assert lagging.y is not None
    lagging.y[20:] = lagging.y[:-20]
    assert "f0 runs back" in " ".join(identify([lagging], 7).warnings)
    reversed_ = measured(triangle(3))
    assert reversed_.y is not None
    mirrored = replace(reversed_, y=-reversed_.y)
    assert "sign reversed" in " ".join(identify([mirrored], 3).warnings)


def refused(records: list[Record], match: str, **options: float | int) -> None:
    with pytest.raises(InputError, match=match):
        identify(records, **options)  # type: ignore[arg-type]


def test_what_cannot_be_identified_is_refused() -> None:
    good = measured(triangle(2))
    refused([Record("r.csv", good.t_s, good.u_V)], "r.csv: no column y_um")
    refused([good, Record("v", good.t_s, good.u_V, good.y, "V")], "V and um: use one unit")
    refused([good], "the records reach 0 to 40 V of the range 0 to 80 V: 50 % off", u_max_V=80.0)
    refused([good], "must be above", u_max_V=-1.0)
    refused([good], "the degree is 8: 0 to 7", degree=8)
    refused([good], "no full swing between 0 V and 40 V", from_s=1e6)
    few = np.tile(np.repeat([0.0, 20.0, 40.0, 20.0], 20), 3)
    few[1::2] += 0.1
    refused([measured(few)], "too few different voltages; use a lower --degree", degree=7)


@pytest.mark.parametrize("start_V", [0.0, 10.0])
def test_jumps_are_no_slow_loop(start_V: float, recwarn: pytest.WarningsRecorder) -> None:
    levels = np.repeat([start_V, 10.0, 38.0, 5.0, 30.0, 2.0, 12.0], 500)
    u = np.convolve(np.append([start_V] * 3, levels), np.full(4, 0.25), "valid")
    refused([measured(u)], "full swings, these are jumps: record a slow triangle or sine")
    assert not recwarn.list


def run(*args: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, ["identify", *map(str, args)], standalone_mode=False)
    return (2 if result.exception else result.exit_code), result.stdout, str(result.exception)


def test_command_writes_the_contracts_model_and_pictures(tmp_path: Path) -> None:
    record, model, plot = tmp_path / "r.csv", tmp_path / "m.json", tmp_path / "p.png"
    write_record(record, measured(triangle(3), 0.01))
    code, out, _ = run(record, "-o", model, "--degree", 3, "--plot", plot)
    assert code == 0 and "% of the stroke" in out
    data = json.loads(model.read_text(encoding="utf-8"))
    assert data["schema"] == "madelung.model/1" and data["kind"] == "madelung"
    assert len(data["f0"]) == 4 and np.shape(data["covariance"]) == (4, 4)
    assert data["noise_correlation_rows"] > 0.0
    assert data["records"] == ["r.csv"] and curve_error(tuple(data["f0"])) < 0.01
    assert load_model(model).range_V == 40.0
    assert plot.read_bytes()[:4] == b"\x89PNG"
    first = model.read_bytes(), plot.read_bytes()
    run(record, "-o", model, "--degree", 3, "--plot", plot)
    assert (model.read_bytes(), plot.read_bytes()) == first


def test_command_writes_an_interactive_page(tmp_path: Path) -> None:
    record, model, page = tmp_path / "r.csv", tmp_path / "m.json", tmp_path / "p.html"
    write_record(record, measured(triangle(3), 0.01))
    assert run(record, "-o", model, "--html", page)[0] == 0
    text = page.read_text(encoding="utf-8")
    assert text.rstrip().endswith("</html>") and "Plotly.newPlot" in text
    assert 'src="http' not in text, "it needs no network"
    for name in ("Major loop", "What the fit leaves", "measured", "rising", "asymmetry"):
        assert name in text[-200_000:]
    first = page.read_bytes()
    run(record, "-o", model, "--html", page)
    assert page.read_bytes() == first


def test_command_refuses_and_leaves_nothing(tmp_path: Path) -> None:
    record = tmp_path / "r.csv"
    write_record(record, measured(triangle(3), 0.01))
    out = tmp_path / "m.json"
    for args, match in [
        ((record, "-o", out, "--degree", "x"), "--degree is 'x'"),
        ((record, "-o", out, "--degree", "-1"), "--degree is '-1'"),
        ((record, "-o", out, "--model", "yang2015"), "2 whole cycles: record 4 or more"),
        ((record, "-o", out, "--from", 5, "--to", 2), "must be after"),
        ((record, "-o", out, "--from", "nan"), "--from is not a number"),
        ((record, "-o", out, "--plot", tmp_path / "p.gif"), "PNG"),
        ((record, "-o", out, "--html", tmp_path / "p.txt"), "HTML"),
        ((record, "-o", tmp_path / "none" / "m.json"), "cannot be written"),
        ((tmp_path / "none.csv", "-o", out), "none.csv: cannot be read"),
        ((), "Missing"),
    ]:
        code, _, error = run(*args)
        assert code == 2 and match in error, (args, error)
    assert [p.name for p in tmp_path.iterdir()] == ["r.csv"]
