"""What the judges of gears, planets and shafts make of a window that a baseline has found to be changed.

A baseline tells that something is different, the judges what it looks like. They take longer than the
indicators, so they are asked only while something is different, and then not in every window.
"""

from __future__ import annotations

import numpy as np

from gearsim_dsp.features import is_signal
from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.judges.registry import judge_all
from gearsim_dsp.speed import ShaftSpeed
from gearsim_dsp.streams.assembler import Window
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine

__all__ = ["LiveNames", "looks_like"]


class LiveNames:
    """Findings of the latest window that was looked at.

    Parameters
    ----------
    machine : Machine
    every : int
        Windows from one look to the next while something is different; 0: none at all.
    """

    def __init__(self, machine: Machine, every: int = 8) -> None:
        self._machine = machine
        self._every = every
        self._age = 0
        self._found: tuple[Finding, ...] = ()

    def reset(self) -> None:
        """The stream began anew, or nothing is different any more."""
        self._found = ()

    def of(self, window: Window, speed: ShaftSpeed) -> tuple[Finding, ...]:
        """What the judges find in this window, or found in one shortly before."""
        if not self._every:
            return ()
        # Where nothing was found the next window is looked at: the first one that differs holds both states.
        if not self._found or self._age >= self._every:
            self._found, self._age = self._judge(window, speed), 0
        self._age += 1
        return self._found

    def _judge(self, window: Window, speed: ShaftSpeed) -> tuple[Finding, ...]:
        channels: dict[str, np.ndarray] = {
            name: samples
            for name, samples in zip(window.channels, window.data, strict=True)
            if is_signal(samples)
        }
        trains = {train.shaft: train for train in window.pulses}
        measured = Measured(self._machine, window.sample_rate_hz, window.unit, channels, speed, trains)
        try:
            return judge_all(measured)
        except InputError:  # the window is too short for one of them
            return ()


def looks_like(component: str, findings: tuple[Finding, ...]) -> str:
    """For the end of a reason: what the surest finding on these wheels or shafts is; empty without one.

    `component` may hold several names, as of wheels that turn at one speed: "gears.pinion or gears.gear".
    """
    names = component.split(" or ")
    fitting = [one for one in findings if any(_same(name, one.component) for name in names)]
    best = max(fitting, key=lambda one: one.confidence, default=None)
    if best is None:
        return ""
    return f"; it looks like {best.fault.replace('_', ' ')} (confidence {best.confidence:.2f})"


def _same(one: str, other: str) -> bool:
    """True for the same component, or a part of it."""
    return one == other or one.startswith(f"{other}.") or other.startswith(f"{one}.")
