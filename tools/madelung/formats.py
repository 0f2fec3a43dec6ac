"""Records in other formats than CSV: MATLAB, HDF5, and, where installed, MDF and TDMS.

Columns are variables, datasets or channels named as in CSV (``t_s``, ``u_V``, ``y_um``, ...), at
the top of the file or together in one struct or group of it.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from madelung.errors import InputError
from madelung.records import is_column

Columns = dict[str, NDArray[Any]]
Tree = Mapping[str, Any]

CELLS_MAX = 200_000_000
"""Larger arrays are refused before they are read: a damaged header can promise anything."""


def read_other(path: Path) -> Columns | None:
    """The columns of a file of one of `READERS`; None when the suffix is none of theirs.

    Raises
    ------
    InputError
        The file cannot be read, is damaged, or holds no columns of one record.
    """
    suffix = path.suffix.lower()
    if suffix not in READERS:
        return None
    try:
        with path.open("rb"):
            pass
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about things in the file that no record needs
            tree = READERS[suffix](path)
    except InputError:
        raise
    except Exception as error:  # on damaged files these libraries raise whatever they run into
        reason = (str(error).strip() or type(error).__name__).splitlines()[0]
        raise InputError(
            f"{path}: cannot be read as {suffix}: it is damaged, or of another format "
            f"({reason:.200}): write it again, or as CSV"
        ) from error
    return _columns(path, tree)


def _columns(path: Path, tree: Tree) -> Columns:
    """The vectors of the first level of a file that holds columns of a record."""
    named = {name.replace("\N{MICRO SIGN}", "u").replace("μ", "u"): v for name, v in tree.items()}
    inner = [v for v in named.values() if isinstance(v, Mapping)]
    if not any(map(is_column, named)):
        holding = [v for v in inner if any(map(is_column, v))]
        if len(holding) > 1:
            raise InputError(
                f"{path}: {len(holding)} structs or groups hold columns of a record: "
                "keep one record in a file"
            )
        if holding:
            return _columns(path, holding[0])
    columns: Columns = {}
    for name, value in named.items():
        vector = np.squeeze(value) if isinstance(value, np.ndarray) else None
        if vector is not None and vector.ndim == 1 and vector.dtype.kind in "biuf":
            columns[name] = vector
        elif is_column(name):
            raise InputError(f"{path}: {name} is not a vector of two or more real numbers")
    sizes = {name: v.size for name, v in columns.items() if is_column(name)}
    if len(set(sizes.values())) > 1:
        said = ", ".join(f"{name} {size}" for name, size in sizes.items())
        raise InputError(f"{path}: columns differ in length ({said}): they must be of one record")
    rows = next(iter(sizes.values()), 0)
    return {name: v for name, v in columns.items() if v.size == rows or not rows}


def _check_size(path: Path, cells: int) -> None:
    if cells > CELLS_MAX:
        raise InputError(
            f"{path}: promises {cells} values, more than {CELLS_MAX}: it is damaged, or must be cut"
        )


def _read_mat(path: Path) -> Tree:
    """MATLAB files, v4 to v7 and v7.3 (which is HDF5)."""
    import h5py
    import scipy.io
    from pymatreader import read_mat

    if h5py.is_hdf5(path):
        with h5py.File(path, "r") as file:
            _check_hdf5(path, file)
    else:
        sizes = (np.prod(shape, dtype=object) for _, shape, _ in scipy.io.whosmat(path))
        _check_size(path, int(sum(sizes)))
    found: dict[str, Any] = read_mat(str(path))
    # Sorted: pymatreader goes through a set, whose order changes from run to run.
    return {name: found[name] for name in sorted(found) if not name.startswith("__")}


def _read_hdf5(path: Path) -> Tree:
    """Datasets, or the fields of a dataset of compound type."""
    import h5py

    def read(group: Any, deep: bool) -> dict[str, Any]:
        tree: dict[str, Any] = {}
        for name, item in group.items():
            if isinstance(item, h5py.Group):
                tree[name] = read(item, False) if deep else {}
            elif item.dtype.names:
                tree[name] = {field: item[field] for field in item.dtype.names}
            elif item.dtype.kind in "biufc" and item.shape is not None:
                tree[name] = np.asarray(item[()])
        return tree

    if not h5py.is_hdf5(path):
        raise InputError(
            f"{path}: is not an HDF5 file: it is damaged, or of another format: "
            "write it again, or as CSV"
        )
    with h5py.File(path, "r") as file:
        _check_hdf5(path, file)
        return read(file, True)


def _check_hdf5(path: Path, file: Any) -> None:
    cells: list[int] = []
    file.visititems(lambda _, item: cells.append(int(getattr(item, "size", 0) or 0)))
    _check_size(path, sum(cells))


def _read_mdf(path: Path) -> Tree:
    """Channels of an MDF file; their common time stamps are the time."""
    tree: dict[str, Any] = {}
    with _optional(path, "asammdf").MDF(str(path)) as file:
        for signal in file.iter_channels(skip_master=True):
            time = np.asarray(signal.timestamps, np.float64)
            if is_column(signal.name):
                if signal.name in tree or not np.array_equal(tree.setdefault("t_s", time), time):
                    raise InputError(
                        f"{path}: {signal.name} stands there twice or has its own time stamps: "
                        "give all channels of the record one time base"
                    )
                tree[signal.name] = signal.samples
    return tree


def _read_tdms(path: Path) -> Tree:
    """Channels of a TDMS file, and the waveform's time where there is no channel of time."""
    tree: dict[str, dict[str, Any]] = {}
    for group in _optional(path, "nptdms").TdmsFile.read(str(path)).groups():
        tree[group.name] = {channel.name: channel[:] for channel in group.channels()}
        timed = [
            c for c in group.channels() if is_column(c.name) and "wf_increment" in c.properties
        ]
        if timed and not {"t_s", "t_ms"} & tree[group.name].keys():
            tree[group.name]["t_s"] = timed[0].time_track()
    return tree


def _optional(path: Path, package: str) -> Any:
    try:
        return import_module(package)
    except ImportError as error:
        raise InputError(
            f"{path}: {path.suffix} files need the Python package {package}, which is not "
            "installed: install it, or export the record as CSV"
        ) from error


READERS: dict[str, Callable[[Path], Tree]] = {
    ".mat": _read_mat,
    **dict.fromkeys((".h5", ".hdf5"), _read_hdf5),
    **dict.fromkeys((".mf4", ".mdf"), _read_mdf),
    ".tdms": _read_tdms,
}
