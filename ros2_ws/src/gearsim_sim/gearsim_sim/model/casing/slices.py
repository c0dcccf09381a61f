"""Many lowest modes of a large sparse structure, found slice by slice.

Work with one Lanczos basis for all of them grows with the square of their number. Here each slice has a
shift, a factor and a small basis of its own, and finds the modes nearest to its shift (Grimes, Lewis and
Simon, 1994). That none is missing is not a hope: the negative pivots of the factor count the eigenvalues
below its shift (Sylvester's law).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import csc_array

from gearsim_sim.model.casing.eigen import factorise, lowest_modes
from gearsim_sim.model.casing.material import Array

SPAN = 150  # modes of a slice
_SEAM = 12  # of the last ones so many may be left to the next slice, so that seams lie in wide gaps
_SAME = 1e-7  # relative difference of two eigenvalues found from two shifts that may be one
_TRIES = 4


def sliced_modes(
    stiffness: csc_array, mass: csc_array, count: int, factor: Any = None
) -> tuple[Array, Array]:
    """As `eigen.lowest_modes` at shift zero, of a positive definite stiffness.

    Parameters
    ----------
    stiffness, mass : csc_array, shape (size, size)
    count : int
    factor : object, optional
        Of `stiffness`, where it has been made already.

    Raises
    ------
    ArithmeticError
        If eigenvalues found and eigenvalues counted do not agree.
    """
    squares, shapes = lowest_modes(stiffness, mass, min(count, SPAN), factor=factor)
    if count <= SPAN:
        return squares, shapes
    found, parts, total = squares, [shapes], len(squares)
    step = SPAN // 2
    tries = 0
    while total < count:
        end = _seam(found)
        kept = total - (len(found) - end)
        top = float(found[end - 1])
        # Modes of plates grow in number with frequency, that is with the root of the eigenvalue.
        shift = top * ((kept + step) / kept) ** 2
        near = _slice(stiffness, mass, shift, kept, top)
        if near is None:  # too far off, or the shift met an eigenvalue
            step, tries = max(8, step * 2 // 3), tries + 1
            if tries > _TRIES:
                raise ArithmeticError(f"no slice joins the {kept} modes below {top**0.5 / 2 / np.pi:.0f} Hz")
            continue
        tries = 0
        parts[-1] = parts[-1][:, :end]
        found, shapes = near
        parts.append(shapes)
        total = kept + len(found)
    everything = np.hstack(parts)[:, :count]
    stretched = np.einsum("ij,ij->j", everything, stiffness @ everything)
    return stretched, everything


def _slice(
    stiffness: csc_array, mass: csc_array, shift: float, kept: int, top: float
) -> tuple[Array, Array] | None:
    """The modes around a shift that come after the `kept` ones up to `top`; None if some are missing."""
    factor = factorise(csc_array(stiffness - shift * mass))
    below = int(np.sum(factor.U.diagonal() < 0))
    squares, shapes = lowest_modes(stiffness, mass, SPAN, shift=shift, factor=factor)
    under = int(np.searchsorted(squares, shift))
    first = under - (below - kept)
    if below <= kept or first < 0 or squares[first] < top * (1 - _SAME):
        return None
    if first > 0 and squares[first - 1] > top * (1 + _SAME):
        return None
    return squares[first:], shapes[:, first:]


def _seam(squares: Array) -> int:
    """How many of a slice's modes to keep, so that the gap behind them is the widest of the last ones."""
    first = max(1, len(squares) - _SEAM)
    gaps = squares[first:] / squares[first - 1 : -1]
    return first + int(np.argmax(gaps))
