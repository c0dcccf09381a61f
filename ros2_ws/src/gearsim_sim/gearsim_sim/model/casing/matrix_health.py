"""What must hold of a mass and a stiffness matrix before anything is made of them."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, eye_array

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.eigen import factorise
from gearsim_sim.model.casing.held import pivots

# Entry against entry, as files keep 8 digits and more.
SYMMETRY = 1e-6
# Of the mean mass: what is added so that displacements without mass do not stop the factor.
HAIR = 1e-9


def check_matrices(stiffness: csc_array, mass: csc_array, where: str) -> None:
    """InputError unless both are square, alike in size and symmetric, and the mass has no negative direction.

    That the stiffness has none is seen when its masters are held, see `held_factor`.
    """
    for name, matrix in (("stiffness", stiffness), ("mass", mass)):
        rows, columns = matrix.shape
        if rows != columns:
            raise InputError(where, name, f"{rows} rows and {columns} columns", "a square matrix")
    if stiffness.shape != mass.shape:
        expected = f"{stiffness.shape[0]} rows, as the stiffness has"
        raise InputError(where, "mass", f"{mass.shape[0]} rows", expected)
    for name, matrix in (("stiffness", stiffness), ("mass", mass)):
        _symmetric(matrix, name, where)
    _positive(mass, where)


def _symmetric(matrix: csc_array, name: str, where: str) -> None:
    gap = abs(matrix - matrix.T).tocoo()
    largest = float(np.abs(matrix.data).max(initial=0.0))
    if largest == 0:
        raise InputError(where, name, "nothing but zeros", "a matrix")
    if gap.nnz == 0 or gap.data.max() <= SYMMETRY * largest:
        return
    worst = int(np.argmax(gap.data))
    row, column = int(gap.row[worst]), int(gap.col[worst])
    dense = matrix.tocsr()
    what = f"{dense[row, column]:.6g} at ({row}, {column}) but {dense[column, row]:.6g} at ({column}, {row})"
    raise InputError(where, name, what, "a symmetric matrix")


def _positive(mass: csc_array, where: str) -> None:
    diagonal = mass.diagonal()
    negative = np.flatnonzero(diagonal < 0)
    if len(negative):
        what = f"{diagonal[negative[0]]:g} on the diagonal of row {negative[0]}"
        raise InputError(where, "mass", what, "no negative mass")
    hair = HAIR * float(diagonal.mean())
    signs = pivots(factorise(csc_array(mass + hair * eye_array(mass.shape[0]))))
    if not (signs > 0).all():
        row = int(np.argmin(np.where(np.isfinite(signs), signs, -np.inf)))
        what = f"an indefinite matrix (a negative pivot at row {row})"
        raise InputError(where, "mass", what, "no negative eigenvalues")
