"""Speed and angle of a machine without tacho, from its vibration, also while the speed changes.

1. In short spectra the path through the candidate speeds is sought whose shaft and mesh lines stand out
   most (`ridge`, `course`); of several frame lengths the one that shows them best is taken, for a quick
   change smears long frames.
2. The signal resampled by that angle is searched again with frames twice as long, close to that speed, as
   long as the lines gain by it.
3. The phases of all lines that stand out then give the angle to a small part of a turn (`refine`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import decimate

from gearsim_dsp.angle.course import (
    Comb,
    Course,
    best_factor,
    first_course,
    line_score,
    log_speed,
    models,
    zoomed_course,
)
from gearsim_dsp.angle.refine import angle_error
from gearsim_dsp.angle.resample import AngleSignal, full_rate, to_angle
from gearsim_dsp.angle.tracked_orders import carrier_orders
from gearsim_dsp.speed import Phase, ShaftSpeed
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine

__all__ = ["SpeedTrack", "speed_limits", "track_speed"]

_WIDE_HZ = (4.0, 65.0)
_REACH = 2.5
_LEAST_REACH = 0.05
_LEAST_TURNS = 10.0
_TOP_SHARE = 0.45
_KNOTS_PER_TURN = 4
_CARRIER_ORDERS = 64.0
_BAND_SHARE = 0.4
_REFINEMENTS = 4
_FOUND = 0.5
_WEIGHTS = (-7.5, 6.5, 2.42)
_RATE_OVER_TOP = 3.2
_MOST_THINNING = 64
_MOST_CHANNELS = 3
_SAME_DB = 0.5
_CLEAR_BEND = 4.0
_FREEDOM_DB = 4.0


@dataclass(frozen=True, slots=True, eq=False)
class SpeedTrack:
    """Speed of the reference shaft over a record without tacho.

    Parameters
    ----------
    phase : Phase
        Angle of the reference shaft; its zero is arbitrary.
    time_s, speed_hz : ndarray of float64, shape (m,)
        The speed's course.
    confidence : float
        Probability that the speed is right to 0.5 % all the time.
    relative_error : float
        Standard deviation of the mean speed over its value, if the track is right at all.
    note : str
        What it rests on, or why little can be said.
    """

    phase: Phase
    time_s: NDArray[np.float64]
    speed_hz: NDArray[np.float64]
    confidence: float
    relative_error: float
    note: str

    @property
    def found(self) -> bool:
        """True when the track is more likely right than wrong."""
        return self.confidence >= _FOUND

    @property
    def mean_hz(self) -> float:
        """Mean speed over the record."""
        turns = self.phase.turns[-1] - self.phase.turns[0]
        return float(turns / (self.time_s[-1] - self.time_s[0]))

    @property
    def change(self) -> float:
        """Span of the speed, but for a twentieth at either end, over its mean."""
        edge = self.speed_hz.size // 20  # the ends are less sure
        return float(np.ptp(self.speed_hz[edge : self.speed_hz.size - edge])) / self.mean_hz

    def shaft_speed(self) -> ShaftSpeed:
        """The same as `speed.ShaftSpeed`, with its phase."""
        value = self.mean_hz
        half = 1.96 * self.relative_error * value
        return ShaftSpeed(value, (value - half, value + half), "estimated", self.phase, self.note)


def track_speed(
    signal: NDArray[np.float32] | NDArray[np.float64],
    sample_rate_hz: float,
    machine: Machine,
    *,
    range_hz: tuple[float, float] | None = None,
) -> SpeedTrack:
    """Find the speed's course and the angle of the reference shaft from the vibration.

    Parameters
    ----------
    signal : ndarray, shape (n,) or (channels, n)
        Finite values; of several channels the three that show the machine's lines best are used together.
    sample_rate_hz : float
    machine : Machine
        Its shafts and meshes give the orders looked for, its nominal speed the range (5 %, or 2.5 times the
        tolerance, either way); without one 4 to 65 Hz.
    range_hz : tuple of float, optional
        Lowest and highest speed to look at, instead.

    Returns
    -------
    SpeedTrack
        Always the best there is: look at `found` or `confidence` before use.

    Raises
    ------
    InputError
        When the record is shorter than ten turns at the lowest nameplate speed, or not finite.
    """
    x = np.atleast_2d(np.asarray(signal, dtype=np.float64))
    expected, limits = _ranges(machine, range_hz)
    limits = _checked(x, sample_rate_hz, limits)
    comb = Comb.of(machine, _TOP_SHARE * sample_rate_hz / limits[0])
    x, thinned = _thinned(x, sample_rate_hz, limits[1] * max(comb.top, _CARRIER_ORDERS))
    rate_hz = sample_rate_hz / thinned
    course = first_course(x, rate_hz, comb, limits, expected)
    x = _clearest(x, _coarse_phase(course, x.shape[1], rate_hz), comb)
    tracked = _zoomed(x, rate_hz, comb, course)
    tracked, lines, error = _refined(x, tracked, comb, machine)
    last = float(np.atleast_2d(signal).shape[1] - 1)
    phase = _over_all(Phase(tracked.phase.samples * thinned, tracked.phase.turns), last)
    return _track(phase, sample_rate_hz, _confidence(course, comb, tracked), lines, error)


def speed_limits(machine: Machine) -> tuple[float, float]:
    """Speeds that `track_speed` looks at where it is not told: around the nominal one, or 4 to 65 Hz."""
    nominal = machine.nominal_speed_hz
    if not math.isfinite(nominal):
        return _WIDE_HZ
    reach = max(_REACH * machine.speed_tolerance, _LEAST_REACH)
    return nominal * (1 - reach), nominal * (1 + reach)


def _ranges(
    machine: Machine, range_hz: tuple[float, float] | None
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Speeds that are expected, and those looked at."""
    if range_hz is not None:
        if not 0 < range_hz[0] < range_hz[1]:
            raise InputError("track_speed", "range_hz", range_hz, "low and high with 0 < low < high")
        return range_hz, range_hz
    limits = speed_limits(machine)
    nominal, tolerance = machine.nominal_speed_hz, machine.speed_tolerance
    if not math.isfinite(nominal):
        return limits, limits
    return (nominal * (1 - tolerance), nominal * (1 + tolerance)), limits


