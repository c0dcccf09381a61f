"""What may be asked of a running engine: a new operating point, a fault to begin, a fault to end."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class FaultSpec:
    """A fault as asked for; checked against the machine when it is injected.

    Parameters
    ----------
    kind : str
        A key of `gearsim_sim.model.faults.REGISTRY`, such as "outer_race_spall".
    component : str
        Bearing that carries it, such as "bearing_3".
    params : dict
        Parameters of the kind. Keys carry the unit; values are SI numbers or texts with a unit:
        `{"width_m": 8e-4}` or `{"width_m": "0.8 mm"}`. What is left out takes the kind's default.
    severity : float
        Factor on the fault's geometry, 0 (bitwise healthy) to 2; 1 is the full fault.
    fault_id : str
        Name for later clearing; empty means "<component>/<kind>".
    """

    kind: str
    component: str
    params: dict[str, Any] = field(default_factory=dict)
    severity: float = 1.0
    fault_id: str = ""

    @property
    def name(self) -> str:
        """The name under which the fault runs."""
        return self.fault_id or f"{self.component}/{self.kind}"


@dataclass(frozen=True, slots=True)
class SetOperatingPoint:
    """Ramp to another speed and load; None keeps the present value."""

    speed_hz: float | None = None
    load_nm: float | None = None
    ramp_s: float = 1.0
    at_sample: int | None = None


@dataclass(frozen=True, slots=True)
class Inject:
    """Let a fault grow from zero (or from its present severity) within `ramp_s`."""

    fault: FaultSpec
    ramp_s: float = 0.1
    at_sample: int | None = None


@dataclass(frozen=True, slots=True)
class Clear:
    """Let a fault shrink to zero within `ramp_s`; an empty `fault_id` means all faults."""

    fault_id: str = ""
    ramp_s: float = 0.1
    at_sample: int | None = None


Event = SetOperatingPoint | Inject | Clear
