"""A band-limited random load, without end and without memory.

A spline of degree 5 on knots at fixed steps, eight per period of the highest frequency. Its coefficients
are white numbers of a counter-based generator through a linear-phase band-pass filter, which also makes
up for the droop of the spline; the spline's own copies of the band lie 100 dB lower. The value at any
step follows from the seed and the step alone.
"""

from __future__ import annotations

import zlib
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from gearsim_sim.profile.curve import Stretch

Array = NDArray[np.float64]
_KNOTS_PER_PERIOD = 8
_DEGREE = 5
_BLOCK = 1024
WIDEST_BAND = 1000.0  # highest over lowest frequency


class RandomLoad:
    """Random curve of zero mean with this rms in a band.

    Parameters
    ----------
    rms : float
        Standard deviation.
    low_hz, high_hz : float
        Edges of the band (half amplitude); `low_hz` 0 reaches down to slow drifts.
    seed : int
        With `name` the key of the random numbers.
    """

    def __init__(
        self, rms: float, low_hz: float, high_hz: float, step_s: float, seed: int, name: str
    ) -> None:
        self._knot = max(1, round(1 / (_KNOTS_PER_PERIOD * high_hz * step_s)))
        rate_hz = 1 / (self._knot * step_s)
        taps = _filter(low_hz / rate_hz, high_hz / rate_hz)
        self._taps = taps * (rms / _spline_rms(taps))
        self._key = (seed, zlib.crc32(name.encode()))
        self._basis = _basis()
        self._coefficients = lru_cache(maxsize=4)(self._block)

    def stretch(self, step: int) -> Stretch:
        """The stretch that covers `step`: from one knot to the next."""
        number = step // self._knot
        weights = np.array([self._coefficient(number + i) for i in range(_DEGREE + 1)])
        powers = weights @ self._basis
        return Stretch(float(number * self._knot), float(self._knot), tuple(powers.tolist()))

    def final_value(self) -> float:
        """Its mean."""
        return 0.0

    def _coefficient(self, index: int) -> float:
        return float(self._coefficients(index // _BLOCK)[index % _BLOCK])

    def _block(self, block: int) -> Array:
        """Filtered numbers block _BLOCK .. + _BLOCK - 1, from the white ones that the filter reaches."""
        reach = self._taps.size - 1
        before = -(-reach // _BLOCK)
        white = np.concatenate([self._white(block - k) for k in range(before, -1, -1)])
        return np.asarray(np.convolve(white[before * _BLOCK - reach :], self._taps, "valid"))

    def _white(self, block: int) -> Array:
        sequence = np.random.SeedSequence([*self._key, block + 2**40])
        return np.random.Generator(np.random.Philox(sequence)).standard_normal(_BLOCK)


@lru_cache(maxsize=1)
def _basis() -> Array:
    """Powers of u of the six pieces of the basis spline that reach into one interval; row i: weight i."""
    points = np.linspace(0.0, 1.0, _DEGREE + 1)
    pieces = BSpline.basis_element(np.arange(_DEGREE + 2.0), extrapolate=False)
    # Coefficient number + i belongs to the basis spline that begins i - 5 knots from here.
    rows = [
        np.linalg.solve(np.vander(points, increasing=True), np.nan_to_num(pieces(points + _DEGREE - i)))
        for i in range(_DEGREE + 1)
    ]
    return np.array(rows)


def _filter(low: float, high: float) -> Array:
    """Taps of the band-pass; edges in fractions of the knots' rate (`high` at most 1/8)."""
    from scipy.signal import firwin2  # here, because it takes long to load

    width = min(0.25 * high, 0.5 * low if low > 0 else 1.0)
    count = 2 * int(np.ceil(2.0 / width)) + 1
    grid = np.linspace(0.0, 0.5, 4 * count)
    inside = np.clip((high + width / 2 - grid) / width, 0, 1)
    if low > 0:
        inside = np.minimum(inside, np.clip((grid - low + width / 2) / width, 0, 1))
    droop = np.sinc(grid) ** (_DEGREE + 1)
    return np.asarray(firwin2(count, 2 * grid, inside / droop, window="hamming"))


def _spline_rms(taps: Array) -> float:
    """Rms of the spline over white numbers of unit variance through these taps, averaged over time."""
    overlap = BSpline.basis_element(np.arange(2.0 * _DEGREE + 3))  # of two basis splines: of degree 11
    shifts = np.arange(-_DEGREE, _DEGREE + 1)
    correlation = np.correlate(np.pad(taps, _DEGREE), taps, "valid")
    return float(np.sqrt(correlation @ overlap(shifts + _DEGREE + 1.0)))
