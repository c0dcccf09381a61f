"""Envelope spectra and cyclic coherence of 10 s at 65536 Hz beside what scipy offers for them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.fft import rfft
from scipy.signal import butter, csd, hilbert, sosfiltfilt

from gearsim_bringup.bench.clock import alternate
from gearsim_bringup.bench.figure import Figure, Goal
from gearsim_dsp.cyclic.correlation import cyclic_spectrum
from gearsim_dsp.cyclic.envelope_spectra import squared_envelope_spectrum

BAND_HZ = (4000.0, 8000.0)
HIGHEST_HZ, RESOLUTION_HZ = 400.0, 64.0


def figures(signal: NDArray[np.float64], rate_hz: float) -> Iterator[Figure]:
    """Squared envelope spectrum with its floor and tests; coherence at 8,000 cyclic frequencies."""
    own, peer = alternate(
        lambda: squared_envelope_spectrum(signal, rate_hz, BAND_HZ, HIGHEST_HZ),
        lambda: _plain_ses(signal, rate_hz),
    )
    yield Figure("dsp.ses_s", own, "s", Goal("<=", 1, on_ratio=True), ("scipy band-pass + hilbert", peer))
    own, peer = alternate(
        lambda: cyclic_spectrum(signal, rate_hz, RESOLUTION_HZ, HIGHEST_HZ).squared_coherence(),
        lambda: _one_slice(signal, rate_hz),
        3,
    )
    yield Figure("dsp.coherence_s", own, "s", Goal("<=", 3), ("scipy csd at one cyclic frequency", peer))


def _plain_ses(signal: NDArray[np.float64], rate_hz: float) -> NDArray[np.float64]:
    sections = butter(4, BAND_HZ, "bandpass", fs=rate_hz, output="sos")
    squared = np.abs(hilbert(sosfiltfilt(sections, signal))) ** 2
    return np.asarray(np.abs(rfft(squared - squared.mean())) ** 2)


def _one_slice(signal: NDArray[np.float64], rate_hz: float) -> NDArray[np.complex128]:
    length = round(rate_hz / RESOLUTION_HZ)
    shifted = signal * np.exp(-1j * np.pi * 48.8 / rate_hz * np.arange(signal.size))
    _, density = csd(
        shifted.conj(), shifted, rate_hz, nperseg=length, noverlap=3 * length // 4, return_onesided=False
    )
    return np.asarray(density)
