"""Planetary stages of a nameplate: how they are read, and whether they can be put together at all."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Annotated, Literal

from pydantic import AfterValidator

from gearsim_io.errors import InputError
from gearsim_io.nameplate import PLANETARY_MEMBERS, PlanetaryStage
from gearsim_io.quantities import Si, Strict

# Positions of planets are compared to this fraction of the least mesh angle: far below a tooth's play,
# far above the rounding of positions written with four digits.
_POSITION_TOLERANCE = 1e-2
_TIP = 2  # a full-depth tooth adds one module to the pitch radius, two teeth's worth to the diameter


def _whole(value: float) -> int:
    if value != round(value):
        raise ValueError("a whole number")
    return round(value)


Teeth = Annotated[float, Si("", ge=1), AfterValidator(_whole)]
Member = Literal["carrier", "sun", "ring"]


class PlanetaryStageModel(Strict):
    """A planetary stage; the member that stands still has no shaft. Planets are equally spaced by default."""

    carrier_shaft: str = ""
    sun_shaft: str = ""
    ring_shaft: str = ""
    planet_shaft: str
    input_member: Member
    sun_teeth: Teeth
    ring_teeth: Teeth
    planet_teeth: Teeth
    planets: Teeth
    planet_angles: tuple[Annotated[float, Si("rad")], ...] = ()


def make_stage(name: str, model: PlanetaryStageModel, where: str) -> PlanetaryStage:
    """The stage, if it can be put together.

    Raises
    ------
    InputError
        If not exactly one member stands still, teeth do not fit between sun and ring, planets cannot
        stand where they should, or would touch each other.
    """
    place = f"nameplate.planetary_stages.{name}"
    still = [one for one in PLANETARY_MEMBERS if not getattr(model, f"{one}_shaft")]
    if len(still) != 1:
        expected = "exactly one of carrier_shaft, sun_shaft and ring_shaft left out, the one that stands"
        raise InputError(where, place, f"{len(still)} left out", expected)
    if model.input_member == still[0]:
        raise InputError(where, f"{place}.input_member", model.input_member, "a member that has a shaft")
    count = int(model.planets)
    angles = model.planet_angles or tuple(2 * math.pi * k / count for k in range(count))
    if len(angles) != count:
        raise InputError(where, f"{place}.planet_angles", f"{len(angles)} angles", f"{count} angles")
    stage = PlanetaryStage(
        name=name,
        carrier_shaft=model.carrier_shaft,
        sun_shaft=model.sun_shaft,
        ring_shaft=model.ring_shaft,
        planet_shaft=model.planet_shaft,
        input_member=model.input_member,
        sun_teeth=int(model.sun_teeth),
        ring_teeth=int(model.ring_teeth),
        planet_teeth=int(model.planet_teeth),
        planet_angles_rad=angles,
    )
    check_assembly(stage, where, place)
    return stage


def check_assembly(stage: PlanetaryStage, where: str, place: str) -> None:
    """Whether gears and planets fit together.

    The ring must span sun and planets; each planet must stand where its teeth meet tooth spaces of sun
    and ring at once, on multiples of 2 pi / (Z_s + Z_r) from the first; neighbours must clear each other.
    """
    sun, ring, planet = stage.sun_teeth, stage.ring_teeth, stage.planet_teeth
    if ring != sun + 2 * planet:
        expected = f"{sun + 2 * planet}, the sun's teeth and twice the planet's"
        raise InputError(where, f"{place}.ring_teeth", ring, expected)
    angles = stage.planet_angles_rad
    least = 2 * math.pi / (sun + ring)
    for k, angle in enumerate(angles):
        steps = (angle - angles[0]) / least
        if abs(steps - round(steps)) > _POSITION_TOLERANCE:
            expected = _where_it_fits(stage, k, steps, least)
            raise InputError(where, f"{place}.planet_angles", f"{math.degrees(angle):.6g} deg", expected)
    turned = sorted(math.remainder(angle, 2 * math.pi) % (2 * math.pi) for angle in angles)
    gaps = [b - a for a, b in zip(turned, [*turned[1:], turned[0] + 2 * math.pi], strict=True)]
    apart = (sun + planet) * math.sin(min(*gaps, math.pi) / 2)
    if len(angles) > 1 and apart <= planet + _TIP:
        most = math.floor(math.pi / math.asin(min(1.0, (planet + _TIP) / (sun + planet))))
        expected = f"planets clear of each other: at most {most} of {planet} teeth, evenly spaced"
        raise InputError(where, f"{place}.planets", len(angles), expected)


def _where_it_fits(stage: PlanetaryStage, index: int, steps: float, least: float) -> str:
    teeth, count = stage.sun_teeth + stage.ring_teeth, len(stage.planet_angles_rad)
    first = stage.planet_angles_rad[0]
    below, above = (math.degrees(first + least * side(steps)) for side in (math.floor, math.ceil))
    text = f"{below:.6g} or {above:.6g} deg for planet {index + 1} (multiples of 360/{teeth} deg)"
    if teeth % count:
        text += f"; {count} planets fit equally spaced only if {count} divides {teeth} = Z_s + Z_r"
    return text


def stage_speeds(stages: Iterable[PlanetaryStage]) -> list[tuple[str, str, float]]:
    """(input shaft, other shaft, magnitude of its speed over the input's) for all shafts of stages."""
    found = []
    for stage in stages:
        ratios: Mapping[str, float] = stage.member_ratios()
        source = getattr(stage, f"{stage.input_member}_shaft")
        for member in (*PLANETARY_MEMBERS, "planet"):
            shaft = getattr(stage, f"{member}_shaft")
            if shaft and shaft != source:
                found.append((source, shaft, abs(ratios[member])))
    return found
