"""What is missing from the flank of a tooth: spall, wear, tip and root relief, over the phase of its pair.

All are depths along the line of action [m], >= 0; as errors of the mesh they count negative.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.model.periodic import PeriodicSeries
from gearsim_sim.model.tooth.compliance import hertz_compliance
from gearsim_sim.model.tooth.gear import SpurGear
from gearsim_sim.model.tooth.pair import GearPair
from gearsim_sim.model.tooth.sharing import shares, tooth_error_series
from gearsim_sim.model.tooth.stiffness import pair_compliance
from gearsim_sim.model.tooth.windows import window_nodes, window_series

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ToothSpall:
    """A pit in one flank.

    Parameters
    ----------
    width_m, depth_m : float
        Length along the profile, and depth.
    radius_m : float or None
        Distance of its middle from the gear's axis; None: on the working pitch circle.
    face_fraction : float
        Part of the face width that it takes.
    shape : "rounded" or "rectangular"
        Rounded: the other flank dips in as far as its curvature lets it, over one edge and then the other.
        Rectangular: down to the floor at once, as in thesis Figure 7.10.
    """

    width_m: float
    depth_m: float
    radius_m: float | None = None
    face_fraction: float = 1.0
    shape: Literal["rounded", "rectangular"] = "rounded"


def spall_extent(pair: GearPair, spall: ToothSpall, *, of_wheel: bool) -> tuple[float, float, float]:
    """Phases of the pair at which contact enters the spall, passes its middle and leaves it.

    Raises
    ------
    InputError
        If the spall is not on the part of the flank that is ever in contact.
    """
    gear = pair.gear(of_wheel=of_wheel)
    where = f"spall on {gear.name}"
    pitch = float(pair.roll_rad(np.array(pair.pitch_point_m), of_wheel=of_wheel))
    low, high = sorted(float(r) for r in pair.roll_rad(np.array(pair.path_m), of_wheel=of_wheel))
    radii = [gear.base_radius_m * math.sqrt(1 + roll**2) for roll in (low, high)]
    middle = pitch
    if spall.radius_m is not None:
        if not radii[0] < spall.radius_m < radii[1]:
            expected = f"{radii[0]:.5g} to {radii[1]:.5g} m, where the flank is in contact"
            raise InputError(where, "radius_m", spall.radius_m, expected)
        middle = gear.roll_rad(spall.radius_m)
    # Length along an involute: r_b roll^2 / 2.
    squares = [middle**2 + sign * spall.width_m / gear.base_radius_m for sign in (-1, 1)]
    if squares[0] < low**2 or squares[1] > high**2:
        room = gear.base_radius_m * min(middle**2 - low**2, high**2 - middle**2)
        expected = f"up to {room:.4g} m, so that it ends on the working flank"
        raise InputError(where, "width_m", spall.width_m, expected)
    phases = [_phase(pair, gear, roll) for roll in (math.sqrt(squares[0]), middle, math.sqrt(squares[1]))]
    first, centre, last = phases if phases[0] < phases[2] else phases[::-1]
    return first, centre, last


def _phase(pair: GearPair, gear: SpurGear, roll: float) -> float:
    radius = gear.base_radius_m * roll
    across = pair.centre_distance_m * math.sin(pair.pressure_angle_rad)
    position = radius
    if gear is pair.wheel:
        position = radius - across if gear.internal else across - radius
    return (position - sum(pair.path_m) / 2) / gear.base_pitch_m


def spall_depth(pair: GearPair, spall: ToothSpall, phase: Array, *, of_wheel: bool) -> Array:
    """How far the other flank drops into the spall [m] at these phases of the pair.

    A flank of relative curvature c, rolling over an edge that is s away, comes down by c s^2 / 2.
    """
    gear = pair.gear(of_wheel=of_wheel)
    _, centre, _ = spall_extent(pair, spall, of_wheel=of_wheel)
    roll = pair.roll_rad(pair.position_m(np.asarray(phase)), of_wheel=of_wheel)
    middle = float(pair.roll_rad(pair.position_m(np.array(centre)), of_wheel=of_wheel))
    beside = np.abs(gear.base_radius_m * (roll**2 - middle**2) / 2)
    inside = np.maximum(0.0, spall.width_m / 2 - beside)
    own, other = pair.curvature_radii_m(pair.position_m(np.array(centre)))
    curvature = 1 / float(own) + pair.wheel.side / float(other)
    if spall.shape == "rectangular":
        return np.asarray(np.where(inside > 0, spall.depth_m, 0.0) * spall.face_fraction)
    return np.asarray(np.minimum(spall.depth_m, curvature * inside**2 / 2) * spall.face_fraction)


def spall_error(
    pair: GearPair, spall: ToothSpall, *, of_wheel: bool = False, tooth: int = 0, harmonics: int = 8
) -> PeriodicSeries:
    """Transmission error [m, <= 0] over the turn of the gear whose flank has the spall.

    The other pairs in contact carry it in part: the drop counts with the pair's share of the load. A planet
    has a mesh on each flank: only the one that touches the spalled flank has this error.
    """
    gear = pair.gear(of_wheel=of_wheel)
    factors = np.zeros(gear.teeth)
    factors[tooth % gear.teeth] = 1.0
    return tooth_error_series(
        pair,
        lambda phase: -spall_depth(pair, spall, phase, of_wheel=of_wheel),
        factors,
        teeth=gear.teeth,
        harmonics=harmonics,
        breaks=list(spall_extent(pair, spall, of_wheel=of_wheel)),
    )


def specific_sliding(pair: GearPair, phase: Array, *, of_wheel: bool) -> Array:
    """Sliding over rolling speed of a gear's flank, |1 - v_other / v_own|: zero at the pitch point."""
    pinion, wheel = pair.curvature_radii_m(pair.position_m(np.asarray(phase)))
    ratio = pair.pinion.teeth * wheel / (pair.wheel.teeth * pinion)
    return np.asarray(np.abs(1 - (1 / ratio if of_wheel else ratio)))


