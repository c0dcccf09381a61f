"""The trend node: all indicators that other nodes publish, against the healthy machine and over time."""

from __future__ import annotations

from dataclasses import dataclass

from gearsim_dsp.nodes.learning import LearningNode, LearningParameters
from gearsim_dsp.nodes.parameters import AlarmParameters
from gearsim_dsp.streams.report import AlarmedMonitor
from gearsim_dsp.streams.trend_monitor import TrendMonitor, TrendSettings
from gearsim_io import qos
from gearsim_io.nameplate import Machine
from gearsim_io.nodes.parameters import parameter

SOURCE = "trend"
_DEFAULT = TrendSettings()


@dataclass(frozen=True)
class TrendParameters(LearningParameters, AlarmParameters):
    """Parameters of the trend node.

    A level needs eight of ten windows: a knock shows in the four windows of 2 s that share it.
    """

    raise_windows: int = parameter(8, "windows that must show a level ...", 1, 100)
    of_windows: int = parameter(10, "... among so many", 1, 100)
    clear_windows: int = parameter(16, "clean windows that end an alarm", 1, 10_000)
    hop_s: float = parameter(_DEFAULT.hop_s, "distance of the windows of the other nodes [s]", 0.01, 60.0)
    publish_s: float = parameter(_DEFAULT.publish_s, "stream time between two reports [s]", 0.1, 3600.0)
    sources: str = parameter(
        ",".join(_DEFAULT.sources),
        "nodes whose indicators can raise alarms; others are followed only",
    )

    def check(self) -> None:
        """Raise InputError where values contradict each other."""
        super().check()
        self.trend_settings()

    def trend_settings(self) -> TrendSettings:
        """The part for the monitor."""
        sources = tuple(name.strip() for name in self.sources.split(",") if name.strip())
        return TrendSettings(self.learn_s, self.learn_at_start, self.hop_s, self.publish_s, sources)


def make_monitor(machine: Machine, parameters: TrendParameters) -> AlarmedMonitor:
    """The monitor of a machine with its alarms, and with the baseline that is stored of it."""
    alarms = parameters.alarm_settings()
    monitor = TrendMonitor(machine, parameters.trend_settings(), SOURCE, alarms=alarms)
    parameters.recall(monitor.keeper, SOURCE)
    return AlarmedMonitor(monitor, alarms)


def make_node() -> LearningNode:
    """The node, once rclpy is ready."""
    return LearningNode(SOURCE, TrendParameters, make_monitor, (qos.FEATURES,))
