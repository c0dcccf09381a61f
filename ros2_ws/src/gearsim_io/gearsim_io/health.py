"""How a node feels, by REP-107: statuses of its tasks, sent once a second and at once when a level changes.

Knows no ROS: `gearsim_io.nodes.health` publishes what `Health` hands to its sink.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum


class Level(IntEnum):
    """Level of a status or an alarm, with the numbers of `diagnostic_msgs/DiagnosticStatus`."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True, slots=True)
class Status:
    """One status of one task; `name` is "node: task" and `values` are key-value pairs of text."""

    name: str
    hardware_id: str
    level: Level
    message: str
    values: tuple[tuple[str, str], ...] = ()


class Health:
    """Keeps the latest status of each task of a node and decides when they are to be sent.

    Parameters
    ----------
    node : str
        Name of the node, the first half of each status's name.
    hardware_id : str
        What the node looks after, such as the machine's name; may be set later.
    clock_s : callable
        Seconds that never run backwards (a steady clock).
    sink : callable
        Receives the statuses to be sent, never an empty tuple.
    period_s : float
        Distance of two full reports.
    """

    def __init__(
        self,
        node: str,
        hardware_id: str,
        clock_s: Callable[[], float],
        sink: Callable[[tuple[Status, ...]], None],
        period_s: float = 1.0,
    ) -> None:
        self.node = node
        self.hardware_id = hardware_id
        self._clock_s = clock_s
        self._sink = sink
        self._period_s = period_s
        self._tasks: dict[str, tuple[Level, str, tuple[tuple[str, str], ...]]] = {}
        self._last_full_s: float | None = None

    def report(
        self, task: str, level: Level, message: str, values: Mapping[str, object] | None = None
    ) -> None:
        """Set the status of a task; it goes out at once if the task is new or its level changed."""
        pairs = tuple((key, _text(value)) for key, value in (values or {}).items())
        before = self._tasks.get(task)
        self._tasks[task] = (level, message, pairs)
        if before is None or before[0] != level:
            self._sink((self._status(task),))

    def level(self, task: str) -> Level | None:
        """Level last reported of a task, None if it never was."""
        entry = self._tasks.get(task)
        return None if entry is None else entry[0]

    def tick(self) -> bool:
        """Send all statuses if a period has passed since the last time; True if it did.

        May be called at any pace; a late call sends once, it does not catch up.
        """
        now_s = self._clock_s()
        if self._last_full_s is not None and now_s - self._last_full_s < self._period_s - 1e-3:
            return False
        self._last_full_s = now_s
        if not self._tasks:
            return False
        self._sink(tuple(self._status(task) for task in self._tasks))
        return True

    def _status(self, task: str) -> Status:
        level, message, values = self._tasks[task]
        return Status(f"{self.node}: {task}", self.hardware_id, level, message, values)


def _text(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
