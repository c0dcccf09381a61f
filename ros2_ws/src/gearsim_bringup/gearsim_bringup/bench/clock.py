"""Timing to be trusted on a shared machine: processor time of this process, the least of several runs."""

from __future__ import annotations

import time
from collections.abc import Callable


def cpu_seconds(work: Callable[[], object], repeats: int = 5) -> float:
    """Least processor time of `repeats` runs, after one that is not counted."""
    work()
    best = float("inf")
    for _ in range(repeats):
        began = time.process_time()
        work()
        best = min(best, time.process_time() - began)
    return best


def alternate(
    first: Callable[[], object], second: Callable[[], object], repeats: int = 5
) -> tuple[float, float]:
    """Least processor times of two pieces of work run in turns, so that drift of the machine hits both."""
    first(), second()
    best = [float("inf"), float("inf")]
    for _ in range(repeats):
        for index, work in enumerate((first, second)):
            began = time.process_time()
            work()
            best[index] = min(best[index], time.process_time() - began)
    return best[0], best[1]
