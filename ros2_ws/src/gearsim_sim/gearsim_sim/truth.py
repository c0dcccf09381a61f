"""What the simulator really runs, mirroring `gearsim_msgs/GroundTruth`.

For scoring a diagnosis; a diagnosis never reads it.
"""

from __future__ import annotations

import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from gearsim_io.quantities import validate
from gearsim_sim import __version__
from gearsim_sim.events import Event, FaultSpec
from gearsim_sim.model.faults import fault_kind


@dataclass(frozen=True, slots=True)
class FaultTruth:
    """A fault that runs since `since_sample`; `parameters` are SI numbers with the unit in the key."""

    fault_id: str
    kind: str
    component: str
    parameters: Mapping[str, Any]
    since_sample: int


@dataclass(frozen=True, slots=True)
class GroundTruth:
    """What holds from `sample` on.

    Attributes
    ----------
    t0_ns : int
        Time of `sample` in the stream.
    sample : int
        Sample index from which the rest holds.
    scenario, seed, version
        What produced the stream; `version` is the commit if it runs from a checkout.
    speed_hz, load_nm : float
        Commanded operating point (the target, where it is ramped to); under a profile that varies by
        itself, what it is at `sample`.
    faults : tuple of FaultTruth
        A fault counts from the start of its growth to the end of its ramp down.
    events : tuple of Event
        Everything that was asked for up to now and later, with its sample index: a run of the same
        scenario with these events in place of its own gives the same stream bit for bit.
    """

    t0_ns: int
    sample: int
    scenario: str
    seed: int
    speed_hz: float
    load_nm: float
    faults: tuple[FaultTruth, ...]
    version: str
    frame_id: str = ""
    events: tuple[Event, ...] = ()


def fault_parameters(spec: FaultSpec) -> dict[str, Any]:
    """All parameters of a fault, defaults included, as SI numbers with the unit in the key.

    Raises
    ------
    InputError
        An unknown kind, an unknown parameter, or a value that is out of range or has the wrong unit.
    """
    model = fault_kind(spec.kind).params_model
    checked = validate(model, spec.params, f"fault {spec.name}")
    return {**checked.model_dump(exclude_none=True), "severity": spec.severity}


@cache
def version() -> str:
    """The commit of the checkout that the package runs from, else the package's version."""
    root = Path(__file__).resolve().parents[4]
    if not (root / ".git").exists():
        return __version__
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=12"]
    try:
        found = subprocess.run(command, capture_output=True, text=True, timeout=5, check=True)
    except (OSError, subprocess.SubprocessError):
        return __version__
    return found.stdout.strip() or __version__
