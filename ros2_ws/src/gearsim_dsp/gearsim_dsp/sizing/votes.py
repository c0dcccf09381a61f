"""Widths on which several analyses agree.

A width found by one analysis of a mean impact is as good as the picture that the analysis has of the path.
The same impact in narrower bands has another path, other noise, and the same width. Each analysis therefore
votes: for every width the squared deviation of what it found, in standard deviations, limited so that one
that is caught in a wrong explanation cannot outvote the others. What the model leaves out is common to all,
so the votes are averaged, not added. Widths whose mean exceeds the least by a limit at most are the interval;
where the analyses contradict each other it is wide, or even the best width has much against it.

The numbers were set on 59 simulated spalls in two kinds of rig (four machines), and checked on others: see
docs/methods/spall_size.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.sizing.crossing import RELEASE_LOG_SD

__all__ = ["Verdict", "agreed", "pair_vote", "width_grid", "width_vote"]

_GRID_STEP = 0.01
DISPERSION = 5.0
"""Cost of an explanation that counts as one squared standard deviation: the errors of neighbouring samples
are not independent, and no path is exactly linear."""
MODEL_LOG_SD = 0.04
MODEL_RELEASES = 0.2
"""Standard deviation of a width by what the model leaves out (rings that give way, worn edges): a share of
the width, and one of the expected release distance, since the moment of entry has no sharp event."""
VOTE_LIMIT = 9.0
"""Three standard deviations: more than that one analysis may not say."""
INTERVAL_EXCESS = 3.84
"""Squared deviations that bound the 95 % interval (chi-squared, one degree of freedom)."""
MOST_DISCORD = 2.0
"""Mean vote against the best width above which the analyses are said to contradict each other."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """The width on which votes agree best, and the interval about it, in the unit of the grid.

    `discord` is the mean vote against the best width, in squared standard deviations.
    """

    value: float
    low: float
    high: float
    discord: float


def width_grid(narrowest: float, widest: float) -> NDArray[np.float64]:
    """Logarithms of the widths that are voted on, 1 % apart."""
    return np.arange(np.log(narrowest), np.log(widest) + _GRID_STEP, _GRID_STEP)


def width_vote(
    grid: NDArray[np.float64], widths: NDArray[np.float64], costs: NDArray[np.float64], release: float
) -> NDArray[np.float64]:
    """Squared deviation of each width of the grid from what explains an impact.

    Parameters
    ----------
    grid : ndarray of float64, shape (g,)
    widths, costs : ndarray of float64, shape (tried,)
        Widths tried and what they cost, see `double_event.Explanations`.
    release : float
        Expected release distance in the unit of the grid.
    """
    place = np.round((np.log(widths) - grid[0]) / _GRID_STEP).astype(np.intp)
    inside = (place >= 0) & (place < grid.size)
    least = np.full(grid.size, np.inf)
    np.minimum.at(least, place[inside], costs[inside])
    known = np.flatnonzero(np.isfinite(least))
    if known.size == 0:
        return np.full(grid.size, VOTE_LIMIT)
    excess = (least[known] - least[known].min()) / DISPERSION
    sd = np.hypot(MODEL_LOG_SD, MODEL_RELEASES * release / np.exp(grid))
    off = (grid[:, None] - grid[None, known]) / sd[:, None]
    return np.asarray(np.minimum((excess[None, :] + off**2).min(axis=1), VOTE_LIMIT))


def pair_vote(grid: NDArray[np.float64], spacing: float, error: float, release: float) -> NDArray[np.float64]:
    """Squared deviation of each width of the grid from a measured spacing of entry's event and impact.

    The width is the spacing and two release distances; of these only the expectation is known.

    Parameters
    ----------
    grid : ndarray of float64, shape (g,)
    spacing, error, release : float
        Spacing, its standard deviation, expected release; in the unit of the grid.
    """
    width = np.exp(grid)
    least = release * np.exp(-3 * RELEASE_LOG_SD)
    rest = np.maximum(0.5 * (width - spacing), least)
    off = np.log(rest / release) / RELEASE_LOG_SD
    short = np.maximum(spacing + 2 * least - width, 0.0) / max(error, 1e-12)
    return np.asarray(off**2 + short**2)


def agreed(grid: NDArray[np.float64], votes: Sequence[NDArray[np.float64]]) -> Verdict:
    """The width with the least mean vote, and the interval of those that are nearly as good."""
    total = np.mean(votes, axis=0)
    best = int(np.argmin(total))
    near = np.flatnonzero(total <= total[best] + INTERVAL_EXCESS)
    half = 0.5 * _GRID_STEP
    low, high = np.exp(grid[near[0]] - half), np.exp(grid[near[-1]] + half)
    return Verdict(float(np.exp(grid[best])), float(low), float(high), float(total[best]))
