"""The kurtosis node: RMS, kurtosis and crest factor of every channel, whole and in bands, alarms."""

from __future__ import annotations

from dataclasses import dataclass

from gearsim_dsp.nodes.base import MonitorNode
from gearsim_dsp.nodes.parameters import MonitorParameters
from gearsim_dsp.streams.kurtosis_monitor import KurtosisMonitor, KurtosisSettings
from gearsim_dsp.streams.report import AlarmedMonitor
from gearsim_io.nameplate import Machine
from gearsim_io.nodes.parameters import parameter

SOURCE = "kurtosis"


@dataclass(frozen=True)
class KurtosisParameters(MonitorParameters):
    """Parameters of the kurtosis node."""

    band_low_hz: float = parameter(0.0, "lower edge of a band to look at; both 0: automatic", 0.0, 1e7)
    band_high_hz: float = parameter(0.0, "upper edge of that band [Hz]", 0.0, 1e7)
    bands: int = parameter(8, "bands of equal width that the spectrum is cut into", 1, 64)

    def check(self) -> None:
        """Raise InputError where values contradict each other."""
        super().check()
        self.kurtosis_settings()

    def kurtosis_settings(self) -> KurtosisSettings:
        """The part for the monitor."""
        automatic = self.band_low_hz == 0 and self.band_high_hz == 0
        band = None if automatic else (self.band_low_hz, self.band_high_hz)
        return KurtosisSettings(self.window_settings(), self.bands, band)


def make_monitor(machine: Machine, parameters: KurtosisParameters) -> AlarmedMonitor:
    """The monitor of a machine with its alarms."""
    monitor = KurtosisMonitor(machine, parameters.kurtosis_settings(), SOURCE)
    return AlarmedMonitor(monitor, parameters.alarm_settings())


def make_node() -> MonitorNode:
    """The node, once rclpy is ready."""
    return MonitorNode(SOURCE, KurtosisParameters, make_monitor)
