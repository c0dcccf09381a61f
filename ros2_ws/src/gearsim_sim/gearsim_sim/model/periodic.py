"""Smooth periodic functions of an angle: Fourier series, and tables of them for the compiled kernel."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

# Points per period of the highest order in a table. Cubic Hermite interpolation then errs by
# (2 pi / 48)^4 / 384 = 8e-7 of that order's amplitude, and by far less of all lower orders.
_POINTS_PER_PERIOD = 48
# Low orders come with large amplitudes (run-out): more points cost nothing there and push that error away.
_LEAST_POINTS = 1024
_WAVES_AT_ONCE = 32


@dataclass(frozen=True, eq=False)
class PeriodicSeries:
    """mean + sum of cosine cos(2 pi orders u) + sine sin(2 pi orders u); u in turns, orders >= 1."""

    mean: float
    orders: NDArray[np.int64]
    cosine: NDArray[np.float64]
    sine: NDArray[np.float64]

    def value(self, turns: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """The function at angles given in turns (any shape)."""
        if isinstance(turns, float):
            return np.asarray(
                self.mean + np.dot(self._spectrum, _waves(float(turns), self._spectrum.size)).real
            )
        phase = 2 * np.pi * np.multiply.outer(np.asarray(turns), self.orders)
        return np.asarray(self.mean + np.cos(phase) @ self.cosine + np.sin(phase) @ self.sine)

    def on_grid(self, points: int) -> NDArray[np.float64]:
        """The function at so many equally spaced angles of a turn from 0 on, by one Fourier transform."""
        # Orders beyond the grid's own take the values of those that they fold to: nothing is left out.
        spectrum = np.zeros(points, dtype=np.complex128)
        np.add.at(spectrum, self.orders % points, self.cosine - 1j * self.sine)
        return np.asarray(self.mean + points * np.fft.ifft(spectrum).real)

    def slope(self, turns: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """Its derivative with respect to turns."""
        if isinstance(turns, float):
            waves = _waves(float(turns), self._spectrum.size)
            return np.asarray(np.dot(self._slope_spectrum, waves).real)
        phase = 2 * np.pi * np.multiply.outer(np.asarray(turns), self.orders)
        rate = 2 * np.pi * self.orders
        return np.asarray(np.cos(phase) @ (rate * self.sine) - np.sin(phase) @ (rate * self.cosine))

    @cached_property
    def _spectrum(self) -> NDArray[np.complex128]:
        """Amplitudes of all orders from 0 on, the mean left out: Re sum a_k exp(2 pi i k u)."""
        found = np.zeros(int(self.orders.max(initial=0)) + 1, dtype=np.complex128)
        np.add.at(found, self.orders, self.cosine - 1j * self.sine)
        return found

    @cached_property
    def _slope_spectrum(self) -> NDArray[np.complex128]:
        return 2j * np.pi * np.arange(self._spectrum.size) * self._spectrum

    def table(self) -> NDArray[np.float64]:
        """Values and slopes for cubic Hermite interpolation, interleaved, shape (2 (points + 1),).

        The number of points is a power of two; slopes are per table step; the last point repeats the
        first so that no index needs to wrap.
        """
        highest = int(self.orders.max()) if self.orders.size else 1
        points = max(_LEAST_POINTS, 1 << int(np.ceil(np.log2(highest * _POINTS_PER_PERIOD))))
        spectrum = np.zeros(points // 2 + 1, dtype=np.complex128)
        np.add.at(spectrum, self.orders, (self.cosine - 1j * self.sine) / 2)
        spectrum[0] = self.mean
        derivative = spectrum * 2j * np.pi * np.arange(spectrum.size) / points
        result = np.empty((points + 1, 2))
        result[:-1, 0] = np.fft.irfft(spectrum, points) * points
        result[:-1, 1] = np.fft.irfft(derivative, points) * points
        result[-1] = result[0]
        return result.ravel()


@lru_cache(maxsize=256)
def _waves(turns: float, count: int) -> NDArray[np.complex128]:
    """exp(2 pi i k turns) for k = 0 to count - 1, each a product of two; one angle serves many series."""
    angle = 2j * np.pi * (turns - np.floor(turns))
    coarse = np.exp(angle * _WAVES_AT_ONCE * np.arange(-(-count // _WAVES_AT_ONCE)))
    return np.asarray(np.multiply.outer(coarse, np.exp(angle * np.arange(_WAVES_AT_ONCE))).ravel()[:count])


def merged(*series: PeriodicSeries) -> PeriodicSeries:
    """The sum of series over the same angle."""
    return PeriodicSeries(
        mean=sum(one.mean for one in series),
        orders=np.concatenate([one.orders for one in series]),
        cosine=np.concatenate([one.cosine for one in series]),
        sine=np.concatenate([one.sine for one in series]),
    )


def sinusoid(order: int, amplitude: float, phase_rad: float) -> PeriodicSeries:
    """amplitude sin(2 pi order u + phase)."""
    return PeriodicSeries(
        mean=0.0,
        orders=np.array([order]),
        cosine=np.array([amplitude * np.sin(phase_rad)]),
        sine=np.array([amplitude * np.cos(phase_rad)]),
    )
