"""Ball and roller bearings: contacts, clearance, preload, load zone and kinematics, (4.5) to (4.11).

Coordinates are the displacement (x, y) of the inner ring relative to the outer ring. Element j at the
azimuth phi_j is compressed by d_j = x cos phi_j + y sin phi_j - c - s_j, where c is the radial clearance
(negative: preload) and s_j what the surfaces lack under it because of faults. It pushes with k d^n if
d > 0 and never pulls; n is 3/2 for balls and 10/9 for rollers. Force and stiffness are continuous at touch
(the stiffness of rollers nearly so: it grows as d^(1/9)). The elements push the inner ring by -sum and the
outer ring by +sum. They have no inertia and roll without slip: the cage turns with the mean of the speeds
of both races (4.8).

A contact at the angle a is compressed by d cos a along its line, and of its force the radial part is
cos a: k_radial = k cos(a)^(n+1). An axial preload F_a compresses all Z elements alike along their lines, by
d_0 with F_a = Z k d_0^n sin a. With the rings held at that axial distance, radial displacements add to it:
d = d_0 + (x cos phi + y sin phi - c) cos a. So preload is a uniform radial pre-compression d_0 / cos a,
a negative clearance. The contact angle is taken as constant.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_io.nameplate import Bearing
from gearsim_sim.model.hertz import (
    LINE_EXPONENT,
    POINT_EXPONENT,
    ball_load_factor,
    contact_modulus,
    line_patch_half_width_m,
    point_contact_patch,
    race_curvatures,
    roller_load_factor,
)
from gearsim_sim.model.oil_film import ContactGeometry
from gearsim_sim.params.bearing import Element
from gearsim_sim.params.bearing import RollingBearing as RollingBearingParams

Array = NDArray[np.float64]
# Peak pressure at which the contact patch is measured: that of bearings under an ordinary load.
_PATCH_PRESSURE_PA = 1.5e9


@dataclass(frozen=True, eq=False)
class RollingBearing:
    """Geometry and contact law of one bearing; "ball" means a rolling element of any shape."""

    balls_per_row: int
    rows: int
    azimuths_rad: Array  # (rows * balls_per_row,) in the frame of the cage
    load_factor: float  # k, radial [N/m^exponent]
    exponent: float
    clearance_m: float  # negative: preload
    ball_radius_m: float
    inner_race_radius_m: float
    outer_race_radius_m: float
    cage_ratio: float  # turns of the cage per turn of the inner ring; 0 if the balls stand
    load_direction_rad: float  # where the load presses the inner ring to
    contact_angle_rad: float
    pitch_radius_m: float
    contacts: tuple[ContactGeometry, ContactGeometry]  # with the inner and the outer race
    modulus_pa: float  # E*

    @property
    def ball_count(self) -> int:
        """Balls in all rows."""
        return self.rows * self.balls_per_row

    @property
    def ball_spacing_rad(self) -> float:
        """Angle between neighbours in one row."""
        return 2 * math.pi / self.balls_per_row

    @property
    def gamma(self) -> float:
        """d cos(a) / D, that decides on the kinematics."""
        return self.ball_radius_m * math.cos(self.contact_angle_rad) / self.pitch_radius_m

    def cage_rate(self, inner_rate: float, outer_rate: float = 0.0) -> float:
        """Speed of the cage for the speeds of the rings, signed, in their unit (no slip)."""
        if self.cage_ratio == 0.0:
            return 0.0
        return 0.5 * (inner_rate * (1 - self.gamma) + outer_rate * (1 + self.gamma))

    def spin_rate(self, inner_rate: float, outer_rate: float = 0.0) -> float:
        """Speed of a ball about its own axis relative to the cage, signed (the BSF)."""
        if self.cage_ratio == 0.0:
            return 0.0
        ratio = self.pitch_radius_m / (2 * self.ball_radius_m) * (1 - self.gamma**2)
        return ratio * (outer_rate - inner_rate)

    def entrainment_m(self) -> float:
        """Mean speed of both surfaces through a contact, per Hz between the rings [m]."""
        return math.pi * self.pitch_radius_m * (1 - self.gamma**2)

    def compressions(
        self, displacement_m: Array, cage_angle_rad: float, missing_m: Array | float = 0.0
    ) -> Array:
        """d_j of every ball, negative where there is a gap; shape (balls,)."""
        azimuths = self.azimuths_rad + cage_angle_rad
        toward = displacement_m[0] * np.cos(azimuths) + displacement_m[1] * np.sin(azimuths)
        return np.asarray(toward - self.clearance_m - missing_m)

    def ball_forces(self, compressions_m: Array) -> Array:
        """k d^n where d > 0, else 0 [N]."""
        return np.asarray(self.load_factor * np.maximum(compressions_m, 0.0) ** self.exponent)

    def force(self, displacement_m: Array, cage_angle_rad: float, missing_m: Array | float = 0.0) -> Array:
        """Force (x, y) of the inner ring on the outer ring [N]; its negative acts on the inner ring."""
        azimuths = self.azimuths_rad + cage_angle_rad
        balls = self.ball_forces(self.compressions(displacement_m, cage_angle_rad, missing_m))
        return np.array([balls @ np.cos(azimuths), balls @ np.sin(azimuths)])

    def stiffness(
        self, displacement_m: Array, cage_angle_rad: float, missing_m: Array | float = 0.0
    ) -> Array:
        """Derivative of `force` with respect to the displacement, shape (2, 2) [N/m]."""
        azimuths = self.azimuths_rad + cage_angle_rad
        gaps = self.compressions(displacement_m, cage_angle_rad, missing_m)
        tangent = self.exponent * self.load_factor * np.maximum(gaps, 0.0) ** (self.exponent - 1)
        directions = np.array([np.cos(azimuths), np.sin(azimuths)])
        return np.asarray((directions * tangent) @ directions.T)

    def energy(self, displacement_m: Array, cage_angle_rad: float, missing_m: Array | float = 0.0) -> float:
        """Elastic energy, the sum of k d^(n+1) / (n+1) over the balls in contact [J]."""
        gaps = self.compressions(displacement_m, cage_angle_rad, missing_m)
        power = self.exponent + 1
        return float(self.load_factor / power * np.sum(np.maximum(gaps, 0.0) ** power))

    def mean_displacement_m(self, load_n: float, clearance_m: float | None = None) -> float:
        """How far a radial load > 0 moves the inner ring, with the balls spread evenly [m]."""
        clearance = self.clearance_m if clearance_m is None else clearance_m
        low, high = max(clearance, 0.0), 1e-6
        while self._mean_load(clearance + high, clearance) < load_n:
            high *= 2
        high += max(clearance, 0.0)
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self._mean_load(middle, clearance) < load_n else (low, middle)
        return 0.5 * (low + high)

    def load_zone_half_angle_rad(self, load_n: float, clearance_m: float | None = None) -> float:
        """Half of the angle over which balls carry a steady load > 0; pi if all do. A mean over azimuths.

        `clearance_m` replaces the bearing's own (a fault may widen it).
        """
        clearance = self.clearance_m if clearance_m is None else clearance_m
        shift = self.mean_displacement_m(load_n, clearance)
        if clearance <= -shift:
            return math.pi
        return math.acos(clearance / shift)

    def _mean_load(self, displacement_m: float, clearance_m: float) -> float:
        """Radial load at a displacement, balls spread evenly (trapezoidal rule over a whole turn)."""
        angle = np.linspace(-math.pi, math.pi, 720, endpoint=False)
        forces = self.ball_forces(displacement_m * np.cos(angle) - clearance_m)
        return float(np.mean(forces * np.cos(angle))) * self.ball_count

    def check_load_zone(
        self, where: str, field: str, load_n: float, clearance_m: float | None = None
    ) -> None:
        """Raise InputError unless more than a single ball at a time carries this load."""
        if load_n <= 0:
            return
        clearance = self.clearance_m if clearance_m is None else clearance_m
        zone = 2 * self.load_zone_half_angle_rad(load_n, clearance)
        if zone < self.ball_spacing_rad / self.rows:
            expected = f"a clearance that leaves a load zone under {load_n:.3g} N (this: {zone:.2g} rad)"
            raise InputError(where, field, clearance, expected)


def preload_compression_m(
    axial_preload_n: float, ball_count: int, factor: float, exponent: float, contact_angle_rad: float
) -> float:
    """Uniform radial pre-compression of an axial preload [m]; `factor` is k along the line of contact."""
    along = (axial_preload_n / (ball_count * factor * math.sin(contact_angle_rad))) ** (1 / exponent)
    return float(along / math.cos(contact_angle_rad))


def make_rolling_bearing(
    plate: Bearing,
    params: RollingBearingParams,
    *,
    load_direction_rad: float,
    passing: bool = True,
    clearance: bool = True,
    where: str = "bearing",
) -> RollingBearing:
    """A bearing from its nameplate geometry; `passing` and `clearance` are the off switches.

    Raises
    ------
    InputError
        For elements that do not fit between the races, or a preload that no contact angle takes up.
    """
    _check_geometry(where, plate, params)
    rows, count = int(params.rows), plate.rolling_elements
    spacing = 2 * math.pi / count
    azimuths = np.concatenate(
        [spacing * (np.arange(count) + row * params.row_stagger) for row in range(rows)]
    )
    ball, pitch, angle = plate.element_diameter_m, plate.pitch_diameter_m, plate.contact_angle_rad
    reach = ball * math.cos(angle)
    factor, exponent = _contact_law(plate, params)
    gap = params.radial_clearance_m if clearance else 0.0
    if params.axial_preload_n > 0:
        gap -= preload_compression_m(params.axial_preload_n, rows * count, factor, exponent, angle)
    return RollingBearing(
        balls_per_row=count,
        rows=rows,
        azimuths_rad=azimuths,
        load_factor=factor * math.cos(angle) ** (exponent + 1),
        exponent=exponent,
        clearance_m=gap,
        ball_radius_m=ball / 2,
        inner_race_radius_m=(pitch - reach) / 2,
        outer_race_radius_m=(pitch + reach) / 2,
        cage_ratio=0.5 * (1 - reach / pitch) if passing else 0.0,
        load_direction_rad=load_direction_rad,
        contact_angle_rad=angle,
        pitch_radius_m=pitch / 2,
        contacts=_contacts(plate, params),
        modulus_pa=contact_modulus(params.youngs_modulus_pa, params.poisson_ratio),
    )


def _contacts(plate: Bearing, params: RollingBearingParams) -> tuple[ContactGeometry, ContactGeometry]:
    """Radii of the contacts with the inner and the outer race."""
    modulus = contact_modulus(params.youngs_modulus_pa, params.poisson_ratio)
    found = []
    for inner in (True, False):
        conformity = params.inner_groove_conformity if inner else params.outer_groove_conformity
        rolling, across = race_curvatures(
            plate.element_diameter_m, plate.pitch_diameter_m, conformity, plate.contact_angle_rad, inner=inner
        )
        if params.element is Element.ROLLER:
            assert params.element_length_m is not None  # validated
            half = line_patch_half_width_m(1 / rolling, modulus, _PATCH_PRESSURE_PA)
            found.append(ContactGeometry(1 / rolling, math.inf, params.element_length_m, half))
        else:
            unit = point_contact_patch(rolling, across, modulus, 1.0)  # its axes grow as the peak pressure
            half = unit.semi_minor_m * _PATCH_PRESSURE_PA / unit.peak_pressure_pa
            found.append(ContactGeometry(1 / rolling, 1 / across, 0.0, half))
    return found[0], found[1]


def _contact_law(plate: Bearing, params: RollingBearingParams) -> tuple[float, float]:
    """Load factor along the line of contact, and its exponent."""
    material = (params.youngs_modulus_pa, params.poisson_ratio)
    if params.element is Element.ROLLER:
        assert params.element_length_m is not None  # validated
        return roller_load_factor(params.element_length_m, *material), LINE_EXPONENT
    assert params.inner_groove_conformity is not None  # validated
    factor = ball_load_factor(
        plate.element_diameter_m,
        plate.pitch_diameter_m,
        params.inner_groove_conformity,
        *material,
        outer_groove_conformity=params.outer_groove_conformity,
        contact_angle_rad=plate.contact_angle_rad,
    )
    return factor, POINT_EXPONENT


def _check_geometry(where: str, plate: Bearing, params: RollingBearingParams) -> None:
    """Elements must fit on their circle, and a preload needs a contact angle."""
    ball, pitch, count = plate.element_diameter_m, plate.pitch_diameter_m, plate.rolling_elements
    if count < 3:
        raise InputError(where, "rolling_elements", count, "3 or more, so that a ring is held")
    if not 0 <= plate.contact_angle_rad < math.pi / 2:
        raise InputError(where, "contact_angle", plate.contact_angle_rad, "0 to below pi/2: a radial bearing")
    room = pitch * math.sin(math.pi / count)
    if not 0 < ball <= room:
        expected = f"at most {room * 1e3:.4g} mm, the room that {count} elements have on their pitch circle"
        raise InputError(where, "element_diameter", ball, expected)
    if params.axial_preload_n > 0 and plate.contact_angle_rad == 0:
        raise InputError(where, "axial_preload", params.axial_preload_n, "0, or a contact angle > 0")
