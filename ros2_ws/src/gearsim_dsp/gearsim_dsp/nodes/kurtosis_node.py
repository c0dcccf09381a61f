"""The kurtosis node: RMS, kurtosis and crest factor of every channel, whole and in bands, alarms."""

from __future__ import annotations

from dataclasses import dataclass

from gearsim_dsp.nodes.base import MonitorNode
from gearsim_dsp.nodes.parameters import BandParameters
from gearsim_dsp.streams.kurtosis_monitor import KurtosisMonitor, KurtosisSettings
from gearsim_dsp.streams.report import AlarmedMonitor
from gearsim_io.nameplate import Machine
from gearsim_io.nodes.parameters import parameter

SOURCE = "kurtosis"


@dataclass(frozen=True)
class KurtosisParameters(BandParameters):
    """Parameters of the kurtosis node."""

    bands: int = parameter(8, "bands of equal width that the spectrum is cut into", 1, 64)

    def check(self) -> None:
        """Raise InputError where values contradict each other."""
        super().check()
        self.kurtosis_settings()

    def kurtosis_settings(self) -> KurtosisSettings:
        """The part for the monitor."""
        return KurtosisSettings(self.window_settings(), self.bands, self.band_hz)


def make_monitor(machine: Machine, parameters: KurtosisParameters) -> AlarmedMonitor:
    """The monitor of a machine with its alarms."""
    monitor = KurtosisMonitor(machine, parameters.kurtosis_settings(), SOURCE)
    return AlarmedMonitor(monitor, parameters.alarm_settings())


def make_node() -> MonitorNode:
    """The node, once rclpy is ready."""
    return MonitorNode(SOURCE, KurtosisParameters, make_monitor)
