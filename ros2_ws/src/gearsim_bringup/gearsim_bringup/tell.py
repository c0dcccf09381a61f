"""Tells a person what happens in a running graph, line by line in stream time."""

from __future__ import annotations

from typing import Any

from gearsim_bringup.ui import Voice
from gearsim_io.health import Level


class Teller:
    """Callbacks for a `LiveRun` that print alarms and changes of the ground truth.

    Parameters
    ----------
    voice : Voice
    sample_rate_hz : float
        Turns sample indices into seconds of the stream.
    """

    def __init__(self, voice: Voice, sample_rate_hz: float) -> None:
        self._voice = voice
        self._rate_hz = sample_rate_hz
        self._faults: dict[str, Any] = {}
        self._point: tuple[float, float] | None = None

    def alarm(self, message: Any) -> None:
        """An Alarm message."""
        level = Level(message.level).name
        where = f"{message.source}, {message.channel}" if message.channel else message.source
        self._say(message.sample, f"ALARM {level}: {message.reason} [{where}]")

    def truth(self, message: Any) -> None:
        """A GroundTruth message: what has changed since the one before."""
        faults = {fault.fault_id: fault for fault in message.faults}
        for name in faults.keys() - self._faults.keys():
            fault = faults[name]
            self._say(fault.since_sample, f"injected: {fault.kind} on {fault.component} {fault.parameters}")
        for name in self._faults.keys() - faults.keys():
            self._say(message.sample, f"cleared: {name}")
        point = (message.speed, message.load)
        if point != self._point:
            self._say(message.sample, f"running at {point[0]:g} Hz, {point[1]:g} N m")
        self._faults, self._point = faults, point

    def _say(self, sample: int, text: str) -> None:
        self._voice.say(f"{sample / self._rate_hz:7.2f} s  {text}")
