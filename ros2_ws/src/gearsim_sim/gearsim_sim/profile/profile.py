"""The rigid rotation of a machine and the torques on it, as the compiled loop takes them.

Turns of the reference shaft are a polynomial of degree 7 at most, torques of degree 5. The motor gives
what the load takes and what the inertia J needs,

    T_motor = ratio T_load + 2 pi J d(speed)/dt,

derived from the polynomial of the turns itself, so that the rigid rotation is in equilibrium to rounding.
A fluctuation of the load comes on top and is not balanced by the motor: the rotation answers to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from gearsim_sim.profile.curve import GRID_STEPS, Array, Constant, Curve, Laid, ramp_from

SPEED_SIZE, TURNS_SIZE, TORQUE_SIZE = 7, 8, 6


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """Polynomials in u = (step - start_step) / (end_step - start_step), lowest power first."""

    start_step: int
    end_step: int
    turns: Array  # (8,) turns of the reference shaft since start_step
    load_nm: Array  # (6,) without the fluctuation
    motor_nm: Array  # (6,)
    fluctuation_nm: Array  # (6,) of the load, beyond `load_nm`
    step_s: float

    @property
    def steps(self) -> int:
        """Length."""
        return self.end_step - self.start_step

    @property
    def steady(self) -> bool:
        """Whether speed and torques are constant."""
        torques = (self.load_nm, self.motor_nm, self.fluctuation_nm)
        return not (np.any(self.turns[2:]) or any(np.any(one[1:]) for one in torques))

    def turns_at(self, step: float) -> float:
        """Turns since the start of the segment."""
        return _horner(self.turns, (step - self.start_step) / self.steps)

    def speed_hz_at(self, step: float) -> float:
        """Speed of the reference shaft."""
        u = (step - self.start_step) / self.steps
        return _horner(_derivative(self.turns), u) / (self.steps * self.step_s)

    def acceleration_hz_per_s_at(self, step: float) -> float:
        """Its change per second."""
        u = (step - self.start_step) / self.steps
        return _horner(_derivative(_derivative(self.turns)), u) / (self.steps * self.step_s) ** 2


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
        turns = np.zeros(TURNS_SIZE)
        seconds = length * self.step_s
        speed_part = speed.cut(start, length, SPEED_SIZE)
        turns[1:] = speed_part * seconds / np.arange(1, TURNS_SIZE)
        load_part = load.cut(start, length, TORQUE_SIZE)
        acceleration = _derivative(speed_part) / seconds
        motor = self.ratio * load_part + 2 * math.pi * self.inertia_kg_m2 * acceleration
        fluctuation = np.zeros(TORQUE_SIZE) if noise is None else noise.cut(start, length, TORQUE_SIZE)
        return Segment(start, end, turns, load_part, motor, fluctuation, self.step_s)

    def speed_at(self, step: int) -> float:
        """Speed of the reference shaft [Hz]."""
        return self.speed_hz.stretch(step).value(float(step))

    def load_at(self, step: int) -> float:
        """Load torque without its fluctuation [N m]."""
        return self.load_nm.stretch(step).value(float(step))

    def changed(self, step: int, speed_hz: float | None, load_nm: float | None, ramp_steps: float) -> Profile:
        """Another operating point from a step on, over a smooth ramp; None lets a curve go on as it is.

        A load that depends on the speed takes `load_nm` by its own rule (`with_load`).
        """
        speed, load = self.speed_hz, self.load_nm
        if speed_hz is not None:
            speed = ramp_from(speed, step, speed_hz, ramp_steps)
        if load_nm is not None:
            load = ramp_from(load, step, load_nm, ramp_steps)
        return replace(self, speed_hz=speed, load_nm=load)


def constant_profile(
    speed_hz: float, load_nm: float, *, step_s: float, ratio: float, inertia_kg_m2: float
) -> Profile:
    """One operating point."""
    return Profile(Constant(speed_hz), Constant(load_nm), step_s, ratio, inertia_kg_m2)


def is_constant(curve: Curve, step: int) -> bool:
    """Whether a curve will not change any more from a step on, as far as its kind tells."""
    if isinstance(curve, Laid):
        return not curve.stretches or step >= curve.stretches[-1].end
    return isinstance(curve, Constant)


def _horner(coefficients: Array, u: float) -> float:
    result = 0.0
    for c in coefficients[::-1]:
        result = result * u + float(c)
    return result


def _derivative(coefficients: Array) -> Array:
    return coefficients[1:] * np.arange(1, coefficients.size)
