"""Power density between the lines of a measured and a simulated channel side by side.

Noise of a measuring chain lies between the lines, also where the machine's lines are densest. So windows are
long, bins next to lines of the shafts are left out, and of the others the lower quartile is taken, which
lines of other parts hardly move. The mean of k periodograms of noise has in each bin a gamma distribution of
shape k; its quantile gives back what taking a quartile has taken away.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.stats import gamma

from gearsim_dsp.spectra import Psd, welch_psd
from gearsim_twin.causes.lines import machine_lines
from gearsim_twin.causes.spectra_beside import Beside

if TYPE_CHECKING:
    from gearsim_twin.view import View

__all__ = ["between_lines", "noise_density"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_PARTS, _LONGEST_S = 3, 2.0  # a window is a third of the record at most
_LOWEST_HZ, _TOP = 20.0, 0.45  # the latter of the sample rate: beyond, converters filter
_PER_OCTAVE = 6
_FEWEST_BINS = 4
_QUARTILE = 0.25
_NEAR = 2.6  # bins of a line of a Hann window
_CROWDED = 0.3  # of the distance of two lines: closer, nothing lies between them
# Squared correlation of Hann windows that overlap by half, and bins per independent one.
_OVERLAP, _PER_BIN = 0.0278, 1.94
_DB = 10 / np.log(10)
_MODEL_DB = 2.0  # what models miss of machines
_LEAST_STD_DB = 0.1


def between_lines(pairs: Sequence[tuple[View, View]], channel: str) -> Beside | None:
    """Levels of a channel between the lines on both sides, in sixths of an octave from 20 Hz up.

    Parameters
    ----------
    pairs : sequence of (measured, simulated)
    channel : str

    Returns
    -------
    Beside or None
        The bands of all pairs one after the other. Its standard deviations are those of noise, and of the
        model by 2 dB of what it has in a band. None where no pair has a signal on both sides.
    """
    found = [each for pair in pairs if (each := _of_pair(*pair, channel)) is not None]
    if not found:
        return None
    rows = ("frequency_hz", "measured_db", "simulated_db", "std_db")
    return Beside(*(np.concatenate([getattr(each, row) for each in found]) for row in rows))


def _of_pair(measured: View, simulated: View, channel: str) -> Beside | None:
    if channel not in measured.record.channels or channel not in simulated.record.channels:
        return None
    spectra = [_spectrum(view, channel) for view in (measured, simulated)]
    if spectra[0] is None or spectra[1] is None:
        return None
    top = _TOP * min(view.record.sample_rate_hz for view in (measured, simulated))
    edges = _edges(max(each.step_hz for each in spectra if each is not None), top)
    (level, std), (model, _) = (
        noise_density(psd, _free(view, psd), edges)
        for view, psd in zip((measured, simulated), spectra, strict=True)
        if psd is not None
    )
    told = np.isfinite(level) & np.isfinite(model)
    if np.count_nonzero(told) < 2 * _FEWEST_BINS:
        return None
    share = np.minimum(10 ** (0.1 * (model - level)), 1.0)
    spread = np.hypot(np.maximum(std, _LEAST_STD_DB), _MODEL_DB * share)
    centres = np.sqrt(edges[1:] * edges[:-1])
    return Beside(centres[told], level[told], model[told], spread[told])


def noise_density(psd: Psd, free: Flags, edges_hz: Array) -> tuple[Array, Array]:
    """Density of noise in bands, whatever lines stand out of a part of the bins.

    Parameters
    ----------
    psd : Psd
    free : ndarray of bool, shape (lines,)
        Bins that count.
    edges_hz : ndarray, shape (bands + 1,)

    Returns
    -------
    (level_db, std_db) : ndarray, shape (bands,)
        NaN where hardly a bin is free.
    """
    shape = psd.segments / (1 + 2 * _OVERLAP * (1 - 1 / psd.segments))
    level, std = np.full((2, edges_hz.size - 1), np.nan)
    ends = np.searchsorted(psd.frequency_hz, edges_hz)
    for k, (low, high) in enumerate(itertools.pairwise(ends.tolist())):
        values = psd.density[low:high][free[low:high]]
        if values.size < _FEWEST_BINS:
            continue
        # Of n ordered values the one at this place is expected where the distribution has that share (Blom).
        share = (_QUARTILE * (values.size - 1) + 0.625) / (values.size + 0.25)
        own = gamma.ppf(share, shape, scale=1 / shape)
        level[k] = 10 * np.log10(max(float(np.quantile(values, _QUARTILE)), 1e-30) / own)
        spread = np.sqrt(share * (1 - share) * _PER_BIN / values.size)
        std[k] = _DB * spread / (gamma.pdf(own, shape, scale=1 / shape) * own)
    return level, std


def _spectrum(view: View, channel: str) -> Psd | None:
    x = view.signal(channel)
    if not np.all(np.isfinite(x)) or np.ptp(x) == 0 or x.size < 2048:
        return None
    rate = view.record.sample_rate_hz
    return welch_psd(x, rate, rate / min(x.size / _PARTS, _LONGEST_S * rate))


def _edges(step_hz: float, top_hz: float) -> Array:
    """Of bands a sixth of an octave wide, wider where that is but a few bins."""
    edges = [top_hz]
    while edges[-1] > _LOWEST_HZ:
        edges.append(min(edges[-1] / 2 ** (1 / _PER_OCTAVE), edges[-1] - 2 * _FEWEST_BINS * step_hz))
    return np.array(edges[-2:0:-1] if edges[-1] <= 0 else edges[::-1])


def _free(view: View, psd: Psd) -> Flags:
    """Bins that lie beside no line of the shafts; all of them where such lines run into one another."""
    known = machine_lines(view)
    f = psd.frequency_hz
    free = np.ones(f.size, dtype=np.bool_)
    free[:3] = False
    for fundamental in known.fundamentals_hz:
        beside = _NEAR * psd.step_hz + known.error * f
        distance = np.abs(f - np.round(f / fundamental) * fundamental)
        free &= (distance > beside) | (beside > _CROWDED * fundamental)
    return free
