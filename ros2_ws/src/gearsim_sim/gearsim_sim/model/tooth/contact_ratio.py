"""Contact ratio: the mean number of tooth pairs in contact, from lengths on the line of action.

The path of contact is the part of the line of action between the two tip circles. Divided by the base
pitch it gives the contact ratio. Source: thesis (7.14) and (7.15), after Kim et al. (2012); the sign of
the last term of (7.15) is + (as printed, with -, the thesis's own data give -5.06 instead of 1.89).
"""

from __future__ import annotations

import math


def contact_ratio_external(
    tip_radius_1_m: float,
    base_radius_1_m: float,
    tip_radius_2_m: float,
    base_radius_2_m: float,
    centre_distance_m: float,
    pressure_angle_rad: float,
    base_pitch_m: float,
) -> float:
    """Contact ratio of two external spur gears.

    Parameters
    ----------
    tip_radius_1_m, base_radius_1_m, tip_radius_2_m, base_radius_2_m : float
        Addendum and base circles of the two gears.
    centre_distance_m : float
        Distance of the axes.
    pressure_angle_rad : float
        Working pressure angle (at this distance of the axes).
    base_pitch_m : float
        Distance of neighbouring flanks along the line of action, pi m cos(alpha).
    """
    path = _tangent(tip_radius_1_m, base_radius_1_m) + _tangent(tip_radius_2_m, base_radius_2_m)
    return (path - centre_distance_m * math.sin(pressure_angle_rad)) / base_pitch_m


def contact_ratio_internal(
    pinion_tip_radius_m: float,
    pinion_base_radius_m: float,
    ring_tip_radius_m: float,
    ring_base_radius_m: float,
    centre_distance_m: float,
    pressure_angle_rad: float,
    base_pitch_m: float,
) -> float:
    """Contact ratio of an external gear inside a ring gear.

    Parameters
    ----------
    pinion_tip_radius_m, pinion_base_radius_m : float
        Addendum and base circle of the inner, external gear.
    ring_tip_radius_m, ring_base_radius_m : float
        Addendum circle (the smallest radius of the ring's teeth) and base circle of the ring.
    centre_distance_m, pressure_angle_rad, base_pitch_m : float
        As for `contact_ratio_external`.
    """
    pinion = _tangent(pinion_tip_radius_m, pinion_base_radius_m)
    ring = _tangent(ring_tip_radius_m, ring_base_radius_m)
    return (pinion - ring + centre_distance_m * math.sin(pressure_angle_rad)) / base_pitch_m


def _tangent(tip_radius_m: float, base_radius_m: float) -> float:
    """Length of the tangent to the base circle from a point on the tip circle."""
    return math.sqrt(tip_radius_m**2 - base_radius_m**2)
