"""Two spur gears in mesh: path of contact, and whether they can mesh at all.

Positions on the line of action are distances from the pinion's tangent point: there they are the radius
of curvature of the pinion's flank. The pinion is external; the wheel is external or a ring around it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from gearsim_io.errors import InputError
from gearsim_sim.model.tooth.contact_ratio import contact_ratio_external, contact_ratio_internal
from gearsim_sim.model.tooth.gear import SpurGear, involute

Array = NDArray[np.float64]


@dataclass(frozen=True)
class GearPair:
    """A pinion and a wheel, `spread_m` further apart than where they would mesh without backlash.

    Raises
    ------
    InputError
        If they cannot mesh: different module or pressure angle, a wheel without room for the pinion,
        a contact ratio below 1, tips that dig into the other gear's roots.
    """

    pinion: SpurGear
    wheel: SpurGear
    spread_m: float = 0.0

    def __post_init__(self) -> None:
        _check_alike(self)
        _check_path(self)
        if self.wheel.internal:
            _check_ring(self)

    @property
    def where(self) -> str:
        """The pair in errors."""
        return f"gears {self.pinion.name} and {self.wheel.name}"

    @property
    def pressure_angle_rad(self) -> float:
        """Working pressure angle."""
        return math.acos(self._bases_m / self.centre_distance_m)

    @property
    def _bases_m(self) -> float:
        """Base radii, as they lie on the line between the axes."""
        return self.wheel.base_radius_m + self.wheel.side * self.pinion.base_radius_m

    def _tight_angle_rad(self) -> float:
        """Pressure angle without backlash: inv(a_w) = inv(a) + 2 tan(a) (x2 +- x1) / (z2 +- z1)."""
        alpha, sign = self.pinion.pressure_angle_rad, self.wheel.side
        shift = self.pinion.profile_shift + sign * self.wheel.profile_shift
        teeth = self.pinion.teeth + sign * self.wheel.teeth
        if shift == 0:
            return alpha
        target = involute(alpha) + 2 * math.tan(alpha) * shift / teeth
        if target <= 0:
            raise InputError(self.where, "profile_shift", shift, "shifts that leave a distance of the axes")
        return float(brentq(lambda angle: involute(angle) - target, 1e-6, 1.4, xtol=1e-15))

    @property
    def centre_distance_m(self) -> float:
        """Distance of the axes."""
        return self._bases_m / math.cos(self._tight_angle_rad()) + self.spread_m

    @property
    def backlash_m(self) -> float:
        """Play along the line of action that the spread gives: the teeth's thickness does the rest.

        The involutes of both flanks part by the change of inv(a_w), on base circles that roll together.
        """
        opened = involute(self.pressure_angle_rad) - involute(self._tight_angle_rad())
        return 2 * self._bases_m * opened

    @property
    def contact_ratio(self) -> float:
        """Mean number of tooth pairs in contact."""
        closed_form = contact_ratio_internal if self.wheel.internal else contact_ratio_external
        return closed_form(
            self.pinion.tip_radius_m,
            self.pinion.base_radius_m,
            self.wheel.tip_radius_m,
            self.wheel.base_radius_m,
            self.centre_distance_m,
            self.pressure_angle_rad,
            self.pinion.base_pitch_m,
        )

    @property
    def path_m(self) -> tuple[float, float]:
        """Where contact begins (pinion's root) and ends (pinion's tip)."""
        across = self.centre_distance_m * math.sin(self.pressure_angle_rad)
        wheel = self.wheel.base_radius_m * self.wheel.roll_rad(self.wheel.tip_radius_m)
        begin = wheel - across if self.wheel.internal else across - wheel
        return begin, self.pinion.base_radius_m * self.pinion.roll_rad(self.pinion.tip_radius_m)

    @property
    def pitch_point_m(self) -> float:
        """Where the flanks roll without sliding."""
        return self.pinion.base_radius_m * math.tan(self.pressure_angle_rad)

    def position_m(self, phase: Array) -> Array:
        """Position of a pair whose phase is `phase` base pitches past the middle of the path."""
        begin, end = self.path_m
        return np.asarray((begin + end) / 2 + np.asarray(phase) * self.pinion.base_pitch_m)

    def curvature_radii_m(self, position_m: Array) -> tuple[Array, Array]:
        """Radii of curvature of the pinion's and the wheel's flank."""
        across = self.centre_distance_m * math.sin(self.pressure_angle_rad)
        position = np.asarray(position_m)
        return position, across + position if self.wheel.internal else across - position

    def roll_rad(self, position_m: Array, *, of_wheel: bool) -> Array:
        """Roll angle of the contact point on one of the two flanks."""
        radii = self.curvature_radii_m(position_m)
        gear = self.wheel if of_wheel else self.pinion
        return np.asarray(radii[of_wheel] / gear.base_radius_m)

    def gear(self, *, of_wheel: bool) -> SpurGear:
        """One of the two."""
        return self.wheel if of_wheel else self.pinion


def _check_alike(pair: GearPair) -> None:
    if pair.pinion.internal:
        raise InputError(pair.where, "pinion", "an internal gear", "an external gear; the ring is the wheel")
    for field in ("module_m", "pressure_angle_rad"):
        first, second = getattr(pair.pinion, field), getattr(pair.wheel, field)
        if abs(first / second - 1) > 1e-9:
            raise InputError(pair.where, field, second, f"{first:g}, as the pinion's")
    if pair.wheel.internal and pair.wheel.teeth <= pair.pinion.teeth:
        raise InputError(pair.where, "wheel.teeth", pair.wheel.teeth, f"more than {pair.pinion.teeth}")


def _check_path(pair: GearPair) -> None:
    """Contact must lie between the tangent points, and hand over before it ends."""
    begin, end = pair.path_m
    across = pair.centre_distance_m * math.sin(pair.pressure_angle_rad)
    if begin < -1e-12:
        expected = "less: its tips reach below the pinion's base circle (interference)"
        raise InputError(pair.where, "wheel.addendum", pair.wheel.addendum, expected)
    if not pair.wheel.internal and end > across + 1e-12:
        expected = "less: its tips reach below the wheel's base circle (interference)"
        raise InputError(pair.where, "pinion.addendum", pair.pinion.addendum, expected)
    if pair.contact_ratio < 1:
        expected = "1 or more: contact is lost before the next teeth meet"
        raise InputError(pair.where, "contact_ratio", round(pair.contact_ratio, 3), expected)
    for tip, root in ((pair.pinion, pair.wheel), (pair.wheel, pair.pinion)):
        gap = _clearance_m(pair, tip, root)
        if gap < 0:
            expected = f"more than {-gap:.3g} m deeper: tips of {tip.name} hit the roots"
            raise InputError(pair.where, f"{root.name}.dedendum", root.dedendum, expected)


def _clearance_m(pair: GearPair, tip: SpurGear, root: SpurGear) -> float:
    distance = pair.centre_distance_m
    if root.internal:
        return root.root_radius_m - distance - tip.tip_radius_m
    if tip.internal:
        return tip.tip_radius_m - distance - root.root_radius_m
    return distance - tip.tip_radius_m - root.root_radius_m


def _check_ring(pair: GearPair) -> None:
    """Tips of pinion and ring must not meet outside the line of action (trochoidal interference).

    Where the tip circles cross, the pinion's tooth must have left the ring's space: the ring's tooth at
    that point lags behind by the angle that it turned meanwhile (Litvin and Fuentes, Gear Geometry,
    section 11.9; Colbourne, The Geometry of Involute Gears, chapter 8).
    """
    pinion, ring, distance = pair.pinion, pair.wheel, pair.centre_distance_m
    if ring.tip_radius_m >= distance + pinion.tip_radius_m:
        raise InputError(pair.where, "addendum", pinion.addendum, "more: the teeth do not reach each other")
    ratio = pinion.teeth / ring.teeth
    at_pinion = (ring.tip_radius_m**2 - pinion.tip_radius_m**2 - distance**2) / (2 * distance)
    at_ring = (ring.tip_radius_m**2 - pinion.tip_radius_m**2 + distance**2) / (2 * distance)
    turn_1 = math.acos(max(-1.0, min(1.0, at_pinion / pinion.tip_radius_m)))
    turn_2 = math.acos(max(-1.0, min(1.0, at_ring / ring.tip_radius_m)))
    working = involute(pair.pressure_angle_rad)
    lead_1 = involute(math.acos(pinion.base_radius_m / pinion.tip_radius_m)) - working
    lead_2 = involute(math.acos(ring.base_radius_m / ring.tip_radius_m)) - working
    if ratio * (turn_1 + lead_1) - turn_2 - lead_2 < 0:
        expected = f"more than {ring.teeth - pinion.teeth} teeth between ring and pinion, or lower teeth"
        raise InputError(pair.where, "teeth", pinion.teeth, expected + ": tips would foul beside the mesh")
