"""What the electrical surroundings add: hum of the mains, and the switching of a frequency converter.

Both have one phase for the whole rig, as all channels hang on the same grid and beside the same motor; only
their strength belongs to the channel. Phases are exact over days: they are counted in turns from anchors
at fixed places of the stream.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gearsim_io.errors import InputError
from gearsim_io.quantities import Si, Strict
from gearsim_sim.sensors.draws import generator, uniform

if TYPE_CHECKING:
    from gearsim_sim.sensors.rows import Row

Array = NDArray[np.float64]
Amplitude = TypeVar("Amplitude")
_ANCHOR = 1 << 14  # samples
Order = Annotated[int, Field(ge=2, le=100)]


class Mains(Strict, Generic[Amplitude]):
    """Hum: amplitude (peak) of the fundamental, and of its harmonics relative to it."""

    amplitude: Amplitude
    """Peak of the line at the mains frequency."""
    frequency: Annotated[float, Si("Hz", ge=10, le=1000)] = 50.0
    """Frequency of the mains."""
    harmonics: dict[Order, Annotated[float, Si("", ge=0, le=100)]] = Field(
        default_factory=lambda: {2: 0.1, 3: 0.4, 5: 0.2, 7: 0.1}
    )
    """Peaks of the harmonics, by order, in parts of the fundamental's (assumed: 2: 0.1, 3: 0.4, 5: 0.2, 7:
    0.1)."""


class Inverter(Strict, Generic[Amplitude]):
    """Pulse-width modulation coupled in by stray capacitance: amplitude (peak) of the carrier's own line."""

    amplitude: Amplitude
    """Peak of the line at the carrier frequency."""
    carrier: Annotated[float, Si("Hz", ge=100, le=1e5)] = 4000.0
    """Switching frequency (assumed: 4 kHz, a usual setting)."""
    output: Annotated[float, Si("Hz", ge=1, le=1000)] = 50.0
    """Frequency that the inverter gives its motor; does not follow the shaft."""
    modulation: Annotated[float, Si("", ge=0, le=1)] = 0.8
    """Index of modulation, wanted amplitude over the largest."""
    multiples: Annotated[int, Field(ge=1, le=16)] = 4
    """Groups of lines around multiples of the carrier; those beyond half the sensors' rate are left out."""


class PhaseClock:
    """Phase of a steady line in turns, modulo one, the same in any portions."""

    def __init__(self, frequency_hz: float, sample_rate_hz: float, start_turns: float = 0.0) -> None:
        self._exact = Fraction(frequency_hz) / Fraction(sample_rate_hz)
        self._step = float(self._exact)
        self._start = start_turns

    def turns(self, first_sample: int, count: int) -> Array:
        """Phase of so many samples, not folded into one turn."""
        out = np.empty(count)
        at = first_sample
        while at < first_sample + count:
            anchor = at - at % _ANCHOR
            stop = min(first_sample + count, anchor + _ANCHOR)
            base = float(self._exact * anchor % 1) + self._start
            out[at - first_sample : stop - first_sample] = (
                base + np.arange(at - anchor, stop - anchor) * self._step
            )
            at = stop
        return out


class _Hum:
    """Waveform of unit fundamental, shared by all channels of one kind of mains."""

    def __init__(
        self, frequency_hz: float, harmonics: Mapping[int, float], rate_hz: float, seed: int
    ) -> None:
        self._clock = PhaseClock(frequency_hz, rate_hz)
        lines = {1: 1.0, **harmonics}
        self._lines = [
            (order, part, float(uniform(generator(seed, f"mains/{order}"), 1)[0]))
            for order, part in sorted(lines.items())
            if part > 0.0 and order * frequency_hz < 0.5 * rate_hz
        ]

    def read(self, first_sample: int, count: int) -> Array:
        turns = self._clock.turns(first_sample, count)
        out = np.zeros(count)
        for order, part, phase in self._lines:
            out += part * np.sin((2 * np.pi) * (order * turns + phase))
        return out


