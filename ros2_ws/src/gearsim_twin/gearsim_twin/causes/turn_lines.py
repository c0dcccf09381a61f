"""Lines of a part's turn, with angle: what a record has there beyond the model, and how sure that is.

The record is averaged over the turns of a shaft or carrier. Line k of the average is a complex amplitude;
measured minus simulated is the *deviation*, with the variance of the measured line, of what seeds of the
model scatter by, and of what a model is wrong by anyway.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft
from scipy.ndimage import median_filter, uniform_filter1d

from gearsim_dsp.angle.resample import to_angle
from gearsim_dsp.features import is_signal
from gearsim_twin.causes.gear_model import has_planets

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context
    from gearsim_twin.view import View

__all__ = ["Deviation", "Lines", "deviation", "turn_lines"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_TOP = 0.4  # of the sample rate: flat on both sides
_LEAST_TURNS = 3
_MOST_LINES = 6000
_FLOOR_LINES = 15
# What fitted models still miss of lines that they have: a fifth; errors of planetary gears are drawn anew
# with every seed, so that such a line may have any phase.
_MODEL, _DRAWN = 0.2, 1.0
# What lines of one machine differ by from run to run, of speeds and loads that differ by some 0.3 %.
_REPEATED = 0.1
_SMOOTH_LINES = 9
# Between planets, whose errors are drawn anew, nothing but marks tells where a carrier stands.
_MARKED = ("tacho", "encoder")
_FINE = 8  # angles per line at which two records are laid over each other
_NEARLY = 0.97


@dataclass(frozen=True, slots=True, eq=False)
class Lines:
    """Complex amplitudes over a turn.

    Attributes
    ----------
    values : ndarray of complex128, shape (channels, lines)
        Line k turns k times in the turn; line 0 is left at zero. Missing channels hold zeros.
    variance : ndarray, same shape
        Of each value, by the scatter of the single turns; infinite for missing channels.
    """

    values: Complex
    variance: Array


@dataclass(frozen=True, slots=True, eq=False)
class Deviation:
    """Measured minus simulated of one record.

    Attributes
    ----------
    record : int
    turns : float
        Of the averaged part per turn of the reference shaft.
    values : ndarray of complex128, shape (channels, lines)
    power : ndarray, same shape
        Square of the measured line less that of the simulated one.
    variance : ndarray, same shape
        Of the values where nothing but noise and drawn errors makes them.
    model : ndarray of complex128, same shape, optional
        The simulated lines, over which the record was laid; None where its angle is known.
    """

    record: int
    turns: float
    values: Complex
    power: Array
    variance: Array
    model: Complex | None = None

    def beside(self, answer: Complex) -> Deviation:
        """The same, the record laid over the model with an answer added (same shape)."""
        if self.model is None:
            return self
        own = self.values + self.model
        return replace(self, values=own * _best_turn(own, self.model + answer) - self.model)

    @property
    def turning(self) -> Complex:
        """What a small turn of the record does to the values, per radian; zeros where its angle is known."""
        if self.model is None:
            return np.zeros_like(self.values)
        return np.asarray(1j * np.arange(self.model.shape[1]) * self.model)

    @property
    def excess(self) -> Array:
        """Square of each value in units of its variance."""
        return np.asarray(np.abs(self.values) ** 2 / self.variance)


_LINES: WeakKeyDictionary[View, dict[tuple[float, int], Lines | None]] = WeakKeyDictionary()


def line_count(view: View, turns: float) -> int:
    """How many lines of a part's turn a record holds."""
    per_turn = view.record.sample_rate_hz / (view.speed_hz * turns)
    return max(4, min(_MOST_LINES, math.floor(_TOP * per_turn)))


def turn_lines(view: View, turns: float, lines: int, channels: tuple[str, ...]) -> Lines | None:
    """Lines 0 to `lines` - 1 of the turn of a part; None without an angle or with fewer than three turns."""
    if view.phase is None or view.turns * turns < _LEAST_TURNS:
        return None
    kept = _LINES.setdefault(view, {})
    key = (round(turns, 9), lines)
    if key not in kept:
        kept[key] = _averaged(view, turns, lines, channels)
    return kept[key]


def _averaged(view: View, turns: float, lines: int, channels: tuple[str, ...]) -> Lines | None:
    values = np.zeros((len(channels), lines), dtype=np.complex128)
    variance = np.full((len(channels), lines), np.inf)
    per_turn = int(sfft.next_fast_len(math.ceil(2.5 * lines), real=True))
    assert view.phase is not None
    for row, name in enumerate(channels):
        if name not in view.record.channels:
            continue
        samples = view.signal(name)
        if not is_signal(samples) or not np.all(np.isfinite(samples)):
            continue
        signal = to_angle(samples, view.phase, per_turn, ratio=turns)
        count = signal.values.size // per_turn
        if count < 2:
            return None
        each = sfft.rfft(signal.values[: count * per_turn].reshape(count, per_turn), axis=1)[:, :lines]
        each *= 2.0 / per_turn * np.exp(-2j * np.pi * np.arange(lines) * (signal.first_turn % 1.0))
        values[row] = each.mean(axis=0)
        values[row, 0] = 0.0
        scatter = np.mean(np.abs(each - values[row]) ** 2, axis=0) / (count - 1)
        variance[row] = uniform_filter1d(scatter, _SMOOTH_LINES, mode="nearest")
    return Lines(values, variance)


