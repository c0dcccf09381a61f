"""What a bank of sampled resonators lacks of a casing's responses: a short filter without resonances.

A mode's acceleration per force is s^2 / (s^2 + 2 zeta w s + w^2) = 1 + C / (s - p) + C* / (s - p*). Sampled
at steps h, a recursion with the pole e^{p h} follows C / (s - p) exactly at the resonance; what is missing,

    h C [ 1 / (s - p) / h - 1 / (1 - e^{(p - s) h}) ]

is smooth in frequency, as its next poles lie a whole sample rate beyond. That holds for all modes, so all
that is missing between one seat and one site is one smooth function, and some sixty taps about the present
sample meet it over the whole band in which signals may lie. So is the residual, -w^2 R, and what modes above
half the sample rate add.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.frf.responses import CasingResponses
from gearsim_sim.integrate.decimate import PASS_BAND

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
HALF_LENGTH = 32  # samples that it reaches to each side
_POINTS = 512  # frequencies at which it is fitted: 16 for each pair of taps
# Weight of what lies above the band, where nothing is to be met, against gains that grow beyond measure.
_BEYOND = 1e-3
# Rates of rolling and shafts are low and their forces large: errors count more there, down to this share.
_LOW = 0.02


@dataclass(frozen=True, eq=False)
class Resonators:
    """x_n = decay x_{n-1} + gain f_n, one for each mode below half the sample rate; its output is Re(x)."""

    decay: Complex
    gain: Complex
    modes: NDArray[np.bool_]
    """Which of all modes."""


def resonators(responses: CasingResponses, rate_hz: float) -> Resonators:
    """The recursions of a casing's modes at a sample rate."""
    inside = responses.omega < np.pi * rate_hz
    omega, ratios = responses.omega[inside], responses.ratios[inside]
    own = omega * np.sqrt(1 - ratios**2)
    pole = -ratios * omega + 1j * own
    # With the conjugate pole the output is twice a real part.
    return Resonators(np.exp(pole / rate_hz), pole**2 / (1j * own) / rate_hz, inside)


def smooth_rest(responses: CasingResponses, rate_hz: float) -> tuple[Array, float]:
    """Taps of what the resonators lack, and the largest error of the sum.

    Returns
    -------
    taps : ndarray, shape (sites, inputs, 2 HALF_LENGTH + 1)
        Tap k meets the force k - HALF_LENGTH samples later.
    error : float
        Largest deviation from the responses up to `PASS_BAND` of the rate, over their largest value there.
    """
    angles = np.pi * (np.arange(_POINTS) + 0.5) / _POINTS
    inside = angles <= 2 * np.pi * PASS_BAND
    exact = responses.accelerances(angles[inside] * rate_hz / (2 * np.pi))
    missing = exact - _sampled(responses, rate_hz, angles[inside])
    lags = np.arange(-HALF_LENGTH, HALF_LENGTH + 1)
    turning = np.exp(1j * angles[:, None] * lags)
    weights = np.where(inside, 1 + _LOW / angles, _BEYOND)
    rows = np.concatenate([(turning * weights[:, None]).real, (turning * weights[:, None]).imag])
    flat = missing.reshape(-1, missing.shape[-1]).T * weights[inside, None]
    target = np.zeros((2, _POINTS, flat.shape[1]))
    target[:, inside] = flat.real, flat.imag
    taps = np.linalg.lstsq(rows, target.reshape(2 * _POINTS, -1), rcond=None)[0].T
    still, steady = _at_low_rates(responses, rate_hz)
    tilt = (steady.ravel() - taps @ lags) / 2
    taps[:, HALF_LENGTH + 1] += tilt
    taps[:, HALF_LENGTH - 1] -= tilt
    taps[:, HALF_LENGTH] += still.ravel() - taps.sum(axis=1)
    left = np.abs(taps @ turning[inside].T - missing.reshape(-1, missing.shape[-1]))
    return taps.reshape(*missing.shape[:2], -1), float(left.max() / np.abs(exact).max())


def _sampled(responses: CasingResponses, rate_hz: float, angles: Array) -> Complex:
    """What the resonators give at these frequencies [rad per sample], (sites, inputs, angles)."""
    own = resonators(responses, rate_hz)
    back = np.exp(-1j * angles)
    each = own.gain[:, None] / (1 - own.decay[:, None] * back)
    each = (each + own.gain.conj()[:, None] / (1 - own.decay.conj()[:, None] * back)) / 2
    pairs = responses.site_shapes[:, None, own.modes] * responses.input_shapes[:, own.modes]
    return np.asarray(pairs @ each)


def _at_low_rates(responses: CasingResponses, rate_hz: float) -> tuple[Array, Array]:
    """Sum of the taps, and sum with their lags, with which low frequencies come through as their squares.

    The first one for forces that do not change, the second one for forces that grow steadily: neither moves
    anything for good.
    """
    own = resonators(responses, rate_hz)
    pairs = responses.site_shapes[:, None, own.modes] * responses.input_shapes[:, own.modes]
    still = own.gain / (1 - own.decay)
    return -(pairs @ still.real), np.asarray(pairs @ (still * own.decay / (1 - own.decay)).real)
