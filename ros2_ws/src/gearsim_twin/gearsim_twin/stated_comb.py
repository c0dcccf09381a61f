"""Whether the lines of the shaft are where the speed that was taken has them, or those of another speed.

Speeds in the ratio of small numbers share lines: of a shaft at 30 Hz every fourth multiple is one of a shaft
at 24 Hz. Who looks only near the nameplate's 25 Hz finds those, sharp and certain, and is wrong by a fifth.
Here the first multiples are counted, over all speeds at which the machine might have run.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from gearsim_dsp.features import is_signal
from gearsim_io.record import Record
from gearsim_twin.view import View

__all__ = ["other_speed_hz"]

Array = NDArray[np.float64]

_MULTIPLES = 10
# From half the speed to twice, where a multiple of the true speed is not yet taken for it.
_LOW, _HIGH = 0.55, 1.8
# Over the median of its neighbours; of noise in one window it is one bin in six thousand.
_CLEAR_DB = 11.0
_MEDIAN_LINES = 61
_OWN_REACH = 0.004  # within which the speed taken may be off
# Shares of multiples: of the other speed at least, of the one taken at most. A speed in the ratio of small
# numbers, or half of a fault's frequency, has half of them; where the shaft hardly shows, next to none.
_SHARES = ((0.8, 0.65), (0.5, 0.1))
_APART = 0.03
# Turns in a record from which multiples lie so far apart that other lines hardly hit them.
_LEAST_TURNS = 60.0
_BAND = 1.6  # lines of a Hann window: half its width, and a little


def other_speed_hz(view: View) -> float | None:
    """Another speed of the reference shaft whose multiples stand out where those of the one taken do not.

    Parameters
    ----------
    view : View
        Without an angle signal, of a machine without gears: theirs have multiples of their own.

    Returns
    -------
    float or None
        None where the speed taken holds, or nothing contradicts it.
    """
    geared = view.machine.gear_meshes or view.machine.planetary_stages
    if geared or view.source not in ("estimated", "nameplate") or not view.turns >= _LEAST_TURNS:
        return None
    heights = _heights(view.record, _HIGH * view.speed_hz * (_MULTIPLES + 1))
    if heights is None:
        return None
    clear, step_hz = heights
    scan = np.arange(_LOW * view.speed_hz, _HIGH * view.speed_hz, step_hz / _MULTIPLES)
    hits = _hits(clear, step_hz, scan)
    near = np.abs(scan / view.speed_hz - 1.0) <= _OWN_REACH
    own = float(np.max(hits[near].mean(axis=1), initial=0.0))
    # Half or a third of the frequency of a bearing's lines has every second or third multiple alone.
    number = np.arange(1, _MULTIPLES + 1)
    parts = [np.ones(_MULTIPLES, dtype=np.bool_), number % 2 > 0, number % 3 > 0]
    shares = np.min([hits[:, part].mean(axis=1) for part in parts], axis=0)
    best = int(np.argmax(shares))
    found = float(np.mean(scan[(shares >= shares[best]) & (np.abs(scan / scan[best] - 1.0) < _OWN_REACH)]))
    tells = any(shares[best] >= most and own <= least for most, least in _SHARES)
    return found if tells and abs(found / view.speed_hz - 1.0) > _APART else None


def _heights(record: Record, top_hz: float) -> tuple[NDArray[np.bool_], float] | None:
    """Which lines of the spectra of a record stand out in any channel, and their distance [Hz]."""
    rate, count = record.sample_rate_hz, record.sample_count
    step_hz = rate / count
    lines = int(top_hz / step_hz) + _MEDIAN_LINES
    if lines >= count // 2:
        return None
    clear = np.zeros(lines, dtype=np.bool_)
    for row in record.data:
        if is_signal(row) and bool(np.all(np.isfinite(row))):
            windowed = (row - np.mean(row)) * np.hanning(count)
            power = np.abs(np.fft.rfft(windowed)[:lines]) ** 2
            floor = median_filter(power, _MEDIAN_LINES)
            clear |= power > 10.0 ** (0.1 * _CLEAR_DB) * np.maximum(floor, 1e-300)
    return clear, step_hz


def _hits(clear: NDArray[np.bool_], step_hz: float, speeds_hz: Array) -> NDArray[np.bool_]:
    """Whether the first multiples of each speed have a clear line, shape (speeds, multiples)."""
    reach = math.ceil(_BAND) - 1
    wide = clear.copy()
    for shift in range(1, reach + 1):
        wide[shift:] |= clear[:-shift]
        wide[:-shift] |= clear[shift:]
    index = np.rint(np.outer(speeds_hz, np.arange(1, _MULTIPLES + 1)) / step_hz).astype(np.intp)
    return np.asarray(wide[np.minimum(index, wide.size - 1)])
