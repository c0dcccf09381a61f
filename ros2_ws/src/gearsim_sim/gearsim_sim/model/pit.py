"""The way of a rolling element across a pit, in the plane of rolling.

A pit of the race: the centre of the element (radius r) rolls about the edge of the pit, which lies on the
race (radius R). With b the angle from the edge, seen from the bearing's axis, the centre comes

    drop = r - sqrt(r^2 - (R sin b)^2) -/+ R (1 - cos b)             (- outer race, + inner race)

off its ordinary path. A pit of the element: the edge lies on the element, and the race passes over it;
with b the angle from the edge, seen from the element's centre,

    drop = r (1 - cos b) -/+ (R - sqrt(R^2 - (r sin b)^2))           (- outer race, + inner race).

Both have one form: with the edge on a circle of radius C (carrier) and the other body of radius O,
drop = s_o (O - sqrt(O^2 - (C sin b)^2)) + s_c C (1 - cos b).

Rectangular geometry is that of early models (thesis Figure 4.4 a): the whole depth is missing at once while
the centre is between the edges. Its jumps are averaged over one step of integration, see `inside_fraction`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Edge:
    """An edge that the contact rolls over; see the module's text."""

    carrier_radius_m: float
    other_radius_m: float
    carrier_sign: float
    other_sign: float

    @property
    def greatest_angle_rad(self) -> float:
        """Angle past the edge up to which the contact rolls; farther on, an element would be wedged in."""
        return math.asin(min(1.0, 0.9 * self.other_radius_m / self.carrier_radius_m))

    def drop(self, angle_rad: float) -> float:
        """How far the bodies come together once the contact is `angle_rad` past the edge [m]."""
        half = math.sin(0.5 * angle_rad)
        chord = self.carrier_radius_m * math.sin(angle_rad)
        own = self.other_radius_m - math.sqrt(self.other_radius_m**2 - chord**2)
        return self.other_sign * own + self.carrier_sign * 2 * self.carrier_radius_m * half**2


def race_edge(race_radius_m: float, element_radius_m: float, *, inner: bool, rounding_m: float = 0.0) -> Edge:
    """Edge of a pit of a race, worn round with the radius `rounding_m`.

    A round edge moves the centre on a circle about the centre of the rounding, which lies below the race.
    """
    below = race_radius_m - rounding_m if inner else race_radius_m + rounding_m
    return Edge(below, element_radius_m + rounding_m, 1.0 if inner else -1.0, 1.0)


def element_edge(race_radius_m: float, element_radius_m: float, *, inner: bool) -> Edge:
    """Edge of a pit of a rolling element that passes a race."""
    return Edge(element_radius_m, race_radius_m, 1.0, 1.0 if inner else -1.0)


def rounded_drop(offset_rad: float, half_width_rad: float, depth_m: float, edge: Edge) -> float:
    """Drop `offset_rad` from the middle of a pit: entry edge, perhaps floor, exit edge [m]."""
    past = half_width_rad - abs(offset_rad)
    return 0.0 if past <= 0 else min(depth_m, edge.drop(min(past, edge.greatest_angle_rad)))


def inside_fraction(offset_rad: float, half_width_rad: float, travel_rad: float) -> float:
    """Part of one step during which the contact is between the edges.

    The step is centred on the present offset, and the contact travels `travel_rad` in it. A force F that
    jumps to F' in the pit is thus replaced by its mean over the step, (1 - w) F + w F': the sum of forces
    over all steps is then that of the jumping force exactly, wherever the jump falls between two steps.
    That mean is a box filter of one step; its zeros lie on the multiples of the step rate, about which
    the images of the signal would lie that alias.
    """
    travel = abs(travel_rad)
    if travel == 0.0:
        return 1.0 if abs(offset_rad) < half_width_rad else 0.0
    first = max(offset_rad - 0.5 * travel, -half_width_rad)
    last = min(offset_rad + 0.5 * travel, half_width_rad)
    return max(0.0, last - first) / travel


def wide_pit_path(
    half_width_rad: float, depth_m: float, edge: Edge, patch_rad: float, points: int
) -> tuple[float, Array]:
    """Path of elements across a wide pit: entry edge, floor, exit edge, several elements at once.

    The corner where an element meets the floor, and the one where it meets the exit edge, are as round as
    the contact patch is long: the path is averaged over `patch_rad` to each side with a window (1 - u^2)^3.

    Returns
    -------
    half_span_rad : float
        The path is zero, with all its slopes up to the third, at this distance from the middle.
    path : ndarray, shape (points + 1,)
        Drop at equal distances from -half_span to +half_span [m].
    """
    half_span = half_width_rad + patch_rad
    fine = max(
        1, math.ceil(64 * 2 * half_span / (patch_rad * points))
    )  # 64 points to each side of the window
    offsets = np.linspace(-half_span, half_span, points * fine + 1)
    path = np.array([rounded_drop(offset, half_width_rad, depth_m, edge) for offset in offsets])
    step = offsets[1] - offsets[0]
    reach = int(patch_rad / step)
    window = (1 - (np.arange(-reach, reach + 1) * step / patch_rad) ** 2) ** 3
    smooth = np.convolve(path, window / window.sum(), mode="same")
    return half_span, np.ascontiguousarray(smooth[::fine])
