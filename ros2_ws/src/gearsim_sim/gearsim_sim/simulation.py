"""A scenario that runs: physics, sensors and what happens on the way, as the batches that the rig sends.

The same scenario, seed and events give the same batches bit for bit: live or offline, and however the
samples are asked for. `truth().events` of a live run is all that is needed to repeat it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeVar

import numpy as np

from gearsim_io.batches import EncoderBatch, SampleBatch, TachoBatch
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine
from gearsim_io.record import EdgeTrain, PulseTrain, Record
from gearsim_sim.events import Clear, Event, FaultSpec, Inject, SetOperatingPoint
from gearsim_sim.history import History
from gearsim_sim.models import MODELS, RunningModel
from gearsim_sim.scenario import Scenario
from gearsim_sim.sensors.chain import AccelerometerChain
from gearsim_sim.sensors.edges import EdgeFinder
from gearsim_sim.sensors.rows import Encoder, Tacho
from gearsim_sim.truth import GroundTruth
from gearsim_sim.window import Window

_T = TypeVar("_T")
Batch = SampleBatch | TachoBatch | EncoderBatch


class Simulation:
    """A running rig.

    Parameters
    ----------
    scenario : Scenario
    t0_ns : int
        Time of sample 0; stamps are t0 + sample / rate.
    model : RunningModel, optional
        In place of the one that the scenario names.

    Raises
    ------
    InputError
        What the scenario asks for does not fit the machine.
    """

    def __init__(self, scenario: Scenario, t0_ns: int = 0, model: RunningModel | None = None) -> None:
        self.scenario = scenario
        self.t0_ns = t0_ns
        self._model = model or _told(scenario, lambda: MODELS[scenario.model](scenario))
        self._history = History(scenario)
        for number, event in enumerate(scenario.events):
            try:
                self._schedule(event)
            except InputError as error:
                where = f"{scenario.source}: event {number + 1} of the timeline: {error.where}"
                raise InputError(where, error.field, error.value, error.expected) from None
        self._requested = 0
        self._sent = 0
        self._finished = False
        first = _told(scenario, lambda: self._model.advance(1))  # tells sites and shafts
        self._chain = AccelerometerChain(
            scenario.sensors.accelerometers, first.site_names, scenario.sample_rate_hz, scenario.seed
        )
        # An edge between the last sample of a batch and the next belongs to the batch: look one ahead.
        self._window = Window(first, scenario.batch_samples, self._chain.past, max(1, self._chain.ahead))
        self._tachos = [(row, EdgeFinder(row.pulses, row.phase_turns)) for row in scenario.sensors.tachos]
        self._encoders = [(row, EdgeFinder(row.lines)) for row in scenario.sensors.encoders]
        self._pulses = [0] * len(self._tachos)

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

    def advance(self, n_samples: int) -> list[Batch]:
        """Run so many samples further and hand out the batches that are complete.

        Batches begin at multiples of the scenario's `batch_samples`, whatever the portions; samples of an
        incomplete batch wait for the next call or for `finish`. Of each stretch the SampleBatch comes
        first, then one TachoBatch per tacho, then one EncoderBatch per encoder.
        """
        if self._finished:
            raise RuntimeError("the simulation has been finished")
        self._requested += n_samples
        batches: list[Batch] = []
        window = self._window
        while (missing := self._requested + window.ahead - window.head) > 0:
            window.put(self._model.advance(min(missing, window.room)))
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
        if isinstance(event, Inject):
            sample = self._model.inject(event.fault, event.ramp_s, event.at_sample)
        elif isinstance(event, Clear):
            sample = self._model.clear(event.fault_id, event.ramp_s, event.at_sample)
        else:
            sample = self._model.set_operating_point(
                event.speed_hz, event.load_nm, event.ramp_s, event.at_sample
            )
        self._history.add(event, sample)
        return sample

    def _send(self, count: int) -> list[Batch]:
        scenario = self.scenario
        window = self._window
        rate_hz = scenario.sample_rate_hz
        first = self._sent
        t0_ns = self.t0_ns + round(first * 1e9 / rate_hz)
        frame = self.machine.name
        data = self._chain.process(window.accel(count), first, count)
        batches: list[Batch] = [
            SampleBatch(t0_ns, rate_hz, first, self._chain.channels, "m/s^2", data, frame)
        ]
        for number, (tacho, finder) in enumerate(self._tachos):
            _, offsets = finder.find(*window.angle(tacho.shaft, count, rate_hz))
            pulse = self._pulses[number]
            self._pulses[number] += offsets.size
            batches.append(
                TachoBatch(
                    t0_ns, rate_hz, first, count, tacho.shaft, float(tacho.pulses), pulse, offsets, frame
                )
            )
        for encoder, finder in self._encoders:
            edge, offsets = finder.find(*window.angle(encoder.shaft, count, rate_hz))
            batches.append(
                EncoderBatch(t0_ns, rate_hz, first, count, encoder.shaft, encoder.lines, edge, offsets, frame)
            )
        window.drop(count)
        self._sent += count
        return batches


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
    scenario: Scenario, seconds: float, t0_ns: int = 0, model: RunningModel | None = None
) -> Iterator[Batch]:
    """The batches of a whole run as fast as they can be made: round(seconds x rate) samples.

    The last batch is shorter if need be. Parameters as for `Simulation`.
    """
    simulation = Simulation(scenario, t0_ns, model)
    total = round(seconds * scenario.sample_rate_hz)
    for start in range(0, total, scenario.batch_samples):
        yield from simulation.advance(min(scenario.batch_samples, total - start))
    yield from simulation.finish()


def to_record(
    scenario: Scenario, seconds: float, t0_ns: int = 0, model: RunningModel | None = None
) -> Record:
    """A whole run in memory; `seconds` must give at least one sample."""
    batches = list(simulate(scenario, seconds, t0_ns, model))
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
    )


def _pulse_train(batches: list[Batch], tacho: Tacho) -> PulseTrain:
    mine = [batch for batch in batches if isinstance(batch, TachoBatch) and batch.shaft == tacho.shaft]
    samples = np.concatenate([batch.first_sample + batch.pulse_offsets for batch in mine])
    return PulseTrain(tacho.shaft, float(tacho.pulses), samples)


def _edge_train(batches: list[Batch], encoder: Encoder) -> EdgeTrain:
    mine = [batch for batch in batches if isinstance(batch, EncoderBatch) and batch.shaft == encoder.shaft]
    samples = np.concatenate([batch.first_sample + batch.edge_offsets for batch in mine])
    return EdgeTrain(encoder.shaft, encoder.lines, mine[0].first_edge, samples)
