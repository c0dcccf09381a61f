"""Smooth errors that any model has: at neighbouring places alike, in all records the same.

A resonance a little off its place is wrong by the same decibels at neighbouring lines. Such errors are let in
as unknowns of their own, known beforehand to be small: hats over the places of each representation, finer
ones that all channels share and coarser ones for each channel. What then counts for a cause is what smooth
errors do not do: that lines stand out of their neighbours, that a difference is larger than models err, or
that it depends on the record.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.sparse import csr_array

from gearsim_twin.stack import ASSUMED, TONES, Array, Codes, Stack, group_of

__all__ = ["smooth_errors"]

# Places from one hat to the next.
_COMMON_STEP, _CHANNEL_STEP = 4, 12


def smooth_errors(stack: Stack, use: np.ndarray, spread_db: Array) -> csr_array:
    """Levels by the coordinates of smooth errors.

    Parameters
    ----------
    stack : Stack
    use : ndarray of bool, shape (n,)
        Places that count.
    spread_db : ndarray, shape (domains,)
        Standard deviation of such errors.

    Returns
    -------
    csr_array, shape (n, q)
        Each coordinate is standard normal beforehand.
    """
    rows, columns, values, count = [], [], [], 0
    for places, spread, step in _groups(stack, use, spread_db):
        line = np.unique(stack.line[places], return_inverse=True)[1]
        at = np.zeros(int(line.max()) + 1)
        at[line] = [stack.places[k].at for k in places]
        position = np.argsort(np.argsort(at, kind="stable"))[line] / step
        low = np.floor(position)
        for hat, share in ((low, 1.0 - (position - low)), (low + 1.0, position - low)):
            rows.append(places)
            columns.append(count + hat.astype(np.intp))
            values.append(spread * share)
        count += int(low.max()) + 2
    if not rows:
        return csr_array((stack.size, 0))
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return csr_array(entries, shape=(stack.size, count))


def _groups(stack: Stack, use: np.ndarray, spread_db: Array) -> Iterator[tuple[Codes, float, int]]:
    """Places with common hats, their spread, and the step; single channels have half of the variance."""
    kinds = sorted({(p.domain, p.kind) for p in stack.places if group_of(p) not in (ASSUMED, TONES)})
    number: dict[tuple[str, str], int] = {kind: k for k, kind in enumerate(kinds)}
    kind = np.array([number.get((p.domain, p.kind), -1) for p in stack.places], dtype=np.intp)
    for (domain, _), k in number.items():
        mine = use & (kind == k)
        spread = float(spread_db[stack.domains.index(domain)]) / np.sqrt(2.0)
        channels = np.unique(stack.channel[mine])
        if channels.size:
            yield np.flatnonzero(mine), float(spread), _COMMON_STEP
        for channel in channels:
            yield np.flatnonzero(mine & (stack.channel == channel)), float(spread), _CHANNEL_STEP
