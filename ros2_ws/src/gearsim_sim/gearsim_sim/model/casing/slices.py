"""Many lowest modes of a large sparse structure, found slice by slice.

Work with one Lanczos basis for all of them grows with the square of their number. Here each slice has a
shift, a factor and a small basis of its own, and finds the modes nearest to its shift (Grimes, Lewis and
Simon, 1994). That none is missing is not a hope: the negative pivots of the factor count the eigenvalues
below its shift (Sylvester's law). Above the last shift Lanczos is trusted, as it is with few modes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import csc_array

from gearsim_sim.model.casing.eigen import factorise, lowest_modes
from gearsim_sim.model.casing.material import Array

SPAN = 150  # modes of a slice
_SEAM = 12  # a slice leaves one in so many of its modes to the next at most: seams lie in wide gaps
_SAME = 1e-7  # relative difference of two eigenvalues found from two shifts that may be one


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
    while total < count:
        end = _seam(found)
        kept = total - (len(found) - end)
        parts[-1] = parts[-1][:, :end]
        found, shapes = _next_slice(stiffness, mass, kept, float(found[end - 1]))
        parts.append(shapes)
        total = kept + len(found)
    everything = np.hstack(parts)[:, :count]
    stretched = np.einsum("ij,ij->j", everything, stiffness @ everything)
    return stretched, everything


def _next_slice(stiffness: csc_array, mass: csc_array, kept: int, top: float) -> tuple[Array, Array]:
    """The modes that come after the `kept` ones up to `top`."""
    step = SPAN // 2
    while step:
        # Modes of plates grow in number with frequency, that is with the root of the eigenvalue.
        near = _slice(stiffness, mass, top * ((kept + step) / kept) ** 2, kept, top)
        if near is not None:
            return near
        step //= 2  # too far off, or the shift met an eigenvalue
    raise ArithmeticError(f"no slice joins the {kept} modes below {top**0.5 / 2 / np.pi:.0f} Hz")


def _slice(
    stiffness: csc_array, mass: csc_array, shift: float, kept: int, top: float
) -> tuple[Array, Array] | None:
    """The modes around a shift that come after the `kept` ones up to `top`; None if some are missing."""
    factor = factorise(csc_array(stiffness - shift * mass))
    below = int(np.sum(factor.U.diagonal() < 0))
    squares, shapes = lowest_modes(stiffness, mass, SPAN, shift=shift, factor=factor)
    under = int(np.searchsorted(squares, shift))
    first = under - (below - kept)
    known = top * (1 + _SAME)
    if below <= kept or first < 0 or squares[first] <= known or (first > 0 and squares[first - 1] > known):
        return None
    return squares[first:], shapes[:, first:]


def _seam(squares: Array) -> int:
    """How many of a slice's modes to keep, so that the gap behind them is the widest of the last ones."""
    first = max(1, len(squares) - max(3, len(squares) // _SEAM))
    gaps = squares[first:] / squares[first - 1 : -1]
    return first + int(np.argmax(gaps))
