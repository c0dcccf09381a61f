"""Faults of single teeth, of wheels and planets: their names in the simulator, and what it takes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gearsim_twin.causes.cause import Content
from gearsim_twin.causes.edit import with_fault
from gearsim_twin.causes.gear_model import Part, has_planets, parts_of, plant_of
from gearsim_twin.causes.matched import Match
from gearsim_twin.compare.turns import KINDS

if TYPE_CHECKING:
    from gearsim_sim.model.tooth.pair import GearPair
    from gearsim_twin.causes.context import Context

__all__ = ["most_of", "tooth_starts", "toothed", "with_tooth_fault"]

_CLEAR = 0.98
_STANDS_OUT = 3.0  # standard deviations
_MOST_STARTS = 4
_STANDS = "ring"  # its teeth bear least, and each is met by all planets in turn
_PLANETS = {"gear_tooth_crack": "planet_tooth_crack", "gear_tooth_spall": "planet_tooth_spall"}
_SIDE_KEY = {"gear_tooth_crack": "opens_towards", "gear_tooth_spall": "side"}


def toothed(content: Content, kind: str) -> list[Part]:
    """Wheels that turn, and the first planet by each of its sides: nameplates do not tell planets apart."""
    planets = parts_of(content, _PLANETS[kind])[:1]
    sides = [replace(planet, side=side) for planet in planets for side in ("sun", "ring")]
    return [*(part for part in parts_of(content, kind) if part.name != _STANDS), *sides]


def tooth_starts(
    context: Context, found: Sequence[Match], parts: Sequence[Part], size: str, usual: float, most: int
) -> list[dict[str, float | str]]:
    """First guesses of a fault of one tooth: what was matched, and of planets every part besides.

    Teeth of planetary gears are drawn anew with every seed, so that a weak fault matches no phase. Their
    average over the carrier's turn tells that single teeth do more than the model's; then each part is
    tried with a fault of a usual size.
    """
    starts = [
        _start(match.part, size, match.sign * match.value, 1 + round(match.angle_turns * match.part.teeth))
        for match in found[:most]
    ]
    if not has_planets(context.contents[0]) or not _teeth_stand_out(context):
        return starts
    tried = {(start["component"], start.get("side", "")) for start in starts}
    starts += [_start(part, size, usual, 1) for part in parts if (part.name, part.side) not in tried]
    return starts[:_MOST_STARTS]


def _start(part: Part, size: str, value: float, tooth: int) -> dict[str, float | str]:
    side: dict[str, float | str] = {"side": part.side} if part.side else {}
    return {"component": part.name, size: value, "tooth": str(tooth), **side}


def _teeth_stand_out(context: Context) -> bool:
    """Whether single teeth do more than those of the model, in averages over turns or in envelopes."""
    averaged = (one.z for one in context.differences("transient") if one.place.kind in KINDS)
    modulated = (one.z for one in context.differences("envelope") if one.place.kind != "ratio")
    return max((*averaged, *modulated), default=0.0) > _STANDS_OUT


def with_tooth_fault(
    content: Content, kind: str, component: str, side: str, tooth: int, params: Mapping[str, Any]
) -> Content:
    """With a fault of one tooth; `side` tells the flank of planets, or the mesh that opens their crack."""
    own = {**params, "tooth": tooth}
    if component in {part.name for part in parts_of(content, _PLANETS[kind])}:
        return with_fault(content, _PLANETS[kind], component, {**own, _SIDE_KEY[kind]: side or "sun"})
    return with_fault(content, kind, component, own)


def most_of(content: Content, kind: str, component: str) -> float:
    """The greatest crack or spall [m] that the simulator takes of a component: some tooth must be left."""
    plant = plant_of(content)
    if component in {part.name for part in parts_of(content, _PLANETS[kind])}:
        from gearsim_sim.model.faults.planets import planetary

        geometry = planetary(plant).geometry
        flanks = [(geometry.pair(side), False) for side in (0, 1)]
    else:
        flanks = [(wheel.pair, wheel.of_wheel) for wheel in plant.wheels if wheel.name == component]
    if not flanks:
        raise KeyError(component)
    return _CLEAR * min(
        _deepest(*flank) if kind == "gear_tooth_crack" else _widest(*flank) for flank in flanks
    )


def _deepest(pair: GearPair, of_wheel: bool) -> float:
    """A crack that leaves a fifth of the critical section (`gearsim_sim.model.tooth.crack`)."""
    from gearsim_sim.model.tooth.crack import depth_to_middle_m

    return 1.6 * depth_to_middle_m(pair.gear(of_wheel=of_wheel))


def _widest(pair: GearPair, of_wheel: bool) -> float:
    """A pit around the pitch point that ends on the working flank; an involute is r_b roll^2 / 2 long."""
    gear = pair.gear(of_wheel=of_wheel)
    low, middle, high = np.sort(
        pair.roll_rad(np.array([*pair.path_m, pair.pitch_point_m]), of_wheel=of_wheel)
    )
    return float(gear.base_radius_m * min(middle**2 - low**2, high**2 - middle**2))
