"""Entry and impact told apart: the width whose two events, heard through any path, explain the mean impact.

The path from the contact to the sensor is not known. It is taken to be linear, with a state that forgets:

    y[n] = a_1 y[n-1] + ... + a_p y[n-p] + b_0 u[n] + ... + b_q u[n-q] + e[n]

with y the mean impact and u the force of an element on its way across a spall of some width (`crossing`), so
that entry and impact go through one path (an ARX model; Ljung, System Identification, ch. 4). For each width,
release distance and moment of entry the best path is a matter of least squares, and the error that remains
tells how likely they are; the ringing of earlier impacts obeys the same a and needs no u. All widths are
tried, first quickly, with the a of a fit without u, by correlation; then the best ones in earnest.

How many coefficients b the path has is part of the question. On a stiff pedestal a bearing is heard through a
resonance or two, and few b do. Through a flexible casing dozens of modes are heard at once, whose sum has
about as many zeros as poles: few b cannot place these, and entry and impact fit best where they are not. Many
b, on the other hand, can turn one event into two, so that a wrong width explains as much as the right one. So
both are tried, and the many have to be worth it (`Explanations.criterion`).
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
from gearsim_dsp.sizing.votes import DISPERSION

__all__ = ["FEW", "MANY", "Explanations", "PathFit", "explain"]

# Numbers of direct coefficients. On rigs without a casing four do, and ten lose narrow spalls; in the casing
# ten do (docs/methods/spall_size.md).
FEW, MANY = 4, 10
_RELEASES = np.exp(np.linspace(-2.2, 1.8, 8) * RELEASE_LOG_SD)
_WIDTH_STEP = 0.012
_CANDIDATES = 20
_PEAK_SAMPLES = 1.5
_EVALUATIONS = 140
_SINGULAR = 1e-9  # of the longest one: a column that differs by less from those before it is none of its own
_MOST_SD = 2.6
_LEVEL_SAMPLES = 5
_MODEL_SHARE = 0.3
_HALVES = (0.7, 1.0, 1.4, 2.0, 2.8)
_IMPULSE_REACH = 1.5  # release distances about the middle in which a single impulse is looked for
_Way = tuple[float, float, float, float]  # gain or cost, entry, width, release


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
    criterion : float
        m log(errors) + (q + 1) log m of the best one; the less, the likelier is a path of that length, as the
        difference of two is twice that of their log evidence (Schwarz, Ann. Statist. 6 (1978) 461-464). m:
        errors that are independent, of those that p leaves free one in `votes.DISPERSION`; infinite where
        they are one or none.
    """

    entry: NDArray[np.float64]
    width: NDArray[np.float64]
    release: NDArray[np.float64]
    cost: NDArray[np.float64]
    without_event: float
    impulse: float
    criterion: float

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
    length : int
        Number q + 1 of the direct coefficients.
    """

    def __init__(self, mean: NDArray[np.float64], order: int, release: float, length: int) -> None:
        self.order = order
        self.release = release
        self.length = length
        past = np.column_stack([mean[order - k : mean.size - k] for k in range(1, order + 1)])
        own, _ = np.linalg.qr(past)
        self.plain_residual = mean[order:] - own @ (own.T @ mean[order:])
        self._weight = _weights(self.plain_residual)
        weighted, _ = np.linalg.qr(past * self._weight[:, None])
        target = mean[order:] * self._weight
        self.residual = target - weighted @ (weighted.T @ target)
        self._past = np.ascontiguousarray(weighted.T)
        self._without = float(self.residual @ self.residual)
        self._size = mean.size

    @property
    def without_event(self) -> float:
        """Sum of squared errors of a path that nothing drives."""
        return self._without

    @property
    def freedom(self) -> int:
        """Values less coefficients."""
        return int(self.residual.size - self.order - self.length - 3)

    def criterion(self, error: float) -> float:
        """What `Explanations.criterion` is, for a sum of squared errors."""
        independent = (self.residual.size - self.order) / DISPERSION
        if independent <= 1.0:
            return math.inf  # too short an impact tells nothing of its path
        return independent * math.log(max(error, 1e-300)) + self.length * math.log(independent)

    def error(self, drive: NDArray[np.float64], first: int) -> float:
        """Sum of squared errors with the best path.

        Parameters
        ----------
        drive : ndarray of float64, shape (m,)
            The force u from `first` on; elsewhere there is none.
        first : int
            Index in the mean.
        """
        length, begin = self.length, first - self.order  # in the residual
        start, stop = max(begin, 0), min(begin + drive.size + length - 1, self.residual.size)
        if stop <= start:
            return self._without
        columns = np.zeros((drive.size + length - 1, length))
        for k in range(length):
            columns[k : k + drive.size, k] = drive
        columns = columns[start - begin : stop - begin] * self._weight[start:stop, None]
        known = self._past[:, start:stop] @ columns
        against = columns.T @ self.residual[start:stop, None]
        parts = _parts(columns.T @ columns - known.T @ known, against)
        return self._without - float(np.sum(parts**2))

    def cost(self, entry: float, width: float, release: float, unit: float) -> float:
        """Squared error plus `unit` times the squared deviation of the release from its expectation."""
        off = (math.log(release) - math.log(self.release)) / RELEASE_LOG_SD
        first, stop = max(0, math.floor(entry)), min(self._size, math.ceil(entry + width) + 1)
        place = np.arange(first, stop, dtype=np.float64) - entry
        return self.error(force_change(place, width, release), first) + unit * off * off

    def impulse_error(self, first: int, last: int) -> float:
        """Least error with a single impulse between two indices."""
        places = range(max(first, self.order), min(last, self._size - self.length))
        return min([self._without, *(self.error(np.ones(1), at) for at in places)])


def _parts(gram: NDArray[np.float64], against: NDArray[np.float64]) -> NDArray[np.float64]:
    """What each column explains that those before it left; the squares add up to what is explained.

    Parameters
    ----------
    gram, against : ndarray of float64, shape (..., k, k), (..., k, ways)
        Products of the columns with each other, and with what is to be explained.
    """
    longest = gram.diagonal(axis1=-2, axis2=-1).max(axis=-1)
    gram = gram + _SINGULAR * longest[..., None, None] * np.eye(gram.shape[-1])
    try:
        return np.asarray(np.linalg.solve(np.linalg.cholesky(gram), against))
    except np.linalg.LinAlgError:  # the past foretells this u: it explains nothing of its own
        return np.zeros_like(against)


def _weights(residual: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weight of each error: noise counts as such, and the model is right within a share of what happens.

    Without the latter the loudest event alone would decide, and the quiet moment of entry count for nothing.
    """
    noise = 1.4826 * float(np.median(np.abs(residual)))
    level = np.sqrt(uniform_filter1d(residual**2, _LEVEL_SAMPLES))
    weight = 1.0 / np.sqrt(noise**2 + (_MODEL_SHARE * level) ** 2)
    return np.asarray(weight / weight.max())


