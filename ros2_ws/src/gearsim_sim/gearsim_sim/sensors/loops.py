"""The sample-by-sample loops of the sensors, compiled by numba.

Imported where they are called: numba takes long to load, and a scenario must be read without the wait.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def filter_rows(block, rows, coefficients, state):  # type: ignore[no-untyped-def]
    """Transposed direct form II; `state` (sections, 2) is read and kept."""
    for i in range(rows.size):
        row = block[rows[i]]
        b0, b1, b2, a1, a2 = coefficients[i]
        s0 = state[i, 0]
        s1 = state[i, 1]
        for k in range(row.size):
            x = row[k]
            y = b0 * x + s0
            s0 = b1 * x - a1 * y + s1
            s1 = b2 * x - a2 * y
            row[k] = y
        state[i, 0] = s0
        state[i, 1] = s1


@njit(cache=True, nogil=True)
def passages(turns, fraction, speed, marks, phase, errors, first, out):  # type: ignore[no-untyped-def]
    """Where the angle passes the marks from number `first` on, into `out`; returns how many."""
    count = 0
    edge = first
    edge_turns = edge // marks
    mark = edge - edge_turns * marks
    edge_fraction = phase + mark / marks + errors[mark]
    for i in range(turns.size - 1):
        end = (turns[i + 1] - edge_turns) + (fraction[i + 1] - edge_fraction)
        while end > 0.0:
            start = (turns[i] - edge_turns) + (fraction[i] - edge_fraction)
            at = i + _root(start, end, speed[i], speed[i + 1])
            # Rounding must not push the edge into the next interval, and so out of its batch.
            out[count] = min(at, np.nextafter(i + 1.0, 0.0))
            count += 1
            edge += 1
            edge_turns = edge // marks
            mark = edge - edge_turns * marks
            edge_fraction = phase + mark / marks + errors[mark]
            end = (turns[i + 1] - edge_turns) + (fraction[i + 1] - edge_fraction)
    return count


@njit(cache=True, nogil=True)
def _root(p0, p1, m0, m1):  # type: ignore[no-untyped-def]
    # First zero in [0, 1) of the cubic with values p0 <= 0 < p1 and slopes m0, m1: Newton, kept in a bracket.
    if p0 >= 0.0:
        return 0.0
    c2 = 3.0 * (p1 - p0) - 2.0 * m0 - m1
    c3 = 2.0 * (p0 - p1) + m0 + m1
    low = 0.0
    high = 1.0
    s = p0 / (p0 - p1)
    for _ in range(60):
        value = p0 + s * (m0 + s * (c2 + s * c3))
        if value > 0.0:
            high = s
        else:
            low = s
        slope = m0 + s * (2.0 * c2 + s * 3.0 * c3)
        following = s - value / slope if slope > 0.0 else 0.5 * (low + high)
        if not (low <= following <= high):
            following = 0.5 * (low + high)
        if abs(following - s) < 1e-15:
            return following
        s = following
    return s


@njit(cache=True, nogil=True)
def limit_rows(block, rows, numbers, shift):  # type: ignore[no-untyped-def]
    """Clip rows and move their zero by what leaked away; `numbers` are limit, leak, keep; `shift` is kept."""
    for i in range(rows.size):
        row = block[rows[i]]
        limit, leak, keep = numbers[i]
        d = shift[i]
        for k in range(row.size):
            x = row[k] - d
            y = min(max(x, -limit), limit)
            row[k] = y
            d = d * keep + (x - y) * leak
        shift[i] = d


@njit(cache=True, nogil=True, fastmath={"reassoc", "contract", "nsz"})
def decimate_rows(signal, start, factor, taps, out):  # type: ignore[no-untyped-def]
    """Every `factor`-th sample of the filtered `signal`, from `start` on, into `out` (channels, samples)."""
    for c in range(out.shape[0]):
        for i in range(out.shape[1]):
            window = signal[c, start + i * factor : start + i * factor + taps.size]
            total = 0.0
            for m in range(taps.size):
                total += taps[m] * window[m]
            out[c, i] = total
