"""Elements with a motion of their own, readable: slipping cages, oil films, side oscillators, loose feet.

The compiled loop carries what these remember from step to step; here each is a differential equation, with
a few components behind those of the machine in the state that DOP853 integrates.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.bearing_faults import BearingTerm, Term
from gearsim_sim.model.bearing_seat import BearingSeat
from gearsim_sim.model.cage_slip import jitter
from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.hertz import POINT_EXPONENT
from gearsim_sim.model.oil_film import LINE_LOAD_POWER, POINT_LOAD_POWER
from gearsim_sim.model.plant import Moment, Plant

Array = NDArray[np.float64]
Faults = Sequence[tuple[Contribution, float]]
FORCE_MEMORY_S = 0.1  # over which the force is averaged that decides on the slip
BALL_STRIDE = 1 << 40  # of the knots between the random functions of neighbours
_CAGE = 4  # components before those of the films: lag of cage and of balls, way of the cage, mean force


@dataclass(frozen=True, eq=False)
class RememberingBearing:
    """A bearing with slip, play or oil films; its state is (lag, lag of the spin, way, force, films...).

    The film of each ball is counted in thicknesses under 1 N.
    """

    index: int
    seat: BearingSeat
    rates: Array  # of the tracks

    @property
    def size(self) -> int:
        """Components of its state."""
        return _CAGE + self.seat.law.ball_count

    def own(self, moment: Moment) -> Faults:
        """Contributions to this bearing."""
        return [pair for pair in moment.faults if getattr(pair[0], "bearing", None) == self.index]

    def start(self, films: Array) -> Array:
        """The state when the fault begins, `films` being those of the compiled loop at that time."""
        return np.concatenate([np.zeros(_CAGE), films[: self.seat.law.ball_count]])

    def forces(
        self, q: Array, state: Array, moment: Moment, phases: Array, own: Faults
    ) -> tuple[Array, Array, float]:
        """Force on the outer ring (x, y), of each ball, and the thickness of a film under 1 N now [m]."""
        seat, place = self.seat, phases.copy()
        terms = [(one, level) for one, level in own if isinstance(one, BearingTerm) and level]
        place[seat.cage] -= state[0]
        place[seat.spin] -= state[1]
        azimuths, unit = seat.law.azimuths_rad.copy(), 0.0
        for one, level in terms:
            values = one.values
            if one.what is Term.CAGE_JITTER:
                place[seat.cage] += level * values[0] * jitter(int(values[2]), state[2] * values[1])
            elif one.what is Term.POCKET_PLAY:
                for j in range(azimuths.size):
                    ahead = jitter(int(values[2]), state[2] * values[1], j * BALL_STRIDE)
                    azimuths[j] += 2 * math.pi * level * values[0] * ahead
            elif one.what is Term.FILM:
                unit += level * values[0] * abs(moment.speed_hz) ** values[1]
        law = dataclasses.replace(seat.law, azimuths_rad=azimuths)
        moved = dataclasses.replace(seat, law=law)
        missing = moved.missing(place, tuple(own)) - unit * state[_CAGE:]
        angle = moved.cage_angle_rad(place)
        balls = law.ball_forces(law.compressions(q, angle, missing))
        return law.force(q, angle, missing), balls, unit

    def rate(
        self, state: Array, total: Array, balls: Array, unit: float, moment: Moment, own: Faults
    ) -> Array:
        """The derivative of the state."""
        seat, rate = self.seat, np.zeros_like(state)
        squeeze = 0.0
        point = seat.law.exponent == POINT_EXPONENT
        for one, level in own:
            if not isinstance(one, BearingTerm) or not level:
                continue
            values = one.values
            if one.what is Term.SLIP:
                share = level * values[0] / (1 + state[3] / values[1])
                share *= 1 + values[2] * jitter(int(values[4]), state[2] * values[3])
                rate[0] += share * self.rates[seat.cage] * moment.speed_hz
                rate[1] += share * self.rates[seat.spin] * moment.speed_hz
            if one.what in (Term.SLIP, Term.CAGE_JITTER, Term.POCKET_PLAY):
                rate[2] = abs(self.rates[seat.cage] * moment.speed_hz)
                rate[3] = (float(np.hypot(*total)) - state[3]) / FORCE_MEMORY_S
            if one.what is Term.FILM:
                squeeze += level * values[2 if point else 3]
        if squeeze:
            z = state[_CAGE:]
            power = POINT_LOAD_POWER if point else LINE_LOAD_POWER
            give = z if point else math.sqrt(unit) * z**1.5
            rate[_CAGE:] = give * (z**-power - balls) / squeeze
        return rate


def remembering(plant: Plant, faults: Faults) -> tuple[RememberingBearing, ...]:
    """The bearings of which some fault makes one."""
    found = {
        one.bearing for one, _ in faults if isinstance(one, BearingTerm) and one.what is not Term.CLEARANCE
    }
    return tuple(RememberingBearing(b, plant.bearings[b], plant.rates) for b in sorted(found))
