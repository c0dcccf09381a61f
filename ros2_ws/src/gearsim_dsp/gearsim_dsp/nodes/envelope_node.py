"""The envelope node: squared envelope spectra of every channel, bearing faults, alarms."""

from __future__ import annotations

from dataclasses import dataclass, replace

from gearsim_dsp.nodes.base import MonitorNode
from gearsim_dsp.nodes.parameters import BandParameters
from gearsim_dsp.streams.envelope_monitor import EnvelopeMonitor, EnvelopeSettings
from gearsim_dsp.streams.fitting import for_bearings
from gearsim_dsp.streams.report import AlarmedMonitor
from gearsim_io.nameplate import Machine
from gearsim_io.nodes.parameters import parameter

SOURCE = "envelope"
_DEFAULT = EnvelopeSettings()


@dataclass(frozen=True)
class EnvelopeParameters(BandParameters):
    """Parameters of the envelope node."""

    memory_windows: int = parameter(0, "windows averaged for a judgement; 0: automatic", 0, 1000)
    kurtogram_every: int = parameter(
        _DEFAULT.kurtogram_every, "windows from one choice of a band to the next; 0: none", 0, 1000
    )
    size_every: int = parameter(
        _DEFAULT.size_every, "windows from one measurement of a spall's width to the next; 0: none", 0, 1000
    )

    def check(self) -> None:
        """Raise InputError where values contradict each other."""
        super().check()
        self.envelope_settings()

    def envelope_settings(self) -> EnvelopeSettings:
        """The part for the monitor."""
        return EnvelopeSettings(
            self.window_settings(), self.band_hz, self.memory_windows, self.kurtogram_every, self.size_every
        )


def make_monitor(machine: Machine, parameters: EnvelopeParameters) -> AlarmedMonitor:
    """The monitor of a machine with its alarms; windows are longer where the machine turns slowly."""
    settings = parameters.envelope_settings()
    settings = replace(settings, window=for_bearings(settings.window, machine))
    monitor = EnvelopeMonitor(machine, settings, SOURCE)
    return AlarmedMonitor(monitor, parameters.alarm_settings())


def make_node() -> MonitorNode:
    """The node, once rclpy is ready."""
    return MonitorNode(SOURCE, EnvelopeParameters, make_monitor)
