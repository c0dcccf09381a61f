"""The spectral correlation at a few given cyclic frequencies, before and after something is taken out.

The averaged cyclic periodogram in its symmetric form: with u(t) = x(t) exp(-j pi a t) and v(t) its
counterpart turned the other way, S(a, f) = E[ U(f) V*(f) ] is the cross-spectrum of u and v, the correlation
of the lines at f + a/2 and f - a/2 (Gardner, IEEE Trans. Inf. Theory 32 (1986) 197-200). Welch's method with
Hann windows that overlap by three quarters estimates it without bias from the framing (Antoni, Mech. Syst.
Signal Process. 21 (2007) 597-630, sec. 4). At a = 0 it is the power spectral density.

Gears mask extended faults of bearings. What tells them apart is that gear lines can be foretold and the
modulated noise of a rough race cannot, so the slice at the shaft's speed (inner race) or the ball pass
frequency (outer race) is looked at after removal of the deterministic part (Antoni and Randall, J. Vib.
Acoust. 124 (2002) 282-290).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import csd

from gearsim_dsp.noise_floor import effective_averages
from gearsim_dsp.spectra import good_length
from gearsim_io.errors import InputError

__all__ = ["BeforeAfter", "SpectralSlices", "gain_db", "slices_before_and_after", "spectral_slices"]

_OVERLAP = 0.75
_LEAST_SEGMENTS = 4


@dataclass(frozen=True, slots=True, eq=False)
class SpectralSlices:
    """Slices of the spectral correlation, one row per cyclic frequency.

    Parameters
    ----------
    alphas_hz : tuple of float
    frequency_hz : ndarray of float64, shape (lines,)
    density : ndarray of complex128, shape (alphas, lines)
        One-sided, in the signal's unit squared per Hz.
    bound : ndarray of float64, shape (alphas, lines)
        Geometric mean of the power spectral densities at f + a/2 and f - a/2, which |density| cannot exceed.
    averages : float
        Independent averages behind each value.
    """

    alphas_hz: tuple[float, ...]
    frequency_hz: NDArray[np.float64]
    density: NDArray[np.complex128]
    bound: NDArray[np.float64]
    averages: float

    def level_db(self) -> NDArray[np.float64]:
        """10 log10 of |density|, shape (alphas, lines)."""
        return np.asarray(10 * np.log10(np.maximum(np.abs(self.density), np.finfo(np.float64).tiny)))

    def squared_coherence(self) -> NDArray[np.float64]:
        """|density|^2 over its bound squared, 0..1, shape (alphas, lines)."""
        power = np.abs(self.density) ** 2
        bound = self.bound**2
        ratio = np.divide(power, bound, out=np.zeros_like(power), where=bound > 0)
        return np.asarray(np.minimum(ratio, 1.0))

    def chance_db(self, false_alarm: float = 1e-3) -> NDArray[np.float64]:
        """What stationary noise of the same spectrum exceeds with that probability in one line, in dB."""
        if not 0 < false_alarm < 1:
            raise InputError("SpectralSlices", "false_alarm", false_alarm, "a probability between 0 and 1")
        squared = -np.expm1(np.log(false_alarm) / (self.averages - 1.0))
        level = self.bound * np.sqrt(squared)
        return np.asarray(10 * np.log10(np.maximum(level, np.finfo(np.float64).tiny)))

    def mean_level(self, row: int, low_hz: float, high_hz: float) -> float:
        """Mean of |density| over [low_hz, high_hz) in the slice of that row."""
        inside = (self.frequency_hz >= low_hz) & (self.frequency_hz < high_hz)
        if not np.any(inside):
            top = float(self.frequency_hz[-1])
            raise InputError("SpectralSlices", "band_hz", (low_hz, high_hz), f"a band inside 0..{top:g} Hz")
        return float(np.mean(np.abs(self.density[row, inside])))


@dataclass(frozen=True, slots=True, eq=False)
class BeforeAfter:
    """Slices of a signal and of what is left of it; `removed_share` is the power share taken out."""

    before: SpectralSlices
    after: SpectralSlices
    removed_share: float


def spectral_slices(
    samples: NDArray[np.float32] | NDArray[np.float64],
    sample_rate_hz: float,
    alphas_hz: Sequence[float],
    step_hz: float,
) -> SpectralSlices:
    """Slices at given cyclic frequencies.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        Finite values. Resampled at equal angles, with samples per turn in place of the rate, all frequencies
        are orders.
    sample_rate_hz : float
    alphas_hz : sequence of float
        From 0 to half the rate. Each must be right within half the inverse of the duration: a wrong one reads
        low. 0 gives the power spectral density.
    step_hz : float
        Distance of the lines over the carrier frequency; segments are `sample_rate_hz / step_hz` long. Far
        more than the cyclic frequencies resolves what they modulate, far less makes them lines.

    Returns
    -------
    SpectralSlices

    Raises
    ------
    InputError
        When the record is shorter than four segments (it says how long it must be), or a cyclic frequency is
        out of range.
    """
    x = np.asarray(samples, dtype=np.float64)
    if x.ndim != 1 or not np.all(np.isfinite(x)):
        raise InputError("spectral_slices", "samples", f"shape {x.shape}", "a vector of finite values")
    if not (np.isfinite(sample_rate_hz) and 0 < step_hz <= sample_rate_hz / 16):
        expected = "a rate above 0 and a step of at most a 16th of it"
        raise InputError("spectral_slices", "sample_rate_hz, step_hz", (sample_rate_hz, step_hz), expected)
    if x.size * step_hz < _LEAST_SEGMENTS * sample_rate_hz:
        expected = f"at least {_LEAST_SEGMENTS / step_hz:.3g} s at a step of {step_hz:g} Hz"
        raise InputError("spectral_slices", "duration", f"{x.size / sample_rate_hz:.3g} s", expected)
    for alpha in alphas_hz:
        if not 0 <= alpha < 0.5 * sample_rate_hz:
            raise InputError("spectral_slices", "alphas_hz", alpha, f"0 to {0.5 * sample_rate_hz:g} Hz")
    length = good_length(round(sample_rate_hz / step_hz))
    x = x - np.mean(x)
    pairs = [_slice(x, sample_rate_hz, float(alpha), length) for alpha in alphas_hz]
    hop = length - int(_OVERLAP * length)
    starts = np.arange(0, x.size - length + 1, hop)
    return SpectralSlices(
        tuple(float(alpha) for alpha in alphas_hz),
        np.arange(length // 2 + 1) * sample_rate_hz / length,
        np.stack([density for density, _ in pairs]),
        np.stack([bound for _, bound in pairs]),
        _averages(starts, length),
    )


def _slice(
    x: NDArray[np.float64], rate_hz: float, alpha_hz: float, length: int
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    shift = np.exp(-1j * np.pi * alpha_hz / rate_hz * np.arange(x.size))
    up = x * shift
    shown = slice(0, length // 2 + 1)
    # |V|^2 is |U|^2 mirrored, since v is the conjugate of u.
    cross, power = (
        csd(
            one,
            up,
            fs=rate_hz,
            window="hann",
            nperseg=length,
            noverlap=int(_OVERLAP * length),
            detrend=False,
            return_onesided=False,
        )[1]
        for one in (up.conj(), up)
    )
    power = power.real
    mirrored = np.roll(power[::-1], 1)
    bound = np.sqrt(np.maximum(power[shown] * mirrored[shown], 0.0))
    return 2.0 * cross[shown], 2.0 * bound


def _averages(starts: NDArray[np.intp], length: int) -> float:
    """Of very many segments a thousand stand for all."""
    part = starts[:1000].astype(np.int64)
    return effective_averages(part, length) * starts.size / part.size


def slices_before_and_after(
    samples: NDArray[np.float32] | NDArray[np.float64],
    sample_rate_hz: float,
    alphas_hz: Sequence[float],
    step_hz: float,
    remove: Callable[[NDArray[np.float64]], NDArray[np.float64]],
) -> BeforeAfter:
    """Slices of a signal, and of the random part that `remove` leaves of it.

    Parameters
    ----------
    samples, sample_rate_hz, alphas_hz, step_hz
        As in `spectral_slices`.
    remove : callable
        Takes the samples and returns what is left, of the same length, such as
        ``lambda x: drs(x, delay, length)[1]``.
    """
    x = np.asarray(samples, dtype=np.float64)
    before = spectral_slices(x, sample_rate_hz, alphas_hz, step_hz)
    left = np.asarray(remove(x), dtype=np.float64)
    if left.shape != x.shape:
        raise InputError("slices_before_and_after", "remove", f"shape {left.shape}", f"shape {x.shape}")
    after = spectral_slices(left, sample_rate_hz, alphas_hz, step_hz)
    whole = float(np.var(x))
    share = 1.0 - float(np.var(left)) / whole if whole > 0 else 0.0
    return BeforeAfter(before, after, share)


def gain_db(faulty: SpectralSlices, sound: SpectralSlices, row: int, low_hz: float, high_hz: float) -> float:
    """By how much a slice of one record lies above that of another in a band, in dB of the mean |density|."""
    ratio = faulty.mean_level(row, low_hz, high_hz) / max(sound.mean_level(row, low_hz, high_hz), 1e-300)
    return float(10 * np.log10(max(ratio, 1e-300)))
