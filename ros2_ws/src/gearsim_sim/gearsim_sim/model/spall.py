"""Localised spalls of bearing races: the path of a ball across a pit, thesis Figure 4.4 (b).

While a ball crosses the pit, it first rolls over the entry edge, then over the exit edge: its centre
moves on circles of the ball's radius about the two edges. Half-way through it changes over, and the
direction of its motion changes at once: the impact. With beta the angle between the ball and the nearer
edge, seen from the bearing's axis, and R the race's radius, the centre lies by

    drop = r - sqrt(r^2 - (R sin beta)^2) -/+ R (1 - cos beta)       (- outer race, + inner race)

off its ordinary path. At half the width this is the greatest depth that the ball can reach. A pit
shallower than that carries the ball on its floor in between. Severity scales the drop as a whole.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from gearsim_sim.model.ring import Ring


@dataclass(frozen=True, slots=True)
class Spall:
    """A spall in place: geometry that the contact model needs."""

    table: ClassVar[str] = "spalls"

    bearing: int  # index of its seat in the plant
    row: int  # from 0
    on_inner_race: bool
    ring: Ring  # what it turns with
    position_rad: float  # middle of the pit, at angle zero of the ring
    half_width_rad: float
    depth_m: float
    race_radius_m: float
    ball_radius_m: float

    def drop(self, offset_rad: float) -> float:
        """How much the race is away under a ball `offset_rad` from the middle of the pit [m]."""
        beta = self.half_width_rad - abs(offset_rad)
        if beta <= 0:
            return 0.0
        return min(self.depth_m, edge_drop(beta, self))

    def numbers(self) -> tuple[float, ...]:
        """The columns of the table `spalls`."""
        return (
            self.bearing,
            self.row,
            self.ring.track,
            self.ring.sense,
            self.on_inner_race,
            self.position_rad / (2 * math.pi),
            self.half_width_rad,
            self.depth_m,
            self.race_radius_m,
            self.ball_radius_m,
        )

    def samples(self) -> None:
        """A pit needs no table."""
        return


def edge_drop(beta_rad: float, spall: Spall) -> float:
    """Drop of a ball that has rolled `beta_rad` past the edge, for severity 1 [m]."""
    return reachable_depth(
        2 * beta_rad * spall.race_radius_m,
        race_radius_m=spall.race_radius_m,
        ball_radius_m=spall.ball_radius_m,
        on_inner_race=spall.on_inner_race,
    )


def reachable_depth(
    width_m: float, *, race_radius_m: float, ball_radius_m: float, on_inner_race: bool
) -> float:
    """Greatest depth that a ball reaches in a pit of this width along the race [m].

    For the Koyo 1205 and 0.8 mm: 19.0 um on the outer and 27.6 um on the inner race (thesis 5.3.2 and
    5.3.3: 19.1 and 27.6 um).
    """
    beta = width_m / (2 * race_radius_m)
    chord = race_radius_m * math.sin(beta)
    ball = ball_radius_m - math.sqrt(ball_radius_m**2 - chord**2)
    race = 2 * race_radius_m * math.sin(beta / 2) ** 2
    return ball + race if on_inner_race else ball - race
