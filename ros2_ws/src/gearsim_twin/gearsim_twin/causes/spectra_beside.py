"""Smooth spectra of a measured and a simulated channel side by side, and curves through their ratio.

What a sensor, a filter or a structure does is a smooth curve over frequency, the same whatever excites it:
it shows in the ratio of smoothed spectra, where lines and random parts of both sides cancel.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.optimize import OptimizeResult, least_squares

from gearsim_dsp.spectra import welch_psd

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context
    from gearsim_twin.view import View

Array = NDArray[np.float64]

_BLOCKS = 6
_SEGMENTS = 8  # per block: some 50 periodograms in all
_PER_OCTAVE = 12
_LOWEST_HZ = 15.0
_TOP = 0.49  # of the sample rate
_MODEL_DB = (
    2.0  # what models miss of machines in a twelfth of an octave, and seeds of planetary ones of each other
)
_LEAST_LINES = 3
_MOST_GAIN_DB = 400.0


@dataclass(frozen=True, slots=True, eq=False)
class Beside:
    """Levels of a channel by frequency, each float64 of shape (bands,).

    Attributes
    ----------
    frequency_hz : ndarray
        Centres of the bands, a twelfth of an octave apart.
    measured_db, simulated_db : ndarray
        Power densities, re 1 (m/s^2)^2/Hz.
    std_db : ndarray
        Of their difference: the scatter of both over the record, and 2 dB for the model.
    floor_db : ndarray or None
        Of the sensors' noise, which nothing before the sensor changes; None: not known, taken for none.
    """

    frequency_hz: Array
    measured_db: Array
    simulated_db: Array
    std_db: Array
    floor_db: Array | None = None

    @property
    def ratio_db(self) -> Array:
        """Measured over simulated, the sensors' noise included."""
        return self.measured_db - self.shaped(0.0)

    def shaped(self, change_db: Array | float) -> Array:
        """What the sensors would show if all that is simulated were changed by so many dB."""
        level = np.asarray(self.simulated_db + change_db)
        if self.floor_db is None:
            return level
        return np.asarray(10 * np.log10(10 ** (0.1 * level) + 10 ** (0.1 * self.floor_db)))

    @property
    def heard(self) -> NDArray[np.bool_]:
        """Bands in which the sensors' noise does not cover what is simulated."""
        if self.floor_db is None:
            return np.ones(self.simulated_db.size, dtype=np.bool_)
        return np.asarray(self.simulated_db > self.floor_db)


def beside(
    measured: View,
    simulated: View,
    channel: str,
    per_octave: int = _PER_OCTAVE,
    noisy: View | None = None,
) -> Beside | None:
    """Spectra of a channel on both sides; None where one lacks it or has no signal.

    Parameters
    ----------
    measured, simulated : View
    channel : str
    per_octave : int
        Bands in an octave; with more of them the lowest band lies higher.
    noisy : View, optional
        `simulated` with the sensors' noise.
    """
    if channel not in measured.record.channels or channel not in simulated.record.channels:
        return None
    top = _TOP * min(measured.record.sample_rate_hz, simulated.record.sample_rate_hz)
    rates = measured.record.sample_rate_hz, simulated.record.sample_rate_hz
    model = simulated.signal(channel)
    one = _levels(measured.signal(channel), rates[0], top, per_octave)
    other = _levels(model, rates[1], top, per_octave)
    if one is None or other is None:
        return None
    noise = None
    if noisy is not None:
        noise = _levels(noisy.signal(channel) - model, rates[1], top, per_octave)
    low = max(one[0][0], other[0][0])
    grid = one[0][one[0] >= low - 1e-6]
    level, std = (np.interp(grid, one[0], row) for row in one[1:])
    beside_level, beside_std = (np.interp(grid, other[0], row) for row in other[1:])
    noise_level = None if noise is None else np.interp(grid, noise[0], noise[1])
    spread = np.sqrt(std**2 + beside_std**2 + _MODEL_DB**2)
    return Beside(grid, level, beside_level, spread, noise_level)


def _levels(x: Array, rate: float, top_hz: float, per_octave: int) -> tuple[Array, Array, Array] | None:
    if not np.all(np.isfinite(x)) or np.ptp(x) == 0 or x.size < 2048:
        return None
    length = x.size // _BLOCKS
    step = rate / (length / (0.5 * (_SEGMENTS + 1)))
    rows = []
    for k in range(_BLOCKS):
        psd = welch_psd(x[k * length : (k + 1) * length], rate, step)
        rows.append(psd.density)
    density, frequency, step = np.stack(rows), psd.frequency_hz, psd.step_hz
    centres, kernels = _bands(frequency, step, top_hz, per_octave)
    if centres.size < 8:
        return None
    power = np.stack([density[:, inside] @ weight for inside, weight in kernels], axis=1)
    power = np.maximum(power, 1e-30)
    mean = power.mean(axis=0)
    std = 4.343 * power.std(axis=0) / mean / (_BLOCKS - 1) ** 0.5
    return centres, 10 * np.log10(mean), std


