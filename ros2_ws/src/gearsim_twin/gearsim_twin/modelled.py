"""Which model can stand for a machine, and which of its channels that model gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine, machine_names, read_machine_file
from gearsim_sim.models import MODELS, parameters
from gearsim_sim.scenario import Scenario, parse_scenario

__all__ = ["Modelled", "describe", "fitting_models", "has_model_section"]


@dataclass(frozen=True, slots=True)
class Modelled:
    """What a model tells of a machine.

    Parameters
    ----------
    kind : str
        Kind of the description's `model` section, such as `bearing_rig`.
    sites : tuple of str
        Names of the places that can be measured.
    torque_shafts : tuple of str
        Shafts whose torque can be measured.
    tacho_shafts : tuple of str
        Shafts whose angle can be measured.
    load_nm, speed_hz : float
        The operating point that the description gives.
    """

    kind: str
    sites: tuple[str, ...]
    torque_shafts: tuple[str, ...]
    tacho_shafts: tuple[str, ...]
    load_nm: float
    speed_hz: float


def describe(machine: str | Path, model: str) -> Modelled:
    """What `model` tells of a machine.

    Raises
    ------
    InputError
        If there is no such model, the description has no section `model`, or the model is of another kind of
        machine: with the names that would do.
    """
    if model not in MODELS:
        raise InputError("--model", "", model, "one of " + ", ".join(sorted(MODELS)))
    path, content = read_machine_file(machine)
    section = content.get("model")
    if section is None or not has_model_section(content):
        able = ", ".join(name for name in machine_names() if has_model_section(read_machine_file(name)[1]))
        expected = (
            "a section `model` with masses, stiffnesses and dampers, without which nothing can be simulated "
            f"(docs/rigs.md; the machines {able} have one); `gearsim diagnose` needs none"
        )
        raise InputError(str(path), "model", "nothing", expected)
    try:
        scenario = _scenario(path, model)
        params = parameters(scenario)
    except InputError as error:
        others = fitting_models(path)
        if model in others:
            raise
        if others:
            expected = f"a model that describes {content.get('name')}: one of " + ", ".join(others)
            raise InputError("--model", "", model, expected) from None
        raise InputError(error.where, error.field, error.value, error.expected) from None
    from gearsim_sim.model.plants import make_plant  # here, because a refusal need not wait for it

    plant = make_plant(params, scenario.seed)
    return Modelled(
        kind=str(section["kind"]),
        sites=tuple(plant.sites),
        torque_shafts=tuple(name.removesuffix("_torque") for name in plant.signals if "_torque" in name),
        tacho_shafts=tuple(plant.encoders),
        load_nm=float(plant.limits.load_nm),
        speed_hz=float(plant.limits.speed_hz),
    )


def fitting_models(machine: str | Path) -> tuple[str, ...]:
    """The models that a machine's description has all numbers for."""
    found = []
    for name in sorted(MODELS):
        try:
            parameters(_scenario(Path(machine), name))
        except InputError:
            continue
        found.append(name)
    return tuple(found)


def has_model_section(content: Mapping[str, Any]) -> bool:
    """Whether the content of a machine file has what a simulation needs at all."""
    section = content.get("model")
    return isinstance(section, Mapping) and "kind" in section


def _scenario(path: Path, model: str) -> Scenario:
    plate = load_machine(path)
    content = {"machine": str(path), "model": model, "operating_point": {"speed": "1 Hz", "load": "0 N*m"}}
    if not plate.channels:
        raise InputError(str(path), "nameplate.channels", "none", "at least one channel to compare")
    return parse_scenario(content, path)
