"""From the rate of integration to the rate of the samples: linear-phase filter and decimation in one.

The filter is a Kaiser-windowed sinc of 54 output periods: flat within 0.001 dB up to 0.45 of the output
rate, 80 dB down from 0.55 on, so that nothing folds into the pass band; between 0.45 and 0.5 of the
rate what lies mirrored above folds in with less rejection. It is symmetric about the output sample, so
accelerations keep the time axis of the state. Only samples that are kept are computed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.compiled import compiled

Array = NDArray[np.float64]
HALF_LENGTH_SAMPLES = 27  # the filter reaches this many output samples to each side
PASS_BAND = 0.45  # of the output rate
STOP_BAND = 0.55
_KAISER_BETA = 8.3  # 84 dB of stop-band attenuation
# The dot product runs in blocks of this many numbers; taps are padded with zeros to a multiple.
_BLOCK = 32


def decimation_taps(oversampling: int) -> Array:
    """Filter taps at the rate of integration, 54 `oversampling` + 1 of them; their sum is one."""
    half = HALF_LENGTH_SAMPLES * oversampling
    taps = np.sinc(np.arange(-half, half + 1) / oversampling) * np.kaiser(2 * half + 1, _KAISER_BETA)
    return np.asarray(taps / taps.sum())


def padded_taps(oversampling: int) -> Array:
    """The taps with zeros behind them, as `decimate` needs them."""
    taps = decimation_taps(oversampling)
    return np.concatenate([taps, np.zeros(-taps.size % _BLOCK)])


@compiled
def decimate(
    signal: Array, first: int, taps: Array, oversampling: int, out: Array, start: int, count: int
) -> None:
    """Filter and decimate each row.

    out[:, start + i] is the product of the taps with signal[:, first + i oversampling :], i < count; the
    signal must be long enough for the padded taps.
    """
    length = taps.size & 0xFFFFF
    rows = signal.shape[0]
    for block in range(rows // 4):  # four rows share each load of the taps
        r = 4 * block
        for i in range(count):
            a = first + i * oversampling
            w0, w1 = signal[r, a : a + length], signal[r + 1, a : a + length]
            w2, w3 = signal[r + 2, a : a + length], signal[r + 3, a : a + length]
            t0, t1, t2, t3 = 0.0, 0.0, 0.0, 0.0
            for m in range(length):
                t0 += taps[m] * w0[m]
                t1 += taps[m] * w1[m]
                t2 += taps[m] * w2[m]
                t3 += taps[m] * w3[m]
            out[r, start + i], out[r + 1, start + i] = t0, t1
            out[r + 2, start + i], out[r + 3, start + i] = t2, t3
    for r in range(rows // 4 * 4, rows):
        for i in range(count):
            window = signal[r, first + i * oversampling : first + i * oversampling + length]
            total = 0.0
            for m in range(length):
                total += taps[m] * window[m]
            out[r, start + i] = total
