"""The live graph: which nodes run with which parameters, and what a command sees of them."""

from __future__ import annotations

import json
import shutil
import signal
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gearsim_bringup.monitoring.choice import MONITORS, Choice
from gearsim_bringup.processes import Graph, NodeProcess, NodeSpec
from gearsim_bringup.quiet import Quiet
from gearsim_bringup.ui import JobFailedError
from gearsim_io import qos
from gearsim_io.errors import InputError

__all__ = ["MONITORS", "BadNodeError", "Choice", "LiveRun", "Outcome", "player", "simulator"]

# A twin that was never run compiles first, which takes up to a minute.
_READY_S = 150.0
# In which another rig in this domain makes itself known, as a rule. At times the middleware's first greetings
# are lost and the next come after 3 s: so the run keeps looking.
_DISCOVERY_S = 1.0
_PATIENCE_S = 60.0
_INTERRUPTED = (130, -signal.SIGINT)
_WATCHERS = 1  # this process hears the alarms itself


@dataclass
class LiveRun:
    """One run of a graph.

    Parameters
    ----------
    source : NodeSpec
        Simulator or player.
    log_dir : Path
        Where the nodes' output goes.
    bag : Path, optional
        Records to there.
    custom_data : mapping
        Kept in the bag.
    rrd : Path, optional
        Shows the run as a rerun recording.
    on_alarm, on_truth : callable, optional
        Called with each message as it arrives.
    choice : Choice
        Which diagnostic nodes run, and who passes their results on.
    """

    source: NodeSpec
    log_dir: Path
    bag: Path | None = None
    custom_data: Mapping[str, str] = field(default_factory=dict)
    rrd: Path | None = None
    on_alarm: Callable[[Any], None] | None = None
    on_truth: Callable[[Any], None] | None = None
    choice: Choice = field(default_factory=Choice)

    def sinks(self) -> list[NodeSpec]:
        """Everything that listens, in the order in which it starts."""
        specs = []
        if self.bag is not None:
            values = {"bag": str(self.bag), "custom_data": json.dumps(dict(self.custom_data))}
            specs.append(NodeSpec("recorder", "gearsim_io.nodes.recorder", values))
        if self.rrd is not None:
            specs.append(NodeSpec("viewer", "gearsim_io.nodes.viewer", {"out": str(self.rrd)}))
        return [*specs, *self.choice.specs(alarm_listeners=len(specs) + _WATCHERS)]

    def run(self, on_start: Callable[[Graph], None] | None = None) -> Outcome:
        """Run until the source ends by itself, or Ctrl-C. `on_start` is told when all processes are up.

        Raises
        ------
        InputError
            If another rig publishes already, or a node was given bad parameters.
        JobFailedError
            If a node ends with an error.
        """
        from gearsim_bringup.nodes.watcher import Watcher

        outcome, quiet = Outcome(), Quiet(self.choice.monitors)
        with (
            Watcher(self.on_alarm, self.on_truth, quiet.status) as watcher,
            Graph(self.log_dir) as graph,
        ):
            watcher.spin(_DISCOVERY_S, lambda: bool(watcher.publishers_of(qos.ACCEL)))
            if watcher.publishers_of(qos.ACCEL):
                raise _other_rig()
            for spec in self.sinks():
                graph.start(spec)
            source = graph.start(self.source)
            if on_start is not None:
                on_start(graph)
            self._watch(watcher, graph, source)
            outcome.late = _drain(watcher, graph, quiet)
            graph.stop()
            watcher.spin(0.5)
            outcome.seen = watcher.seen
        self._check(graph)
        return outcome

    def _watch(self, watcher: Any, graph: Graph, source: NodeProcess) -> None:
        def over() -> bool:
            return source.returncode() is not None or graph.failed() is not None

        def two() -> bool:
            return bool(watcher.publishers_of(qos.ACCEL) > 1)

        try:
            watcher.spin(float("inf"), lambda: over() or two())
            if two():
                graph.stop()
                self._remove_files()
                raise _other_rig()
        except KeyboardInterrupt:
            graph.stop()
            self._check(graph)
            raise

    def _remove_files(self) -> None:
        """Take away what was recorded of two rigs mixed."""
        if self.bag is not None:
            shutil.rmtree(self.bag, ignore_errors=True)
        if self.rrd is not None:
            self.rrd.unlink(missing_ok=True)

    def _check(self, graph: Graph) -> None:
        failed = graph.failed()
        if failed is None:
            return
        if failed.returncode() in _INTERRUPTED:  # Ctrl-C reached the node before it reached this process
            raise KeyboardInterrupt
        words = failed.last_words()
        if failed.returncode() == 2:
            name, _, rest = words.partition(": ")
            raise BadNodeError(rest if name == failed.spec.name else words)
        raise JobFailedError(f"node {failed.spec.name} ended with status {failed.returncode()}: {words}")


def _drain(watcher: Any, graph: Graph, quiet: Quiet) -> str:
    """Wait for what the last samples lead to, be it in a second or on a busy computer in a minute.

    Returns the nodes that did not come to it, in words.
    """
    quiet.restart()
    watcher.spin(_PATIENCE_S, lambda: quiet.reached or quiet.stuck or graph.failed() is not None)
    return quiet.words


def _other_rig() -> InputError:
    expected = "none; end the other rig, or set another ROS_DOMAIN_ID"
    return InputError(qos.ACCEL.full_name, "publishers", "one already", expected)


class BadNodeError(InputError):
    """A node's own one-line complaint about its input, passed on as it is."""

    def __init__(self, line: str) -> None:
        self._line = line
        super().__init__(line, "", "", "")

    def __str__(self) -> str:
        return self._line


@dataclass
class Outcome:
    """What a run brought; `seen` as in `nodes.watcher`.

    `late` names the diagnostic nodes that had not judged all samples long after the last one, empty if all
    had: their last alarms are missing.
    """

    seen: Any = None
    late: str = ""

    @property
    def warning(self) -> str:
        """For people; empty where there is nothing to warn of."""
        if not self.late:
            return ""
        return f"not judged to the end, so alarms may be missing: {self.late}"


def simulator(scenario: str, *, end_after: float, rate: float | None, listeners: int) -> NodeSpec:
    """The simulator as a source; `listeners` subscribers of accel must be there before sample 0."""
    parameters: dict[str, Any] = {
        "scenario": scenario,
        "end_after": float(end_after),
        "wait_for_subscribers": listeners,
    }
    if rate is not None:
        parameters["rate_factor"] = float(rate)
    return NodeSpec("simulator", "gearsim_sim.nodes.simulator", parameters)


def player(bag: Path, *, rate: float, loop: bool, listeners: int, signals_only: bool) -> NodeSpec:
    """The player as a source; `listeners` subscribers of accel must be there before the first message."""
    parameters: dict[str, Any] = {
        "bag": str(bag),
        "rate": float(rate),
        "loop": loop,
        "signals_only": signals_only,
    }
    if listeners:
        parameters |= {
            "wait_for": [qos.ACCEL.full_name],
            "min_subscribers": listeners,
            "wait_timeout_s": _READY_S,
        }
    return NodeSpec("player", "gearsim_io.nodes.player", parameters)
