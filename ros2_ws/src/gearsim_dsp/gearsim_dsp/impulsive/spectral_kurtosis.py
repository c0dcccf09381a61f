"""Spectral kurtosis: how far the energy at each frequency comes and goes.

Of short-time spectra X_k(f), k = 1 ... K,

    SK(f) = (K + 1) / (K - 1) ( K sum |X_k|^4 / (sum |X_k|^2)^2 - 1 ) - 1

which is <|X|^4> / <|X|^2>^2 - 2 (Antoni, Mech. Syst. Signal Process. 20 (2006) 282-307) but for the bias of
a small K, taken out exactly (Nita and Gary, Publ. Astron. Soc. Pacific 122 (2010) 595-607): 0 for stationary
Gaussian noise, -1 for a steady line, large where impacts ring. Its square root is the gain of the filter that
brings impacts out of stationary noise (Antoni and Randall, Mech. Syst. Signal Process. 20 (2006) 308-331).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft as sfft
from scipy import special
from scipy.signal import firwin2, oaconvolve
from scipy.signal.windows import hann

from gearsim_dsp.separation.checks import checked_count, checked_signal
from gearsim_io.errors import InputError

__all__ = ["SpectralKurtosis", "spectral_kurtosis"]

_AT_ONCE = 64
_LEAST_SEGMENTS = 8


@dataclass(frozen=True, slots=True, eq=False)
class SpectralKurtosis:
    """Spectral kurtosis over frequency.

    Parameters
    ----------
    frequency_hz, values : ndarray of float64, shape (lines,)
        Without the lines at 0 and at half the rate, where the spectrum is real and noise has 1, not 0.
    mean_square : ndarray of float64, shape (lines,)
        Mean of |X|^2, in the signal's unit squared; adds up to the signal's mean square.
    independent : float
        Number of independent short-time spectra that the overlapping ones are worth.
    window_samples : int
    """

    frequency_hz: NDArray[np.float64]
    values: NDArray[np.float64]
    mean_square: NDArray[np.float64]
    independent: float
    window_samples: int

    def chance_limit(self, false_alarm: float = 1e-3) -> float:
        """Value that stationary Gaussian noise exceeds somewhere on the axis with this probability.

        The variance is 4 / K for K independent spectra. The distribution is skew: with the skewness
        10 / sqrt(K) and the excess kurtosis 250 / K (counted on noise) the quantile is that of Cornish and
        Fisher. Every line counts as one look, though neighbours under a Hann window depend on each other.
        """
        if not 0.0 < false_alarm < 1.0:
            raise InputError("chance_limit", "false_alarm", false_alarm, "between 0 and 1")
        z = -float(special.ndtri(-np.expm1(np.log1p(-false_alarm) / self.values.size)))
        k = self.independent
        skewed = 10.0 / np.sqrt(k) * (z * z - 1.0) / 6.0
        tailed = 250.0 / k * (z**3 - 3 * z) / 24.0 - 100.0 / k * (2 * z**3 - 5 * z) / 36.0
        return float(2.0 / np.sqrt(k) * (z + skewed + tailed))

    def wiener_gain(
        self, false_alarm: float = 1e-3, band_hz: tuple[float, float] | None = None
    ) -> NDArray[np.float64]:
        """sqrt(SK) where it exceeds `chance_limit`, else 0; shape (lines,), the largest scaled to 1.

        Outside `band_hz` it is 0: give the range below the anti-alias filter's roll-off
        (`band_choice.usable_ceiling_hz`), whose slope is as impulsive as what leaks into it.
        """
        gain = np.where(self.values > self.chance_limit(false_alarm), np.maximum(self.values, 0.0), 0.0)
        if band_hz is not None:
            low_hz, high_hz = band_hz
            if not 0.0 <= low_hz < high_hz:
                raise InputError("wiener_gain", "band_hz", band_hz, "0 <= low < high")
            gain[(self.frequency_hz < low_hz) | (self.frequency_hz > high_hz)] = 0.0
        largest = float(gain.max(initial=0.0))
        return np.asarray(np.sqrt(gain / largest) if largest > 0 else gain)

    def filtered(
        self, signal: ArrayLike, false_alarm: float = 1e-3, band_hz: tuple[float, float] | None = None
    ) -> NDArray[np.float64]:
        """The signal through the filter of `wiener_gain`, without delay; zeros if nothing is impulsive."""
        taps = self.window_samples + 1
        x = checked_signal("SpectralKurtosis.filtered", signal, taps, "more than the window")
        gain = np.concatenate(([0.0], self.wiener_gain(false_alarm, band_hz), [0.0]))
        axis = np.linspace(0.0, 1.0, gain.size)
        return np.asarray(oaconvolve(x, firwin2(taps, axis, gain), mode="same"))


def spectral_kurtosis(
    signal: ArrayLike, sample_rate_hz: float, window_samples: int, hop_samples: int | None = None
) -> SpectralKurtosis:
    """Spectral kurtosis by short-time Fourier transforms with a Hann window.

    Parameters
    ----------
    signal : array_like, shape (n,)
        Finite samples, at least 8 windows.
    sample_rate_hz : float
    window_samples : int
        Even; between the ringing of an impact and the distance of two: a longer window holds several impacts,
        which look like noise, a shorter one smears resonances.
    hop_samples : int, optional
        A quarter of the window by default.

    Raises
    ------
    InputError
        Signal too short or not finite.
    """
    where = "spectral_kurtosis"
    window_samples = checked_count(where, "window_samples", window_samples, 8)
    window_samples += window_samples % 2
    hop = window_samples // 4 if hop_samples is None else hop_samples
    hop = checked_count(where, "hop_samples", hop, 1, window_samples)
    need = _LEAST_SEGMENTS * window_samples
    x = checked_signal(where, signal, need, f"{_LEAST_SEGMENTS} windows")
    if not (np.isfinite(sample_rate_hz) and sample_rate_hz > 0):
        raise InputError(where, "sample_rate_hz", sample_rate_hz, "above 0 Hz")
    segments = np.lib.stride_tricks.sliding_window_view(x - np.mean(x), window_samples)[::hop]
    window = hann(window_samples, sym=False)
    second, fourth = np.zeros(window_samples // 2 - 1), np.zeros(window_samples // 2 - 1)
    for first in range(0, segments.shape[0], _AT_ONCE):
        lines = sfft.rfft(segments[first : first + _AT_ONCE] * window, axis=1)[:, 1:-1]
        square = lines.real**2 + lines.imag**2
        second += square.sum(axis=0)
        fourth += np.einsum("kn,kn->n", square, square)
    count = segments.shape[0]
    k = max(2.0, count * _worth(window, hop))
    ratio = count * fourth / np.maximum(second**2, np.finfo(np.float64).tiny)
    values = (k + 1) / (k - 1) * (ratio - 1.0) - 1.0
    frequency = np.arange(1, window_samples // 2) * sample_rate_hz / window_samples
    scale = 2.0 / (count * window_samples * np.sum(window**2))
    return SpectralKurtosis(frequency, values, second * scale, k, window_samples)


def _worth(window: NDArray[np.float64], hop: int) -> float:
    """Independent spectra per spectrum: |X|^4 of neighbours correlates as their correlation to the fourth.

    Of complex Gaussian values with the correlation r the squared magnitudes correlate with r^2, and what
    makes up the estimator's variance, of second order in these, with r^4.
    """
    energy = float(window @ window)
    total = 1.0
    for shift in range(hop, window.size, hop):
        total += 2.0 * (float(window[shift:] @ window[:-shift]) / energy) ** 4
    return 1.0 / total
