"""A coarse angle made fine by the phases of all lines that turn with the shafts, taken together.

In a signal resampled at equal coarse angles a line of order o is nearly a constant tone. Its phase,
demodulated in a narrow band, over 2 pi o is the error of the coarse angle (phase demodulation of a mesh
harmonic: Bonnardot et al., Mech. Syst. Signal Process. 19 (2005) 766-785). Every line tells the same
error, with a variance of 1 / (2 snr (2 pi o)^2) turns^2; the weighted mean of those that agree is taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.angle.resample import AngleSignal
from gearsim_dsp.noise_floor import local_floor

__all__ = ["AngleError", "angle_error"]

_LEAST_SNR = 8.0
_BLOCK_LINES = 128
_MOST_LINES = 64
_DISAGREE = 4.0
_MOST_STEP_RAD = 2.0
_LEAST_HALF_LINES = 4.0
_WIDEST_BAND = 0.45


@dataclass(frozen=True, slots=True, eq=False)
class AngleError:
    """How far the true angle is ahead of the coarse one.

    Parameters
    ----------
    turns : ndarray of float64, shape (m,)
        Coarse angle.
    ahead : ndarray of float64, shape (m,)
        In turns.
    orders : ndarray of float64, shape (lines,)
        The lines it rests on.
    slope_error : float
        Standard deviation of the mean slope, in turns per turn: the relative error of the mean speed.
    bend : float
        Variance of `ahead` about its straight line over what the lines' noise and disagreement give it; 0
        where only one line speaks.
    half_band : float
        Half-width of the bands in the end, in orders.
    """

    turns: NDArray[np.float64]
    ahead: NDArray[np.float64]
    orders: NDArray[np.float64]
    slope_error: float
    bend: float
    half_band: float


def angle_error(
    signals: list[AngleSignal], orders: NDArray[np.float64], half_band: float
) -> AngleError | None:
    """The error of the coarse angle that the lines at `orders` tell, None where no line is clear enough.

    Parameters
    ----------
    signals : list of AngleSignal
        The channels, resampled by the coarse angle.
    orders : ndarray, shape (lines,)
        Where lines of shafts and meshes may be.
    half_band : float
        Half-width of the bands, in orders: below the distance of two lines. Of a short signal it is made
        wide enough for four resolutions.

    Notes
    -----
    At the ends the demodulation sees one side only, so that a part of the error stays there: repeated with
    the corrected angle it vanishes.
    """
    size, per_turn = signals[0].values.size, signals[0].samples_per_turn
    padded = sfft.next_fast_len(size + size // 4, real=True)  # so that the end does not meet the start
    spacing = per_turn / padded
    half = round(max(half_band, _LEAST_HALF_LINES * per_turn / size) / spacing)
    if half * spacing > _WIDEST_BAND:
        return None
    edge = np.hanning(2 * half + 3)[1:-1]  # smooth, so that the amplitude does not ring
    found: list[tuple[NDArray[np.complex128], float, float]] = []
    for signal in signals:
        lines = sfft.rfft(signal.values - signal.values.mean(), padded)
        floor = local_floor(lines.real**2 + lines.imag**2, max(_BLOCK_LINES, 8 * half), 1.0, 2)
        found += _tones(lines, floor, orders, spacing, edge)
    count = int(4 * half * size / padded)
    found = [tone for tone in found if _is_steady(tone[0][:count])]
    found = sorted(found, key=lambda tone: tone[1])[:_MOST_LINES]
    if not found:
        return None
    tones = np.stack([tone[0][:count] for tone in found])
    turns = signals[0].first_turn + np.arange(count) * padded / (4 * half * per_turn)
    orders = np.array([tone[2] for tone in found])
    angles = np.unwrap(np.angle(tones), axis=1) / (2 * np.pi * orders[:, None])
    return _combined(turns, angles, np.array([tone[1] for tone in found]), orders, half * spacing)


def _tones(
    lines: NDArray[np.complex128],
    floor: NDArray[np.float64],
    orders: NDArray[np.float64],
    spacing: float,
    edge: NDArray[np.float64],
) -> list[tuple[NDArray[np.complex128], float, float]]:
    """Of each clear line: complex amplitude over the angle (4 half points), variance of the angle, order."""
    half = edge.size // 2
    place = orders / spacing
    centre = np.round(place).astype(np.intp)
    inside = (centre - half >= 2) & (centre + half < lines.size)
    place, centre, orders = place[inside], centre[inside], orders[inside]
    around = centre[:, None] + np.arange(-half, half + 1)
    bands = lines[around] * edge
    power = np.sum(bands.real**2 + bands.imag**2, axis=1)
    snr = power / np.sum(floor[around] * edge**2, axis=1) - 1.0
    clear = snr >= _LEAST_SNR
    place, centre, orders, bands, snr = place[clear], centre[clear], orders[clear], bands[clear], snr[clear]
    count = 4 * half
    shifted = np.zeros((orders.size, count), dtype=np.complex128)
    shifted[:, : half + 1] = bands[:, half:]
    shifted[:, -half:] = bands[:, :half]
    drift = np.exp(-2j * np.pi * (place - centre)[:, None] * np.arange(count) / count)
    tones = sfft.ifft(shifted, axis=1) * drift
    variance = 0.5 / snr / (2 * np.pi * orders) ** 2
    return [(tones[k], float(variance[k]), float(orders[k])) for k in range(orders.size)]


def _is_steady(tone: NDArray[np.complex128]) -> bool:
    """False where a phase jumps (the amplitude vanishes in a beat): it may then have slipped by a cycle."""
    return bool(np.max(np.abs(np.angle(tone[1:] * np.conj(tone[:-1])))) < _MOST_STEP_RAD)


def _combined(
    turns: NDArray[np.float64],
    angles: NDArray[np.float64],
    variance: NDArray[np.float64],
    orders: NDArray[np.float64],
    half_band: float,
) -> AngleError:
    """The weighted mean of the lines' errors, without lines whose slopes contradict the others'."""
    centred = turns - turns.mean()
    slopes = (angles @ centred) / np.sum(centred**2)
    # The slope's variance of white noise in the band: a quarter of the points are independent.
    spread = np.sqrt(variance / (turns.size / 4) * 12) / (turns[-1] - turns[0])
    kept = np.ones(orders.size, dtype=bool)
    while np.count_nonzero(kept) > 2:
        weight = np.where(kept, 1 / variance, 0.0) / np.sum(1 / variance[kept])
        error = np.sqrt(spread**2 + np.sum((weight * spread) ** 2))
        excess = np.where(kept, np.abs(slopes - weight @ slopes) / error, 0.0)
        worst = int(np.argmax(excess))
        if excess[worst] < _DISAGREE:
            break
        kept[worst] = False
    weight = np.where(kept, 1 / variance, 0.0) / np.sum(1 / variance[kept])
    offsets = angles - angles.mean(axis=1, keepdims=True)
    ahead = weight @ offsets
    # Each line's difference from the mean, over its own noise: more than 1 where lines disagree.
    lines = int(np.count_nonzero(kept))
    excess = np.mean((offsets - ahead) ** 2, axis=1) / variance
    disagreement = max(1.0, float(np.sum(excess[kept])) / max(lines - 1, 1))
    bent = ahead - np.polyval(np.polyfit(turns, ahead, 1), turns)
    noise = disagreement / np.sum(1 / variance[kept])
    bend = float(np.mean(bent**2) / noise) if lines > 1 else 0.0
    # What the lines make of the stretch from one end to the other, beside their own noise.
    independent = max(lines - 1, 1)
    scatter = float(np.sqrt(weight @ (slopes - weight @ slopes) ** 2 / independent))
    own = float(np.sqrt(np.sum((weight * spread) ** 2)))
    return AngleError(turns, ahead, orders[kept], float(np.hypot(scatter, own)), bend, half_band)
