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
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any

from gearsim_io.errors import InputError
from gearsim_io.quantities import validate
from gearsim_sim.events import FaultSpec
from gearsim_sim.model.ball_bearing import BallBearing
from gearsim_sim.params.fields import Count, SiKeyed, Strict

MAX_SEVERITY = 2.0


class SpallParams(Strict):
    """Parameters common to the spalls of both races.

    `depth_m` beyond what the ball can reach makes no difference. `row` counts from 1.
    """

    width_m: Annotated[float, SiKeyed("m", gt=0)] = 0.8e-3
    depth_m: Annotated[float, SiKeyed("m", gt=0)] = 0.3e-3
    position_rad: Annotated[float, SiKeyed("rad", ge=-2 * math.pi, le=2 * math.pi)] | None = None
    row: Count = 1


@dataclass(frozen=True, slots=True)
class Spall:
    """A spall in place: geometry that the contact model needs."""

    bearing: int  # 0..3
    row: int  # from 0
    on_inner_race: bool
    position_rad: float  # middle of the pit; of the inner race at shaft angle zero
    half_width_rad: float
    depth_m: float
    race_radius_m: float
    ball_radius_m: float
    severity: float

    def drop(self, offset_rad: float) -> float:
        """How much the race is away under a ball `offset_rad` from the middle of the pit [m]."""
        beta = self.half_width_rad - abs(offset_rad)
        if beta <= 0:
            return 0.0
        return self.severity * min(self.depth_m, edge_drop(beta, self))


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


@dataclass(frozen=True, slots=True)
class FaultKind:
    """An entry of the registry: a kind of fault, its parameters, and how it is put in place."""

    name: str
    summary: str
    params_model: type[SpallParams]
    place: Callable[[Any, int, BallBearing], Spall]

    def build(
        self, spec: FaultSpec, bearing_names: tuple[str, ...], bearings: tuple[BallBearing, ...]
    ) -> Spall:
        """The fault in place; `severity` is that of `spec`.

        Raises
        ------
        InputError
            For an unknown bearing or parameter, or a pit that the localised model cannot have.
        """
        where = f"fault {spec.name}"
        if spec.component not in bearing_names:
            raise InputError(where, "component", spec.component, "one of " + ", ".join(bearing_names))
        if not 0 <= spec.severity <= MAX_SEVERITY:
            raise InputError(where, "severity", spec.severity, f"0 to {MAX_SEVERITY:g}")
        params = validate(self.params_model, spec.params, where)
        index = bearing_names.index(spec.component)
        return check_spall(where, self.place(params, index, bearings[index]), bearings[index], spec)


def check_spall(where: str, spall: Spall, bearing: BallBearing, spec: FaultSpec) -> Spall:
    """The spall with the severity of `spec`, if a ball can cross it."""
    width = 2 * spall.half_width_rad * spall.race_radius_m
    limit = min(bearing.ball_spacing_rad * spall.race_radius_m, 2 * spall.ball_radius_m)
    if width >= limit:
        expected = f"less than {limit * 1e3:.3g} mm, so that one ball at a time is in the spall"
        raise InputError(where, "width_m", width, expected)
    if not 0 <= spall.row < bearing.rows:
        raise InputError(where, "row", spall.row + 1, f"1 to {bearing.rows}")
    return replace(spall, severity=spec.severity)
