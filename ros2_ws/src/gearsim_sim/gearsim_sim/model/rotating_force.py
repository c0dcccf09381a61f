"""Forces that are known functions of angle and speed: unbalance, a bow, torque ripple, misalignment.

    F = (c cos(phi) + s sin(phi)) (constant + square w^2) + (c sin(phi) - s cos(phi)) linear dw/dt

phi is `order` times the angle of a track, w the angular speed of the reference shaft [rad/s]. A mass m
whose centre goes round at the distance e, x = e cos(k Theta), presses with -m x'': c = m e, square = k^2,
linear = k. `corner_hz` fades the force out where order times the track's speed is below it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.assembly import Vector

Array = NDArray[np.float64]
TIME_TRACK = -1  # phi = 2 pi order t, the order being a frequency [Hz]


@dataclass(frozen=True, eq=False)
class RotatingForce:
    """One harmonic of a known force along a direction (a torque where that is a rotation)."""

    table: ClassVar[str] = "forcings"

    direction: Vector
    track: int
    order: float
    cosine: float
    sine: float
    constant: float = 1.0
    square: float = 0.0
    linear: float = 0.0
    corner_hz: float = 0.0

    @property
    def directions(self) -> tuple[Vector, ...]:
        """Where it acts."""
        return (self.direction,)

    def numbers(self) -> tuple[float, ...]:
        """Its row in the table, behind the direction."""
        return (
            self.track,
            self.order,
            self.cosine,
            self.sine,
            self.constant,
            self.square,
            self.linear,
            self.corner_hz,
        )

    def samples(self) -> NDArray[np.float64] | None:
        """None: no table of samples."""
        return None

    def force(
        self,
        track_turns: float,
        speed_hz: float,
        acceleration_hz_per_s: float = 0.0,
        *,
        rate: float = 1.0,
    ) -> float:
        """The force [N or N m] at an angle of the track (for TIME_TRACK: a time) and a reference speed."""
        phi = 2 * math.pi * self.order * track_turns
        c, s = math.cos(phi), math.sin(phi)
        w = 2 * math.pi * speed_hz
        in_phase = (self.cosine * c + self.sine * s) * (self.constant + self.square * w * w)
        lag = (self.cosine * s - self.sine * c) * self.linear * 2 * math.pi * acceleration_hz_per_s
        return (in_phase + lag) * faded(self.order * rate * speed_hz, self.corner_hz)


def faded(frequency_hz: float, corner_hz: float) -> float:
    """x^4 / (1 + x^4) with x = frequency / corner; 1 without a corner."""
    if corner_hz == 0.0:
        return 1.0
    x = (frequency_hz / corner_hz) ** 4
    return x / (1.0 + x)


def rotating_pair(
    x: Vector,
    y: Vector,
    track: int,
    rate: float,
    sense: float,
    amplitude: float,
    phase_rad: float,
    *,
    inertial: bool,
) -> tuple[RotatingForce, RotatingForce]:
    """A force of constant direction in a shaft: amplitude (cos(phi + phase), sense sin(phi + phase)).

    `inertial` makes it the force of a mass that goes round, amplitude being m e [kg m]; else amplitude
    is in newtons. `rate` is the absolute rate of the shaft per turn of the reference shaft, counted in the
    sense of the track; where the track is seen from a turning frame, so is the force.
    """
    c, s = amplitude * math.cos(phase_rad), amplitude * math.sin(phase_rad)
    constant, square, linear = (0.0, rate * rate, rate) if inertial else (1.0, 0.0, 0.0)
    return (
        RotatingForce(x, track, 1.0, c, -s, constant, square, linear),
        RotatingForce(y, track, 1.0, sense * s, sense * c, constant, square, linear),
    )
