"""Records: what is read, what is reported, and what is refused in one sentence."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from madelung.errors import InputError
from madelung.records import Record, make_record, read_record, write_record

N = 400
T = np.arange(N) * 0.01
U = 20.0 - 20.0 * np.cos(0.05 * np.arange(N))
Y = 0.1 * U + 0.002 * np.random.default_rng(0).normal(size=N)
HEADER = "t_s,u_V,y_um"
ROWS = [f"{t:.6f},{u:.6f},{y:.6f}" for t, u, y in zip(T, U, Y, strict=True)]


def text(header: str = HEADER, rows: list[str] = ROWS, end: str = "\n") -> bytes:
    return (end.join([header, *rows]) + end).encode()


def with_row(line: int, row: str) -> bytes:
    """The good record with one line of the file (from 1) replaced."""
    rows = list(ROWS)
    rows[line - 2] = row
    return text(rows=rows)


def read(tmp_path: Path, content: bytes, name: str = "r.csv") -> Record:
    path = tmp_path / name
    path.write_bytes(content)
    return read_record(path)


@pytest.mark.parametrize(
    "content",
    [
        text(),
        b"\xef\xbb\xbf" + text(),
        text(end="\r\n"),
        text(end="\r"),
        text() + b"\n\n",
        text('"t_s", u_V ,y_um'),
        text("t_s,u_V,y_\N{MICRO SIGN}m"),
        text(rows=[r.replace(",", ", ") for r in ROWS]),
    ],
    ids=["plain", "bom", "crlf", "cr", "blank-end", "quoted", "micro", "spaces"],
)
def test_reads_what_programs_write(tmp_path: Path, content: bytes) -> None:
    record = read(tmp_path, content)
    np.testing.assert_allclose(record.t_s, T)
    np.testing.assert_allclose(record.u_V, U, atol=1e-6)
    assert record.y is not None and record.y_unit == "um" and not record.faults
    np.testing.assert_allclose(record.y, Y, atol=1e-6)
    assert record.step_s == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("header", "factors", "unit"),
    [
        ("t_ms,u_mV,y_nm", (1e-3, 1e-3, 1e-3), "um"),
        ("t_s,u_V,y_mm", (1.0, 1.0, 1e3), "um"),
        ("t_s,u_V,y_V", (1.0, 1.0, 1.0), "V"),
        ("t_s,u_V,y_deg", (1.0, 1.0, 1.0), "deg"),
    ],
)
def test_units_are_converted(
    tmp_path: Path, header: str, factors: tuple[float, float, float], unit: str
) -> None:
    record = read(tmp_path, text(header))
    np.testing.assert_allclose(record.t_s, T * factors[0], atol=1e-9)
    np.testing.assert_allclose(record.u_V, U * factors[1], atol=1e-6)
    assert record.y is not None and record.y_unit == unit
    np.testing.assert_allclose(record.y, Y * factors[2], atol=1e-6 * factors[2])


def test_extra_columns_are_kept_and_may_hold_anything(tmp_path: Path) -> None:
    rows = [f"{r},note {i},,{i}.5" for i, r in enumerate(ROWS)]
    record = read(tmp_path, text(HEADER + ",note,empty,u_meas_mV", rows))
    assert record.extra["note"][3] == "note 3" and set(record.extra) == {"note", "empty"}
    assert record.u_meas_V is not None and record.u_meas_V[2] == pytest.approx(2.5e-3)


TWO_RATES = [
    f"{min(i, 199) + 10 * max(i - 199, 0)}e-3,{r.partition(',')[2]}"
    for i, r in enumerate(ROWS[:399])
]
REFUSED: dict[str, tuple[bytes, str]] = {
    "nan": (with_row(6, "0.04,nan,1"), "row 6: u_V is empty or not a number"),
    "empty cell": (with_row(6, "0.04,,1"), "row 6: u_V is empty"),
    "short row": (with_row(6, "0.04"), "row 6: u_V is empty"),
    "blank row": (with_row(6, ""), "row 6: t_s is empty"),
    "infinite": (with_row(7, "0.05,1,inf"), "row 7: y_um reads 'inf'"),
    "overflow": (with_row(7, "0.05,1e999,1"), "row 7: u_V reads 'inf'"),
    "huge": (with_row(7, "0.05,1,1e300"), r"row 7: y_um reads '1e\+300'"),
    "text": (with_row(6, "0.04,oops,1"), "row 6: u_V reads 'oops'"),
    "comma quoted": (with_row(6, '0.04,"1,5",1'), "row 6: u_V reads '1,5'.*decimal point"),
    "long row": (with_row(6, "0.04,1,1,1"), "csv: row 6: more cells than the header"),
    "open quote": (with_row(6, '0.04,"1,1'), "csv: row 6: a quotation mark is opened and not"),
    "comma": (text(rows=[r.replace(".", ",") for r in ROWS]), "row 2: more cells"),
    "back": (with_row(9, "0.01,1,1"), "row 9: time runs back from 0.06 s to 0.01 s: sort"),
    "two rates": (text(rows=TWO_RATES), "row 201: the sample time changes from 0.001 s to 0.01 s"),
    "still": (text(rows=["1," + r.partition(",")[2] for r in ROWS]), "399 of 400 rows"),
    "semicolons": (text("t_s;u_V;y_um", [r.replace(",", ";") for r in ROWS]), "semicolons"),
    "tabs": (text("t_s\tu_V\ty_um", [r.replace(",", "\t") for r in ROWS]), "tabs"),
    "no time": (text("time,u_V,y_um"), "row 1: no column t_s or t_ms"),
    "no input": (text("t_s,voltage,y_um"), "row 1: no column u_V or u_mV"),
    "no header": (b"\n".join(text().split(b"\n")[1:]), "row 1: no header"),
    "unit": (text("t_s,u_kV,y_um"), "'u_kV': the unit 'kV' does not fit; .* u_V or u_mV"),
    "unit of y": (text("t_s,u_V,y_kg"), "'y_kg': the unit 'kg' does not fit"),
    "two units": (text("t_s,u_V,u_mV"), "columns 'u_V' and 'u_mV' both hold u"),
    "twice": (text("t_s,u_V,u_V"), "column 'u_V' stands there twice"),
    "three inputs": (text("t_s,u1_V,u2_V"), r"2 input columns \(u1_V, u2_V\): a predictor with"),
    "second input": (text("t_s,u_V,u2_V"), r"2 input columns \(u_V, u2_V\): a predictor with"),
    "constant u": (text(rows=[f"{t},5,{y}" for t, y in zip(T, Y, strict=True)]), "u_V is 5 in"),
    "constant y": (text(rows=[f"{t},{u},5" for t, u in zip(T, U, strict=True)]), "y_um is 5 in"),
    "header only": (text(rows=[]), "0 rows are too few"),
    "few rows": (text(rows=ROWS[:9]), "9 rows are too few: at least 10 are needed"),
    "empty": (b"", "row 1: no header"),
    "latin-1": (with_row(6, "0.04,1,\N{LATIN SMALL LETTER U WITH DIAERESIS}")
                .decode().encode("latin-1"), "row 6: is not UTF-8"),
    "utf-16": (text().decode().encode("utf-16"), "is not a text file"),
    "binary": (bytes(range(256)) * 9, "is not a text file"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_refuses_in_one_sentence_with_file_and_reason(tmp_path: Path, case: str) -> None:
    content, reason = REFUSED[case]
    with pytest.raises(InputError, match=reason) as refused:
        read(tmp_path, content, "bad.csv")
    assert str(refused.value).startswith(f"{tmp_path / 'bad.csv'}: ")


def test_refuses_what_cannot_be_opened(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="Is a directory"):
        read_record(tmp_path)
    with pytest.raises(InputError, match="No such file"):
        read_record(tmp_path / "none.csv")


def faults(change: Callable[[np.ndarray, np.ndarray, np.ndarray], None]) -> list[tuple]:
    t, u, y = T.copy(), U.copy(), Y.copy()
    change(t, u, y)
    record = make_record("r", {"t_s": t, "u_V": u, "y_um": y})
    return [(f.kind, f.first, f.last) for f in record.faults]


def test_gaps_duplicates_and_jitter_are_reported_not_refused() -> None:
    def gap(t: np.ndarray, u: np.ndarray, y: np.ndarray) -> None:
        t[100:] += 0.03

    def duplicate(t: np.ndarray, u: np.ndarray, y: np.ndarray) -> None:
        t[50] = t[49]
        t[51:] -= 0.01

    def jitter(t: np.ndarray, u: np.ndarray, y: np.ndarray) -> None:
        t[200] += 0.002

    def rounded(t: np.ndarray, u: np.ndarray, y: np.ndarray) -> None:
        t[:] = np.round(np.arange(N) * 1e-5 / 3.0, 6)

    assert faults(gap) == [("gap", 100, 100)]
    assert faults(duplicate) == [("duplicate", 50, 50)]
    assert faults(jitter) == [("jitter", 200, 201)]
    assert faults(rounded) == []


@pytest.mark.parametrize("share", [0.1, 0.3, 0.4])
def test_jitter_however_large_is_no_gap_and_moves_no_sample_of_the_grid(share: float) -> None:
    shaken = T + 0.01 * share * np.random.default_rng(1).uniform(-1.0, 1.0, N)
    record = make_record("r", {"t_s": shaken, "u_V": U, "y_um": Y})
    assert {f.kind for f in record.faults} == {"jitter"}
    assert record.places.tolist() == list(range(N))
    assert record.step_s == pytest.approx(0.01, rel=2.0 * share / N)


def test_a_gap_among_jitter_is_still_one() -> None:
    shaken = T + 0.001 * np.random.default_rng(1).uniform(-1.0, 1.0, N)
    shaken[100:] += 0.03
    record = make_record("r", {"t_s": shaken, "u_V": U, "y_um": Y})
    assert [f.first for f in record.faults if f.kind == "gap"] == [100]
    assert record.places.tolist() == [k if k < 100 else k + 3 for k in range(N)]


def test_stuck_and_clipped_values_are_found_backlash_and_dwell_are_not() -> None:
    def stuck(t: np.ndarray, u: np.ndarray, y: np.ndarray) -> None:
        y[30:41] = y[30]

    def clipped(t: np.ndarray, u: np.ndarray, y: np.ndarray) -> None:
        np.minimum(y, 3.5, out=y)

    def backlash(t: np.ndarray, u: np.ndarray, y: np.ndarray) -> None:
        turn = int(np.argmax(u[:100]))
        y[turn : turn + 12] = y[turn]

    def dwell(t: np.ndarray, u: np.ndarray, y: np.ndarray) -> None:
        u[200:230], y[200:230] = u[200], y[200]

    assert faults(stuck) == [("stuck", 30, 40)]
    over = [(k, f, bool((Y[f : last + 1] >= 3.5).all())) for k, f, last in faults(clipped)]
    assert [(k, ok) for k, _, ok in over] == [("clipped", True)] * 3
    assert faults(backlash) == []
    assert faults(dwell) == []


@pytest.mark.parametrize("row", [0, 1, 99, N - 1])
def test_a_single_value_many_strokes_away_is_an_outlier(row: int) -> None:
    def leap(t: np.ndarray, u: np.ndarray, y: np.ndarray) -> None:
        y[row] = 1e6

    def clipped_too(t: np.ndarray, u: np.ndarray, y: np.ndarray) -> None:
        np.minimum(y, 3.5, out=y)
        y[row] = 1e6

    assert faults(leap) == [("outlier", row, row)]
    assert {kind for kind, *_ in faults(clipped_too)} == {"outlier", "clipped"}


def test_what_the_command_or_noise_makes_is_no_outlier() -> None:
    rng = np.random.default_rng(3)

    def pulses(t: np.ndarray, u: np.ndarray, y: np.ndarray) -> None:
        u[:] = 40.0 * (np.arange(N) % 50 == 20)
        y[:] = 0.75 * np.roll(u, 1) + 0.01 * rng.standard_normal(N)

    def alternating(t: np.ndarray, u: np.ndarray, y: np.ndarray) -> None:
        y[:] = 100.0 * (-1.0) ** np.arange(N)

    def heavy_tails(t: np.ndarray, u: np.ndarray, y: np.ndarray) -> None:
        y[:] = rng.standard_t(4, N)

    for change in (pulses, alternating, heavy_tails):
        assert not [f for f in faults(change) if f[0] == "outlier"]


def ringing(n: int, per_period: float, decay: float) -> np.ndarray:
    k = np.arange(n)
    return np.round(1e3 * np.cos(2 * np.pi * k / per_period) * np.exp(-(k % 300) / decay))


def test_single_clipped_peaks_of_a_ringing_are_found_free_and_equal_peaks_are_not() -> None:
    u = np.repeat([0.0, 5.0], 600)
    t = np.arange(1200) * 1e-3

    def found(y: np.ndarray) -> list[tuple[str, int, int]]:
        return [(f.kind, f.first, f.last) for f in make_record("r", columns(t, u, y)).faults]

    def columns(t: np.ndarray, u: np.ndarray, y: np.ndarray) -> dict[str, np.ndarray]:
        return {"t_s": t, "u_V": u, "y_um": y}

    free = ringing(1200, 4.7, 60.0)
    for sign in (1.0, -1.0):
        cut = np.minimum(free, 700.0)
        rows = [row for k, first, last in found(sign * cut) for row in range(first, last + 1)]
        assert {k for k, *_ in found(sign * cut)} == {"clipped"}
        assert len(rows) >= 8 and (cut[rows] == 700.0).all()
    assert found(free) == []
    assert found(ringing(1200, 5.03, np.inf)) == []  # many peaks near its largest value
    assert found(ringing(1200, 5.0, np.inf)) == []  # all its periods are equal


def test_plateaus_and_a_drive_that_clips_are_no_clipped_peaks() -> None:
    rng = np.random.default_rng(5)
    levels = np.repeat([100.0, 20.0, 100.0, 45.0, 100.0, 10.0, 100.0, 60.0, 100.0, 30.0], 200)
    jumps = rng.uniform(0.0, 120.0, 2000)
    for u, top in ((levels, 200.0), (jumps, 90.0)):
        y = np.round(40.0 * np.minimum(u, top) + 0.1 * rng.standard_normal(u.size))
        record = make_record("r", {"t_s": np.arange(u.size) * 1e-3, "u_V": u, "y_um": y})
        assert not [f for f in record.faults if f.kind == "clipped" and f.last - f.first < 4]


def test_faulty_rows_are_not_sound_and_are_named_by_file_line() -> None:
    y = Y.copy()
    y[30:41] = y[30]
    record = make_record("r.csv", {"t_s": T, "u_V": U, "y_um": y})
    assert np.flatnonzero(~record.sound).tolist() == list(range(30, 41))
    (said,) = record.warnings()
    assert said.startswith("r.csv: rows in which y is stuck") and "11" in said and "row 32" in said


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    record = Record("x", T, U / 3.0, Y / 7.0, u_meas_V=U / 9.0, extra={"i": np.arange(N)})
    path = tmp_path / "out.csv"
    write_record(path, record)
    again = read_record(path)
    for one, two in ((record.t_s, again.t_s), (record.u_V, again.u_V), (record.y, again.y)):
        np.testing.assert_allclose(one, two, atol=5.1e-10)
    assert again.extra["i"][-1] == N - 1 and again.u_meas_V is not None
    assert [p.name for p in tmp_path.iterdir()] == ["out.csv"]


def test_writing_into_no_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        write_record(tmp_path / "none" / "out.csv", Record("x", T, U))
