"""Entry and impact told apart: the width whose two events, heard through any path, explain the mean impact.

The path from the contact to the sensor is not known. It is taken to be linear, with a state that forgets:

    y[n] = a_1 y[n-1] + ... + a_p y[n-p] + b_0 u[n] + ... + b_q u[n-q] + e[n]

with y the mean impact and u the force of an element on its way across a spall of some width (`crossing`), so
that entry and impact go through one path (an ARX model; Ljung, System Identification, ch. 4). For each width,
release distance and moment of entry the best path is a matter of least squares, and the error that remains
tells how likely they are; the ringing of earlier impacts obeys the same a and needs no u. All widths are
tried, first quickly, with the a of a fit without u, by correlation; then the best ones in earnest.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft
from scipy.ndimage import uniform_filter1d
from scipy.optimize import minimize

from gearsim_dsp.sizing.crossing import RELEASE_LOG_SD, force_change

__all__ = ["Explanations", "PathFit", "explain"]

_TAPS = 4
_RELEASES = np.exp(np.linspace(-2.2, 1.8, 8) * RELEASE_LOG_SD)
_WIDTH_STEP = 0.012
_CANDIDATES = 20
_PEAK_SAMPLES = 1.5
_EVALUATIONS = 140
_SINGULAR = 1e-9
_MOST_SD = 2.6
_LEVEL_SAMPLES = 5
_MODEL_SHARE = 0.3
_HALVES = (0.7, 1.0, 1.4, 2.0, 2.8)
_IMPULSE_REACH = 1.5  # release distances about the middle in which a single impulse is looked for


@dataclass(frozen=True, slots=True, eq=False)
class Explanations:
    """Ways across spalls that were compared, the best one first.

    Parameters
    ----------
    entry, width, release : ndarray of float64, shape (tried,)
        Moment of entry, and distances as times, in samples.
    cost : ndarray of float64, shape (tried,)
        Squared errors left, with that of the release against its expectation, in units of the variance that
        the best one leaves.
    without_event, impulse : float
        What a path that nothing drives and one that a single impulse drives leave, in the same unit.
    """

    entry: NDArray[np.float64]
    width: NDArray[np.float64]
    release: NDArray[np.float64]
    cost: NDArray[np.float64]
    without_event: float
    impulse: float

    @property
    def spacing(self) -> float:
        """Time from the entry's event to the impact of the best one; 0 where the contact never empties."""
        return max(0.0, float(self.width[0] - 2 * self.release[0]))

    @property
    def gain(self) -> float:
        """What entry and impact explain that neither a single impulse nor nothing does."""
        return float(min(self.impulse, self.without_event) - self.cost[0])


class PathFit:
    """Least squares for the path, given a way across a spall.

    Parameters
    ----------
    mean : ndarray of float64, shape (n,)
        Mean impact.
    order : int
        Number p of the path's recursive coefficients.
    release : float
        Expected release distance in samples.
    """

    def __init__(self, mean: NDArray[np.float64], order: int, release: float) -> None:
        self.order = order
        self.release = release
        past = np.column_stack([mean[order - k : mean.size - k] for k in range(1, order + 1)])
        own, _ = np.linalg.qr(past)
        self.plain_residual = mean[order:] - own @ (own.T @ mean[order:])
        self._weight = _weights(self.plain_residual)
        self._past, _ = np.linalg.qr(past * self._weight[:, None])
        target = mean[order:] * self._weight
        self.residual = target - self._past @ (self._past.T @ target)
        self._index = np.arange(mean.size, dtype=np.float64)

    @property
    def without_event(self) -> float:
        """Sum of squared errors of a path that nothing drives."""
        return float(self.residual @ self.residual)

    @property
    def freedom(self) -> int:
        """Values less coefficients."""
        return int(self.residual.size - self.order - _TAPS - 3)

    def error(self, drive: NDArray[np.float64]) -> float:
        """Sum of squared errors with the best path for this u, shape (n,)."""
        columns = np.empty((self.residual.size, _TAPS))
        for k in range(_TAPS):
            columns[:, k] = drive[self.order - k : drive.size - k] * self._weight
        columns -= self._past @ (self._past.T @ columns)
        gram = columns.T @ columns
        against = columns.T @ self.residual
        values, vectors = np.linalg.eigh(gram)
        keep = values > _SINGULAR * values[-1]
        parts = (vectors.T @ against)[keep]
        return self.without_event - float(np.sum(parts**2 / values[keep]))

    def cost(self, entry: float, log_width: float, log_release: float, unit: float) -> float:
        """Squared error plus `unit` times the squared deviation of the release from its expectation."""
        off = (log_release - math.log(self.release)) / RELEASE_LOG_SD
        drive = force_change(self._index - entry, math.exp(log_width), math.exp(log_release))
        return self.error(drive) + unit * off * off

    def impulse_error(self, first: int, last: int) -> float:
        """Least error with a single impulse between two indices."""
        least = self.without_event
        for at in range(max(first, self.order), min(last, self._index.size - _TAPS)):
            drive = np.zeros(self._index.size)
            drive[at] = 1.0
            least = min(least, self.error(drive))
        return least


