"""How far an effect stands out, in dB: the same yardstick for all, so that "medium" means alike.

Two short records of one machine under the same noise, with and without the effect, are compared in three
ways: lines of the spectrum, lines of the squared envelope in three bands, and level and kurtosis. Of each way
counts the mean of the eight greatest changes in dB (of levels the one greatest), of the three ways the
greatest. Noise being the same in both, what does not change gives zero. Of an effect that is noise itself,
whose single lines scatter by chance, sixths of an octave are compared in place of lines.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

Array = NDArray[np.float64]
_TOP = 8
_BANDS = ((0.02, 0.1), (0.1, 0.25), (0.25, 0.45))  # of the rate
_ENVELOPE_HZ = 400.0
_LOWEST_HZ, _PER_OCTAVE = 40.0, 6


def stands_out_db(
    plain: NDArray[np.float32], changed: NDArray[np.float32], rate_hz: float, random: bool = False
) -> float:
    """Of all channels the greatest; records (channels, samples). `random`: the effect is noise itself."""
    found = 0.0
    for one, other in zip(plain.astype(np.float64), changed.astype(np.float64), strict=True):
        if random:
            found = max(found, _top(_bands(one, rate_hz), _bands(other, rate_hz)))
            continue
        found = max(found, _top(_lines(one, rate_hz), _lines(other, rate_hz)), _levels(one, other))
        for low, high in _BANDS:
            pair = [_envelope(x, low * rate_hz, high * rate_hz, rate_hz) for x in (one, other)]
            found = max(found, _top(*pair))
    return found


def _lines(x: Array, rate_hz: float, most_hz: float = np.inf) -> Array:
    """Power in lines as wide as a Hann window's, (lines,)."""
    spectrum = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(x.size))) ** 2
    inside = np.fft.rfftfreq(x.size, 1 / rate_hz) <= most_hz
    spectrum = spectrum[inside]
    return np.asarray(spectrum[: spectrum.size // 4 * 4].reshape(-1, 4).sum(axis=1))


def _bands(x: Array, rate_hz: float) -> Array:
    """Power in sixths of an octave, (bands,)."""
    spectrum = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(x.size))) ** 2
    f = np.fft.rfftfreq(x.size, 1 / rate_hz)
    count = int(_PER_OCTAVE * np.log2(0.45 * rate_hz / _LOWEST_HZ))
    edges = np.searchsorted(f, _LOWEST_HZ * 2 ** (np.arange(count + 1) / _PER_OCTAVE))
    return np.asarray(np.add.reduceat(spectrum, edges)[:-1])


def _envelope(x: Array, low_hz: float, high_hz: float, rate_hz: float) -> Array:
    band = sosfiltfilt(butter(4, (low_hz, high_hz), "bandpass", fs=rate_hz, output="sos"), x)
    squared = band**2
    return _lines(squared / squared.mean(), rate_hz, _ENVELOPE_HZ)


def _top(one: Array, other: Array) -> float:
    change = np.abs(10 * np.log10((other + 1e-300) / (one + 1e-300)))
    # Lines far below all others do not count, however much they change.
    alive = np.maximum(one, other) > 1e-7 * max(float(one.max()), float(other.max()))
    return float(np.mean(np.sort(change[alive])[-_TOP:])) if np.any(alive) else 0.0


def _levels(one: Array, other: Array) -> float:
    powers = [float(np.var(x)) for x in (one, other)]
    peaks = [float(np.mean((x - x.mean()) ** 4)) / p**2 for x, p in zip((one, other), powers, strict=True)]
    return max(abs(10 * np.log10(pair[1] / pair[0])) for pair in (powers, peaks))
