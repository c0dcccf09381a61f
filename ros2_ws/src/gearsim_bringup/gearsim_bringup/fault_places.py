"""Where a kind of fault can be: on which components of which shipped machines, how great, and shown where."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import get_origin

from pydantic.fields import FieldInfo

from gearsim_bringup.reference import si_of
from gearsim_io.errors import InputError
from gearsim_io.machines import machine_names, read_machine_file
from gearsim_sim.events import FaultSpec
from gearsim_sim.model.faults import FaultKind
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.plants import make_plant
from gearsim_sim.models import MODELS, parameters
from gearsim_sim.scenario import FOLDER, load_scenario, parse_scenario, scenario_names

_BEYOND_ALL = 1e9  # in the unit of any parameter


@dataclass(frozen=True)
class Place:
    """A machine that can have a fault.

    Attributes
    ----------
    machine : str
        Name of a shipped description, and the scenario that changes its model where it must be changed.
    models : tuple of str
        Models of it on which the same components can have the fault.
    components : tuple of str
    limits : tuple of (parameter, text)
        What the first component allows of each parameter whose range is open above.
    """

    machine: str
    models: tuple[str, ...]
    components: tuple[str, ...]
    limits: tuple[tuple[str, str], ...]


def places_of(kind: FaultKind) -> tuple[Place, ...]:
    """All places of a kind on the shipped machines."""
    found: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    plants = {}
    for model, machine, plant in (*_plants(), *_changed(kind)):
        components = kind.components(plant)
        if components:
            found.setdefault((machine, components), []).append(model)
            plants[machine, components] = plant
    return tuple(
        Place(machine, tuple(models), components, _limits(kind, plants[machine, components], components[0]))
        for (machine, components), models in found.items()
    )


def scenarios_of(kind: FaultKind) -> tuple[str, ...]:
    """Shipped scenarios that have a fault of this kind, the one named after it first."""
    line = re.compile(rf"\bkind: {kind.name}\b")
    names = [name for name in scenario_names() if line.search((FOLDER / f"{name}.yaml").read_text())]
    return tuple(sorted(names, key=lambda name: (name != kind.name, name)))


@cache
def _plants() -> tuple[tuple[str, str, Plant], ...]:
    """Every model of every shipped machine."""
    return tuple(_made())


def _made() -> Iterator[tuple[str, str, Plant]]:
    for machine in machine_names():
        if "model" not in read_machine_file(machine)[1]:
            continue
        content = {"machine": machine, "operating_point": {"speed": "0 Hz", "load": "0 N*m"}}
        scenario = parse_scenario(content, Path("standing.yaml"))
        for model in MODELS:
            try:
                params = parameters(replace(scenario, model=model))
            except InputError:  # a model of another kind of machine
                continue
            yield model, machine, make_plant(params, 1)


def _changed(kind: FaultKind) -> Iterator[tuple[str, str, Plant]]:
    """Machines of scenarios that change the model and show the kind, where it needs that change."""
    able = {machine for _, machine, plant in _plants() if kind.components(plant)}
    for name in scenarios_of(kind):
        scenario = load_scenario(name)
        if scenario.parameters and scenario.machine.name not in able:
            able.add(scenario.machine.name)
            label = f"{scenario.machine.name} as in scenario {name}"
            yield scenario.model, label, make_plant(parameters(scenario), 1)


def _limits(kind: FaultKind, plant: Plant, component: str) -> tuple[tuple[str, str], ...]:
    names = (name for name, field in kind.params_model.model_fields.items() if _is_open_above(field))
    limits = ((name, _limit(kind, plant, component, name)) for name in names)
    return tuple((name, limit) for name, limit in limits if limit)


def _is_open_above(field: FieldInfo) -> bool:
    """Whether it is a single number whose own range has no upper end."""
    si = si_of(field)
    single = get_origin(field.annotation) is not tuple
    return single and si is not None and si.lt is None and si.le is None


def _limit(kind: FaultKind, plant: Plant, component: str, name: str) -> str:
    """What the check of a value beyond all bounds says that it expected; empty if nothing can be said."""
    try:
        kind.build(FaultSpec(kind.name, component, {name: _BEYOND_ALL}), plant)
    except InputError as error:
        expected = error.expected.split(" (this: ")[0]  # what follows is about this value alone
        return expected if error.field == name else f"as long as {error.field} is {expected}"
    except ArithmeticError:
        return ""
    return "no upper limit"
