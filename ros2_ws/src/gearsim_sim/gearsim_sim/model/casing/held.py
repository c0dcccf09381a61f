"""Factors that tell what is wrong with a stiffness matrix: mechanisms, negative directions, loose parts."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.csgraph import connected_components

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.eigen import factorise
from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.shell import Cells

# A pivot so small against its diagonal entry is rounding: structures of plates have 1e-6 and more.
NEGLIGIBLE = 1e-11


def pivots(factor: Any) -> Array:
    """Pivots of a symmetric factorisation, in the matrix's own order of rows."""
    return np.asarray(factor.U.diagonal()[factor.perm_c])


def held_factor(stiffness: csc_array, where: str, rows: Cells) -> Any:
    """Factor of a stiffness with its masters held; InputError if anything still moves freely.

    Parameters
    ----------
    stiffness : csc_array
        Of what is not held.
    where : str
        Names the structure in errors.
    rows : Cells
        What row of the whole structure each row is.
    """
    diagonal = stiffness.diagonal()
    empty = np.flatnonzero(diagonal <= 0)
    if len(empty):
        what = f"row {rows[empty[0]]} with {diagonal[empty[0]]:g} on the diagonal"
        raise InputError(where, "stiffness", what, "a positive number")
    try:
        factor = factorise(stiffness)
    except RuntimeError:
        raise _mechanism(stiffness, where, rows) from None
    ratio = pivots(factor) / diagonal
    if np.isfinite(ratio).all() and (ratio > NEGLIGIBLE).all():
        return factor
    if np.isfinite(ratio).all() and (ratio < -NEGLIGIBLE).any():
        worst = int(np.argmin(ratio))
        what = f"an indefinite matrix (a negative pivot at row {rows[worst]})"
        raise InputError(where, "stiffness", what, "no negative eigenvalues")
    raise _mechanism(stiffness, where, rows)


def _mechanism(stiffness: csc_array, where: str, rows: Cells) -> InputError:
    """Which row moves most in the motion that costs nothing: the shape that a hair of stiffness leaves."""
    diagonal = np.abs(stiffness.diagonal())
    hair = csc_array(stiffness.copy())
    hair.setdiag(stiffness.diagonal() + 1e-9 * diagonal.max())
    shape = np.ones(len(diagonal))
    factor = factorise(hair)
    for _ in range(4):
        shape = factor.solve(shape)
        shape /= np.abs(shape).max()
    moving = rows[np.flatnonzero(np.abs(shape) > 0.1)]
    shown = ", ".join(str(row) for row in moving[:5]) + (", ..." if len(moving) > 5 else "")
    what = f"a mechanism: with the masters held {len(moving)} rows move freely ({shown})"
    return InputError(where, "stiffness", what, "a structure that its masters hold")


def connected_or_raise(stiffness: csc_array, where: str) -> None:
    """InputError if the structure falls into parts that nothing connects."""
    parts, labels = connected_components(stiffness, directed=False)
    if parts > 1:
        sizes = np.bincount(labels)
        small = int(np.argmin(sizes))
        first = int(np.flatnonzero(labels == small)[0])
        what = f"{parts} parts without connection (the smallest of {sizes[small]} rows, with row {first})"
        raise InputError(where, "stiffness", what, "one connected structure")
