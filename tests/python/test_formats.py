"""Records as .mat (v5, v7.3), .h5, .mf4 and .tdms, written by the formats' own libraries."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io
from typer.testing import CliRunner

from madelung import formats
from madelung.cli import app
from madelung.errors import InputError
from madelung.records import Record, read_record, write_record

N = 400
T = np.arange(N) * 0.01
U = 20.0 - 20.0 * np.cos(0.05 * np.arange(N))
Y = 0.1 * U + 0.002 * np.random.default_rng(0).normal(size=N)
GOOD: dict[str, Any] = {"t_s": T, "u_V": U, "y_um": Y}


def write_mat5(path: Path, columns: dict[str, Any]) -> None:
    scipy.io.savemat(path, columns)


def write_mat5_compressed(path: Path, columns: dict[str, Any]) -> None:
    scipy.io.savemat(path, columns, do_compression=True, oned_as="column")


def write_mat5_struct(path: Path, columns: dict[str, Any]) -> None:
    scipy.io.savemat(path, {"record": columns, "comment": "of a stage"})


def write_mat73(path: Path, columns: dict[str, Any], group: str = "/") -> None:
    """The layout that MATLAB gives `save -v7.3`: a vector (n, 1) is stored as (1, n)."""
    classes = {"f": b"double", "i": b"int32", "c": b"double"}
    with h5py.File(path, "w", userblock_size=512) as file:
        place = file.require_group(group)
        if group != "/":
            place.attrs["MATLAB_class"] = np.bytes_(b"struct")
        for name, values in columns.items():
            vector = np.atleast_2d(np.asarray(values))
            kind = vector.dtype.kind
            if kind == "c":  # real and imaginary part are fields of a compound type
                vector = vector.view([("real", "f8"), ("imag", "f8")])
            data = place.create_dataset(name, data=vector)
            data.attrs["MATLAB_class"] = np.bytes_(classes[kind])
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    with path.open("r+b") as raw:
        raw.write(head)


def write_mat73_struct(path: Path, columns: dict[str, Any]) -> None:
    write_mat73(path, columns, "record")


def write_h5(path: Path, columns: dict[str, Any]) -> None:
    with h5py.File(path, "w") as file:
        for name, values in columns.items():
            file[name] = values


def write_h5_group(path: Path, columns: dict[str, Any]) -> None:
    with h5py.File(path, "w") as file:
        file["about"] = "a stage"
        for name, values in columns.items():
            file.create_dataset(f"run/{name}", data=values, compression="gzip")


def write_h5_table(path: Path, columns: dict[str, Any]) -> None:
    table = np.zeros(N, [(name, "f8") for name in columns])
    for name, values in columns.items():
        table[name] = values
    with h5py.File(path, "w") as file:
        file["table"] = table


def write_mf4(path: Path, columns: dict[str, Any]) -> None:
    asammdf = pytest.importorskip("asammdf", reason="asammdf, an optional extra, is not installed")
    t = columns["t_s"]
    signals = [
        asammdf.Signal(samples=np.asarray(v), timestamps=t, name=name)
        for name, v in columns.items()
        if name != "t_s"
    ]
    with asammdf.MDF(version="4.10") as file:
        file.append(signals)
        file.save(path)


def write_tdms(path: Path, columns: dict[str, Any]) -> None:
    nptdms = pytest.importorskip("nptdms", reason="npTDMS, an optional extra, is not installed")
    with nptdms.TdmsWriter(str(path)) as file:
        file.write_segment(
            [nptdms.ChannelObject("run", name, np.asarray(v)) for name, v in columns.items()]
        )


WRITERS: dict[str, tuple[str, Callable[[Path, dict[str, Any]], None]]] = {
    "mat v5": (".mat", write_mat5),
    "mat v5 compressed": (".mat", write_mat5_compressed),
    "mat v5 struct": (".mat", write_mat5_struct),
    "mat v7.3": (".mat", write_mat73),
    "mat v7.3 struct": (".mat", write_mat73_struct),
    "h5": (".h5", write_h5),
    "h5 group": (".HDF5", write_h5_group),
    "h5 table": (".h5", write_h5_table),
    "mf4": (".mf4", write_mf4),
    "tdms": (".tdms", write_tdms),
}


@pytest.mark.parametrize("form", WRITERS)
def test_round_trip(tmp_path: Path, form: str) -> None:
    suffix, write = WRITERS[form]
    path = tmp_path / f"r{suffix}"
    write(path, {**GOOD, "u_meas_mV": 1e3 * U})
    record = read_record(path)
    assert record.name == str(path) and record.y_unit == "um"
    for name, values in (("t_s", T), ("u_V", U), ("y", Y)):
        np.testing.assert_array_equal(getattr(record, name), values)
    assert record.u_meas_V is not None
    np.testing.assert_allclose(record.u_meas_V, U)


def test_units_integers_and_extra_vectors(tmp_path: Path) -> None:
    path = tmp_path / "r.mat"
    t_ms = (10 * np.arange(N)).astype(np.int32)
    names = {"t_ms": t_ms, "u_V": U.astype(np.float32), "y_nm": 1e3 * Y}
    write_mat5(path, {**names, "code": np.arange(N), "gain": 3.0, "other": np.arange(7)})
    record = read_record(path)
    np.testing.assert_allclose(record.t_s, T)
    assert record.y is not None and set(record.extra) == {"code"}
    np.testing.assert_allclose(record.y, Y)


def test_time_of_a_tdms_waveform(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms", reason="npTDMS, an optional extra, is not installed")
    path = tmp_path / "r.tdms"
    timed = {"wf_increment": 0.01, "wf_start_offset": 0.0}
    with nptdms.TdmsWriter(str(path)) as file:
        channels = [
            nptdms.ChannelObject("run", name, values, properties=timed)
            for name, values in (("u_V", U), ("y_um", Y))
        ]
        file.write_segment(channels)
    np.testing.assert_allclose(read_record(path).t_s, T, atol=1e-9)


def changed(name: str, row: int, value: float) -> dict[str, Any]:
    values = np.array(GOOD[name])
    values[row] = value
    return {**GOOD, name: values}


def without(name: str) -> dict[str, Any]:
    return {k: v for k, v in GOOD.items() if k != name}


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "nan": (changed("u_V", 4, np.nan), "row 5: u_V is empty or not a number"),
    "infinite": (changed("y_um", 4, np.inf), "row 5: y_um reads 'inf'"),
    "huge": (changed("y_um", 4, 1e300), r"row 5: y_um reads '1e\+300'"),
    "back": (changed("t_s", 7, 0.01), "row 8: time runs back from 0.06 s to 0.01 s"),
    "still": ({**GOOD, "t_s": np.ones(N)}, "399 of 400 rows have the time of the row before"),
    "constant": ({**GOOD, "u_V": np.full(N, 5.0)}, "u_V is 5.0 in all rows"),
    "unit": ({**without("u_V"), "u_kV": U}, "bad[^ ]*: column 'u_kV': the unit 'kV' does not fit"),
    "no time": (without("t_s"), "no column t_s or t_ms; the names are 'u_V,y_um'"),
    "no input": (without("u_V"), "no column u_V or u_mV"),
    "two units": ({**GOOD, "u_mV": U}, "columns 'u_m?V' and 'u_m?V' both hold u"),
    "few rows": ({k: v[:9] for k, v in GOOD.items()}, "9 rows are too few"),
    "lengths": ({**GOOD, "y_um": Y[:-1]}, r"differ in length \(.*y_um 399.*\)"),
    "matrix": ({**GOOD, "y_um": np.ones((N, 2))}, "y_um is not a vector of two or more real"),
    "scalar": ({**GOOD, "u_V": np.array([5.0])}, "u_V is not a vector"),
    "complex": ({**GOOD, "u_V": U + 1j}, "u_V is not a vector"),
    "inputs": ({**GOOD, "u1_V": U, "u2_V": U}, "3 input columns"),
}


@pytest.mark.parametrize("form", ["mat v5", "mat v7.3", "h5"])
@pytest.mark.parametrize("case", REFUSED)
def test_refuses_in_one_sentence(tmp_path: Path, form: str, case: str) -> None:
    suffix, write = WRITERS[form]
    columns, reason = REFUSED[case]
    path = tmp_path / f"bad{suffix}"
    write(path, columns)
    with pytest.raises(InputError, match=reason) as refused:
        read_record(path)
    assert str(refused.value).startswith(f"{path}: ") and "\n" not in str(refused.value)


@pytest.mark.parametrize("suffix", sorted(formats.READERS))
@pytest.mark.parametrize("content", [b"", b"t_s,u_V\n0,1\n", bytes(range(256)) * 9])
def test_refuses_what_is_not_of_the_format(tmp_path: Path, suffix: str, content: bytes) -> None:
    path = tmp_path / f"bad{suffix}"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"damaged, or|need the Python package|no column"):
        read_record(path)


@pytest.mark.parametrize("form", ["mat v5", "mat v7.3", "h5"])
def test_refuses_a_truncated_file(tmp_path: Path, form: str) -> None:
    suffix, write = WRITERS[form]
    path = tmp_path / f"bad{suffix}"
    write(path, GOOD)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(InputError, match=f"{path.name}: cannot be read as {suffix}: it is"):
        read_record(path)


def test_junk_is_said_in_words_of_ours(tmp_path: Path) -> None:
    path = tmp_path / "junk.h5"
    path.write_bytes(b"junk" * 99)
    with pytest.raises(InputError, match=r"junk.h5: is not an HDF5 file: it is damaged, or of"):
        read_record(path)


def test_refuses_two_records_and_none_in_a_file(tmp_path: Path) -> None:
    path = tmp_path / "two.h5"
    with h5py.File(path, "w") as file:
        for group in "ab":
            for name, values in GOOD.items():
                file[f"{group}/{name}"] = values
    with pytest.raises(InputError, match="2 structs or groups hold columns"):
        read_record(path)
    path = tmp_path / "none.mat"
    scipy.io.savemat(path, {"x": "text"})
    with pytest.raises(InputError, match="no column t_s or t_ms; it holds no vector of numbers"):
        read_record(path)


@pytest.mark.parametrize("suffix", [".h5", ".mat"])
def test_refuses_a_promise_of_more_than_fits(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"huge{suffix}"
    with h5py.File(path, "w") as file:
        file.create_dataset("t_s", (10**12,), "f8", chunks=(1000,))
    with pytest.raises(InputError, match="promises 1000000000000 values"):
        read_record(path)


@pytest.mark.parametrize("suffix", sorted(formats.READERS))
def test_refuses_what_cannot_be_opened(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(InputError, match="No such file"):
        read_record(tmp_path / f"none{suffix}")
    (tmp_path / f"folder{suffix}").mkdir()
    with pytest.raises(InputError, match="Is a directory"):
        read_record(tmp_path / f"folder{suffix}")


@pytest.mark.parametrize("suffix", [".mf4", ".tdms"])
def test_a_missing_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    def absent(name: str) -> None:
        raise ModuleNotFoundError(name)

    monkeypatch.setattr(formats, "import_module", absent)
    (tmp_path / f"r{suffix}").write_bytes(b"x")
    with pytest.raises(InputError, match=f"{suffix} files need the Python package (asammdf|npt)"):
        read_record(tmp_path / f"r{suffix}")


def test_commands_take_them(tmp_path: Path) -> None:
    record, model, out = (tmp_path / name for name in ("r.mat", "m.json", "p.csv"))
    write_mat5(record, GOOD)
    for args in (
        ["identify", record, "-o", model, "--degree", "1"],
        ["predict", model, record, "-o", out],
    ):
        result = CliRunner().invoke(app, list(map(str, args)))
        assert result.exit_code == 0, result.output
    from_mat = model.read_bytes()
    write_record(tmp_path / "r.csv", Record("r", T, U, Y))
    args = ["identify", tmp_path / "r.csv", "-o", model, "--degree", "1"]
    assert CliRunner().invoke(app, list(map(str, args))).exit_code == 0
    assert len(from_mat) > 100 and read_record(out).t_s.size == N
