"""The outline of a tooth as a cantilever: half its thickness over the height above the root.

From the foot: an arc of the fillet, tangent to the root circle; where the involute does not reach it (root
inside the base circle), a straight piece parallel to the middle line from the base circle down, as in
Liang, Zuo and Pandey (2014); then the involute. The arc is placed so that it touches root circle and
flank, whichever part of the flank that is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from gearsim_io.errors import InputError
from gearsim_sim.model.tooth.gear import SpurGear

Array = NDArray[np.float64]
_NODES = 24
_GAUSS_X, _GAUSS_W = np.polynomial.legendre.leggauss(_NODES)


@dataclass(frozen=True, eq=False)
class Outline:
    """Sections between foot and contact point, as quadrature nodes.

    Parameters
    ----------
    height_m : array, shape (..., nodes)
        Height of each section above the foot, along the middle line.
    half_m : array, shape (..., nodes)
        Half the tooth's thickness there.
    weight_m : array, shape (..., nodes)
        Quadrature weights: an integral over the height is the sum of weight times integrand.
    """

    height_m: Array
    half_m: Array
    weight_m: Array


@dataclass(frozen=True)
class Root:
    """The foot of a tooth.

    `foot_m` and `foot_half_m` are the distance from the gear's axis along the middle line and half the
    thickness where the fillet meets the root circle; the flank begins at `flank_m`, `flank_half_m`,
    which is at roll angle `flank_roll_rad` (0: below the involute, on the straight piece).
    """

    foot_m: float
    foot_half_m: float
    centre_m: float
    centre_half_m: float
    fillet_m: float
    flank_m: float
    flank_half_m: float
    flank_roll_rad: float

    @property
    def half_angle_rad(self) -> float:
        """Half the angle of the tooth at its foot, seen from the axis."""
        return math.atan2(self.foot_half_m, self.foot_m)

    def weakest(self, *, internal: bool) -> tuple[float, float]:
        """Height above the foot and half thickness where a crack begins [m].

        There the fillet's tangent stands at 30 deg to the middle line (ring gear: 60 deg), the critical
        section of ISO 6336-3; without a fillet it is the lowest point of the flank.
        """
        side = -1 if internal else 1
        if self.fillet_m == 0:
            return side * (self.flank_m - self.foot_m), self.flank_half_m
        tangent = math.radians(60 if internal else 30)
        x = self.centre_m - side * self.fillet_m * math.sin(tangent)
        return side * (x - self.foot_m), self.centre_half_m - self.fillet_m * math.cos(tangent)


def tooth_root(gear: SpurGear) -> Root:
    """Where the fillet touches root circle and flank.

    Raises
    ------
    InputError
        If the fillet does not fit between neighbouring teeth.
    """
    radius = gear.fillet * gear.module_m
    centre_circle = gear.root_radius_m + gear.side * radius

    def miss(s: float) -> float:
        x, h, normal_x, normal_h = _flank_point(gear, s)
        return math.hypot(x + radius * normal_x, h + radius * normal_h) - centre_circle

    low, high = _flank_range(gear)
    if radius > 0 and miss(low) * miss(high) > 0:
        raise InputError(f"gear {gear.name}", "fillet", gear.fillet, "a smaller one, that ends below the tip")
    s = low if radius == 0 else float(brentq(miss, low, high, xtol=1e-14))
    x, h, normal_x, normal_h = _flank_point(gear, s)
    centre_x, centre_h = x + radius * normal_x, h + radius * normal_h
    scale = gear.root_radius_m / centre_circle
    if math.atan2(centre_h, centre_x) > math.pi / gear.teeth + 1e-12:
        raise InputError(f"gear {gear.name}", "fillet", gear.fillet, "a smaller one: it fills the space")
    foot = centre_x * scale, centre_h * scale
    return Root(*foot, centre_x, centre_h, radius, x, h, max(s, 0.0))


def _flank_range(gear: SpurGear) -> tuple[float, float]:
    """Parameters of the flank's lowest and highest point: roll angle, negative on the straight piece."""
    tip = gear.roll_rad(gear.tip_radius_m)
    if gear.root_radius_m >= gear.base_radius_m:
        return gear.roll_rad(gear.root_radius_m), tip
    base_h = gear.base_radius_m * math.sin(gear.base_half_angle_rad)
    base_x = gear.base_radius_m * math.cos(gear.base_half_angle_rad)
    return -(base_x - math.sqrt(gear.root_radius_m**2 - base_h**2)) / gear.base_radius_m, tip


def _flank_point(gear: SpurGear, s: float) -> tuple[float, float, float, float]:
    """Point of the flank and the normal there, out of the tooth."""
    if s < 0:
        angle = gear.base_half_angle_rad
        return gear.base_radius_m * (math.cos(angle) + s), gear.base_radius_m * math.sin(angle), 0.0, 1.0
    roll = np.asarray(s)
    x, h = (float(value) for value in gear.flank(roll))
    angle = float(gear.force_angle_rad(roll))
    return x, h, gear.side * math.sin(angle), math.cos(angle)


def tooth_outline(gear: SpurGear, root: Root, roll_rad: Array) -> Outline:
    """Sections from the foot to the contact points at these roll angles, shape (contacts, nodes)."""
    roll = np.asarray(roll_rad, dtype=np.float64).reshape(-1, 1)
    below = [_fillet(gear, root)]
    if root.flank_roll_rad == 0.0:
        below.append(_straight(gear, root))
    involute = _involute(gear, root, roll)
    joined = []
    for part, above in enumerate(involute):
        common = np.concatenate([piece[part] for piece in below])
        joined.append(np.hstack([np.broadcast_to(common, (roll.shape[0], common.size)), above]))
    return Outline(*joined)


def _fillet(gear: SpurGear, root: Root) -> tuple[Array, Array, Array]:
    start = math.atan2(root.foot_half_m - root.centre_half_m, root.foot_m - root.centre_m)
    end = math.atan2(root.flank_half_m - root.centre_half_m, root.flank_m - root.centre_m)
    if root.fillet_m == 0:
        start = end = 0.0
    turn = (end - start + math.pi) % (2 * math.pi) - math.pi
    angle = start + turn * (_GAUSS_X + 1) / 2
    x = root.centre_m + root.fillet_m * np.cos(angle)
    half = root.centre_half_m + root.fillet_m * np.sin(angle)
    slope = -root.fillet_m * np.sin(angle) * turn / 2
    return gear.side * (x - root.foot_m), half, gear.side * slope * _GAUSS_W


def _straight(gear: SpurGear, root: Root) -> tuple[Array, Array, Array]:
    base = gear.base_radius_m * math.cos(gear.base_half_angle_rad)
    length = base - root.flank_m
    x = root.flank_m + length * (_GAUSS_X + 1) / 2
    return x - root.foot_m, np.full(_NODES, root.flank_half_m), length / 2 * _GAUSS_W


def _involute(gear: SpurGear, root: Root, roll: Array) -> tuple[Array, Array, Array]:
    start = root.flank_roll_rad
    at = start + (roll - start) * (_GAUSS_X + 1) / 2
    x, half = gear.flank(at)
    # The involute's element of length is r_b roll d(roll), turned from the middle line by the force angle.
    slope = gear.base_radius_m * at * np.cos(gear.force_angle_rad(at))
    weight = gear.side * slope * (roll - start) / 2 * _GAUSS_W
    return gear.side * (x - root.foot_m), half, weight
