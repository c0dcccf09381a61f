"""The twin node: a model runs beside the stream, and what it misses anew raises alarms."""

from __future__ import annotations

from dataclasses import dataclass

from gearsim_dsp.nodes.learning import LearningNode, LearningParameters
from gearsim_dsp.nodes.parameters import MonitorParameters
from gearsim_dsp.streams.report import AlarmedMonitor
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine
from gearsim_io.nodes.parameters import parameter
from gearsim_sim.models import MODELS
from gearsim_twin.live.model import LiveModel
from gearsim_twin.live.monitor import TwinMonitor, TwinSettings

SOURCE = "twin"
_DEFAULT = TwinSettings()


@dataclass(frozen=True)
class TwinParameters(LearningParameters, MonitorParameters):
    """Parameters of the twin node.

    A level needs three of four windows: two windows share a knock.
    """

    model: str = parameter("", "name of a model of the stream's machine, or a scenario such as extended.yaml")
    machine: str = parameter("", "description of the machine for a named model; empty: the stream's name")
    window_s: float = parameter(_DEFAULT.window.window_s, "length of an analysis window [s]", 0.05, 60.0)
    hop_s: float = parameter(_DEFAULT.window.hop_s, "distance of two windows [s]", 0.01, 60.0)
    learn_s: float = parameter(_DEFAULT.learn_s, "time to learn the standing discrepancy [s]", 1.0, 1e7)
    raise_windows: int = parameter(3, "windows that must show a level ...", 1, 100)
    of_windows: int = parameter(4, "... among so many", 1, 100)

    def check(self) -> None:
        """Raise InputError where values contradict each other."""
        super().check()
        self.twin_settings()
        if not self.model:
            raise InputError("parameter", "model", "nothing", f"a scenario, or one of {', '.join(MODELS)}")
        if self.model not in MODELS:
            LiveModel.of_scenario(self.model)

    def twin_settings(self) -> TwinSettings:
        """The part for the monitor."""
        return TwinSettings(self.window_settings(), self.learn_s, self.learn_at_start)

    def model_of(self, stream: Machine) -> LiveModel:
        """The model that runs beside a stream of some machine."""
        if self.model in MODELS:
            return LiveModel.of_machine(self.machine or stream.name, self.model)
        return LiveModel.of_scenario(self.model)


def make_monitor(machine: Machine, parameters: TwinParameters) -> AlarmedMonitor:
    """The monitor of a stream with its alarms, and with the standing discrepancy that is stored of it."""
    monitor = TwinMonitor(machine, parameters.model_of(machine), parameters.twin_settings(), SOURCE)
    parameters.recall(monitor.keeper, SOURCE)
    return AlarmedMonitor(monitor, parameters.alarm_settings())


def make_node() -> LearningNode:
    """The node, once rclpy is ready and the integrator is compiled: samples do not wait for that."""
    LiveModel.of_machine("mfpt", "bearing2").warm_up()
    return LearningNode(SOURCE, TwinParameters, make_monitor)
