"""Elastic contact of rolling elements: Hertz's point contact for balls, Palmgren's line contact for rollers.

Point contact: K. L. Johnson, Contact Mechanics (1985), sections 4.2 and 4.3, in the form with complete
elliptic integrals; force Q and approach d of two elastic bodies obey Q = k d^(3/2).
Line contact: A. Palmgren, Ball and Roller Bearing Engineering (1959), as quoted by T. A. Harris, Rolling
Bearing Analysis (1991), (6.52): Q = k d^(10/9), k in proportion to the length to the power 8/9.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

POINT_EXPONENT, LINE_EXPONENT = 1.5, 10 / 9
# Below this difference of curvatures the contact is treated as a circle; the error is its square.
_CIRCLE = 1e-6


@dataclass(frozen=True, slots=True)
class ContactPatch:
    """Ellipse of a point contact under a force."""

    semi_major_m: float
    semi_minor_m: float
    approach_m: float
    peak_pressure_pa: float


def contact_modulus(youngs_modulus_pa: float, poisson_ratio: float) -> float:
    """E* of two bodies of one material, 1/E* = 2 (1 - nu^2) / E [Pa]."""
    return youngs_modulus_pa / (2 * (1 - poisson_ratio**2))


def point_contact_patch(
    curvature_1_per_m: float, curvature_2_per_m: float, modulus_pa: float, force_n: float
) -> ContactPatch:
    """The contact ellipse; its minor axis lies in the plane of the greater curvature.

    Parameters
    ----------
    curvature_1_per_m, curvature_2_per_m : float
        Sums of the two bodies' curvatures in the two principal planes, positive.
    modulus_pa : float
        Contact modulus E*, from 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.
    force_n : float
        Normal force, > 0.
    """
    low, high = sorted((curvature_1_per_m, curvature_2_per_m))
    squared = _eccentricity_squared(high / low)
    integral_k, integral_e = float(ellipk(squared)), float(ellipe(squared))
    axis_ratio = math.sqrt(1 - squared)
    major = (3 * force_n * integral_e / (math.pi * axis_ratio**2 * modulus_pa * (low + high))) ** (1 / 3)
    approach = 3 * force_n * integral_k / (2 * math.pi * major * modulus_pa)
    pressure = 1.5 * force_n / (math.pi * major**2 * axis_ratio)
    return ContactPatch(float(major), float(major * axis_ratio), float(approach), float(pressure))


def point_contact_factor(curvature_1_per_m: float, curvature_2_per_m: float, modulus_pa: float) -> float:
    """The k of Q = k d^(3/2) in N/m^1.5; parameters as in `point_contact_patch`."""
    # Approach grows with force^(2/3).
    approach = point_contact_patch(curvature_1_per_m, curvature_2_per_m, modulus_pa, 1.0).approach_m
    return float(approach**-1.5)


def _eccentricity_squared(curvature_ratio: float) -> float:
    """1 - (b/a)^2 of the contact ellipse from B/A = (E a^2/b^2 - K) / (K - E)."""
    if curvature_ratio - 1 < _CIRCLE:
        return 0.0

    def mismatch(squared: float) -> float:
        integral_k, integral_e = float(ellipk(squared)), float(ellipe(squared))
        return (integral_e / (1 - squared) - integral_k) / (integral_k - integral_e) - curvature_ratio

    return float(brentq(mismatch, 1e-8, 1 - 1e-12, xtol=1e-15))


def line_contact_factor(length_m: float, modulus_pa: float) -> float:
    """The k of Q = k d^(10/9) of a roller on one race [N/m^(10/9)], by Palmgren.

    d = 0.39 (4 / E*)^0.9 Q^0.9 / l^0.8; for steel 3.84e-5 Q^0.9 / l^0.8 in mm and N (Harris). The diameter
    of the roller does not enter.
    """
    flexibility = 0.39 * (4 / modulus_pa) ** 0.9 / length_m**0.8
    return float(flexibility ** -(1 / 0.9))


def line_patch_half_width_m(radius_m: float, modulus_pa: float, peak_pressure_pa: float) -> float:
    """Half of the contact's length in the direction of rolling, p_0 = E* b / (2 R) (Johnson 4.45)."""
    return 2 * radius_m * peak_pressure_pa / modulus_pa


def in_series(factors: tuple[float, float], exponent: float) -> float:
    """Load factor of two contacts under one force: their approaches add."""
    first, second = factors
    return float((first ** (-1 / exponent) + second ** (-1 / exponent)) ** -exponent)


def race_curvatures(
    element_diameter_m: float,
    pitch_diameter_m: float,
    conformity: float | None,
    contact_angle_rad: float,
    *,
    inner: bool,
) -> tuple[float, float]:
    """Sums of the curvatures of ball and race: in the rolling plane, and across it [1/m].

    `conformity` is the groove's radius over the ball's diameter. None makes the race a sphere about the
    centre of the bearing: the outer race of a self-aligning bearing.
    """
    ball = 2 / element_diameter_m
    gamma = element_diameter_m * math.cos(contact_angle_rad) / pitch_diameter_m
    along = 2 * math.cos(contact_angle_rad) / (pitch_diameter_m * (1 - gamma if inner else 1 + gamma))
    rolling = ball + along if inner else ball - along
    across = ball - along if conformity is None else ball - 1 / (conformity * element_diameter_m)
    return rolling, across


def ball_load_factor(
    ball_diameter_m: float,
    pitch_diameter_m: float,
    inner_groove_conformity: float,
    youngs_modulus_pa: float,
    poisson_ratio: float,
    *,
    outer_groove_conformity: float | None = None,
    contact_angle_rad: float = 0.0,
) -> float:
    """Load-deflection factor k_b of one ball between its races, along the line of contact [N/m^1.5].

    Both races are grooves of a radius given as a multiple of the ball's diameter; without one, the outer
    race is the sphere of a self-aligning bearing (see `race_curvatures`). The two contacts are in series.
    """
    modulus = contact_modulus(youngs_modulus_pa, poisson_ratio)
    sizes = (ball_diameter_m, pitch_diameter_m)
    outer = race_curvatures(*sizes, outer_groove_conformity, contact_angle_rad, inner=False)
    inner = race_curvatures(*sizes, inner_groove_conformity, contact_angle_rad, inner=True)
    factors = (point_contact_factor(*outer, modulus), point_contact_factor(*inner, modulus))
    return in_series(factors, POINT_EXPONENT)


def roller_load_factor(length_m: float, youngs_modulus_pa: float, poisson_ratio: float) -> float:
    """Load-deflection factor of one roller between its races [N/m^(10/9)]: two line contacts in series."""
    factor = line_contact_factor(length_m, contact_modulus(youngs_modulus_pa, poisson_ratio))
    return in_series((factor, factor), LINE_EXPONENT)
