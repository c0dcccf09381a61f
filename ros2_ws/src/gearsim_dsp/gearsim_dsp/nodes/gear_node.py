"""The gear node: synchronous averages of all shafts, indicators of gears and shafts, alarms."""

from __future__ import annotations

from dataclasses import dataclass, replace

from gearsim_dsp.nodes.learning import LearningNode, LearningParameters
from gearsim_dsp.nodes.parameters import MonitorParameters
from gearsim_dsp.streams.fitting import for_gears
from gearsim_dsp.streams.gear_monitor import GearMonitor, GearSettings
from gearsim_dsp.streams.report import AlarmedMonitor
from gearsim_io.nameplate import Machine
from gearsim_io.nodes.parameters import parameter

SOURCE = "gear"
_DEFAULT = GearSettings()


@dataclass(frozen=True)
class GearParameters(LearningParameters, MonitorParameters):
    """Parameters of the gear node.

    A level needs three of four windows: two windows share a knock.
    """

    window_s: float = parameter(_DEFAULT.window.window_s, "length of an analysis window [s]", 0.05, 60.0)
    hop_s: float = parameter(_DEFAULT.window.hop_s, "distance of two windows [s]", 0.01, 60.0)
    learn_s: float = parameter(_DEFAULT.learn_s, "stream time that a baseline is learnt from [s]", 1.0, 1e7)
    raise_windows: int = parameter(3, "windows that must show a level ...", 1, 100)
    of_windows: int = parameter(4, "... among so many", 1, 100)

    def check(self) -> None:
        """Raise InputError where values contradict each other."""
        super().check()
        self.gear_settings()

    def gear_settings(self) -> GearSettings:
        """The part for the monitor."""
        return GearSettings(self.window_settings(), self.learn_s, self.learn_at_start)


def make_monitor(machine: Machine, parameters: GearParameters) -> AlarmedMonitor:
    """The monitor of a machine with its alarms, and with the baseline that is stored of it."""
    settings = parameters.gear_settings()
    settings = replace(settings, window=for_gears(settings.window, machine))
    monitor = GearMonitor(machine, settings, SOURCE)
    parameters.recall(monitor.keeper, SOURCE)
    return AlarmedMonitor(monitor, parameters.alarm_settings())


def make_node() -> LearningNode:
    """The node, once rclpy is ready."""
    return LearningNode(SOURCE, GearParameters, make_monitor)
