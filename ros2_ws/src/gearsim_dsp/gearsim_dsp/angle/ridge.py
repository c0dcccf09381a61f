"""The speed's course over short spectra: how well each speed explains the lines, and the likeliest path.

For each frame and each candidate speed the heights over the local noise floor at all orders that turn
with the shafts are summed in decibels (Leclere, Andre and Antoni, Mech. Syst. Signal Process. 81 (2016)
371-388, who multiply normalised spectra, which is the same). A path through the frames then maximises
this sum less a penalty for changes of speed: dynamic programming (Viterbi, IEEE Trans. Inf. Theory 13
(1967) 260-269).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.noise_floor import local_floor

__all__ = ["Frames", "best_path", "comb_evidence", "line_heights"]

_BLOCK_LINES = 64
_NOISE_DB = 2.1
"""Mean of the height in dB, cut off at 0, of a line of one look at noise (of an exponential variable)."""


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """Heights of the lines of short overlapping spectra over their noise floor.

    Parameters
    ----------
    centres : ndarray of float64, shape (frames,)
        Middle of each frame, in the unit of 1 / rate (seconds or turns).
    step : float
        Distance of two lines, in the rate's unit (Hz or orders).
    resolution : float
        Distance of two independent lines.
    heights : ndarray of float64, shape (frames, lines)
        dB, less the mean that noise has.
    """

    centres: NDArray[np.float64]
    step: float
    resolution: float
    heights: NDArray[np.float64]


def line_heights(
    signals: NDArray[np.float64], rate: float, seconds: float, hop: float, top: float, top_db: float = 25.0
) -> Frames:
    """Spectra of frames of all channels; of several channels each line counts on the one that shows it best.

    Parameters
    ----------
    signals : ndarray of float64, shape (channels, n)
    rate : float
        Samples per second (or turn).
    seconds, hop : float
        Length of a frame and distance of two, in seconds (or turns).
    top : float
        Highest frequency (order) wanted.
    top_db : float
        Lines count at most so much.
    """
    length = min(signals.shape[1], max(64, round(seconds * rate)))
    stride = max(1, round(hop * rate))
    starts = np.arange(0, signals.shape[1] - length + 1, stride)
    starts += (signals.shape[1] - length - starts[-1]) // 2
    padded = sfft.next_fast_len(2 * length, real=True)
    lines = min(padded // 2, int(np.ceil(top * padded / rate)) + 2)
    lines = max(lines, min(padded // 2, 4 * _BLOCK_LINES))
    window = np.hanning(length + 1)[:-1]
    heights = np.empty((starts.size, lines))
    for row, start in enumerate(starts):
        part = signals[:, start : start + length]
        spectra = sfft.rfft((part - part.mean(axis=1, keepdims=True)) * window, padded, axis=1)[:, :lines]
        power = spectra.real**2 + spectra.imag**2
        # Padding doubles the lines: a block holds half as many independent ones.
        floor = local_floor(power, 2 * _BLOCK_LINES, 1.0, 5)
        ratio = np.max(power / np.maximum(floor, np.finfo(np.float64).tiny), axis=0)
        heights[row] = 10 * np.log10(np.maximum(ratio / (1.0 + np.log(signals.shape[0])), 1.0))
    return Frames(
        (starts + 0.5 * (length - 1)) / rate,
        rate / padded,
        rate / length,
        np.minimum(heights, top_db) - _NOISE_DB,
    )


def comb_evidence(
    frames: Frames, candidates: NDArray[np.float64], orders: NDArray[np.float64], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Weighted sum of the heights at `orders` times each candidate speed, shape (frames, candidates).

    Orders that lie beyond the spectrum, or too low to be told from the mean, count nothing.
    """
    place = candidates[:, None] * orders / frames.step
    low = np.minimum(place.astype(np.intp), frames.heights.shape[1] - 2)
    share = np.where(place < frames.heights.shape[1] - 1, place - low, 0.0)
    counts = weights * ((place < frames.heights.shape[1] - 1) & (place * frames.step > 2 * frames.resolution))
    total = np.zeros((frames.heights.shape[0], candidates.size))
    for k in range(orders.size):
        left = frames.heights[:, low[:, k]]
        right = frames.heights[:, low[:, k] + 1]
        total += counts[:, k] * (left + share[:, k] * (right - left))
    return total


def best_path(evidence: NDArray[np.float64], penalty: float, reach: int) -> tuple[NDArray[np.intp], float]:
    """The path of highest evidence less `penalty` times the square of each change of candidate.

    Parameters
    ----------
    evidence : ndarray, shape (frames, candidates)
        Candidates evenly spaced in the logarithm of the speed.
    penalty : float
        In the evidence's unit, for a change of one candidate from one frame to the next.
    reach : int
        Largest change from one frame to the next, in candidates.

    Returns
    -------
    path : ndarray of int, shape (frames,)
    score : float
        Its evidence less its penalties, per frame.
    """
    frames, count = evidence.shape
    shifts = np.arange(-reach, reach + 1)
    cost = penalty * shifts.astype(np.float64) ** 2
    came = np.zeros((frames, count), dtype=np.int16)
    score = evidence[0].copy()
    padded = np.full(count + 2 * reach, -np.inf)
    for t in range(1, frames):
        padded[reach : reach + count] = score
        options = np.lib.stride_tricks.sliding_window_view(padded, count) - cost[:, None]
        best = np.argmax(options, axis=0)
        came[t] = shifts[best]
        score = options[best, np.arange(count)] + evidence[t]
    path = np.empty(frames, dtype=np.intp)
    path[-1] = int(np.argmax(score))
    for t in range(frames - 1, 0, -1):
        path[t - 1] = path[t] + came[t, path[t]]
    return path, float(np.max(score)) / frames
