"""Surfaces of races and rolling elements as smooth tables over their angle.

A profile says how much of a surface is missing where an element touches it. Those of a whole turn
(waviness) are Fourier series; those of a zone (rough faults, wide pits) vanish outside it, with their
slopes. Random shapes are functions of a seed and a name.
"""

from __future__ import annotations

import hashlib
import math

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.periodic import PeriodicSeries

Array = NDArray[np.float64]
# Points of a table per cutoff wavelength of a rough surface. Cubic Hermite interpolation errs by
# (2 pi / n)^4 / 384 of an amplitude: 1.2e-5 at the cutoff, 1e-3 of what the filter leaves at a third of it.
_POINTS_PER_WAVELENGTH = 24
# The filter of `rough_series` ends at this fraction of the cutoff wavelength, where it passes 2^-9.
_SHORTEST = 1 / 3


def normal_numbers(seed: int, name: str, count: int) -> Array:
    """Standard normal numbers of a counter-based generator: a function of seed and name only."""
    return _generator(seed, name).standard_normal(count)


def uniform_numbers(seed: int, name: str, count: int) -> Array:
    """Numbers in [0, 1) of a counter-based generator: a function of seed and name only."""
    return _generator(seed, name).random(count)


def _generator(seed: int, name: str) -> np.random.Generator:
    words = np.frombuffer(hashlib.sha256(name.encode()).digest(), dtype="<u4")
    return np.random.Generator(np.random.Philox(np.random.SeedSequence([seed, *words.tolist()])))


def smooth_step(u: Array) -> Array:
    """0 up to u = 0, 1 from u = 1 on, with derivatives of every order everywhere between and at the ends."""
    inside = np.clip(u, 0.0, 1.0)
    with np.errstate(divide="ignore"):
        rise, fall = np.exp(-1 / inside), np.exp(-1 / (1 - inside))
    return np.asarray(rise / (rise + fall))


def bucket(position: Array, length: float, edge: float) -> Array:
    """A bucket from 0 to `length`, with a bottom of 1 and walls `edge` long that begin and end smoothly.

    The thesis's bucket begins with a kink, at which every passing ball gives an impulse (8.2.1); here all
    derivatives vanish at the rim, so that entry and exit give none.
    """
    return smooth_step(position / edge) * smooth_step((length - position) / edge)


def rough_series(
    seed: int, name: str, circumference_m: float, rms_m: float, cutoff_m: float
) -> PeriodicSeries:
    """Gaussian random surface of a whole turn: white noise through the Gaussian filter of ISO 16610-21.

    The filter passes 2^-(cutoff / wavelength)^2 of an amplitude: one half at the cutoff. `rms_m` is that of
    the filtered surface.
    """
    highest = math.ceil(circumference_m / (cutoff_m * _SHORTEST))
    orders = np.arange(1, highest + 1)
    gain = 2.0 ** -((orders * cutoff_m / circumference_m) ** 2)
    draws = normal_numbers(seed, name, 2 * highest).reshape(2, -1)
    scale = rms_m / math.sqrt(float(np.sum(gain**2)))
    return PeriodicSeries(
        mean=0.0, orders=orders, cosine=scale * gain * draws[0], sine=scale * gain * draws[1]
    )


def waviness_series(
    orders: tuple[float, ...], amplitudes_m: tuple[float, ...], phases_rad: Array
) -> PeriodicSeries:
    """Lobes of a race or ball: amplitude cos(order * angle + phase)."""
    amplitudes = np.asarray(amplitudes_m)
    return PeriodicSeries(
        mean=0.0,
        orders=np.asarray(orders, dtype=np.int64),
        cosine=amplitudes * np.cos(phases_rad),
        sine=-amplitudes * np.sin(phases_rad),
    )


def ball_series(radius: PeriodicSeries) -> PeriodicSeries:
    """What a ball of this uneven radius adds to both contacts together, over its spin.

    The contacts lie opposite each other: even orders count twice, odd ones cancel (a ball of odd lobes has
    the same diameter everywhere).
    """
    both = np.where(radius.orders % 2 == 0, 2.0, 0.0)
    return PeriodicSeries(2 * radius.mean, radius.orders, both * radius.cosine, both * radius.sine)


def rough_zone(
    surface: PeriodicSeries,
    circumference_m: float,
    length_m: float,
    edge_m: float,
    depth_m: float,
    cutoff_m: float,
) -> Array:
    """A rough zone: bucket times (depth + surface), as a table from rim to rim [m]; see `zone_table`."""
    points = math.ceil(length_m / cutoff_m * _POINTS_PER_WAVELENGTH)
    # The walls need as many points as the surface has.
    points = max(points, math.ceil(length_m / edge_m * 4 * _POINTS_PER_WAVELENGTH))
    position = np.linspace(0.0, length_m, points + 1)
    rough = surface.value(position / circumference_m) - surface.mean
    return zone_table(bucket(position, length_m, edge_m) * (depth_m + rough))


def zone_table(values: Array) -> Array:
    """Values and slopes per step for cubic Hermite interpolation, as `PeriodicSeries.table` has them.

    The ends must be (nearly) zero with zero slope. Slopes are central differences of fourth order.
    """
    padded = np.concatenate([np.zeros(2), values, np.zeros(2)])
    slope = (8 * (padded[3:-1] - padded[1:-3]) - (padded[4:] - padded[:-4])) / 12
    slope[0] = slope[-1] = 0.0
    return np.ascontiguousarray(np.column_stack([values, slope]).ravel())


def table_lookup(table: Array, fraction: Array | float) -> Array:
    """A table at fractions [0, 1] of its length: the readable twin of `pieces.table_value`."""
    points = table.size // 2 - 1
    scaled = np.asarray(fraction, dtype=np.float64) * points
    i = np.minimum(scaled.astype(np.int64), points - 1)
    t = scaled - i
    v0, d0, v1, d1 = (table[2 * i + k] for k in range(4))
    rise = v1 - v0
    u = 1 - t
    return np.asarray(u * v0 + t * v1 + t * u * ((d0 - rise) * u + (rise - d1) * t))
