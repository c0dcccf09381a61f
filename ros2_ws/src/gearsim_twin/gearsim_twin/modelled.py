"""Which model can stand for a machine, and which of its channels that model gives."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine, machine_file
from gearsim_sim.models import MODELS, parameters
from gearsim_sim.scenario import Scenario, parse_scenario
from gearsim_twin.given import check_given, model_kind

__all__ = ["Modelled", "describe", "fitting_models"]


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
    load_limit_nm, speed_limit_hz : float
        What its drive can do.
    """

    kind: str
    sites: tuple[str, ...]
    torque_shafts: tuple[str, ...]
    tacho_shafts: tuple[str, ...]
    load_nm: float
    speed_hz: float
    load_limit_nm: float
    speed_limit_hz: float


def describe(machine: str | Path, model: str) -> Modelled:
    """What `model` tells of a machine.

    Raises
    ------
    InputError
        If there is no such model, the description has no section `model`, or the model is of another kind of
        machine: with the names that would do.
    """
    path = machine_file(machine)
    kind = model_kind(path)
    check_given({}, path, model)
    try:
        scenario = _scenario(path, model)
        params = parameters(scenario)
    except InputError as error:
        others = fitting_models(path)
        if model in others:
            raise
        if others:
            expected = f"a model that describes {load_machine(path).name}: one of " + ", ".join(others)
            raise InputError("--model", "", model, expected) from None
        raise InputError(error.where, error.field, error.value, error.expected) from None
    from gearsim_sim.model.plants import make_plant  # here, because a refusal need not wait for it

    plant = make_plant(params, scenario.seed)
    return Modelled(
        kind=kind,
        sites=tuple(plant.sites),
        torque_shafts=tuple(name.removesuffix("_torque") for name in plant.signals if "_torque" in name),
        tacho_shafts=tuple(plant.encoders),
        load_nm=float(plant.limits.load_nm),
        speed_hz=float(plant.limits.speed_hz),
        load_limit_nm=float(plant.limits.load_limit_nm),
        speed_limit_hz=float(plant.limits.speed_limit_hz),
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


def _scenario(path: Path, model: str) -> Scenario:
    plate = load_machine(path)
    content = {"machine": str(path), "model": model, "operating_point": {"speed": "1 Hz", "load": "0 N*m"}}
    if not plate.channels:
        raise InputError(str(path), "nameplate.channels", "none", "at least one channel to compare")
    return parse_scenario(content, path)
