"""An involute spur gear: circles, flanks, and what teeth can be cut at all.

External gears carry their teeth outwards, internal (ring) gears inwards. A point of a flank is named by
its roll angle, the tangent of the pressure angle there: the radius of curvature is the base radius times
it, and a gear that turns by some angle rolls its contact point by the same angle.
Sources: DIN 3960 / ISO 21771 for the geometry, ISO 53 (profile A) for the usual coefficients.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError

Array = NDArray[np.float64]
_FEWEST_TEETH = 6


def involute(angle_rad: float) -> float:
    """inv(a) = tan(a) - a."""
    return math.tan(angle_rad) - angle_rad


@dataclass(frozen=True)
class SpurGear:
    """A spur gear with involute teeth.

    Parameters
    ----------
    teeth : int
        Number of teeth.
    module_m, pressure_angle_rad : float
        Of the basic rack.
    face_width_m : float
        Length of the teeth along the axis.
    hub_radius_m : float
        Where the wheel's body is held: bore radius of an external gear, outer radius of a ring gear.
    internal : bool
        A ring gear.
    addendum, dedendum, fillet : float
        Height above and depth below the pitch circle, and radius of the root fillet, over the module.
    profile_shift : float
        Over the module, positive makes teeth thicker (ring gear: thinner, as DIN 3960 counts it).
    youngs_modulus_pa, poisson_ratio : float
        Material.
    name : str
        For errors.

    Raises
    ------
    InputError
        If such teeth cannot exist: undercut, pointed, or with a fillet that does not fit.
    """

    teeth: int
    module_m: float
    face_width_m: float
    hub_radius_m: float
    pressure_angle_rad: float = math.radians(20)
    internal: bool = False
    addendum: float = 1.0
    dedendum: float = 1.25
    fillet: float = 0.38
    profile_shift: float = 0.0
    youngs_modulus_pa: float = 206e9
    poisson_ratio: float = 0.3
    name: str = "gear"

    def __post_init__(self) -> None:
        _check_numbers(self)
        _check_teeth(self)

    @property
    def side(self) -> int:
        """+1 for an external, -1 for an internal gear: the sense in which teeth grow with the radius."""
        return -1 if self.internal else 1

    @property
    def pitch_radius_m(self) -> float:
        """Radius of the reference circle."""
        return self.teeth * self.module_m / 2

    @property
    def base_radius_m(self) -> float:
        """Radius of the circle that the involutes unwind from."""
        return self.pitch_radius_m * math.cos(self.pressure_angle_rad)

    @property
    def base_pitch_m(self) -> float:
        """Distance of neighbouring flanks along the line of action."""
        return math.pi * self.module_m * math.cos(self.pressure_angle_rad)

    @property
    def tip_radius_m(self) -> float:
        """Radius of the tips: of a ring gear the smallest radius of its teeth."""
        return self.pitch_radius_m + self.module_m * (self.side * self.addendum + self.profile_shift)

    @property
    def root_radius_m(self) -> float:
        """Radius of the root circle."""
        return self.pitch_radius_m + self.module_m * (self.profile_shift - self.side * self.dedendum)

    @property
    def base_half_angle_rad(self) -> float:
        """Half the angle that a tooth takes, its involutes continued to the base circle."""
        shift = 2 * self.profile_shift * math.tan(self.pressure_angle_rad) / self.teeth
        half = math.pi / (2 * self.teeth) + self.side * shift
        return half + self.side * involute(self.pressure_angle_rad)

    def half_angle_rad(self, radius_m: float) -> float:
        """Half the angle that a tooth takes at a radius outside the base circle."""
        return self.base_half_angle_rad - self.side * involute(math.acos(self.base_radius_m / radius_m))

    def roll_rad(self, radius_m: float) -> float:
        """Roll angle at a radius, sqrt((r / r_b)^2 - 1)."""
        return math.sqrt((radius_m / self.base_radius_m) ** 2 - 1)

    def flank(self, roll_rad: Array) -> tuple[Array, Array]:
        """Points of the flank [m]: distance from the axis along the tooth's middle line, and off it."""
        angle = self.base_half_angle_rad - self.side * (roll_rad - np.arctan(roll_rad))
        radius = self.base_radius_m * np.sqrt(1 + roll_rad**2)
        return radius * np.cos(angle), radius * np.sin(angle)

    def force_angle_rad(self, roll_rad: Array) -> Array:
        """Angle between the flank's normal and the line across the tooth; positive presses into the body."""
        return (
            roll_rad - self.base_half_angle_rad if not self.internal else roll_rad + self.base_half_angle_rad
        )


def _check_numbers(gear: SpurGear) -> None:
    where = f"gear {gear.name}"
    if gear.teeth != round(gear.teeth) or gear.teeth < _FEWEST_TEETH:
        raise InputError(where, "teeth", gear.teeth, f"a whole number, {_FEWEST_TEETH} or more")
    for field in ("module_m", "face_width_m", "hub_radius_m", "addendum", "dedendum", "youngs_modulus_pa"):
        if not getattr(gear, field) > 0:
            raise InputError(where, field, getattr(gear, field), "> 0")
    if not math.radians(10) <= gear.pressure_angle_rad <= math.radians(35):
        degrees = f"{math.degrees(gear.pressure_angle_rad):g} deg"
        raise InputError(where, "pressure_angle", degrees, "10 to 35 deg")
    if not 0 <= gear.poisson_ratio < 0.5:
        raise InputError(where, "poisson_ratio", gear.poisson_ratio, "0 to less than 0.5")
    if gear.fillet < 0:
        raise InputError(where, "fillet", gear.fillet, "0 or more")


def _check_teeth(gear: SpurGear) -> None:
    where = f"gear {gear.name}"
    body = (gear.root_radius_m - gear.hub_radius_m) * gear.side
    if body <= 0:
        limit = "less" if gear.side > 0 else "more"
        raise InputError(
            where, "hub_radius_m", gear.hub_radius_m, f"{limit} than the root's {gear.root_radius_m:.6g} m"
        )
    if gear.tip_radius_m <= gear.base_radius_m:
        expected = "teeth outside the base circle: more teeth, a smaller addendum or a positive profile shift"
        raise InputError(where, "addendum", gear.addendum, expected)
    if gear.half_angle_rad(gear.tip_radius_m) <= 0:
        raise InputError(where, "addendum", gear.addendum, "a smaller one: these teeth are pointed")
    if not gear.internal:
        # A rack of this addendum cuts below the tangent point (DIN 3960): x >= h_a - z sin(a)^2 / 2.
        least = gear.addendum - gear.teeth * math.sin(gear.pressure_angle_rad) ** 2 / 2
        if gear.profile_shift < least - 1e-9:
            few = math.ceil(2 * (gear.addendum - gear.profile_shift) / math.sin(gear.pressure_angle_rad) ** 2)
            expected = f"{few} or more, or a profile shift of {least:.3f} or more: these teeth are undercut"
            raise InputError(where, "teeth", gear.teeth, expected)
