"""Hertz's theory of point contact: how much a ball between two races gives way.

Source: K. L. Johnson, Contact Mechanics (1985), sections 4.2 and 4.3, in the form with complete
elliptic integrals. Force Q and approach d of two elastic bodies obey Q = k d^(3/2).
"""

from __future__ import annotations

import math

from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

# Below this difference of curvatures the contact is treated as a circle; the error is its square.
_CIRCLE = 1e-6


def point_contact_factor(curvature_1_per_m: float, curvature_2_per_m: float, modulus_pa: float) -> float:
    """The k of Q = k d^(3/2) in N/m^1.5.

    Parameters
    ----------
    curvature_1_per_m, curvature_2_per_m : float
        Sums of the two bodies' curvatures in the two principal planes, positive.
    modulus_pa : float
        Contact modulus E*, from 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.
    """
    low, high = sorted((curvature_1_per_m, curvature_2_per_m))
    squared = _eccentricity_squared(high / low)
    integral_k, integral_e = float(ellipk(squared)), float(ellipe(squared))
    axis_ratio = math.sqrt(1 - squared)
    # Semi-major axis and approach under a force of 1 N; approach grows with force^(2/3).
    major = (3 * integral_e / (math.pi * axis_ratio**2 * modulus_pa * (low + high))) ** (1 / 3)
    approach = 3 * integral_k / (2 * math.pi * major * modulus_pa)
    return float(approach**-1.5)


def _eccentricity_squared(curvature_ratio: float) -> float:
    """1 - (b/a)^2 of the contact ellipse from B/A = (E a^2/b^2 - K) / (K - E)."""
    if curvature_ratio - 1 < _CIRCLE:
        return 0.0

    def mismatch(squared: float) -> float:
        integral_k, integral_e = float(ellipk(squared)), float(ellipe(squared))
        return (integral_e / (1 - squared) - integral_k) / (integral_k - integral_e) - curvature_ratio

    return float(brentq(mismatch, 1e-8, 1 - 1e-12, xtol=1e-15))


def ball_load_factor(
    ball_diameter_m: float,
    pitch_diameter_m: float,
    inner_groove_conformity: float,
    youngs_modulus_pa: float,
    poisson_ratio: float,
) -> float:
    """Load-deflection factor k_b of one ball between the races of a self-aligning bearing [N/m^1.5].

    The outer race is a sphere around the bearing's centre, which lets the inner ring tilt; the inner
    race is a groove of radius `inner_groove_conformity` times the ball's diameter. The two contacts
    are in series: their approaches under one force add.
    """
    modulus = youngs_modulus_pa / (2 * (1 - poisson_ratio**2))
    ball = 2 / ball_diameter_m
    sphere = 2 / (pitch_diameter_m + ball_diameter_m)
    ring = 2 / (pitch_diameter_m - ball_diameter_m)
    groove = 1 / (inner_groove_conformity * ball_diameter_m)
    outer = point_contact_factor(ball - sphere, ball - sphere, modulus)
    inner = point_contact_factor(ball + ring, ball - groove, modulus)
    return float((outer ** (-2 / 3) + inner ** (-2 / 3)) ** -1.5)
