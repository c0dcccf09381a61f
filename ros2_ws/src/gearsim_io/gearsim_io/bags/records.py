"""From a bag (or a measured file) to a `Record` in memory, and the plain objects of a bag in order."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from gearsim_io.bags.reader import BagMessage, decode, read_bag, topics_of
from gearsim_io.batches import EncoderBatch, SampleBatch, TachoBatch, TorqueBatch
from gearsim_io.errors import InputError
from gearsim_io.messages import from_msg
from gearsim_io.nameplate import Machine
from gearsim_io.qos import TORQUE
from gearsim_io.record import EdgeTrain, PulseTrain, Record, Torques

_SAMPLES = "gearsim_msgs/msg/SampleBatch"
_SIGNALS = (_SAMPLES, "gearsim_msgs/msg/TachoBatch", "gearsim_msgs/msg/EncoderBatch")
_MACHINE = "gearsim_msgs/msg/MachineInfo"
_NANOSECONDS = 1e9
# Angle batches whose stamp differs more from where their sample index puts them are of another run.
_SAME_RUN_NS = 1e8

Batch = TypeVar("Batch", TachoBatch, EncoderBatch)
Train = TypeVar("Train", PulseTrain, EdgeTrain)


def is_bag(path: Path | str) -> bool:
    """Whether a path is a bag's folder or an .mcap file rather than a measured file."""
    path = Path(path)
    return path.is_dir() or path.suffix == ".mcap"


def read_objects(
    path: Path | str,
) -> Iterator[SampleBatch | TachoBatch | EncoderBatch | TorqueBatch | Machine]:
    """The signals and nameplates of a bag as plain objects, in the order of recording.

    Raises
    ------
    InputError
        As `read_bag`, or if a message contradicts itself.
    """
    wanted = tuple(t.name for t in topics_of(path).values() if t.type in (*_SIGNALS, _MACHINE))
    for message in read_bag(path, wanted):
        yield _plain(message, torque=_is_torque(message.topic))


def read_machine(path: Path | str) -> Machine | None:
    """The nameplate recorded in a bag (the last one sent); None if there is none."""
    names = tuple(topic.name for topic in topics_of(path).values() if topic.type == _MACHINE)
    found: Machine | None = None
    if names:
        for message in read_bag(path, names):
            found = _plain(message)
    return found


def read_record(path: Path | str, machine: str | Path | None = None, topic: str | None = None) -> Record:
    """A bag or a measured file as one `Record`.

    Parameters
    ----------
    path : Path or str
        A bag's folder, an .mcap file, or any file that `gearsim_io.importers` reads.
    machine : str or Path, optional
        Machine description for a measured file; a bag needs none.
    topic : str, optional
        Full name of the SampleBatch topic, where a bag holds several.

    Returns
    -------
    Record
        Of a bag with gaps the longest stretch without one; `notes["gaps"]` then tells the others.

    Raises
    ------
    InputError
        If it cannot be read, holds no samples, or holds several streams and `topic` does not choose.
    """
    if not is_bag(path):
        from gearsim_io.importers import import_file

        return import_file(path, machine)
    topics = topics_of(path)
    samples = [t.name for t in topics.values() if t.type == _SAMPLES]
    chosen = _choose(str(path), samples, topic)
    beside = [t for t in topics.values() if t.name != chosen and _beside(t.name, chosen)]
    others = [t.name for t in beside if t.type in _SIGNALS[1:] or (t.name in samples and _is_torque(t.name))]
    build = _Assembly(str(path))
    for message in read_bag(path, (chosen, *others)):
        build.add(_plain(message, torque=message.topic != chosen and _is_torque(message.topic)))
    return build.record()


def _choose(where: str, names: list[str], wanted: str | None) -> str:
    listed = ", ".join(names) or "none"
    if wanted is not None:
        if wanted not in names:
            raise InputError(where, "topic", wanted, f"one of its SampleBatch topics ({listed})")
        return wanted
    names = [name for name in names if not _is_torque(name)] or names
    if len(names) != 1:
        raise InputError(where, "topics of type SampleBatch", listed, "exactly one, or one chosen by name")
    return names[0]


def _beside(name: str, samples: str) -> bool:
    """Angle signals belong to the samples in the same namespace."""
    return name.rsplit("/", 1)[0] == samples.rsplit("/", 1)[0]


def _is_torque(name: str) -> bool:
    return name.rsplit("/", 1)[-1] == TORQUE.name


def _plain(message: BagMessage, *, torque: bool = False) -> Any:
    try:
        found = from_msg(decode(message))
        return TorqueBatch.of(found) if torque and isinstance(found, SampleBatch) else found
    except InputError as error:
        raise InputError(f"topic {message.topic}", error.field, error.value, error.expected) from None


@dataclass(slots=True)
class _Stretch:
    """Batches that follow each other without a gap."""

    batches: list[SampleBatch] = field(default_factory=list)

    @property
    def first(self) -> int:
        return self.batches[0].first_sample

    @property
    def end(self) -> int:
        return self.batches[-1].end_sample

    def holds(self, batch: TachoBatch | EncoderBatch | TorqueBatch) -> bool:
        """Whether a batch is of this stretch and not of another run that counted from 0 again."""
        head = self.batches[0]
        offset_s = (batch.first_sample - head.first_sample) / head.sample_rate_hz
        same_time = abs(batch.t0_ns - head.t0_ns - offset_s * _NANOSECONDS) < _SAME_RUN_NS
        return same_time and batch.end_sample > self.first and batch.first_sample < self.end


