"""Messages on their way out: in order, and kept when the middleware refuses one for now."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any


class Outbox:
    """A queue between a producer and a transport that may refuse under pressure.

    Parameters
    ----------
    refusal : type of exception
        What the transport raises when it refuses for now.
    room : int
        Messages that may wait; beyond it `full` tells the producer to wait too.
    """

    def __init__(self, refusal: type[Exception], room: int = 200) -> None:
        self._refusal = refusal
        self._room = room
        self._waiting: deque[tuple[Callable[[Any], None], Any]] = deque()
        self.sent = 0
        self.refused = 0
        self.last_refusal = ""

    @property
    def waiting(self) -> int:
        """Messages that have not gone out yet."""
        return len(self._waiting)

    @property
    def full(self) -> bool:
        """True while the producer should wait."""
        return len(self._waiting) >= self._room

    def put(self, send: Callable[[Any], None], message: Any) -> None:
        """Queue a message behind the others; `send(message)` will be called by `flush`."""
        self._waiting.append((send, message))

    def flush(self) -> bool:
        """Send what waits until one is refused; True if nothing waits any more."""
        while self._waiting:
            send, message = self._waiting[0]
            try:
                send(message)
            except self._refusal as error:
                self.refused += 1
                self.last_refusal = " ".join(str(error).split())
                return False
            self._waiting.popleft()
            self.sent += 1
        return True
