"""How many samples are due: from a clock that is handed in, never from counted ticks.

Knows neither ROS nor threads. All times are seconds of one clock that never runs backwards.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from gearsim_io.health import Level

_WINDOW_S = 2.0


@dataclass(frozen=True, slots=True)
class PaceReport:
    """How the pacing goes.

    Attributes
    ----------
    lag_s : float
        Simulated seconds that are due and not yet made.
    achieved : float
        Simulated seconds per second of the clock over about the last two seconds, NaN before that is known.
    wanted : float
        The rate factor asked for; 0 means as fast as it goes.
    slipped_s : float
        Simulated seconds by which the schedule was put back because the machine could not keep up.
    keeping_up : bool
        False while samples are late by more than `late_s`, and for two seconds after the schedule was put
        back.
    """

    lag_s: float
    achieved: float
    wanted: float
    slipped_s: float
    keeping_up: bool


class Pacer:
    """Turns clock time into a number of samples.

    The schedule is a straight line: at `factor` times real time, sample n is due at start + n / (rate x
    factor). After a stall the number due is therefore as exact as the clock, and the samples missed are
    made at once. If samples are overdue by more than `max_lag_s`, the machine cannot keep up: the schedule
    is put back so that just `max_lag_s` remain. Simulated time then falls behind; no sample is ever left
    out or added.

    Parameters
    ----------
    rate_hz : float
        Samples per simulated second.
    factor : float
        Simulated seconds per second of the clock; 0 is as fast as it goes.
    max_lag_s : float
        Seconds of the clock by which samples may be late before the schedule is put back.
    late_s : float
        The same, above which the report says that the machine does not keep up.
    """

    def __init__(self, rate_hz: float, factor: float = 1.0, max_lag_s: float = 2.0, late_s: float = 0.5):
        if not (math.isfinite(factor) and factor >= 0):
            raise ValueError(f"rate factor {factor}: expected a finite number >= 0")
        self._rate_hz = rate_hz
        self._factor = factor
        self._max_lag_s = max_lag_s
        self._late_s = late_s
        self._made = 0
        self._anchor_s: float | None = None
        self._anchor_samples = 0.0
        self._paused = False
        self._slipped = 0
        self._last_slip_s = -math.inf
        self._history: deque[tuple[float, int]] = deque()

    @property
    def factor(self) -> float:
        """Rate factor asked for."""
        return self._factor

    @property
    def paused(self) -> bool:
        """True between `pause` and `resume`."""
        return self._paused

    @property
    def made(self) -> int:
        """Samples made so far."""
        return self._made

    def start(self, now_s: float) -> None:
        """Begin the schedule: sample 0 is due now. Does nothing if it has begun."""
        if self._anchor_s is None:
            self._anchor_s = now_s
            self._history.append((now_s, self._made))

    def due(self, now_s: float, most: int) -> int:
        """Samples to make now, at most `most`; 0 before `start` and while paused."""
        if self._anchor_s is None or self._paused:
            return 0
        if self._factor == 0:
            return most
        behind = self._target(now_s) - self._made
        most_behind = round(self._max_lag_s * self._rate_hz * self._factor)
        if behind > most_behind:
            self._slip(behind - most_behind, now_s)
            behind = most_behind
        return max(0, min(behind, most))

    def add(self, samples: int, now_s: float) -> None:
        """Tell that so many samples were made; `now_s` is the time after making them."""
        self._made += samples
        self._history.append((now_s, self._made))
        while len(self._history) > 2 and now_s - self._history[1][0] >= _WINDOW_S:
            self._history.popleft()

    def seconds_until(self, sample: int, now_s: float) -> float:
        """Clock seconds until that many samples are due; infinite before `start` and in a pause."""
        if self._anchor_s is None or self._paused:
            return math.inf
        if self._factor == 0:
            return 0.0
        due_s = self._anchor_s + (sample - self._anchor_samples) / (self._rate_hz * self._factor)
        return max(0.0, due_s - now_s)

    def set_factor(self, factor: float, now_s: float) -> None:
        """Change the rate factor from now on; what is due until now stays due."""
        if not (math.isfinite(factor) and factor >= 0):
            raise ValueError(f"rate factor {factor}: expected a finite number >= 0")
        self._anchor_at(now_s)
        self._factor = factor

    def pause(self, now_s: float) -> None:
        """Stop the schedule; what is due until now stays due after `resume`."""
        if not self._paused:
            self._anchor_at(now_s)
            self._paused = True

    def resume(self, now_s: float) -> None:
        """Let the schedule go on from now."""
        if self._paused:
            self._paused = False
            if self._anchor_s is not None:
                self._anchor_s = now_s
            self._history.clear()
            self._history.append((now_s, self._made))

    def report(self, now_s: float) -> PaceReport:
        """The state of the pacing."""
        lag = 0
        if self._anchor_s is not None and not self._paused and self._factor > 0:
            lag = max(0, self._target(now_s) - self._made)
        achieved = math.nan
        if self._history and now_s - self._history[0][0] > 0.1:
            first_s, first = self._history[0]
            achieved = (self._made - first) / self._rate_hz / (now_s - first_s)
        slipping = now_s - self._last_slip_s < _WINDOW_S
        return PaceReport(
            lag_s=lag / self._rate_hz,
            achieved=achieved,
            wanted=self._factor,
            slipped_s=self._slipped / self._rate_hz,
            keeping_up=lag <= self._late_s * self._rate_hz * self._factor and not slipping,
        )

    def _target(self, now_s: float) -> int:
        assert self._anchor_s is not None
        exact = self._anchor_samples + (now_s - self._anchor_s) * self._rate_hz * self._factor
        # A clock that was read a rounding error early must not hold back the sample that is due just now.
        return math.floor(exact + 1e-6)

    def _anchor_at(self, now_s: float) -> None:
        if self._anchor_s is None or self._paused:
            return
        if self._factor == 0:
            self._anchor_samples = float(self._made)
        else:
            self._anchor_samples += (now_s - self._anchor_s) * self._rate_hz * self._factor
        self._anchor_s = now_s

    def _slip(self, samples: int, now_s: float) -> None:
        self._anchor_samples -= samples
        self._slipped += samples
        self._last_slip_s = now_s


class StartGate:
    """Holds a stream back until its subscribers are there.

    Both sides of a connection do not learn of each other at the same moment; so the gate opens when nothing
    has changed for `settle_s`.

    Parameters
    ----------
    wanted : int
        Subscribers of the first stream to wait for; 0 opens at once.
    """

    def __init__(self, wanted: int, settle_s: float = 0.3) -> None:
        self._wanted = wanted
        self._settle_s = settle_s
        self._found: tuple[int, ...] = ()
        self._since_s = math.inf

    def is_open(self, subscribers: Sequence[int], now_s: float) -> bool:
        """True if the stream may begin, with so many subscribers of each of its parts now."""
        found = tuple(subscribers)
        if found != self._found or self._since_s == math.inf:
            self._found, self._since_s = found, now_s
        return self._wanted == 0 or (found[0] >= self._wanted and now_s - self._since_s >= self._settle_s)


def pace_status(pace: PaceReport, *, paused: bool) -> tuple[Level, str]:
    """Level and one line for people."""
    if paused:
        return Level.OK, "paused"
    if pace.wanted == 0:
        known = "" if math.isnan(pace.achieved) else f": {pace.achieved:.2f} x real time"
        return Level.OK, f"as fast as it goes{known}"
    if pace.keeping_up:
        return Level.OK, f"{pace.wanted:g} x real time"
    behind = pace.lag_s + pace.slipped_s
    wanted = f"{pace.achieved:.2f} x real time in place of {pace.wanted:g} x"
    return Level.WARN, f"cannot keep up: {wanted}, {behind:.1f} s behind"
