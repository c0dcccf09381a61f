"""Localised pits of races and rolling elements in their place; see `pit` for their shapes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.pit import Edge, race_edge, rounded_drop
from gearsim_sim.model.ring import Ring
from gearsim_sim.model.rolling_bearing import RollingBearing

Array = NDArray[np.float64]
ON_RACE = -1  # in place of the number of a ball


@dataclass(frozen=True, slots=True)
class Spall:
    """A localised pit in a race, crossed by one ball of a row at a time, or in one ball.

    `ring` is what the pit turns with: a ring of the bearing, or (sense 1) the track of the balls' spin. A pit
    of a ball meets one race when the spin's angle and `position_rad` make whole turns; what it does at the
    other race is a second row, half a turn off.
    """

    table: ClassVar[str] = "spalls"

    bearing: int  # index of its seat in the plant
    row: int  # from 0
    ball: int  # of all balls of the bearing, or ON_RACE
    ring: Ring
    position_rad: float  # middle of the pit, at angle zero of the ring
    half_width_rad: float
    depth_m: float
    edge: Edge
    rectangular: bool = False

    def drop(self, offset_rad: float) -> float:
        """How much is missing `offset_rad` from the middle of the pit [m]."""
        if self.rectangular:
            return self.depth_m if abs(offset_rad) < self.half_width_rad else 0.0
        return rounded_drop(offset_rad, self.half_width_rad, self.depth_m, self.edge)

    def missing(self, law: RollingBearing, cage_rad: float, phases: Array) -> Array:
        """What is missing under each ball [m]; shape (balls,)."""
        middle = self.position_rad + 2 * math.pi * self.ring.angle_turns(phases)
        missing = np.zeros(law.ball_count)
        if self.ball != ON_RACE:
            missing[self.ball] = self.drop(math.remainder(middle, 2 * math.pi))
            return missing
        first = self.row * law.balls_per_row
        for ball in range(first, first + law.balls_per_row):
            offset = math.remainder(law.azimuths_rad[ball] + cage_rad - middle, 2 * math.pi)
            missing[ball] = self.drop(offset)
        return missing

    @property
    def on_inner_race(self) -> bool:
        """Whether it is a pit of the inner race."""
        return self.ball == ON_RACE and self.edge.carrier_sign > 0

    @property
    def race_radius_m(self) -> float:
        """Radius of the race that has the pit, or meets it."""
        edge = self.edge
        return edge.carrier_radius_m if self.ball == ON_RACE else edge.other_radius_m

    def numbers(self) -> tuple[float, ...]:
        """The columns of the table `spalls`."""
        return (
            self.bearing,
            self.row,
            self.ball,
            self.ring.track,
            self.ring.sense,
            self.position_rad / (2 * math.pi),
            self.half_width_rad,
            self.depth_m,
            self.edge.carrier_radius_m,
            self.edge.other_radius_m,
            self.edge.carrier_sign,
            self.edge.other_sign,
            self.rectangular,
        )

    def samples(self) -> None:
        """A pit needs no table."""
        return


def reachable_depth(
    width_m: float, *, race_radius_m: float, ball_radius_m: float, on_inner_race: bool
) -> float:
    """Greatest depth that a ball reaches in a pit of this width along the race [m].

    For the Koyo 1205 and 0.8 mm: 19.0 um on the outer and 27.6 um on the inner race (thesis 5.3.2 and
    5.3.3: 19.1 and 27.6 um).
    """
    return race_edge(race_radius_m, ball_radius_m, inner=on_inner_race).drop(width_m / (2 * race_radius_m))
