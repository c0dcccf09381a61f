"""One line for each step on stderr (stdout belongs to the commands), with the time it took."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO

NAME_WIDTH = 18
DETAIL_WIDTH = 52


class Step:
    """A step that is running: `now` shows how far it is, `done` what it came to."""

    def __init__(self, show: Callable[[str], None]) -> None:
        self._show = show
        self.result = "done"

    def now(self, detail: str) -> None:
        """Show a passing state; only on a terminal."""
        self._show(detail)

    def done(self, result: str) -> None:
        """Set what the step's final line says."""
        self.result = result


class Report:
    """Writes the lines of a set-up.

    Parameters
    ----------
    stream : TextIO, optional
        Where to; stderr unless given.
    clock : callable, optional
        Seconds from an arbitrary origin.
    """

    def __init__(self, stream: TextIO | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        self._stream = stream if stream is not None else sys.stderr
        self._clock = clock
        self._live = self._stream.isatty()
        self._begun = clock()

    def line(self, text: str) -> None:
        """Write one line."""
        self._stream.write(text + "\n")
        self._stream.flush()

    def total(self) -> float:
        """Seconds since this report began."""
        return self._clock() - self._begun

    @contextmanager
    def step(self, name: str) -> Iterator[Step]:
        """Time a step; its final line is written only when it succeeded."""
        begun = self._clock()

        def show(detail: str) -> None:
            if self._live:
                self._stream.write(f"\r\x1b[K  {name:<{NAME_WIDTH}}{detail[:DETAIL_WIDTH]}")
                self._stream.flush()

        step = Step(show)
        show("...")
        try:
            yield step
        except BaseException:
            if self._live:
                self._stream.write("\r\x1b[K")
            raise
        clear = "\r\x1b[K" if self._live else ""
        took = self._clock() - begun
        self.line(f"{clear}  {name:<{NAME_WIDTH}}{step.result:<{DETAIL_WIDTH}}{took:7.1f} s")
