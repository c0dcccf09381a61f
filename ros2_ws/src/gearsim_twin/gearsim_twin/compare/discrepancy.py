"""Measured against simulated, place by place; what differs for certain, put together and told in words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from gearsim_io.errors import InputError
from gearsim_twin.compare.features import Features
from gearsim_twin.compare.places import DOMAINS, Place

__all__ = ["NU", "RATIO_DB", "Comparison", "DomainDifference", "compare", "pooled", "significant"]

NU = 5.0
"""Degrees of freedom of Student's t: heavier tails than any domain showed on replicates."""
RATIO_DB = 6.0
"""A line off its place by the width at which lines part counts as much as one too weak by half."""
_DEFAULT_TAU_DB = 1.0
_T_CONST = math.lgamma((NU + 1) / 2) - math.lgamma(NU / 2) - 0.5 * math.log(NU * math.pi)


@dataclass(frozen=True, slots=True)
class DomainDifference:
    """Of the counted places of one domain: their number, root mean square difference, and log likelihood."""

    count: int
    rms_db: float
    loglike: float


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Measured minus simulated at n places.

    Attributes
    ----------
    places : tuple of Place
    difference_db : ndarray of float64, shape (n,)
        Positive where the measurement has more; of a ratio 6 dB for each width of a line; 0 where a place
        does not count.
    z : ndarray of float64, shape (n,)
        In standard deviations (sampling on both sides, and tau); 0 where a place does not count.
    std_db : ndarray of float64, shape (n,)
        That standard deviation; infinite where a place does not count.
    counted : ndarray of bool, shape (n,)
        Places that both sides tell something of, and lines that stand out on one side at least.
    loglike : float
        Student's t with 5 degrees of freedom, over counted places.
    by_domain : mapping of str to DomainDifference
    speed_hz : float
    """

    places: tuple[Place, ...]
    difference_db: NDArray[np.float64]
    z: NDArray[np.float64]
    std_db: NDArray[np.float64]
    counted: NDArray[np.bool_]
    loglike: float
    by_domain: Mapping[str, DomainDifference]
    speed_hz: float

    def densities(self) -> NDArray[np.float64]:
        """Log density of each place, shape (n,); 0 where it does not count."""
        return _densities(self.z, self.std_db, self.counted)


def compare(measured: Features, simulated: Features, tau_db: Mapping[str, float] | None = None) -> Comparison:
    """Compare two records at their places.

    Parameters
    ----------
    measured, simulated : Features
        At the same places; `simulated` with its nuisances.
    tau_db : mapping of str to float, optional
        Per domain, what a good model of a machine still misses (standard deviation); 1 dB by default. Of
        what records of the healthy machine had already, `simulated` says itself what it is known to.

    Raises
    ------
    InputError
        When the places differ.
    """
    if measured.places != simulated.places:
        raise InputError("compare", "places", "different ones", "the same on both sides")
    places = measured.places
    tau = tau_db or {}
    scale = np.array([_scale(place) for place in places])
    tau_each = np.array([tau.get(place.domain, _DEFAULT_TAU_DB) for place in places])
    counted = (
        np.isfinite(measured.level_db)
        & np.isfinite(simulated.level_db)
        & (measured.stands_out | simulated.stands_out)
    )
    sampling = scale * np.hypot(measured.std_db, simulated.std_db)
    missed = np.hypot(tau_each * simulated.own, scale * simulated.repeat_db)
    std = np.where(counted, np.hypot(sampling, missed), np.inf)
    raw = np.where(counted, measured.level_db, 0.0) - np.where(counted, simulated.level_db, 0.0)
    difference = scale * raw
    z = difference / std
    return _comparison(places, difference, z, std, counted, measured.speed_hz)


def _comparison(
    places: tuple[Place, ...],
    difference: NDArray[np.float64],
    z: NDArray[np.float64],
    std: NDArray[np.float64],
    counted: NDArray[np.bool_],
    speed_hz: float,
) -> Comparison:
    density = _densities(z, std, counted)
    domain = np.array([place.domain for place in places])
    by_domain: dict[str, DomainDifference] = {}
    for name in DOMAINS:
        rows = counted & (domain == name)
        if rows.any():
            rms = float(np.sqrt(np.mean(difference[rows] ** 2)))
            by_domain[name] = DomainDifference(int(rows.sum()), rms, float(density[rows].sum()))
    return Comparison(places, difference, z, std, counted, float(density.sum()), by_domain, speed_hz)


def _densities(
    z: NDArray[np.float64], std: NDArray[np.float64], counted: NDArray[np.bool_]
) -> NDArray[np.float64]:
    safe = np.where(counted, std, 1.0)
    return np.where(counted, _T_CONST - np.log(safe) - 0.5 * (NU + 1) * np.log1p(z**2 / NU), 0.0)


def _scale(place: Place) -> float:
    return RATIO_DB / place.width if place.kind == "ratio" else 1.0


def pooled(comparisons: Sequence[Comparison]) -> Comparison:
    """Several records as one: mean differences, and mean z.

    What the model misses it misses in every record, so z does not grow with their number.
    """
    if not comparisons:
        raise InputError("pooled", "comparisons", 0, "one or more")
    if any(c.places != comparisons[0].places for c in comparisons):
        raise InputError("pooled", "places", "different ones", "the same in all records")
    counted = np.stack([c.counted for c in comparisons])
    number = np.maximum(counted.sum(axis=0), 1)
    difference = np.sum([c.difference_db for c in comparisons], axis=0) / number
    z = np.sum([c.z for c in comparisons], axis=0) / number
    some = np.asarray(counted.any(axis=0))
    variance = np.sum([np.where(c.counted, c.std_db, 0.0) ** 2 for c in comparisons], axis=0) / number
    std = np.where(some, np.sqrt(variance), np.inf)
    speed = float(np.median([c.speed_hz for c in comparisons]))
    return _comparison(comparisons[0].places, difference, z, std, some, speed)


def significant(
    comparison: Comparison, false_share: float = 0.01, nu: float | NDArray[np.float64] = NU
) -> NDArray[np.bool_]:
    """Places that differ for certain: of those told at most `false_share` do so by chance, on average.

    `nu` are the degrees of freedom of differences in standard deviations, of all places or of each, (n,).

    Benjamini and Hochberg, J. R. Stat. Soc. B 57 (1995) 289-300, over all counted places, with the tails of
    Student's t; valid for positively dependent places, as neighbours are.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    out = np.zeros(comparison.z.size, dtype=np.bool_)
    index = np.flatnonzero(comparison.counted)
    if index.size == 0:
        return out
    freedom = np.broadcast_to(np.asarray(nu, dtype=np.float64), comparison.z.shape)[index]
    p = 2 * stats.t.sf(np.abs(comparison.z[index]), freedom)
    out[index] = stats.false_discovery_control(p, method="bh") <= false_share
    return out
