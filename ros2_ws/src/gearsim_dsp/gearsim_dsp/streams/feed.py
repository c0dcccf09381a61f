"""Between a node's subscriptions and its analysis: a bounded queue, and what to say of the stream."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from gearsim_dsp.results import AlarmState, Features
from gearsim_dsp.streams.assembler import Batch, WindowAssembler
from gearsim_io.batches import SampleBatch
from gearsim_io.health import Level

__all__ = ["BatchQueue", "StateKeeper", "StreamStatus", "StreamWatch", "Verdict"]


Item = Batch | Features
"""What a node's analysis takes."""


class BatchQueue:
    """Hands batches from the thread that receives them to the one that analyses, in order.

    Holds at most `limit_s` of signal and `LIMIT_COUNT` batches; beyond that the oldest are dropped, which
    the assembler sees as a gap. Each entry carries the moment of its arrival.
    """

    LIMIT_COUNT = 20_000

    def __init__(self, limit_s: float) -> None:
        self.limit_s = limit_s
        self.dropped = 0
        self.dropped_samples = 0
        self.unfinished = 0
        """Batches put in and not yet reported by `finished`, but for those dropped."""
        self._items: deque[tuple[float, Item]] = deque()
        self._seconds = 0.0
        self._open = True
        self._changed = threading.Condition()

    @property
    def seconds(self) -> float:
        """Signal that waits."""
        return self._seconds

    def put(self, arrival_s: float, batch: Item) -> None:
        """Append a batch; never blocks."""
        with self._changed:
            self._items.append((arrival_s, batch))
            self.unfinished += 1
            self._seconds += _seconds(batch)
            while len(self._items) > 1 and (
                self._seconds > self.limit_s or len(self._items) > self.LIMIT_COUNT
            ):
                _, old = self._items.popleft()
                self._seconds -= _seconds(old)
                self.dropped += 1
                self.unfinished -= 1
                self.dropped_samples += old.sample_count if isinstance(old, SampleBatch) else 0
            self._changed.notify()

    def get(self, timeout_s: float) -> tuple[float, Item] | None:
        """The oldest batch with its arrival; None if none came in time or the queue is closed and empty."""
        with self._changed:
            self._changed.wait_for(lambda: self._items or not self._open, timeout_s)
            if not self._items:
                return None
            arrival_s, batch = self._items.popleft()
            self._seconds -= _seconds(batch)
            return arrival_s, batch

    def finished(self) -> None:
        """The analysis of one batch taken is over, and what came of it is told."""
        with self._changed:
            self.unfinished -= 1

    def close(self) -> None:
        """No more batches will come; those waiting can still be taken."""
        with self._changed:
            self._open = False
            self._changed.notify_all()


def _seconds(batch: Item) -> float:
    return batch.sample_count / batch.sample_rate_hz if isinstance(batch, SampleBatch) else 0.0


@dataclass(frozen=True, slots=True)
class StreamStatus:
    """Numbers that a node knows of its stream at one moment; counts run from the node's start."""

    gaps: int = 0
    lost_samples: int = 0
    duplicates: int = 0
    restarts: int = 0
    layout_changes: int = 0
    windows: int = 0
    windows_without_angle: int = 0
    dropped_batches: int = 0
    queued_s: float = 0.0
    last_note: str = ""
    unfinished_batches: int = 0

    @classmethod
    def of(cls, assembler: WindowAssembler | None, queue: BatchQueue) -> StreamStatus:
        """The present numbers of a node's assembler and queue."""
        if assembler is None:
            return cls(
                dropped_batches=queue.dropped, queued_s=queue.seconds, unfinished_batches=queue.unfinished
            )
        counts = assembler.counts
        return cls(
            *assembler.stream_counts,
            counts.layout_changes,
            counts.windows,
            counts.windows_without_angle,
            queue.dropped,
            queue.seconds,
            counts.last_note,
            queue.unfinished,
        )


@dataclass(frozen=True, slots=True)
class Verdict:
    """Level, message and key-values of one task for /diagnostics."""

    level: Level
    message: str
    values: dict[str, object]


