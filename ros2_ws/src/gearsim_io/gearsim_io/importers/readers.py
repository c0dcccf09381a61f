"""One reader per file format; each only says what is in the file."""

from __future__ import annotations

import gzip
import io
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_io.importers.content import Content, reads
from gearsim_io.importers.times import rate_of_times

_HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"
_DELIMITERS = (";", "\t", ",")


@reads(".mat")
def read_matlab(path: Path) -> Content:
    """MATLAB files of version 5 (scipy) and 7.3 (HDF5 inside)."""
    with open(path, "rb") as stream:
        head = stream.read(520)
    if head[512:520] == _HDF5_MAGIC or head[:8] == _HDF5_MAGIC:
        return read_hdf5(path)
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadWarning

    content = Content()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", MatReadWarning)
        variables = loadmat(path, squeeze_me=True, struct_as_record=False)
    for name, value in variables.items():
        if not name.startswith("__"):
            _add_matlab(content, name, value)
    for warning in caught:
        match = re.search(r'Duplicate variable name "(\w+)"', str(warning.message))
        if match:
            content.notes[f"variable {match[1]}"] = "occurs several times, the last was taken"
    return content


def _add_matlab(content: Content, name: str, value: Any) -> None:
    fields = getattr(value, "_fieldnames", None)
    if fields is None:
        content.add(name, value)
        return
    for inner in fields:
        _add_matlab(content, f"{name}.{inner}", getattr(value, inner))


@reads(".h5", ".hdf5")
def read_hdf5(path: Path) -> Content:
    """HDF5: every data set under its path with dots, every attribute as `path.attribute`."""
    import h5py

    content = Content()

    def visit(name: str, node: Any) -> None:
        dotted = name.replace("/", ".")
        is_text = node.attrs.get("MATLAB_class") in (b"char", "char")
        if isinstance(node, h5py.Dataset) and not name.startswith("#"):
            if is_text:
                content.add(dotted, "".join(chr(code) for code in np.ravel(node[()])))
            elif node.dtype.kind in "biufOS":
                content.add(dotted, node[()])
        for key, value in node.attrs.items():
            if not key.startswith("MATLAB_"):
                content.add(f"{dotted}.{key}", value)

    with h5py.File(path, "r") as file:
        for key, value in file.attrs.items():
            content.add(key, value)
        file.visititems(visit)
    return content


@reads(".npy")
def read_npy(path: Path) -> Content:
    """One numpy array, called `data`."""
    content = Content()
    content.add("data", np.load(path, allow_pickle=False))
    return content


@reads(".npz")
def read_npz(path: Path) -> Content:
    """Named numpy arrays."""
    content = Content()
    with np.load(path, allow_pickle=False) as arrays:
        for name in arrays.files:
            content.add(name, arrays[name])
    return content


@reads(".wav", ".flac")
def read_audio(path: Path) -> Content:
    """Audio files; integer formats are scaled to full scale = 1. Channels are `1`, `2` ..."""
    import soundfile

    data, rate_hz = soundfile.read(path, dtype="float64", always_2d=True)
    content = Content(rates_hz={"header": float(rate_hz)})
    for k in range(data.shape[1]):
        content.arrays[str(k + 1)] = data[:, k]
    return content


@reads(".uff", ".unv", ".u58")
def read_uff(path: Path) -> Content:
    """Universal file format: every data set 58 over time, called by its first line or `set1`, `set2` ..."""
    import pyuff

    file = pyuff.UFF(str(path))
    content = Content()
    for number, kind in enumerate(file.get_set_types()):
        if kind != 58:
            continue
        data_set = file.read_sets(number)
        data = np.asarray(data_set["data"])
        if data_set.get("abscissa_spec_data_type") not in (17, 0, None) or np.iscomplexobj(data):
            continue  # not over time
        given = str(data_set.get("id1", "")).strip()
        name = given if given and given.upper() != "NONE" and given not in content.arrays else ""
        name = name or f"set{number + 1}"
        content.arrays[name] = data
        step_s = float(data_set.get("abscissa_inc", 0.0))
        if step_s > 0:
            content.rates_hz[f"{name}: abscissa increment"] = 1.0 / step_s
        elif "x" in data_set:
            content.rates_hz[f"{name}: abscissa"] = rate_of_times(str(path), name, data_set["x"])
        unit = str(data_set.get("ordinate_axis_units_lab", "")).strip()
        if unit and unit.upper() != "NONE":
            content.units[name] = unit
    if not content.arrays:
        raise InputError(str(path), "data set 58", "none over time", "at least one")
    return content


