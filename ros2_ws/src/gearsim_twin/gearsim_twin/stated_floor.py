"""Noise that a content states for its accelerometers, taken from the simulation and added in closed form.

Drawn noise scatters as the record's own does: beside a floor that is told by its expectation it would fit
worse for that alone, by a third of a nat for each band.
"""

from __future__ import annotations

import copy

import numpy as np

from gearsim_twin.causes.cause import Content
from gearsim_twin.compare.chains import ChannelNuisance, Nuisance

__all__ = ["without_floor"]

_DENSITY, _CORNER = "noise_density", "noise_corner"
_UNITS = {_DENSITY: " m/s^2/Hz^0.5", _CORNER: " Hz"}
# What comes after the noise and is not linear, so that the noise must pass it.
_BEHIND = ("range", "dropouts", "overload")
_KNOTS_HZ = np.geomspace(0.1, 1e6, 85)


def without_floor(content: Content) -> tuple[Content, Nuisance]:
    """The content without the noise that causes have given single channels, and that noise.

    Noise in other units than those of causes, and noise that is clipped or interrupted, stays in the content.
    """
    rows = content.get("sensors", {}).get("accelerometers", {}).get("each", {})
    chains = {name: chain for name, row in rows.items() if (chain := _floor(name, row)) is not None}
    if not chains:
        return content, Nuisance(())
    bare = copy.deepcopy(content)
    for name in chains:
        row = bare["sensors"]["accelerometers"]["each"][name]
        for key in _UNITS:
            row.pop(key, None)
    return bare, Nuisance(tuple(chains.values()))


def _floor(channel: str, row: Content) -> ChannelNuisance | None:
    density, corner_hz = (_number(row, key) for key in _UNITS)
    if density is None or density <= 0.0 or any(key in row for key in _BEHIND):
        return None
    if _CORNER in row and corner_hz is None:
        return None
    floor = density**2 * (1.0 + (corner_hz or 0.0) / _KNOTS_HZ)
    db = 10.0 * np.log10(floor)
    return ChannelNuisance(channel, floor_hz=tuple(_KNOTS_HZ.tolist()), floor_db=tuple(db.tolist()))


def _number(row: Content, key: str) -> float | None:
    """A number that is written in the unit that causes write."""
    told = row.get(key)
    if not isinstance(told, str) or not told.endswith(_UNITS[key]):
        return None
    return float(told.removesuffix(_UNITS[key]))
