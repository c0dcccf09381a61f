"""A view as levels at places: the same code for what was measured and what was simulated.

Adding a representation is one file with `places(frame, materials)` and `measure(material, places)`, and one
line of `REPRESENTATIONS`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from types import ModuleType
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine
from gearsim_twin.compare import cyclic, envelope, orders, psd, statistics, torsional, transient
from gearsim_twin.compare.frame import Frame, make_frame
from gearsim_twin.compare.levels import Levels, joined
from gearsim_twin.compare.material import Material
from gearsim_twin.compare.places import Domain, Place
from gearsim_twin.view import View

__all__ = ["REPRESENTATIONS", "Features", "HasMachine", "Plan", "features", "make_plan"]

REPRESENTATIONS: dict[Domain, ModuleType] = {
    "orders": orders,  # first: what it takes as tones the others leave out
    "psd": psd,
    "envelope": envelope,
    "cyclic": cyclic,
    "torsional": torsional,
    "statistics": statistics,
    "transient": transient,
}


class HasMachine(Protocol):
    """A case, or whatever else knows the nameplate."""

    @property
    def machine(self) -> Machine:
        """The nameplate."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """What is compared in a case: one list of places for all records, measured and simulated."""

    frame: Frame
    places: tuple[Place, ...]

    def of(self, domain: Domain) -> tuple[Place, ...]:
        """Places of one domain, in their order."""
        return tuple(place for place in self.places if place.domain == domain)


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """Levels of one record at the places of a plan.

    Attributes
    ----------
    places : tuple of Place, length n
    levels : Levels
        With what nuisances need to know.
    speed_hz : float
        Mean speed of the reference shaft.

    Notes
    -----
    `level_db` is NaN and `std_db` infinite where a place says nothing in this record, such as the order of
    a family that is not there.
    """

    places: tuple[Place, ...]
    levels: Levels
    speed_hz: float = float("nan")

    def __post_init__(self) -> None:
        if len(self.places) != self.levels.level_db.size:
            raise InputError("Features", "places", len(self.places), f"{self.levels.level_db.size} places")

    @property
    def level_db(self) -> NDArray[np.float64]:
        """Levels, shape (n,)."""
        return self.levels.level_db

    @property
    def std_db(self) -> NDArray[np.float64]:
        """Their sampling standard deviations, shape (n,)."""
        return self.levels.std_db

    @property
    def own(self) -> NDArray[np.float64]:
        """Share of each level that rests on a model alone, shape (n,)."""
        return self.levels.own

    @property
    def repeat_db(self) -> NDArray[np.float64]:
        """What the rest of it differs by from run to run, shape (n,)."""
        return self.levels.repeat_db

    @property
    def stands_out(self) -> NDArray[np.bool_]:
        """Where the level is more than noise alone would give; everywhere for what is no line."""
        return np.asarray(self.levels.height_db > self.levels.clear_db)

    def where(self, mask: NDArray[np.bool_]) -> Features:
        """The features at some of the places."""
        kept = tuple(place for place, on in zip(self.places, mask.tolist(), strict=True) if on)
        levels = Levels(*(getattr(self.levels, f.name)[mask] for f in fields(Levels)))
        return Features(kept, levels, self.speed_hz)


def make_plan(
    case: HasMachine, views: Sequence[View], shifted: Sequence[tuple[str, float, float]] = ()
) -> Plan:
    """What is compared, from the nameplate and the records at hand.

    Parameters
    ----------
    case : Case
    views : sequence of View
        The measured records for training; simulated ones too, if lines of theirs that no record has shall
        be among the places.
    shifted : sequence of (fault, order, share)
        Bearing families whose lines lie off the nameplate's orders, as `make_frame` takes them.

    Raises
    ------
    InputError
        When records have no channel in common or are too short.
    """
    frame = make_frame(case.machine, views, shifted)
    places: list[Place] = []
    materials = [Material(view, frame) for view in views]
    for domain, representation in REPRESENTATIONS.items():
        places += representation.places(frame, materials)
        if domain == "orders":
            tones = tuple((p.channel, p.at, p.unit) for p in places if p.kind == "tone")
            frame = replace(frame, tones=tones)
            for material in materials:
                material.frame = frame
    return Plan(frame, tuple(places))


def features(view: View, plan: Plan) -> Features:
    """The levels of a record at the places of a plan.

    Raises
    ------
    InputError
        When the record lacks a channel of the plan, or is sampled too slowly for it.
    """
    missing = set(plan.frame.channels) - set(view.record.channels)
    if missing:
        have = ", ".join(view.record.channels)
        raise InputError(view.record.source, "channels", have, f"with {', '.join(sorted(missing))}")
    if plan.frame.top_hz > 0.5 * view.record.sample_rate_hz:
        need = f"above {2 * plan.frame.top_hz:.6g} Hz, for what the other records hold"
        raise InputError(view.record.source, "sample_rate", view.record.sample_rate_hz, need)
    material = Material(view, plan.frame)
    parts = [
        representation.measure(material, wanted)
        for domain, representation in REPRESENTATIONS.items()
        if (wanted := plan.of(domain))
    ]
    return Features(plan.places, joined(parts), material.speed_hz)
