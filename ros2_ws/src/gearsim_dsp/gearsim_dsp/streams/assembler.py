"""From batches of any size and in any interleaving to analysis windows at fixed places of the stream.

A window [k hop, k hop + length) of the sample index is made once all its samples are there without a gap
and the angle signals of the nameplate cover it, or are overdue by `angle_wait_s` of *signal*. No clock is
read, so the same batches give the same windows live, offline and on replay.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.envelope import WindowSpectrum, both_spectra
from gearsim_dsp.streams.angle_track import AngleTrack, as_pulses
from gearsim_dsp.streams.ring import SignalBuffer
from gearsim_dsp.streams.sequencer import Link, Sequenced, Sequencer
from gearsim_io.batches import EncoderBatch, SampleBatch, TachoBatch
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine
from gearsim_io.record import PulseTrain

__all__ = ["AssemblerCounts", "Batch", "Window", "WindowAssembler", "WindowSettings"]

_STAMP_DRIFT_NS = 1_000_000

Batch = SampleBatch | TachoBatch | EncoderBatch


@dataclass(frozen=True, slots=True)
class WindowSettings:
    """Length and distance of the windows and the wait for angle signals, all in seconds of signal."""

    window_s: float = 2.0
    hop_s: float = 0.5
    angle_wait_s: float = 1.0

    def __post_init__(self) -> None:
        for name, low, high in (("window_s", 0.05, 60.0), ("hop_s", 0.01, 60.0), ("angle_wait_s", 0.0, 10.0)):
            value = getattr(self, name)
            if not low <= value <= high:
                raise InputError("window settings", name, value, f"{low:g} to {high:g} s")
        if self.hop_s > self.window_s:
            raise InputError(
                "window settings", "hop_s", self.hop_s, f"at most window_s = {self.window_s:g} s"
            )


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """One analysis window of all channels.

    Parameters
    ----------
    data : ndarray of float32, shape (channels, samples)
        Read-only; may hold values that are not finite where the source sent such.
    pulses : tuple of PulseTrain
        Angle signals that cover the whole window, in samples from its start.
    run : int
        Counts the starts of the stream; windows of different runs have nothing to do with each other.
    note : str
        Why an angle signal of the nameplate is not among `pulses`; empty otherwise.
    """

    t0_ns: int
    sample_rate_hz: float
    first_sample: int
    channels: tuple[str, ...]
    unit: str
    data: NDArray[np.float32]
    pulses: tuple[PulseTrain, ...]
    run: int
    note: str = ""
    _spectra: dict[int, tuple[WindowSpectrum, WindowSpectrum]] = field(
        default_factory=dict, repr=False, init=False
    )

    def spectra(self, row: int) -> tuple[WindowSpectrum, WindowSpectrum]:
        """Spectrum of a channel, and without its lines: made once for all monitors that look at it."""
        if row not in self._spectra:
            self._spectra[row] = both_spectra(self.data[row], self.sample_rate_hz)
        return self._spectra[row]

    @property
    def sample_count(self) -> int:
        """Samples per channel."""
        return int(self.data.shape[1])

    @property
    def end_sample(self) -> int:
        """Index after the last sample."""
        return self.first_sample + self.sample_count

    @property
    def last_ns(self) -> int:
        """Time of the last sample."""
        return self.t0_ns + round((self.sample_count - 1) * 1e9 / self.sample_rate_hz)


@dataclass(slots=True)
class AssemblerCounts:
    """What happened since the start; `last_note` tells the latest break of the stream in words."""

    windows: int = 0
    windows_without_angle: int = 0
    layout_changes: int = 0
    unlisted_angle_batches: int = 0
    last_note: str = ""


@dataclass(slots=True)
class _Segment:
    """A stretch without a gap and of one layout; `next_window` is the start of the window to be made next.

    `anchors` are (sample, stamp) pairs: one at the start, and one wherever the source's stamps leave the
    straight line from the last one (a clock that drifts against the sample clock).
    """

    anchors: deque[tuple[int, int]]
    sample_rate_hz: float
    channels: tuple[str, ...]
    unit: str
    buffer: SignalBuffer
    length: int
    hop: int
    next_window: int


class WindowAssembler:
    """Makes windows of the batches of one source.

    Parameters
    ----------
    machine : Machine
        Its tacho shafts (or, when it has none, its encoder shafts) are waited for.
    settings : WindowSettings
    """

    def __init__(self, machine: Machine, settings: WindowSettings) -> None:
        self.settings = settings
        shafts = machine.tacho_shafts or machine.encoder_shafts
        self._encoders = not machine.tacho_shafts
        memory_s = settings.window_s + settings.hop_s + settings.angle_wait_s + 1.0
        self._tracks = {shaft: AngleTrack(shaft, memory_s) for shaft in shafts}
        self._sequencer: Sequencer[SampleBatch] = Sequencer(_trim)
        self._queue: deque[Sequenced[SampleBatch]] = deque()
        self._segment: _Segment | None = None
        self._finished = False
        self._newest_first = -1
        self.run = 0
        self.counts = AssemblerCounts()

    @property
    def stream_counts(self) -> tuple[int, int, int, int]:
        """Gaps, samples lost, duplicate batches and restarts of the samples."""
        c = self._sequencer.counts
        return c.gaps, c.lost_samples, c.duplicates, c.restarts

    @property
    def nbytes(self) -> int:
        """Memory of the signal kept."""
        queued = sum(item.batch.data.nbytes for item in self._queue)
        return queued + (self._segment.buffer.nbytes if self._segment else 0)

    def push(self, batch: Batch) -> list[Window]:
        """Take one batch; return the windows that are complete now, in the order of the stream."""
        if isinstance(batch, SampleBatch):
            self._queue.extend(self._sequencer.push(batch))
        else:
            track = self._tracks.get(batch.shaft)
            if track is None or isinstance(batch, EncoderBatch) != self._encoders:
                self.counts.unlisted_angle_batches += 1
                return []
            track.push(as_pulses(batch))
        return self._advance()

    def finish(self) -> list[Window]:
        """The end of the input: windows that still wait are made with what there is."""
        self._queue.extend(self._sequencer.finish())
        for track in self._tracks.values():
            track.finish()
        self._finished = True
        windows = self._advance()
        self._finished = False
        return windows

    def _advance(self) -> list[Window]:
        windows: list[Window] = []
        while self._queue:
            item = self._queue[0]
            breaks = self._breaks_segment(item)
            if breaks:
                # The old segment's windows first: a break must not depend on which topic was read earlier.
                windows += self._make_windows()
                if self._pending() and not self._overdue_after_break():
                    return windows
                windows += self._make_windows(force=True)
            self._queue.popleft()
            self._ingest(item, breaks)
            windows += self._make_windows()
        return windows + self._make_windows(force=self._finished)

    def _breaks_segment(self, item: Sequenced[SampleBatch]) -> bool:
        segment = self._segment
        return segment is None or item.link is not Link.NEXT or _layout(item.batch) != _layout(segment)

    def _pending(self) -> bool:
        segment = self._segment
        return segment is not None and segment.next_window + segment.length <= segment.buffer.end_sample

    def _overdue_after_break(self) -> bool:
        assert self._segment is not None
        queued_s = sum(item.batch.sample_count / item.batch.sample_rate_hz for item in self._queue)
        return self._finished or queued_s >= self.settings.angle_wait_s

    def _ingest(self, item: Sequenced[SampleBatch], breaks: bool) -> None:
        batch = item.batch
        if breaks:
            self._start_segment(item)
        assert self._segment is not None
        self._segment.buffer.append(batch.data)
        stamp_ns = _stamp_ns(self._segment.anchors[-1], batch.first_sample, batch.sample_rate_hz)
        if abs(batch.t0_ns - stamp_ns) > _STAMP_DRIFT_NS:
            self._segment.anchors.append((batch.first_sample, batch.t0_ns))
        self._newest_first = batch.first_sample

    def _start_segment(self, item: Sequenced[SampleBatch]) -> None:
        batch, old = item.batch, self._segment
        if item.link is Link.RESTART:
            self.run += 1
            self.counts.last_note = f"the stream began again at sample {batch.first_sample}"
            for track in self._tracks.values():
                track.next_run()
        elif old is not None and _layout(batch) != _layout(old):
            self.run += 1
            self.counts.layout_changes += 1
            self.counts.last_note = f"{_change(old, batch)} at sample {batch.first_sample}"
        elif item.link is Link.GAP:
            self.counts.last_note = f"{item.lost} samples lost before sample {batch.first_sample}"
        length = max(round(self.settings.window_s * batch.sample_rate_hz), 1)
        hop = max(round(self.settings.hop_s * batch.sample_rate_hz), 1)
        spare = round(self.settings.angle_wait_s * batch.sample_rate_hz) + hop
        first = batch.first_sample
        self._segment = _Segment(
            deque([(first, batch.t0_ns)]),
            batch.sample_rate_hz,
            batch.channels,
            batch.unit,
            SignalBuffer(len(batch.channels), length + spare, first),
            length,
            hop,
            math.ceil(first / hop) * hop,
        )

    def _make_windows(self, force: bool = False) -> list[Window]:
        windows = []
        while self._pending():
            segment = self._segment
            assert segment is not None
            if not (force or self._decided(segment)):
                break
            windows.append(self._window(segment))
            segment.next_window += segment.hop
            segment.buffer.drop_before(segment.next_window)
            for track in self._tracks.values():
                track.drop_before(segment.next_window)
        return windows

    def _decided(self, segment: _Segment) -> bool:
        """True when nothing more is to be expected of the angle signals for the next window."""
        end = segment.next_window + segment.length
        if self._newest_first >= end + self.settings.angle_wait_s * segment.sample_rate_hz:
            return True
        return all(track.reached(end) or track.source_restarted for track in self._tracks.values())

    def _window(self, segment: _Segment) -> Window:
        first, end = segment.next_window, segment.next_window + segment.length
        good, missing = [], []
        for shaft, track in self._tracks.items():
            if track.covers(first, end) and track.rate_hz == segment.sample_rate_hz:
                good.append(track.pulses(first, end))
            else:
                missing.append(shaft)
        self.counts.windows += 1
        self.counts.windows_without_angle += bool(missing)
        kind = "encoder" if self._encoders else "tacho"
        note = f"no complete {kind} signal of shaft {', '.join(missing)} in this window" if missing else ""
        while len(segment.anchors) > 1 and segment.anchors[1][0] <= first:
            segment.anchors.popleft()
        return Window(
            _stamp_ns(segment.anchors[0], first, segment.sample_rate_hz),
            segment.sample_rate_hz,
            first,
            segment.channels,
            segment.unit,
            segment.buffer.copy(first, end),
            tuple(good),
            self.run,
            note,
        )


def _stamp_ns(anchor: tuple[int, int], sample: int, rate_hz: float) -> int:
    return anchor[1] + round((sample - anchor[0]) * 1e9 / rate_hz)


def _layout(part: SampleBatch | _Segment) -> tuple[float, tuple[str, ...], str]:
    return part.sample_rate_hz, part.channels, part.unit


def _change(old: _Segment, new: SampleBatch) -> str:
    parts = []
    if old.sample_rate_hz != new.sample_rate_hz:
        parts.append(f"sample rate from {old.sample_rate_hz:g} to {new.sample_rate_hz:g} Hz")
    if old.channels != new.channels:
        parts.append(f"channels from {', '.join(old.channels)} to {', '.join(new.channels)}")
    if old.unit != new.unit:
        parts.append(f"unit from {old.unit} to {new.unit}")
    return "the source changed " + " and ".join(parts)


def _trim(batch: SampleBatch, first_sample: int) -> SampleBatch:
    skip = first_sample - batch.first_sample
    return replace(
        batch,
        t0_ns=batch.t0_ns + round(skip * 1e9 / batch.sample_rate_hz),
        first_sample=first_sample,
        data=np.ascontiguousarray(batch.data[:, skip:]),
    )
