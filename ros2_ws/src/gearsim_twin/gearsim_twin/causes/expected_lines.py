"""Whether lines that one record taught are in another: at known places, of known heights, of unknown phases.

A finder must ask much of a record, since it looks everywhere. Of a line whose place and height are known the
odds are those of a sine of amplitude a and any phase in noise: with t the amplitudes of cosine and sine that
are found, F their information and u = (cos p, sin p),

    log odds = log mean over p of exp(a u F t - a^2 u F u / 2).

Lines that are there by chance, or are not there at all, have odds against them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

__all__ = ["odds_of_lines", "odds_of_sine"]

Array = NDArray[np.float64]

_PHASES = 2 * np.pi * np.arange(48) / 48
# Heights are read to some per cent, and beside an order to some tens.
_FACTORS = np.array([0.6, 0.75, 0.9, 1.0, 1.1, 1.3, 1.6])


def odds_of_sine(found: Array, information: Array, amplitude: Array) -> Array:
    """Log odds of a sine against noise.

    Parameters
    ----------
    found : ndarray, shape (2,)
        Amplitudes of cosine and sine found.
    information : ndarray, shape (2, 2)
        The inverse of their covariance.
    amplitude : ndarray, shape (n,)
        Some that are thought of.

    Returns
    -------
    ndarray, shape (n,)
    """
    u = np.stack([np.cos(_PHASES), np.sin(_PHASES)], axis=1)
    pull, size = u @ (information @ found), np.einsum("pi,ij,pj->p", u, information, u)
    exponent = amplitude[:, None] * pull - 0.5 * amplitude[:, None] ** 2 * size
    return np.asarray(logsumexp(exponent, axis=1) - np.log(_PHASES.size))


def odds_of_lines(lines: Sequence[tuple[float, Array, Array]]) -> float:
    """Log odds of several lines together, whose heights are off by one factor.

    `lines` has of each the amplitude that it should have, what was found, and the information on that.
    """
    total = np.zeros(_FACTORS.size)
    for amplitude, found, information in lines:
        total += odds_of_sine(found, information, amplitude * _FACTORS)
    return float(logsumexp(total) - np.log(_FACTORS.size))