class _Assembly:
    """Puts the batches of one stream together."""

    def __init__(self, where: str) -> None:
        self._where = where
        self._stretches: list[_Stretch] = []
        self._tachos: dict[str, list[TachoBatch]] = {}
        self._encoders: dict[str, list[EncoderBatch]] = {}
        self._torques: list[TorqueBatch] = []

    def add(self, batch: SampleBatch | TachoBatch | EncoderBatch | TorqueBatch) -> None:
        """Take the next batch; after a gap or a restart of the index a new stretch begins."""
        if isinstance(batch, SampleBatch):
            self._add_samples(batch)
        elif isinstance(batch, TorqueBatch):
            self._torques.append(batch)
        elif isinstance(batch, TachoBatch):
            self._tachos.setdefault(batch.shaft, []).append(batch)
        else:
            self._encoders.setdefault(batch.shaft, []).append(batch)

    def _add_samples(self, batch: SampleBatch) -> None:
        if self._stretches:
            last = self._stretches[-1].batches[-1]
            for name in ("sample_rate_hz", "channels", "unit"):
                if getattr(batch, name) != getattr(last, name):
                    expected = f"{getattr(last, name)}, as before"
                    place = f"sample {batch.first_sample}: {name}"
                    raise InputError(self._where, place, getattr(batch, name), expected)
            if batch.first_sample == last.end_sample:
                self._stretches[-1].batches.append(batch)
                return
        self._stretches.append(_Stretch([batch]))

    def record(self) -> Record:
        """The longest stretch with its angle signals."""
        if not self._stretches:
            raise InputError(self._where, "", "no samples", "at least one SampleBatch")
        longest = max(self._stretches, key=lambda stretch: stretch.end - stretch.first)
        head = longest.batches[0]
        notes = self._gap_notes(longest)
        return Record(
            sample_rate_hz=head.sample_rate_hz,
            channels=head.channels,
            unit=head.unit,
            data=np.concatenate([batch.data for batch in longest.batches], axis=1),
            tachos=tuple(_trains(longest, self._tachos, _pulse_train, notes)),
            encoders=tuple(_trains(longest, self._encoders, _edge_train, notes)),
            t0_ns=head.t0_ns,
            first_sample=head.first_sample,
            machine=head.frame_id,
            source=self._where,
            notes=notes,
            torques=_torque(longest, self._torques, notes),
        )

    def _gap_notes(self, chosen: _Stretch) -> dict[str, str]:
        gaps = len(self._stretches) - 1
        if gaps == 0:
            return {}
        total = sum(stretch.end - stretch.first for stretch in self._stretches)
        kept = chosen.end - chosen.first
        return {"gaps": f"{gaps} gaps; the longest stretch without one was taken, {kept} of {total} samples"}


def _trains(
    stretch: _Stretch,
    by_shaft: Mapping[str, list[Batch]],
    build: Callable[[_Stretch, list[Batch]], Train | None],
    notes: dict[str, str],
) -> Iterator[Train]:
    """One train for each shaft whose batches cover the stretch without a hole; the others are noted."""
    for shaft, batches in by_shaft.items():
        own = {batch.first_sample: batch for batch in batches if stretch.holds(batch)}
        ordered = [own[first] for first in sorted(own)]
        train = build(stretch, ordered) if _covers(stretch, ordered) else None
        if train is None:
            notes[f"angle signal of {shaft}"] = "incomplete, not used"
        else:
            yield train


def _torque(stretch: _Stretch, batches: list[TorqueBatch], notes: dict[str, str]) -> Torques | None:
    """The torques if they cover the stretch without a hole; otherwise that is noted."""
    own = {batch.first_sample: batch for batch in batches if stretch.holds(batch)}
    ordered = [own[first] for first in sorted(own)]
    same = len({batch.channels for batch in ordered}) == 1
    if not (same and _covers(stretch, ordered)):
        if batches:
            notes["torque"] = "incomplete, not used"
        return None
    skip = stretch.first - ordered[0].first_sample
    data = np.concatenate([batch.data for batch in ordered], axis=1)
    return Torques(ordered[0].channels, data[:, skip : skip + stretch.end - stretch.first])


def _covers(stretch: _Stretch, batches: Sequence[TachoBatch | EncoderBatch | TorqueBatch]) -> bool:
    if not batches or batches[0].first_sample > stretch.first or batches[-1].end_sample < stretch.end:
        return False
    return all(before.end_sample == after.first_sample for before, after in pairwise(batches))


def _pulse_train(stretch: _Stretch, batches: list[TachoBatch]) -> PulseTrain | None:
    counts = [(batch.first_pulse, batch.pulse_offsets.size) for batch in batches]
    if not _in_sequence(counts):
        return None
    places = np.concatenate([batch.first_sample + batch.pulse_offsets for batch in batches])
    inside = places[(places >= stretch.first) & (places < stretch.end)] - stretch.first
    return PulseTrain(batches[0].shaft, batches[0].pulses_per_revolution, inside)


def _edge_train(stretch: _Stretch, batches: list[EncoderBatch]) -> EdgeTrain | None:
    counts = [(batch.first_edge, batch.edge_offsets.size) for batch in batches]
    if not _in_sequence(counts):
        return None
    places = np.concatenate([batch.first_sample + batch.edge_offsets for batch in batches])
    before = int(np.count_nonzero(places < stretch.first))
    inside = places[(places >= stretch.first) & (places < stretch.end)] - stretch.first
    return EdgeTrain(batches[0].shaft, batches[0].lines_per_revolution, counts[0][0] + before, inside)


def _in_sequence(counts: list[tuple[int, int]]) -> bool:
    """Whether each batch's first number follows the last of the batch before."""
    return all(first + size == after for (first, size), (after, _) in pairwise(counts))


__all__ = ["is_bag", "read_machine", "read_objects", "read_record"]
