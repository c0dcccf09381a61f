"""Scenarios: which machine runs how, what happens to it when, and what measures it.

A scenario is a YAML file, shipped under a name in `gearsim_sim/scenarios` or of one's own. Every mistake in
it is an InputError that names the file, the key, what was found and what is expected.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, model_validator

from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine, machine_file
from gearsim_io.nameplate import Channel, Machine
from gearsim_io.places import entry
from gearsim_io.quantities import Si, Strict, read_yaml, validate
from gearsim_sim.events import Clear, Event, FaultSpec, Inject, SetOperatingPoint
from gearsim_sim.model.structure import StructureModel
from gearsim_sim.models import MODELS
from gearsim_sim.profile.settings import ProfileModel
from gearsim_sim.sensors.rows import SensorTable
from gearsim_sim.sensors.settings import SensorsModel
from gearsim_sim.sensors.table import sensor_table

if TYPE_CHECKING:
    from gearsim_sim.operation import Operation

FOLDER = Path(__file__).parent / "scenarios"
# Fast DDS passes messages through shared memory only up to its segment size; larger ones are lost under load.
_MOST_BATCH_BYTES = 480_000

Seconds = Annotated[float, Si("s", ge=0, le=1e6)]
Speed = Annotated[float, Si("Hz", ge=0, le=500)]
Load = Annotated[float, Si("N*m", ge=0, le=1e5)]


class OperatingPointModel(Strict):
    """Speed of the reference shaft and load torque at the start.

    Under a law of torques it is what is to be reached; beside a measured trace there is no speed here, and
    no load where the trace has one.
    """

    speed: Speed | None = None
    """Speed of the reference shaft at the start; under a law of torques that to be reached."""
    load: Load | None = None
    """Load torque at the start; may be left out where a measured trace gives the load."""


class FaultModel(Strict):
    """A fault; `params` have the unit in the key, such as `{width_m: 0.8 mm}`."""

    kind: str = Field(min_length=1)
    """Kind of fault, such as `outer_race_spall`."""
    component: str = Field(min_length=1)
    """Component that has it, such as `bearing_3`."""
    params: dict[str, Any] = Field(default_factory=dict)
    """Parameters of the kind."""
    severity: Annotated[float, Si("", ge=0, le=2)] = 1.0
    """Factor on the fault; 0 is healthy, 1 the full fault."""
    id: str = ""
    """Name to clear it by; `component/kind` if left out."""

    def spec(self) -> FaultSpec:
        """As the engine takes it."""
        return FaultSpec(self.kind, self.component, dict(self.params), self.severity, self.id)


class InjectModel(FaultModel):
    """A fault that begins and grows within `ramp`."""

    ramp: Seconds = 0.1
    """Time in which the fault grows."""


class SetModel(Strict):
    """Another operating point, reached within `ramp`."""

    speed: Speed | None = None
    """Speed to go to; as it is if left out."""
    load: Load | None = None
    """Load to go to; as it is if left out."""
    ramp: Seconds = 1.0
    """Time that it takes."""


class ClearModel(Strict):
    """The end of a fault (of all without `id`) within `ramp`."""

    id: str = ""
    """Fault to end; all if left out."""
    ramp: Seconds = 0.1
    """Time in which it fades."""


class EventModel(Strict):
    """Something that happens at a time of the stream."""

    at: Seconds
    """Time of the stream."""
    inject: InjectModel | None = None
    set: SetModel | None = None
    clear: ClearModel | None = None

    @model_validator(mode="after")
    def _just_one(self) -> EventModel:
        if sum(part is not None for part in (self.inject, self.set, self.clear)) != 1:
            raise ValueError("one of inject, set, clear beside at")
        return self

    def event(self, rate_hz: float) -> Event:
        """As the engine takes it, at the nearest sample."""
        sample = round(self.at * rate_hz)
        if self.inject is not None:
            return Inject(self.inject.spec(), self.inject.ramp, sample)
        if self.set is not None:
            return SetOperatingPoint(self.set.speed, self.set.load, self.set.ramp, sample)
        assert self.clear is not None
        return Clear(self.clear.id, self.clear.ramp, sample)


class ScenarioModel(Strict):
    """The file."""

    description: str = ""
    """What the scenario shows, for people."""
    machine: str = "unsw_parallel"
    """Shipped machine description, or path of one."""
    model: str = "lpm34"
    """Model that simulates it."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    """Of all random numbers."""
    sample_rate: Annotated[float, Si("Hz", ge=1000, le=2e6)] = 65536.0
    """Rate of the accelerometers."""
    oversampling: Annotated[int, Field(ge=2, le=16)] = 4
    """Integration steps per sample."""
    batch_samples: Annotated[int, Field(ge=16, le=65536)] = 4096
    """Samples per message."""
    rate_factor: Annotated[float, Si("", ge=0, le=1000)] = 1.0
    """Pace of the live rig in times of real time; 0 is as fast as it goes."""
    operating_point: OperatingPointModel = OperatingPointModel()
    profile: ProfileModel = ProfileModel()
    structure: StructureModel = StructureModel()
    sensors: SensorsModel = SensorsModel()
    parameters: dict[str, Any] = Field(default_factory=dict)
    """Dotted names of the machine's `model` section with other values; also dimensions of bearings that are
    not as the nameplate says, such as `nameplate.bearings.bearing_3.element_diameter`."""
    faults: tuple[FaultModel, ...] = ()
    timeline: tuple[EventModel, ...] = ()


@dataclass(frozen=True, slots=True)
class Scenario:
    """A checked scenario in SI units; build one by `load_scenario`.

    Attributes
    ----------
    name, source : str
        Name, and the file that it came from.
    machine : Machine
        Nameplate, with the channels of the sensor table.
    machine_path : Path
        Description of the machine, for the model's parameters.
    speed_hz, load_nm : float
        Operating point at the start; under a law of torques the speed to be reached.
    operation : Operation
        Operating profile and added structure.
    parameters : mapping
        Dotted names of model parameters and the values that replace those of the machine description.
    faults : tuple of FaultSpec
        Present from sample 0.
    events : tuple of Event
        What happens later, by ascending `at_sample`.
    """

    name: str
    description: str
    source: str
    machine: Machine
    machine_path: Path
    model: str
    seed: int
    sample_rate_hz: float
    oversampling: int
    batch_samples: int
    rate_factor: float
    speed_hz: float
    load_nm: float
    operation: Operation
    sensors: SensorTable
    parameters: Mapping[str, Any]
    faults: tuple[FaultSpec, ...]
    events: tuple[Event, ...]

    def with_events(self, events: Sequence[Event]) -> Scenario:
        """The same with other events, such as those of a live run's `GroundTruth.events`."""
        return dataclasses.replace(self, events=tuple(sorted(events, key=lambda event: event.at_sample or 0)))


