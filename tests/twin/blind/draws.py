"""Random functions of time and angle, of this generator's own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.signal import butter, sosfilt

Array = NDArray[np.float64]


def low_noise(times: int, rate_hz: float, corner_hz: float, rng: np.random.Generator) -> Array:
    """Gaussian noise below a corner, mean zero and mean square one; from points, joined by cubic splines."""
    span = times / rate_hz
    points = max(8, int(8 * corner_hz * span) + 8)
    white = rng.standard_normal(points + 400)
    rate = points / span
    rough = sosfilt(butter(4, min(corner_hz / (0.5 * rate), 0.95), output="sos"), white)[400:]
    spline = CubicSpline(np.linspace(0.0, span, points), (rough - rough.mean()) / rough.std())
    return np.asarray(spline(np.arange(times) / rate_hz))


def bounded_walk(place: Array, knot: float, bound: float, rng: np.random.Generator) -> Array:
    """A smooth function of an ascending place that stays within +-bound, with a value at each knot."""
    first, last = float(place.min()), float(place.max())
    knots = np.arange(first - knot, last + 3 * knot, knot)
    return np.asarray(PchipInterpolator(knots, rng.uniform(-bound, bound, knots.size))(place))


def coloured(samples: int, slope: float, corner_hz: float, rate_hz: float, rng: np.random.Generator) -> Array:
    """Noise of one-sided density 1 above the corner, growing as (corner / f)^slope in power below it."""
    spectrum = np.fft.rfft(rng.standard_normal(samples))
    f = np.fft.rfftfreq(samples, 1 / rate_hz)
    f[0] = f[1]
    power = 1.0 + (corner_hz / f) ** slope
    spectrum *= np.sqrt(power * rate_hz / 2)
    spectrum[0] = 0.0
    return np.asarray(np.fft.irfft(spectrum, samples))
