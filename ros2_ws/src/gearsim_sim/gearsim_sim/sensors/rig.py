"""All sensors of a rig: what the model gives for a batch becomes the batches that go out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearsim_io.batches import EncoderBatch, SampleBatch, TachoBatch, TorqueBatch
from gearsim_io.errors import InputError
from gearsim_sim.sensors.chain import MeasuringChain
from gearsim_sim.sensors.marks import MarkReader
from gearsim_sim.window import Window

if TYPE_CHECKING:
    from gearsim_sim.engine import EngineOutput
    from gearsim_sim.scenario import Scenario

Batch = SampleBatch | TachoBatch | EncoderBatch | TorqueBatch


class RigSensors:
    """Accelerometers, tachos, encoders and torque transducers, and the stretch of signal they look at.

    Parameters
    ----------
    scenario : Scenario
    first : EngineOutput
        The model's first `factor` samples; they tell its sites, shafts and signals.

    Raises
    ------
    InputError
        A sensor looks at something that the model does not have, or a number does not fit the rate.
    """

    def __init__(self, scenario: Scenario, first: EngineOutput) -> None:
        table, rate_hz, seed = scenario.sensors, scenario.sample_rate_hz, scenario.seed
        self._scenario = scenario
        self._accelerometers = MeasuringChain(
            table.accelerometers, first.site_names, rate_hz, seed, table.sampling
        )
        signals = tuple(first.signals)
        for row in table.torques:
            if row.site not in signals:
                known = ", ".join(name for name in signals if name.endswith("_torque"))
                expected = f"one of {known}" if known else "no shafts, as the model tells no torques"
                raise InputError("sensors.torques", "shafts", row.site, expected)
        self._torques = MeasuringChain(table.torques, signals, rate_hz, seed) if table.torques else None
        self._tachos = [
            (row, MarkReader(f"tacho {row.shaft}", row.pulses, row.phase_turns, row.pickup, rate_hz, seed))
            for row in table.tachos
        ]
        self._encoders = [
            (row, MarkReader(f"encoder {row.shaft}", row.lines, 0.0, row.pickup, rate_hz, seed))
            for row in table.encoders
        ]
        self._pulses = [0] * len(self._tachos)
        chains = [self._accelerometers, *([self._torques] if self._torques else [])]
        readers = [reader for _, reader in (*self._tachos, *self._encoders)]
        # An edge between the last sample of a batch and the next belongs to the batch: look one ahead.
        ahead = max(1, *(chain.ahead for chain in chains), *(1 + reader.ahead for reader in readers))
        self.window = Window(
            first,
            scenario.batch_samples,
            max(chain.past for chain in chains),
            ahead,
            table.sampling.oversampling,
            signals if table.torques else (),
        )

    def read(self, first: int, count: int, t0_ns: int) -> list[Batch]:
        """The batches of the next `count` samples, of which the first is sample `first` at `t0_ns`.

        The SampleBatch comes first, then a TachoBatch per tacho, an EncoderBatch per encoder, and a
        TorqueBatch if torques are measured. The window moves on.
        """
        rate_hz, frame = self._scenario.sample_rate_hz, self._scenario.machine.name
        chain, window = self._accelerometers, self.window
        data = chain.process(window.accel(count, chain.past, chain.ahead), first, count)
        batches: list[Batch] = [SampleBatch(t0_ns, rate_hz, first, chain.channels, "m/s^2", data, frame)]
        common = (t0_ns, rate_hz, first, count)
        for number, (tacho, reader) in enumerate(self._tachos):
            span = reader.stretch(count)
            _, offsets = reader.read(*window.angle(tacho.shaft, *span, rate_hz), count)
            pulse = self._pulses[number]
            self._pulses[number] += offsets.size
            batches.append(TachoBatch(*common, tacho.shaft, float(tacho.pulses), pulse, offsets, frame))
        for encoder, reader in self._encoders:
            span = reader.stretch(count)
            edge, offsets = reader.read(*window.angle(encoder.shaft, *span, rate_hz), count)
            batches.append(EncoderBatch(*common, encoder.shaft, encoder.lines, edge, offsets, frame))
        if self._torques is not None:
            chain = self._torques
            torque = chain.process(window.signals(count, chain.past, chain.ahead), first, count)
            batches.append(TorqueBatch(t0_ns, rate_hz, first, chain.channels, "N*m", torque, frame))
        window.drop(count)
        return batches