@reads(".csv", ".csv.gz", ".txt", ".txt.gz", ".tsv")
def read_text(path: Path) -> Content:
    """Columns of numbers, with or without a line of names; without, they are `1`, `2` ..."""
    text = _text_of(path)
    lines = [line for line in text.splitlines()[:20] if line.strip() and not line.startswith("#")]
    if not lines:
        raise InputError(str(path), "", "no lines", "columns of numbers")
    delimiter = next(
        (mark for mark in _DELIMITERS if 2 * sum(mark in line for line in lines) >= len(lines)), None
    )
    rows = "".join(lines[1:])
    decimal_comma = delimiter in (";", "\t") and "," in rows and "." not in rows
    first = _cells(lines[0], delimiter)
    has_names = not all(_is_number(cell, decimal_comma) for cell in first)
    table = _table(path, text, delimiter, decimal_comma, skip=1 if has_names else 0)
    names = first if has_names else [str(k + 1) for k in range(table.shape[1])]
    if len(names) != table.shape[1]:
        raise InputError(
            str(path), "line 1", f"{len(names)} names", f"one for each of {table.shape[1]} columns"
        )
    if len(set(names)) != len(names):
        raise InputError(str(path), "line 1", ", ".join(names), "a name for each column, no name twice")
    return Content(arrays={name: table[:, k] for k, name in enumerate(names)})


def _text_of(path: Path) -> str:
    raw = path.read_bytes()
    if path.name.lower().endswith(".gz"):
        raw = gzip.decompress(raw)
    return raw.decode("utf-8-sig")


def _cells(line: str, delimiter: str | None) -> list[str]:
    return [cell.strip().strip('"') for cell in line.split(delimiter)]


def _is_number(cell: str, decimal_comma: bool) -> bool:
    try:
        float(cell.replace(",", ".") if decimal_comma else cell)
    except ValueError:
        return cell == ""
    return True


def _table(
    path: Path, text: str, delimiter: str | None, decimal_comma: bool, skip: int
) -> NDArray[np.float64]:
    if decimal_comma:
        text = text.replace(",", ".")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # on a table without rows; told below
        try:
            table = np.loadtxt(io.StringIO(text), delimiter=delimiter, skiprows=skip, ndmin=2)
        except ValueError:
            table = np.empty((0, 0))
    return table if table.size else _slow_table(path, text, delimiter, skip)


def _slow_table(path: Path, text: str, delimiter: str | None, skip: int) -> NDArray[np.float64]:
    """Read again line by line, to name the first cell that is wrong; an empty cell is a missing value."""
    rows: list[list[float]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if number <= skip or not line.strip() or line.startswith("#"):
            continue
        cells = _cells(line, delimiter)
        if rows and len(cells) != len(rows[0]):
            raise InputError(
                str(path), f"line {number}", f"{len(cells)} columns", f"{len(rows[0])} as before"
            )
        try:
            rows.append([float(cell) if cell else float("nan") for cell in cells])
        except ValueError:
            wrong = next(cell for cell in cells if not _is_number(cell, decimal_comma=False))
            raise InputError(str(path), f"line {number}", wrong, "a number") from None
    if not rows:
        raise InputError(str(path), "", "no lines of numbers", "columns of numbers")
    return np.asarray(rows, dtype=np.float64)
