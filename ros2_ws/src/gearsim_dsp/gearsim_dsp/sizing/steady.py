"""The part of a record in which the speed hardly changes, so that ways are times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearsim_dsp.speed import Phase, ShaftSpeed

__all__ = ["Stretch", "steady_stretch"]

_TOLERANCE = 0.03  # of the speed: less than the model leaves out
_MOST_KNOTS = 400


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """Samples `first` to `stop` of a signal, the mean speed of the reference shaft in it, and its angle."""

    first: int
    stop: int
    speed_hz: float
    phase: Phase | None


def steady_stretch(count: int, sample_rate_hz: float, speed: ShaftSpeed) -> Stretch:
    """The longest stretch whose speed stays within 3 % of its middle; all where the angle is not known."""
    if speed.phase is None:
        return Stretch(0, count, speed.value_hz, None)
    knots = np.linspace(0, count - 1, int(min(_MOST_KNOTS, max(2, speed.phase.samples.size))))
    turns = np.interp(knots, speed.phase.samples, speed.phase.turns)
    pace = np.diff(turns) / np.diff(knots)
    begin, end = _longest(pace)
    first, stop = int(np.ceil(knots[begin])), int(knots[end]) + 1
    inside = (speed.phase.samples > first) & (speed.phase.samples < stop - 1)
    samples = np.concatenate(([first], speed.phase.samples[inside], [stop - 1.0]))
    angle = np.interp(samples, speed.phase.samples, speed.phase.turns)
    mean = float(angle[-1] - angle[0]) / (stop - 1 - first) * sample_rate_hz
    return Stretch(first, stop, mean, Phase(samples - first, angle))


def _longest(pace: np.ndarray) -> tuple[int, int]:
    """Longest run of values whose range stays within the tolerance: [begin, end)."""
    best = (0, 1)
    begin = 0
    for end in range(1, pace.size + 1):
        while np.ptp(pace[begin:end]) > 2 * _TOLERANCE * float(np.mean(pace[begin:end])):
            begin += 1
        if end - begin > best[1] - best[0]:
            best = (begin, end)
    return best
