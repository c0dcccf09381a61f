"""What the simulator has of a bearing: geometry as built, force on it, faults that it has already."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearsim_dsp.kinematics import bearing_orders
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine
from gearsim_sim.scenario import parse_scenario
from gearsim_twin.causes.cause import Content

if TYPE_CHECKING:
    from gearsim_sim.model.bearing_seat import BearingSeat
    from gearsim_sim.model.plant import Plant

__all__ = [
    "DEFECTS",
    "alike",
    "bearings_of",
    "fault_of",
    "force_n",
    "has_defect",
    "most_growth_m",
    "seat_of",
]

DEFECTS = {
    "outer_race_spall": "outer_race",
    "inner_race_spall": "inner_race",
    "rolling_element_spall": "rolling_element",
    "ball_waviness": "rolling_element",
    "wide_spall": "outer_race",
    "extended_roughness": "inner_race",
    "race_waviness": "inner_race",
}
"""Faults of the simulator that put lines of a bearing into the envelope, and whose; `race` may differ."""
_SOURCE = Path("model")
_GROWTHS_M = np.geomspace(0.5e-6, 200e-6, 61)


def bearings_of(content: Content) -> tuple[str, ...]:
    """Bearings that the model has as contacts, so that they can have faults."""
    return tuple(seat.name for seat in _plant(_key(content)).bearings)


def seat_of(content: Content, component: str) -> BearingSeat:
    """A bearing of the model; KeyError if it has none of that name."""
    for seat in _plant(_key(content)).bearings:
        if seat.name == component:
            return seat
    raise KeyError(component)


def fault_of(content: Content, kind: str, component: str) -> Mapping[str, Any] | None:
    """Parameters and severity of a fault that the content holds; None where it has no such fault."""
    for fault in content.get("faults", ()):
        if fault["kind"] == kind and fault["component"] == component:
            return {"severity": fault.get("severity", 1.0), **fault.get("params", {})}
    return None


def has_defect(content: Content, components: Iterable[str], fault: str) -> bool:
    """Whether one of some bearings has a defect in the content that gives the lines of `fault`."""
    wanted = set(components)
    for each in content.get("faults", ()):
        if each["component"] in wanted and each["kind"] in DEFECTS:
            race = each.get("params", {}).get("race")
            if fault == (f"{race}_race" if race else DEFECTS[each["kind"]]):
                return True
    return False


def alike(machine: Machine, component: str) -> list[str]:
    """Bearings of the nameplate with the same lines, itself among them."""
    orders = {b.name: bearing_orders(b, machine.shaft(b.shaft).ratio) for b in machine.bearings}
    return [name for name, own in orders.items() if own == orders[component]]


def force_n(content: Content, component: str) -> float:
    """Radial force on a bearing that stands under the load of the content [N]."""
    return _forces(_key(content), json.dumps(content.get("operating_point", {}), sort_keys=True))[component]


def most_growth_m(content: Content, component: str) -> float:
    """The greatest growth of a bearing's clearance that the simulator takes: a load zone must be left."""
    return _most_growth(_key(content), component)


def _key(content: Content) -> str:
    """What the plant depends on."""
    wanted = {name: content.get(name) for name in ("machine", "model", "parameters")}
    return json.dumps(wanted, sort_keys=True)


@lru_cache(maxsize=64)
def _plant(key: str) -> Plant:
    from gearsim_sim.model.plants import make_plant
    from gearsim_sim.models import parameters

    content = {name: value for name, value in json.loads(key).items() if value is not None}
    point = {"operating_point": {"speed": "1 Hz", "load": "0 N*m"}}
    return make_plant(parameters(parse_scenario({**content, **point}, _SOURCE)), 1)


@lru_cache(maxsize=64)
def _forces(key: str, point: str) -> dict[str, float]:
    from gearsim_sim.integrate.modes import complex_modes
    from gearsim_sim.model.plant import Moment
    from gearsim_sim.model.statics import static_equilibrium

    plant = _plant(key)
    load = json.loads(point).get("load")
    content = {**json.loads(key), "operating_point": {"speed": "1 Hz", "load": load or "0 N*m"}}
    told = {name: value for name, value in content.items() if value is not None}
    load_nm = parse_scenario(told, _SOURCE).load_nm if load is not None else plant.limits.load_nm
    rest = static_equilibrium(
        plant, complex_modes(plant.system), Moment(0.0, 0.0), plant.known_inputs(load_nm)
    )
    motion, phases = plant.system.interfaces.T @ rest, plant.phases(0.0)
    forces = [np.linalg.norm(seat.force(motion[[seat.x, seat.y]], phases)) for seat in plant.bearings]
    return {seat.name: float(force) for seat, force in zip(plant.bearings, forces, strict=True)}


@lru_cache(maxsize=64)
def _most_growth(key: str, component: str) -> float:
    from gearsim_sim.model.bearing_loads import bearing_loads

    plant = _plant(key)
    loads = bearing_loads(plant)
    index = [seat.name for seat in plant.bearings].index(component)
    law = plant.bearings[index].law
    most = 0.0
    for growth in _GROWTHS_M:
        try:
            law.check_load_zone(component, "growth_m", loads[index], law.clearance_m + float(growth))
        except InputError:
            break
        most = float(growth)
    return most
