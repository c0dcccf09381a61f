"""Power spectral density with the property that its integral is the variance, exactly.

Welch's method (IEEE Trans. Audio Electroacoust. 15 (1967) 70-73): averaged periodograms of windowed
segments. Here the segments' means are kept and the record's mean is taken out, and each segment's
periodogram is scaled by the window's own power, so a stationary signal's PSD integrates to its variance
without bias.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_io.errors import InputError

__all__ = ["Psd", "good_length", "welch_psd"]


@dataclass(frozen=True, slots=True, eq=False)
class Psd:
    """One-sided power spectral density.

    Parameters
    ----------
    frequency_hz : ndarray of float64, shape (lines,)
    density : ndarray of float64, shape (lines,)
        Unit of the signal squared per Hz.
    step_hz : float
        Distance of two lines.
    segments : int
        Periodograms averaged.
    """

    frequency_hz: NDArray[np.float64]
    density: NDArray[np.float64]
    step_hz: float
    segments: int

    def power(self, low_hz: float, high_hz: float) -> float:
        """Mean square of what lies in [low_hz, high_hz)."""
        inside = (self.frequency_hz >= low_hz) & (self.frequency_hz < high_hz)
        return float(np.sum(self.density[inside]) * self.step_hz)


def good_length(samples: int) -> int:
    """The largest length <= `samples` of which all prime factors are 2, 3 or 5, so that its FFT is fast."""
    if samples < 1:
        raise InputError("good_length", "samples", samples, "at least 1")
    best = 1
    power5 = 1
    while power5 <= samples:
        power3 = power5
        while power3 <= samples:
            best = max(best, power3 << ((samples // power3).bit_length() - 1))
            power3 *= 3
        power5 *= 5
    return best


def welch_psd(
    samples: NDArray[np.float32] | NDArray[np.float64], sample_rate_hz: float, step_hz: float
) -> Psd:
    """Welch's PSD with a Hann window, half overlap and lines about `step_hz` apart.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        Finite values.
    sample_rate_hz, step_hz : float
        The segments are `sample_rate_hz / step_hz` samples long, at most the whole signal.

    Returns
    -------
    Psd
        sum(density) * step_hz equals the mean over segments of the windowed segments' power: for white noise
        of variance v its expectation is v.
    """
    x = np.asarray(samples, dtype=np.float64)
    if x.ndim != 1 or x.size < 8:
        raise InputError("welch_psd", "samples", f"shape {x.shape}", "a vector of 8 samples or more")
    if not (np.isfinite(sample_rate_hz) and sample_rate_hz > 0 and step_hz > 0):
        raise InputError("welch_psd", "sample_rate, step", (sample_rate_hz, step_hz), "both above 0 Hz")
    length = good_length(int(min(x.size, max(8, round(sample_rate_hz / step_hz)))))
    x = x - np.mean(x)
    window = np.hanning(length + 1)[:-1]
    starts = np.arange(0, x.size - length + 1, max(1, length // 2))
    total = np.zeros(length // 2 + 1)
    for start in starts:
        total += np.abs(sfft.rfft(x[start : start + length] * window)) ** 2
    two_sided = np.full(total.size, 2.0)
    two_sided[0] = 1.0
    if length % 2 == 0:
        two_sided[-1] = 1.0
    density = total * two_sided / (starts.size * np.sum(window**2) * sample_rate_hz)
    step = sample_rate_hz / length
    return Psd(np.arange(density.size) * step, density, step, int(starts.size))
