"""Places that differ together, merged into discrepancies that a person can read.

Places are one discrepancy when they differ in the same direction and belong to the same thing: lines of one
mesh, one family or one shaft in whatever channel and band, neighbouring bands of noise, one figure.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gearsim_twin.compare.discrepancy import Comparison, pooled, significant
from gearsim_twin.compare.places import Place, band_text, hz_text

__all__ = ["Discrepancy", "discrepancies"]

_MOST_CHANNELS = 3
# Tails of differences that are mostly what models err by: with those of sampling alone (5) a line would need
# twelve standard deviations to be told by itself.
_NU = 8.0
_FEWEST = 6
# Neighbouring lines and bands err alike, about so many at a time.
_ALIKE = 3.0
# Of a normal distribution the median of absolute values times this is its standard deviation.
_MEDIAN_TO_STD = 1.4826
# No model errs by less than half of what is assumed of any.
_LEAST_VARIANCE = 0.25
_GAP = 1  # bands between two that differ


@dataclass(frozen=True, slots=True)
class Discrepancy:
    """Something that the simulation gets wrong.

    Attributes
    ----------
    id : str
    domain : str
    where : str
        In plain words.
    size_db : float
        Measured minus simulated, weighted mean over its places.
    z : float
        Of the place that is surest.
    places : tuple of Place
        The surest first.
    explained_by : str or None
        Cause that takes it away; None while there is none.
    """

    id: str
    domain: str
    where: str
    size_db: float
    z: float
    places: tuple[Place, ...]
    explained_by: str | None = None

    def words(self) -> str:
        """What is wrong, for people."""
        if self.places[0].kind == "ratio":
            return f"{self.where}: not where the model has it"
        side = "above" if self.size_db > 0 else "below"
        return f"{self.where}: measured {abs(self.size_db):.1f} dB {side} the model"

    def explained(self, cause: str | None) -> Discrepancy:
        """The same with its cause."""
        return replace(self, explained_by=cause)

    def to_json(self) -> dict[str, object]:
        """As in `twin --json`."""
        return {
            "id": self.id,
            "domain": self.domain,
            "where": self.where,
            "size_db": round(self.size_db, 3),
            "z": round(self.z, 2),
            "explained_by": self.explained_by,
        }


def discrepancies(comparisons: Sequence[Comparison], false_share: float = 0.01) -> tuple[Discrepancy, ...]:
    """What differs for certain between records and their simulations, the surest first.

    Parameters
    ----------
    comparisons : sequence of Comparison
        One per record, at the same places.
    false_share : float
        Share of places told that may differ by chance.
    """
    both = pooled(comparisons)
    found = _told(both, false_share)
    groups: dict[tuple[object, ...], list[int]] = {}
    for key, k in _keys(both, np.flatnonzero(found).tolist()):
        groups.setdefault(key, []).append(k)
    rows = [sorted(rows, key=lambda k: -abs(both.z[k])) for rows in groups.values()]
    rows.sort(key=lambda group: -abs(both.z[group[0]]))
    return tuple(_one(both, group, number) for number, group in enumerate(rows, start=1))


def _told(both: Comparison, false_share: float) -> np.ndarray:
    """Places that differ for certain, by what models err by beforehand or by what this one errs by.

    By how much models err is not known beforehand: were the variance of z scaled inverse chi-squared with 8
    degrees of freedom about 1, z had the tails of t_8. Of this model the median over all places tells what to
    put in place of 1, and that of n places of a domain weighs as n more degrees of freedom (Gelman et al.,
    Bayesian Data Analysis, 2013, 3.2): one more place then differs as t with 8 + n degrees of freedom and the
    mean of both variances. Where an effect fills a domain its median is no error of the model, and only the
    first of the two tells it.
    """
    if not both.counted.any():
        return np.zeros(both.z.size, dtype=np.bool_)
    domain = np.array([place.domain for place in both.places])
    usual = _variance(both.z[both.counted])
    scale, freedom = np.ones(both.z.size), np.full(both.z.size, _NU)
    for name in np.unique(domain[both.counted]):
        mine = both.counted & (domain == name)
        # Few places tell nothing of how much the others of them err.
        count = int(mine.sum())
        number = count / _ALIKE if count >= _FEWEST else 0.0
        variance = (_NU * usual + number * _variance(both.z[mine])) / (_NU + number)
        scale[mine], freedom[mine] = np.sqrt(max(variance, _LEAST_VARIANCE)), _NU + number
    here = replace(both, z=both.z / scale)
    # Lines that a machine makes itself are wrong by ten decibels near a notch of their path, however good the
    # model is elsewhere: those are told by what models err by beforehand alone.
    own = np.array([p.domain == "orders" and not p.label.startswith("tone") for p in both.places])
    told = significant(here, false_share, freedom) & ~own
    return np.asarray(significant(both, false_share, _NU) | told)


def _variance(z: np.ndarray) -> float:
    return float((_MEDIAN_TO_STD * np.median(np.abs(z))) ** 2)


def _keys(both: Comparison, rows: Sequence[int]) -> Iterator[tuple[tuple[object, ...], int]]:
    """What each place belongs to."""
    run, last = 0, (-10, "", False)
    for k in rows:
        place = both.places[k]
        up = bool(both.difference_db[k] > 0)
        if place.domain == "psd":
            together = k - last[0] <= 1 + _GAP and (place.channel, up) == last[1:]
            run = run if together else run + 1
            last = (k, place.channel, up)
            yield ("psd", run), k
        else:
            yield (place.domain, _thing(place), up), k


def _thing(place: Place) -> tuple[object, ...]:
    if place.domain == "statistics":
        return (place.kind,)
    if place.domain == "transient":
        return (place.kind, place.label)
    if place.kind == "ratio":
        return ("ratio", place.label)
    if place.kind in ("tone", "floor", "half"):
        channel = place.channel if place.kind == "floor" else ""
        return (
            place.kind,
            channel,
            place.unit,
            round(place.at / max(place.width, 1e-9)) if not channel else 0,
        )
    channel = place.channel if place.domain == "torsional" else ""
    return (channel, base(place.label))


def base(label: str) -> str:
    """What a line belongs to: "2 x mesh gears +1 x input" is of "mesh gears"."""
    first, either, other = label.partition(" or ")
    if either:
        return f"{base(first)} or {base(other)}"
    label = label.removeprefix("sidebands of ")
    plain = re.sub(r"^[\d.]+ x (?!\D*\bHz\b)", "", label)
    return re.sub(r" [+-]\d+ x .*$", "", plain)


def _one(both: Comparison, rows: list[int], number: int) -> Discrepancy:
    places = tuple(both.places[k] for k in rows)
    weight = 1 / both.std_db[rows] ** 2
    size = float(np.sum(weight * both.difference_db[rows]) / np.sum(weight))
    z = float(both.z[rows[0]])
    return Discrepancy(f"d{number}", places[0].domain, _where(places, both.speed_hz), size, z, places)


def _where(places: tuple[Place, ...], speed_hz: float) -> str:
    first = places[0]
    channels = _listed(list(dict.fromkeys(p.channel for p in places)))
    if first.domain == "psd":
        low = min(p.at - 0.5 * p.width for p in places)
        high = max(p.at + 0.5 * p.width for p in places)
        return f"noise from {hz_text(low)} to {hz_text(high)} of {channels}"
    if first.domain in ("statistics", "transient") or first.kind in ("floor", "ratio"):
        return f"{first.what(speed_hz)}{_bands(places)} of {channels}"
    if first.domain == "torsional":
        return f"{_lines(places, speed_hz)} of the encoder of {channels}"
    place = {"envelope": f" in the envelope{_bands(places)}", "cyclic": f" in the coherence{_bands(places)}"}
    return f"{_lines(places, speed_hz)}{place.get(first.domain, '')} of {channels}"


def _lines(places: tuple[Place, ...], speed_hz: float) -> str:
    """ "lines at 48.4 Hz and multiples (BPFO of bearing_3)"."""
    first = places[0]
    lowest = min(places, key=lambda p: p.at)
    hz = lowest.hz(speed_hz)
    at = hz_text(hz) if hz == hz else f"order {lowest.at:.4g}"
    orders = {round(p.at, 6) for p in places}
    if len(orders) == 1:
        name = f" ({first.label})" if first.label and first.label != "tone" else ""
        return f"line at {at}{name}"
    count = sum(1 for order in orders if abs(order / lowest.at - round(order / lowest.at)) < 0.01)
    more = "and multiples" if count == len(orders) else f"and {len(orders) - 1} more"
    return f"lines at {at} {more} ({base(first.label)})"


def _bands(places: tuple[Place, ...]) -> str:
    bands = list(dict.fromkeys(p.band_hz for p in places if p.band_hz is not None))
    if not bands:
        return ""
    if len(bands) == 1:
        return f" of the {band_text(bands[0])} band"
    return f" of {len(bands)} bands ({band_text(bands[0])} most)"


def _listed(names: list[str]) -> str:
    if len(names) <= _MOST_CHANNELS:
        return ", ".join(names)
    return f"{', '.join(names[:_MOST_CHANNELS])} and {len(names) - _MOST_CHANNELS} more channels"
