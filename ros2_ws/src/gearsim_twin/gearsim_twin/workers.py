"""Processes that work for one, and end when they are told to: also in the middle of a simulation."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any, TypeVar

__all__ = ["StoppedError", "WorkerLostError", "Workers", "check_stop"]

A = TypeVar("A")
R = TypeVar("R")

_PATIENCE_S = 1.0
# The flag of this process, if it is a worker.
_flag: Any = None


class StoppedError(RuntimeError):
    """The work was given up, as nobody waits for it any more."""


class WorkerLostError(RuntimeError):
    """A process ended by itself, such as one that the system killed for memory."""


def check_stop() -> None:
    """Called by what runs in a worker, often: StoppedError once the work is to be given up."""
    if _flag is not None and _flag.is_set():
        raise StoppedError("given up")


class Workers:
    """Fresh processes, started when there is work.

    Parameters
    ----------
    count : int
        Processes.

    Notes
    -----
    Fresh ones, because compiled loops and their thread pools do not survive a fork; a program that uses them
    must be importable without running (`if __name__ == "__main__"`). An interrupt from the keyboard reaches
    this process alone, which then tells the others.
    """

    def __init__(self, count: int) -> None:
        self._context = _Remembering()
        self._count = count
        self._stop = self._context.Event()
        self._executor = ProcessPoolExecutor(count, self._context, _begin, (self._stop,))

    def map(self, function: Callable[[A], R], arguments: Sequence[A]) -> list[R]:
        """`function` of each argument, in their order; both must be picklable.

        Raises
        ------
        WorkerLostError
            If a process ended.
        """
        try:
            futures = [self._executor.submit(function, argument) for argument in arguments]
            return [future.result() for future in futures]
        except BrokenProcessPool as error:
            raise WorkerLostError(str(error)) from error

    def wake(self) -> None:
        """Start all processes now."""
        for _ in range(self._count):
            self._executor.submit(_load)

    def close(self) -> None:
        """End all processes; what they work at is given up."""
        self._stop.set()
        # A process that does not hear it soon is loading its libraries, or within a long calculation.
        timer = threading.Timer(_PATIENCE_S, self._context.terminate)
        timer.start()
        self._executor.shutdown(wait=True, cancel_futures=True)
        timer.cancel()
        timer.join()


class _DeafProcess(SpawnProcess):
    """A fresh process that interrupts from the keyboard do not reach, also while it starts."""

    def start(self) -> None:
        """Start with the signal blocked, which the new process inherits."""
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            super().start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Remembering(SpawnContext):
    """Starts such processes, and remembers them."""

    def __init__(self) -> None:
        super().__init__()
        self._started: list[_DeafProcess] = []

    def Process(self, *args: Any, **kwargs: Any) -> SpawnProcess:  # type: ignore[override]
        """A process that is not yet started."""
        process = _DeafProcess(*args, **kwargs)
        self._started.append(process)
        return process

    def terminate(self) -> None:
        """End those that run."""
        for process in self._started:
            if process.is_alive():
                process.terminate()


def _load() -> None:
    """In a worker: load what simulations need."""
    import gearsim_twin.compare.features  # noqa: F401


def _begin(flag: Any) -> None:
    global _flag
    _flag = flag
