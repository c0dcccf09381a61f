"""Every model that a scenario can name, on a shipped machine, found without a list of its own."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine, machine_names
from gearsim_sim.engine import Engine
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.plants import make_plant
from gearsim_sim.models import MODELS
from gearsim_sim.scenario import Scenario, parse_scenario

SEED = 3
# Share of the nominal load at which a fault is tried; play between teeth shows where they part.
LIGHT_LOAD = {"gear_backlash": 0.08}


def model_names() -> tuple[str, ...]:
    """All models."""
    return tuple(MODELS)


def documented_first() -> tuple[str, ...]:
    """Shipped machines: those whose nameplate tells their bearings before those that have assumed ones."""
    return tuple(sorted(machine_names(), key=lambda name: (not load_machine(name).bearings, name)))


@cache
def machine_of(model: str) -> tuple[str, Any]:
    """The first shipped machine that this model can be: its name, its parameters.

    Raises
    ------
    LookupError
        If there is none: then nobody could try the model.
    """
    for machine in documented_first():
        try:
            running = MODELS[model](_smallest_scenario(model, machine))
        except InputError:
            continue
        assert isinstance(running, Engine)
        return machine, running.params
    raise LookupError(f"no shipped machine for the model {model}")


def params_of(model: str) -> Any:
    """Parameters of that machine."""
    return machine_of(model)[1]


def _smallest_scenario(model: str, machine: str) -> Scenario:
    content = {
        "machine": machine,
        "model": model,
        "seed": SEED,
        "operating_point": {"speed": "1 Hz", "load": "0 N*m"},
    }
    return parse_scenario(content, Path(f"{model}.yaml"))


@cache
def plant_of(model: str) -> Plant:
    """The machine of that model, with the gear errors of `SEED`."""
    return make_plant(params_of(model), SEED)


def load_for(model: str, kind: str) -> float:
    """Load [N m] at which this kind of fault acts: the nominal one but for a few."""
    return LIGHT_LOAD.get(kind, 1.0) * plant_of(model).limits.load_nm
