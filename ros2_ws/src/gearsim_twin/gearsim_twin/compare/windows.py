"""Power spectra of overlapping windows, window by window, so that their scatter can be seen.

Each window's spectrum is scaled so that a sine of mean square P shows P at its bin; with a Hann window it
shows in five bins whose sum is 1.5 P wherever between two bins it lies.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.noise_floor import effective_averages, local_floor

__all__ = ["HANN_SUM", "WindowSpectra", "cut", "hann", "spectra_of", "window_starts"]

HANN_SUM = 1.5
"""Sum of a Hann-windowed line's bins over its peak; also the noise bandwidth in bins."""

_FLOOR_BINS = 64


@dataclass(frozen=True, slots=True, eq=False)
class WindowSpectra:
    """Spectra of the windows of one signal.

    Attributes
    ----------
    power : ndarray of float64, shape (windows, lines)
    step : float
        Distance of two lines, in Hz or orders.
    averages : float
        Independent windows that the overlapping ones amount to, for noise.
    floor : ndarray of float64, shape (lines,)
        Mean power of noise at every line, between sparse lines.
    """

    power: NDArray[np.float64]
    step: float
    averages: float
    floor: NDArray[np.float64]

    @property
    def windows(self) -> int:
        """Windows, overlapping by half."""
        return int(self.power.shape[0])

    @property
    def mean(self) -> NDArray[np.float64]:
        """Mean power at every line."""
        return np.asarray(self.power.mean(axis=0))


def window_starts(samples: int, length: int) -> NDArray[np.int64]:
    """First samples of windows that overlap by half."""
    return np.arange(0, samples - length + 1, max(1, length // 2), dtype=np.int64)


@lru_cache(maxsize=16)
def hann(length: int) -> NDArray[np.float64]:
    """Periodic Hann window, read-only."""
    window = np.asarray(0.5 - 0.5 * np.cos(2 * np.pi * np.arange(length) / length))
    window.flags.writeable = False
    return window


def cut(x: NDArray[np.float64], length: int) -> NDArray[np.float64]:
    """The windows of a signal, shape (windows, length); a view."""
    frames = np.lib.stride_tricks.sliding_window_view(x, length)
    return np.asarray(frames[window_starts(x.size, length)])


def spectra_of(windows: NDArray[np.float64], step: float) -> WindowSpectra:
    """Spectra of windows of shape (windows, length) that overlap by half.

    Parameters
    ----------
    windows : ndarray
    step : float
        Distance of two lines of their spectra.
    """
    length = windows.shape[1]
    lines = sfft.rfft(windows * hann(length), axis=1)
    power = np.asarray((lines.real**2 + lines.imag**2) * (2.0 / (0.5 * length) ** 2))
    starts = np.arange(windows.shape[0], dtype=np.int64) * max(1, length // 2)
    averages = effective_averages(starts, length)
    mean = np.maximum(power.mean(axis=0), np.finfo(np.float64).tiny)
    first = 3  # leakage of the mean
    block = min(_FLOOR_BINS, max(16, mean.size - first))
    floor = local_floor(mean, block, averages, first)
    return WindowSpectra(power, step, averages, floor)