def scenario_names() -> tuple[str, ...]:
    """Names of the shipped scenarios."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.yaml")))


def scenario_summary(name: str) -> str:
    """What a shipped scenario shows, in one line; its file is not checked."""
    return " ".join(str(read_yaml(scenario_file(name)).get("description", "")).split())


def scenario_file(name_or_path: str | Path) -> Path:
    """The file of a scenario: a shipped name, or the path of a YAML file; InputError if it is neither."""
    text = str(name_or_path)
    shipped = FOLDER / f"{text}.yaml"
    if "/" not in text and shipped.is_file():
        return shipped
    path = Path(name_or_path)
    if path.suffix in (".yaml", ".yml") and path.is_file():
        return path
    if path.suffix in (".yaml", ".yml"):
        raise InputError("scenario", "", text, "a file that exists")
    known = ", ".join(scenario_names())
    raise InputError("scenario", "", text, f"one of {known}, or the path of a .yaml file")


def load_scenario(name_or_path: str | Path, changes: Mapping[str, Any] | None = None) -> Scenario:
    """The scenario of that name or file.

    Parameters
    ----------
    name_or_path : str or Path
        A shipped name (see `scenario_names`) or the path of a YAML file.
    changes : mapping, optional
        Top-level keys that replace those of the file, such as `{"seed": 2}`.

    Raises
    ------
    InputError
        Naming file, key, what was found and what is expected.
    """
    path = scenario_file(name_or_path)
    content = read_yaml(path)
    if changes and isinstance(content, dict):
        content = {**content, **changes}
    return parse_scenario(content, path)


def parse_scenario(content: Any, path: Path) -> Scenario:
    """The content of a scenario file as a scenario; `path` names it and is where relative paths start."""
    where = str(path)
    if not isinstance(content, dict):
        raise InputError(where, "", content, "a mapping of scenario keys")
    model = validate(ScenarioModel, content, where)
    if model.model not in MODELS:
        raise InputError(where, "model", model.model, "one of " + ", ".join(sorted(MODELS)))
    machine_path = _machine_path(model.machine, path)
    machine = load_machine(machine_path)
    table = sensor_table(model.sensors, machine, where)
    _check_batch(model.batch_samples, len(table.accelerometers), where)
    faults = tuple(
        _fault(fault, f"{where}: {entry('faults', k, len(model.faults))}")
        for k, fault in enumerate(model.faults)
    )
    events = []
    for number, event in enumerate(model.timeline):
        if event.inject is not None:
            _fault(event.inject, f"{where}: {entry('timeline', number, len(model.timeline))}.inject")
        events.append(event.event(model.sample_rate))
    operation = _operation(model, path)
    return Scenario(
        name=path.stem,
        description=model.description,
        source=where,
        machine=_measured(machine, table),
        machine_path=machine_path,
        model=model.model,
        seed=model.seed,
        sample_rate_hz=model.sample_rate,
        oversampling=model.oversampling,
        batch_samples=model.batch_samples,
        rate_factor=model.rate_factor,
        speed_hz=operation.first_speed_hz(model.operating_point.speed),
        load_nm=operation.first_load_nm(model.operating_point.load),
        operation=operation,
        sensors=table,
        parameters=model.parameters,
        faults=faults,
        events=(),
    ).with_events(events)


def _operation(model: ScenarioModel, path: Path) -> Operation:
    from gearsim_sim.operation import Operation  # here and last, because it takes long to load

    return Operation(model.profile, model.structure, str(path), path.parent)


def _fault(fault: FaultModel, where: str) -> FaultSpec:
    from gearsim_sim.truth import fault_parameters  # here, because all kinds of faults take long to load

    spec = fault.spec()
    try:
        fault_parameters(spec)
    except InputError as error:
        raise InputError(where, error.field, error.value, error.expected) from None
    return spec


def _machine_path(name: str, scenario_path: Path) -> Path:
    beside = scenario_path.parent / name
    if beside.suffix in (".yaml", ".yml") and beside.is_file():
        return beside
    return machine_file(name)


def _measured(machine: Machine, table: SensorTable) -> Machine:
    """The nameplate of the machine with the sensors that the scenario puts on it."""
    known = {channel.name: channel for channel in machine.channels}
    channels = tuple(
        dataclasses.replace(
            known.get(row.channel, Channel(row.channel)),
            axis=row.axis,
            unit="m/s^2",
            full_scale=math.nan if row.full_scale is None else row.full_scale,
        )
        for row in table.accelerometers
    )
    names = {channel.name for channel in channels}
    bearings = tuple(
        dataclasses.replace(bearing, channels=tuple(name for name in bearing.channels if name in names))
        for bearing in machine.bearings
    )
    return dataclasses.replace(
        machine,
        channels=channels,
        bearings=bearings,
        tacho_shafts=tuple(tacho.shaft for tacho in table.tachos),
        encoder_shafts=tuple(encoder.shaft for encoder in table.encoders),
    )


def _check_batch(batch_samples: int, channels: int, where: str) -> None:
    most = _MOST_BATCH_BYTES // (4 * channels)
    if batch_samples > most:
        expected = f"at most {most}, so that a message of {channels} channels passes through shared memory"
        raise InputError(where, "batch_samples", batch_samples, expected)