def _checked(
    x: NDArray[np.float64], sample_rate_hz: float, limits_hz: tuple[float, float]
) -> tuple[float, float]:
    if x.ndim != 2 or x.size == 0:
        raise InputError("track_speed", "signal", f"shape {x.shape}", "samples of one channel or more")
    if not (math.isfinite(sample_rate_hz) and sample_rate_hz > 0):
        raise InputError("track_speed", "sample_rate", sample_rate_hz, "a finite rate above 0 Hz")
    if not math.isfinite(float(np.sum(x))):
        raise InputError("track_speed", "signal", "values that are not finite", "finite values")
    seconds = x.shape[1] / sample_rate_hz
    low, high = limits_hz
    if limits_hz != _WIDE_HZ and seconds * low < _LEAST_TURNS:
        expected = f"at least {_LEAST_TURNS / low:.3g} s ({_LEAST_TURNS:.0f} turns at {low:.4g} Hz)"
        raise InputError("track_speed", "signal", f"{seconds:.3g} s", expected)
    low = max(low, _LEAST_TURNS / seconds)
    if low >= high / 1.05:
        expected = f"at least {1.2 * _LEAST_TURNS / high:.3g} s"
        raise InputError("track_speed", "signal", f"{seconds:.3g} s", expected)
    return low, high


def _thinned(x: NDArray[np.float64], rate_hz: float, top_hz: float) -> tuple[NDArray[np.float64], int]:
    """The signal at a whole fraction of its rate that still holds `top_hz`."""
    factor = min(_MOST_THINNING, int(rate_hz / (_RATE_OVER_TOP * top_hz)))
    if factor < 2:
        return x, 1
    return np.ascontiguousarray(decimate(x, factor, ftype="fir", axis=1)), factor


def _clearest(x: NDArray[np.float64], phase: Phase, comb: Comb) -> NDArray[np.float64]:
    """The three channels whose spectra over the angle show the comb best."""
    if x.shape[0] <= _MOST_CHANNELS:
        return x
    signals = _over_angle(x, phase, comb.top)
    clear = [line_score(s.values[np.newaxis], s.samples_per_turn, comb) for s in signals]
    return x[np.sort(np.argsort(clear)[-_MOST_CHANNELS:])]


