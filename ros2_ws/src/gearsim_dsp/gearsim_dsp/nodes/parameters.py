"""Parameters that all diagnostic nodes have."""

from __future__ import annotations

from dataclasses import dataclass

from gearsim_dsp.alarms import AlarmSettings, Latch
from gearsim_dsp.streams.assembler import WindowSettings
from gearsim_io.errors import InputError
from gearsim_io.nodes.parameters import parameter

_WINDOW, _ALARMS = WindowSettings(), AlarmSettings()


@dataclass(frozen=True)
class AlarmParameters:
    """Parameters of every node that raises alarms."""

    warn_probability: float = parameter(
        _ALARMS.warn_probability, "of a false WARN in ten minutes of a healthy machine", 1e-12, 0.5
    )
    error_probability: float = parameter(
        _ALARMS.error_probability, "of a false ERROR in ten years of a healthy machine", 1e-12, 0.5
    )
    raise_windows: int = parameter(_ALARMS.raise_windows, "windows that must show a level ...", 1, 100)
    of_windows: int = parameter(_ALARMS.of_windows, "... among so many", 1, 100)
    clear_windows: int = parameter(_ALARMS.clear_windows, "clean windows that end an alarm", 1, 10_000)
    latch: str = parameter(
        str(_ALARMS.latch), "levels that stay until they are acknowledged: none, error or all"
    )
    stale_after_s: float = parameter(3.0, "silence after which the stream is stale [s]", 0.1, 3600.0)
    patience_s: float = parameter(3.0, "wait for machine_info before complaining [s]", 0.0, 3600.0)
    alarm_listeners: int = parameter(0, "subscribers of alarm to wait for before taking samples", 0, 100)
    queue_s: float = parameter(10.0, "signal that may wait for analysis [s]", 0.5, 120.0)

    def check(self) -> None:
        """Raise InputError where values contradict each other, so that it is told at the start."""
        self.alarm_settings()

    def alarm_settings(self) -> AlarmSettings:
        """The part for the alarms."""
        if self.latch not in set(Latch):
            raise InputError("parameter", "latch", self.latch, f"one of {', '.join(Latch)}")
        return AlarmSettings(
            warn_probability=self.warn_probability,
            error_probability=self.error_probability,
            raise_windows=self.raise_windows,
            of_windows=self.of_windows,
            clear_windows=self.clear_windows,
            latch=Latch(self.latch),
        )


@dataclass(frozen=True)
class MonitorParameters(AlarmParameters):
    """Parameters of every diagnostic node that analyses samples."""

    window_s: float = parameter(_WINDOW.window_s, "length of an analysis window [s]", 0.05, 60.0)
    hop_s: float = parameter(_WINDOW.hop_s, "distance of two windows [s]", 0.01, 60.0)
    angle_wait_s: float = parameter(_WINDOW.angle_wait_s, "wait for tacho, in seconds of signal", 0.0, 10.0)

    def check(self) -> None:
        """Raise InputError where values contradict each other, so that it is told at the start."""
        super().check()
        self.window_settings()

    def window_settings(self) -> WindowSettings:
        """The part for the assembler."""
        return WindowSettings(self.window_s, self.hop_s, self.angle_wait_s)


@dataclass(frozen=True)
class BandParameters(MonitorParameters):
    """Parameters of a node that may be told which band to look at."""

    band_low_hz: float = parameter(0.0, "lower edge of a band to look at; both 0: automatic", 0.0, 1e7)
    band_high_hz: float = parameter(0.0, "upper edge of that band [Hz]", 0.0, 1e7)

    @property
    def band_hz(self) -> tuple[float, float] | None:
        """The band asked for; None where it is to be found."""
        automatic = self.band_low_hz == 0 and self.band_high_hz == 0
        return None if automatic else (self.band_low_hz, self.band_high_hz)
