"""Noise of a measuring chain: white, and below a corner rising towards low frequencies as 1/f.

One-sided power spectral density = density^2 (1 + corner / f), within 1 % + 2 corner / rate, down to 0.03 Hz
and flat below 0.01 Hz. The 1/f part is a sum of Lorentzians whose corners lie a factor of four apart (van
der Ziel 1950); the sum with the white part is a rational function of f^2 with real poles and zeros, so one
white sequence through sections of first order has it exactly. The filter starts in its stationary state.
Sample n uses the n-th random number of the channel's own stream (see `draws`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.sensors.biquad import Section, Sections
from gearsim_sim.sensors.draws import generator, normal

if TYPE_CHECKING:
    from gearsim_sim.sensors.rows import Row

Array = NDArray[np.float64]
LOWEST_HZ = 0.01
_RATIO = 4.0
_HIGHEST_CORNER = 0.125  # of the sample rate
_HIGHEST_POLE = 0.45  # of the sample rate


def flicker_zeros_poles(corner_hz: float, sample_rate_hz: float) -> tuple[Array, Array]:
    """Frequencies [Hz] of zeros and poles of a filter with |H|^2 = 1 + corner / f, from low to high."""
    top = min(64.0 * corner_hz, _HIGHEST_POLE * sample_rate_hz)
    count = 1 + math.ceil(math.log(top / LOWEST_HZ) / math.log(_RATIO))
    poles = np.asarray(top / _RATIO ** np.arange(count - 1, -1, -1), dtype=np.float64)
    # sum of weight / (1 + (f / pole)^2) is corner / f for corners that close together
    weights = corner_hz / poles * (2.0 / math.pi) * math.log(_RATIO)

    def total(zero_hz: float) -> float:  # 1 + sum at f^2 = -zero^2
        return float(1.0 + np.sum(weights * poles**2 / (poles**2 - zero_hz**2)))

    # The function runs from minus to plus infinity between two poles: one zero there, and one above all.
    ends = np.append(poles[1:], poles[-1] * math.sqrt(1.0 + weights.sum()))
    zeros = np.empty(count)
    for k in range(count):
        low, high = math.log(poles[k]), math.log(ends[k])
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if total(math.exp(middle)) < 0.0 else (low, middle)
        zeros[k] = math.exp(0.5 * (low + high))
    return zeros, poles


def first_order(zero_hz: float, pole_hz: float, sample_rate_hz: float) -> tuple[float, float, float]:
    """b0, b1, a1 of (s + 2 pi zero) / (s + 2 pi pole) by the bilinear transform."""
    z, p = math.pi * zero_hz / sample_rate_hz, math.pi * pole_hz / sample_rate_hz
    return (1.0 + z) / (1.0 + p), (z - 1.0) / (1.0 + p), (p - 1.0) / (1.0 + p)


class _Shape:
    """The sections of one corner frequency, two of first order in each, and their stationary states."""

    def __init__(self, corner_hz: float, sample_rate_hz: float) -> None:
        zeros, poles = flicker_zeros_poles(corner_hz, sample_rate_hz)
        single = [first_order(z, p, sample_rate_hz) for z, p in zip(zeros, poles, strict=True)]
        if len(single) % 2:
            single.append((1.0, 0.0, 0.0))
        self._single = single
        self.sections: list[Section] = []
        for (b0, b1, a1), (d0, d1, c1) in zip(single[::2], single[1::2], strict=True):
            self.sections.append((b0 * d0, b0 * d1 + b1 * d0, b1 * d1, a1 + c1, a1 * c1))

    def start(self, deviates: Array) -> Array:
        """States (sections, 2) of filters that white noise of unit variance has run through for ever.

        `deviates` are as many normal numbers as there are sections of first order, 2 x sections.
        """
        from scipy.linalg import solve_discrete_lyapunov

        count = len(self._single)
        step, drive = np.zeros((count, count)), np.zeros(count)
        # Each section: y = b0 x + s, s' = b1 x - a1 y. x of the next is y.
        passes_states, passes_input = np.zeros(count), 1.0
        for k, (b0, b1, a1) in enumerate(self._single):
            step[k] = (b1 - a1 * b0) * passes_states
            step[k, k] -= a1
            drive[k] = (b1 - a1 * b0) * passes_input
            passes_states, passes_input = b0 * passes_states, b0 * passes_input
            passes_states[k] += 1.0
        cover = solve_discrete_lyapunov(step, np.outer(drive, drive))
        values, vectors = np.linalg.eigh(0.5 * (cover + cover.T))
        states = vectors @ (np.sqrt(np.maximum(values, 0.0)) * deviates)
        return self._joined(states)

    def _joined(self, states: Array) -> Array:
        """States of two sections of first order as those of one of second order with the same response."""
        out = np.empty((len(self.sections), 2))
        for i, section in enumerate(self.sections):
            (_, _, a1), (d0, d1, c1) = self._single[2 * i], self._single[2 * i + 1]
            s, t = states[2 * i], states[2 * i + 1]
            y0 = d0 * s + t
            y1 = d0 * (-a1 * s) + (d1 * s - c1 * y0)
            out[i] = y0, y1 + section[3] * y0
        return out


class Noise:
    """The noise of every channel that has one, added in place.

    Raises
    ------
    InputError
        A 1/f corner above an eighth of the sample rate.
    """

    def __init__(self, rows: Sequence[Row], sample_rate_hz: float, seed: int) -> None:
        width = math.sqrt(sample_rate_hz / 2)
        noisy = [(channel, row) for channel, row in enumerate(rows) if row.noise_density]
        self._sources = [
            (channel, row.noise_density * width, generator(seed, f"accelerometer noise/{row.channel}"))
            for channel, row in noisy
            if row.noise_density is not None
        ]
        self._places = [k for k, (_, row) in enumerate(noisy) if row.noise_corner_hz is not None]
        shapes: dict[float, _Shape] = {}
        chosen: list[tuple[int, Section]] = []
        starts: list[Array] = []
        for place, k in enumerate(self._places):
            row = noisy[k][1]
            corner_hz = _checked_corner(row, sample_rate_hz)
            if corner_hz not in shapes:
                shapes[corner_hz] = _Shape(corner_hz, sample_rate_hz)
            shape = shapes[corner_hz]
            chosen += [(place, section) for section in shape.sections]
            draws = normal(generator(seed, f"flicker start/{row.channel}"), 2 * len(shape.sections))
            starts.append(shape.start(draws))
        self._sections = Sections(chosen)
        if starts:
            self._sections.state[:] = np.concatenate(starts)

    @property
    def active(self) -> bool:
        """False if no channel is noisy."""
        return bool(self._sources)

    def apply(self, block: NDArray[np.float64], first_sample: int) -> None:  # noqa: ARG002
        """Add the noise of the next samples to `block` (channels, samples)."""
        coloured = np.empty((len(self._places), block.shape[1]))
        for k, (channel, sigma, source) in enumerate(self._sources):
            deviates = normal(source, block.shape[1])
            if k in self._places:
                coloured[self._places.index(k)] = deviates
                continue
            deviates *= sigma
            block[channel] += deviates
        if self._places:
            self._sections.apply(coloured)
            for place, k in enumerate(self._places):
                channel, sigma, _ = self._sources[k]
                coloured[place] *= sigma
                block[channel] += coloured[place]


def _checked_corner(row: Row, sample_rate_hz: float) -> float:
    corner_hz = row.noise_corner_hz
    assert corner_hz is not None
    most_hz = _HIGHEST_CORNER * sample_rate_hz
    if corner_hz > most_hz:
        expected = f"at most an eighth of the sample rate, {most_hz:g} Hz"
        raise InputError(f"sensor {row.channel}", "noise_corner", corner_hz, expected)
    return corner_hz
