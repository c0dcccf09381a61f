"""A crack in the root of a tooth: what it takes from the sections above it, and from the mesh.

The crack runs from the critical section of one fillet down into the tooth, at an angle to its middle line.
Material between crack and flank carries nothing up to a limiting line: parallel to the middle line through
the crack's tip (Tian 2004; Wu, Zuo and Parey 2008); when the crack's tip has come closer to the middle than
the tooth's own tip is thick, a parabola from there to the corner of the tooth's tip (Mohammed, Rantatalo
and Aidanpaa 2013). A crack over a part of the face width runs out as a parabola in depth (Chen and Shao
2011): the slices of the tooth are springs side by side.

Load on the cracked flank opens the crack. Load on the other flank closes it, and faces that touch carry
pressure: only the part `closing` of the loss is left (1 for a slot, which cannot close).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.model.periodic import PeriodicSeries
from gearsim_sim.model.tooth.compliance import beam_compliance, contact_point, root_of
from gearsim_sim.model.tooth.gear import SpurGear
from gearsim_sim.model.tooth.outline import Outline, Root, tooth_outline
from gearsim_sim.model.tooth.pair import GearPair
from gearsim_sim.model.tooth.stiffness import pair_compliance
from gearsim_sim.model.tooth.windows import window_nodes, window_series

Array = NDArray[np.float64]
_SLICES_X, _SLICES_W = np.polynomial.legendre.leggauss(12)
# A crack that leaves less than this of the critical section is a tooth about to break, beyond a linear model.
_LEFT = 0.2


@dataclass(frozen=True)
class Crack:
    """A root crack.

    Parameters
    ----------
    depth_m : float
        Length of the crack from the surface of the fillet inwards.
    angle_rad : float
        Between crack and middle line of the tooth.
    width_m : float or None
        Length along the face where it has this depth at one end and ends at the other; None: all along.
    closing : float
        Part of the loss of stiffness that remains when the load presses the crack shut.
    """

    depth_m: float
    angle_rad: float = math.pi / 4
    width_m: float | None = None
    closing: float = 0.3


def depth_to_middle_m(gear: SpurGear, angle_rad: float = math.pi / 4) -> float:
    """Depth of a crack that reaches the middle line, as the slot of thesis 7.3.2."""
    return root_of(gear).weakest(internal=gear.internal)[1] / math.sin(angle_rad)


def check_crack(where: str, gear: SpurGear, crack: Crack) -> None:
    """InputError unless the tooth holds on: the crack leaves a fifth of its critical section."""
    if not math.radians(10) <= crack.angle_rad <= math.radians(90):
        raise InputError(where, "angle_rad", crack.angle_rad, "0.175 to 1.571 rad (10 to 90 deg)")
    limit = 2 * (1 - _LEFT) * depth_to_middle_m(gear, crack.angle_rad)
    if not 0 < crack.depth_m <= limit:
        expected = f"more than 0 and up to {limit:.4g} m, so that a fifth of the tooth is left"
        raise InputError(where, "depth_m", crack.depth_m, expected)
    if crack.width_m is not None and not 0 < crack.width_m <= gear.face_width_m:
        raise InputError(where, "width_m", crack.width_m, f"more than 0 and up to {gear.face_width_m:g} m")


def cracked_compliance(gear: SpurGear, crack: Crack, roll_rad: Array, *, opens: bool) -> Array:
    """Bending + shear + compression of a cracked tooth [m/N] for contact at these roll angles.

    `opens`: the load is on the cracked flank. The part `closing` is left to the caller.
    """
    root = root_of(gear)
    outline = tooth_outline(gear, root, roll_rad)
    point = contact_point(gear, root, roll_rad)
    sound = 1 / beam_compliance(outline, point, gear).sum(axis=0)
    width = gear.face_width_m if crack.width_m is None else crack.width_m
    if crack.width_m is None:
        depths, weights = [crack.depth_m], [1.0]
    else:
        depths = list(crack.depth_m * np.sqrt((1 - _SLICES_X) / 2))
        weights = list(_SLICES_W / 2 * width / gear.face_width_m)
    stiffness = sound * (1 - sum(weights))
    for depth, weight in zip(depths, weights, strict=True):
        left = _left_of_section(gear, root, outline, depth, crack.angle_rad)
        halves = (left, None) if opens else (None, left)
        stiffness = stiffness + weight / beam_compliance(outline, point, gear, *halves).sum(axis=0)
    return np.asarray(1 / stiffness)


def _left_of_section(gear: SpurGear, root: Root, outline: Outline, depth: float, angle: float) -> Array:
    """Half the thickness that is left on the cracked side, shape as the outline's."""
    start_height, start_half = root.weakest(internal=gear.internal)
    tip_height = start_height - depth * math.cos(angle)
    tip_half = start_half - depth * math.sin(angle)
    x, half = gear.flank(np.array(gear.roll_rad(gear.tip_radius_m)))
    corner_height, corner_half = gear.side * (float(x) - root.foot_m), float(half)
    along = (outline.height_m - tip_height) / (corner_height - tip_height)
    rise = max(0.0, corner_half - tip_half)
    limit = tip_half + rise * np.sqrt(np.clip(along, 0.0, 1.0))
    return np.where(along < 0, outline.half_m, np.minimum(outline.half_m, limit))


def cracked_pair_loss(pair: GearPair, crack: Crack, phase: Array, *, of_wheel: bool, opens: bool) -> Array:
    """How much less stiff the pair with the cracked tooth is [N/m, >= 0] at these phases of the pair."""
    gear = pair.gear(of_wheel=of_wheel)
    roll = pair.roll_rad(pair.position_m(phase), of_wheel=of_wheel)
    root = root_of(gear)
    outline = tooth_outline(gear, root, roll)
    before = beam_compliance(outline, contact_point(gear, root, roll), gear).sum(axis=0)
    compliance = pair_compliance(pair, phase)
    more = cracked_compliance(gear, crack, roll, opens=opens) - before
    share = 1.0 if opens else crack.closing
    return np.asarray(share * (1 / compliance - 1 / (compliance + more)))


def crack_stiffness_loss(
    pair: GearPair,
    crack: Crack,
    *,
    of_wheel: bool = False,
    tooth: int = 0,
    opens: bool = True,
    harmonics: int = 8,
) -> PeriodicSeries:
    """Deviation of the mesh stiffness [N/m, <= 0] over the turn of the gear with the cracked tooth.

    Parameters
    ----------
    pair : GearPair
        The mesh.
    crack : Crack
        See there.
    of_wheel : bool
        The crack is in the wheel (else in the pinion).
    tooth : int
        Which tooth; the middle of its contact is at (tooth + 1/2) / teeth turns.
    opens : bool
        The mesh loads the cracked flank. A planet has two meshes on opposite flanks: call this for the
        one with True, for the other with False.
    harmonics : int
        Mesh orders kept, as in `stiffness_series`.

    Raises
    ------
    InputError
        If the crack is deeper than the tooth can bear.
    """
    gear = pair.gear(of_wheel=of_wheel)
    check_crack(f"crack in {gear.name}", gear, crack)
    nodes = window_nodes(pair.contact_ratio, harmonics)
    loss = cracked_pair_loss(pair, crack, nodes.phase, of_wheel=of_wheel, opens=opens)
    return window_series(nodes, -loss, gear.teeth, tooth, harmonics)
