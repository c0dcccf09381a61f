"""What the simulator has of gears, shafts and planets: who can have a fault, teeth, how fast they turn."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from gearsim_sim.scenario import parse_scenario
from gearsim_twin.causes.cause import Content

if TYPE_CHECKING:
    from gearsim_sim.model.plant import Plant

__all__ = ["Part", "has_planets", "parts_of", "plant_of"]

_SOURCE = Path("model")


@dataclass(frozen=True, slots=True)
class Part:
    """A component of the model that can have a fault.

    Attributes
    ----------
    name : str
        As scenarios name it.
    teeth : int
        Of a wheel, a planet, or the wheel of a shaft; 1 for all that has none.
    turns : float
        Of the part against the frame that its faults turn in (the carrier's, for a stage with planets), in
        turns of the reference shaft.
    twin : bool
        A wheel that nothing but angle marks tells from its mate: it meets as many teeth as fast.
    side : str
        The mesh of a planet that is meant: "sun" or "ring".
    """

    name: str
    teeth: int = 1
    turns: float = 1.0
    twin: bool = False
    side: str = ""


def plant_of(content: Content) -> Plant:
    """The plant of the model in a content, without faults."""
    return _plant(_key(content))


def parts_of(content: Content, kind: str) -> tuple[Part, ...]:
    """Components of the model that can have a kind of fault, in the simulator's order."""
    from gearsim_sim.model.faults import fault_kind

    plant = _plant(_key(content))
    return tuple(_part(plant, name) for name in fault_kind(kind).components(plant))


def has_planets(content: Content) -> bool:
    """Whether planets carry the load: then gear errors have other phases in every run."""
    return bool(_planet_teeth(_plant(_key(content))))


def _part(plant: Plant, name: str) -> Part:
    for wheel in plant.wheels:
        if wheel.name == name:
            rate = abs(float(plant.tracks[wheel.track].rate))
            mates = [one for one in plant.wheels if one.mesh == wheel.mesh and one.name != name]
            alike = any(
                one.gear.teeth == wheel.gear.teeth and abs(plant.tracks[one.track].rate) == rate
                for one in mates
            )
            return Part(name, int(wheel.gear.teeth), rate, alike)
    if name in _planet_teeth(plant):
        return Part(name, _planet_teeth(plant)[name], abs(float(plant.tracks[plant.track("planet")].rate)))
    for shaft in plant.shafts:
        if shaft.name == name:
            rate = abs(float(shaft.rate))
            on_it = [one.gear.teeth for one in plant.wheels if abs(plant.tracks[one.track].rate) == rate]
            return Part(name, int(on_it[0]) if on_it else 1, rate)
    for seat in plant.bearings:
        if seat.name == name:
            return Part(name, 1, abs(float(seat.inner.rate(plant.rates))) or 1.0)
    return Part(name)


def _planet_teeth(plant: Plant) -> Mapping[str, int]:
    from gearsim_sim.model.planet_plant import PlanetaryPlant

    if not isinstance(plant, PlanetaryPlant):
        return {}
    return dict.fromkeys(plant.planet_names, int(plant.params.stage.planet_teeth))


def _key(content: Content) -> str:
    """What the plant depends on."""
    return json.dumps(
        {name: content.get(name) for name in ("machine", "model", "parameters")}, sort_keys=True
    )


@lru_cache(maxsize=16)
def _plant(key: str) -> Plant:
    from gearsim_sim.model.plants import make_plant
    from gearsim_sim.models import parameters

    content = {name: value for name, value in json.loads(key).items() if value is not None}
    point = {"operating_point": {"speed": "1 Hz", "load": "0 N*m"}}
    return make_plant(parameters(parse_scenario({**content, **point}, _SOURCE)), 1)
