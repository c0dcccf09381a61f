"""The pieces of `pieces` and `decimate` for several lanes at once; see there for what they are."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.compiled import compiled_exactly, inlined
from gearsim_sim.integrate.vectors import floor, fma, gather, load, minimum, splat, store, where_ge

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
OUTPUTS = 4  # that `decimate_lanes` works out side by side
# Taylor coefficients of cos(x) in x^2 and of sin(x) / x, highest first: exact to rounding up to pi / 4.
_COSINE = tuple((-1) ** k / math.factorial(2 * k) for k in range(8, -1, -1))
_SINE = tuple((-1) ** k / math.factorial(2 * k + 1) for k in range(8, -1, -1))
_C8, _C7, _C6, _C5, _C4, _C3, _C2, _C1, _C0 = _COSINE
_S8, _S7, _S6, _S5, _S4, _S3, _S2, _S1, _S0 = _SINE


@inlined
def cosines_sines(turns: Any) -> Any:
    """Cosine and sine of angles in turns, to rounding."""
    quarters = floor(fma(turns, splat(4.0), splat(0.5)))
    x = fma(quarters, splat(-0.25), turns) * splat(2.0 * math.pi)
    y = x * x
    c = fma(y, fma(y, splat(_C8), splat(_C7)), splat(_C6))
    c = fma(y, fma(y, fma(y, c, splat(_C5)), splat(_C4)), splat(_C3))
    c = fma(y, fma(y, fma(y, c, splat(_C2)), splat(_C1)), splat(_C0))
    s = fma(y, fma(y, splat(_S8), splat(_S7)), splat(_S6))
    s = fma(y, fma(y, fma(y, s, splat(_S5)), splat(_S4)), splat(_S3))
    s = x * fma(y, fma(y, fma(y, s, splat(_S2)), splat(_S1)), splat(_S0))
    quadrant = quarters - splat(4.0) * floor(quarters * splat(0.25))
    half = quadrant * splat(0.5)
    odd = half - floor(half)
    cosine = where_ge(odd, splat(0.25), s, c)
    sine = where_ge(odd, splat(0.25), c, s)
    cosine = where_ge(quadrant, splat(0.5), where_ge(quadrant, splat(2.5), cosine, -cosine), cosine)
    return cosine, where_ge(quadrant, splat(1.5), -sine, sine)


@inlined
def polynomials(u: Any, coefficients: Array) -> Any:
    """Value and first two derivatives; row k of `coefficients` is that of u^k."""
    value, first, second = splat(0.0), splat(0.0), splat(0.0)
    for k in range(coefficients.shape[0] - 1, -1, -1):
        second = fma(second, u, first)
        first = fma(first, u, value)
        value = fma(value, u, load(coefficients, k))
    return value, first, second + second


@inlined
def table_values(turns: Any, tables: Array, offset: Any, points: Any) -> Any:
    """Value and slope per turn of a tabled periodic function, for each lane its own."""
    scaled = (turns - floor(turns)) * points
    i = minimum(floor(scaled), points - splat(1.0))
    t = scaled - i
    at = fma(splat(2.0), i, offset)
    v0, d0 = gather(tables, at), gather(tables, at + splat(1.0))
    v1, d1 = gather(tables, at + splat(2.0)), gather(tables, at + splat(3.0))
    rise = v1 - v0
    a, b = d0 - rise, rise - d1
    u = splat(1.0) - t
    bend = fma(a, u, b * t)
    value = fma(u, v0, fma(t, v1, t * u * bend))
    slope = fma(splat(1.0) - splat(2.0) * t, bend, fma(t * u, b - a, rise))
    return value, slope * points


def phase_taps(taps: Array, oversampling: int) -> tuple[Array, Indices]:
    """Taps of `decimation_taps` by their phase, for `decimate_lanes`.

    All but one phase of each tap at a multiple of `oversampling` from the middle are zero but for rounding
    (the filter is of Nyquist's kind); they are left out.

    Returns
    -------
    ndarray, shape (oversampling, width)
        Taps of each phase, filled up by OUTPUTS - 1 zeros before and behind.
    ndarray, shape (oversampling, 2)
        First and last but one of the taps of each phase that are not zero.
    """
    margin, count = OUTPUTS - 1, -(-taps.size // oversampling)
    table = np.zeros((oversampling, count + 2 * margin))
    ranges = np.empty((oversampling, 2), dtype=np.int64)
    for phase in range(oversampling):
        own = taps[phase::oversampling].copy()
        own[np.abs(own) < 1e-12 * np.abs(taps).max()] = 0.0
        table[phase, margin : margin + own.size] = own
        used = np.flatnonzero(own)
        ranges[phase] = used[0], used[-1] + 1
    return table, ranges


@compiled_exactly
def decimate_lanes(
    signal: Array, width: int, taps: Array, ranges: Indices, out: Array, out_width: int
) -> None:
    """Filter and decimate each site of `signal` [site][width] into `out` [site][out_width].

    Output i is the product of the taps with the columns from i oversampling on. `out_width` must be a
    multiple of OUTPUTS, and the signal long enough for all of them.
    """
    oversampling, per_phase = taps.shape
    margin = OUTPUTS - 1
    flat = taps.ravel()
    for site in range(signal.shape[0] // width):
        for i in range(0, out_width, OUTPUTS):
            t0, t1, t2, t3 = splat(0.0), splat(0.0), splat(0.0), splat(0.0)
            start = site * width + i * oversampling
            for phase in range(oversampling):
                k = phase * per_phase + margin
                for m in range(ranges[phase, 0], ranges[phase, 1] + margin):
                    x = load(signal, start + phase + m * oversampling)
                    t0, t1 = fma(load(flat, k + m), x, t0), fma(load(flat, k + m - 1), x, t1)
                    t2, t3 = fma(load(flat, k + m - 2), x, t2), fma(load(flat, k + m - 3), x, t3)
            at = site * out_width + i
            store(out, at, t0)
            store(out, at + 1, t1)
            store(out, at + 2, t2)
            store(out, at + 3, t3)


@compiled_exactly
def spread(lanes: Array, width: int, count: int, out: Array, at: int) -> None:
    """Columns `at` to `at` + count of out (lanes, sites, n) from `lanes` [site][width]."""
    for lane in range(out.shape[0]):
        for site in range(out.shape[1]):
            for i in range(count):
                out[lane, site, at + i] = lanes[site * width + i, lane]
