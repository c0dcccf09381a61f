"""The autogram: which band's envelope repeats itself most sharply.

For every band of a binary tree the squared envelope's autocorrelation is formed, without bias, and of its
values over the lags

    V = K sum_q (R(q) - min R)^4 / ( sum_q (R(q) - min R)^2 )^2

is taken, which is large where R has narrow peaks at multiples of a period (Moshrefzadeh and Fasana, Mech.
Syst. Signal Process. 105 (2018) 294-318). A single knock has no second peak, so it does not win as it does in
the kurtogram. Three things differ from the paper: the bands are cut out of one FFT (its wavelet packets
overlap their neighbours); lags shorter than a band's own memory are left out, where every signal correlates
with itself; and the squared envelope is limited to its 99th percentile, so that a knock weighs no
more than any other moment in which the signal is loud.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.band_choice import BandChoice, levels_for
from gearsim_dsp.envelope import WindowSpectrum, squared_envelopes, window_spectrum
from gearsim_dsp.impulsive.band_map import BandMap, BandValue, choose_from
from gearsim_dsp.separation.checks import checked_count, checked_signal
from gearsim_io.errors import InputError

__all__ = ["autogram", "choose_by_autogram"]

_LEAST_SAMPLES = 1024
_LEAST_LINES = 64
_OWN_MEMORY = 4.0
_LOUD_SHARE = 0.01
_SPARSE = 8
_AT_ONCE = 1 << 20


def autogram(
    samples: NDArray[np.float32] | NDArray[np.float64],
    sample_rate_hz: float,
    levels: int = 6,
) -> BandMap:
    """V of every band of a binary tree.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        Finite values, at least 1024 and 2^(levels + 7).
    sample_rate_hz : float
    levels : int
        The narrowest bands are sample_rate / 2^(levels + 1) wide.

    Raises
    ------
    InputError
        Signal too short for so many levels, or not finite.
    """
    where = "autogram"
    levels = checked_count(where, "levels", levels, 1)
    least = max(_LEAST_SAMPLES, 2 * _LEAST_LINES << levels)
    x = checked_signal(where, samples, least, f"{levels} levels")
    return _autogram(window_spectrum(x, sample_rate_hz), levels)


def choose_by_autogram(
    samples: NDArray[np.float32] | NDArray[np.float64],
    sample_rate_hz: float,
    least_width_hz: float,
    rng: np.random.Generator,
) -> BandChoice:
    """The band of the largest V that the guards of `band_map` let through.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        Finite values, at least 1024.
    sample_rate_hz : float
    least_width_hz : float
        Narrowest band of use: twice the highest fault frequency sought.
    rng : Generator
        For the surrogates that tell what chance does.
    """
    where = "choose_by_autogram"
    x = checked_signal(where, samples, _LEAST_SAMPLES)
    if not 0 < least_width_hz < 0.5 * sample_rate_hz:
        raise InputError(where, "least_width_hz", least_width_hz, f"0 to {0.5 * sample_rate_hz:g} Hz")
    levels = min(levels_for(least_width_hz, sample_rate_hz), int(np.log2(x.size / (2 * _LEAST_LINES))))
    spectrum = window_spectrum(x, sample_rate_hz)
    return choose_from(lambda lines: _autogram(lines, levels), spectrum, x, least_width_hz, rng)


def _autogram(spectrum: WindowSpectrum, levels: int) -> BandMap:
    top_hz = 0.5 * spectrum.sample_rate_hz
    bands: list[BandValue] = []
    for level in range(levels + 1):
        count = 1 << level
        width_hz = top_hz / count
        # The lines at 0 and at half the rate belong to no band: one line less on either side.
        lows_hz = width_hz * np.arange(count)
        inner = np.maximum(lows_hz, spectrum.step_hz)
        envelopes = squared_envelopes(spectrum, inner, width_hz - 2 * spectrum.step_hz)
        first_lag = envelopes.rate_hz * _OWN_MEMORY / width_hz
        sharpness = _sharpness(envelopes.values, first_lag)
        power = envelopes.values.mean(axis=1, dtype=np.float64)
        bands += [
            BandValue(float(level), low, low + width_hz, value, mean_square)
            for low, value, mean_square in zip(
                lows_hz.tolist(), sharpness.tolist(), power.tolist(), strict=True
            )
        ]
    return BandMap("autogram", tuple(bands))


def _sharpness(values: NDArray[np.float32], first_lag: float) -> NDArray[np.float64]:
    """V over the lags from the first up to half the length; larger lags rest on too few products."""
    count = values.shape[1]
    first, last = max(1, int(np.ceil(first_lag))), count // 2
    padded = sfft.next_fast_len(count + last, real=True)
    weight = (1.0 / (count - np.arange(first, last))).astype(np.float32)
    rows = max(1, _AT_ONCE // padded)
    result = np.empty(values.shape[0])
    for row in range(0, values.shape[0], rows):
        some = values[row : row + rows]
        loud = np.quantile(some[:, ::_SPARSE], 1 - _LOUD_SHARE, axis=1, keepdims=True)
        some = np.minimum(some, loud.astype(np.float32))
        mean = some.mean(axis=1, keepdims=True)
        lines = sfft.rfft(some / np.maximum(mean, np.finfo(np.float32).tiny) - 1, padded, axis=1)
        correlation = sfft.irfft(lines.real**2 + lines.imag**2, padded, axis=1)[:, first:last] * weight
        correlation -= correlation.min(axis=1, keepdims=True)
        square = correlation * correlation
        second = square.mean(axis=1, dtype=np.float64)
        fourth = np.einsum("kn,kn->k", square, square, dtype=np.float64) / square.shape[1]
        result[row : row + rows] = fourth / np.maximum(second**2, np.finfo(np.float64).tiny)
    return result
