"""Enhanced and improved envelope spectra: the squared cyclic coherence averaged over carrier frequencies.

The coherence weighs every carrier by its own noise, so a weak resonance counts as much as a strong one, and
no gear mesh outshouts it. Averaged over all carriers it is the enhanced envelope spectrum (EES), over those
that carry the modulation sought the improved one (IES)::

    EES(a) = < |g(a, f)|^2 >_f over all f        IES(a) = < |g(a, f)|^2 >_f over a band

(Antoni, Xin and Hamzaoui, Mech. Syst. Signal Process. 92 (2017) 248-277; Abboud, Elbadaoui, Smith and
Randall, ibid. 114 (2019) 43-60; Mauricio, Smith, Randall, Antoni and Gryllias, ibid. 144 (2020) 106891).
Authors average |g| or |g|^2; here it is |g|^2, of which the law under noise is known: 1 / averages in the
mean, and a Gamma distribution with one degree per bin and window.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.cyclic.coherence import CoherenceMap
from gearsim_dsp.cyclic.modulation import CombTest, ModulationSpectrum
from gearsim_io.errors import InputError

__all__ = ["best_band", "carrier_profile", "enhanced_envelope_spectrum", "improved_envelope_spectrum"]

_TOP_HARMONICS = 3
_LEAST_BINS = 2


def enhanced_envelope_spectrum(
    coherence: CoherenceMap, band_hz: tuple[float, float] | None = None
) -> ModulationSpectrum:
    """Squared coherence averaged over all carriers above the highest cyclic frequency.

    Parameters
    ----------
    coherence : CoherenceMap
        As `CyclicSpectrum.coherence_map` or `averaged_coherence` give it.
    band_hz : tuple of float, optional
        Where the record is trusted, such as below an anti-alias filter. Default: from the highest cyclic
        frequency to the top.

    Returns
    -------
    ModulationSpectrum
        Of kind "EES".
    """
    return _averaged(coherence, coherence.bins(band_hz), "EES")


def improved_envelope_spectrum(coherence: CoherenceMap, band_hz: tuple[float, float]) -> ModulationSpectrum:
    """Squared coherence averaged over the carriers of a band that was not chosen by looking at `coherence`.

    Returns
    -------
    ModulationSpectrum
        Of kind "IES".
    """
    return _averaged(coherence, coherence.bins(band_hz), "IES")


def best_band(
    coherence: CoherenceMap,
    expected: float,
    tolerance: float,
    *,
    sideband: float = 0.0,
    shafts: tuple[float, ...] = (),
    band_hz: tuple[float, float] | None = None,
) -> tuple[ModulationSpectrum, CombTest]:
    """The improved envelope spectrum of the band that shows a comb best.

    Bands of a binary tree (whole, halves, quarters ... down to two bins) with those half-way between compete;
    the most improbable comb wins, and the number of bands tried is counted in every false-alarm probability
    of the spectrum returned. (The feature optimisation of Mauricio et al. (2020), with improbability as the
    feature, for which no reference record is needed.)

    Parameters
    ----------
    coherence : CoherenceMap
        As `CyclicSpectrum.coherence_map` or `averaged_coherence` give it.
    expected, tolerance, sideband, shafts
        The comb, as in `ModulationSpectrum.comb`.
    band_hz : tuple of float, optional
        Where to look; default as in `enhanced_envelope_spectrum`.

    Returns
    -------
    spectrum : ModulationSpectrum
        Of kind "IES", with its `band_hz`.
    comb : CombTest
        The comb in it.
    """
    bands = _tree(coherence.bins(band_hz))
    below = np.zeros((coherence.values.shape[0] + 1, coherence.values.shape[1]))
    np.cumsum(coherence.values, axis=0, out=below[1:])
    found = []
    for band in bands:
        power = (below[band.stop] - below[band.start]) / (band.stop - band.start)
        candidate = _modulation(coherence, power, band, "IES", len(bands))
        found.append((candidate, candidate.comb(expected, tolerance, sideband, shafts)))
    return min(found, key=lambda pair: (pair[1].false_alarm, -pair[1].modulation))


def carrier_profile(
    coherence: CoherenceMap, fundamental: float, harmonics: int = _TOP_HARMONICS
) -> NDArray[np.float64]:
    """Which carriers a period modulates: squared coherence at its first harmonics, less the noise's mean.

    Parameters
    ----------
    coherence : CoherenceMap
        As `CyclicSpectrum.coherence_map` or `averaged_coherence` give it.
    fundamental : float
        Cyclic frequency found, on the map's axis; the nearest column on either side may be taken.
    harmonics : int
        As many as the axis holds, at least one.

    Returns
    -------
    ndarray of float64, shape (bins,)
        Sum over the harmonics; around 0 where nothing is modulated.
    """
    columns = [round(k * fundamental / coherence.alpha_step) for k in range(1, harmonics + 1)]
    columns = [column for column in columns if 1 <= column < coherence.values.shape[1] - 1]
    if not columns:
        top = coherence.alpha_step * (coherence.values.shape[1] - 2)
        raise InputError("carrier_profile", "fundamental", fundamental, f"above 0 and at most {top:g}")
    mean = coherence.values[coherence.bins()].mean(axis=0)
    tops = [column - 1 + int(np.argmax(mean[column - 1 : column + 2])) for column in columns]
    total = np.sum(coherence.values[:, tops], axis=1, dtype=np.float64)
    return np.asarray(total - len(tops) / coherence.averages)


def _tree(chosen: slice) -> list[slice]:
    """Bands of a binary tree with half-way bands between, each of two bins or more."""
    count = chosen.stop - chosen.start
    bands = {(chosen.start, chosen.stop)}
    parts = 2
    while count // parts >= _LEAST_BINS:
        edges = chosen.start + np.round(np.linspace(0, count, 2 * parts + 1)).astype(int)
        bands |= {(int(edges[k]), int(edges[k + 2])) for k in range(2 * parts - 1)}
        parts *= 2
    return [slice(first, last) for first, last in sorted(bands)]


def _averaged(coherence: CoherenceMap, band: slice, kind: str) -> ModulationSpectrum:
    power = coherence.values[band].mean(axis=0, dtype=np.float64)
    return _modulation(coherence, np.asarray(power), band, kind, 1)


def _modulation(
    coherence: CoherenceMap, power: NDArray[np.float64], band: slice, kind: str, looks: int
) -> ModulationSpectrum:
    edges = band.start * coherence.resolution_hz, band.stop * coherence.resolution_hz
    averages = (band.stop - band.start) * coherence.windows
    return ModulationSpectrum(power, coherence.alpha_step, coherence.alpha_unit, averages, edges, kind, looks)
