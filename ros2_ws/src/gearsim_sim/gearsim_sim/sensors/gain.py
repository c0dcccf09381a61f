"""What the sensitivity is off by: a fixed error, and the temperature.

reading = motion (1 + gain error) (1 + coefficient (T(t) - T0)), and zero coefficient (T(t) - T0) is added.
T(t) - T0 is a warming up 1 - exp(-t / time) from the start of the stream, plus random wandering.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray

from gearsim_io.quantities import Si, Strict
from gearsim_sim.sensors.draws import generator
from gearsim_sim.sensors.slow import Course, wander, warming

if TYPE_CHECKING:
    from gearsim_sim.sensors.rows import Row

Array = NDArray[np.float64]


class Temperature(Strict):
    """How warm the sensor gets, and what that does to its sensitivity."""

    coefficient: Annotated[float, Si("1/K", ge=-0.1, le=0.1)]
    """Relative change of the sensitivity per kelvin."""
    offset: Annotated[float, Si("delta_degC", ge=-300, le=300)] = 0.0
    """Temperature at sample 0 over that of the calibration."""
    rise: Annotated[float, Si("delta_degC", ge=-300, le=300)] = 0.0
    """By how much the sensor warms up in the end."""
    time: Annotated[float, Si("s", ge=1, le=1e6)] = 600.0
    """Time constant of the warming up (assumed: 10 min)."""
    wander: Annotated[float, Si("delta_degC", ge=0, le=50)] = 0.0
    """Standard deviation of a random course of the temperature."""
    wander_time: Annotated[float, Si("s", ge=1, le=1e6)] = 60.0
    """Time constant of that course (assumed: 1 min)."""


class _Heat:
    """Temperature of one sensor over that of its calibration, in kelvin."""

    def __init__(self, row: Row, settings: Temperature, rate_hz: float, seed: int) -> None:
        self._offset = settings.offset
        self._courses: list[Course] = []
        if settings.rise != 0.0:
            self._courses.append(warming(settings.rise, settings.time, rate_hz))
        if settings.wander > 0.0:
            source = generator(seed, f"sensor temperature/{row.channel}")
            self._courses.append(wander(settings.wander, settings.wander_time, rate_hz, source))

    def read(self, first_sample: int, count: int) -> Array | float:
        heat: Array | float = self._offset
        for course in self._courses:
            heat = heat + course.read(first_sample, count)
        return heat


class Sensitivity:
    """Gain error and temperature of every channel that has one."""

    def __init__(self, rows: Sequence[Row], sample_rate_hz: float, seed: int) -> None:
        self._gains = [
            (channel, 1.0 + row.gain_error) for channel, row in enumerate(rows) if row.gain_error != 0.0
        ]
        self._heats = [
            (
                channel,
                row.temperature.coefficient,
                row.zero_per_k,
                _Heat(row, row.temperature, sample_rate_hz, seed),
            )
            for channel, row in enumerate(rows)
            if row.temperature is not None
        ]

    @property
    def active(self) -> bool:
        """False if all sensitivities are what they should be."""
        return bool(self._gains or self._heats)

    def apply(self, block: NDArray[np.float64], first_sample: int) -> None:
        """Scale `block` (channels, samples), which continues the block before."""
        for channel, gain in self._gains:
            block[channel] *= gain
        for channel, coefficient, zero_per_k, source in self._heats:
            heat = source.read(first_sample, block.shape[1])
            block[channel] *= 1.0 + coefficient * heat
            if zero_per_k != 0.0:
                block[channel] += zero_per_k * heat
