"""Two events far apart: entry and impact of a wide spall, in the energy of the impacts.

Elements differ, and each meets the far edge a little early or late. In a long crossing that is more than
the length of a whitened event, and the mean of the impacts shows but one of the two sharply. Their energy
shows both.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.signal import find_peaks

__all__ = ["EnergyPair", "energy_pair"]

_RING_S = 0.15e-3
_LEAST_SHARE = 0.12  # of the louder event: 9 dB below it
_LEAST_CLEAR = 6.0  # standard deviations of the energy's mean
_VALLEY_SHARE = 0.5
_NEAR_SHARE = 0.25
_MOST_SPREAD = 0.08  # of the spacing: entry and impact keep their distance, knocks do not


@dataclass(frozen=True, slots=True)
class EnergyPair:
    """Distance of two events in the mean energy.

    Parameters
    ----------
    spacing : float
        From the first to the second, in samples.
    spread : float
        Standard deviation of the spacing from one crossing to the next, in samples.
    count : int
        Crossings in which both events were found.
    """

    spacing: float
    spread: float
    count: int

    @property
    def error(self) -> float:
        """Standard deviation of the mean spacing."""
        return max(self.spread / math.sqrt(max(self.count, 1)), 0.5)


def energy_pair(
    segments: NDArray[np.float64], sample_rate_hz: float, least: float, most: float
) -> EnergyPair | None:
    """Find two separate events in the impacts.

    Parameters
    ----------
    segments : ndarray of float64, shape (impacts, n)
        Whitened, the loudest moment about the middle of each.
    sample_rate_hz : float
    least, most : float
        Spacings looked for, in samples.

    Returns
    -------
    EnergyPair or None
        None where the energy has no second event that stands out, with a valley between.
    """
    ring = max(3, round(_RING_S * sample_rate_hz))
    # Of the differences: an impact is sharp, while the rings that spring back after one move slowly.
    smooth = uniform_filter1d(np.diff(segments, axis=1) ** 2, ring, axis=1)
    profile = np.median(smooth, axis=0)
    floor = float(np.quantile(profile, 0.25))
    noise = float(np.std(smooth[:, profile <= np.median(profile)])) / max(len(segments), 1) ** 0.5
    raised = profile - floor
    quarter = raised.size // 8
    main = quarter + int(np.argmax(raised[quarter : raised.size - quarter]))
    height = max(_LEAST_SHARE * float(raised[main]), _LEAST_CLEAR * noise)
    tops, _ = find_peaks(raised, height=height)
    best: tuple[float, int] | None = None
    for top in tops:
        between = raised[min(top, main) : max(top, main) + 1]
        if least <= abs(int(top) - main) <= most and between.min() < _VALLEY_SHARE * raised[top]:
            best = max(best or (0.0, 0), (float(raised[top]), int(top)))
    if best is None:
        return None
    first, last = sorted((main, best[1]))
    pair = _measured(smooth, first, last, _NEAR_SHARE * (last - first))
    return pair if pair.spread <= _MOST_SPREAD * pair.spacing else None


def _measured(smooth: NDArray[np.float64], first: int, last: int, near: float) -> EnergyPair:
    """The spacing in each crossing, between the loudest moments near the two events."""
    reach = max(2, min(int(near), first, smooth.shape[1] - 1 - last))
    early = np.argmax(smooth[:, first - reach : first + reach + 1], axis=1)
    late = np.argmax(smooth[:, last - reach : last + reach + 1], axis=1)
    spacings = (last - first) + (late - early)
    middle = float(np.median(spacings))
    spread = 1.4826 * float(np.median(np.abs(spacings - middle)))
    good = np.abs(spacings - middle) <= 4 * max(spread, 1.0)
    return EnergyPair(float(np.mean(spacings[good])), float(np.std(spacings[good])), int(good.sum()))
