"""The reference of all parameters as sections, and as the page docs/parameters.md."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

from pydantic import BaseModel

from gearsim_bringup.fault_places import Place, places_of, scenarios_of
from gearsim_bringup.reference import Parameter, parameters, table
from gearsim_io.errors import InputError
from gearsim_io.machines import machine_names, read_machine_file
from gearsim_sim.model.faults import REGISTRY, FaultKind
from gearsim_sim.params.kinds import MODEL_KINDS
from gearsim_sim.scenario import ScenarioModel

_HEAD = """# Parameters

Made by `./gearsim parameters --out docs/parameters.md` from what the program checks. Numbers in YAML carry
their unit (`0.8 mm`, `10 Hz`) and are converted; in a key that names its unit (`width_m`) a bare number is in
that unit. In machine descriptions each number is `{value, unit, source}`. `<name>` stands for a key of one's
own, `[]` for an entry of a list. For each kind of fault follow the shipped machines that can have it, with
the limits that they set, and the shipped scenarios that show it (`./gearsim run NAME`).
"""


@dataclass(frozen=True)
class Section:
    """A part of the reference."""

    name: str
    summary: str
    rows: tuple[Parameter, ...]
    values: tuple[tuple[str, str, str, str], ...] = ()  # machine, parameter, value with unit, source
    places: tuple[Place, ...] = ()
    scenarios: tuple[str, ...] = ()  # shipped ones that show it

    def content(self) -> dict[str, Any]:
        """For programs."""
        return {
            "name": self.name,
            "summary": self.summary,
            "parameters": [asdict(row) for row in self.rows],
            "values": [
                dict(zip(("machine", "parameter", "value", "source"), row, strict=True))
                for row in self.values
            ],
            "places": [asdict(place) | {"limits": dict(place.limits)} for place in self.places],
            "scenarios": list(self.scenarios),
        }


def sections(only: str | None = None) -> list[Section]:
    """All sections, or the one of that name; InputError lists the names if there is none."""
    makers: dict[str, Callable[[], Section]] = {
        "scenario": lambda: Section("scenario", "The keys of a scenario file.", _rows(ScenarioModel)),
        **{name: partial(_of_fault, kind) for name, kind in REGISTRY.items()},
        **{name: partial(_of_machine, name) for name in MODEL_KINDS},
    }
    if only is None:
        return [make() for make in makers.values()]
    if only not in makers:
        raise InputError("parameters", "section", only, "one of " + ", ".join(makers))
    return [makers[only]()]


def _of_fault(kind: FaultKind) -> Section:
    rows = _rows(kind.params_model)
    return Section(kind.name, kind.summary, rows, places=places_of(kind), scenarios=scenarios_of(kind))


def _of_machine(name: str) -> Section:
    summary = f"The `model` section of a machine of kind {name}."
    return Section(name, summary, _rows(MODEL_KINDS[name]), _values(name))


def markdown(chosen: Sequence[Section], *, whole: bool) -> str:
    """The sections as Markdown; `whole` adds the head of the page."""
    parts = [_HEAD] if whole else []
    for one in chosen:
        text = f"## {one.name}\n{one.summary[:1].upper()}{one.summary[1:]}\n\n"
        text += table(one.rows) if one.rows else "No parameters of its own."
        if one.values:
            text += "\n\n| machine | parameter | value | source |\n|---|---|---|---|\n"
            text += "\n".join("| " + " | ".join(row) + " |" for row in one.values)
        if one.places:
            text += "\n\n" + _places(one)
        parts.append(text + "\n")
    return "\n".join(parts)


def _places(one: Section) -> str:
    """Who can have a fault, how great it can be there, and what shows it."""
    lines = ["| machine | models | components | upper limits, on the first of them |", "|---|---|---|---|"]
    for place in one.places:
        limits = "; ".join(f"`{name}` {text}" for name, text in place.limits) or "as above"
        cells = (place.machine, ", ".join(place.models), ", ".join(place.components), limits)
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n\nShown by: " + ", ".join(f"`{name}`" for name in one.scenarios) + "."


def _rows(model: type[BaseModel]) -> tuple[Parameter, ...]:
    return tuple(parameters(model))


def _values(kind: str) -> tuple[tuple[str, str, str, str], ...]:
    """What the shipped machines of a kind have."""
    rows = []
    for name in machine_names():
        section = read_machine_file(name)[1].get("model")
        if isinstance(section, dict) and section.get("kind") == kind:
            rows += [(name, *row) for row in _numbers(section)]
    return tuple(rows)


def _numbers(section: Mapping[str, Any], prefix: str = "") -> list[tuple[str, str, str]]:
    rows = []
    for key, value in section.items():
        if isinstance(value, dict) and "value" in value:
            text = f"{value['value']} {value.get('unit', '')}".strip()
            rows.append((f"`{prefix}{key}`", text, str(value.get("source", "")).replace("|", "\\|")))
        elif isinstance(value, dict):
            rows += _numbers(value, f"{prefix}{key}.")
    return rows