def _weights(residual: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weight of each error: noise counts as such, and the model is right within a share of what happens.

    Without the latter the loudest event alone would decide, and the quiet moment of entry count for nothing.
    """
    noise = 1.4826 * float(np.median(np.abs(residual)))
    level = np.sqrt(uniform_filter1d(residual**2, _LEVEL_SAMPLES))
    weight = 1.0 / np.sqrt(noise**2 + (_MODEL_SHARE * level) ** 2)
    return np.asarray(weight / weight.max())


def explain(
    mean: NDArray[np.float64], order: int, release: float, limits: tuple[float, float]
) -> Explanations:
    """Compare ways across spalls that could have made the mean impact.

    Parameters
    ----------
    mean : ndarray of float64, shape (n,)
        Mean impact, its loudest moment about the middle.
    order : int
        Of the path, see `PathFit`.
    release : float
        Expected release distance in samples.
    limits : tuple of float
        Least and greatest width looked for, in samples.
    """
    fit = PathFit(mean, order, release)
    middle = mean.size // 2
    unit = fit.without_event / fit.freedom
    starts = sorted(_quick(fit, limits, middle), reverse=True)
    chosen: list[tuple[float, float, float, float]] = []
    # A contact that is never empty has one loud event, half-way.
    for half in release * np.array(_HALVES):
        chosen.append((0.0, middle - half, min(2 * half, limits[1]), min(half, 2 * release)))
    for start in starts:
        if all(_apart(start, other) for other in chosen):
            chosen.append(start)
        if len(chosen) == _CANDIDATES + len(_HALVES):
            break
    tried: list[tuple[float, float, float, float]] = []
    for start in chosen:
        _refine(fit, start[1:], limits, unit, tried)
    best = min(tried)
    _refine(fit, best[1:], limits, best[0] / fit.freedom, tried)
    table = np.array(sorted(tried))
    variance = table[0, 0] / fit.freedom
    reach = round(_IMPULSE_REACH * release) + 2
    impulse = fit.impulse_error(middle - reach, middle + reach)
    return Explanations(
        table[:, 1],
        table[:, 2],
        table[:, 3],
        table[:, 0] / variance,
        fit.without_event / variance,
        impulse / variance,
    )


def _refine(
    fit: PathFit,
    start: tuple[float, float, float],
    limits: tuple[float, float],
    unit: float,
    tried: list[tuple[float, float, float, float]],
) -> None:
    """Descend from a start; all ways tried are kept as (cost, entry, width, release)."""
    expected = math.log(fit.release)

    def cost(q: NDArray[np.float64]) -> float:
        entry, log_width, log_release = (float(v) for v in q)
        if not (
            math.log(limits[0]) <= log_width <= math.log(limits[1])
            and abs(log_release - expected) < _MOST_SD * RELEASE_LOG_SD
        ):
            return 10 * fit.without_event
        value = fit.cost(entry, log_width, log_release, unit)
        tried.append((value, entry, math.exp(log_width), math.exp(log_release)))
        return value

    entry, width, release = start
    first = np.array([entry, math.log(width), math.log(release)])
    spread = np.diag([1.0, 1.0 / width, 0.2])
    minimize(
        cost,
        first,
        method="Nelder-Mead",
        options={
            "initial_simplex": np.vstack([first, first + spread]),
            "maxfev": _EVALUATIONS,
            "xatol": 1e-3,
            "fatol": 1e-2 * unit,
        },
    )


def _apart(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    """Whether two candidates differ in either event."""
    _, entry, width, release = one
    _, entry2, width2, release2 = other
    first = abs(entry + release - entry2 - release2)
    last = abs(entry + width - release - entry2 - width2 + release2)
    return max(first, last) > _PEAK_SAMPLES or abs(entry - entry2) > 2 * _PEAK_SAMPLES


def _quick(
    fit: PathFit, limits: tuple[float, float], middle: int
) -> Iterator[tuple[float, float, float, float]]:
    """(gain, entry, width, release) of the best moment for every shape, with the path fitted beforehand."""
    size = sfft.next_fast_len(2 * fit.plain_residual.size, real=True)
    spectrum = sfft.rfft(fit.plain_residual, size)
    width, widest = limits
    while width < widest:
        for release in fit.release * _RELEASES:
            if release > max(0.75 * width, fit.release * _RELEASES[1]):
                continue
            shape = force_change(np.arange(math.ceil(width) + 1, dtype=np.float64), width, release)
            shape = np.concatenate((shape, np.zeros(_TAPS)))
            match = sfft.irfft(spectrum * np.conj(sfft.rfft(shape, size)), size)
            own = np.array([shape[k:] @ shape[: shape.size - k] for k in range(_TAPS)])
            values, vectors = np.linalg.eigh(own[np.abs(np.subtract.outer(range(_TAPS), range(_TAPS)))])
            keep = values > _SINGULAR * values[-1]
            turn = vectors[:, keep] / np.sqrt(values[keep])
            # The loudest event, either of the two, is near the middle.
            early = int(middle - fit.order - width - 4)
            entries = np.arange(max(0, early), max(1, middle - fit.order + 4))
            taps = np.stack([match[entries + k] for k in range(_TAPS)])
            gain = np.sum((turn.T @ taps) ** 2, axis=0)
            best = int(np.argmax(gain))
            yield float(gain[best]), float(entries[best] + fit.order), width, float(release)
        width += max(0.7, _WIDTH_STEP * width)
