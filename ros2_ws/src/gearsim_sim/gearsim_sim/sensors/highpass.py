"""AC coupling: the high-pass of an IEPE supply, a charge amplifier or an AC-coupled input.

A Butterworth high-pass of first order (one coupling capacitor; the discharge time constant of a data sheet
is 1 / (2 pi corner)) or of second order, -3 dB at the corner; digital by the bilinear transform with the
corner held in place. The sensor is switched on at sample 0 with its capacitors discharged.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_io.quantities import Si, Strict
from gearsim_sim.sensors.biquad import Section, Sections

if TYPE_CHECKING:
    from gearsim_sim.sensors.rows import Row

_HIGHEST = 0.25  # of the sample rate


class HighPass(Strict):
    """Corner (-3 dB) and order, 1 or 2, of the high-pass."""

    corner: Annotated[float, Si("Hz", ge=0.01, le=1e4)]
    """Frequency at which the high-pass is 3 dB down."""
    order: Literal[1, 2] = 1
    """Order of the Butterworth high-pass; 1 is a single coupling capacitor."""


def highpass(corner_hz: float, order: int, sample_rate_hz: float) -> Section:
    """Coefficients (b0, b1, b2, a1, a2) of the high-pass, a0 = 1."""
    k = math.tan(math.pi * corner_hz / sample_rate_hz)
    if order == 1:
        norm = 1.0 / (1.0 + k)
        return norm, -norm, 0.0, (k - 1.0) * norm, 0.0
    norm = 1.0 / (1.0 + math.sqrt(2.0) * k + k * k)
    return norm, -2 * norm, norm, 2 * (k * k - 1) * norm, (1 - math.sqrt(2.0) * k + k * k) * norm


class AcCoupling:
    """The high-pass of every channel that has one.

    Raises
    ------
    InputError
        A corner above a quarter of the rate at which the sensor works.
    """

    def __init__(self, rows: Sequence[Row], sample_rate_hz: float) -> None:
        chosen = []
        for channel, row in enumerate(rows):
            if row.high_pass is None:
                continue
            corner_hz, most_hz = row.high_pass.corner, _HIGHEST * sample_rate_hz
            if corner_hz > most_hz:
                expected = f"at most a quarter of the sample rate, {most_hz:g} Hz"
                raise InputError(f"sensor {row.channel}", "high_pass.corner", corner_hz, expected)
            chosen.append((channel, highpass(corner_hz, row.high_pass.order, sample_rate_hz)))
        self._sections = Sections(chosen)

    @property
    def active(self) -> bool:
        """False if all channels are coupled down to 0 Hz."""
        return len(self._sections) > 0

    def apply(self, block: NDArray[np.float64], first_sample: int) -> None:  # noqa: ARG002
        """Filter `block` (channels, samples), which continues the block before."""
        self._sections.apply(block)
