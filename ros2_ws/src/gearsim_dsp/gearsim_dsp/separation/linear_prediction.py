"""Autoregressive linear prediction: what the past of a signal foretells, and the rest.

Each sample is predicted from the `length` samples before it,

    x^[n] = a_1 x[n-1] + ... + a_p x[n-p],      e[n] = x[n] - x^[n],

with the coefficients that leave the least error on average. Gear meshes and resonances go into the
prediction; impacts, which nothing foretells, stay in the residual e, whose spectrum is flat (Wang and Wong,
J. Sound Vib. 258 (2002) 893-912). The length is that at which the residual is most impulsive, and at most a
quarter of the distance of two impacts, so that no impact helps to foretell the next (Sawalhi, Randall and
Endo, Mech. Syst. Signal Process. 21 (2007) 2616-2633).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft as sfft
from scipy.signal import oaconvolve
from scipy.signal.windows import tukey

from gearsim_dsp.separation.checks import checked_count, checked_signal
from gearsim_io.errors import InputError

__all__ = [
    "LinearPredictor",
    "ar_residual",
    "best_ar_length",
    "kurtosis_by_length",
    "linear_predictor",
    "longest_ar_length",
]

_TAPERED_SHARE = 0.5
# Share of the power added to the autocorrelation at lag 0. It is well above the rounding of the FFT (1e-15)
# and lets a line be reduced by 100 dB or more.
_RIDGE = 1e-12


@dataclass(frozen=True, slots=True, eq=False)
class LinearPredictor:
    """Coefficients fitted to one signal, to be used on that or on another of the same machine.

    Parameters
    ----------
    coefficients : ndarray of float64, shape (length,)
        a_1 to a_p, no unit.
    reflection : ndarray of float64, shape (length,)
        Reflection coefficients k_1 to k_p, all within (-1, 1).
    error_share : float
        Power of the residual over that of the signal it was fitted to.
    periodic : bool
        Whether signals are taken to repeat themselves (synchronous averages do).
    """

    coefficients: NDArray[np.float64]
    reflection: NDArray[np.float64]
    error_share: float
    periodic: bool

    @property
    def length(self) -> int:
        """Number of samples that a prediction rests on."""
        return int(self.coefficients.size)

    def residual(self, signal: ArrayLike) -> NDArray[np.float64]:
        """What remains of a signal, without its mean, when the prediction is taken away.

        Parameters
        ----------
        signal : array_like, shape (n,)
            Finite samples, more than `length`.

        Returns
        -------
        ndarray of float64, shape (n,)
            In the signal's unit. Unless the signal is periodic, the first `length` samples have no complete
            past to be predicted from and are 0.
        """
        x = checked_signal("ar_residual", signal, self.length + 1, "more than the predictor's length")
        x = x - np.mean(x)
        taps = np.concatenate(([1.0], -self.coefficients))
        if self.periodic:
            extended = np.concatenate((x[-self.length :], x))
            return np.asarray(oaconvolve(extended, taps)[self.length : self.length + x.size])
        error = np.asarray(oaconvolve(x, taps)[: x.size])
        error[: self.length] = 0.0
        return error


def linear_predictor(signal: ArrayLike, length: int, *, periodic: bool = False) -> LinearPredictor:
    """Fit a predictor by the autocorrelation method (Levinson and Durbin).

    Parameters
    ----------
    signal : array_like, shape (n,)
        Finite samples, at least 4 * length + 1 of them.
    length : int
        Samples that a prediction rests on.
    periodic : bool
        The signal repeats itself, as a synchronous average does: its autocorrelation is then circular.
        Otherwise the signal is tapered over a quarter at either end, for a bare cut would look like noise
        1 / n below each line, which is what would remain of it.

    Raises
    ------
    InputError
        Signal too short or not finite.
    """
    where = "linear_predictor"
    length = checked_count(where, "length", length, 1)
    x = checked_signal(where, signal, 4 * length + 1, f"four times the length of {length}, and one")
    coefficients, reflection, share = _levinson(_autocorrelation(x - np.mean(x), length, periodic))
    return LinearPredictor(coefficients, reflection, share, periodic)


def ar_residual(signal: ArrayLike, length: int, *, periodic: bool = False) -> NDArray[np.float64]:
    """The part of a signal that the `length` samples before do not foretell; see `linear_predictor`.

    Returns
    -------
    ndarray of float64, shape (n,)
        In the signal's unit, without mean; the first `length` samples are 0 unless `periodic`.
    """
    return linear_predictor(signal, length, periodic=periodic).residual(signal)


def kurtosis_by_length(signal: ArrayLike, longest: int) -> NDArray[np.float64]:
    """Kurtosis of the residual for every length from 1 to `longest`.

    All lengths come out of one pass: the residuals of successive lengths are the stages of one lattice
    filter, whose reflection coefficients the recursion of Levinson and Durbin gives anyway.

    Parameters
    ----------
    signal : array_like, shape (n,)
        Finite samples, at least 4 * longest + 1 of them.
    longest : int

    Returns
    -------
    ndarray of float64, shape (longest,)
        Fourth moment over the squared second (3 for Gaussian noise) over all samples from `longest` on.
    """
    from gearsim_dsp.separation.lattice import lattice_moments  # compiled: only who needs it waits for it

    where = "kurtosis_by_length"
    longest = checked_count(where, "longest", longest, 1)
    x = checked_signal(where, signal, 4 * longest + 1, f"four times the longest length of {longest}, and one")
    x = x - np.mean(x)
    scale = float(np.max(np.abs(x)))
    if scale == 0.0:
        raise InputError(where, "signal", "a constant", "a signal that varies")
    x /= scale  # so that fourth powers neither overflow nor vanish
    _, reflection, _ = _levinson(_autocorrelation(x, longest, False))
    second, fourth = lattice_moments(x, reflection)
    count = x.size - longest
    return np.asarray(count * fourth / np.maximum(second**2, np.finfo(np.float64).tiny))


def best_ar_length(signal: ArrayLike, longest: int) -> int:
    """The length, 1 to `longest`, at which the residual has the largest kurtosis.

    Parameters
    ----------
    signal : array_like, shape (n,)
        Finite samples, at least 4 * longest + 1 of them.
    longest : int
        See `longest_ar_length`.
    """
    return int(np.argmax(kurtosis_by_length(signal, longest))) + 1


def longest_ar_length(sample_rate_hz: float, impacts_hz: float, samples: int) -> int:
    """A quarter of the distance of two impacts, in samples, and at most a quarter of the signal.

    Parameters
    ----------
    sample_rate_hz : float
    impacts_hz : float
        Expected rate of impacts; of several faults the fastest.
    samples : int
        Length of the signal.
    """
    where = "longest_ar_length"
    for field, value in (("sample_rate_hz", sample_rate_hz), ("impacts_hz", impacts_hz)):
        if not (np.isfinite(value) and value > 0):
            raise InputError(where, field, value, "above 0 Hz")
    quarter = int(min(0.25 * sample_rate_hz / impacts_hz, (samples - 1) // 4))
    if quarter < 1:
        raise InputError(where, "samples, impacts_hz", (samples, impacts_hz), "a signal and a spacing of 4")
    return quarter


def _autocorrelation(x: NDArray[np.float64], lags: int, periodic: bool) -> NDArray[np.float64]:
    """Sum of x[n] x[n + lag] for lag = 0 to `lags`."""
    if periodic:
        count = x.size
    else:
        x = x * tukey(x.size, _TAPERED_SHARE)
        count = sfft.next_fast_len(x.size + lags, real=True)
    lines = sfft.rfft(x, count)
    return np.asarray(sfft.irfft(lines.real**2 + lines.imag**2, count)[: lags + 1])


def _levinson(
    autocorrelation: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Coefficients, reflection coefficients and share of the error, by the recursion over the length."""
    power = float(autocorrelation[0])
    length = autocorrelation.size - 1
    reflection = np.zeros(length)
    if power <= 0.0:
        return np.zeros(length), reflection, 0.0
    r = autocorrelation / power
    error = 1.0 + _RIDGE
    a = np.zeros(length)
    for m in range(length):
        k = float(r[m + 1] - a[:m] @ r[m:0:-1]) / error
        a[:m] -= k * a[:m][::-1].copy()
        a[m] = reflection[m] = k
        error *= 1.0 - k * k
    return a, reflection, error
