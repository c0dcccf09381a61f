"""What a record shows of gears that the nameplate does not list: told, not judged.

Without the teeth of both wheels no fault can be pinned on one of them. But lines at a whole order and its
multiples with side lines a turn apart are a tooth mesh, and what is seen of it helps whoever has to complete
the nameplate.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.quality import QualityIssue
from gearsim_dsp.synchronous.indicators import gear_indicators
from gearsim_dsp.synchronous.tsa import Average

__all__ = ["unlisted_mesh"]

Array = NDArray[np.float64]

_FEWEST_TEETH, _MOST_TEETH = 10, 150
_MULTIPLES = 4
_SIDE_LINES = 3
_PER_TURN = 1024
_CLEAR = 10.0  # amplitudes over those of the orders around
_PART = 0.05  # of the strongest multiple's amplitude that the fundamental must have


def unlisted_mesh(measured: Measured) -> QualityIssue | None:
    """An entry "unlisted_mesh": the clearest mesh on the reference shaft with its side lines; or None."""
    best: tuple[float, str, int, Average] | None = None
    for name in measured.channels:
        average = measured.average(name, 1.0, _PER_TURN)
        if average is None:
            continue
        lines = average.spectrum()[1]
        teeth = _teeth(lines)
        size = float(np.sum(lines[_multiples(teeth)] ** 2)) if teeth else 0.0
        if teeth and (best is None or size > best[0]):
            best = size, name, teeth, average
    if best is None:
        return None
    return QualityIssue("unlisted_mesh", best[1], _told(measured, best[2], best[3]))


def _multiples(teeth: int) -> NDArray[np.intp]:
    top = min(_MULTIPLES, (_PER_TURN // 2 - 1) // teeth)
    return np.asarray(teeth * np.arange(1, top + 1), dtype=np.intp)


def _teeth(lines: Array) -> int:
    """The order whose first multiples hold most, 0 where none stands out with its double."""
    orders = range(_FEWEST_TEETH, _MOST_TEETH + 1)
    held = {n: float(np.sum(lines[_multiples(n)] ** 2)) for n in orders}
    most = max(held.values())
    for n in reversed(orders):  # the largest of those that are all multiples of one
        own = lines[_multiples(n)]
        around = np.median(lines[n // 2 : 5 * n // 2])
        clear = bool(own[0] > _CLEAR * around and own[1] > _CLEAR * around)
        if held[n] >= 0.9 * most and clear and own[0] >= _PART * own.max():
            return n
    return 0


def _told(measured: Measured, teeth: int, average: Average) -> str:
    lines = average.spectrum()[1] / math.sqrt(2.0)
    hz = measured.speed.value_hz
    mesh = ", ".join(
        f"order {n} ({n * hz:.1f} Hz, {lines[n]:.3g} {measured.unit})" for n in _multiples(teeth)
    )
    sides = [teeth + k for k in range(-_SIDE_LINES, _SIDE_LINES + 1) if k]
    part = 100 * float(lines[sides].max() / lines[teeth])
    nearest = max(sides, key=lambda n: float(lines[n])) - teeth
    fm4 = gear_indicators(average, teeth).fm4
    return (
        f"lines at {mesh}: a wheel with {teeth} teeth on shaft {measured.machine.reference_shaft!r}; "
        f"side lines a turn apart, the strongest at {nearest:+d} with {part:.1f} % of it; FM4 over "
        f"{average.count} turns {fm4:.2f}; "
        "to judge the gears, the nameplate must list the pair with the teeth of both wheels"
    )
