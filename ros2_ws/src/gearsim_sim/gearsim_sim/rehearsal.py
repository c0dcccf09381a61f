"""A scenario gone through without a run: what its machine cannot do is told before anything is compiled."""

from __future__ import annotations

from gearsim_io.errors import InputError
from gearsim_sim.model.plants import make_plant
from gearsim_sim.models import parameters
from gearsim_sim.scenario import Scenario
from gearsim_sim.timeline import Timeline

__all__ = ["rehearse"]


def rehearse(scenario: Scenario) -> None:
    """Build the machine and place every fault that is there or comes, as a run does.

    Raises
    ------
    InputError
        As the run would: the scenario, the fault and its parameter, and what is possible.
    """
    try:
        plant = scenario.operation.machine(make_plant(parameters(scenario), scenario.seed))
        timeline = Timeline(plant, scenario.seed, scenario.sample_rate_hz, 1)
        for fault in scenario.faults:
            timeline.initial_fault(fault, 0)
    except InputError as error:
        if scenario.source in error.where:
            raise
        where = f"{scenario.source}: {error.where}"
        raise InputError(where, error.field, error.value, error.expected) from None
    for event in scenario.events:
        try:
            timeline.add(event, 0)
        except InputError as error:
            at_s = (event.at_sample or 0) / scenario.sample_rate_hz
            where = f"{scenario.source}: timeline, at {at_s:g} s: {error.where}"
            raise InputError(where, error.field, error.value, error.expected) from None
