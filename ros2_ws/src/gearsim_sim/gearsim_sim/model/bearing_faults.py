"""What faults do to a rolling bearing beside pits (`spall`): profiles of surfaces, numbers added.

Each is a row of a table of the compiled loop (`bearing_loop`), and answers for itself in the readable model
(`BearingSeat`). Surfaces say what they lack under each element; see `pit` and `surface` for the shapes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.ring import Ring
from gearsim_sim.model.rolling_bearing import RollingBearing
from gearsim_sim.model.surface import table_lookup

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SurfaceProfile:
    """A smooth shape of a race or of a ball, from a zone or the whole turn.

    On a race, the fraction of a turn between the zone's start and a ball decides; on a ball (`on_ball`) its
    spin. `values` are a table (`PeriodicSeries.table`, `zone_table`) of what is missing [m].
    """

    table: ClassVar[str] = "profiles"

    bearing: int
    first_ball: int
    balls: int  # that the shape acts on, from the first one on
    ring: Ring
    on_ball: bool
    start_turns: float  # at angle zero of the ring
    span_turns: float
    values: Array

    def missing(self, law: RollingBearing, cage_rad: float, phases: Array) -> Array:
        """What is missing under each ball [m]; shape (balls,)."""
        own = slice(self.first_ball, self.first_ball + self.balls)
        turned = self.start_turns + self.ring.angle_turns(phases)
        if self.on_ball:
            at = np.full(self.balls, turned)
        else:
            at = (law.azimuths_rad[own] + cage_rad) / (2 * math.pi) - turned
        fraction = (at - np.floor(at)) / self.span_turns
        missing = np.zeros(law.ball_count)
        inside = table_lookup(self.values, np.minimum(fraction, 1.0))
        missing[own] = np.where(fraction < 1.0, inside, 0.0)
        return missing

    def numbers(self) -> tuple[float, ...]:
        """The columns of the table `profiles` but for the place of its samples."""
        return (
            self.bearing,
            self.first_ball,
            self.balls,
            self.ring.track,
            self.ring.sense,
            self.on_ball,
            self.start_turns,
            self.span_turns,
        )

    def samples(self) -> Array:
        """The table."""
        return self.values


class Term(IntEnum):
    """Numbers of a bearing that a fault may add to."""

    CLEARANCE = 0  # clearance [m]
    SLIP = 1  # share of the cage's speed, halving force [N], walk, knots per turn, key
    CAGE_JITTER = 2  # turns, knots per turn, key
    POCKET_PLAY = 3  # turns, knots per turn, key
    FILM = 4  # thickness under 1 N at 1 Hz between the rings [m], power of the speed, squeeze constants


@dataclass(frozen=True, slots=True)
class BearingTerm:
    """Numbers added to those of a bearing; the first ones are scaled by the severity (see `bearing_loop`)."""

    table: ClassVar[str] = "bearing_terms"

    bearing: int
    what: Term
    values: tuple[float, ...]

    def numbers(self) -> tuple[float, ...]:
        """The columns of the table `bearing_terms`."""
        return (self.bearing, float(self.what), *self.values, *[0.0] * (5 - len(self.values)))

    def samples(self) -> None:
        """A term needs no table."""
        return
