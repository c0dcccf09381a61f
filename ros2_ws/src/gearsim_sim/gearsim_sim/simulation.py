"""A scenario that runs: physics, sensors and what happens on the way, as the batches that the rig sends.

The same scenario, seed and events give the same batches bit for bit: live or offline, and however the
samples are asked for. `truth().events` of a live run is all that is needed to repeat it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TypeVar

import numpy as np

from gearsim_io.batches import EncoderBatch, SampleBatch, TachoBatch, TorqueBatch
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine
from gearsim_io.record import EdgeTrain, PulseTrain, Record, Torques
from gearsim_sim.engine import MAX_RATE_HZ
from gearsim_sim.events import Clear, Event, FaultSpec, Inject, SetOperatingPoint
from gearsim_sim.history import History
from gearsim_sim.models import MODELS, RunningModel
from gearsim_sim.rehearsal import rehearse
from gearsim_sim.scenario import Scenario
from gearsim_sim.sensors.rig import Batch, RigSensors
from gearsim_sim.sensors.rows import Encoder, Tacho
from gearsim_sim.truth import GroundTruth

_T = TypeVar("_T")
_LEAST_OVERSAMPLING = 2  # steps per sample that the integrator needs


class Simulation:
    """A running rig.

    Parameters
    ----------
    scenario : Scenario
    t0_ns : int
        Time of sample 0; stamps are t0 + sample / rate.
    model : RunningModel, optional
        In place of the one that the scenario names; it works at the sample rate times the sensors'
        `sampling.oversampling`.

    Raises
    ------
    InputError
        What the scenario asks for does not fit the machine.
    """

    def __init__(self, scenario: Scenario, t0_ns: int = 0, model: RunningModel | None = None) -> None:
        self.scenario = scenario
        self.t0_ns = t0_ns
        self._factor = scenario.sensors.sampling.oversampling
        if model is None:
            _told(scenario, lambda: rehearse(scenario))
        self._model = model or _told(scenario, lambda: _model(scenario))
        self._history = History(scenario, None if self._model.steady else self._model.operating_point_at)
        for event in scenario.events:
            try:
                self._schedule(event)
            except InputError as error:
                at_s = (event.at_sample or 0) / scenario.sample_rate_hz
                where = f"{scenario.source}: timeline, at {at_s:g} s: {error.where}"
                raise InputError(where, error.field, error.value, error.expected) from None
        self._requested = 0
        self._sent = 0
        self._finished = False
        first = _told(scenario, lambda: self._model.advance(self._factor))  # tells sites and shafts
        self._sensors = _told(scenario, lambda: RigSensors(scenario, first))

    @property
    def machine(self) -> Machine:
        """Nameplate, with the channels, tachos and encoders that this rig has."""
        return self.scenario.machine

    @property
    def samples_sent(self) -> int:
        """Samples of the batches handed out so far."""
        return self._sent

    @property
    def seconds_sent(self) -> float:
        """Their duration."""
        return self._sent / self.scenario.sample_rate_hz

    def warm_up(self) -> None:
        """Compile all that any event may bring; for a live stream, before it starts."""
        self._model.warm_up(events=True)

    def advance(self, n_samples: int) -> list[Batch]:
        """Run so many samples further and hand out the batches that are complete.

        Batches begin at multiples of the scenario's `batch_samples`, whatever the portions; samples of an
        incomplete batch wait for the next call or for `finish`. Of each stretch the SampleBatch comes
        first, then one TachoBatch per tacho, then one EncoderBatch per encoder, then a TorqueBatch if
        torques are measured.
        """
        if self._finished:
            raise RuntimeError("the simulation has been finished")
        self._requested += n_samples
        batches: list[Batch] = []
        window, factor = self._sensors.window, self._factor
        while (missing := self._requested + window.ahead - window.head) > 0:
            window.put(self._model.advance(min(missing, window.room) * factor))
            if window.room == 0:
                batches += self._send(window.batch)
        return batches

    def finish(self) -> list[Batch]:
        """End the run: the samples that were asked for and not yet handed out, as a shorter batch."""
        self._finished = True
        left = self._requested - self._sent
        return self._send(left) if left > 0 else []

    def set_operating_point(
        self, speed_hz: float | None = None, load_nm: float | None = None, ramp_s: float = 1.0
    ) -> int:
        """Change speed (of the reference shaft) and load as soon as possible; returns the first sample.

        None keeps the present value. Raises InputError if the machine cannot run so.
        """
        return self._schedule(SetOperatingPoint(speed_hz, load_nm, ramp_s))

    def inject(self, fault: FaultSpec, ramp_s: float = 0.1) -> int:
        """Let a fault grow as soon as possible; returns its first sample. InputError if it cannot be."""
        return self._schedule(Inject(fault, ramp_s))

    def clear(self, fault_id: str = "", ramp_s: float = 0.1) -> int:
        """Let a fault (all if empty) shrink as soon as possible; returns the first sample of that.

        InputError if no fault of that name runs.
        """
        return self._schedule(Clear(fault_id, ramp_s))

    def truth(self, sample: int | None = None) -> GroundTruth:
        """What holds at a sample (default: the last one handed out)."""
        return self._history.truth(max(0, self._sent - 1) if sample is None else sample, self.t0_ns)

    def truths(self, after: int, upto: int) -> list[GroundTruth]:
        """What holds from each change on, for the changes at after < sample <= upto."""
        return [self.truth(sample) for sample in self._history.changes(after, upto)]

    def _schedule(self, event: Event) -> int:
        """Let the model do something; samples here are those of the batches, not those of the model."""
        factor, model = self._factor, self._model
        sample = event.at_sample
        if sample is None and factor > 1:  # a sample of the batches, so that the run can be repeated
            sample = -(-model.earliest_event_sample // factor)
        at = None if sample is None else sample * factor
        if isinstance(event, Inject):
            at = model.inject(event.fault, event.ramp_s, at)
        elif isinstance(event, Clear):
            at = model.clear(event.fault_id, event.ramp_s, at)
        else:
            at = model.set_operating_point(event.speed_hz, event.load_nm, event.ramp_s, at)
        sample = at // factor
        self._history.add(event, sample)
        return sample

    def _send(self, count: int) -> list[Batch]:
        first = self._sent
        t0_ns = self.t0_ns + round(first * 1e9 / self.scenario.sample_rate_hz)
        self._sent += count
        return self._sensors.read(first, count, t0_ns)


def _model(scenario: Scenario) -> RunningModel:
    """The model of a scenario, at the rate at which its sensors work."""
    factor = scenario.sensors.sampling.oversampling
    if factor > 1:
        most = int(MAX_RATE_HZ // scenario.sample_rate_hz)
        if factor > most:
            where = f"{scenario.source}: sensors.accelerometers"
            expected = f"at most {most}, so that the sensors work at {MAX_RATE_HZ:g} Hz or less"
            raise InputError(where, "sampling.oversampling", factor, expected)
        scenario = replace(
            scenario,
            sample_rate_hz=scenario.sample_rate_hz * factor,
            oversampling=max(_LEAST_OVERSAMPLING, -(-scenario.oversampling // factor)),
        )
    return MODELS[scenario.model](scenario)


def _told(scenario: Scenario, act: Callable[[], _T]) -> _T:
    """What `act` gives; what the physics refuses is told as a mistake in the scenario."""
    try:
        return act()
    except InputError as error:
        if scenario.source in error.where:
            raise
        where = f"{scenario.source}: {error.where}"
        raise InputError(where, error.field, error.value, error.expected) from None
    except (ValueError, ArithmeticError) as error:
        if not scenario.parameters:
            raise
        expected = f"numbers that the model can be solved with ({error})"
        raise InputError(scenario.source, "parameters", dict(scenario.parameters), expected) from None


def simulate(
    scenario: Scenario,
    seconds: float,
    t0_ns: int = 0,
    model: RunningModel | None = None,
    between: Callable[[], None] = lambda: None,
) -> Iterator[Batch]:
    """The batches of a whole run as fast as they can be made: round(seconds x rate) samples.

    The last batch is shorter if need be. Parameters as for `Simulation`; `between` is called before each
    batch, and may end the run by an exception.
    """
    simulation = Simulation(scenario, t0_ns, model)
    total = round(seconds * scenario.sample_rate_hz)
    for start in range(0, total, scenario.batch_samples):
        between()
        yield from simulation.advance(min(scenario.batch_samples, total - start))
    yield from simulation.finish()


def to_record(
    scenario: Scenario,
    seconds: float,
    t0_ns: int = 0,
    model: RunningModel | None = None,
    between: Callable[[], None] = lambda: None,
) -> Record:
    """A whole run in memory; `seconds` must give at least one sample. Parameters as for `simulate`."""
    batches = list(simulate(scenario, seconds, t0_ns, model, between))
    samples = [batch for batch in batches if isinstance(batch, SampleBatch)]
    if not samples:
        raise InputError("simulation", "seconds", seconds, "long enough for one sample")
    return Record(
        sample_rate_hz=scenario.sample_rate_hz,
        channels=samples[0].channels,
        unit=samples[0].unit,
        data=np.concatenate([batch.data for batch in samples], axis=1),
        tachos=tuple(_pulse_train(batches, row) for row in scenario.sensors.tachos),
        encoders=tuple(_edge_train(batches, row) for row in scenario.sensors.encoders),
        t0_ns=t0_ns,
        machine=scenario.machine.name,
        source=f"scenario {scenario.name}",
        notes={"scenario": scenario.source, "seed": str(scenario.seed)},
        torques=_torques(batches),
    )


def _torques(batches: list[Batch]) -> Torques | None:
    own = [batch for batch in batches if isinstance(batch, TorqueBatch)]
    if not own:
        return None
    return Torques(own[0].channels, np.concatenate([batch.data for batch in own], axis=1))


def _pulse_train(batches: list[Batch], tacho: Tacho) -> PulseTrain:
    mine = [batch for batch in batches if isinstance(batch, TachoBatch) and batch.shaft == tacho.shaft]
    samples = np.concatenate([batch.first_sample + batch.pulse_offsets for batch in mine])
    return PulseTrain(tacho.shaft, float(tacho.pulses), samples)


def _edge_train(batches: list[Batch], encoder: Encoder) -> EdgeTrain:
    mine = [batch for batch in batches if isinstance(batch, EncoderBatch) and batch.shaft == encoder.shaft]
    samples = np.concatenate([batch.first_sample + batch.edge_offsets for batch in mine])
    return EdgeTrain(encoder.shaft, encoder.lines, mine[0].first_edge, samples)
