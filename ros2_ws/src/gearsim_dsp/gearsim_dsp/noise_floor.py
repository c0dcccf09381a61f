"""The noise floor of averaged power spectra, and how improbable a line or a comb of lines is above it.

Of stationary noise a line of a power spectrum averaged over v independent windows is distributed as the
floor times chi^2(2v) / 2v. The floor is estimated from the neighbours by a trimmed mean, which lines do
not lift, and has an error of its own; the ratio z of a line to the estimate then follows F(2v, 2u), u
being what the neighbourhood is worth in averages. With p(z) its upper tail, -ln p is exponential under
noise, so the sum over n lines of a comb is Gamma(n, 1) (R. A. Fisher, Statistical Methods for Research
Workers, 4th ed. (1932), sec. 21.1).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gearsim_io.errors import InputError

__all__ = ["LineTail", "comb_false_alarm", "effective_averages", "local_floor", "search_false_alarm"]

_KEEP = 0.75
_LN_CAP = 60.0
_TABLE = np.linspace(np.log(1e-3), np.log(1e6), 8192)


def effective_averages(starts: NDArray[np.int64], length: int) -> float:
    """Independent averages that Hann-windowed power spectra of overlapping windows amount to.

    Parameters
    ----------
    starts : ndarray of int, shape (windows,)
        First samples.
    length : int
        Samples of each window.

    Notes
    -----
    Welch (1967): var = floor^2 / K^2 sum_ij r_ij^2, with r the correlation of the shifted windows.
    """
    if starts.size == 0 or length < 1:
        raise InputError(
            "effective_averages", "starts", starts.size, "one window or more, of one sample or more"
        )
    shift = np.abs(starts[:, None] - starts[None, :]) / length
    return float(starts.size**2 / np.sum(_hann_correlation(shift) ** 2))


def _hann_correlation(shift: NDArray[np.float64]) -> NDArray[np.float64]:
    s = np.clip(shift, 0.0, 1.0)
    rest = 1.0 - s
    # integral of sin^2(pi t) sin^2(pi (t + s)) over the overlap, over the same at s = 0 (which is 3/8)
    value = rest * (2 + np.cos(2 * np.pi * s)) / 8 + 3 * np.sin(2 * np.pi * s) / (16 * np.pi)
    return np.asarray(value / 0.375)


def local_floor(
    power: NDArray[np.float64], block_lines: int, averages: float, first_line: int = 1
) -> NDArray[np.float64]:
    """Mean power of the noise at every line, from the lower three quarters of each block of lines.

    Parameters
    ----------
    power : ndarray, shape (..., lines)
    block_lines : int
        Width of a block; between block centres the floor is interpolated in the logarithm.
    averages : float
        Independent averages behind `power`, for the trimmed mean's bias.
    first_line : int
        Lines before it (the mean's leakage) are left out and get the first block's floor.

    Returns
    -------
    ndarray, shape (..., lines)
    """
    lines = power.shape[-1]
    usable = lines - first_line
    if usable < 16 or block_lines < 16:
        raise InputError("local_floor", "lines", usable, "16 lines and blocks of 16 lines at least")
    blocks = max(1, usable // block_lines)
    width = usable // blocks
    shape = (*power.shape[:-1], blocks, width)
    cut = power[..., first_line : first_line + blocks * width].reshape(shape)
    keep = max(1, round(_KEEP * width))
    low = np.partition(cut, keep - 1, axis=-1)[..., :keep].mean(axis=-1)
    level = np.log(np.maximum(low / _trimmed_share(float(averages)), np.finfo(np.float64).tiny))
    centres = first_line + (np.arange(blocks) + 0.5) * width
    flat = level.reshape(-1, blocks)
    at = np.arange(lines)
    floors = np.stack([np.interp(at, centres, row) for row in flat])
    return np.asarray(np.exp(floors).reshape(power.shape))


@lru_cache(maxsize=256)
def _trimmed_share(averages: float) -> float:
    """Mean of the lower three quarters of Gamma(v, 1/v), which has mean 1."""
    cut = float(special.gammaincinv(averages, _KEEP))
    return float(special.gammainc(averages + 1.0, cut) / _KEEP)


@dataclass(frozen=True, slots=True, eq=False)
class LineTail:
    """-ln of the probability that noise lifts a line to z times its estimated floor.

    Parameters
    ----------
    averages : float
        Independent averages v behind a line.
    floor_averages : float
        Independent averages u behind the floor's estimate.
    """

    averages: float
    floor_averages: float

    def __call__(self, ratio: NDArray[np.float64]) -> NDArray[np.float64]:
        """-ln p for each ratio, at most 60; from a table of the F distribution in steps of 0.25 % of z."""
        table = _tail_table(round(self.averages, 2), round(self.floor_averages, 1))
        place = (np.log(np.maximum(ratio, 1e-3)) - _TABLE[0]) * (1.0 / (_TABLE[1] - _TABLE[0]))
        return np.asarray(table[np.minimum(place, _TABLE.size - 1).astype(np.int32)])


@lru_cache(maxsize=128)
def _tail_table(averages: float, floor_averages: float) -> NDArray[np.float64]:
    ratio: NDArray[np.float64] = np.exp(_TABLE)
    # The upper tail of F(2v, 2u) at z is the regularised incomplete beta function I(u, v) at u / (u + v z).
    beta = special.betainc(floor_averages, averages, floor_averages / (floor_averages + averages * ratio))
    survival = np.asarray(beta, dtype=np.float64)
    return np.minimum(-np.log(np.maximum(survival, np.exp(-_LN_CAP))), _LN_CAP)


def comb_false_alarm(
    total: NDArray[np.float64] | float, lines: NDArray[np.int64] | int
) -> NDArray[np.float64]:
    """Probability that noise gives `lines` lines whose -ln p sum up to `total` or more (1 for no lines)."""
    count = np.asarray(lines, dtype=np.float64)
    tail = special.gammaincc(np.maximum(count, 1.0), np.asarray(total, dtype=np.float64))
    return np.asarray(np.where(count > 0, tail, 1.0))


def search_false_alarm(probability: float, trials: float) -> float:
    """Probability that the best of `trials` independent looks is as improbable as `probability`."""
    if not 0 <= probability <= 1 or trials < 1:
        raise InputError(
            "search_false_alarm", "probability, trials", (probability, trials), "0..1, 1 or more"
        )
    if probability >= 1:
        return 1.0
    return float(-np.expm1(trials * np.log1p(-probability)))
