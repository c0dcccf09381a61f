"""The real cepstrum, and signals edited in it.

The real cepstrum is the inverse Fourier transform of the logarithm of the magnitude spectrum; over its axis,
the quefrency in seconds, a family of equally spaced lines or sidebands becomes a few peaks (rahmonics) at
multiples of the inverse spacing, and a resonance a part near zero. What is changed there (liftered) goes back
into the magnitude, the phase stays, and so a signal in time comes out (Randall and Sawalhi, Sound and
Vibration 45 (2011) 12-15; Randall, Antoni and Smith, Mech. Syst. Signal Process. 118 (2019) 780-803).
Setting all of the cepstrum to zero is pre-whitening (CPW; Borghesani, Pennacchi, Randall, Sawalhi and Ricci,
Mech. Syst. Signal Process. 36 (2013) 370-384): every line of the spectrum gets the same magnitude, so meshes
and resonances lose their weight, and impacts, made of many lines in phase, remain.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft as sfft
from scipy.signal.windows import tukey

from gearsim_dsp.separation.checks import checked_signal
from gearsim_io.errors import InputError

__all__ = ["comb_lifter", "exponential_lifter", "liftered", "prewhitened", "real_cepstrum"]

_LEAST_SAMPLES = 16
# Lines this far below the strongest hold rounding errors (the FFT's is 1e-16 of the strongest), not signal.
_EMPTY = 1e-14


def real_cepstrum(signal: ArrayLike) -> NDArray[np.float64]:
    """Real cepstrum of a signal.

    Parameters
    ----------
    signal : array_like, shape (n,)
        Finite samples, at least 16.

    Returns
    -------
    ndarray of float64, shape (n,)
        Sample k is at the quefrency k / sample_rate and equals sample n - k; no unit but for sample 0, the
        mean of the logarithm of the magnitudes.
    """
    x = checked_signal("real_cepstrum", signal, _LEAST_SAMPLES)
    logarithm, _ = _log_magnitude(sfft.rfft(x))
    return np.asarray(sfft.irfft(logarithm, x.size))


def prewhitened(
    signal: ArrayLike,
    *,
    band_hz: tuple[float, float] | None = None,
    sample_rate_hz: float = 1.0,
    tapered_share: float = 0.01,
) -> NDArray[np.float64]:
    """The signal with every line of its spectrum at the same magnitude, the geometric mean of all (CPW).

    Parameters
    ----------
    signal : array_like, shape (n,)
        Finite samples, at least 16.
    band_hz : (float, float), optional
        Lines outside are set to zero. Without it empty bands, such as those beyond an anti-alias filter, are
        raised to the level of all others.
    sample_rate_hz : float
        For `band_hz` only.
    tapered_share : float
        Share of the signal faded in at its beginning and out at its end. The spectrum takes the signal to
        repeat itself; the jump from its end to its beginning is all that is found in empty bands, and raised
        with them it is a knock at the record's ends that outdoes everything else.

    Returns
    -------
    ndarray of float64, shape (n,)
        In the signal's unit. All zeros for a signal of zeros.
    """
    x = checked_signal("prewhitened", signal, _LEAST_SAMPLES)
    if not 0.0 <= tapered_share <= 0.5:
        raise InputError("prewhitened", "tapered_share", tapered_share, "0 to 0.5")
    lines = sfft.rfft((x - np.mean(x)) * tukey(x.size, 2 * tapered_share) if tapered_share else x)
    if band_hz is not None:
        low, high = band_hz
        if not 0.0 <= low < high <= 0.5 * sample_rate_hz:
            raise InputError(
                "prewhitened", "band_hz", band_hz, f"a band within 0 to {0.5 * sample_rate_hz:g}"
            )
        step_hz = sample_rate_hz / x.size
        lines[: int(np.ceil(low / step_hz))] = 0.0
        lines[int(high / step_hz) + 1 :] = 0.0
    logarithm, filled = _log_magnitude(lines)
    if not filled.any():
        return np.zeros(x.size)
    level = np.exp(_two_sided_mean(logarithm, filled, x.size))
    magnitude = np.abs(lines)
    factor = np.divide(level, magnitude, out=np.zeros(magnitude.size), where=filled)
    return np.asarray(sfft.irfft(lines * factor, x.size))


def liftered(signal: ArrayLike, lifter: ArrayLike) -> NDArray[np.float64]:
    """The signal with its real cepstrum multiplied by a lifter, phases kept.

    Parameters
    ----------
    signal : array_like, shape (n,)
        Finite samples, at least 16.
    lifter : array_like, shape (n // 2 + 1,)
        Weight of each quefrency from 0 on; the mirrored half follows.

    Returns
    -------
    ndarray of float64, shape (n,)
        In the signal's unit where the weight of quefrency 0 is 1.
    """
    where = "liftered"
    x = checked_signal(where, signal, _LEAST_SAMPLES)
    weight = checked_signal(where, lifter, 1)
    if weight.size != x.size // 2 + 1:
        raise InputError(where, "lifter", f"{weight.size} weights", f"{x.size // 2 + 1} for {x.size} samples")
    lines = sfft.rfft(x)
    logarithm, filled = _log_magnitude(lines)
    if not filled.any():
        return np.zeros(x.size)
    cepstrum = sfft.irfft(logarithm, x.size)
    mirrored = np.concatenate((weight, weight[1 : (x.size + 1) // 2][::-1]))
    wanted = sfft.rfft(cepstrum * mirrored).real
    factor = np.where(filled, np.exp(wanted - logarithm), 0.0)
    return np.asarray(sfft.irfft(lines * factor, x.size))


def comb_lifter(samples: int, period: float, width: float = 0.0) -> NDArray[np.float64]:
    """Zero at the rahmonics of one family of lines, one elsewhere: removes shaft or mesh harmonics.

    Parameters
    ----------
    samples : int
        Of the signal.
    period : float
        Samples per turn or mesh: sample_rate / spacing of the lines.
    width : float
        Half width of the notch at the first rahmonic in samples, growing in proportion to the rahmonic's
        number as an error of the period does; at least one sample. A speed that varies by 0.1 % asks for
        0.001 * period.

    Returns
    -------
    ndarray of float64, shape (samples // 2 + 1,)
    """
    if not (np.isfinite(period) and 4.0 <= period <= samples / 2):
        raise InputError("comb_lifter", "period", period, f"4 to {samples / 2:g} samples")
    if not 0.0 <= width < 0.5 * period:
        raise InputError("comb_lifter", "width", width, f"0 to {0.5 * period:g} samples")
    quefrency = np.arange(samples // 2 + 1)
    number = np.maximum(np.round(quefrency / period), 1.0)
    reach = np.minimum(np.maximum(width * number, 1.0), 0.5 * period)
    weight = np.ones(quefrency.size)
    weight[np.abs(quefrency - number * period) <= reach] = 0.0
    return weight


def exponential_lifter(samples: int, decay: float) -> NDArray[np.float64]:
    """exp(-k / decay): keeps resonances, adds damping to them, and removes lines and sidebands.

    In the cepstrum a resonance is a decaying cosine, so this changes its damping by an amount known in
    advance: 1 / (2 pi decay) cycles per sample of half the 3 dB width (Randall, Antoni and Smith, 2019).

    Parameters
    ----------
    samples : int
        Of the signal.
    decay : float
        Quefrency in samples where the weight is 1 / e.

    Returns
    -------
    ndarray of float64, shape (samples // 2 + 1,)
    """
    if not (np.isfinite(decay) and decay > 0):
        raise InputError("exponential_lifter", "decay", decay, "above 0 samples")
    return np.asarray(np.exp(-np.arange(samples // 2 + 1) / decay))


def _log_magnitude(lines: NDArray[np.complex128]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Logarithm of the magnitudes, empty lines taken as the smallest; and which lines are not empty."""
    magnitude = np.abs(lines)
    filled = magnitude > _EMPTY * float(magnitude.max())
    if not filled.any():
        return np.zeros(magnitude.size), filled
    floor = float(magnitude[filled].min())
    return np.log(np.maximum(magnitude, floor)), filled


def _two_sided_mean(values: NDArray[np.float64], filled: NDArray[np.bool_], samples: int) -> float:
    weight = np.where(filled, 2.0, 0.0)
    weight[0] *= 0.5
    if samples % 2 == 0:
        weight[-1] *= 0.5
    return float(np.sum(weight * values) / np.sum(weight))