def _coarse_phase(course: Course, samples: int, rate_hz: float) -> Phase:
    """The angle as the integral of the course."""
    mean_hz = math.exp(float(np.mean(course.log_speed)))
    seconds = (samples - 1) / rate_hz
    knots = np.linspace(0.0, seconds, max(16, math.ceil(_KNOTS_PER_TURN * mean_hz * seconds)) + 1)
    return Phase(knots * rate_hz, _integral(knots, np.exp(log_speed(course, knots))))


def _integral(at: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.concatenate(([0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(at))))


def _end_bend(phase: Phase, reach: float) -> float:
    """Share of the turns that bends of the speed within `reach` turns of the ends may hide."""
    turns = phase.turns
    speed = np.log(np.gradient(turns, phase.samples))
    bends = []
    for near in (turns < turns[0] + 2 * reach, turns > turns[-1] - 2 * reach):
        at, value = turns[near] - turns[near].mean(), speed[near] - speed[near].mean()
        bends.append(float(np.std(value - at * (at @ value) / (at @ at))))
    return math.hypot(*bends) * reach / float(turns[-1] - turns[0])


@dataclass(frozen=True, slots=True, eq=False)
class _Tracked:
    """An angle, the channels over it, and how clearly the comb shows in their spectra.

    `stretch` is the number of turns behind each independent value of the speed.
    """

    phase: Phase
    values: NDArray[np.float64]
    per_turn: int
    score: float
    stretch: float

    @property
    def turns(self) -> float:
        return float(self.values.shape[1]) / self.per_turn


def _tracked(x: NDArray[np.float64], phase: Phase, comb: Comb, stretch: float) -> _Tracked:
    signals = _over_angle(x, phase, comb.top)
    values, per_turn = np.stack([signal.values for signal in signals]), signals[0].samples_per_turn
    return _Tracked(phase, values, per_turn, line_score(values, per_turn, comb), stretch)


def _over_angle(x: NDArray[np.float64], phase: Phase, top_order: float) -> list[AngleSignal]:
    """The channels over the angle, as dense as over the time: resampling is then quickest."""
    per_turn = max(16, math.ceil(2.6 * top_order), full_rate(phase))
    return [to_angle(channel, phase, per_turn) for channel in x]


def _zoomed(x: NDArray[np.float64], rate_hz: float, comb: Comb, course: Course) -> _Tracked:
    """The angle after passes with longer and longer frames, as long as the lines gain by it."""
    turns = x.shape[1] / rate_hz * math.exp(float(np.mean(course.log_speed)))
    first = []
    for share, model in models(course):
        coarse = _tracked(x, _coarse_phase(model, x.shape[1], rate_hz), comb, share * turns)
        first.append(_centred(x, coarse, comb))
    best = _simplest(first, comb)
    frame = 0.5 * course.frame * math.exp(float(np.mean(course.log_speed)))
    while frame <= best.turns / 3:
        zoom = zoomed_course(best.values, best.per_turn, comb, frame)
        others = []
        for share, model in models(zoom):
            stretch = min(best.stretch, share * turns)
            other = _tracked(x, _corrected(best.phase, model), comb, stretch)
            others.append(_centred(x, other, comb))
        best = _simplest([best, *others], comb)
        frame *= 2
    return best


def _simplest(tracks: list[_Tracked], comb: Comb) -> _Tracked:
    """The clearest of tracks of growing freedom, each of which must gain by it what noise would not give."""
    best = tracks[0]
    for track in tracks[1:]:
        if track.score > best.score + _FREEDOM_DB * comb.norm:
            best = track
    return best


def _centred(x: NDArray[np.float64], track: _Tracked, comb: Comb) -> _Tracked:
    """The track times the factor within 1 % at which the lines of the whole signal show best."""
    factor = best_factor(track.values, track.per_turn, comb)
    scaled = Phase(track.phase.samples, track.phase.turns * factor)
    other = _tracked(x, scaled, comb, track.stretch)
    return other if other.score > track.score else track


def _corrected(phase: Phase, zoom: Course) -> Phase:
    """The angle times the speed's error that was found over it."""
    turns = phase.turns - phase.turns[0]
    return Phase(phase.samples, _integral(turns, np.exp(log_speed(zoom, turns))))


def _refined(
    x: NDArray[np.float64], best: _Tracked, comb: Comb, machine: Machine
) -> tuple[_Tracked, NDArray[np.float64], float]:
    """The angle by the phases of all clear lines, those lines, and the mean speed's relative error.

    The mean speed is corrected at once. The rest of what the phases say is believed where the lines agree on
    it, or where the comb gains by it what noise would not give: an electrical line beside one of the
    machine's must not bend a steady speed.
    """
    lines = np.empty(0)
    # Half a line of the middle of the comb, of the stretch that is free to have a speed of its own.
    middle = float(np.sum(comb.orders * comb.weights) / np.sum(comb.weights))
    relative_error = 0.5 / (middle * best.stretch)
    top = max(comb.top, _CARRIER_ORDERS)
    # A speed that was seen to change already needs no more proof that it does.
    speed = np.diff(best.phase.turns) / np.diff(best.phase.samples)
    needed = _FREEDOM_DB * comb.norm if np.ptp(speed) < 1e-6 * speed.mean() else 0.0
    for _ in range(_REFINEMENTS):
        signals = _over_angle(x, best.phase, top)
        error = angle_error(signals, carrier_orders(machine, top), _BAND_SHARE * comb.spacing)
        if error is None:
            break
        even = np.asarray(np.polyval(np.polyfit(error.turns, error.ahead, 1), error.turns), dtype=np.float64)
        straight = _ahead(x, best, comb, error.turns, even)
        bent = _ahead(x, best, comb, error.turns, error.ahead)
        left = math.hypot(error.ahead[0], error.ahead[-1]) if needed < 0 else 0.0
        if error.bend > _CLEAR_BEND:
            needed = -_SAME_DB * comb.norm
        if bent is not None and bent.score > max(best.score, straight.score if straight else 0.0) + needed:
            best, needed = bent, -_SAME_DB * comb.norm
        elif straight is not None and needed > 0 and straight.score > best.score - _SAME_DB * comb.norm:
            best = straight
        else:
            break
        # The ends converge by about a half with every pass: as much as the last one moved them is left.
        end = math.hypot(left / best.turns, _end_bend(best.phase, 1 / error.half_band))
        lines, relative_error = error.orders, math.hypot(error.slope_error, end)
    return best, lines, relative_error


def _ahead(
    x: NDArray[np.float64],
    best: _Tracked,
    comb: Comb,
    turns: NDArray[np.float64],
    ahead: NDArray[np.float64],
) -> _Tracked | None:
    """The angle moved on by `ahead`; None where it would turn back."""
    at = best.phase.turns
    moved = at + CubicSpline(turns, ahead)(np.clip(at, turns[0], turns[-1]))
    inside = (at >= turns[0]) & (at <= turns[-1])
    slope = (ahead[-1] - ahead[-2]) / (turns[-1] - turns[-2])
    moved = np.where(at > turns[-1], moved + (at - turns[-1]) * slope, moved)
    if not inside.any() or np.any(np.diff(moved) <= 0):
        return None
    return _tracked(x, Phase(best.phase.samples, moved), comb, best.stretch)


def _over_all(phase: Phase, last: float) -> Phase:
    """The angle carried on to the last sample, which a thinned signal does not reach."""
    missing = last - phase.samples[-1]
    if missing <= 0:
        return phase
    slope = (phase.turns[-1] - phase.turns[-2]) / (phase.samples[-1] - phase.samples[-2])
    return Phase(np.append(phase.samples, last), np.append(phase.turns, phase.turns[-1] + missing * slope))


def _track(
    phase: Phase, rate_hz: float, confidence: float, lines: NDArray[np.float64], relative_error: float
) -> SpeedTrack:
    time_s = phase.samples / rate_hz
    speed = np.gradient(phase.turns, time_s)
    if confidence < _FOUND:
        note = "no shaft lines stand out of the noise"
    elif lines.size:
        note = f"by the phases of {lines.size} lines of shafts and meshes"
    else:
        note = "by the lines of short spectra; none is clear enough for its phase"
    return SpeedTrack(phase, time_s, speed, confidence, relative_error, note)


def _confidence(course: Course, comb: Comb, tracked: _Tracked) -> float:
    """Logistic regression on 400 synthetic machines (see docs/methods/speed_without_tacho.md)."""
    margin = 1 - course.rival / course.score if course.score > 0 else 1.0
    clear = math.log1p(max(tracked.score, 0.0) / comb.norm)
    return 1 / (1 + math.exp(-(_WEIGHTS[0] + _WEIGHTS[1] * min(margin, 0.5) + _WEIGHTS[2] * clear)))
