"""The rigid rotation of a machine and the torques on it, as the compiled loop takes them.

Turns of the reference shaft are a polynomial of degree 7 at most, torques of degree 5. The motor gives
what the load takes and what the inertia J needs,

    T_motor = ratio T_load + 2 pi J d(speed)/dt,

derived from the polynomial of the turns itself, so that the rigid rotation is in equilibrium to rounding.
A fluctuation of the load comes on top and is not balanced by the motor: the rotation answers to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from gearsim_sim.integrate.pieces import DEGREE, plain_polynomial
from gearsim_sim.model.plant import Plant
from gearsim_sim.profile.curve import GRID_STEPS, Array, Constant, Curve, ramp_from
from gearsim_sim.profile.dynamics import LawLoad, TorqueSpeed

SPEED_SIZE, TORQUE_SIZE = 7, 6
SIZE = DEGREE + 1  # of the polynomials that the loop takes


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """Polynomials of u = (step - start_step) / length_steps, coefficients ascending, (SIZE,) each."""

    start_step: int
    end_step: int
    turns: Array  # of the reference shaft since start_step
    load: Array  # [N m] without its fluctuation
    motor: Array  # [N m]
    fluctuation: Array  # [N m] of the load
    step_s: float
    steady: bool = field(init=False)  # whether speed and torques are constant

    def __post_init__(self) -> None:
        torques = (self.load, self.motor, self.fluctuation)
        changing = np.any(self.turns[2:]) or any(np.any(one[1:]) for one in torques)
        object.__setattr__(self, "steady", not changing)

    @property
    def length_steps(self) -> float:
        """Steps from its start to its end."""
        return float(self.end_step - self.start_step)

    def _at(self, step: float, coefficients: Array) -> tuple[float, float, float]:
        return plain_polynomial((step - self.start_step) / self.length_steps, coefficients)

    def turns_at(self, step: float) -> float:
        """Turns since the start of the segment."""
        return self._at(step, self.turns)[0]

    def speed_hz(self, step: float) -> float:
        """Speed of the reference shaft."""
        return self._at(step, self.turns)[1] / (self.length_steps * self.step_s)

    def acceleration_hz_per_s(self, step: float) -> float:
        """Its change per second."""
        return self._at(step, self.turns)[2] / (self.length_steps * self.step_s) ** 2

    def load_nm(self, step: float) -> float:
        """Load torque without its fluctuation."""
        return self._at(step, self.load)[0]


@dataclass(frozen=True, slots=True)
class Profile:
    """Speed, load and fluctuation of the load over the steps of a run.

    Attributes
    ----------
    speed_hz, load_nm : Curve
        Speed of the reference shaft (degree 6 at most) and load torque (degree 5 at most).
    fluctuation_nm : Curve or None
        Of the load, not balanced by the motor.
    step_s : float
        Length of a step.
    ratio : float
        Turns of the loaded shaft per turn of the reference shaft.
    inertia_kg_m2 : float
        Of everything that turns, at the reference shaft.
    """

    speed_hz: Curve
    load_nm: Curve
    step_s: float
    ratio: float
    inertia_kg_m2: float
    fluctuation_nm: Curve | None = None

    def segment(self, step: int) -> Segment:
        """The segment that covers a step: no longer than the fixed grid, ending where a curve changes."""
        speed, load = self.speed_hz.stretch(step), self.load_nm.stretch(step)
        ends = [float((step // GRID_STEPS + 1) * GRID_STEPS), speed.end, load.end]
        begins = [float(step // GRID_STEPS * GRID_STEPS), speed.start, load.start]
        noise = None
        if self.fluctuation_nm is not None:
            noise = self.fluctuation_nm.stretch(step)
            ends.append(noise.end)
            begins.append(noise.start)
        start, end = math.ceil(max(begins)), math.ceil(min(ends))
        length = float(end - start)
        seconds = length * self.step_s
        turns = np.zeros(SIZE)
        own = speed.cut(start, length, SPEED_SIZE)
        turns[1:] = own * seconds / np.arange(1, SIZE)
        torques = np.zeros((3, SIZE))  # load, motor, fluctuation
        torques[0, :TORQUE_SIZE] = load.cut(start, length, TORQUE_SIZE)
        accelerating = 2 * math.pi * self.inertia_kg_m2 / seconds * own[1:] * np.arange(1, SPEED_SIZE)
        torques[1] = self.ratio * torques[0]
        torques[1, :TORQUE_SIZE] += accelerating
        if noise is not None:
            torques[2, :TORQUE_SIZE] = noise.cut(start, length, TORQUE_SIZE)
        return Segment(start, end, turns, torques[0], torques[1], torques[2], self.step_s)

    def speed_at(self, step: int) -> float:
        """Speed of the reference shaft [Hz]."""
        return self.speed_hz.stretch(step).value(float(step))

    def load_at(self, step: int) -> float:
        """Load torque without its fluctuation [N m]."""
        return self.load_nm.stretch(step).value(float(step))

    def changed(self, step: int, speed_hz: float | None, load_nm: float | None, ramp_steps: float) -> Profile:
        """Another operating point from a step on, over a smooth ramp; None lets a curve go on as it is.

        A load that depends on the speed goes on doing so, `load_nm` being its rated value; under a law of
        torques the speed answers to it. A new speed ends such a law.
        """
        speed, load = self.speed_hz, self.load_nm
        if speed_hz is not None:
            speed = ramp_from(speed, step, speed_hz, ramp_steps)
        elif load_nm is not None and isinstance(speed, TorqueSpeed):
            speed = speed.with_rated(step, ramp_from(speed.rotor.rated_nm, step, load_nm, ramp_steps))
        if isinstance(load, LawLoad):
            load = load.changed(step, speed, load_nm, ramp_steps)
        elif load_nm is not None:
            load = ramp_from(load, step, load_nm, ramp_steps)
        return replace(self, speed_hz=speed, load_nm=load)

    def turns_between(self, first: int, last: int) -> float:
        """Turns of the reference shaft from a step to a later one."""
        total, step = 0.0, first
        while step < last:
            segment = self.segment(step)
            end = min(segment.end_step, last)
            total += segment.turns_at(end) - segment.turns_at(step)
            step = end
        return total

    @property
    def constant(self) -> bool:
        """Whether speed and load stay as they are until an event."""
        return isinstance(self.speed_hz, Constant) and isinstance(self.load_nm, Constant)


def constant_profile(plant: Plant, step_s: float, speed_hz: float, load_nm: float) -> Profile:
    """One operating point of a machine."""
    return Profile(Constant(speed_hz), Constant(load_nm), step_s, load_ratio(plant), plant.inertia_kg_m2)


def load_ratio(plant: Plant) -> float:
    """Turns of the loaded shaft per turn of the reference shaft, in the senses of the torques."""
    motor, load = plant.torque_ratios
    return -load / motor
