"""Ball bearing with Hertz contacts, clearance and load zone, (4.5) to (4.11).

Coordinates are the displacement (x, y) of the inner ring relative to the outer ring. Ball j at the
azimuth phi_j is compressed by d_j = x cos phi_j + y sin phi_j - c - s_j, where c is the radial
clearance and s_j what the races lack under the ball (a spall). A ball pushes with k d^1.5 if d > 0 and
never pulls; force and stiffness are continuous at touch. The balls push the inner ring by -sum and the
outer ring by +sum. They have no inertia and roll without slip: the cage turns with the mean of the
speeds of both races (4.8).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_io.nameplate import Bearing
from gearsim_sim.model.hertz import ball_load_factor
from gearsim_sim.params.parallel import BallBearing as BallBearingParams


@dataclass(frozen=True, eq=False)
class BallBearing:
    """Geometry and contact law of one bearing."""

    balls_per_row: int
    rows: int
    azimuths_rad: NDArray[np.float64]  # (rows * balls_per_row,) in the frame of the cage
    load_factor: float  # k_b [N/m^1.5]
    clearance_m: float
    ball_radius_m: float
    inner_race_radius_m: float
    outer_race_radius_m: float
    cage_ratio: float  # turns of the cage per turn of the inner ring
    load_direction_rad: float  # where the load presses the inner ring to

    @property
    def ball_count(self) -> int:
        """Balls in all rows."""
        return self.rows * self.balls_per_row

    @property
    def ball_spacing_rad(self) -> float:
        """Angle between neighbours in one row."""
        return 2 * math.pi / self.balls_per_row

    def compressions(
        self,
        displacement_m: NDArray[np.float64],
        cage_angle_rad: float,
        missing_m: NDArray[np.float64] | float = 0.0,
    ) -> NDArray[np.float64]:
        """d_j of every ball, negative where there is a gap; shape (balls,)."""
        azimuths = self.azimuths_rad + cage_angle_rad
        toward = displacement_m[0] * np.cos(azimuths) + displacement_m[1] * np.sin(azimuths)
        return np.asarray(toward - self.clearance_m - missing_m)

    def ball_forces(self, compressions_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """k d^1.5 where d > 0, else 0 [N]."""
        return self.load_factor * np.maximum(compressions_m, 0.0) ** 1.5

    def force(
        self,
        displacement_m: NDArray[np.float64],
        cage_angle_rad: float,
        missing_m: NDArray[np.float64] | float = 0.0,
    ) -> NDArray[np.float64]:
        """Force (x, y) of the inner ring on the outer ring [N]; its negative acts on the inner ring."""
        azimuths = self.azimuths_rad + cage_angle_rad
        balls = self.ball_forces(self.compressions(displacement_m, cage_angle_rad, missing_m))
        return np.array([balls @ np.cos(azimuths), balls @ np.sin(azimuths)])

    def stiffness(
        self,
        displacement_m: NDArray[np.float64],
        cage_angle_rad: float,
        missing_m: NDArray[np.float64] | float = 0.0,
    ) -> NDArray[np.float64]:
        """Derivative of `force` with respect to the displacement, shape (2, 2) [N/m]."""
        azimuths = self.azimuths_rad + cage_angle_rad
        gaps = self.compressions(displacement_m, cage_angle_rad, missing_m)
        tangent = 1.5 * self.load_factor * np.sqrt(np.maximum(gaps, 0.0))
        directions = np.array([np.cos(azimuths), np.sin(azimuths)])
        return np.asarray((directions * tangent) @ directions.T)

    def energy(
        self,
        displacement_m: NDArray[np.float64],
        cage_angle_rad: float,
        missing_m: NDArray[np.float64] | float = 0.0,
    ) -> float:
        """Elastic energy, the sum of (2/5) k d^2.5 over the balls in contact [J]."""
        gaps = self.compressions(displacement_m, cage_angle_rad, missing_m)
        return float(0.4 * self.load_factor * np.sum(np.maximum(gaps, 0.0) ** 2.5))

    def load_zone_half_angle_rad(self, load_n: float) -> float:
        """Half of the angle over which balls carry a steady load > 0; from the mean over azimuths.

        With the gap g = c (cos(angle) / cos(half) - 1) under the zone's edge at zero, the load grows with
        the half angle; it is found by bisection.
        """
        if self.clearance_m == 0:
            return math.pi / 2
        low, high = 0.0, math.pi / 2
        for _ in range(50):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self._mean_load(middle) < load_n else (low, middle)
        return 0.5 * (low + high)

    def _mean_load(self, half_angle_rad: float) -> float:
        """Load carried by a zone of this half angle, balls spread evenly."""
        angle = np.linspace(-half_angle_rad, half_angle_rad, 201)
        gap = self.clearance_m * (np.cos(angle) / math.cos(half_angle_rad) - 1)
        density = self.load_factor * np.maximum(gap, 0.0) ** 1.5 * np.cos(angle)
        return float(np.mean(density[1:])) * 2 * half_angle_rad * self.ball_count / (2 * math.pi)


def make_ball_bearing(
    plate: Bearing, params: BallBearingParams, *, load_direction_rad: float, passing: bool, clearance: bool
) -> BallBearing:
    """A bearing from its nameplate geometry; `passing` and `clearance` are the off switches."""
    rows, count = int(params.rows), plate.rolling_elements
    spacing = 2 * math.pi / count
    azimuths = np.concatenate(
        [spacing * (np.arange(count) + row * params.row_stagger) for row in range(rows)]
    )
    ball, pitch = plate.element_diameter_m, plate.pitch_diameter_m
    tilt = math.cos(plate.contact_angle_rad)
    reach = ball * tilt
    factor = ball_load_factor(
        ball, pitch, params.inner_groove_conformity, params.youngs_modulus_pa, params.poisson_ratio
    )
    return BallBearing(
        balls_per_row=count,
        rows=rows,
        azimuths_rad=azimuths,
        load_factor=factor * tilt**2.5,  # radial force and radial approach of a tilted contact
        clearance_m=params.radial_clearance_m if clearance else 0.0,
        ball_radius_m=ball / 2,
        inner_race_radius_m=(pitch - reach) / 2,
        outer_race_radius_m=(pitch + reach) / 2,
        cage_ratio=0.5 * (1 - reach / pitch) if passing else 0.0,
        load_direction_rad=load_direction_rad,
    )
