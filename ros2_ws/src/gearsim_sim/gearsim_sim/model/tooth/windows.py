"""Functions that live while a pair of teeth is in contact, as smooth periodic series of a gear's turn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.periodic import PeriodicSeries

Array = NDArray[np.float64]
_GAUSS_X, _GAUSS_W = np.polynomial.legendre.leggauss(16)
# Periods of the highest order in a quadrature panel: 16 nodes integrate four to
# 1e-6 of the integrand (Gauss-Legendre: once past pi nodes per period, faster than any power).
_PERIODS = 4.0
_LONGEST_PANEL = 0.125
_WAVES_AT_ONCE = 32


@dataclass(frozen=True, eq=False)
class Nodes:
    """Quadrature nodes over a window of pair phases [pitches], and their weights."""

    phase: Array
    weight: Array


def window_nodes(length: float, harmonics: int, breaks: Sequence[float] = ()) -> Nodes:
    """Nodes over [-length / 2, length / 2] for integrals up to the order `harmonics` per pitch.

    Panels end at `breaks`, where an integrand has kinks or jumps.
    """
    longest = min(_LONGEST_PANEL, _PERIODS / harmonics)
    inner = [point for point in breaks if abs(point) < length / 2]
    ends = np.unique(np.array([-length / 2, *inner, length / 2]))
    edges = np.concatenate(
        [
            np.linspace(start, stop, int(np.ceil((stop - start) / longest)) + 1)[:-1]
            for start, stop in pairwise(ends)
        ]
    )
    edges = np.append(edges, ends[-1])
    width = np.diff(edges)[:, None]
    phase = edges[:-1, None] + width * (_GAUSS_X + 1) / 2
    return Nodes(phase.ravel(), (width / 2 * _GAUSS_W).ravel())


def window_series(nodes: Nodes, values: Array, teeth: int, tooth: int, harmonics: int) -> PeriodicSeries:
    """What happens while one tooth is in contact, as a series of the gear's turn.

    Parameters
    ----------
    nodes, values : Nodes, array
        The function over the phase of the pair.
    teeth : int
        Teeth of the gear, or 1 for what happens to every tooth: then a turn is one pitch.
    tooth : int
        Which tooth, from 0. The middle of its path is at (tooth + 1/2) / teeth turns.
    harmonics : int
        Mesh orders kept: the series has `harmonics` x `teeth` orders, tapered by Lanczos factors.
    """
    orders = np.arange(1, harmonics * teeth + 1)
    turns = (nodes.phase + tooth + 0.5) / teeth
    weighted = nodes.weight * values / teeth
    found = _transform(turns, weighted, orders.size)
    taper = 2 * np.sinc(orders / ((harmonics + 1) * teeth))
    return PeriodicSeries(
        mean=float(np.sum(weighted)),
        orders=orders,
        cosine=taper * found.real,
        sine=taper * found.imag,
    )


def _transform(turns: Array, weighted: Array, count: int) -> NDArray[np.complex128]:
    """sum of weighted exp(2 pi i k turns) for k = 1 to count, each wave a product of two."""
    angle = 2j * np.pi * turns
    fine = np.exp(np.multiply.outer(np.arange(_WAVES_AT_ONCE), angle))
    coarse = np.exp(np.multiply.outer(1 + _WAVES_AT_ONCE * np.arange(-(-count // _WAVES_AT_ONCE)), angle))
    return np.asarray(((coarse * weighted) @ fine.T).ravel()[:count])


def truncation_error(
    series: PeriodicSeries, exact: Callable[[Array], Array], points: int = 20_000
) -> tuple[float, float]:
    """Rms and largest difference between a series and the function that it stands for, over one turn."""
    turns = (np.arange(points) + 0.5) / points
    difference = series.value(turns) - exact(turns)
    return float(np.sqrt(np.mean(difference**2))), float(np.max(np.abs(difference)))


def stretched(series: PeriodicSeries, teeth: int) -> PeriodicSeries:
    """A function of the tooth phase as a function of the turn of a gear with this many teeth."""
    return PeriodicSeries(series.mean, series.orders * teeth, series.cosine, series.sine)


def shifted(series: PeriodicSeries, turns: float) -> PeriodicSeries:
    """The function `turns` later: value(u) becomes value(u - turns)."""
    angle = 2 * np.pi * series.orders * turns
    cosine = series.cosine * np.cos(angle) - series.sine * np.sin(angle)
    sine = series.cosine * np.sin(angle) + series.sine * np.cos(angle)
    return PeriodicSeries(series.mean, series.orders, cosine, sine)


def scaled(series: PeriodicSeries, factor: float) -> PeriodicSeries:
    """factor times the function."""
    return PeriodicSeries(series.mean * factor, series.orders, series.cosine * factor, series.sine * factor)