class _Switching:
    """Capacitively coupled output of one inverter leg, its carrier line scaled to one.

    A leg under sine-triangle modulation (naturally sampled) of index M gives, beside the wanted output,
    sum over m of 2 / (m pi) sin(m pi d) cos(m w t), d = (1 + M cos(w1 t)) / 2 its duty cycle; expanded by
    Jacobi and Anger these are the side bands m carrier +- n output with Bessel functions as amplitudes
    (Holmes and Lipo 2003, chapter 3). A capacitance passes the derivative: a line of the m-th group m times
    as strongly. Groups that reach half the rate are left out.
    """

    def __init__(self, settings: Inverter[float], rate_hz: float, seed: int) -> None:
        from scipy.special import j0  # here, because it takes long to load

        phases = uniform(generator(seed, "inverter"), 2)
        self._carrier = PhaseClock(settings.carrier, rate_hz, float(phases[0]))
        self._output = PhaseClock(settings.output, rate_hz, float(phases[1]))
        self._modulation = settings.modulation
        reach = [
            m * settings.carrier + (2 * m + 4) * settings.output for m in range(1, settings.multiples + 1)
        ]
        self._groups = max(1, sum(highest < 0.5 * rate_hz for highest in reach))
        self._scale = 1.0 / float(j0(0.5 * math.pi * settings.modulation))

    def read(self, first_sample: int, count: int) -> Array:
        carrier = (2 * np.pi) * self._carrier.turns(first_sample, count)
        duty = np.cos((2 * np.pi) * self._output.turns(first_sample, count))
        duty = (0.5 * np.pi) * (1.0 + self._modulation * duty)  # pi d
        out = np.zeros(count)
        for m in range(1, self._groups + 1):
            out += np.sin(m * duty) * np.sin(m * carrier)
        out *= self._scale
        return out


class Interference:
    """Mains and inverter of every channel that has them, added in place.

    Raises
    ------
    InputError
        A frequency at or above half the rate at which the sensor works.
    """

    def __init__(self, rows: Sequence[Row], sample_rate_hz: float, seed: int) -> None:
        sources: dict[object, tuple[_Hum | _Switching, list[tuple[int, float]]]] = {}
        for channel, row in enumerate(rows):
            if row.mains is not None and row.mains.amplitude > 0.0:
                _check(row, "mains.frequency", row.mains.frequency, sample_rate_hz)
                key: object = ("mains", row.mains.frequency, tuple(sorted(row.mains.harmonics.items())))
                if key not in sources:
                    hum = _Hum(row.mains.frequency, row.mains.harmonics, sample_rate_hz, seed)
                    sources[key] = (hum, [])
                sources[key][1].append((channel, row.mains.amplitude))
            if row.inverter is not None and row.inverter.amplitude > 0.0:
                _check(row, "inverter.carrier", row.inverter.carrier, sample_rate_hz)
                key = row.inverter.model_copy(update={"amplitude": 1.0}).model_dump_json()
                if key not in sources:
                    sources[key] = (_Switching(row.inverter, sample_rate_hz, seed), [])
                sources[key][1].append((channel, row.inverter.amplitude))
        self._sources = list(sources.values())

    @property
    def active(self) -> bool:
        """False if all channels are well shielded."""
        return bool(self._sources)

    def apply(self, block: NDArray[np.float64], first_sample: int) -> None:
        """Add the lines to `block` (channels, samples)."""
        for source, channels in self._sources:
            waveform = source.read(first_sample, block.shape[1])
            for channel, amplitude in channels:
                block[channel] += amplitude * waveform


def _check(row: Row, field: str, frequency_hz: float, rate_hz: float) -> None:
    if frequency_hz >= 0.5 * rate_hz:
        expected = (
            f"below half the rate at which the sensors work, {0.5 * rate_hz:g} Hz; "
            "sampling.oversampling raises that"
        )
        raise InputError(f"sensor {row.channel}", field, frequency_hz, expected)
