"""A record made ready for sizing: flat spectrum, no lines but those that the fault itself may have.

Linear prediction flattens the spectrum with a minimum-phase filter, so an impact stays where it began and
what precedes it stays before it (Sawalhi and Randall, Mech. Syst. Signal Process. 25 (2011) 846-870,
pre-whiten for the same reason). It is too short to resolve the lines of gear meshes and inverters, which
would add up in an average over impacts if they are near a multiple of its rate (on the 32-tooth rig 64 orders
against 9 BPFI of 7.110). Lines are therefore cut down to their neighbourhood afterwards, those apart that are
near a harmonic of the fault or its sidebands and on no shaft order: a defect crossed without slip has lines,
too.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft
from scipy.signal.windows import tukey

from gearsim_dsp.separation.linear_prediction import ar_residual, longest_ar_length

__all__ = ["whitened"]

_LENGTH_S = 1.5e-3  # long enough for the ringing of housings, shorter than from entry to entry
_LINE_LIMIT = 3.0  # times the neighbourhood's median magnitude: 0.2 % of the lines of noise
_BLOCK_LINES = 128
_WIDTH_LINES = 1.5
_FAULT_TOLERANCE = 3e-4  # of the fault's frequency as found
_SHAFT_TOLERANCE = 1e-4
_SIDEBANDS = 4
_EDGE_SHARE = 0.02


def whitened(
    signal: NDArray[np.float64],
    sample_rate_hz: float,
    passes_hz: float,
    sideband_hz: float,
    shafts_hz: Sequence[float],
) -> tuple[NDArray[np.float64], int]:
    """The residual of a linear prediction without lines.

    Parameters
    ----------
    signal : ndarray of float64, shape (n,)
    sample_rate_hz : float
    passes_hz, sideband_hz : float
        Frequency of the fault, and of what modulates it (0: nothing).
    shafts_hz : sequence of float
        Speeds of the shafts whose orders are no fault's; empty where they are not known to 1e-4.

    Returns
    -------
    ndarray of float64, shape (m,)
        Unit variance; both ends, where the prediction begins and the taper acts, are cut off.
    int
        Sample of the signal that its first value belongs to.
    """
    longest = longest_ar_length(sample_rate_hz, passes_hz, signal.size)
    length = max(8, min(round(_LENGTH_S * sample_rate_hz), longest))
    residual = ar_residual(signal, length)[length:]
    taper = tukey(residual.size, 2 * _EDGE_SHARE)
    size = sfft.next_fast_len(residual.size, real=True)
    lines = sfft.rfft(residual * taper, size)
    step = sample_rate_hz / size
    magnitude = np.abs(lines)
    bound = _LINE_LIMIT * _local_median(magnitude)
    too_high = magnitude > np.maximum(bound, 1e-300)
    own = _own_lines(lines.size, step, passes_hz, sideband_hz) & ~_orders(lines.size, step, shafts_hz)
    cut = too_high & ~own
    lines[cut] *= bound[cut] / magnitude[cut]
    edge = int(np.ceil(_EDGE_SHARE * residual.size))
    flat = sfft.irfft(lines, size)[edge : residual.size - edge]
    return flat / max(float(np.std(flat)), 1e-300), length + edge


def _local_median(magnitude: NDArray[np.float64]) -> NDArray[np.float64]:
    blocks = max(1, magnitude.size // _BLOCK_LINES)
    width = magnitude.size // blocks
    medians = np.median(magnitude[: blocks * width].reshape(blocks, width), axis=1)
    return np.asarray(medians[np.minimum(np.arange(magnitude.size) // width, blocks - 1)])


def _own_lines(count: int, step: float, passes_hz: float, sideband_hz: float) -> NDArray[np.bool_]:
    """Lines near a harmonic of the fault, or one of its sidebands."""
    frequency = np.arange(count) * step
    width = _WIDTH_LINES * step + _FAULT_TOLERANCE * frequency
    own = np.zeros(count, dtype=np.bool_)
    reach = _SIDEBANDS if sideband_hz > 0 else 0
    for shift in np.arange(-reach, reach + 1) * sideband_hz:
        off = frequency - shift
        own |= np.abs(off - np.round(off / passes_hz) * passes_hz) < width
    return own


def _orders(count: int, step: float, shafts_hz: Sequence[float]) -> NDArray[np.bool_]:
    """Lines on a multiple of a shaft's speed."""
    frequency = np.arange(count) * step
    width = _WIDTH_LINES * step + _SHAFT_TOLERANCE * frequency
    on = np.zeros(count, dtype=np.bool_)
    for speed in shafts_hz:
        on |= np.abs(frequency - np.round(frequency / speed) * speed) < np.minimum(width, 0.1 * speed)
    return on
