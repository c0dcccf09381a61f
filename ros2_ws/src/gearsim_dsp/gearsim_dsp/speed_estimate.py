"""Speed of the reference shaft from the vibration alone: the comb of shaft and mesh lines that fits best.

For every candidate speed near the nameplate's the heights over the local noise floor of all lines that
turn with the shafts (harmonics of each shaft, gear meshes with their harmonics) are summed up in
decibels, capped so that no single line decides; speeds beyond the nameplate's tolerance count 0.7 of
their sum. This is the multi-order approach (Leclere, Andre and Antoni, Mech. Syst. Signal Process. 81
(2016) 371-388); that the comb is no noise is then shown by Fisher's test over its lines.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.angle.tracked_orders import all_mesh_orders
from gearsim_dsp.noise_floor import LineTail, comb_false_alarm, local_floor
from gearsim_dsp.speed import ShaftSpeed, nameplate_speed
from gearsim_io.nameplate import Machine

__all__ = ["estimate_speed", "shaft_line_orders"]

_SHAFT_HARMONICS = 8
_MESH_HARMONICS = 3
_LINE_CAP = 25.0
_BLOCK_LINES = 64
_TEMPER_DB = 4.0
_LINE_WIDTH = 0.25
_TOP_DB = 40.0
_CLEAR_DB = 6.0
_RIVAL = 0.85
_OUTSIDE = 0.7
_REACH = 2.5
_LEAST_REACH = 0.05
_FALSE_ALARM = 1e-3
_WIDE_HZ = (4.0, 65.0)


def shaft_line_orders(machine: Machine) -> NDArray[np.float64]:
    """Orders at which a sound machine has lines: harmonics of the shafts, gear meshes and their harmonics."""
    orders = {round(n * s.ratio, 9) for s in machine.shafts for n in range(1, _SHAFT_HARMONICS + 1)}
    orders |= {round(k * m, 9) for m in all_mesh_orders(machine) for k in range(1, _MESH_HARMONICS + 1)}
    return np.array(sorted(orders))


def estimate_speed(
    power: Sequence[NDArray[np.float64]], step_hz: float, averages: float, machine: Machine
) -> ShaftSpeed:
    """The speed whose lines stand out most, within 5 % or 2.5 times the nameplate's tolerance.

    Parameters
    ----------
    power : sequence of ndarray, shape (lines,)
        Averaged power spectra of the channels (Hann window).
    step_hz : float
        Distance of two lines.
    averages : float
        Independent averages behind them.
    machine : Machine
        Without a nominal speed the range is 4 to 65 Hz.

    Returns
    -------
    ShaftSpeed
        "estimated" with the interval of 95 % of the (tempered) likelihood, or "nameplate" where no comb is
        improbable enough as noise.
    """
    nominal = nameplate_speed(machine)
    if not power:
        return nominal
    evidence, prominence = _line_evidence(power, averages)
    peaks, heights, tails = _peaks(prominence, evidence)
    orders = shaft_line_orders(machine)
    candidates = _candidates(nominal, step_hz, float(orders.max()))
    position = candidates[:, None] * orders / step_hz
    inside = (position > 2.0) & (position < evidence.size - 2)
    values = _match(position, peaks, heights) * inside
    score = values.sum(axis=1) * _weight(nominal, candidates)
    best = int(np.argmax(score))
    tail = _match(position[best], peaks, tails) * inside[best]
    # Without its strongest line, for one line alone is no comb.
    rest = int(np.count_nonzero(inside[best])) - 1
    p = float(comb_false_alarm(tail.sum() - tail.max(), rest)) * candidates.size
    if p > _FALSE_ALARM:
        return nameplate_speed(machine, "no shaft lines stand out of the noise")
    if _rival(score, candidates, candidates[best]) > _RIVAL * score[best]:
        return nameplate_speed(machine, "two speeds fit the shaft lines about equally well")
    matched = orders[values[best] > _CLEAR_DB]
    least = _LINE_WIDTH * step_hz / float(np.sqrt(np.sum(matched**2)))
    low, high = _interval(score, candidates, 1.96 * least)
    return ShaftSpeed(float(candidates[best]), (low, high), "estimated")


def _line_evidence(
    power: Sequence[NDArray[np.float64]], averages: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """-ln p (capped) and height over the floor in dB (clipped) of every line, on the channel that shows
    it best.

    The best of several channels is so much higher by chance; that is taken off.
    """
    lines = min(p.size for p in power)
    tail = LineTail(averages, averages * 0.45 * _BLOCK_LINES)
    best = np.zeros(lines)
    for spectrum in power:
        cut = np.asarray(spectrum[:lines], dtype=np.float64)
        floor = np.maximum(local_floor(cut, _BLOCK_LINES, averages, 2), np.finfo(np.float64).tiny)
        best = np.maximum(best, cut / floor)
    chance = np.log(len(power))
    evidence = np.clip(tail(best) - chance, 0.0, _LINE_CAP)
    height = 10 * np.log10(np.maximum(best / (1.0 + chance / averages), 1e-3))
    return evidence, np.maximum(height, 0.0)


def _peaks(
    prominence: NDArray[np.float64], evidence: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Positions (in lines, by a parabola), heights in dB (capped) and -ln p of the local maxima."""
    left, mid, right = prominence[:-2], prominence[1:-1], prominence[2:]
    at = np.flatnonzero((mid > left) & (mid >= right) & (mid > 3.0))
    curve = 2 * mid[at] - left[at] - right[at]
    shift = 0.5 * (right[at] - left[at]) / np.maximum(curve, 1e-12)
    position = np.asarray(at + 1 + np.clip(shift, -0.5, 0.5), dtype=np.float64)
    return position, np.minimum(mid[at], _TOP_DB), evidence[at + 1]


