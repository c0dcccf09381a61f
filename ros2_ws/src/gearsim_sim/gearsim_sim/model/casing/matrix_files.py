"""Sparse matrices from files that finite-element programs write."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse
from scipy.sparse import csc_array

from gearsim_io.errors import EnvironmentLackError, InputError
from gearsim_sim.model.casing.shell import Cells

FORMATS = ".npz (scipy.sparse.save_npz), .mtx (Matrix Market), .op4 (Nastran OUTPUT4), .pch (DMIG punch)"


class Labelled:
    """A matrix, and where the file tells it the grid point and component of each row."""

    def __init__(self, matrix: csc_array, labels: Cells | None = None) -> None:
        self.matrix = matrix
        self.labels = labels
        """Shape (rows, 2): grid point and component 1 to 6; None if the file knows rows only."""


def read_matrix(path: Path, name: str = "") -> Labelled:
    """Read a square or rectangular matrix.

    Parameters
    ----------
    path : Path
        Its suffix tells the format, see `FORMATS`.
    name : str
        Which matrix of an .op4 or .pch file; may be left out where the file has but one.

    Raises
    ------
    InputError
        If the file is missing, unreadable, of another format, or holds no matrix of that name.
    EnvironmentLackError
        If the library that reads Nastran's formats is not installed.
    """
    readers: dict[str, Callable[[Path, str], Labelled]] = {
        ".npz": _scipy,
        ".mtx": _market,
        ".op4": _op4,
        ".pch": _punch,
    }
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise InputError(str(path), "", path.suffix or "no suffix", f"one of {FORMATS}")
    if not path.is_file():
        raise InputError(str(path), "", "no such file", f"one of {FORMATS}")
    try:
        found = reader(path, name)
    except (InputError, EnvironmentLackError):
        raise
    except Exception as error:  # the readers raise whatever they stumble over
        what = f"{type(error).__name__}: {error}"
        raise InputError(str(path), "", what, f"a {path.suffix} matrix") from None
    if not np.isfinite(found.matrix.data).all():
        raise InputError(str(path), "", "numbers that are not finite", "finite numbers")
    return found


def _sparse(matrix: Any) -> csc_array:
    entries = scipy.sparse.coo_array(matrix)
    if np.iscomplexobj(entries.data):
        raise ValueError("complex numbers")
    return csc_array(entries, dtype=np.float64)


def _scipy(path: Path, _name: str) -> Labelled:
    return Labelled(_sparse(scipy.sparse.load_npz(path)))


def _market(path: Path, _name: str) -> Labelled:
    return Labelled(_sparse(scipy.io.mmread(path)))


def _nastran(module: str) -> Any:
    """A module of pyyeti, which is loaded only for Nastran's formats."""
    from importlib import import_module

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return import_module(f"pyyeti.nastran.{module}")
    except ImportError:
        lack = "pyyeti is not installed, which reads Nastran's matrix files"
        raise EnvironmentLackError(lack, "pip install pyyeti") from None


def _op4(path: Path, name: str) -> Labelled:
    matrices = _nastran("op4").read(str(path), sparse=True)
    return Labelled(_sparse(_chosen(matrices, name, path)))


def _punch(path: Path, name: str) -> Labelled:
    table = _chosen(_nastran("bulk").rddmig(str(path)), name, path)
    labels = np.array([list(label)[:2] for label in table.index], dtype=np.int64)
    columns = np.array([list(label)[:2] for label in table.columns], dtype=np.int64)
    if labels.shape != columns.shape or (labels != columns).any():
        raise InputError(str(path), name, "rows and columns that differ", "a square matrix (form 6)")
    # A grid point's only component counts as its first one in scalar points.
    return Labelled(_sparse(table.to_numpy()), labels)


def _chosen(matrices: Mapping[str, Any], name: str, path: Path) -> Any:
    known = {key.lower(): matrix for key, matrix in matrices.items()}
    if not name and len(known) == 1:
        return next(iter(known.values()))
    if name.lower() not in known:
        expected = f"the name of one of its matrices: {', '.join(known)}"
        raise InputError(str(path), "name", name or "nothing", expected)
    return known[name.lower()]
