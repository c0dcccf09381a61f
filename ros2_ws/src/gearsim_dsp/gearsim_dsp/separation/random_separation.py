"""Discrete/random separation (DRS): lines that go on from what dies out.

The signal is predicted from itself, a delay earlier. What is longer than the memory of the random part -
gear meshes, shafts, supply lines - can be foretold, what slips or rings out cannot. The filter is the
transfer function from the delayed signal to the signal, averaged over pairs of blocks:

    G(f) = < X(f) X_d(f)* > / < (|X(f)|^2 + |X_d(f)|^2) / 2 >

(Antoni and Randall, Mech. Syst. Signal Process. 18 (2004) 103-117). Its magnitude is near 1 at lines and near
1 / sqrt(blocks) elsewhere; taking the mean power of both blocks below the line keeps it from exceeding 1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft as sfft
from scipy.signal.windows import hann

from gearsim_dsp.separation.checks import checked_count, checked_signal

__all__ = ["drs", "separation_gain"]

_BLOCKS_PER_LENGTH = 4


def separation_gain(signal: ArrayLike, delay: int, length: int) -> NDArray[np.complex128]:
    """G(f) of the equation above, at the lines of a real FFT of `length` samples.

    Parameters
    ----------
    signal : array_like, shape (n,)
        Finite samples, at least 4 * (length + delay).
    delay : int
        Samples from the end of the earlier block to the beginning of the later one: longer than the memory
        of the random part (several times the decay of its resonances).
    length : int
        Samples of a block, even. Lines narrower than 4 / length of the sampling rate are told from noise;
        the more blocks fit into the signal, the less of the noise is taken for lines.

    Returns
    -------
    ndarray of complex128, shape (length // 2 + 1,)
        Magnitudes of at most 1.

    Raises
    ------
    InputError
        Signal too short or not finite, length odd or below 16.
    """
    x, delay, length = _checked(signal, delay, length)
    return _gain(x - np.mean(x), delay, length)


def drs(signal: ArrayLike, delay: int, length: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Separate a signal into lines that go on and the rest.

    Parameters
    ----------
    signal : array_like, shape (n,)
        Finite samples, at least 4 * (length + delay). Speed that varies by more than 1 / (length + delay)
        of a line's frequency per sample smears that line: resample to equal angles first.
    delay, length : int
        As in `separation_gain`.

    Returns
    -------
    deterministic, random : ndarray of float64, shape (n,)
        In the signal's unit; their sum is the signal. The mean goes with the deterministic part.

    Notes
    -----
    Each sample is predicted from the past and, with the same filter turned round, from the future, and the
    mean is taken, which halves the noise that comes with it; at either end of the signal one of the two
    is all there is.
    """
    x, delay, length = _checked(signal, delay, length)
    mean = float(np.mean(x))
    centred = x - mean
    gain = _gain(centred, delay, length)
    deterministic = _predicted(centred, gain, delay, length) + mean
    return deterministic, x - deterministic


def _checked(signal: ArrayLike, delay: int, length: int) -> tuple[NDArray[np.float64], int, int]:
    where = "drs"
    length = checked_count(where, "length", length, 16)
    length += length % 2
    delay = checked_count(where, "delay", delay, 0)
    need = 4 * (length + delay)
    return checked_signal(where, signal, need, "four times length and delay"), delay, length


def _gain(x: NDArray[np.float64], delay: int, length: int) -> NDArray[np.complex128]:
    """Blocks follow each other by a whole fraction of the pairs' distance: each spectrum serves twice."""
    distance = length + delay
    per_distance = -(-_BLOCKS_PER_LENGTH * distance // length)
    count = (x.size - length) * per_distance // distance + 1
    starts = np.arange(count) * distance // per_distance
    blocks = np.lib.stride_tricks.sliding_window_view(x, length)
    window = hann(length, sym=False)
    cross = np.zeros(length // 2 + 1, dtype=np.complex128)
    power = np.zeros(length // 2 + 1)
    earlier = sfft.rfft(blocks[starts[:per_distance]] * window, axis=1)
    for first in range(per_distance, count, per_distance):
        later = sfft.rfft(blocks[starts[first : first + per_distance]] * window, axis=1)
        earlier = earlier[: later.shape[0]]
        cross += np.einsum("kn,kn->n", later, earlier.conj())
        power += 0.5 * (_power(later) + _power(earlier))
        earlier = later
    return np.asarray(cross / np.maximum(power, np.finfo(np.float64).tiny))


def _power(lines: NDArray[np.complex128]) -> NDArray[np.float64]:
    return np.asarray(np.sum(lines.real**2 + lines.imag**2, axis=0))


def _predicted(
    x: NDArray[np.float64], gain: NDArray[np.complex128], delay: int, length: int
) -> NDArray[np.float64]:
    """Mean of the predictions from the past and from the future; x has no mean."""
    half, count = length // 2, x.size
    reach = half + length + delay  # the farthest sample that a prediction rests on
    taps = np.roll(sfft.irfft(gain, length), half)  # of the lags -half to half - 1
    padded = sfft.next_fast_len(count + length, real=True)
    lines, response = sfft.rfft(x, padded), sfft.rfft(taps, padded)
    total = np.zeros(count)
    total[reach:] = sfft.irfft(lines * response, padded)[length : length + count - reach]
    future = sfft.irfft(lines * response.conj(), padded)[reach - length : count - length]
    total[: count - reach] += future
    total[reach : count - reach] *= 0.5
    return total
