"""Orders of the machine that lie beyond half the sample rate and show all the same: nothing filtered them.

An order that turns faster than half the rate is sampled like any other: the mean of x exp(-2 pi i k turns)
over the samples finds it without any knowledge of where its image lies, and tells it from a true line there,
because the image moves against the speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from gearsim_twin.causes.mesh_orders import finest_marks, mesh_orders

if TYPE_CHECKING:
    from gearsim_twin.view import View

Array = NDArray[np.float64]

_UP_TO = 2.0  # times the sample rate
_LEAST_EVIDENCE = 25.0  # e^-25 of noise for the best of some thousand looks
_FEWEST = 2
_LEAST_TRAVEL = 3.0  # lines that an order must travel against its image over the record
_AROUND = 24


def folded_orders(views: Sequence[View]) -> list[float]:
    """Mesh orders beyond half the rate that stand out, clearest first; empty if fewer than two do.

    Where the speed is so constant that an image cannot be told from another order's line, nothing is found.
    """
    best: dict[float, float] = {}
    for view in views:
        turns = _turns(view)
        if turns is None:
            continue
        count = turns.size
        mean = (turns[-1] - turns[0]) / (count - 1)  # turns per sample
        wander = float(np.ptp(turns - turns[0] - mean * np.arange(count)))
        for mesh in sorted(mesh_orders(view.machine).values()):
            low, high = int(0.55 / (mesh * mean)) + 1, int(_UP_TO / (mesh * mean))
            for number in range(low, min(high, low + 200) + 1):
                # An order and its image turn against each other: twice the wander of its phase parts them.
                if 2 * number * mesh * wander < _LEAST_TRAVEL:
                    continue
                evidence = max(_evidence(view.signal(c), turns, number * mesh) for c in view.record.channels)
                if evidence > _LEAST_EVIDENCE:
                    best[number * mesh] = max(evidence, best.get(number * mesh, 0.0))
    found = sorted(best, key=lambda order: -best[order])
    return found if len(found) >= _FEWEST else []


def _turns(view: View) -> Array | None:
    """The angle at each sample; smooth between marks, as high orders see what straight lines miss."""
    marks = finest_marks(view)
    if marks is None or marks.samples.size < 4:
        return None
    inside = (marks.samples > 0) & (marks.samples < view.record.sample_count - 1)
    if np.count_nonzero(inside) < 4:
        return None
    spline = CubicSpline(marks.samples[inside], marks.turns[inside])
    return np.asarray(spline(np.arange(view.record.sample_count, dtype=np.float64)))


def _evidence(x: Array, turns: Array, order: float) -> float:
    """Power at an order over the mean of its neighbours in frequency: minus the log probability of noise."""
    window = np.hanning(x.size + 1)[:-1]
    turned = (x - x.mean()) * window * np.exp(-2j * np.pi * order * turns)
    power = np.abs(np.fft.fft(turned)[np.r_[-_AROUND : _AROUND + 1]]) ** 2
    beside = np.delete(power, slice(_AROUND - 4, _AROUND + 5))
    return float(power[_AROUND] / max(float(beside.mean()), 1e-300))
