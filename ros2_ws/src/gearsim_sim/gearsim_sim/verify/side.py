"""Forces beside the machine's own elements, readable: known forces, loose feet, side oscillators.

Each is one contribution of a fault, found by its place among all contributions. Known forces that would turn
the whole machine are not among faults.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.loose_foot import LooseFoot
from gearsim_sim.model.plant import Moment, Plant
from gearsim_sim.model.rotating_force import TIME_TRACK, RotatingForce
from gearsim_sim.model.side_oscillator import SideOscillator

Array = NDArray[np.float64]
Faults = Sequence[tuple[Contribution, float]]


class Now(NamedTuple):
    """A moment, with time since step 0 and the motion of all degrees of freedom."""

    seconds: float
    x: Array
    v: Array
    moment: Moment
    change_hz_per_s: float  # of the reference shaft's speed


class SideForce(Protocol):
    """A force along directions of its own."""

    @property
    def size(self) -> int:
        """Components of the state that are its."""
        ...

    def start(self, x: Array, v: Array) -> Array:
        """Its components when it begins."""
        ...

    def act(self, now: Now, own: Array) -> tuple[Array, Array]:
        """Force on all degrees of freedom, and the derivative of its components."""
        ...


@dataclass(frozen=True, eq=False)
class Known:
    """A known function of angle, speed and time."""

    plant: Plant
    place: int
    one: RotatingForce
    size: int = 0

    def start(self, x: Array, v: Array) -> Array:  # noqa: ARG002
        """It remembers nothing."""
        return np.zeros(0)

    def act(self, now: Now, own: Array) -> tuple[Array, Array]:
        """See `SideForce`."""
        one, severity = self.one, now.moment.faults[self.place][1]
        if one.track == TIME_TRACK:
            force = one.force(now.seconds, now.moment.speed_hz, now.change_hz_per_s)
        else:
            turns = float(self.plant.phases(now.moment.turns)[one.track])
            rate = abs(float(self.plant.rates[one.track]))
            force = one.force(turns, now.moment.speed_hz, now.change_hz_per_s, rate=rate)
        return severity * force * self.plant.system.direction(one.direction), own


@dataclass(frozen=True, eq=False)
class Foot:
    """A loose foot."""

    direction: Array
    place: int
    one: LooseFoot
    size: int = 0

    def start(self, x: Array, v: Array) -> Array:  # noqa: ARG002
        """It remembers nothing."""
        return np.zeros(0)

    def act(self, now: Now, own: Array) -> tuple[Array, Array]:
        """See `SideForce`."""
        lift, rate = float(self.direction @ now.x), float(self.direction @ now.v)
        return self.one.force(lift, rate, now.moment.faults[self.place][1]) * self.direction, own


@dataclass(frozen=True, eq=False)
class Oscillator:
    """A mass on springs; its components are displacement and rate."""

    directions: Array  # (places, dofs)
    place: int
    one: SideOscillator
    size: int = 2

    def start(self, x: Array, v: Array) -> Array:
        """It moves with its places at first."""
        return np.array([np.mean(self.directions @ x), np.mean(self.directions @ v)])

    def act(self, now: Now, own: Array) -> tuple[Array, Array]:
        """See `SideForce`."""
        places = np.stack([self.directions @ now.x, self.directions @ now.v], axis=1)
        z, z_rate = own.tolist()
        forces = self.one.forces(z, z_rate, places, now.moment.faults[self.place][1])
        return forces @ self.directions, np.array([z_rate, self.one.acceleration(z, z_rate, places)])


def side_forces(plant: Plant, faults: Faults) -> tuple[SideForce, ...]:
    """Those among the contributions of faults."""
    direction, found = plant.system.direction, list[SideForce]()
    for place, (one, _) in enumerate(faults):
        if isinstance(one, RotatingForce):
            found.append(Known(plant, place, one))
        elif isinstance(one, LooseFoot):
            found.append(Foot(direction(one.direction), place, one))
        elif isinstance(one, SideOscillator):
            directions = np.array([direction(vector) for vector in one.directions])
            found.append(Oscillator(directions, place, one))
    return tuple(found)
