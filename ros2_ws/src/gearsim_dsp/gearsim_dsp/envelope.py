"""Squared envelope spectra of frequency bands, in Hz or in orders, from one FFT of the window.

For a band [a, b] the part of the signal's spectrum inside it, shifted to zero and transformed back, is
the analytic signal z(t) of the band at the low rate of about 2 (b - a); e = |z|^2 is the squared envelope
(Randall, Antoni and Chobsaard, Mech. Syst. Signal Process. 15 (2001) 945-962). Divided by its mean it has
no unit, and of stationary Gaussian noise its value is exponentially distributed around 1, in whatever
band.

Discrete lines (gear mesh, inverter, supply) beat against each other in the envelope. `suppress_lines`
limits every line of the spectrum to a few times the local median, the idea of cepstrum pre-whitening
(Borghesani et al., Mech. Syst. Signal Process. 36 (2013) 370-384) with the colour of the noise and the
weight of resonances left alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft
from scipy.signal.windows import tukey

from gearsim_dsp.speed import Phase
from gearsim_io.errors import InputError

__all__ = [
    "Envelopes",
    "WindowSpectrum",
    "both_spectra",
    "envelope_spectrum",
    "order_spectrum",
    "squared_envelopes",
    "suppress_lines",
    "window_spectrum",
]

_EDGE_SHARE = 0.04
_LINE_LIMIT = 10.0
_BLOCK_LINES = 128


@dataclass(frozen=True, slots=True, eq=False)
class WindowSpectrum:
    """One-sided complex spectrum of a tapered window of `samples` samples; line k at k / samples * rate."""

    lines: NDArray[np.complex64]
    samples: int
    sample_rate_hz: float

    @property
    def step_hz(self) -> float:
        """Distance of two lines."""
        return self.sample_rate_hz / self.samples


@dataclass(frozen=True, slots=True, eq=False)
class Envelopes:
    """Squared envelopes of several bands of one width.

    `values` is float32 of shape (bands, n) in the signal's unit squared: sample i belongs to sample index
    `first + i * stride` of the window; the tapered ends are cut off.
    """

    values: NDArray[np.float32]
    first: float
    stride: float
    rate_hz: float


def window_spectrum(
    samples: NDArray[np.float32] | NDArray[np.float64], sample_rate_hz: float
) -> WindowSpectrum:
    """Spectrum of a window without its mean; 4 % at either end are tapered against leakage."""
    x = samples
    if x.ndim != 1 or x.size < 64:
        raise InputError("window_spectrum", "samples", f"shape {x.shape}", "a vector of 64 samples or more")
    mean = float(np.mean(x, dtype=np.float64))
    centred = (x - x.dtype.type(mean)).astype(np.float32, copy=False) * _taper(x.size)
    return WindowSpectrum(sfft.rfft(centred), int(x.size), float(sample_rate_hz))


def suppress_lines(spectrum: WindowSpectrum, limit: float = _LINE_LIMIT) -> WindowSpectrum:
    """The spectrum with every line limited to `limit` times the median magnitude of its neighbourhood.

    The neighbourhood is 128 lines wide. Of Gaussian noise a share of 2^-(limit^2) of the lines is touched:
    none at the default of 10, 0.2 % at 3. Phases stay, so impulses keep their shape in time.
    """
    magnitude = np.abs(spectrum.lines)
    local = _local_median(magnitude)
    bound = limit * np.maximum(local, np.finfo(np.float32).tiny)
    factor = np.minimum(np.float32(1), bound / np.maximum(magnitude, np.finfo(np.float32).tiny))
    return replace(spectrum, lines=spectrum.lines * factor.astype(np.float32))


def both_spectra(
    samples: NDArray[np.float32] | NDArray[np.float64], sample_rate_hz: float
) -> tuple[WindowSpectrum, WindowSpectrum]:
    """The spectrum of a window, and the same with its lines limited (`suppress_lines`)."""
    spectrum = window_spectrum(samples, sample_rate_hz)
    return spectrum, suppress_lines(spectrum)


@lru_cache(maxsize=8)
def _taper(samples: int) -> NDArray[np.float32]:
    return np.asarray(tukey(samples, 2 * _EDGE_SHARE), dtype=np.float32)


@lru_cache(maxsize=32)
def _hann(samples: int) -> NDArray[np.float32]:
    return np.asarray(np.hanning(samples + 1)[:-1], dtype=np.float32)


def _local_median(values: NDArray[np.float32]) -> NDArray[np.float32]:
    blocks = max(1, values.size // _BLOCK_LINES)
    width = values.size // blocks
    medians = np.median(values[: blocks * width].reshape(blocks, width), axis=1)
    local = np.empty_like(values)
    local[: blocks * width].reshape(blocks, width)[:] = medians[:, np.newaxis]
    local[blocks * width :] = medians[-1]
    return local


def squared_envelopes(spectrum: WindowSpectrum, lows_hz: NDArray[np.float64], width_hz: float) -> Envelopes:
    """Squared envelopes of the bands [low, low + width], all of the same width.

    Parameters
    ----------
    spectrum : WindowSpectrum
    lows_hz : ndarray, shape (bands,)
    width_hz : float
        At least 16 lines of the spectrum.

    Raises
    ------
    InputError
        When a band is too narrow or leaves (0, sample_rate / 2).
    """
    lows = np.atleast_1d(np.asarray(lows_hz, dtype=np.float64))
    count = round(width_hz / spectrum.step_hz)
    starts = np.round(lows / spectrum.step_hz).astype(np.intp)
    if count < 16:
        raise InputError("squared_envelopes", "width_hz", width_hz, f"at least {16 * spectrum.step_hz:g} Hz")
    if starts.size == 0 or starts.min() < 1 or starts.max() + count > spectrum.lines.size:
        top = spectrum.sample_rate_hz / 2
        raise InputError("squared_envelopes", "lows_hz", lows.tolist(), f"bands inside (0, {top:g}) Hz")
    length = sfft.next_fast_len(2 * count)
    buffer = np.zeros((starts.size, length), dtype=np.complex64)
    for row, start in enumerate(starts):
        buffer[row, :count] = spectrum.lines[start : start + count]
    # A real signal's analytic signal has twice the one-sided lines; |z|^2 / 2 is then its local mean square.
    z = sfft.ifft(buffer, axis=1, overwrite_x=True) * np.float32(2 * length / spectrum.samples)
    squared = np.asarray((z.real**2 + z.imag**2) * np.float32(0.5), dtype=np.float32)
    cut = int(np.ceil(_EDGE_SHARE * length))
    stride = spectrum.samples / length
    return Envelopes(squared[:, cut : length - cut], cut * stride, stride, spectrum.sample_rate_hz / stride)


def envelope_spectrum(envelopes: Envelopes, padding: int = 2) -> tuple[NDArray[np.float64], float]:
    """Power of the mean-free squared envelopes over frequency, each envelope divided by its mean.

    Returns
    -------
    power : ndarray of float64, shape (bands, lines)
        A modulation 1 + m cos(2 pi f t) of the squared envelope gives m^2 / 4 at its line; of Gaussian noise
        in a band of width B over a time T a line has the mean 1.5 / (B T) at low frequency (Hann window).
    step_hz : float
        Distance of two lines, the resolution divided by `padding`.
    """
    power, lines = _spectrum(_normalised(envelopes.values), padding)
    return power, envelopes.rate_hz / lines


def order_spectrum(
    envelopes: Envelopes, phase: Phase, orders: float, order_step: float
) -> NDArray[np.float64]:
    """As `envelope_spectrum`, but over orders: the envelope is resampled at equal angles of the shaft.

    Parameters
    ----------
    envelopes : Envelopes
    phase : Phase
        Angle of the reference shaft over the window.
    orders : float
        Highest order wanted.
    order_step : float
        Distance of two lines wanted; the window must hold 1 / order_step turns at most (shorter windows are
        padded with zeros).

    Returns
    -------
    ndarray of float64, shape (bands, lines)
        Line k is at the order k * order_step, up to `orders`.
    """
    count = envelopes.values.shape[1]
    at = envelopes.first + envelopes.stride * np.arange(count)
    turns = np.interp(at, phase.samples, phase.turns)
    span = turns[-1] - turns[0]
    lines = round(1.0 / order_step)
    if not 0 < span <= lines:
        raise InputError("order_spectrum", "order_step", order_step, f"at most {1 / span:g}")
    per_turn = sfft.next_fast_len(int(np.ceil(max(count / span, 2.5 * orders))), real=True)
    grid = turns[0] + np.arange(int(span * per_turn)) / per_turn
    position = np.interp(grid, turns, np.arange(count, dtype=np.float64))
    left = np.minimum(position.astype(np.intp), count - 2)
    weight = (position - left).astype(np.float32)
    values = _normalised(envelopes.values)
    resampled = values[:, left] * (1 - weight) + values[:, left + 1] * weight
    total = lines * per_turn
    power, _ = _spectrum(resampled - resampled.mean(axis=1, keepdims=True), total / resampled.shape[1])
    return power[:, : int(orders / order_step) + 1]


def _normalised(values: NDArray[np.float32]) -> NDArray[np.float32]:
    mean = values.mean(axis=1, keepdims=True, dtype=np.float64).astype(np.float32)
    return np.asarray(values / np.maximum(mean, np.finfo(np.float32).tiny) - 1, dtype=np.float32)


def _spectrum(values: NDArray[np.float32], padding: float) -> tuple[NDArray[np.float64], int]:
    count = values.shape[1]
    window = _hann(count)
    length = round(count * padding)
    lines = sfft.rfft(values * window, n=length, axis=1)
    power = (lines.real.astype(np.float64) ** 2 + lines.imag.astype(np.float64) ** 2) / np.sum(window) ** 2
    return power, length
