"""Pairs of measured and computed modes by the modal assurance criterion (Allemang and Brown, 1982)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.shell import Cells

Shapes = NDArray[np.float64] | NDArray[np.complex128]

# A pair below this is none (the thesis's worst accepted one: 60 %).
LEAST_MAC = 0.6
# Modes farther apart than this share of frequency are not the same, however alike at the points measured.
FARTHEST = 0.25


def mac(first: Shapes, second: Shapes) -> Array:
    """|a'b|^2 / (a'a b'b) of all columns, shape (modes of first, modes of second), 0 to 1."""
    crossed = np.abs(first.conj().T @ second) ** 2
    sizes = [np.sum(np.abs(shapes) ** 2, axis=0) for shapes in (first, second)]
    return np.asarray(crossed / np.outer(*sizes))


def pair_by_mac(
    values: Array, measured_hz: Array, model_hz: Array, least: float = LEAST_MAC
) -> tuple[Cells, Cells]:
    """Indices of measured modes and of the model's modes that form pairs, each used at most once.

    Parameters
    ----------
    values : Array, shape (measured, modelled)
        From `mac`.
    measured_hz, model_hz : Array
        Pairs farther apart than `FARTHEST` are not made.
    least : float
        Least MAC of a pair.
    """
    near = np.abs(model_hz[None] / measured_hz[:, None] - 1) <= FARTHEST
    worth = np.where(near & (values >= least), values, 0.0)
    rows, columns = linear_sum_assignment(-worth)
    real = worth[rows, columns] > 0
    return rows[real], columns[real]
