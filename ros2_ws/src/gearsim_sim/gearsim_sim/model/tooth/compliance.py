"""How much one tooth gives way to a force on its flank: bending, shear, compression, and its foundation.

Potential-energy method: the deflection along the force is the derivative of the elastic energy of the
cantilever, so that each compliance is an integral over the tooth's height of (internal force per unit
force)^2 over the section's rigidity (Yang and Lin 1987; Tian 2004; improved for root and base circle by
Liang, Zuo and Pandey 2014). The wheel body below an external tooth yields after Sainsot, Velex and Duverger
(2004); below a ring's tooth as an elastic half-plane (Weber 1949, in Cornell 1981, for plane stress).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.model.tooth.gear import SpurGear
from gearsim_sim.model.tooth.outline import Outline, Root, tooth_outline, tooth_root

Array = NDArray[np.float64]
# Sainsot et al. (2004): A / theta^2 + B h^2 + C h / theta + D / theta + E h + F, rows L*, M*, P*, Q*.
_SAINSOT = np.array(
    [
        [-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045],
        [60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086],
        [-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236],
        [-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904],
    ]
)
# Root radius over bore radius that the polynomials were fitted to.
_SAINSOT_BODIES = (1.4, 7.0)
_SHEAR_FACTOR = 1.2  # rectangular section
root_of = lru_cache(maxsize=64)(tooth_root)


@dataclass(frozen=True, eq=False)
class Point:
    """Contact points: height above the foot, distance from the middle line, angle of the force to the
    line across the tooth (positive: into the body); shapes (contacts,).
    """

    height_m: Array
    half_m: Array
    angle_rad: Array


def beam_compliance(
    outline: Outline,
    point: Point,
    gear: SpurGear,
    loaded_half_m: Array | None = None,
    other_half_m: Array | None = None,
) -> Array:
    """Bending, shear and compression of a cantilever loaded on its flank [m/N], shape (3, contacts).

    Parameters
    ----------
    outline : Outline
        Sections, shape (contacts, nodes).
    point : Point
        Where and how the force acts, shapes (contacts,).
    gear : SpurGear
        Face width and material.
    loaded_half_m, other_half_m : array, shape (contacts, nodes), optional
        What a crack has left of half the thickness, on the loaded and on the other side.
    """
    loaded = outline.half_m if loaded_half_m is None else loaded_half_m
    other = outline.half_m if other_half_m is None else other_half_m
    across, along = np.cos(point.angle_rad)[:, None], np.sin(point.angle_rad)[:, None]
    # The neutral axis lies in the middle of what is left of the section.
    offset = point.half_m[:, None] + (other - loaded) / 2
    moment = across * (point.height_m[:, None] - outline.height_m) - along * offset
    area = (loaded + other) * gear.face_width_m
    inertia = (loaded + other) ** 3 * gear.face_width_m / 12
    modulus = gear.youngs_modulus_pa
    shear_modulus = modulus / (2 * (1 + gear.poisson_ratio))
    integrands = (
        moment**2 / (modulus * inertia),
        _SHEAR_FACTOR * across**2 / (shear_modulus * area),
        along**2 / (modulus * area),
    )
    return np.array([np.sum(outline.weight_m * one, axis=1) for one in integrands])


def contact_point(gear: SpurGear, root: Root, roll_rad: Array) -> Point:
    """The contact at these roll angles."""
    roll = np.atleast_1d(np.asarray(roll_rad, dtype=np.float64))
    x, half = gear.flank(roll)
    return Point(gear.side * (x - root.foot_m), half, gear.force_angle_rad(roll))


def tooth_compliance(gear: SpurGear, roll_rad: Array) -> Array:
    """Bending + shear + compression of a sound tooth [m/N] for contact at these roll angles."""
    root = root_of(gear)
    outline = tooth_outline(gear, root, roll_rad)
    parts = beam_compliance(outline, contact_point(gear, root, roll_rad), gear)
    return np.asarray(parts.sum(axis=0))


def foundation_compliance(gear: SpurGear, roll_rad: Array) -> Array:
    """What the wheel's body below the tooth adds [m/N].

    Raises
    ------
    InputError
        If the body of an external gear is outside what Sainsot's polynomials cover (root radius over
        bore radius 1.4 to 7).
    """
    root = root_of(gear)
    point = contact_point(gear, root, roll_rad)
    angle = point.angle_rad
    # u: from the foot to where the line of the force crosses the middle line; s: thickness of the foot.
    u_over_s = (point.height_m - point.half_m * np.tan(angle)) / (2 * root.foot_half_m)
    scale = np.cos(angle) ** 2 / (gear.youngs_modulus_pa * gear.face_width_m)
    if gear.internal:
        nu = gear.poisson_ratio
        shape = (16.67 / math.pi) * u_over_s**2 + 2 * (1 - nu) * u_over_s
        return np.asarray(scale * (shape + 1.534 * (1 + np.tan(angle) ** 2 / (2.4 * (1 + nu)))))
    coefficients = sainsot_coefficients(gear, root)
    shape = coefficients[0] * u_over_s**2 + coefficients[1] * u_over_s
    return np.asarray(scale * (shape + coefficients[2] * (1 + coefficients[3] * np.tan(angle) ** 2)))


def sainsot_coefficients(gear: SpurGear, root: Root) -> Array:
    """L*, M*, P*, Q* of Sainsot et al. (2004)."""
    low, high = _SAINSOT_BODIES
    body = gear.root_radius_m / gear.hub_radius_m
    if not low <= body <= high:
        limits = (
            f"{gear.root_radius_m / high:.4g} to {gear.root_radius_m / low:.4g} m (root radius / 7 to 1.4)"
        )
        raise InputError(f"gear {gear.name}", "hub_radius_m", gear.hub_radius_m, limits)
    theta = root.half_angle_rad
    terms = np.array([1 / theta**2, body**2, body / theta, 1 / theta, body, 1.0])
    return np.asarray(_SAINSOT @ terms)


def hertz_compliance(first: SpurGear, second: SpurGear) -> float:
    """Approach of two flanks over the force [m/N], linear: 4 (1 - nu^2) / (pi E L) (Yang and Sun 1985).

    Each of two materials contributes half. L is the shorter face width.
    """
    width = min(first.face_width_m, second.face_width_m)
    halves = sum(2 * (1 - one.poisson_ratio**2) / one.youngs_modulus_pa for one in (first, second))
    return halves / (math.pi * width)
