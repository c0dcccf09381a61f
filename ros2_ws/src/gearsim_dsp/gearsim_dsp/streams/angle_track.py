"""The pulses of one shaft's tacho or encoder, kept for as long as a window may ask for them."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from itertools import pairwise

import numpy as np

from gearsim_dsp.streams.sequencer import Link, Sequenced, Sequencer
from gearsim_io.batches import EncoderBatch, TachoBatch
from gearsim_io.record import PulseTrain

__all__ = ["AngleTrack", "as_pulses"]


def as_pulses(batch: TachoBatch | EncoderBatch) -> TachoBatch:
    """An encoder's line edges as the pulses of a tacho with as many pulses in a revolution."""
    if isinstance(batch, TachoBatch):
        return batch
    return TachoBatch(
        batch.t0_ns,
        batch.sample_rate_hz,
        batch.first_sample,
        batch.sample_count,
        batch.shaft,
        float(batch.lines_per_revolution),
        max(batch.first_edge, 0),  # only a counter here; an encoder's zero may lie ahead
        batch.edge_offsets,
        batch.frame_id,
    )


class AngleTrack:
    """Pulses of one shaft within one run of the stream.

    The track runs ahead of or behind the samples. When its source begins again before the samples do, its
    new batches wait until `next_run()`; when the samples began again first, what still comes of the old
    run is dropped.

    Parameters
    ----------
    shaft : str
    memory_s : float
        Seconds of signal that waiting batches may hold before they are taken without more ado.
    """

    def __init__(self, shaft: str, memory_s: float) -> None:
        self.shaft = shaft
        self._memory_s = memory_s
        self._sequencer: Sequencer[TachoBatch] = Sequencer(_trim)
        self._kept: deque[TachoBatch] = deque()
        self._waiting: deque[Sequenced[TachoBatch]] = deque()
        self._dropping_samples: int | None = None

    @property
    def source_restarted(self) -> bool:
        """True when nothing more can come for the present run of the samples."""
        return bool(self._waiting)

    @property
    def rate_hz(self) -> float:
        """Rate of the sample index used by the batches kept, NaN if there are none."""
        return self._kept[-1].sample_rate_hz if self._kept else float("nan")

    @property
    def kept_samples(self) -> int:
        """Length of the stretch that is kept, in samples."""
        return self._kept[-1].end_sample - self._kept[0].first_sample if self._kept else 0

    def push(self, batch: TachoBatch) -> None:
        """Take a batch of this shaft, in any order."""
        for item in self._sequencer.push(batch):
            self._take(item)

    def finish(self) -> None:
        """The end of the input: take what was held back for order's sake."""
        for item in self._sequencer.finish():
            self._take(item)

    def next_run(self) -> None:
        """The samples began again: forget the old run."""
        self._kept.clear()
        self._dropping_samples = None if self._waiting else 0
        while self._waiting:
            self._kept.append(self._waiting.popleft().batch)
            if self._waiting and self._waiting[0].link is Link.RESTART:
                break

    def drop_before(self, sample: int) -> None:
        """Forget batches that end at or before `sample`."""
        while self._kept and self._kept[0].end_sample <= sample:
            self._kept.popleft()

    def covers(self, first_sample: int, end_sample: int) -> bool:
        """True when the pulses of [first_sample, end_sample) are known without a hole."""
        inside = [b for b in self._kept if b.end_sample > first_sample and b.first_sample < end_sample]
        if not inside or inside[0].first_sample > first_sample or inside[-1].end_sample < end_sample:
            return False
        return all(a.end_sample == b.first_sample for a, b in pairwise(inside))

    def reached(self, end_sample: int) -> bool:
        """True when pulses are known up to `end_sample`, holes before it or not."""
        return bool(self._kept) and self._kept[-1].end_sample >= end_sample

    def pulses(self, first_sample: int, end_sample: int) -> PulseTrain:
        """Pulses in [first_sample, end_sample), as sample indices from `first_sample` on."""
        parts = [b.pulse_offsets + (b.first_sample - first_sample) for b in self._kept]
        samples = np.concatenate(parts) if parts else np.empty(0)
        samples = samples[(samples >= 0) & (samples < end_sample - first_sample)]
        ppr = self._kept[-1].pulses_per_revolution if self._kept else float("nan")
        return PulseTrain(self.shaft, ppr, samples)

    def _take(self, item: Sequenced[TachoBatch]) -> None:
        rate_hz = item.batch.sample_rate_hz
        if self._dropping_samples is not None:
            # Still the old run; a source that is never seen to begin again is believed in the end.
            if item.link is Link.NEXT and self._dropping_samples <= self._memory_s * rate_hz:
                self._dropping_samples += item.batch.sample_count
                return
            self._dropping_samples = None
        elif item.link is Link.RESTART or self._waiting:
            self._waiting.append(item)
            if sum(i.batch.sample_count for i in self._waiting) > self._memory_s * rate_hz:
                self.next_run()  # the samples did not begin again: the tacho alone did
            return
        self._kept.append(item.batch)
        limit = 4 * self._memory_s * rate_hz
        while len(self._kept) > 1 and self.kept_samples - self._kept[0].sample_count > limit:
            self._kept.popleft()


def _trim(batch: TachoBatch, first_sample: int) -> TachoBatch:
    skip = first_sample - batch.first_sample
    keep = batch.pulse_offsets >= skip
    return replace(
        batch,
        t0_ns=batch.t0_ns + round(skip * 1e9 / batch.sample_rate_hz),
        first_sample=first_sample,
        sample_count=batch.sample_count - skip,
        first_pulse=batch.first_pulse + int(np.count_nonzero(~keep)),
        pulse_offsets=batch.pulse_offsets[keep] - skip,
    )
