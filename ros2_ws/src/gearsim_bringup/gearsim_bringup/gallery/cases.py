"""What the gallery shows: for every kind of fault the shipped scenario that has it, with and without it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from gearsim_io.errors import InputError
from gearsim_sim.events import FaultSpec, Inject
from gearsim_sim.model.faults import REGISTRY, fault_kind
from gearsim_sim.scenario import Scenario, load_scenario, scenario_names
from gearsim_sim.sensors.rows import Row, SensorTable, Tacho


@dataclass(frozen=True)
class Case:
    """A kind of fault, and two scenarios that differ by nothing else."""

    kind: str
    example: str  # name of the shipped scenario
    faulty: Scenario  # the fault is there from the start
    healthy: Scenario
    component: str


def cases(only: tuple[str, ...] = ()) -> list[Case]:
    """One case for each kind, in the order of the registry.

    Parameters
    ----------
    only : tuple of str
        Kinds to show; all if empty.

    Raises
    ------
    InputError
        An unknown kind, or a kind that no shipped scenario shows.
    """
    for kind in only:
        fault_kind(kind)
    scenarios = [load_scenario(name) for name in scenario_names()]
    return [_case(kind, scenarios) for kind in only or REGISTRY]


def faults_of(scenario: Scenario) -> list[FaultSpec]:
    """All faults that a scenario brings, from the start or later."""
    injected = [event.fault for event in scenario.events if isinstance(event, Inject)]
    return [*scenario.faults, *injected]


def _case(kind: str, scenarios: list[Scenario]) -> Case:
    showing = [one for one in scenarios if any(fault.kind == kind for fault in faults_of(one))]
    if not showing:
        raise InputError("gallery", "only", kind, "a kind that a shipped scenario shows")
    # Named after the kind, else that with the fewest other faults; flexible casings come last.
    example = min(
        showing,
        key=lambda one: (one.name != kind, one.model in ("cb146", "cb182"), len(faults_of(one)), one.name),
    )
    mine = [fault for fault in faults_of(example) if fault.kind == kind]
    others = tuple(fault for fault in example.faults if fault.kind != kind)
    quiet = dataclasses.replace(example.with_events([]), sensors=_ideal(example.sensors))
    return Case(
        kind=kind,
        example=example.name,
        faulty=dataclasses.replace(quiet, faults=(*others, *mine)),
        healthy=dataclasses.replace(quiet, faults=others),
        component=mine[0].component,
    )


def _ideal(table: SensorTable) -> SensorTable:
    """The same accelerometers without any error of their own, and no other sensors but tachos."""
    rows = tuple(Row(row.channel, row.site, row.axis) for row in table.accelerometers)
    return SensorTable(rows, tuple(Tacho(one.shaft) for one in table.tachos), ())
