"""The speed that goes with each window: of an angle signal that is sound, of the vibration, of the nameplate.

Where there is no angle signal and the speed is steady, windows share the nameplate's axis and are averaged
before the speed is estimated (`evidence.EvidencePool.speed`). Once it is seen to change, each window gets an
angle of its own from its vibration.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import numpy as np

from gearsim_dsp.angle.record_speed import changes, doubt_of_angle
from gearsim_dsp.angle.tacholess import SpeedTrack, track_speed
from gearsim_dsp.features import is_signal
from gearsim_dsp.quality import QualityIssue
from gearsim_dsp.speed import Phase, ShaftSpeed, SpeedSource, nameplate_speed, window_speed
from gearsim_dsp.streams.assembler import Window
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine

__all__ = ["KnownSpeeds", "LiveSpeeds", "WindowSpeeds"]

_CHECKED_FIRST = 2
_CHECK_EVERY = 32
_LOOK_EVERY = 4
_SURE = 0.8
_STEP = 0.05


class WindowSpeeds(Protocol):
    """Gives the speed of one window after the other."""

    def of(self, window: Window) -> ShaftSpeed:
        """Speed over the window, with its phase where that is known."""

    def reset(self) -> None:
        """The stream began anew."""

    @property
    def lost(self) -> bool:
        """True when the speed changes and could not be followed in the latest window: it tells nothing."""

    @property
    def issues(self) -> tuple[QualityIssue, ...]:
        """What is wrong with the angle signal."""


class KnownSpeeds:
    """The windows' parts of a speed that is known for the whole record.

    Parameters
    ----------
    speed : ShaftSpeed
        With its phase, over samples from the record's first one.
    first_sample : int
        Stream index of that one.
    issues : tuple of QualityIssue
    """

    lost = False

    def __init__(self, speed: ShaftSpeed, first_sample: int, issues: tuple[QualityIssue, ...] = ()) -> None:
        if speed.phase is None:
            raise InputError("KnownSpeeds", "speed", "no phase", "a speed with its phase")
        self.issues = issues
        self._speed = speed
        self._phase = speed.phase
        self._first = first_sample

    def of(self, window: Window) -> ShaftSpeed:
        """Speed over the window."""
        start = float(window.first_sample - self._first)
        last = start + window.sample_count - 1
        samples, turns = self._phase.samples, self._phase.turns
        inside = (samples > start) & (samples < last)
        ends = np.interp([start, last], samples, turns)
        at = np.concatenate(([start], samples[inside], [last])) - start
        part = Phase(at, np.concatenate((ends[:1], turns[inside], ends[1:])))
        value = float(ends[1] - ends[0]) / (window.sample_count - 1) * window.sample_rate_hz
        half = max(self._speed.relative_error, 1e-9) * value
        return replace(self._speed, value_hz=value, ci95_hz=(value - half, value + half), phase=part)

    def reset(self) -> None:
        """Nothing is kept between windows."""


class LiveSpeeds:
    """Reads the angle signals of a stream, doubts them, and follows the speed without them.

    Parameters
    ----------
    machine : Machine
    follow : bool
        Whether to doubt the angle signals and to look for changes of speed in the vibration; False where that
        has been done for the whole record.
    """

    def __init__(self, machine: Machine, *, follow: bool = True) -> None:
        self.machine = machine
        self._follow = follow
        self._source: SpeedSource = "tacho" if machine.tacho_shafts else "encoder"
        self.reset()

    def reset(self) -> None:
        """The stream began anew."""
        self.lost = False
        self.issues: tuple[QualityIssue, ...] = ()
        self._angles = 0
        self._without = 0
        self._distrusted = False
        self._last_hz: float | None = None

    def of(self, window: Window) -> ShaftSpeed:
        """Speed over the window."""
        self.lost = False
        rate_hz = window.sample_rate_hz
        speed = window_speed(window.pulses, window.sample_count, rate_hz, self.machine, self._source)
        if not self._follow:
            return speed
        if speed.phase is not None:
            self._check(window, speed)
            if not self._distrusted:
                return speed
        return self._without_angle(window, replace(nameplate_speed(self.machine), note=speed.note))

    def _check(self, window: Window, speed: ShaftSpeed) -> None:
        due = self._angles < _CHECKED_FIRST or self._angles % _CHECK_EVERY == 0
        self._angles += 1
        signals = _sound(window)
        if not due or signals.shape[0] == 0:
            return
        doubt = doubt_of_angle(signals, window.sample_rate_hz, self.machine, speed)
        self.issues = () if doubt is None else (doubt.issue,)
        self._distrusted = doubt is not None and doubt.instead is not None

    def _without_angle(self, window: Window, nominal: ShaftSpeed) -> ShaftSpeed:
        due = self._last_hz is not None or self._without % _LOOK_EVERY == 0
        self._without += 1
        track = self._track(window) if due else None
        if self._last_hz is None:
            if track is None or not changes(track):
                return nominal
        elif track is None or track.confidence < _SURE:
            self.lost = True
            return nominal
        assert track is not None
        self._last_hz = track.mean_hz
        return track.shaft_speed()

    def _track(self, window: Window) -> SpeedTrack | None:
        signals = _sound(window)
        if signals.shape[0] == 0:
            return None
        near = None
        if self._last_hz is not None:
            near = self._last_hz * (1 - _STEP), self._last_hz * (1 + _STEP)
        try:
            return track_speed(signals, window.sample_rate_hz, self.machine, range_hz=near)
        except InputError:  # the window is too short
            return None


def _sound(window: Window) -> np.ndarray:
    """Channels that can be judged."""
    return np.asarray(window.data[[is_signal(samples) for samples in window.data]])
