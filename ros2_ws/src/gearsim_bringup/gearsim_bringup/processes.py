"""Node processes of one graph: started together, watched, ended by their process id, none left behind."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType

ParameterValue = str | int | float | bool | Sequence[str]
_PR_SET_PDEATHSIG = 1
_ON_ITS_WAY_S = 0.3
_INTERRUPTED = 130
_STOP_STEPS = ((signal.SIGINT, 8.0), (signal.SIGTERM, 4.0), (signal.SIGKILL, 4.0))


@dataclass(frozen=True)
class NodeSpec:
    """What to start: a module with a `main()`, its parameters and topic remappings."""

    name: str
    module: str
    parameters: Mapping[str, ParameterValue] = field(default_factory=dict)
    remappings: Mapping[str, str] = field(default_factory=dict)
    namespace: str = "/gearsim"

    def arguments(self) -> list[str]:
        """Its arguments, in ROS 2's syntax."""
        words = ["--ros-args", "-r", f"__ns:={self.namespace}"]
        for key, value in self.parameters.items():
            words += ["-p", f"{key}:={_yaml(value)}"]
        for source, target in self.remappings.items():
            words += ["-r", f"{source}:={target}"]
        return words

    def command(self) -> list[str]:
        """The whole command line."""
        return [sys.executable, "-m", self.module, *self.arguments()]


def run_here(main: Callable[..., int], spec: NodeSpec) -> int:
    """Run a node in this process, by its `main`; the exit status.

    Raises
    ------
    KeyboardInterrupt
        If a signal ended it, once it has ended in good order.
    """
    status = main(["gearsim", *spec.arguments()], told_status=_INTERRUPTED)
    if status == _INTERRUPTED:
        raise KeyboardInterrupt
    return status


class NodeProcess:
    """One running node; its output goes to `log`."""

    def __init__(self, spec: NodeSpec, log: Path, environment: Mapping[str, str] | None = None) -> None:
        self.spec = spec
        self.log = log
        log.parent.mkdir(parents=True, exist_ok=True)
        with log.open("wb") as sink:
            self._process = subprocess.Popen(
                spec.command(),
                stdin=subprocess.DEVNULL,
                stdout=sink,
                stderr=subprocess.STDOUT,
                # Unbuffered, so that the log has its lines in the order in which they were said.
                env={**(environment or os.environ), "PYTHONUNBUFFERED": "1"},
                # A session of its own: the terminal's Ctrl-C reaches us alone, and we end the nodes in order.
                start_new_session=True,
                preexec_fn=_die_with_parent,
            )

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def returncode(self) -> int | None:
        """Exit status, None while it runs."""
        return self._process.poll()

    def wait(self, seconds: float) -> bool:
        """True once it has ended."""
        try:
            self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            return False
        return True

    def send(self, signum: int) -> None:
        """Send a signal, if it still runs."""
        if self._process.poll() is None:
            self._process.send_signal(signum)

    def stop(self) -> int:
        """End it: asked first, then told, then killed. Returns its exit status."""
        for signum, patience in _STOP_STEPS:
            self.send(signum)
            if self.wait(patience):
                break
        return int(self._process.wait())

    def last_words(self) -> str:
        """The last line it printed, for an error message."""
        lines = self.log.read_text(errors="replace").strip().splitlines()
        return lines[-1].strip() if lines else "(it printed nothing)"


class Graph:
    """The processes of a graph as a context: whatever happens inside, all of them are ended."""

    def __init__(self, log_dir: Path, environment: Mapping[str, str] | None = None) -> None:
        self._log_dir = log_dir
        self._environment = environment
        self.processes: list[NodeProcess] = []

    def start(self, spec: NodeSpec) -> NodeProcess:
        """Start one more node."""
        process = NodeProcess(spec, self._log_dir / f"{spec.name}.log", self._environment)
        self.processes.append(process)
        return process

    def failed(self) -> NodeProcess | None:
        """The first process that ended with an error, if any."""
        return next((p for p in self.processes if p.returncode() not in (None, 0)), None)

    def stop(self) -> None:
        """End all processes, the last one started first.

        Sinks are started before sources and end after them, so that they still receive what is on its way.
        """
        for index, process in enumerate(reversed(self.processes)):
            if index == 1:
                time.sleep(_ON_ITS_WAY_S)
            process.stop()

    def __enter__(self) -> Graph:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()


def _die_with_parent() -> None:
    # If we are killed outright, the kernel ends the nodes for us.
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


def _yaml(value: ParameterValue) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return "'" + value.replace("'", "''") + "'"
    if isinstance(value, (int, float)):
        return repr(value)
    return "[" + ", ".join(_yaml(item) for item in value) + "]"
