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
from gearsim_io.errors import InputError
from numpy.typing import NDArray
from scipy import special

__all__ = ["FULL_MODULATION_KURTOSIS", "Impulsiveness", "impulsiveness"]

FULL_MODULATION_KURTOSIS = 17.0 / 9.0

_LEAST_P = 1e-300


@dataclass(frozen=True, slots=True, eq=False)
class Impulsiveness:
    """Of several bands, each an array of shape (bands,).

    `kurtosis` is the excess kurtosis K of the complex envelope, `standard_error` its jackknife estimate over
    the blocks, `p_value` the probability that a signal with K at the limit shows as much.
    """

    kurtosis: NDArray[np.float64]
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
        4, and at most n / 8.
    limit : float
        Highest K that needs no impacts.

    Raises
    ------
    InputError
        When there are too few samples for the blocks.

    Notes
    -----
    The jackknife over blocks measures how far K comes from all of the window: a single knock has a large K
    and an equally large error, a train of impacts has a small one. The statistic is held against Student's t
    with blocks - 1 degrees of freedom; as the blocks' values are skewed to the right, it errs on the safe
    side.
    """
    bands, count = squared_envelope.shape
    width = count // max(blocks, 1)
    if blocks < 4 or width < 8:
        raise InputError("impulsiveness", "blocks", blocks, f"4 to {count // 8} blocks of {count} samples")
    cut = squared_envelope[:, : blocks * width].reshape(bands, blocks, width)
    second = cut.mean(axis=2, dtype=np.float64)
    fourth = np.einsum("bkn,bkn->bk", cut, cut, dtype=np.float64) / width
    whole = _excess(second.mean(axis=1), fourth.mean(axis=1))
    others = blocks - 1
    left_out = _excess(
        (second.sum(axis=1, keepdims=True) - second) / others,
        (fourth.sum(axis=1, keepdims=True) - fourth) / others,
    )
    spread = left_out - left_out.mean(axis=1, keepdims=True)
    error = np.sqrt(others / blocks * np.sum(spread**2, axis=1))
    statistic = (whole - limit) / np.maximum(error, 1e-12)
    p = special.stdtr(others, -statistic)
    return Impulsiveness(whole, error, np.clip(p, _LEAST_P, 1.0))


def _excess(second: NDArray[np.float64], fourth: NDArray[np.float64]) -> NDArray[np.float64]:
    return fourth / np.maximum(second**2, np.finfo(np.float64).tiny) - 2.0