def _bands(
    frequency: Array, step: float, top_hz: float, per_octave: int
) -> tuple[Array, list[tuple[NDArray[np.intp], Array]]]:
    """Triangles two bands wide, so that a line near an edge counts in part."""
    width = 2 ** (1 / per_octave) - 1
    low = max(_LOWEST_HZ, _LEAST_LINES * step / (2 * width))
    count = int(np.log2(top_hz / low) * per_octave)
    centres = top_hz / 2 ** (np.arange(count, -1, -1) / per_octave)
    kernels = []
    for centre in centres:
        weight = np.maximum(1 - np.abs(np.log2(np.maximum(frequency, 1e-9) / centre)) * per_octave, 0.0)
        inside = np.flatnonzero(weight > 0)
        kernels.append((inside, weight[inside] / weight[inside].sum()))
    return centres, kernels


def peaks_hz(data: Beside, most: int = 3) -> list[float]:
    """Where the ratio stands highest over its surroundings (an octave), highest first."""
    ratio = data.ratio_db
    octave = max(5, int(ratio.size / np.log2(data.frequency_hz[-1] / data.frequency_hz[0])))
    over = ratio - median_filter(ratio, octave, mode="nearest")
    smooth = np.convolve(over, [0.25, 0.5, 0.25], mode="same")
    found = [int(k) for k in np.argsort(-smooth)]
    kept: list[int] = []
    for k in found:
        if all(abs(k - one) > 3 for one in kept):
            kept.append(k)
        if len(kept) == most:
            break
    return [float(data.frequency_hz[k]) for k in kept]


@dataclass(frozen=True, slots=True, eq=False)
class CurveFit:
    """A curve through levels.

    Attributes
    ----------
    values, std : ndarray
        Parameters and their standard deviations, from curvature and residuals.
    gain_db : float
        Fitted beside the curve.
    drop : float
        By how much the curve lowers the robust sum of squares of the gain alone.
    share : float
        The same, in parts of that sum.
    """

    values: Array
    std: Array
    gain_db: float
    drop: float
    share: float


def fit_curve(
    data: Beside,
    predicted: Callable[[Array], Array],
    starts: Sequence[Sequence[float]],
    bounds: tuple[Sequence[float], Sequence[float]],
    gain: bool = True,
) -> CurveFit:
    """Fit what a cause predicts of the measured levels.

    Parameters
    ----------
    data : Beside
    predicted : callable
        From parameters to measured levels in dB, shape (bands,), without the gain.
    starts : sequence of parameter vectors
        The best end counts.
    bounds : (low, high)
    gain : bool
        Whether a gain is free, beside the curve and without it.

    Notes
    -----
    Robust least squares (soft l1): the model's own misfits here and there do not bend the curve.
    """
    rough = float(np.median(data.ratio_db)) if gain else 0.0

    def levels(p: Array) -> Array:
        return np.asarray(predicted(p[1:]) + p[0])

    null = _solve(lambda p: data.shaped(0.0) + p[0], data, [[rough]], _bounds(([], []), gain))
    base = null.cost if gain else _cost(data.ratio_db / data.std_db)
    best = _solve(levels, data, [[rough, *start] for start in starts], _bounds(bounds, gain))
    return _fitted(best, base, data)


def fit_change(
    data: Beside,
    change_db: Callable[[Array], Array],
    starts: Sequence[Sequence[float]],
    bounds: tuple[Sequence[float], Sequence[float]],
) -> CurveFit:
    """As `fit_curve`, of a cause that changes what comes before the sensors' noise, by a gain besides.

    `change_db` goes from parameters to the change in dB, shape (bands,).
    """
    heard = data.heard if np.any(data.heard) else np.ones(data.heard.size, dtype=np.bool_)
    rough = float(np.median(data.ratio_db[heard]))
    null = _solve(lambda p: data.shaped(p[0]), data, [[rough], [0.0]], _bounds(([], []), gain=True))
    best = _solve(
        lambda p: data.shaped(change_db(p[1:]) + p[0]),
        data,
        [[rough, *start] for start in starts],
        _bounds(bounds, gain=True),
    )
    return _fitted(best, null.cost, data)