_DEVIATIONS: WeakKeyDictionary[View, dict[tuple[int, float], Deviation | None]] = WeakKeyDictionary()


def deviation(context: Context, record: int, turns: float) -> Deviation | None:
    """What one record has beyond the present model over the turn of a part; None where the angle lacks."""
    view, model = context.views[record], context.simulated_views[record]
    kept = _DEVIATIONS.setdefault(model, {})
    key = (id(view), round(turns, 9))
    if key not in kept:
        kept[key] = _deviation(context, record, turns)
    return kept[key]


def _deviation(context: Context, record: int, turns: float) -> Deviation | None:
    view, model = context.views[record], context.simulated_views[record]
    if not math.isfinite(view.speed_hz):
        return None
    channels, lines = view.record.channels, line_count(view, turns)
    measured = turn_lines(view, turns, lines, channels)
    simulated = turn_lines(model, turns, lines, channels)
    if measured is None or simulated is None:
        return None
    if context.healthy_views:
        healthy = turn_lines(context.healthy_views[record], turns, lines, channels)
        if healthy is not None:
            return _beyond_healthy(context, record, turns, measured, healthy, simulated)
    own = measured.values
    if not context.case.levels_known:
        own = own * (_rms(simulated.values) / np.maximum(_rms(own), 1e-300))
    drawn = has_planets(context.contents[record])
    if not drawn or view.source not in _MARKED:
        own = own * _best_turn(own, simulated.values)
    square = np.abs(simulated.values) ** 2
    floor = np.stack([median_filter(row, _FLOOR_LINES, mode="nearest") for row in square]) / math.log(2.0)
    share = _DRAWN if drawn else _MODEL
    variance = measured.variance + simulated.variance + 2.0 * floor + share**2 * square
    # A simulated record has next to no noise: rounding keeps lines apart by no more than this.
    variance += 1e-10 * np.max(square, axis=1, keepdims=True) + 1e-30
    # A channel that is missing has infinite variance and zeros on both sides.
    values = own - simulated.values
    return Deviation(
        record, turns, values, np.abs(own) ** 2 - square, variance, None if drawn else simulated.values
    )


def _beyond_healthy(
    context: Context, record: int, turns: float, measured: Lines, healthy: Lines, simulated: Lines
) -> Deviation:
    """What a record has beyond one of the same machine when it was healthy, turned to where the model stands.

    The teeth are the same, whatever they are wrong by: both records are laid over each other first.
    """
    own = measured.values * _best_turn(measured.values, healthy.values)
    variance = measured.variance + healthy.variance + (_REPEATED * np.abs(healthy.values)) ** 2
    variance += 1e-10 * np.max(np.abs(healthy.values) ** 2, axis=1, keepdims=True) + 1e-30
    power = np.abs(own) ** 2 - np.abs(healthy.values) ** 2
    if has_planets(context.contents[record]):
        return Deviation(record, turns, own - healthy.values, power, variance, None)
    turned = _best_turn(healthy.values, simulated.values)
    return Deviation(record, turns, (own - healthy.values) * turned, power, variance, simulated.values)


def _rms(values: Complex) -> Array:
    return np.asarray(np.sqrt(np.sum(np.abs(values) ** 2, axis=1, keepdims=True)))


def _best_turn(own: Complex, model: Complex) -> Complex:
    """Turn of each line by the angle at which both records are most alike.

    Where a tacho's mark stands against the teeth no description tells, so an angle counted by marks is as
    unknown as one found in the vibration. Of the angles that do nearly as well, one tooth from the next, it
    is that nearest to the marks: they may have been set to the teeth.
    """
    lines = own.shape[1]
    weight = np.maximum(np.sum(np.abs(own) ** 2) * np.sum(np.abs(model) ** 2), 1e-300) ** 0.5
    steps = _FINE * lines
    alike = sfft.irfft(np.sum(np.conj(own) * model, axis=0) / weight, steps)
    before, after = np.roll(alike, 1), np.roll(alike, -1)
    peaks = np.flatnonzero((alike >= before) & (alike >= after) & (alike >= _NEARLY * alike.max()))
    at = int(peaks[np.argmin(np.minimum(peaks, steps - peaks))])
    # A grid alone would turn the highest lines by up to pi / 8 too far: the peak of a parabola lies between.
    bend = float(before[at] - 2.0 * alike[at] + after[at])
    beside = 0.5 * float(before[at] - after[at]) / bend if bend < 0.0 else 0.0
    return np.asarray(np.exp(-2j * np.pi * np.arange(lines) * (at + beside) / steps))
