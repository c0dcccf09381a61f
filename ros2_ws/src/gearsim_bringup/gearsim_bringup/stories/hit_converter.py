"""HIT-SM: lines that stay where they are when the speed doubles, named as those of a frequency converter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from scipy.signal import welch

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import GREY, HEALTHY, mark, new_figure
from gearsim_bringup.stories.views import view_at
from gearsim_twin.causes.inverter_lines import find_switching
from gearsim_twin.causes.lines import machine_lines

__all__ = ["NAMES", "Carrier", "draw", "tell"]

NAMES = ("hit_sm/SQ_Normal_600.mat", "hit_sm/SQ_Normal_1200.mat")
_CHANNEL, _REACH_HZ, _SECONDS = "accel", 700.0, 2.0


@dataclass(frozen=True, slots=True)
class Carrier:
    """The carrier in one record, the speed of its shaft, and all lines of the pattern, in Hz."""

    speed_hz: float
    carrier_hz: float
    std_hz: float
    lines_hz: tuple[float, ...]

    @property
    def order(self) -> float:
        """The carrier in turns of the shaft: what it would be as a line of the machine."""
        return self.carrier_hz / self.speed_hz


def tell(records: Measured) -> tuple[Carrier, ...]:
    """The carrier at 600 and at 1200 rpm, each found by itself.

    Raises
    ------
    EnvironmentLackError
        If a record is in no data folder.
    """
    found = []
    for name in NAMES:
        view = view_at(records, name)
        one = find_switching(view.signal(_CHANNEL), view.record.sample_rate_hz, machine_lines(view))
        assert one is not None
        found.append(Carrier(view.speed_hz, one.carrier_hz, one.carrier_std_hz, one.lines_hz))
    return tuple(found)


def draw(records: Measured) -> Figure:
    """Spectra about the carrier at both speeds."""
    told = tell(records)
    figure = new_figure("HIT-SM: a line that does not move with the speed", 4.6)
    rows = figure.subplots(2, 1, sharex=True)
    for axes, name, one in zip(rows, NAMES, told, strict=True):
        signal, rate_hz = records.signal(name)
        frequency, power = welch(signal, rate_hz, "hann", round(_SECONDS * rate_hz))
        near = np.abs(frequency - one.carrier_hz) < _REACH_HZ
        axes.semilogy(frequency[near], power[near], color=HEALTHY, linewidth=0.7)
        for line in one.lines_hz:
            mark(axes, line, f"{line:.2f} Hz")
        axes.set_ylabel(f"{60 * one.speed_hz:.0f} rpm", color=GREY)
    rows[1].set_xlabel("frequency [Hz]")
    return figure