def _bounds(own: tuple[Sequence[float], Sequence[float]], gain: bool) -> tuple[list[float], list[float]]:
    """Those of a gain, free or held at none, before a curve's own."""
    most = _MOST_GAIN_DB if gain else 1e-9
    return [-most, *own[0]], [most, *own[1]]


def _fitted(best: OptimizeResult, base: float, data: Beside) -> CurveFit:
    """A solution beside the cost without the curve."""
    jac = best.jac[:, 1:]
    spread = max(2 * best.cost / max(data.std_db.size - best.x.size, 1), 1.0)
    # Neighbouring bands overlap by half: two thirds of them are independent, and the models' misfits fewer.
    std = 1.5 * np.sqrt(np.abs(np.diag(np.linalg.pinv(jac.T @ jac))) * spread)
    drop = 2 * (base - best.cost)
    return CurveFit(best.x[1:], std, float(best.x[0]), float(drop), float(drop / max(2 * base, 1e-12)))


def _solve(predicted: Callable[[Array], Array], data: Beside, starts, bounds):  # type: ignore[no-untyped-def]
    def residual(p: Array) -> Array:
        return np.asarray((predicted(p) - data.measured_db) / data.std_db)

    ends = [
        least_squares(
            residual,
            np.clip(start, np.asarray(bounds[0]) + 1e-12, np.asarray(bounds[1]) - 1e-12),
            bounds=bounds,
            loss="soft_l1",
            x_scale="jac",
            max_nfev=60,
        )
        for start in starts
    ]
    return min(ends, key=lambda end: end.cost)


def _cost(residual: Array) -> float:
    return float(np.sum(np.sqrt(1 + residual**2) - 1))


def by_channel(
    context: Context,
    find: Callable[[Beside, float], CurveFit | None],
    per_octave: int = _PER_OCTAVE,
    noisy: bool = False,
) -> dict[str, CurveFit]:
    """What `find` gives for each channel, of the record in which it lowers the misfit most.

    `find` gets the spectra and the sample rate, and gives None where there is nothing. With `noisy` it gets
    the sensors' noise, too, where that is known.
    """
    found: dict[str, CurveFit] = {}
    known: Sequence[View | None] = context.noisy_views if noisy else ()
    heard = known or [None] * len(context.views)
    for view, model, noise in zip(context.views, context.simulated_views, heard, strict=True):
        for channel in view.record.channels:
            data = beside(view, model, channel, per_octave, noise)
            fit = None if data is None else find(data, view.record.sample_rate_hz)
            if fit is not None and (channel not in found or fit.drop > found[channel].drop):
                found[channel] = fit
    return found


def agreeing(
    context: Context, find: Callable[[Beside, float], CurveFit | None], within: float
) -> list[tuple[str, list[CurveFit]]]:
    """Fits of channels that agree, the clearest group first, each with its channels as a `component`.

    Parameters
    ----------
    context : Context
    find : callable
        As `by_channel` takes it.
    within : float
        Relative distance up to which the first parameters of two fits agree.
    """
    found = by_channel(context, find, noisy=True)
    left = sorted(found, key=lambda name: -found[name].drop)
    groups = []
    while left:
        first = found[left[0]].values[0]
        group = [name for name in left if abs(found[name].values[0] / first - 1) <= within]
        groups.append(group)
        left = [name for name in left if name not in group]
    groups.sort(key=lambda group: -sum(found[name].drop for name in group))
    everyone = len(context.views[0].record.channels)
    words = ["all" if len(group) == everyone else ",".join(group) for group in groups]
    return [(word, [found[name] for name in group]) for word, group in zip(words, groups, strict=True)]


def channels_of(component: str, context: Context) -> Sequence[str]:
    """The channels that a `component` of `agreeing` stands for."""
    return context.views[0].record.channels if component == "all" else component.split(",")


def pooled(fits: Sequence[CurveFit], column: int) -> tuple[float, float]:
    """Mean of a parameter over channels, by their precision, with its standard deviation."""
    values = np.array([fit.values[column] for fit in fits])
    std = np.maximum(np.array([fit.std[column] for fit in fits]), 1e-9 * np.abs(values) + 1e-300)
    weight = std**-2
    mean = float(np.sum(weight * values) / weight.sum())
    scatter = float(np.sqrt(np.sum(weight * (values - mean) ** 2) / weight.sum() / max(len(fits) - 1, 1)))
    return mean, max(float(weight.sum() ** -0.5), scatter if len(fits) > 1 else 0.0)