def wear_depth(pair: GearPair, phase: Array, *, of_wheel: bool) -> Array:
    """Wear of a gear's flank over its largest, at these phases of the pair.

    Archard (1953) as Flodin and Andersson (1997) apply it to gears: depth per cycle is pressure times the
    way that the other flank slides past a point. Pressure times contact width is the load, so that depth
    goes with load share times specific sliding.
    """
    half = pair.contact_ratio / 2
    grid = np.linspace(-half, half, 801)
    largest = float(np.max(shares(pair, grid) * specific_sliding(pair, grid, of_wheel=of_wheel)))
    at = np.clip(np.asarray(phase), -half, half)
    return np.asarray(shares(pair, at) * specific_sliding(pair, at, of_wheel=of_wheel) / largest)


@dataclass(frozen=True)
class Relief:
    """Material taken off near tip and root.

    Parameters
    ----------
    tip_m, root_m : float
        Depth at the end of the working flank, tip and root side.
    length : float
        How far it reaches, over the length of double contact: 1 is long, 0.5 short relief.
    power : float
        1: straight, 2: parabolic from where it begins.
    """

    tip_m: float
    root_m: float = 0.0
    length: float = 0.5
    power: float = 1.0


def relief_depth(pair: GearPair, relief: Relief, phase: Array, *, of_wheel: bool) -> Array:
    """Depth of the relief [m] at these phases of the pair. The pinion's tip is at the end of the path."""
    half = pair.contact_ratio / 2
    reach = relief.length * (pair.contact_ratio - 1)
    along = -np.asarray(phase) if of_wheel else np.asarray(phase)
    tip, root = ((sign * along - (half - reach)) / reach for sign in (1, -1))
    shape = [np.clip(part, 0.0, 1.0) ** relief.power for part in (tip, root)]
    return np.asarray(relief.tip_m * shape[0] + relief.root_m * shape[1])


def spall_contact_loss(
    pair: GearPair,
    spall: ToothSpall,
    part: float,
    *,
    of_wheel: bool = False,
    tooth: int = 0,
    harmonics: int = 8,
) -> PeriodicSeries:
    """Deviation of the mesh stiffness [N/m, <= 0] while the spall takes `part` of the contact line.

    The Hertz spring of the pair is as much shorter; 0 <= part < 1.
    """
    gear = pair.gear(of_wheel=of_wheel)
    first, _, last = spall_extent(pair, spall, of_wheel=of_wheel)
    nodes = window_nodes(pair.contact_ratio, harmonics, [first, last])
    more = hertz_compliance(pair.pinion, pair.wheel) * part / (1 - part)
    compliance = pair_compliance(pair, nodes.phase)
    inside = (nodes.phase > first) & (nodes.phase < last)
    loss = np.where(inside, 1 / compliance - 1 / (compliance + more), 0.0)
    return window_series(nodes, -loss, gear.teeth, tooth, harmonics)
