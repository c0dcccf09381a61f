"""Is a band's signal more impulsive than amplitude modulation can make it?

The excess kurtosis of a band's complex envelope z is K = <|z|^4> / <|z|^2>^2 - 2: 0 for stationary Gaussian
noise, -1 for a tone (Antoni, Mech. Syst. Signal Process. 20 (2006) 282-307, eq. 10). Noise whose amplitude
a(t) swings with the shafts has K = 2 <a^4> / <a^2>^2 - 2, which healthy gears show too; the deepest
sinusoidal swing, a = 1 + cos, gives 2 (35/8) / (3/2)^2 - 2 = 17/9. Only what lies significantly above that is
taken as a sign of impacts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gearsim_io.errors import InputError

__all__ = ["FULL_MODULATION_KURTOSIS", "Impulsiveness", "impulsiveness"]

FULL_MODULATION_KURTOSIS = 17.0 / 9.0

_LEAST_P = 1e-300
_LOUD_SHARE = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class Impulsiveness:
    """Of several bands, each an array of shape (bands,).

    Parameters
    ----------
    kurtosis : ndarray
        Excess kurtosis K of the complex envelope over everything.
    steady_kurtosis, standard_error : ndarray
        K without the loudest fifth of the blocks, and its jackknife error over the blocks left.
    p_value : ndarray
        Probability that a signal with K at the limit has such a steady kurtosis.
    """

    kurtosis: NDArray[np.float64]
    steady_kurtosis: NDArray[np.float64]
    standard_error: NDArray[np.float64]
    p_value: NDArray[np.float64]


def impulsiveness(
    squared_envelope: NDArray[np.float32] | NDArray[np.float64],
    blocks: int,
    limit: float = FULL_MODULATION_KURTOSIS,
) -> Impulsiveness:
    """Excess kurtosis of each band and a test of K <= `limit` against more.

    Parameters
    ----------
    squared_envelope : ndarray, shape (bands, n)
        |z|^2 of each band.
    blocks : int
        Parts of equal length that are taken as independent, such as one for each turn of the shaft; at least
        5, and at most n / 8.
    limit : float
        Highest K that needs no impacts.

    Raises
    ------
    InputError
        When there are too few samples for the blocks.

    Notes
    -----
    A fault strikes in every turn, a knock from outside does not: so the fifth of the blocks with the largest
    fourth moment is left out, which as a rule makes K smaller. The error by the jackknife over the other
    blocks is what it would be of independent ones; the statistic is held against Student's t with their
    number less one degrees of freedom.
    """
    bands, count = squared_envelope.shape
    width = count // max(blocks, 1)
    if blocks < 5 or width < 8:
        raise InputError("impulsiveness", "blocks", blocks, f"5 to {count // 8} blocks of {count} samples")
    cut = squared_envelope[:, : blocks * width].reshape(bands, blocks, width)
    second = cut.mean(axis=2, dtype=np.float64)
    fourth = np.einsum("bkn,bkn->bk", cut, cut, dtype=np.float64) / width
    kept = blocks - max(2, round(_LOUD_SHARE * blocks))
    quiet = np.argsort(fourth, axis=1)[:, :kept]
    whole = _excess(second.mean(axis=1), fourth.mean(axis=1))
    steady, error = _jackknife(
        np.take_along_axis(second, quiet, axis=1), np.take_along_axis(fourth, quiet, axis=1)
    )
    p = special.stdtr(kept - 1, -(steady - limit) / np.maximum(error, 1e-12))
    return Impulsiveness(whole, steady, error, np.clip(p, _LEAST_P, 1.0))


def _jackknife(
    second: NDArray[np.float64], fourth: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Excess kurtosis of all blocks and its standard error."""
    blocks = second.shape[1]
    others = blocks - 1
    left_out = _excess(
        (second.sum(axis=1, keepdims=True) - second) / others,
        (fourth.sum(axis=1, keepdims=True) - fourth) / others,
    )
    spread = left_out - left_out.mean(axis=1, keepdims=True)
    error = np.sqrt(others / blocks * np.sum(spread**2, axis=1))
    return _excess(second.mean(axis=1), fourth.mean(axis=1)), error


def _excess(second: NDArray[np.float64], fourth: NDArray[np.float64]) -> NDArray[np.float64]:
    return fourth / np.maximum(second**2, np.finfo(np.float64).tiny) - 2.0
