"""The protrugram: in which band the envelope's spectrum has the clearest lines.

A band of fixed width is moved over the spectrum in small steps; of each the kurtosis of the envelope
spectrum's amplitudes is taken (Barszcz and Jablonski, Mech. Syst. Signal Process. 25 (2011) 431-451). Noise
gives Rayleigh amplitudes, lines stand out. It asks for periodicity, not for impulses, so it bears knocks and
low signal-to-noise ratios that mislead the kurtogram, and it answers to any modulation, that of sound gears
too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.band_choice import BandChoice
from gearsim_dsp.envelope import WindowSpectrum, squared_envelopes, window_spectrum
from gearsim_dsp.impulsive.band_map import BandMap, BandValue, choose_from
from gearsim_dsp.separation.checks import checked_signal
from gearsim_io.errors import InputError

__all__ = ["choose_by_protrugram", "protrugram"]

_LEAST_SAMPLES = 1024
_LEAST_LINES = 64
_ROWS = 32


def protrugram(
    samples: NDArray[np.float32] | NDArray[np.float64],
    sample_rate_hz: float,
    width_hz: float,
    step_hz: float | None = None,
) -> BandMap:
    """Kurtosis of the envelope spectrum's amplitudes of bands `width_hz` wide, `step_hz` apart.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        Finite values, at least 1024, and so many that the band holds 64 lines.
    sample_rate_hz : float
    width_hz : float
        A little more than three times the fault frequency sought.
    step_hz : float, optional
        A quarter of the width by default.

    Raises
    ------
    InputError
        Signal too short or not finite, band or step out of range.
    """
    x = checked_signal("protrugram", samples, _LEAST_SAMPLES)
    step = _checked_step("protrugram", x.size, sample_rate_hz, width_hz, step_hz)
    return _protrugram(window_spectrum(x, sample_rate_hz), width_hz, step)


def choose_by_protrugram(
    samples: NDArray[np.float32] | NDArray[np.float64],
    sample_rate_hz: float,
    width_hz: float,
    rng: np.random.Generator,
) -> BandChoice:
    """The band of the largest kurtosis that the guards of `band_map` let through.

    Parameters
    ----------
    samples, sample_rate_hz, width_hz
        As in `protrugram`.
    rng : Generator
        For the surrogates that tell what chance does.
    """
    x = checked_signal("choose_by_protrugram", samples, _LEAST_SAMPLES)
    step = _checked_step("choose_by_protrugram", x.size, sample_rate_hz, width_hz, None)
    spectrum = window_spectrum(x, sample_rate_hz)
    return choose_from(lambda lines: _protrugram(lines, width_hz, step), spectrum, x, 0.99 * width_hz, rng)


def _checked_step(
    where: str, samples: int, sample_rate_hz: float, width_hz: float, step_hz: float | None
) -> float:
    if not (np.isfinite(sample_rate_hz) and sample_rate_hz > 0):
        raise InputError(where, "sample_rate_hz", sample_rate_hz, "above 0 Hz")
    least = _LEAST_LINES * sample_rate_hz / samples
    if not least <= width_hz <= 0.4 * sample_rate_hz:
        raise InputError(where, "width_hz", width_hz, f"{least:g} to {0.4 * sample_rate_hz:g} Hz")
    step = 0.25 * width_hz if step_hz is None else step_hz
    if not sample_rate_hz / samples <= step <= width_hz:
        raise InputError(where, "step_hz", step, f"{sample_rate_hz / samples:g} to {width_hz:g} Hz")
    return float(step)


def _protrugram(spectrum: WindowSpectrum, width_hz: float, step_hz: float) -> BandMap:
    top_hz = 0.5 * spectrum.sample_rate_hz - width_hz - 2 * spectrum.step_hz
    lows_hz = np.arange(2 * spectrum.step_hz, top_hz, step_hz)
    bands: list[BandValue] = []
    for first in range(0, lows_hz.size, _ROWS):
        some_hz = lows_hz[first : first + _ROWS]
        squared = squared_envelopes(spectrum, some_hz, width_hz).values
        values = _line_kurtosis(np.sqrt(squared))
        power = squared.mean(axis=1, dtype=np.float64)
        bands += [
            BandValue(0.0, low, low + width_hz, value, mean_square)
            for low, value, mean_square in zip(some_hz.tolist(), values.tolist(), power.tolist(), strict=True)
        ]
    return BandMap("protrugram", tuple(bands))


def _line_kurtosis(envelope: NDArray[np.float32]) -> NDArray[np.float64]:
    """Kurtosis over the lines up to half the band's width, where two thirds of the noise's lines lie."""
    count = envelope.shape[1]
    centred = envelope - envelope.mean(axis=1, keepdims=True)
    amplitude = np.abs(sfft.rfft(centred * np.hanning(count).astype(np.float32), axis=1))
    # The envelope is sampled at twice the band's width, so this is up to a quarter of its rate.
    lines = amplitude[:, 3 : count // 4].astype(np.float64)
    lines -= lines.mean(axis=1, keepdims=True)
    second = np.mean(lines**2, axis=1)
    return np.asarray(np.mean(lines**4, axis=1) / np.maximum(second**2, np.finfo(np.float64).tiny))