def explain(
    mean: NDArray[np.float64], order: int, release: float, limits: tuple[float, float], length: int = FEW
) -> Explanations:
    """Compare ways across spalls that could have made the mean impact.

    Parameters
    ----------
    mean : ndarray of float64, shape (n,)
        Mean impact, its loudest moment about the middle.
    order, length : int
        Of the path, see `PathFit`.
    release : float
        Expected release distance in samples.
    limits : tuple of float
        Least and greatest width looked for, in samples.
    """
    fit = PathFit(mean, order, release, length)
    middle = mean.size // 2
    unit = fit.without_event / fit.freedom
    starts = sorted(_quick(fit, limits, middle), reverse=True)
    chosen: list[_Way] = []
    # A contact that is never empty has one loud event, half-way.
    for half in release * np.array(_HALVES):
        chosen.append((0.0, middle - half, min(2 * half, limits[1]), min(half, 2 * release)))
    for start in starts:
        if all(_apart(start, other) for other in chosen):
            chosen.append(start)
        if len(chosen) == _CANDIDATES + len(_HALVES):
            break
    tried: list[_Way] = []
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
        fit.criterion(table[0, 0]),
    )


def _refine(
    fit: PathFit,
    start: tuple[float, float, float],
    limits: tuple[float, float],
    unit: float,
    tried: list[_Way],
) -> None:
    """Descend from a start (entry, width, release); all ways tried are kept with their costs."""
    expected = math.log(fit.release)

    def cost(q: NDArray[np.float64]) -> float:
        entry, log_width, log_release = (float(v) for v in q)
        if not (
            math.log(limits[0]) <= log_width <= math.log(limits[1])
            and abs(log_release - expected) < _MOST_SD * RELEASE_LOG_SD
        ):
            return 10 * fit.without_event
        here = (entry, math.exp(log_width), math.exp(log_release))
        value = fit.cost(*here, unit)
        tried.append((value, *here))
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


def _quick(fit: PathFit, limits: tuple[float, float], middle: int) -> Iterator[_Way]:
    """(gain, entry, width, release) of the best moment for every shape, with the path fitted beforehand."""
    size = sfft.next_fast_len(2 * fit.plain_residual.size, real=True)
    spectrum = sfft.rfft(fit.plain_residual, size)
    lags = np.arange(fit.length)
    apart = np.abs(np.subtract.outer(lags, lags))
    width, widest = limits
    while width < widest:
        place = np.arange(math.ceil(width) + 1, dtype=np.float64)
        longest = max(0.75 * width, fit.release * _RELEASES[1])
        releases = [float(r) for r in fit.release * _RELEASES if r <= longest]
        shapes = sfft.rfft([force_change(place, width, release) for release in releases], size)
        match = sfft.irfft(spectrum * np.conj(shapes), size)
        own = sfft.irfft(np.abs(shapes) ** 2, size)
        # The loudest event, either of the two, is near the middle.
        early = int(middle - fit.order - width - 4)
        entries = np.arange(max(0, early), max(1, middle - fit.order + 4))
        parts = _parts(own[:, apart], match[:, entries + lags[:, None]])
        for gains, release in zip(np.sum(parts**2, axis=1), releases, strict=True):
            best = int(np.argmax(gains))
            yield float(gains[best]), float(entries[best] + fit.order), width, release
        width += max(0.7, _WIDTH_STEP * width)
