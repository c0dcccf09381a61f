"""The size at which an effect stands out by so many dB on the very machine of a case.

How far a resonance or a pit is seen hangs on where it lies: the sizes that `calibrate` found on one machine
are where the search on another begins. Two short records of the machine are compared by the yardstick of
`severity`, one with the effect and one without, under the noise of the case.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from blind.effects import EFFECTS, SEVERITIES, TARGETS_DB, size_of
from blind.making import Hidden, make
from blind.rigs import RIGS
from blind.severity import stands_out_db
from gearsim_io.errors import InputError

SECONDS = {"parallel": 0.8, "bearing": 1.2, "planetary": 1.2}
_NEAR_DB, _NEAR = 1.5, 0.125  # or that part of the target
_TRIES = 8
_SLOPES = (4.0, 60.0)  # dB per decade, of what changes at all
_FAR = 1.0  # decades in one step
# What no size of an effect reaches on a machine, the largest does by this part of the way or not at all.
_ENOUGH = 0.8


class OutOfReachError(LookupError):
    """No size of an effect makes it stand out by so much on this machine."""


def plain_data(rig: str, noise: float, seed: tuple[int, ...]) -> NDArray[np.float32]:
    """A short record of the machine without any effect."""
    return make(Hidden(rig, (), noise), seed, records=1, seconds=SECONDS[rig]).records[0].data


def stands_out(
    rig: str, effect: tuple[str, float], noise: float, seed: tuple[int, ...], plain: NDArray[np.float32]
) -> float:
    """By how many dB it stands out of `plain`."""
    made = make(Hidden(rig, (effect,), noise), seed, records=1, seconds=SECONDS[rig])
    return stands_out_db(plain, made.records[0].data, RIGS[rig].rate_hz, EFFECTS[effect[0]].random)


def size_for(
    rig: str, name: str, severity: str, noise: float, seed: tuple[int, ...], plain: NDArray[np.float32]
) -> float:
    """The size for a severity.

    Parameters
    ----------
    rig, name, severity : str
    noise : float
        Of the sensors, over the ordinary one.
    seed : tuple of int
        Of the machine.
    plain : ndarray
        As `plain_data` gives it.

    Raises
    ------
    OutOfReachError
        If none within the bounds of the effect does.
    """
    first = size_of(name, rig, severity)
    if first is None:
        raise OutOfReachError(f"no {severity} {name} on {rig}")
    if EFFECTS[name].given:
        return first
    return search(rig, name, TARGETS_DB[SEVERITIES.index(severity)], first, noise, seed, plain)


def search(
    rig: str,
    name: str,
    target_db: float,
    first: float,
    noise: float,
    seed: tuple[int, ...],
    plain: NDArray[np.float32],
) -> float:
    """As `size_for`, for any number of dB, from a first size.

    Pits that are wider than what an element bridges stand out no more: where the most that an effect does is
    four fifths of what is asked for, that is enough.
    """
    effect = EFFECTS[name]
    low, high = float(np.log10(effect.low)), float(np.log10(effect.high))
    grows = -1.0 if effect.shrinks else 1.0
    found: list[tuple[float, float]] = []
    at = float(np.clip(np.log10(first), low, high))
    for _ in range(_TRIES):
        try:
            db = stands_out(rig, (name, float(10**at)), noise, seed, plain)
        except InputError:  # more than the machine can have
            high = at = 0.5 * (at + (max(place for place, _ in found) if found else low))
            continue
        found.append((at, db))
        if abs(db - target_db) <= max(_NEAR_DB, _NEAR * target_db):
            return float(f"{10**at:.4g}")
        at = float(np.clip(_next(found, target_db, grows), low, high))
        if any(abs(at - place) < 1e-3 for place, _ in found):
            break
    nearest = min(found, key=lambda one: abs(one[1] - target_db), default=(0.0, 0.0))
    if _ENOUGH * target_db <= nearest[1] <= target_db:
        return float(f"{10 ** nearest[0]:.4g}")
    raise OutOfReachError(f"{name} on {rig} stands out by {nearest[1]:.1f} dB, not by {target_db:g}")


def _next(found: list[tuple[float, float]], target: float, grows: float) -> float:
    """Between the nearest places on both sides of the target, else further by a slope."""
    below = [one for one in found if one[1] < target]
    above = [one for one in found if one[1] >= target]
    if below and above:
        (x0, y0), (x1, y1) = max(below, key=lambda one: one[1]), min(above, key=lambda one: one[1])
        share = float(np.clip((target - y0) / max(y1 - y0, 1e-9), 0.15, 0.85))
        return x0 + share * (x1 - x0)
    x, y = min(found, key=lambda one: abs(one[1] - target))
    slope = 20.0
    if len(found) > 1:
        (x0, y0), (x1, y1) = found[-2:]
        slope = float(np.clip(abs((y1 - y0) / (x1 - x0)), *_SLOPES)) if abs(x1 - x0) > 1e-6 else slope
    return x + grows * float(np.clip((target - y) / slope, -_FAR, _FAR))
