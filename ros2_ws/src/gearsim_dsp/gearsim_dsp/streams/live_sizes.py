"""Widths of the spalls that a stream's findings are about, measured once in a while and remembered.

A width takes more time (0.7 s for 2 s of one channel at 65536 Hz) than a window's judgement, and does not
change within seconds: it is measured in the first window with the finding, in the next ones where that told
nothing, and then in every `every`-th window.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.sizing.spall_width import Width, spall_width
from gearsim_dsp.speed import ShaftSpeed
from gearsim_dsp.streams.assembler import Window
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine

__all__ = ["LiveSizes", "width_words"]

_MOST = 64
_FIRST_TRIES = 3  # one window after the other: an alarm is raised with the second or third that shows it
_SOON = 8


@dataclass(slots=True)
class _Known:
    """The last width of one fault, and the windows since it was last tried."""

    width: Width | None
    age: int = 0
    tries: int = 1


class LiveSizes:
    """Widths by component and fault.

    Parameters
    ----------
    machine : Machine
    every : int
        Windows from one measurement of a fault to the next; 0: none at all.
    """

    def __init__(self, machine: Machine, every: int = 64) -> None:
        self._machine = machine
        self._every = every
        self._known: dict[tuple[str, str], _Known] = {}

    def reset(self) -> None:
        """The stream began anew."""
        self._known.clear()

    def of(self, window: Window, finding: Finding, speed: ShaftSpeed) -> Width | None:
        """Width of the spall that a finding of this window is about; None where it is not known."""
        if not self._every:
            return None
        key = (finding.component, finding.fault)
        known = self._known.get(key)
        if known is None and len(self._known) >= _MOST:
            return None
        if known is None:
            known = self._known[key] = _Known(self._measure(window, finding, speed))
        elif known.age >= self._wait(known):
            # One window may be too poor for it: what an earlier one told still holds.
            found = self._measure(window, finding, speed)
            known = self._known[key] = _Known(found or known.width, tries=known.tries + 1)
        known.age += 1
        return known.width

    def _wait(self, known: _Known) -> int:
        """Windows until it is measured again."""
        if known.width is not None:
            return self._every
        return 1 if known.tries < _FIRST_TRIES else min(_SOON, self._every)

    def _measure(self, window: Window, finding: Finding, speed: ShaftSpeed) -> Width | None:
        if finding.channel not in window.channels:
            return None
        samples = window.data[window.channels.index(finding.channel)]
        if not np.isfinite(samples).all():
            return None
        try:
            return spall_width(samples, window.sample_rate_hz, finding, self._machine, speed)
        except InputError:  # too short, or a rate too low for it
            return None


def width_words(width: Width | None) -> str:
    """For the end of a reason: ", about 0.8 mm wide (0.62 to 0.98 mm)"; empty where it is not known."""
    if width is None:
        return ""
    low, high = (1e3 * end for end in width.ci95_m)
    return f", about {1e3 * width.value_m:.1f} mm wide ({low:.2f} to {high:.2f} mm)"
