"""A replay without ROS: which message is due when, at any rate, with pauses and in a loop."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator

from gearsim_io.bags.reader import BagMessage

_STEP_S = 0.1


class Timeline:
    """Maps bag time to a steady clock; may be used from several threads.

    Parameters
    ----------
    clock_s : callable
        Seconds of a steady clock.
    rate : float
        Bag seconds per second, above 0.
    paused : bool
        Whether to begin with a pause.
    """

    def __init__(self, clock_s: Callable[[], float], rate: float = 1.0, paused: bool = False) -> None:
        self._clock_s = clock_s
        self._rate = rate
        self._paused = paused
        self._anchor_bag_ns: int | None = None
        self._anchor_s = 0.0
        self._lock = threading.RLock()

    @property
    def paused(self) -> bool:
        """Whether bag time stands still."""
        return self._paused

    @property
    def rate(self) -> float:
        """Bag seconds per second."""
        return self._rate

    def start(self, t_ns: int) -> None:
        """Bag time is `t_ns` now; also at the start of each loop."""
        with self._lock:
            self._anchor_bag_ns, self._anchor_s = t_ns, self._clock_s()

    def now_ns(self) -> int:
        """Bag time now; 0 before the start."""
        with self._lock:
            if self._anchor_bag_ns is None:
                return 0
            if self._paused:
                return self._anchor_bag_ns
            return self._anchor_bag_ns + round((self._clock_s() - self._anchor_s) * self._rate * 1e9)

    def wait_s(self, t_ns: int) -> float:
        """How long to wait until bag time is `t_ns`: 0 if it is due, infinity in a pause."""
        with self._lock:
            if self._paused:
                return float("inf")
            return max(0.0, (t_ns - self.now_ns()) / 1e9 / self._rate)

    def set_rate(self, rate: float) -> None:
        """Go on from here at another rate."""
        with self._lock:
            self._settle()
            self._rate = rate

    def set_paused(self, paused: bool) -> None:
        """Stop here, or go on from here."""
        with self._lock:
            self._settle()
            self._paused = paused

    def _settle(self) -> None:
        if self._anchor_bag_ns is not None:
            self.start(self.now_ns())


class Playback:
    """Sends messages when they are due.

    Parameters
    ----------
    timeline : Timeline
    messages : callable
        Gives the messages from the beginning, once for each loop.
    send : callable
        Takes a message that is due.
    loop : bool
        Begin again at the end.
    """

    def __init__(
        self,
        timeline: Timeline,
        messages: Callable[[], Iterator[BagMessage]],
        send: Callable[[BagMessage], None],
        loop: bool = False,
    ) -> None:
        self.loops = 0
        self._timeline = timeline
        self._messages = messages
        self._send = send
        self._loop = loop
        self._wake = threading.Event()
        self._stopped = False

    @property
    def stopped(self) -> bool:
        """Whether `stop` was called."""
        return self._stopped

    def stop(self) -> None:
        """Send nothing more; `run` returns soon."""
        self._stopped = True
        self._wake.set()

    def wake(self) -> None:
        """Look at the timeline again, as its rate or pause has changed."""
        self._wake.set()

    def run(self) -> None:
        """Play to the end, or until `stop`."""
        while not self._stopped:
            self._play_once()
            self.loops += 1
            if not self._loop:
                return

    def _play_once(self) -> None:
        fresh = True
        for message in self._messages():
            if fresh:
                self._timeline.start(message.t_ns)
                fresh = False
            if not self._wait_until(message.t_ns):
                return
            self._send(message)

    def _wait_until(self, t_ns: int) -> bool:
        """Sleep until a message is due; False if it is not to be sent any more."""
        while not self._stopped:
            wait_s = self._timeline.wait_s(t_ns)
            if wait_s <= 0.0:
                return True
            self._wake.wait(min(wait_s, _STEP_S))
            self._wake.clear()
        return False
