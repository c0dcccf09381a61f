"""The `model` section of a machine description, as every kind of machine reads it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine, read_machine_file
from gearsim_io.nameplate import Machine
from gearsim_sim.params.as_built import PREFIX, as_built
from gearsim_sim.params.assumed_bearings import with_assumed_bearings
from gearsim_sim.params.overrides import override

_MODEL = {"parallel_shaft": "lpm34", "planetary": "planetary18", "bearing_rig": "bearing5"}
"""The usual model of each kind of machine."""


@dataclass(frozen=True)
class ModelSection:
    """What a machine description holds for the simulator; `where` names it in errors.

    `plate` is the nameplate with the bearings as they are built, or as assumed where it tells none.
    """

    plate: Machine
    where: str
    content: dict[str, Any]


def read_model_section(
    machine: str | Path, kind: str, example: str, overrides: Mapping[str, Any] | None, source: str
) -> ModelSection:
    """The `model` section of a machine, not yet validated.

    Parameters
    ----------
    machine : str or Path
        Name of a shipped machine description or path of a YAML file.
    kind : str
        What its `kind` must be.
    example : str
        A shipped machine of that kind, for errors.
    overrides : mapping or None
        Dotted names of the section and the numbers that replace it (see `override`); names that begin with
        `nameplate.` tell how bearings are built where the nameplate is wrong (see `as_built`).
    source : str
        Where the overrides come from, for errors.

    Raises
    ------
    InputError
        If there is no section of that kind, or an override has no place in it.
    """
    plate = load_machine(machine)
    path, content = read_machine_file(machine)
    where = f"{path}: model"
    section = content.get("model")
    if not isinstance(section, dict) or section.get("kind") != kind:
        found = section.get("kind") if isinstance(section, dict) else section
        expected = f"{kind}, as machine {example} has it"
        if found in _MODEL:
            expected += f"; a scenario of this machine needs model: {_MODEL[found]}"
        raise InputError(where, "kind", found, expected)
    plate, section = with_assumed_bearings(plate, section, where)
    if overrides:
        built = {name: value for name, value in overrides.items() if name.startswith(PREFIX)}
        plate = as_built(plate, built, source or where)
        rest = {name: value for name, value in overrides.items() if name not in built}
        section = override(section, rest, source or where)
        where = f"{source or where} (parameters, with {path})"
    return ModelSection(plate, where, section)
