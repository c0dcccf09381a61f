"""Levels of lines in averaged spectra, with the standard deviation that noise and unsteadiness give them.

The power of a line is the sum over the five bins that a Hann window spreads it over, divided by 1.5: the same
wherever between two bins it lies, and little changed by a speed that wobbles by a bin. Noise is part of
it; how much is told by `height_db`. Of a line of mean square A in noise of power F per bin, with the
covariance (1, -2/3, 1/6) of neighbouring Hann bins, one window gives

    var P = 2.593 A F + 3.876 F^2        (2.593 = (2/1.5)^2 / 2 * W'CW;  3.876 = sum |C|^2 / 1.5^2)

and M windows that overlap by half divide these by M / (1 + (M - 1) / (3 M)) (amplitudes correlate by 1/6)
and by Welch's number of averages. The scatter between windows tells whether the line is steady beside; both
are united as if theory were worth six windows, unless the scatter contradicts it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.compare.windows import HANN_SUM, WindowSpectra

__all__ = [
    "DB",
    "LEAST_STD_DB",
    "LineLevels",
    "comb_levels",
    "jackknife",
    "line_levels",
    "united_variance",
]

DB = 10.0 / np.log(10.0)
LEAST_STD_DB = 0.03
"""Rounding and interpolation of the way from samples to levels, found on lines without noise."""

_CROSS, _NOISE = 2.593, 3.876
_THEORY_WINDOWS = 6.0
_BINS = 5
_CLEAR_SIGMA = 3.0
_TINY = 1e-300


@dataclass(frozen=True, slots=True, eq=False)
class LineLevels:
    """Levels of lines, all float64 of shape (lines,): `level_db`, `std_db`, `height_db` over what noise alone
    would give, and `clear_db`, the height that noise hardly reaches.
    """

    level_db: NDArray[np.float64]
    std_db: NDArray[np.float64]
    height_db: NDArray[np.float64]
    clear_db: NDArray[np.float64]


def line_levels(
    spectra: WindowSpectra, positions: NDArray[np.float64], half_bins: NDArray[np.intp] | int = 2
) -> LineLevels:
    """Levels at positions (in the unit of `spectra.step`); those outside the spectrum are NaN."""
    at = np.asarray(positions, dtype=np.float64)
    half = np.broadcast_to(np.asarray(half_bins, dtype=np.intp), at.shape)
    return comb_levels(spectra, [(p,) for p in at.tolist()], half)


def comb_levels(
    spectra: WindowSpectra, combs: Sequence[Sequence[float]], half_bins: NDArray[np.intp]
) -> LineLevels:
    """Levels of sums over several lines each; a comb of which no line is inside the spectrum is NaN."""
    out = np.full((4, len(combs)), np.nan)
    lines = spectra.power.shape[1]
    for k, (comb, half) in enumerate(zip(combs, half_bins.tolist(), strict=True)):
        centres = [round(p / spectra.step) for p in comb]
        bins = [c + j for c in centres if c - half >= 1 and c + half < lines for j in range(-half, half + 1)]
        if bins:
            # Lines of a comb that overlap count once.
            out[:, k] = _one_comb(spectra, np.unique(np.array(bins, dtype=np.intp)))
    return LineLevels(*out)


def _one_comb(spectra: WindowSpectra, bins: NDArray[np.intp]) -> tuple[float, float, float, float]:
    each = spectra.power[:, bins].sum(axis=1) / HANN_SUM
    power = float(each.mean())
    count = bins.size
    floor = float(spectra.floor[bins].mean())
    noise = count * floor / HANN_SUM
    amplitude = max(power - noise, 0.0)
    windows = spectra.windows
    steady = windows / (1 + (windows - 1) / (3 * windows))
    spread = _NOISE * count / _BINS
    theory = _CROSS * amplitude * floor / steady + spread * floor**2 / spectra.averages
    variance = united_variance(theory, each, steady)
    clear = _CLEAR_SIGMA * DB * np.sqrt(spread / spectra.averages) * HANN_SUM / count
    std = DB * np.sqrt(variance) / max(power, _TINY)
    return (
        float(10 * np.log10(max(power, _TINY))),
        float(max(std, LEAST_STD_DB)),
        float(10 * np.log10(max(power, _TINY) / max(noise, _TINY))),
        float(clear),
    )


def united_variance(theory: float, each: NDArray[np.float64], independent: float) -> float:
    """Variance of a mean over windows, from theory and from the scatter of the windows' values `each`.

    Where the scatter is more than theory explains (two standard deviations of a variance), it alone counts.
    """
    if each.size < 2:
        return theory
    found = float(np.var(each, ddof=1)) / independent
    free = max(independent - 1.0, 0.5)
    if found > theory * (1 + 2 * np.sqrt(2 / free)):
        return found
    return (_THEORY_WINDOWS * theory + free * found) / (_THEORY_WINDOWS + free)


def jackknife(
    parts: NDArray[np.float64], figure: Callable[[NDArray[np.float64]], float]
) -> tuple[float, NDArray[np.float64]]:
    """A figure of the mean of parts, and its pseudo-values (Quenouille), whose scatter is that of the figure.

    Parameters
    ----------
    parts : ndarray, shape (parts, ...)
    figure : callable
        Of the mean over parts.
    """
    count = parts.shape[0]
    total = parts.mean(axis=0)
    whole = figure(total)
    without = np.array([figure((count * total - part) / (count - 1)) for part in parts])
    return whole, count * whole - (count - 1) * without
