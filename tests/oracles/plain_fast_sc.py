"""Spectral correlation as a scan of short-time spectra, written down as the paper has it, without speed.

Antoni, Xin and Hamzaoui, Mech. Syst. Signal Process. 92 (2017) 248-277, eqs. 13 to 24: the short-time spectra
at two frequencies p bins apart are multiplied and transformed over time, which sees cyclic frequencies near
p bin widths; the scans p = 0, 1, ... are added and divided by what a white signal would give.
"""

import numpy as np


def fast_sc(x, rate_hz, length, alphas_hz, hop):
    """Densities of shape (length // 2 + 1, alphas), two-sided; `alphas_hz` within rate / (2 hop)."""
    x = x - np.mean(x)
    window = np.hanning(length + 1)[:-1]
    count = (x.size - length) // hop + 1
    spectra = np.array([np.fft.fft(window * x[i * hop : i * hop + length]) for i in range(count)]).T
    bin_hz = rate_hz / length
    times = np.arange(count) * hop / rate_hz
    centre = (length // 2) / rate_hz
    moments = (np.arange(length) - length // 2) / rate_hz
    out = np.zeros((length // 2 + 1, len(alphas_hz)), dtype=complex)
    for column, alpha in enumerate(alphas_hz):
        kernel = 0.0
        for p in range(int(np.floor(alphas_hz[-1] / bin_hz)) + 2):
            upper = spectra[p : length // 2 + 1]
            lower = spectra[: length // 2 + 1 - p]
            turn = np.exp(-2j * np.pi * alpha * times) / count
            scan = (upper * lower.conj()) @ turn
            out[p:, column] += scan * np.exp(2j * np.pi * (p * bin_hz - alpha) * centre)
            kernel += np.sum(window**2 * np.exp(-2j * np.pi * (alpha - p * bin_hz) * moments))
        out[:, column] /= kernel * rate_hz
    return out
