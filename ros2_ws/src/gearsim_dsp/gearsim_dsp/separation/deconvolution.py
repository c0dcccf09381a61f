"""Blind deconvolution: the filter that turns a signal back into the impacts it came from.

MED (minimum entropy deconvolution) looks for the FIR filter f whose output y = f * x has the largest kurtosis
(Wiggins, Geoexploration 16 (1978) 21-35; Endo and Randall, Mech. Syst. Signal Process. 21 (2007) 906-919);
ARMED lets linear prediction go first (Sawalhi, Randall and Endo, Mech. Syst. Signal Process. 21 (2007)
2616-2633). One knock is enough to win there; MCKD asks for impacts that repeat after T samples by maximising
the correlated kurtosis

    CK_M(T) = sum_n ( y[n] y[n-T] ... y[n-MT] )^2 / ( sum_n y[n]^2 )^(M+1)

(McDonald, Zhao and Zuo, Mech. Syst. Signal Process. 33 (2012) 237-255). Both are iterations f = R^-1 g on the
gradient's zero. Only outputs that rest on `length` samples of the record count: a filter that is allowed to
see the record's edge finds its impact there (McDonald and Zhao, Mech. Syst. Signal Process. 82 (2017)
461-477).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft as sfft
from scipy.linalg import cho_factor, cho_solve

from gearsim_dsp.separation.checks import checked_count, checked_signal
from gearsim_dsp.separation.linear_prediction import ar_residual, best_ar_length
from gearsim_io.errors import InputError

__all__ = ["Deconvolution", "armed", "correlated_kurtosis", "mckd", "med"]

# Of the mean square, added to the diagonal of R: bands without any signal (beyond an anti-alias filter) are
# not raised by more than 60 dB.
_RIDGE = 1e-6
_ENOUGH = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class Deconvolution:
    """A filter found and its output.

    Parameters
    ----------
    taps : ndarray of float64, shape (length,)
        The filter, of unit energy.
    values : ndarray of float64, shape (n,)
        Its output, scaled to the mean square of the input; sample n rests on the input up to n. The first
        length - 1 samples are 0.
    history : tuple of float
        What is maximised (kurtosis, 3 for Gaussian noise, or correlated kurtosis) for the input and after
        each iteration.
    converged : bool
        Whether the last iteration changed it by less than 1e-4 of it.
    """

    taps: NDArray[np.float64]
    values: NDArray[np.float64]
    history: tuple[float, ...]
    converged: bool


def med(signal: ArrayLike, length: int, iterations: int = 50) -> Deconvolution:
    """Minimum entropy deconvolution.

    Parameters
    ----------
    signal : array_like, shape (n,)
        Finite samples, at least 4 * length.
    length : int
        Taps: long enough to undo the ringing (a few periods of the resonances), at most the distance of two
        impacts.
    iterations : int
        At most.

    Raises
    ------
    InputError
        Signal too short, constant or not finite.
    """

    def gradient(y: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
        square = y * y
        second, fourth = float(np.sum(square)), float(np.sum(square * square))
        return square * y, y.size * fourth / second**2

    return _iterated("med", signal, length, iterations, gradient)


def armed(signal: ArrayLike, longest: int, length: int, iterations: int = 50) -> Deconvolution:
    """Linear prediction with the best length up to `longest`, then MED of its residual.

    Parameters
    ----------
    signal : array_like, shape (n,)
        Finite samples, at least four times `length` and `longest` together, and one.
    longest : int
        See `linear_prediction.longest_ar_length`.
    length, iterations : int
        See `med`.
    """
    checked_count("armed", "longest", longest, 1)
    checked_count("armed", "length", length, 2)
    need = 4 * (longest + length) + 1
    x = checked_signal("armed", signal, need, "four times both lengths together, and one")
    ar = best_ar_length(x, longest)
    found = med(ar_residual(x, ar)[ar:], length, iterations)
    values = np.concatenate((np.zeros(ar), found.values))
    return Deconvolution(found.taps, values, found.history, found.converged)


def mckd(signal: ArrayLike, length: int, period: int, shifts: int = 1, iterations: int = 50) -> Deconvolution:
    """Maximum correlated kurtosis deconvolution.

    Parameters
    ----------
    signal : array_like, shape (n,)
        Finite samples, at least 4 * length and length + 2 * (shifts + 1) * period.
    length : int
        Taps, as in `med`.
    period : int
        Distance of the impacts in samples. It must hold within the impacts' width over `shifts` periods:
        resample to a whole number of samples per period, and take fewer shifts where there is slip.
    shifts : int
        M: how many periods back the impacts must repeat.
    iterations : int
        At most.
    """
    where = "mckd"
    period = checked_count(where, "period", period, 2)
    shifts = checked_count(where, "shifts", shifts, 1, 7)
    length = checked_count(where, "length", length, 2)
    x = checked_signal(where, signal, length + 2 * (shifts + 1) * period, "length and 2 (shifts + 1) periods")

    def gradient(y: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
        return _correlated(y, period, shifts)

    return _iterated(where, x, length, iterations, gradient)


def correlated_kurtosis(values: ArrayLike, period: int, shifts: int = 1) -> float:
    """CK_M(T) of the equation above, with y = 0 before the first sample; no unit, between 0 and 1.

    Parameters
    ----------
    values : array_like, shape (n,)
        Finite, not all zero.
    period, shifts : int
        T in samples and M.
    """
    y = checked_signal("correlated_kurtosis", values, 2)
    scale = float(np.max(np.abs(y)))
    if scale == 0.0:
        raise InputError("correlated_kurtosis", "values", "zeros", "a signal that varies")
    return _correlated(y / scale, period, shifts)[1]


def _correlated(y: NDArray[np.float64], period: int, shifts: int) -> tuple[NDArray[np.float64], float]:
    """Half the gradient of sum of beta^2 by y (beta the product over the shifts), and CK."""
    square = y * y
    reach = shifts * period
    padded = np.concatenate((np.zeros(reach), square, np.zeros(reach)))
    around = np.zeros(y.size)
    beta_square = 0.0
    for m in range(shifts + 1):
        # Product over the other samples of the group in which y[n] is the one m periods before the last.
        others = np.ones(y.size)
        for k in range(shifts + 1):
            if k != m:
                start = reach + (m - k) * period
                others *= padded[start : start + y.size]
        around += others
        if m == 0:
            beta_square = float(others @ square)
    energy = float(np.sum(square))
    return y * around, beta_square / energy ** (shifts + 1)


def _iterated(
    where: str,
    signal: ArrayLike,
    length: int,
    iterations: int,
    gradient: Callable[[NDArray[np.float64]], tuple[NDArray[np.float64], float]],
) -> Deconvolution:
    length = checked_count(where, "length", length, 2)
    iterations = checked_count(where, "iterations", iterations, 1)
    x = checked_signal(where, signal, 4 * length, f"four times the {length} taps")
    x = x - np.mean(x)
    scale = float(np.sqrt(np.mean(x * x)))
    if scale == 0.0:
        raise InputError(where, "signal", "a constant", "a signal that varies")
    x = x / scale
    record = _Record(x, length)
    taps = np.zeros(length)
    taps[length // 2] = 1.0
    y = record.filtered(taps)
    slope, value = gradient(y / np.max(np.abs(y)))
    history, converged = [value], False
    for _ in range(iterations):
        taps = record.solved(slope)
        y = record.filtered(taps)
        slope, value = gradient(y / np.max(np.abs(y)))
        converged = abs(value - history[-1]) <= _ENOUGH * value
        history.append(value)
        if converged:
            break
    values = np.concatenate((np.zeros(length - 1), y * (scale / np.sqrt(np.mean(y * y)))))
    return Deconvolution(taps, values, tuple(history), converged)


class _Record:
    """A signal with what every iteration needs of it: its spectrum and the factored correlation matrix."""

    def __init__(self, x: NDArray[np.float64], length: int) -> None:
        self._length = length
        self._count = x.size
        self._padded = sfft.next_fast_len(x.size, real=True)
        self._lines = sfft.rfft(x, self._padded)
        matrix = self._correlations(x)
        matrix[np.diag_indices(length)] += _RIDGE * matrix[0, 0]
        self._factor = cho_factor(matrix, lower=True)

    def filtered(self, taps: NDArray[np.float64]) -> NDArray[np.float64]:
        """Outputs that rest on whole windows, shape (n - length + 1,)."""
        y = sfft.irfft(self._lines * sfft.rfft(taps, self._padded), self._padded)
        return np.asarray(y[self._length - 1 : self._count])

    def solved(self, slope: NDArray[np.float64]) -> NDArray[np.float64]:
        """R^-1 g with g[l] = sum over n of slope[n] x[n - l], of unit energy."""
        taps = cho_solve(self._factor, self._against(slope))
        return np.asarray(taps / np.sqrt(taps @ taps))

    def _against(self, slope: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sum over n of slope[n] x[n - l] for l = 0 ... length - 1, slope beginning at n = length - 1."""
        lines = sfft.rfft(slope, self._padded)
        products = sfft.irfft(self._lines * lines.conj(), self._padded)[: self._length]
        return np.asarray(products[::-1])

    def _correlations(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sum over the outputs' windows of x[n - i] x[n - j], each diagonal from its first element."""
        length, count = self._length, self._count
        matrix = np.empty((length, length))
        matrix[0] = matrix[:, 0] = self._against(x[length - 1 :])
        head, tail = x[length - 2 :: -1][: length - 1], x[count - 1 : count - length : -1]
        for i in range(1, length):
            step = head[i - 1] * head[i - 1 :] - tail[i - 1] * tail[i - 1 :]
            matrix[i, i:] = matrix[i - 1, i - 1 : -1] + step
            matrix[i:, i] = matrix[i, i:]
        return matrix
