"""What thesis 7.8.2 does with a planetary record: AR residual of the most impulsive length, and its impulses.

Works on the signal alone; of the machine it knows the speed of the carrier, as a tacho tells it.
"""

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.signal import find_peaks, lfilter

RATE_HZ = 16384.0
# Filter lengths tried. Thesis 7.8.2: up to a quarter of the time between expected impulses; with eight for
# each turn of the carrier at 2.13 Hz that is 14.6 ms, 240 samples.
ORDERS = (20, 60, 120, 240)
# The residual holds echoes of an impulse for the filter's length; impulses closer than twice that are one.
APART_S = 0.03
SMOOTH_S = 4e-3


def kurtosis(x):
    """Fourth moment over squared variance: 3 for noise."""
    x = x - np.mean(x)
    return float(np.mean(x**4) / np.mean(x**2) ** 2)


def ar_residual(x, order):
    """What a linear prediction of this order from the samples before leaves, by Yule and Walker."""
    x = x - np.mean(x)
    spectrum = np.fft.rfft(x, 2 * x.size)
    lags = np.fft.irfft(np.abs(spectrum) ** 2)[: order + 1] / x.size
    lags[0] *= 1 + 1e-10  # against rounding: lines make the matrix nearly singular
    taps = solve_toeplitz(lags[:order], lags[1:])
    return lfilter(np.concatenate([[1.0], -taps]), 1.0, x)[order:]


def best_residual(x, orders=ORDERS):
    """The residual of largest kurtosis among the filter lengths (Sawalhi et al. 2007)."""
    residuals = [ar_residual(x, order)[: -int(0.01 * RATE_HZ)] for order in orders]
    return max(residuals, key=kurtosis)


def envelope(residuals):
    """Smoothed magnitude of one residual or of several together, over its median."""
    power = sum(residual**2 for residual in np.atleast_2d(residuals))
    window = np.hanning(int(SMOOTH_S * RATE_HZ))
    found = np.sqrt(np.convolve(power, window / window.sum(), "same"))
    return found / np.median(found)


def impulses(residuals, carrier_hz, turns=4, threshold=1.7):
    """Times in the residual [s] and heights of the impulses in `turns` turns of the carrier at its end.

    The stretch begins where the envelope is low, so that no impulse is cut in two by its ends.
    """
    count = round(turns / carrier_hz * RATE_HZ)
    shape = envelope(residuals)
    spare = shape.size - count
    begin = max(0, spare - round(2 * APART_S * RATE_HZ))
    begin += int(np.argmin(shape[begin : spare + 1]))
    stretch = shape[begin : begin + count]
    places, _ = find_peaks(stretch, height=threshold, distance=int(APART_S * RATE_HZ))
    return (begin + places) / RATE_HZ, stretch[places]