def _match(
    position: NDArray[np.float64], peaks: NDArray[np.float64], heights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Height of the nearest peak, less the farther it is (a Gaussian of _LINE_WIDTH lines)."""
    if peaks.size == 0:
        return np.zeros_like(position)
    right = np.clip(np.searchsorted(peaks, position), 1, max(peaks.size - 1, 1))
    left = right - 1
    right = np.minimum(right, peaks.size - 1)
    nearest = np.where(position - peaks[left] < peaks[right] - position, left, right)
    distance = (position - peaks[nearest]) / _LINE_WIDTH
    return np.asarray(heights[nearest] * np.exp(-0.5 * distance**2))


def _candidates(nominal: ShaftSpeed, step_hz: float, top_order: float) -> NDArray[np.float64]:
    low, high = _WIDE_HZ
    if np.isfinite(nominal.value_hz):
        reach = max(_REACH * nominal.relative_error, _LEAST_REACH)
        low, high = nominal.value_hz * (1 - reach), nominal.value_hz * (1 + reach)
    spacing = 0.5 * _LINE_WIDTH * step_hz / top_order
    return np.arange(low, high + spacing, spacing)


def _weight(nominal: ShaftSpeed, candidates: NDArray[np.float64]) -> NDArray[np.float64]:
    """Less for speeds beyond the nameplate's tolerance: possible, but they must show more clearly."""
    if not np.isfinite(nominal.value_hz):
        return np.ones(candidates.size)
    low, high = nominal.ci95_hz
    return np.where((candidates >= low) & (candidates <= high), 1.0, _OUTSIDE)


def _rival(score: NDArray[np.float64], candidates: NDArray[np.float64], best: float) -> float:
    """The best score at a speed that is clearly another one (0.5 % away)."""
    other = np.abs(candidates / best - 1) > 0.005
    return float(np.max(score[other], initial=0.0))


def _interval(
    score: NDArray[np.float64], candidates: NDArray[np.float64], least_hz: float
) -> tuple[float, float]:
    weight = np.exp((score - score.max()) / _TEMPER_DB)
    share = np.cumsum(weight) / weight.sum()
    last = candidates.size - 1
    low = float(candidates[min(int(np.searchsorted(share, 0.025)), last)])
    high = float(candidates[min(int(np.searchsorted(share, 0.975)), last)])
    best = float(candidates[int(np.argmax(score))])
    return min(low, best - least_hz), max(high, best + least_hz)
