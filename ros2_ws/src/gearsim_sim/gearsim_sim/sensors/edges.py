"""When a turning shaft passes equally spaced marks: the pulses of a tacho and the line edges of an encoder.

Between two samples the angle is the cubic Hermite interpolant of angle and speed, so a passage is found far
inside a sample. Angles come as whole turns and a fraction and stay exact over days.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray


class EdgeFinder:
    """Finds the first passage of each mark, in ascending order; a shaft that swings back makes no new edge.

    Parameters
    ----------
    marks : int
        Marks per turn.
    phase_turns : float
        Angle of mark 0 in turns.
    errors_turns : ndarray, shape (marks,), optional
        How far each mark lies from its place, in turns; the marks must stay in their order.
    """

    def __init__(
        self, marks: int, phase_turns: float = 0.0, errors_turns: NDArray[np.float64] | None = None
    ) -> None:
        self._marks = marks
        self._phase = phase_turns
        self._errors = np.zeros(marks) if errors_turns is None else errors_turns
        self._next: int | None = None

    def find(
        self,
        turns: NDArray[np.int64],
        fraction: NDArray[np.float64],
        turns_per_sample: NDArray[np.float64],
    ) -> tuple[int, NDArray[np.float64]]:
        """Edges from the first sample up to, not including, the last.

        Parameters
        ----------
        turns, fraction : ndarray, shape (samples + 1,)
            Shaft angle as whole turns and the fraction of the next, 0 <= fraction < 1.
        turns_per_sample : ndarray, shape (samples + 1,)
            Its speed.

        Returns
        -------
        first_edge : int
            Index of the first edge found (or, without any, of the next one): edge k is mark k modulo
            `marks`, passed at the angle phase + k / marks turns, plus the mark's error.
        offsets : ndarray of float64
            Where, as fractional samples from the first sample, ascending, below turns.size - 1.
        """
        from gearsim_sim.sensors.loops import passages

        if self._next is None:
            self._next = self._first_mark(int(turns[0]), float(fraction[0]))
        first = self._next
        reach = float(np.max(turns - turns[0] + fraction)) + 1.0
        out = np.empty(math.ceil(reach * self._marks) + 2)
        count = passages(
            turns, fraction, turns_per_sample, self._marks, self._phase, self._errors, first, out
        )
        self._next = first + count
        return first, out[:count].copy()

    def _first_mark(self, turns: int, fraction: float) -> int:
        mark = turns * self._marks + math.ceil((fraction - self._phase) * self._marks)
        if not self._errors.any():
            return mark
        mark -= 1  # an error is less than a spacing
        while self._phase + (mark / self._marks - turns) + self._errors[mark % self._marks] < fraction:
            mark += 1
        return mark