class StreamWatch:
    """Judges whether a node's input is as it should be.

    Parameters
    ----------
    clock_s : callable
        Steady seconds.
    stale_after_s : float
        Silence after which the stream counts as stale.
    remember_s : float
        How long a trouble that is over is still told.
    log : callable
        Receives each new trouble once, as one line.
    what : str
        What the stream brings, for people.
    """

    def __init__(
        self,
        clock_s: Callable[[], float],
        stale_after_s: float,
        log: Callable[[str], None],
        remember_s: float = 10.0,
        what: str = "samples",
    ) -> None:
        self._clock_s = clock_s
        self._stale_after_s = stale_after_s
        self._remember_s = remember_s
        self._log = log
        self._what = what
        self._started_s = clock_s()
        self._last_s: float | None = None
        self._before = StreamStatus()
        self._trouble: tuple[float, str] | None = None
        self._said: dict[str, int] = {}
        self.batches = 0
        self.rejected = 0
        self.not_finite = 0

    @property
    def silent_s(self) -> float:
        """Seconds since the last batch of samples (or since the start)."""
        last = self._started_s if self._last_s is None else self._last_s
        return self._clock_s() - last

    @property
    def stale(self) -> bool:
        """True when no samples have come for too long."""
        return self.silent_s > self._stale_after_s

    def received(self, batch: Item) -> None:
        """A batch, or a message with indicators, arrived and could be read."""
        if not isinstance(batch, (SampleBatch, Features)):
            return
        self.batches += 1
        self._last_s = self._clock_s()
        if isinstance(batch, Features):
            return
        if not np.isfinite(batch.data).all():
            self.not_finite += 1
            bad = [c for c, row in zip(batch.channels, batch.data, strict=True) if not np.isfinite(row).all()]
            self.trouble("not finite", f"samples that are not finite on {', '.join(bad)}", batch.first_sample)

    def refused(self, topic: str, why: str) -> None:
        """A message on a topic could not be used."""
        self.rejected += 1
        self.trouble(f"refused {topic}", f"message on {topic} refused: {why}")

    def lasting(self, kind: str, words: str) -> None:
        """A trouble that persists; to be said again and again as long as it does, logged once."""
        self._trouble = (self._clock_s(), words)
        if kind not in self._said:
            self._said[kind] = 1
            self._log(words)

    def trouble(self, kind: str, words: str, sample: int | None = None) -> None:
        """Remember a trouble; it is logged when its kind has come 1, 2, 4, 8 ... times."""
        if sample is not None:
            words = f"{words} (sample {sample})"
        self._trouble = (self._clock_s(), words)
        count = self._said.get(kind, 0) + 1
        self._said[kind] = count
        if count & (count - 1) == 0:
            self._log(words if count == 1 else f"{words} - {count} times so far")

    def verdict(self, status: StreamStatus) -> Verdict:
        """How the stream is now, given the present counts."""
        self._notice(status)
        values: dict[str, object] = {
            "batches": self.batches,
            "windows": status.windows,
            "gaps": status.gaps,
            "lost samples": status.lost_samples,
            "duplicates": status.duplicates,
            "restarts": status.restarts,
            "layout changes": status.layout_changes,
            "refused messages": self.rejected,
            "batches not finite": self.not_finite,
            "windows without angle": status.windows_without_angle,
            "batches dropped for lack of time": status.dropped_batches,
            "signal waiting [s]": float(status.queued_s),
            "batches not analysed yet": status.unfinished_batches,
        }
        if self.stale:
            yet = " yet" if self._last_s is None else ""
            return Verdict(Level.STALE, f"no {self._what}{yet} for {self.silent_s:.0f} s", values)
        if self._trouble and self._clock_s() - self._trouble[0] <= self._remember_s:
            return Verdict(Level.WARN, self._trouble[1], values)
        if self._last_s is None:
            return Verdict(Level.OK, f"waiting for {self._what}", values)
        return Verdict(Level.OK, f"{self._what} arrive", values)

    def _notice(self, status: StreamStatus) -> None:
        before, self._before = self._before, status
        if status.dropped_batches > before.dropped_batches:
            self.trouble("slow", "the analysis cannot keep up: batches dropped")
        elif status.gaps > before.gaps or status.restarts > before.restarts:
            self.trouble("break", status.last_note)
        elif status.layout_changes > before.layout_changes:
            self.trouble("layout", status.last_note)
        elif status.windows_without_angle > before.windows_without_angle:
            self.lasting("angle", "windows without a complete tacho signal: the speed is less certain")


class StateKeeper:
    """The latched alarm state of a node, kept honest also when no window comes that could renew it."""

    def __init__(self, source: str) -> None:
        self.state = AlarmState(0, "", source, Level.OK, True, "no window judged yet", 0)
        self._judged: AlarmState | None = None
        self._trouble = ""
        self._lock = threading.Lock()

    def judged(self, state: AlarmState) -> None:
        """A window was judged and this is the state after it."""
        with self._lock:
            self.state = self._judged = state
            self._trouble = ""

    def changed(self, state: AlarmState) -> AlarmState:
        """Somebody acknowledged or reset alarms: the state to publish, with the trouble there is."""
        with self._lock:
            self._judged = state
            if self._trouble:
                state = replace(state, stale=True, note=self.state.note)
            self.state = state
            return state

    def troubled(self, kind: str, words: str) -> AlarmState | None:
        """What keeps the node from judging (`kind` empty: nothing); the state to publish if that is news."""
        with self._lock:
            if kind == self._trouble:
                return None
            self._trouble = kind
            if kind:
                self.state = replace(self.state, stale=True, note=words)
            elif self._judged is not None:
                self.state = self._judged
            else:
                return None
            return self.state
