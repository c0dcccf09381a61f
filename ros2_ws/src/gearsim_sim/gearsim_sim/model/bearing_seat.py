"""A rolling bearing in its place: which interfaces it acts on, and which angles move its cage and rings."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.ball_bearing import BallBearing
from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.ring import Ring
from gearsim_sim.model.spall import Spall

Faults = tuple[tuple[Contribution, float], ...]
Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BearingSeat:
    """A bearing between two bodies; its interfaces are where the inner ring is in the outer."""

    name: str
    law: BallBearing
    x: int  # index of the interface
    y: int
    cage: int  # track, signed counter-clockwise
    inner: Ring
    outer: Ring
    nominal_stiffness_n_per_m: float

    def cage_angle_rad(self, phases: Array) -> float:
        """Azimuth of the cage."""
        return 2 * math.pi * float(phases[self.cage])

    def missing(self, phases: Array, faults: Faults) -> Array:
        """What the races lack under each ball because of faults [m]; shape (balls,)."""
        law = self.law
        missing = np.zeros(law.ball_count)
        azimuths = law.azimuths_rad + self.cage_angle_rad(phases)
        for spall, severity in faults:
            if not isinstance(spall, Spall):
                continue
            middle = spall.position_rad + 2 * math.pi * spall.ring.angle_turns(phases)
            first = spall.row * law.balls_per_row
            for ball in range(first, first + law.balls_per_row):
                offset = math.remainder(azimuths[ball] - middle, 2 * math.pi)
                missing[ball] += severity * spall.drop(offset)
        return missing

    def force(self, displacement_m: Array, phases: Array, faults: Faults = ()) -> Array:
        """Contact force (x, y) of the inner ring on the outer ring [N]."""
        missing = self.missing(phases, faults)
        return self.law.force(displacement_m, self.cage_angle_rad(phases), missing)

    def stiffness(self, displacement_m: Array, phases: Array, faults: Faults = ()) -> Array:
        """Derivative of `force` with respect to the displacement, shape (2, 2) [N/m]."""
        missing = self.missing(phases, faults)
        return self.law.stiffness(displacement_m, self.cage_angle_rad(phases), missing)

    def energy(self, displacement_m: Array, phases: Array, faults: Faults = ()) -> float:
        """Elastic energy [J]."""
        missing = self.missing(phases, faults)
        return self.law.energy(displacement_m, self.cage_angle_rad(phases), missing)
