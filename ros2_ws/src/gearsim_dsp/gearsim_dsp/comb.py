"""Search for a comb of lines (harmonics and sidebands) in spectra whose floor is known."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.noise_floor import comb_false_alarm

__all__ = ["CombGrid", "CombScores", "comb_grid", "score_combs"]

LINE_CAP = 12.0
HARMONIC_OPTIONS = (2, 4, 8)
SIDEBAND_HARMONICS = 3
_TOTAL_STEP = 0.02
_INDEPENDENT_TEMPLATES = 2.0  # the templates share lines; counted on noise, see docs/diagnosis.md


@dataclass(frozen=True, slots=True, eq=False)
class CombGrid:
    """Where the lines of every candidate comb lie on a spectrum's axis.

    `fundamentals` has shape (candidates,); `harmonics` holds line indices of shape (candidates,
    harmonics) and `sidebands` of shape (candidates, SIDEBAND_HARMONICS, 2). An index of -1: outside the
    axis.
    """

    fundamentals: NDArray[np.float64]
    harmonics: NDArray[np.intp]
    sidebands: NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class CombScores:
    """-ln of the false-alarm probability of every comb without regard to the number of looks.

    `score` has shape (bands, candidates): the best of the templates; `template` names it by its row in
    `TEMPLATES`.
    """

    score: NDArray[np.float64]
    template: NDArray[np.intp]


@lru_cache(maxsize=64)
def comb_grid(
    order: float, half_width: float, order_step: float, lines: int, sideband_order: float, resolution: float
) -> CombGrid:
    """Candidates within order * (1 +- half_width), so close that no harmonic used falls between two of them.

    Parameters
    ----------
    order, sideband_order : float
        Fundamental and sideband spacing (0: none) on the axis.
    half_width : float
        Relative.
    order_step, lines : float, int
        The spectrum's axis.
    resolution : float
        Width of a line on the axis (distance of independent lines).
    """
    spacing = resolution / (2 * HARMONIC_OPTIONS[-1])
    count = 2 * int(np.ceil(order * half_width / spacing)) + 1
    fundamentals = order + order * half_width * np.linspace(-1.0, 1.0, max(count, 3))
    number = np.arange(1, HARMONIC_OPTIONS[-1] + 1)
    harmonics = _index(fundamentals[:, None] * number, order_step, lines)
    number = np.arange(1, SIDEBAND_HARMONICS + 1)
    offsets = np.array([-sideband_order, sideband_order])
    positions = fundamentals[:, None, None] * number[:, None] + offsets
    sidebands = _index(positions, order_step, lines)
    if sideband_order <= 0:
        sidebands = np.full_like(sidebands, -1)
    for array in (fundamentals, harmonics, sidebands):
        array.flags.writeable = False  # the grid is shared by all channels of a window
    return CombGrid(fundamentals, harmonics, sidebands)


def _index(positions: NDArray[np.float64], step: float, lines: int) -> NDArray[np.intp]:
    index = np.round(positions / step).astype(np.intp)
    index[(index < 1) | (index >= lines)] = -1
    return index


def score_combs(tail: NDArray[np.float64], usable: NDArray[np.bool_], grid: CombGrid) -> CombScores:
    """Score all candidates of a grid.

    Parameters
    ----------
    tail : ndarray, shape (bands, lines)
        -ln p of every line.
    usable : ndarray of bool, shape (lines,)
        False where a line has another explanation (shaft, mesh, supply).
    grid : CombGrid
    """
    capped = np.minimum(tail, LINE_CAP)
    main, main_on = _take(capped, usable, grid.harmonics)
    side, side_on = _take(capped, usable, grid.sidebands)
    totals = np.cumsum(main, axis=-1)
    counts = np.cumsum(main_on, axis=-1, dtype=np.int64)
    scores = []
    for number in HARMONIC_OPTIONS:
        scores.append(_score(totals[..., number - 1], counts[:, number - 1]))
    if np.any(side_on):
        total = totals[..., SIDEBAND_HARMONICS - 1] + side.sum(axis=(-1, -2))
        count = counts[:, SIDEBAND_HARMONICS - 1] + side_on.sum(axis=(-1, -2), dtype=np.int64)
        scores.append(_score(total, count))
    stacked = np.stack(scores)
    template = np.argmax(stacked, axis=0)
    return CombScores(np.max(stacked, axis=0) - np.log(_INDEPENDENT_TEMPLATES), template)


def _take(
    values: NDArray[np.float64], usable: NDArray[np.bool_], index: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    on = (index >= 0) & usable[index]
    return values[:, index] * on, on


def _score(total: NDArray[np.float64], count: NDArray[np.int64]) -> NDArray[np.float64]:
    """-ln of the Gamma tail, from a table, rounded down by less than its step."""
    table = _gamma_table()
    place = np.minimum(total * (1.0 / _TOTAL_STEP), table.shape[1] - 1).astype(np.intp)
    return np.asarray(table[np.broadcast_to(count, total.shape), place])


@lru_cache(maxsize=1)
def _gamma_table() -> NDArray[np.float64]:
    most = max(HARMONIC_OPTIONS[-1], 3 * SIDEBAND_HARMONICS)
    totals = np.arange(0.0, LINE_CAP * most + 2 * _TOTAL_STEP, _TOTAL_STEP)
    rows = [np.zeros(totals.size)]
    for count in range(1, most + 1):
        rows.append(-np.log(np.maximum(comb_false_alarm(totals, count), 1e-300)))
    return np.stack(rows)
