"""What the gallery shows: for every kind of fault the shipped scenario that has it, with and without it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from gearsim_io.errors import InputError
from gearsim_sim.events import FaultSpec, Inject
from gearsim_sim.model.faults import REGISTRY, fault_kind
from gearsim_sim.scenario import Scenario, load_scenario, scenario_names
from gearsim_sim.sensors.rows import Row, SensorTable, Tacho

IN_CASINGS = ("casing_inner", "casing_outer")
"""Scenarios in a flexible casing that are shown beside the kinds of faults."""


@dataclass(frozen=True)
class Case:
    """A kind of fault, and two scenarios that differ by nothing else."""

    name: str  # of its section and picture: the kind, or a scenario of `IN_CASINGS`
    kind: str
    example: str  # name of the shipped scenario
    faulty: Scenario  # the fault is there from the start
    healthy: Scenario
    component: str


def cases(only: tuple[str, ...] = ()) -> list[Case]:
    """One case for each kind, in the order of the registry, then those of `IN_CASINGS`.

    Parameters
    ----------
    only : tuple of str
        Names of cases to show; all if empty.

    Raises
    ------
    InputError
        An unknown kind, or a kind that no shipped scenario shows.
    """
    check_names(only)
    scenarios = [load_scenario(name) for name in scenario_names()]
    return [_named(name, scenarios) for name in only or (*REGISTRY, *IN_CASINGS)]


def check_names(only: tuple[str, ...]) -> None:
    """InputError unless all are names of cases."""
    for name in only:
        if name not in IN_CASINGS:
            fault_kind(name)


def faults_of(scenario: Scenario) -> list[FaultSpec]:
    """All faults that a scenario brings, from the start or later."""
    injected = [event.fault for event in scenario.events if isinstance(event, Inject)]
    return [*scenario.faults, *injected]


def _named(name: str, scenarios: list[Scenario]) -> Case:
    if name not in IN_CASINGS:
        return _case(name, scenarios)
    example = next(one for one in scenarios if one.name == name)
    (fault,) = faults_of(example)
    return _pair(name, fault.kind, example)


def _case(kind: str, scenarios: list[Scenario]) -> Case:
    showing = [one for one in scenarios if any(fault.kind == kind for fault in faults_of(one))]
    if not showing:
        raise InputError("gallery", "only", kind, "a kind that a shipped scenario shows")
    # Named after the kind, else that with the fewest other faults; flexible casings come last.
    example = min(
        showing,
        key=lambda one: (
            one.name != kind,
            one.model in ("cb146", "cb182", "planetary_cb"),
            len(faults_of(one)),
            one.name,
        ),
    )
    return _pair(kind, kind, example)


def _pair(name: str, kind: str, example: Scenario) -> Case:
    """The scenario with its faults of a kind, and without them."""
    mine = [fault for fault in faults_of(example) if fault.kind == kind]
    others = tuple(fault for fault in example.faults if fault.kind != kind)
    quiet = dataclasses.replace(example.with_events([]), sensors=_ideal(example.sensors))
    return Case(
        name=name,
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
