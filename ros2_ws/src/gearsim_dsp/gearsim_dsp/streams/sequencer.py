"""Puts the batches of one topic into the order of their sample indices and says where the stream breaks.

Decisions rest on indices and stamps alone, never on when a batch arrived, so the same batches give the
same output live and on replay.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Generic, Protocol, TypeVar

__all__ = ["Link", "Sequenced", "Sequencer", "SequencerCounts"]


class _Block(Protocol):
    """A stretch of the sample index: [first_sample, end_sample), stamped at its first sample."""

    @property
    def t0_ns(self) -> int: ...
    @property
    def sample_rate_hz(self) -> float: ...
    @property
    def first_sample(self) -> int: ...
    @property
    def end_sample(self) -> int: ...


B = TypeVar("B", bound=_Block)


class Link(Enum):
    """How a batch follows the one before it."""

    START = "first of the stream"
    NEXT = "without a gap"
    GAP = "after lost samples"
    RESTART = "the stream began again"


@dataclass(frozen=True, slots=True)
class Sequenced(Generic[B]):
    """A batch in order, with its link to its predecessor and the samples lost between the two."""

    batch: B
    link: Link
    lost: int = 0


@dataclass(slots=True)
class SequencerCounts:
    """What happened since the start."""

    duplicates: int = 0
    gaps: int = 0
    lost_samples: int = 0
    restarts: int = 0


class Sequencer(Generic[B]):
    """Orders batches, drops what came twice, reports gaps and restarts.

    A batch that runs ahead is kept until the missing one arrives or `hold_s` of signal is waiting; only
    then a gap is declared. A batch that lies back by at most `late_s` is a duplicate or hopelessly late and
    is dropped. One that lies further back may be a stray or a new start of the stream (a player's loop, a
    new simulator): the next batch tells.

    Parameters
    ----------
    trim : callable
        `trim(batch, first_sample)`: the part of a batch from an index inside it, for overlapping batches.
    hold_s, late_s : float
        Limits in seconds of signal.
    """

    STAMP_TOLERANCE_NS = 100_000_000  # of the moment at which sample 0 would have been taken

    def __init__(self, trim: Callable[[B, int], B], hold_s: float = 0.25, late_s: float = 0.5) -> None:
        self._trim = trim
        self._hold_s = hold_s
        self._late_s = late_s
        self._expected: int | None = None
        self._origin_ns = 0
        self._ahead: dict[int, B] = {}
        self._suspect: B | None = None
        self.counts = SequencerCounts()

    def push(self, batch: B) -> list[Sequenced[B]]:
        """Take one batch; return those that are in order now (none, one or several)."""
        if self._suspect is not None:
            suspect, self._suspect = self._suspect, None
            if batch.first_sample == suspect.end_sample or self._is_restart(batch):
                return [*self._restart(suspect), *self.push(batch)]
            self.counts.duplicates += 1
        if self._expected is None:
            return [self._accept(batch, Link.START, 0)]
        if batch.first_sample > self._expected:
            return self._hold(batch)
        if self._is_restart(batch):
            self._suspect = batch
            return []
        if batch.end_sample <= self._expected:
            self.counts.duplicates += 1
            return []
        return [self._accept(batch, Link.NEXT, 0), *self._release()]

    def finish(self) -> list[Sequenced[B]]:
        """The end of the input: give out what is still held."""
        out = self._release(force=True)
        if self._suspect is not None:
            suspect, self._suspect = self._suspect, None
            out += self._restart(suspect)
        return out

    def _is_restart(self, batch: B) -> bool:
        assert self._expected is not None
        back = self._expected - batch.first_sample
        if back <= 0:
            return False
        if back > self._late_s * batch.sample_rate_hz and batch.end_sample < self._expected:
            return True
        return abs(_origin_ns(batch) - self._origin_ns) > self.STAMP_TOLERANCE_NS

    def _restart(self, batch: B) -> list[Sequenced[B]]:
        out = self._release(force=True)
        self.counts.restarts += 1
        self._expected = None
        return [*out, self._accept(batch, Link.RESTART, 0)]

    def _hold(self, batch: B) -> list[Sequenced[B]]:
        if batch.first_sample in self._ahead:
            self.counts.duplicates += 1
            return []
        self._ahead[batch.first_sample] = batch
        waiting = sum(b.end_sample - b.first_sample for b in self._ahead.values())
        return self._release(force=waiting > self._hold_s * batch.sample_rate_hz)

    def _release(self, force: bool = False) -> list[Sequenced[B]]:
        """Batches held ahead that follow now; with `force` all of them, across gaps."""
        out: list[Sequenced[B]] = []
        while self._ahead:
            assert self._expected is not None
            first = min(self._ahead)
            lost = first - self._expected
            if lost > 0 and not force:
                break
            batch = self._ahead.pop(first)
            if batch.end_sample <= self._expected:
                self.counts.duplicates += 1
            elif lost > 0:
                self.counts.gaps += 1
                self.counts.lost_samples += lost
                out.append(self._accept(batch, Link.GAP, lost))
            else:
                out.append(self._accept(batch, Link.NEXT, 0))
        return out

    def _accept(self, batch: B, link: Link, lost: int) -> Sequenced[B]:
        if self._expected is not None and batch.first_sample < self._expected:
            batch = self._trim(batch, self._expected)
        self._expected = batch.end_sample
        self._origin_ns = _origin_ns(batch)
        return Sequenced(batch, link, lost)


def _origin_ns(batch: _Block) -> int:
    """When sample 0 would have been taken: constant within one run of a source, whatever is lost."""
    return batch.t0_ns - round(batch.first_sample * 1e9 / batch.sample_rate_hz)
