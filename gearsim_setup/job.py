"""One run of set-up: where, with which ROS, telling whom."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from gearsim_setup.command import last_lines, run_logged
from gearsim_setup.places import Places
from gearsim_setup.problems import SetupProblem
from gearsim_setup.report import Report
from gearsim_setup.route import WHEELS


@dataclass(frozen=True)
class Job:
    """What every step of a set-up needs.

    Parameters
    ----------
    places : Places
        The repository.
    route : str
        Where ROS comes from, as `find_route` tells it.
    report : Report
        Where the steps are told.
    keep_open : tuple of int
        Descriptors that the tools inherit, see `run_logged`.
    """

    places: Places
    route: str
    report: Report = field(default_factory=Report)
    keep_open: tuple[int, ...] = ()

    @property
    def on_wheels(self) -> bool:
        """Whether ROS comes from the wheels and not from a distribution."""
        return self.route == WHEELS

    def log(self, name: str) -> Path:
        """The log file of that name."""
        return self.places.logs / f"{name}.log"

    def run(
        self,
        argv: Sequence[str],
        log_name: str,
        env: Mapping[str, str],
        cwd: Path | None = None,
        on_line: Callable[[str], None] | None = None,
    ) -> int:
        """Run a tool with its output in a log, and return its exit status."""
        log = self.log(log_name)
        return run_logged(argv, log=log, env=env, cwd=cwd, on_line=on_line, keep_open=self.keep_open)

    def failed(self, what: str, log_name: str) -> SetupProblem:
        """The problem to raise when a tool failed: what, why in short, and where the long story is."""
        log = self.log(log_name)
        return SetupProblem(f"{what}: {last_lines(log)}; the whole log is {self.places.short(log)}")
