"""When the elements cross the defect: the train of impacts in a whitened signal, and their common shape.

Impacts come at a nearly constant distance, but elements slip: each may come a little early or late and the
error stays (Antoni and Randall, J. Sound Vib. 308 (2007) 246-267). The train is therefore followed: of all
ways through the signal with one place per period, that which gathers most energy, where a step of the slip
costs (dynamic programming). What then counts is how alike the impacts are: of several ways to place them
(evenly, along the way, along the way smoothed) that is taken for which they add up to most. They are not
aligned one by one to their mean: that makes the louder event sharp at the cost of the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter, uniform_filter1d
from scipy.signal import zoom_fft

from gearsim_dsp.speed import Phase

__all__ = ["MeanImpact", "mean_impact"]

_BINS = 200  # per period, of the way
_ENERGY_CAP = 30.0
_SLIP_SHARE = 0.015  # of the period, between neighbouring impacts: Randall and Antoni (2011), 1 to 2 %
_RING_S = 0.12e-3  # energy is gathered over about the length of a whitened impact
_SEARCH_SHARE = 0.004  # doubt about the mean frequency, a little more than the 0.3 % promised of findings
_HARMONICS = 6
_SMOOTHED = 9
_LOUD_QUANTILE = 0.9
_LEAST_PERIODS = 12
_LEAST_IMPACTS = 8
_LOUD_SHARE = 0.5
_ALIGNED_GAIN = 1.3
_DRIFT_SHARE = 0.06  # of a period over the whole signal, by which the mean frequency may be off


@dataclass(frozen=True, slots=True, eq=False)
class MeanImpact:
    """The shape that the impacts have in common.

    Parameters
    ----------
    values : ndarray of float64, shape (n,)
        Mean of the impacts over one period, the loudest moment about the middle.
    noise : float
        Standard deviation of each value, from the scatter of the impacts.
    count : int
        Impacts that were averaged.
    likeness : float
        Correlation of the means of the even and the odd impacts around their loudest moment, -1 to 1.
    period : float
        Mean distance of impacts in samples.
    places : ndarray of float64, shape (count,)
        Where their middles lie, sample index.
    segments : ndarray of float64, shape (count, n)
        The impacts themselves.
    """

    values: NDArray[np.float64]
    noise: float
    count: int
    likeness: float
    period: float
    places: NDArray[np.float64]
    segments: NDArray[np.float64]

    @property
    def extent(self) -> float:
        """Share of the period that the mean's energy takes: (sum of powers)^2 over (n sum of powers^2)."""
        power = np.maximum(self.values**2 - self.noise**2, 0.0)
        return float(np.sum(power) ** 2 / max(power.size * float(power @ power), 1e-300))


def mean_impact(
    white: NDArray[np.float64], sample_rate_hz: float, passes_hz: float, phase: Phase | None
) -> MeanImpact | None:
    """Find the impacts in a whitened signal and average them.

    Parameters
    ----------
    white : ndarray of float64, shape (n,)
        Residual of a linear prediction, or another signal whose impacts are short.
    sample_rate_hz : float
    passes_hz : float
        Mean frequency of the impacts, right within 0.4 %.
    phase : Phase, optional
        Angle of a shaft that the impacts follow, for a speed that is not constant.

    Returns
    -------
    MeanImpact or None
        None with fewer than twelve periods.
    """
    if white.size * passes_hz / sample_rate_hz < _LEAST_PERIODS:
        return None
    axis = _even_axis(white.size, phase)
    smooth = uniform_filter1d(white**2, max(3, round(_RING_S * sample_rate_hz)))
    energy = smooth / max(float(np.median(smooth)), 1e-300)
    rate = _refined_rate(energy, axis, passes_hz / sample_rate_hz * (white.size / axis[-1]))
    expected = np.interp(np.arange(0.0, axis[-1] * rate) / rate, axis, np.arange(white.size, dtype=float))
    period = white.size / (axis[-1] * rate)
    expected = expected[: max(0, expected.size - 3)]
    start, way = _ways(energy, expected, period)
    return _best_mean(white, expected, period, start, way)


def _even_axis(count: int, phase: Phase | None) -> NDArray[np.float64]:
    """An axis for all samples along which impacts are even: sample index, or angle scaled to end there."""
    index = np.arange(count, dtype=np.float64)
    if phase is None:
        return index
    turns = np.interp(index, phase.samples, phase.turns)
    turns -= turns[0]
    return np.asarray(turns * ((count - 1) / turns[-1]))


def _refined_rate(energy: NDArray[np.float64], axis: NDArray[np.float64], rate: float) -> float:
    """Impacts per unit of the axis: where the harmonics of the energy are highest together."""
    bins = int(min(axis.size, 4 * _HARMONICS * axis[-1] * rate))
    edges = np.linspace(0.0, axis[-1], bins + 1)
    total = np.concatenate(([0.0], np.cumsum(np.minimum(energy, _ENERGY_CAP))))
    at = np.interp(edges, axis, np.arange(axis.size, dtype=np.float64))
    even = np.diff(np.interp(at, np.arange(total.size), total)) * np.hanning(bins)
    even -= even.mean() * np.hanning(bins) * 2
    width = axis[-1] / bins
    count = 2 * int(_SEARCH_SHARE * rate * axis[-1] * _HARMONICS * 4) + 1
    scale = np.linspace(1 - _SEARCH_SHARE, 1 + _SEARCH_SHARE, count)
    height = np.zeros(count)
    for k in range(1, _HARMONICS + 1):
        span = [k * rate * scale[0] * width, k * rate * scale[-1] * width]
        height += np.abs(zoom_fft(even, span, count, fs=1.0, endpoint=True)) ** 2
    return float(rate * scale[int(np.argmax(height))])


