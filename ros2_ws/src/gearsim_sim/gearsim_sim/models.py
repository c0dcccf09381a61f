"""The models that a scenario can name: each turns a scenario into something that runs.

What a model needs is imported when it is made: a scenario must be read, and refused, without the wait.
"""

from __future__ import annotations

import json
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, Protocol

from gearsim_sim.events import Event, FaultSpec
from gearsim_sim.frf.sites import place_of

if TYPE_CHECKING:
    from gearsim_sim.engine import EngineOutput
    from gearsim_sim.scenario import Scenario


class RunningModel(Protocol):
    """What the rig needs of a model; `gearsim_sim.engine.Engine` says what each part means."""

    @property
    def next_sample(self) -> int:
        """Index of the first sample that the next `advance` returns."""
        ...

    @property
    def earliest_event_sample(self) -> int:
        """Earliest sample at which an event may start now."""
        ...

    def warm_up(self, *, events: bool = False) -> None:
        """Compile what is needed, with `events` what only events bring, too."""
        ...

    def advance(self, n: int, events: Sequence[Event] = ()) -> EngineOutput:
        """The next `n` samples."""
        ...

    def set_operating_point(
        self,
        speed_hz: float | None = None,
        load_nm: float | None = None,
        ramp_s: float = 1.0,
        at_sample: int | None = None,
    ) -> int:
        """Schedule another operating point; returns its sample."""
        ...

    def inject(self, fault: FaultSpec, ramp_s: float = 0.1, at_sample: int | None = None) -> int:
        """Schedule a fault; returns its sample."""
        ...

    @property
    def steady(self) -> bool:
        """Whether speed and load change by events only."""
        ...

    def operating_point_at(self, sample: int) -> tuple[float, float]:
        """Speed [Hz] and load [N m] at a sample that has been handed out."""
        ...

    def clear(self, fault_id: str = "", ramp_s: float = 0.1, at_sample: int | None = None) -> int:
        """Schedule the end of a fault; returns its sample."""
        ...


def _parallel_shaft(scenario: Scenario, *, pedestals: bool) -> Any:
    from gearsim_sim.params.parallel import load_parallel_params

    params = load_parallel_params(scenario.machine_path, scenario.parameters, scenario.source)
    return params.model_copy(update={"pedestals": pedestals})


def _in_casing(scenario: Scenario, *, finite: bool) -> Any:
    from gearsim_sim.params.casing_gearbox import load_casing_gearbox_params

    return load_casing_gearbox_params(
        scenario.machine_path, scenario.parameters, scenario.source, finite=finite
    )


def _planetary(scenario: Scenario) -> Any:
    from gearsim_sim.params.planetary import load_planetary_params

    return load_planetary_params(scenario.machine_path, scenario.parameters, scenario.source)


def _planetary_in_casing(scenario: Scenario) -> Any:
    from gearsim_sim.params.planetary_casing import load_planetary_casing_params

    return load_planetary_casing_params(scenario.machine_path, scenario.parameters, scenario.source)


def _bearing_rig(scenario: Scenario, *, dofs: Literal[2, 4, 5]) -> Any:
    from gearsim_sim.params.bearing_rig import load_bearing_rig_params

    params = load_bearing_rig_params(scenario.machine_path, scenario.parameters, scenario.source)
    return params.with_dofs(dofs)


_PARAMETERS: Mapping[str, Callable[[Scenario], Any]] = {
    "bearing2": partial(_bearing_rig, dofs=2),
    "bearing4": partial(_bearing_rig, dofs=4),
    "bearing5": partial(_bearing_rig, dofs=5),
    "lpm22": partial(_parallel_shaft, pedestals=False),
    "lpm34": partial(_parallel_shaft, pedestals=True),
    "planetary18": _planetary,
    "cb146": partial(_in_casing, finite=False),
    "cb182": partial(_in_casing, finite=True),
    "planetary_cb": _planetary_in_casing,
}


# Those that read nothing but the machine's own file.
_OF_ONE_FILE = frozenset({"bearing2", "bearing4", "bearing5", "lpm22", "lpm34", "planetary18"})
_MOST_KEPT = 64
_kept: OrderedDict[tuple[Any, ...], Any] = OrderedDict()


def parameters(scenario: Scenario) -> Any:
    """Parameters of the machine that a scenario runs, with what it replaces; immutable.

    They are kept as long as the machine's file stays the same: reading and checking them takes longer than
    a short simulation.
    """
    if scenario.model not in _OF_ONE_FILE:
        return _PARAMETERS[scenario.model](scenario)
    file = scenario.machine_path.stat()
    given = json.dumps(scenario.parameters, sort_keys=True, default=repr)
    key = (scenario.model, scenario.machine_path, file.st_mtime_ns, file.st_size, scenario.source, given)
    found = _kept.pop(key, None)
    if found is None:
        found = _PARAMETERS[scenario.model](scenario)
    _kept[key] = found
    while len(_kept) > _MOST_KEPT:
        _kept.popitem(last=False)
    return found


def _engine(scenario: Scenario) -> RunningModel:
    from gearsim_sim.engine import Engine

    params = parameters(scenario)
    looked_at = [site for row in scenario.sensors.accelerometers for site, _ in row.looks_at]
    through = [place for site in looked_at if (place := place_of(site)) is not None]
    responses = None
    if through:
        from gearsim_sim.frf.of_machine import machine_responses

        responses = machine_responses(params)
    engine = Engine(
        params,
        scenario.seed,
        scenario.sample_rate_hz,
        scenario.oversampling,
        scenario.faults,
        speed_hz=None if scenario.operation.profile.trace else scenario.speed_hz,
        load_nm=scenario.load_nm,
        operation=scenario.operation,
        looked_at=[site for site in looked_at if place_of(site) is None],
        forces=bool(through),
        settling=bool(through),
    )
    if responses is None:
        return engine
    from gearsim_sim.frf.model import ResponseModel

    return ResponseModel(engine, responses, through)


MODELS: Mapping[str, Callable[[Scenario], RunningModel]] = dict.fromkeys(_PARAMETERS, _engine)
