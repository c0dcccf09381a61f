"""Places put together to indicators that are the same in every run, few enough to be learnt one by one.

An indicator is the mean difference, measured minus modelled, of the lines of one thing in one carrier band,
of half an octave of noise, or of one figure. What depends on the data at hand (tones, frequencies found) is
left out: it is not there in every window. So is the torsional signal, as windows hold no encoder's edges.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gearsim_twin.compare.features import Features
from gearsim_twin.compare.merged import base
from gearsim_twin.compare.places import Domain, Place, band_text, hz_text

__all__ = ["Group", "Residual", "groups_of", "residuals"]

_LEFT_OUT = ("tone", "ratio", "passage")


@dataclass(frozen=True, slots=True)
class Group:
    """Places of one channel and domain that are one indicator.

    Attributes
    ----------
    channel : str
    domain : str
    thing : str
        What they belong to, in words, with the carrier band: "BPFO of bearing_3, 6-12 kHz".
    rows : tuple of int
        Their places in the plan.
    """

    channel: str
    domain: Domain
    thing: str
    rows: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Residual:
    """A group in one window: mean difference in dB, and the place that is furthest from it or off most."""

    group: Group
    value_db: float
    worst: Place


def groups_of(places: tuple[Place, ...]) -> tuple[Group, ...]:
    """The indicators of a plan."""
    found: dict[tuple[str, Domain, str], list[int]] = {}
    for row, place in enumerate(places):
        if place.kind not in _LEFT_OUT and place.domain != "torsional":
            found.setdefault((place.channel, place.domain, _thing(place)), []).append(row)
    return tuple(Group(*key, tuple(rows)) for key, rows in found.items())


def _thing(place: Place) -> str:
    if place.domain == "psd":
        return f"noise near {hz_text(2.0 ** (0.5 * round(2 * math.log2(max(place.at, 1.0)))))}"
    if place.domain in ("statistics", "transient") or place.kind == "floor":
        name = place.what()
    else:
        name = base(place.label) or place.kind
    return name if place.band_hz is None else f"{name}, {band_text(place.band_hz)}"


def residuals(groups: tuple[Group, ...], measured: Features, simulated: Features) -> tuple[Residual, ...]:
    """Measured minus modelled of each group; groups that one side says nothing of are left out."""
    difference = measured.level_db - np.where(np.isfinite(simulated.level_db), simulated.level_db, np.nan)
    found = []
    for group in groups:
        rows = np.array(group.rows)
        told = rows[np.isfinite(difference[rows])]
        if told.size:
            value = float(np.mean(difference[told]))
            worst = told[int(np.argmax(difference[told] * (1.0 if value >= 0 else -1.0)))]
            found.append(Residual(group, value, measured.places[int(worst)]))
    return tuple(found)
