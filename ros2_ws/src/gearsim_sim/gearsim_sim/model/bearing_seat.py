"""A rolling bearing in its place: which interfaces it acts on, and which angles move its cage and rings."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.bearing_faults import BearingTerm, SurfaceProfile, Term
from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.ring import Ring
from gearsim_sim.model.rolling_bearing import RollingBearing
from gearsim_sim.model.spall import Spall

Faults = tuple[tuple[Contribution, float], ...]
Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BearingSeat:
    """A bearing between two bodies; its interfaces are where the inner ring is in the outer."""

    name: str
    law: RollingBearing
    x: int  # index of the interface
    y: int
    cage: int  # track, signed counter-clockwise
    spin: int  # track of the balls' turning about themselves, relative to the cage
    inner: Ring
    outer: Ring
    nominal_stiffness_n_per_m: float

    def cage_angle_rad(self, phases: Array) -> float:
        """Azimuth of the cage."""
        return 2 * math.pi * float(phases[self.cage])

    def missing(self, phases: Array, faults: Faults) -> Array:
        """What surfaces lack under each ball because of faults, and added clearance [m]; shape (balls,).

        Slip and oil films have a memory and exist in the compiled loop only.
        """
        missing = np.zeros(self.law.ball_count)
        cage = self.cage_angle_rad(phases)
        for one, severity in faults:
            if isinstance(one, Spall | SurfaceProfile):
                missing += severity * one.missing(self.law, cage, phases)
            elif isinstance(one, BearingTerm) and one.what is Term.CLEARANCE:
                missing += severity * one.values[0]
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