def _ways(
    energy: NDArray[np.float64], expected: NDArray[np.float64], period: float
) -> tuple[float, NDArray[np.float64]]:
    """Offset of an even train from the expected places, and that of each impact along the best way."""
    offsets = np.arange(2 * _BINS) * (period / _BINS)  # two periods, for a way that drifts
    at = np.minimum(expected[:, None] + offsets[None, :], energy.size - 1.0)
    gain = np.interp(at, np.arange(energy.size, dtype=np.float64), np.minimum(energy, _ENERGY_CAP))
    even = float(offsets[int(np.argmax(gain[:, :_BINS].sum(axis=0)))])
    reach = max(1, round(_SLIP_SHARE * _BINS))
    moves = np.arange(-reach, reach + 1)
    cost = 0.25 * float(np.median(gain.max(axis=1))) * (moves / reach) ** 2
    total = gain[0]
    came_from = np.zeros(gain.shape, dtype=np.intp)
    columns = np.arange(offsets.size)
    for row in range(1, expected.size):
        padded = np.pad(total, reach, constant_values=-np.inf)
        options = np.stack([padded[reach + m : reach + m + columns.size] for m in moves]) - cost[:, None]
        choice = np.argmax(options, axis=0)
        came_from[row] = columns + moves[choice]
        total = options[choice, columns] + gain[row]
    way = np.empty(expected.size, dtype=np.intp)
    way[-1] = int(np.argmax(total))
    for row in range(expected.size - 1, 0, -1):
        way[row - 1] = came_from[row, way[row]]
    return even, np.asarray(offsets[way], dtype=np.float64)


def _best_mean(
    white: NDArray[np.float64],
    expected: NDArray[np.float64],
    period: float,
    even: float,
    way: NDArray[np.float64],
) -> MeanImpact:
    """The alignment for which two halves of the impacts agree best."""
    followed = uniform_filter1d(median_filter(way, _SMOOTHED, mode="nearest"), _SMOOTHED, mode="nearest")
    best = _evenly(white, expected, period, even)
    for places in (_evenly(white, expected, period, way).places, expected + followed, expected + way):
        other = _mean(white, places, period)
        best = other if _agreement(other) > _ALIGNED_GAIN * _agreement(best) else best
    return _loud(best)


def _evenly(
    white: NDArray[np.float64],
    expected: NDArray[np.float64],
    period: float,
    offset: float | NDArray[np.float64],
) -> MeanImpact:
    """An even train near an offset, with the drift for which the impacts add up to most.

    The mean frequency is known to some 1e-4, which over hundreds of impacts is many samples.
    """
    run = np.linspace(-0.5, 0.5, expected.size)
    offsets = np.broadcast_to(offset, expected.shape)
    slope, middle = np.polyfit(run, offsets, 1) if np.ptp(offsets) > 0 else (0.0, float(offsets[0]))
    reach = max(8.0, _DRIFT_SHARE * period)
    for step in (4.0, 1.0):
        drifts = slope + np.arange(-reach, reach + 0.5 * step, step)
        sums = [_agreement(_mean(white, expected + middle + drift * run, period)) for drift in drifts]
        slope, reach = float(drifts[int(np.argmax(sums))]), step
    return _mean(white, expected + middle + slope * run, period)


def _mean(white: NDArray[np.float64], places: NDArray[np.float64], period: float) -> MeanImpact:
    segments = _cut(white, places, int(period))
    values = segments.mean(axis=0)
    scatter = float(np.mean(segments.var(axis=0)))
    noise = float(np.sqrt(scatter / max(len(places) - 1, 1)))
    even, odd = _core(segments[::2].mean(axis=0)), _core(segments[1::2].mean(axis=0))
    likeness = float(even @ odd) / max(float(np.linalg.norm(even) * np.linalg.norm(odd)), 1e-300)
    return MeanImpact(values, noise, len(places), likeness, period, places, segments)


def _agreement(mean: MeanImpact) -> float:
    """Energy of the middle of the mean without noise: product of each impact with the mean of the others."""
    count, values = mean.count, _core(mean.values)
    alone = float(np.sum(_core(mean.segments) ** 2)) / count
    return (count * float(values @ values) - alone) / max(count - 1, 1)


def _core(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The middle half."""
    quarter = values.shape[-1] // 4
    return values[..., quarter : values.shape[-1] - quarter]


def _cut(white: NDArray[np.float64], places: NDArray[np.float64], length: int) -> NDArray[np.float64]:
    """Pieces of the signal around the places, to the nearest sample."""
    first = np.round(places).astype(np.intp) - length // 2
    index = np.clip(first[:, None] + np.arange(length)[None, :], 0, white.size - 1)
    return np.asarray(white[index])


def _loud(mean: MeanImpact) -> MeanImpact:
    """Without the impacts that are much weaker than the strong ones: outside the load zone."""
    template = _core(mean.values)
    share = _core(mean.segments) @ template / max(float(template @ template), 1e-300)
    loud = share >= _LOUD_SHARE * np.quantile(share, _LOUD_QUANTILE)
    if np.count_nonzero(loud) < _LEAST_IMPACTS or np.count_nonzero(loud) > 0.8 * loud.size:
        return mean
    segments = mean.segments[loud]
    values = segments.mean(axis=0)
    noise = float(np.sqrt(np.mean(segments.var(axis=0)) / max(len(segments) - 1, 1)))
    return MeanImpact(values, noise, len(segments), mean.likeness, mean.period, mean.places[loud], segments)
