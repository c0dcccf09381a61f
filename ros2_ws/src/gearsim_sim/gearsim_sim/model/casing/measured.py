"""The modal test of the UNSW casing (thesis Table 3.1), and which modes of a model answer to its modes.

The thesis prints frequencies, not shapes, so pairs cannot be made by MAC. They are made by order: the
thesis's own finite-element model says how many modes lie below each measured one, and a pair may deviate from
that number by `SHIFT` at a price. The first pair may not: neither the test nor that model has a lower mode.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.shell import Cells

# Measured frequency [Hz], and the number of the mode of the thesis's updated model that it was paired with.
TABLE_3_1 = (
    (218.28, 1),
    (345.68, 3),
    (426.89, 4),
    (462.75, 5),
    (475.93, 6),
    (564.88, 8),
    (688.43, 12),
    (706.82, 13),
    (802.92, 14),
    (882.92, 15),
    (1006.5, 18),
    (1119.0, 19),
    (1145.7, 20),
    (1239.3, 21),
    (1322.1, 22),
    (1756.6, 33),
    (1972.0, 37),
)
SHIFT = 2
PRICE = 0.01


@dataclass(frozen=True)
class Pairs:
    """Measured frequencies beside those of a model."""

    measured_hz: Array
    model_hz: Array
    modes: Cells
    """Numbers of the model's modes, from 1, rigid-body modes not counted."""

    @property
    def deviations(self) -> Array:
        """Of the model from the test, relative."""
        return np.asarray(self.model_hz / self.measured_hz - 1)


def pair_in_order(elastic_hz: Array) -> Pairs:
    """Pair a free model's elastic frequencies, ascending, with the test.

    Pairs keep their order and no mode is used twice; the sum of squared relative deviations, and of
    `PRICE` squared for each step that a mode's number is off the thesis's, is the least possible.
    """
    measured, numbers = (np.array(column) for column in zip(*TABLE_3_1, strict=True))
    steps = np.arange(len(elastic_hz))[None] - (numbers[:, None] - 1)
    costs = (elastic_hz[None] / measured[:, None] - 1) ** 2 + (PRICE * steps) ** 2
    costs[np.abs(steps) > SHIFT] = np.inf
    costs[0, 1:] = np.inf
    best, back = costs[0], []
    for row in costs[1:]:
        before = np.concatenate([[-1], _argmin_so_far(best)[:-1]])
        back.append(before)
        best = row + np.where(before >= 0, best[before], np.inf)
    chosen = [int(np.argmin(best))]
    for before in back[::-1]:
        chosen.append(int(before[chosen[-1]]))
    modes = np.array(chosen[::-1])
    return Pairs(measured.astype(float), elastic_hz[modes], modes + 1)


def _argmin_so_far(values: Array) -> Cells:
    """Index of the least value up to and with each one."""
    least = np.minimum.accumulate(values)
    new = np.concatenate([[True], least[1:] < least[:-1]])
    return np.maximum.accumulate(np.where(new, np.arange(len(values)), 0))
