"""Which pulses of a train are real, and how many lie between them: pulses that are missing or too many.

The interval of one pulse is followed through the train like a clock: a pulse that comes before 0.6 of it is
a double (or a disturbance) and is left out, one that comes after about n of them has swallowed n - 1. The
clock is set where a stretch of intervals fits whole multiples of one unit best.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["CountedPulses", "count_pulses"]

_STRETCH = 31
_FIT = 0.1
_EARLY = 0.6
_DOUBT = 0.3
_FOLLOW = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class CountedPulses:
    """The pulses kept.

    Parameters
    ----------
    samples : ndarray of float64, shape (n,)
    counts : ndarray of float64, shape (n - 1,)
        Pulses from one to the next: 1 where none is missing.
    dropped, missing, doubtful : int
        Pulses left out and filled in; intervals that are no whole number of pulses.
    """

    samples: NDArray[np.float64]
    counts: NDArray[np.float64]
    dropped: int
    missing: int
    doubtful: int


def count_pulses(samples: NDArray[np.float64]) -> CountedPulses:
    """Count the pulses of a train, ascending sample indices, three or more."""
    start, unit = _best_stretch(np.diff(samples))
    # Backwards only for the unit at the beginning: of a double it is the second pulse that is left out.
    _, _, unit = _followed((-samples[start::-1]).tolist(), unit)
    kept, doubtful, _ = _followed(samples.tolist(), unit)
    counts = np.array([count for _, count in kept[1:]])
    return CountedPulses(
        np.array([sample for sample, _ in kept]),
        counts,
        int(samples.size - len(kept)),
        int(np.sum(counts - 1)),
        doubtful,
    )


def _best_stretch(intervals: NDArray[np.float64]) -> tuple[int, float]:
    """Where to start, and the interval of one pulse there.

    A unit counts by the intervals that are a multiple of it, the less the larger the multiple: so half of
    the true unit, of which all are multiples, loses.
    """
    size = min(_STRETCH, intervals.size)
    best = (-1.0, 0, float(np.median(intervals)))
    for start in range(0, intervals.size - size + 1, max(1, size // 2)):
        part = intervals[start : start + size]
        ratio = part[np.newaxis] / part[:, np.newaxis]
        whole = np.maximum(1.0, np.round(ratio))
        fit = np.exp(-0.5 * ((ratio - whole) / _FIT) ** 2) / np.sqrt(whole)
        score = fit.mean(axis=1)
        top = int(np.argmax(score))
        if score[top] > best[0] + 1e-9:
            # A pulse that ends an interval of one unit is a real one; the unit is the mean of those like it.
            like = np.abs(ratio[top] - 1) < 2 * _FIT
            best = (float(score[top]), start + top, float(part[like].mean()))
    return best[1], best[2]


def _followed(samples: list[float], unit: float) -> tuple[list[tuple[float, float]], int, float]:
    """Pulses kept with the number of units before each, how many are doubtful, and the unit at the end."""
    last = samples[0]
    kept = [(last, 0.0)]
    doubtful = 0
    for sample in samples[1:]:
        ratio = (sample - last) / unit
        if ratio < _EARLY:
            continue
        count = float(max(1, round(ratio)))
        if abs(ratio - count) > _DOUBT:
            doubtful += 1
        else:
            unit += _FOLLOW * ((sample - last) / count - unit)
        kept.append((sample, count))
        last = sample
    return kept, doubtful, unit
