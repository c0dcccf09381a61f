"""One number for each of many bands, and the choice of one of them with guards.

The guards are those of `band_choice`: discrete lines (supply, inverter, gear mesh) taken out before anything
is looked at, no band beyond the anti-alias filter's roll-off or without energy, and none that is no higher
than chance. What chance does is found on surrogates: noise with the magnitudes of the same spectrum and
random phases (Theiler et al., Physica D 58 (1992) 77-94), looked at by the same method. Lines of more than
three times their neighbourhood's median magnitude are not limited, as for the kurtogram, but removed:
autogram and protrugram ask for what repeats, and the rests of a family of lines do.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.band_choice import BandChoice, refusal, usable_ceiling_hz
from gearsim_dsp.bands import Band
from gearsim_dsp.envelope import WindowSpectrum, suppress_lines

__all__ = ["BandMap", "BandValue", "choose_from"]

_SURROGATES = 2
_REPORTED = 5
_LINE_LIMIT = 3.0
_CHANCE_SIGMA = 6.0


@dataclass(frozen=True, slots=True)
class BandValue:
    """One band: `value` as the method defines it, `power` its mean square in the signal's unit squared."""

    level: float
    low_hz: float
    high_hz: float
    value: float
    power: float

    @property
    def width_hz(self) -> float:
        """Width of the band."""
        return self.high_hz - self.low_hz


@dataclass(frozen=True, slots=True)
class BandMap:
    """All bands of a method, level by level, from low to high frequency."""

    method: str
    bands: tuple[BandValue, ...]

    @property
    def strongest(self) -> BandValue:
        """The band of the largest value, without any guard."""
        return max(self.bands, key=lambda band: band.value)


def choose_from(
    method: Callable[[WindowSpectrum], BandMap],
    spectrum: WindowSpectrum,
    samples: NDArray[np.float32] | NDArray[np.float64],
    least_width_hz: float,
    rng: np.random.Generator,
) -> BandChoice:
    """The band of the largest value that the guards let through.

    Parameters
    ----------
    method : callable
        Gives the map for a spectrum.
    spectrum : WindowSpectrum
        Of `samples`; lines are limited here.
    samples : ndarray, shape (n,)
    least_width_hz : float
        Narrowest band of use.
    rng : Generator
        For the surrogates.
    """
    clean = _without_lines(spectrum)
    found = method(clean)
    limit = _chance(method, clean, rng)
    ceiling_hz = usable_ceiling_hz(samples, spectrum.sample_rate_hz)
    total = float(np.var(samples, dtype=np.float64))
    rejected: list[str] = []
    for band in sorted(found.bands, key=lambda b: b.value / limit[b.level], reverse=True):
        if band.value <= limit[band.level]:
            break
        why = refusal(band.low_hz, band.high_hz, band.power / max(total, 1e-300), ceiling_hz, least_width_hz)
        if not why:
            band_hz = Band(max(band.low_hz, 1e-3 * band.width_hz), band.high_hz, found.method)
            return BandChoice(band_hz, band.value, tuple(rejected))
        if len(rejected) < _REPORTED:
            rejected.append(
                f"{band.low_hz:.0f}-{band.high_hz:.0f} Hz ({found.method} {band.value:.3g}): {why}"
            )
    return BandChoice(None, 0.0, tuple(rejected))


def _without_lines(spectrum: WindowSpectrum) -> WindowSpectrum:
    limited = suppress_lines(spectrum, _LINE_LIMIT).lines
    return replace(spectrum, lines=np.where(limited == spectrum.lines, spectrum.lines, np.complex64(0)))


def _chance(
    method: Callable[[WindowSpectrum], BandMap], clean: WindowSpectrum, rng: np.random.Generator
) -> dict[float, float]:
    """For each level six standard deviations above the mean of the logarithms of surrogates' values.

    The values of a level are pooled with those of all finer ones, so that there are many: finer bands rest on
    fewer samples, which makes their values larger and more scattered, and the limit no lower.
    """
    values: list[BandValue] = []
    for _ in range(_SURROGATES):
        turn = np.exp(2j * np.pi * rng.random(clean.lines.size)).astype(np.complex64)
        values += method(replace(clean, lines=clean.lines * turn)).bands
    limit = {}
    for level in {band.level for band in values}:
        some = np.log([max(band.value, 1e-300) for band in values if band.level >= level])
        limit[level] = float(np.exp(np.mean(some) + _CHANCE_SIGMA * np.std(some)))
    return limit
