"""Windows long enough for the machine: what is averaged or resolved by turns needs eight of them."""

from __future__ import annotations

import math
from dataclasses import replace

from gearsim_dsp.bands import least_window_s
from gearsim_dsp.streams.assembler import WindowSettings
from gearsim_dsp.streams.gear_window import places_of
from gearsim_io.nameplate import Machine

__all__ = ["for_bearings", "for_gears"]

_LONGEST_S = 60.0


def for_bearings(window: WindowSettings, machine: Machine) -> WindowSettings:
    """Windows that hold eight turns of the reference shaft at its nominal speed, where there are bearings."""
    return _fitted(window, machine.nominal_speed_hz) if machine.bearings else window


def for_gears(window: WindowSettings, machine: Machine) -> WindowSettings:
    """Windows that hold eight turns of the slowest shaft at its nominal speed."""
    slowest = min((abs(place.ratio) for place in places_of(machine)), default=1.0)
    return _fitted(window, slowest * machine.nominal_speed_hz)


def _fitted(window: WindowSettings, speed_hz: float) -> WindowSettings:
    if not (math.isfinite(speed_hz) and speed_hz > 0):
        return window
    length_s = max(window.window_s, min(least_window_s(speed_hz), _LONGEST_S))
    return replace(window, window_s=length_s)
