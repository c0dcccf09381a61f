"""A scenario run offline into files: a bag as the live rig would record it, arrays or sound if asked."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
import soundfile
from numpy.typing import NDArray

from gearsim_io.bags import BagWriter, StreamWriter
from gearsim_io.batches import EncoderBatch, SampleBatch, TachoBatch, TorqueBatch
from gearsim_io.errors import InputError
from gearsim_io.new_paths import refuse_existing
from gearsim_sim.scenario import Scenario
from gearsim_sim.simulation import Simulation

Batch = SampleBatch | TachoBatch | EncoderBatch | TorqueBatch


@dataclass(frozen=True)
class Made:
    """What a run wrote."""

    samples: int
    seconds: float
    sample_rate_hz: float
    channels: tuple[str, ...]
    files: tuple[Path, ...]


class _Sink(Protocol):
    def take(self, batches: list[Batch]) -> None: ...

    def close(self) -> Path: ...


def simulate_to(
    scenario: Scenario,
    seconds: float,
    out: Path,
    formats: tuple[str, ...],
    progress: Callable[[float], None] = lambda _seconds: None,
) -> Made:
    """Run `scenario` for that many simulated seconds and write it to the new folder `out`.

    The bag's files lie in `out` itself, so that `out` is the bag; beside them `signals.npz` and
    `signals.wav`, if asked for. Whatever interrupts the run, nothing half-written remains.

    Raises
    ------
    InputError
        If `out` exists or is too short for one sample, or the scenario does not fit its machine.
    """
    total = round(seconds * scenario.sample_rate_hz)
    if total < 1:
        raise InputError("simulate", "seconds", seconds, f"at least {1 / scenario.sample_rate_hz:g}")
    refuse_existing(out, "the name of a new folder")
    simulation = Simulation(scenario)
    try:
        files = _run(simulation, total, out, formats, progress)
    except BaseException:
        shutil.rmtree(out, ignore_errors=True)
        raise
    channels = tuple(channel.name for channel in simulation.machine.channels)
    return Made(total, total / scenario.sample_rate_hz, scenario.sample_rate_hz, channels, files)


def _run(
    simulation: Simulation,
    total: int,
    out: Path,
    formats: tuple[str, ...],
    progress: Callable[[float], None],
) -> tuple[Path, ...]:
    with ExitStack() as stack:
        sinks: list[_Sink] = []
        if "mcap" in formats:
            sinks.append(_BagSink(simulation, out, stack))
        else:
            out.mkdir(parents=True)
        if "npz" in formats:
            sinks.append(_NpzSink(simulation, out))
        if "wav" in formats:
            sinks.append(_WavSink(simulation, out, stack))
        size = simulation.scenario.batch_samples
        for start in range(0, total, size):
            batches = simulation.advance(min(size, total - start))
            if start + size >= total:
                batches += simulation.finish()
            for sink in sinks:
                sink.take(batches)
            progress(simulation.seconds_sent)
        return tuple(sink.close() for sink in sinks)


class _BagSink:
    def __init__(self, simulation: Simulation, out: Path, stack: ExitStack) -> None:
        self._simulation = simulation
        scenario = simulation.scenario
        truth = simulation.truth()
        custom = {"scenario": scenario.name, "seed": str(scenario.seed), "version": truth.version}
        self._writer = stack.enter_context(BagWriter(out, custom, sync_period_s=None))
        self._stream = StreamWriter(self._writer)
        self._stream.write(simulation.machine, simulation.t0_ns)
        self._stream.write(truth, simulation.t0_ns)
        self._told = truth.sample

    def take(self, batches: list[Batch]) -> None:
        for batch in batches:
            self._stream.write(batch)
        upto = self._simulation.samples_sent - 1
        for truth in self._simulation.truths(self._told, upto):
            self._stream.write(truth)
        self._told = max(self._told, upto)

    def close(self) -> Path:
        self._writer.close()
        return self._writer.path


class _NpzSink:
    """Each channel as an array of its name, `tacho_<shaft>` and `encoder_<shaft>` in sample indices.

    Torques are arrays `torque_<shaft>` in N m.
    """

    def __init__(self, simulation: Simulation, out: Path) -> None:
        self._simulation = simulation
        self._file = out / "signals.npz"
        self._data: list[NDArray[np.float32]] = []
        self._unit = "1"
        self._marks: dict[str, list[NDArray[np.float64]]] = {}
        self._torques: dict[str, list[NDArray[np.float32]]] = {}

    def take(self, batches: list[Batch]) -> None:
        for batch in batches:
            if isinstance(batch, SampleBatch):
                self._data.append(batch.data)
                self._unit = batch.unit
            elif isinstance(batch, TachoBatch):
                times = batch.first_sample + batch.pulse_offsets
                self._marks.setdefault(f"tacho_{batch.shaft}", []).append(times)
            elif isinstance(batch, TorqueBatch):
                for name, values in zip(batch.channels, batch.data, strict=True):
                    self._torques.setdefault(name, []).append(values)
            else:
                times = batch.first_sample + batch.edge_offsets
                self._marks.setdefault(f"encoder_{batch.shaft}", []).append(times)

    def close(self) -> Path:
        machine = self._simulation.machine
        names = [channel.name for channel in machine.channels]
        arrays = dict(zip(names, np.concatenate(self._data, axis=1), strict=True))
        arrays |= {name: np.concatenate(parts) for name, parts in self._marks.items()}
        arrays |= {name: np.concatenate(parts) for name, parts in self._torques.items()}
        np.savez(
            self._file,
            unit=np.array(self._unit),
            sample_rate_hz=np.array(self._simulation.scenario.sample_rate_hz),
            machine=np.array(machine.name),
            allow_pickle=False,
            **arrays,
        )
        return self._file


class _WavSink:
    """`signals.wav`: all channels as 32-bit floats in the channels' own unit, neither scaled nor clipped."""

    def __init__(self, simulation: Simulation, out: Path, stack: ExitStack) -> None:
        rate = simulation.scenario.sample_rate_hz
        if rate != round(rate):
            raise InputError("simulate", "sample_rate", rate, "a whole number of Hz for a .wav file")
        self._path = out / "signals.wav"
        count = len(simulation.machine.channels)
        self._file = stack.enter_context(
            soundfile.SoundFile(self._path, "w", round(rate), count, subtype="FLOAT", format="WAV")
        )

    def take(self, batches: list[Batch]) -> None:
        for batch in batches:
            if isinstance(batch, SampleBatch):
                self._file.write(batch.data.T)

    def close(self) -> Path:
        self._file.close()
        return self._path
