"""The band to demodulate by the kurtogram, with guards against what makes a plain kurtogram fail.

A plain maximum of the kurtogram is often a trap: a single knock, the beat of two discrete lines, or the
anti-alias filter's slope, where a few quanta of the converter look like impulses. The guards are, in this
order:

1. discrete lines (supply, inverter, gear mesh) are limited to ten times their neighbourhood's median,
2. bands above 0.46 of the sampling rate, or where the spectrum has rolled off, are left out,
3. bands that hold less than 1e-5 of the power are left out,
4. bands too narrow for the fault lines sought are left out,
5. a band's value is its median kurtosis over eight parts of the signal, which a single knock does not move,
   and it must exceed what Gaussian noise reaches by chance.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.bands import TOP_SHARE, Band
from gearsim_dsp.envelope import suppress_lines, window_spectrum
from gearsim_dsp.kurtogram import Kurtogram, KurtogramNode, fast_kurtogram, largest_level
from gearsim_dsp.spectra import welch_psd
from gearsim_io.errors import InputError

__all__ = ["BandChoice", "choose_band", "levels_for", "refusal", "rolloff_hz", "usable_ceiling_hz"]

_SEGMENTS = 8
_LEAST_SHARE = 1e-5
_OVERHANG = 0.1
_ROLLOFF_DB = 6.0
_CHANCE_SIGMA = 5.0


@dataclass(frozen=True, slots=True)
class BandChoice:
    """The band chosen, or None when no band is impulsive; `rejected` says what stood higher and why not."""

    band: Band | None
    kurtosis: float
    rejected: tuple[str, ...]


def choose_band(
    samples: NDArray[np.float32] | NDArray[np.float64],
    sample_rate_hz: float,
    least_width_hz: float,
    levels: int | None = None,
) -> BandChoice:
    """The most impulsive band that the guards let through.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        Finite values, at least 1024.
    sample_rate_hz : float
    least_width_hz : float
        Narrowest band of use: twice the highest fault frequency sought, for its first harmonic.
    levels : int, optional
        Depth of the tree; by default as deep as `least_width_hz` needs.

    Returns
    -------
    BandChoice
    """
    x = np.asarray(samples, dtype=np.float32)
    if x.ndim != 1 or x.size < 1024:
        raise InputError("choose_band", "samples", f"shape {x.shape}", "a vector of 1024 samples or more")
    if not 0 < least_width_hz < 0.5 * sample_rate_hz:
        raise InputError("choose_band", "least_width_hz", least_width_hz, f"0 to {0.5 * sample_rate_hz:g} Hz")
    if levels is None:
        levels = levels_for(least_width_hz, sample_rate_hz)
    levels = min(levels, largest_level(x.size))
    spectrum = suppress_lines(window_spectrum(x, sample_rate_hz))
    clean = sfft.irfft(spectrum.lines, n=spectrum.samples).astype(np.float32)
    kurtogram = fast_kurtogram(clean, sample_rate_hz, levels, _SEGMENTS)
    return _choose(kurtogram, usable_ceiling_hz(x, sample_rate_hz), least_width_hz)


def levels_for(least_width_hz: float, sample_rate_hz: float) -> int:
    """Depth of a binary tree whose narrowest bands are still as wide as that; at least 1."""
    return max(1, int(np.log2(0.5 * sample_rate_hz / least_width_hz)))


def usable_ceiling_hz(samples: NDArray[np.float32] | NDArray[np.float64], sample_rate_hz: float) -> float:
    """Highest frequency of use: below the anti-alias filter's roll-off and 0.46 of the sampling rate."""
    return min(TOP_SHARE * sample_rate_hz, rolloff_hz(samples, sample_rate_hz))


def _choose(kurtogram: Kurtogram, ceiling_hz: float, least_width_hz: float) -> BandChoice:
    total = kurtogram.nodes[0].mean_square
    ranked = sorted(kurtogram.nodes[1:], key=lambda node: node.segment_kurtosis, reverse=True)
    rejected: list[str] = []
    for node in ranked:
        if node.segment_kurtosis <= _chance(node, kurtogram):
            if node.width_hz >= least_width_hz:
                break
            continue
        # A real band has twice the power of its complex envelope.
        share = 2 * node.mean_square / max(total, 1e-300)
        why = refusal(node.low_hz, node.high_hz, share, ceiling_hz, least_width_hz)
        if not why:
            band = Band(max(node.low_hz, 1e-3 * node.width_hz), node.high_hz, "kurtogram")
            return BandChoice(band, node.segment_kurtosis, tuple(rejected))
        if len(rejected) < 5:
            place = f"{node.low_hz:.0f}-{node.high_hz:.0f} Hz (kurtosis {node.segment_kurtosis:.3g})"
            rejected.append(f"{place}: {why}")
    return BandChoice(None, 0.0, tuple(rejected))


def refusal(low_hz: float, high_hz: float, share: float, ceiling_hz: float, least_width_hz: float) -> str:
    """Why a band is not fit to be demodulated, or nothing; `share` is its part of the signal's power."""
    width_hz = high_hz - low_hz
    if width_hz < least_width_hz:
        return f"narrower than {least_width_hz:.0f} Hz"
    if high_hz - ceiling_hz > _OVERHANG * width_hz:
        return f"reaches beyond {ceiling_hz:.0f} Hz, where the signal has rolled off"
    if share < _LEAST_SHARE:
        return "holds hardly any energy"
    return ""


def _chance(node: KurtogramNode, kurtogram: Kurtogram) -> float:
    """What the median over segments reaches of Gaussian noise: 5 standard errors.

    The excess kurtosis of n independent complex Gaussian values has variance 4 / n; the median of eight has
    about a sixth of one segment's variance.
    """
    independent = kurtogram.samples / 2 ** (node.level + 1) / _SEGMENTS
    top_hz = kurtogram.nodes[0].high_hz
    # Next to 0 Hz and to half the rate the filters let mirror frequencies in: the envelope is nearly real.
    mirrored = node.low_hz < 0.5 * node.width_hz or node.high_hz > top_hz - 0.5 * node.width_hz
    return _CHANCE_SIGMA * float(np.sqrt(4.0 / max(independent, 1.0) / 6.0)) + (1.0 if mirrored else 0.0)


def rolloff_hz(samples: NDArray[np.float32] | NDArray[np.float64], sample_rate_hz: float) -> float:
    """Where the anti-alias filter begins to show: above it the spectrum stays 6 dB below all levels before.

    Returns
    -------
    float
        Half the sampling rate when there is no such place above 0.4 of the sampling rate.
    """
    psd = welch_psd(samples, sample_rate_hz, sample_rate_hz / 1024)
    edges = np.linspace(0.25, 0.5, 26) * sample_rate_hz
    level = np.array([10 * np.log10(max(psd.power(low, high), 1e-300)) for low, high in pairwise(edges)])
    usual = float(np.min(level[edges[:-1] < 0.41 * sample_rate_hz]))
    below = level < usual - _ROLLOFF_DB
    first = level.size
    while first > 0 and below[first - 1]:
        first -= 1
    if first == level.size or edges[first] < 0.4 * sample_rate_hz:
        return 0.5 * sample_rate_hz
    return float(edges[first])
