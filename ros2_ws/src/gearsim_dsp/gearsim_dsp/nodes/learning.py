"""What the nodes that judge by a learnt baseline share: where it is kept, learning when asked, saying so."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gearsim_dsp.nodes.base import MonitorNode
from gearsim_dsp.nodes.parameters import AlarmParameters
from gearsim_dsp.nodes.services import BaselineService
from gearsim_dsp.results import Alarm
from gearsim_dsp.streams.baseline import Baseline, load_baseline, save_baseline
from gearsim_dsp.streams.baseline_keeper import BaselineKeeper
from gearsim_dsp.streams.report import AlarmedMonitor, Outcome
from gearsim_io import qos
from gearsim_io.errors import InputError
from gearsim_io.messages import from_msg
from gearsim_io.nameplate import Machine
from gearsim_io.nodes.health import Level
from gearsim_io.nodes.parameters import parameter

BASELINES = "gearsim/baselines"


@dataclass(frozen=True)
class LearningParameters:
    """Parameters of a node that learns; to be mixed into those of its alarms."""

    learn_s: float = parameter(60.0, "stream time that a baseline is learnt from [s]", 1.0, 1e7)
    learn_at_start: bool = parameter(True, "learn from the start where no baseline is stored")
    baseline_dir: str = parameter("", "folder of stored baselines; empty: ~/.local/share/gearsim/baselines")

    def baseline_path(self, machine: str, source: str) -> Path:
        """The file of a machine's baseline."""
        data = os.environ.get("XDG_DATA_HOME", "") or str(Path.home() / ".local" / "share")
        folder = Path(self.baseline_dir or Path(data) / BASELINES)
        safe = "".join(c if c.isalnum() or c in "-_." else "_" for c in machine)
        return folder / f"{safe}.{source}.json"

    def recall(self, keeper: BaselineKeeper, source: str) -> None:
        """Give a keeper what is stored of its machine, or tell it why that cannot be used."""
        path = self.baseline_path(keeper.machine, source)
        if not path.exists():
            return
        try:
            keeper.recall(load_baseline(path, keeper.machine))
        except InputError as error:
            keeper.refuse(str(error))


class LearningNode(MonitorNode):
    """A monitor with a baseline, which is stored as soon as it is learnt.

    `make_monitor` makes a monitor that has a `keeper`.
    """

    def __init__(
        self,
        source: str,
        parameters: type[AlarmParameters],
        make_monitor: Callable[[Machine, Any], AlarmedMonitor],
        inputs: tuple[qos.Topic, ...] = (qos.ACCEL, qos.TACHO),
    ) -> None:
        super().__init__(source, parameters, make_monitor, inputs)
        self._source = source
        self._stored: Baseline | None = None
        self._store_error = ""
        self._trends = qos.create_publisher(self, qos.TRENDS)
        self._learn_service = BaselineService(self, self._learn)
        qos.create_subscription(self, qos.ALARM, self._on_alarm)

    @property
    def _baseline(self) -> BaselineKeeper | None:
        return None if self._monitor is None else self._monitor.monitor.keeper  # type: ignore[attr-defined]

    def _learn(self, seconds: float, extend: bool) -> str:
        with self._judging:
            keeper = self._baseline
            if keeper is None:
                raise InputError("learn_baseline", "machine", "none", "a nameplate and samples to learn from")
            keeper.learn(seconds, extend=extend)
            return f"baseline: {keeper.words}"

    def _on_alarm(self, msg: Any) -> None:
        if msg.source == self._source or msg.level not in (Level.WARN, Level.ERROR):
            return
        alarm = from_msg(msg, Alarm)
        with self._judging:
            keeper = self._baseline
            why = f"as an alarm came: {alarm.reason}"
            if keeper is not None and keeper.disturb(why):
                self.get_logger().warning(f"learning was given up, {why}")

    def _publish(self, outcome: Outcome) -> None:
        super()._publish(outcome)
        if outcome.report.trends is not None:
            self._send(self._trends, outcome.report.trends)
        keeper = self._baseline
        if keeper is not None and keeper.learnt is not None and keeper.learnt is not self._stored:
            self._store(keeper.learnt)

    def _store(self, baseline: Baseline) -> None:
        self._stored = baseline
        path = self._given.baseline_path(baseline.machine, self._source)
        try:
            save_baseline(baseline, path)
            self._store_error = ""
            self.get_logger().info(f"baseline learnt from {baseline.seconds:.0f} s and stored in {path}")
        except OSError as error:
            self._store_error = f"the baseline could not be stored in {path}: {error.strerror}"
            self.get_logger().error(self._store_error)

    def _tick(self) -> None:
        super()._tick()
        keeper = self._baseline
        if keeper is None:
            self._health.report("baseline", Level.OK, "waiting for a nameplate and samples")
            return
        level = Level.OK if keeper.learning or keeper.baseline is not None else Level.WARN
        if self._store_error:
            level = Level.WARN
        path = self._given.baseline_path(keeper.machine, self._source)
        values = {"file": str(path), "indicators that alarms depend on": keeper.tests}
        self._health.report("baseline", level, self._store_error or keeper.words, values)
