"""What the registry knows of a kind of fault, and a fault in its place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from gearsim_io.errors import InputError
from gearsim_io.quantities import validate
from gearsim_sim.events import FaultSpec
from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.plant import Plant

MAX_SEVERITY = 2.0


@dataclass(frozen=True, eq=False)
class Fault:
    """A fault in place, ready for the integrator; `severity` scales all its contributions."""

    name: str
    kind: str
    component: str
    params: BaseModel
    contributions: tuple[Contribution, ...]
    severity: float

    def same_but_severity(self, other: Fault) -> bool:
        """Whether it is the same fault, perhaps of another severity."""
        mine = (self.kind, self.component, self.params)
        return mine == (other.kind, other.component, other.params)


@dataclass(frozen=True, eq=False)
class FaultKind:
    """An entry of the registry.

    Attributes
    ----------
    name, summary : str
    params_model : type
        Its parameters with units, ranges and defaults.
    components : callable
        Names of the plant's components that can have it.
    place : callable
        (parameters, component, plant, seed) -> contributions; raises InputError for what cannot be.
    look_for : str
        What an analyst sees of it in waveform, spectrum and envelope spectrum; the gallery prints it.
    """

    name: str
    summary: str
    params_model: type[BaseModel]
    components: Callable[[Plant], tuple[str, ...]]
    place: Callable[[Any, str, Plant, int], tuple[Contribution, ...]]
    look_for: str = ""

    def build(self, spec: FaultSpec, plant: Plant, seed: int = 0) -> Fault:
        """The fault in place.

        Parameters
        ----------
        spec : FaultSpec
        plant : Plant
        seed : int
            Of the run; faults with a random shape draw it from this and their name.

        Raises
        ------
        InputError
            For an unknown component or parameter, or what is physically impossible.
        """
        where = f"fault {spec.name}"
        known = self.components(plant)
        if spec.component not in known:
            expected = (
                "one of " + ", ".join(known)
                if known
                else f"another machine; none of its parts has {self.name}"
            )
            raise InputError(where, "component", spec.component, expected)
        if not 0 <= spec.severity <= MAX_SEVERITY:
            raise InputError(where, "severity", spec.severity, f"0 to {MAX_SEVERITY:g}")
        params = validate(self.params_model, spec.params, where)
        try:
            contributions = self.place(params, spec.component, plant, seed)
        except InputError as error:
            raise InputError(where, error.field, error.value, error.expected) from None
        return Fault(spec.name, spec.kind, spec.component, params, contributions, spec.severity)


def bearing_names(plant: Plant) -> tuple[str, ...]:
    """Components of faults that sit in a bearing."""
    return tuple(seat.name for seat in plant.bearings)
