"""Speed and angle of the reference shaft: from tacho, encoder, the signal itself, or the nameplate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from gearsim_dsp.angle.pulse_counting import count_pulses
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine
from gearsim_io.record import PulseTrain

__all__ = ["Phase", "ShaftSpeed", "SpeedSource", "nameplate_speed", "phase_from_pulses", "window_speed"]

SpeedSource = Literal["tacho", "encoder", "estimated", "nameplate"]

_LOCAL_INTERVALS = 9
_DOUBT = 0.25
_END_PULSES = 8
_END_AMPLIFICATION = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Phase:
    """Angle of the reference shaft at some moments: `turns[k]` at sample index `samples[k]`.

    Both float64, ascending, at least two of them; indices are relative to the first sample of the window.
    """

    samples: NDArray[np.float64]
    turns: NDArray[np.float64]

    def __post_init__(self) -> None:
        if self.samples.shape != self.turns.shape or self.samples.ndim != 1 or self.samples.size < 2:
            raise InputError("Phase", "samples", self.samples.shape, "two vectors of one length, 2 or more")
        if not (np.all(np.diff(self.samples) > 0) and np.all(np.diff(self.turns) > 0)):
            raise InputError("Phase", "samples, turns", "values out of order", "both strictly ascending")


@dataclass(frozen=True, slots=True, eq=False)
class ShaftSpeed:
    """Mean speed of the reference shaft over a window or record.

    Parameters
    ----------
    value_hz : float
        NaN when nothing is known.
    ci95_hz : tuple of float
        Interval that holds the true mean speed with 95 % probability (NaN, NaN when nothing is known).
    source : {"tacho", "encoder", "estimated", "nameplate"}
    phase : Phase or None
        Angle over the window; None: the speed is taken as constant.
    note : str
        What was mended or doubted on the way, for people.
    """

    value_hz: float
    ci95_hz: tuple[float, float]
    source: SpeedSource
    phase: Phase | None = None
    note: str = ""

    @property
    def relative_error(self) -> float:
        """Half the 95 % interval over the value."""
        return 0.5 * (self.ci95_hz[1] - self.ci95_hz[0]) / self.value_hz

    def to_json(self) -> dict[str, object]:
        """The `speed_hz` object of `diagnose --json` (null where nothing is known)."""
        known = bool(np.isfinite(self.value_hz))
        return {
            "value": float(self.value_hz) if known else None,
            "ci95": [float(v) for v in self.ci95_hz] if known else None,
            "source": self.source,
        }


def nameplate_speed(machine: Machine, note: str = "") -> ShaftSpeed:
    """The nominal speed with the nameplate's tolerance as its interval."""
    value = machine.nominal_speed_hz
    half = machine.speed_tolerance
    return ShaftSpeed(value, (value * (1 - half), value * (1 + half)), "nameplate", None, note)


def window_speed(
    pulses: Sequence[PulseTrain],
    sample_count: int,
    sample_rate_hz: float,
    machine: Machine,
    source: SpeedSource = "tacho",
) -> ShaftSpeed:
    """Speed and phase over one window from the angle signals there are, else from the nameplate.

    Parameters
    ----------
    pulses : sequence of PulseTrain
        In samples from the window's start; those of the reference shaft are preferred, others are converted
        by their shaft's ratio.
    sample_count : int
        Length of the window.
    sample_rate_hz : float
    machine : Machine
    source : {"tacho", "encoder"}
        What the pulses are.

    Returns
    -------
    ShaftSpeed
        From the nameplate when no train has two pulses in the window, with a note that says so.
    """
    ranked = sorted(pulses, key=lambda train: (train.shaft != machine.reference_shaft, -train.samples.size))
    for train in ranked:
        if train.samples.size < 2:
            continue
        ratio = machine.shaft(train.shaft).ratio
        speed = phase_from_pulses(train.samples, train.pulses_per_revolution * ratio, sample_count)
        if speed is not None:
            return _in_hz(speed, sample_count, sample_rate_hz, source)
    note = f"no {source} pulses in this window" if pulses else ""
    return nameplate_speed(machine, note)


@dataclass(frozen=True, slots=True, eq=False)
class _Track:
    phase: Phase
    jitter_samples: float
    note: str


def phase_from_pulses(
    pulse_samples: NDArray[np.float64], pulses_per_turn: float, sample_count: int
) -> _Track | None:
    """Angle over [0, sample_count) from pulses, with bounces dropped and missing pulses filled in by count.

    Parameters
    ----------
    pulse_samples : ndarray of float64
        Ascending sample indices.
    pulses_per_turn : float
        Pulses in one turn of the reference shaft.
    sample_count : int

    Returns
    -------
    track or None
        `phase`, the jitter of the pulses in samples (root mean square), and a note; None with fewer than two
        pulses.

    Notes
    -----
    A train in which each interval is near the median of its neighbours is taken as it is. In any other,
    doubles are left out and missing pulses counted on by following the interval of one pulse
    (`angle.pulse_counting`). Beyond the first and last pulse the angle goes on along the parabola through
    the eight pulses next to the end.
    """
    kept = np.asarray(pulse_samples, dtype=np.float64)
    if kept.size < 2:
        return None
    counts = np.ones(kept.size - 1)
    notes = []
    if _irregular(np.diff(kept)):
        counted = count_pulses(kept)
        kept, counts = counted.samples, counted.counts
        if kept.size < 2:
            return None
        if counted.dropped:
            notes.append(f"{counted.dropped} double pulses dropped")
        if counted.missing:
            notes.append(f"{counted.missing} missing pulses filled in")
        if counted.doubtful:
            notes.append(f"{counted.doubtful} intervals fit no whole number of pulses")
    turns = np.concatenate(([0.0], np.cumsum(counts))) / pulses_per_turn
    per_pulse = np.diff(kept) / counts
    samples, turns = _extended(kept, turns, sample_count)
    return _Track(Phase(samples, turns), _jitter(per_pulse), ", ".join(notes))


def _irregular(intervals: NDArray[np.float64]) -> bool:
    """True when an interval differs from the median of those around it by more than a quarter."""
    return bool(np.any(np.abs(intervals / _local_median(intervals) - 1) > _DOUBT))


def _local_median(intervals: NDArray[np.float64]) -> NDArray[np.float64]:
    if intervals.size < 3:
        return np.full(intervals.size, float(np.median(intervals)))
    size = min(_LOCAL_INTERVALS, intervals.size - (1 - intervals.size % 2))
    return np.asarray(median_filter(intervals, size, mode="nearest"))


def _extended(
    samples: NDArray[np.float64], turns: NDArray[np.float64], sample_count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Knots at the window's ends too, so that the whole window has an angle."""
    end = float(sample_count - 1)
    if samples[0] > 0:
        turns = np.concatenate(([_beyond(samples[:_END_PULSES], turns[:_END_PULSES], 0.0)], turns))
        samples = np.concatenate(([0.0], samples))
    if samples[-1] < end:
        turns = np.concatenate((turns, [_beyond(samples[-_END_PULSES:], turns[-_END_PULSES:], end)]))
        samples = np.concatenate((samples, [end]))
    return samples, turns


def _beyond(samples: NDArray[np.float64], turns: NDArray[np.float64], at: float) -> float:
    """The angle beyond the pulses: by a parabola where enough of them are near, else by a straight line."""
    edge = 0 if at < samples[0] else -1
    scale = float(samples[-1] - samples[0])
    near = abs(at - samples[edge]) < 0.5 * scale
    degree = 2 if samples.size >= 6 and near else 1
    fit = np.polyfit((samples - samples[edge]) / scale, turns - turns[edge], degree)
    fit[-1] = 0.0  # through the outermost pulse itself
    value = float(turns[edge] + np.polyval(fit, (at - samples[edge]) / scale))
    step = (at - samples[edge]) * (turns[-1] - turns[0]) / scale
    return value if step * (value - turns[edge]) > 0 else float(turns[edge] + step)


def _jitter(per_pulse: NDArray[np.float64]) -> float:
    """White jitter from the intervals' second differences, whose variance is 20 times the jitter's."""
    if per_pulse.size < 3:
        return 0.01 * float(np.mean(per_pulse))
    third = np.diff(per_pulse, 2)
    return float(np.sqrt(np.mean(third**2) / 20.0))


def _in_hz(track: _Track, sample_count: int, sample_rate_hz: float, source: SpeedSource) -> ShaftSpeed:
    ends = np.interp([0.0, sample_count - 1.0], track.phase.samples, track.phase.turns)
    seconds = (sample_count - 1) / sample_rate_hz
    value = float(ends[1] - ends[0]) / seconds
    # The angle at the window's ends is extrapolated, which amplifies the pulses' jitter.
    half = 1.96 * _END_AMPLIFICATION * np.sqrt(2.0) * track.jitter_samples / (sample_count - 1) * value
    half = max(half, 1e-9 * value)
    return ShaftSpeed(value, (value - half, value + half), source, track.phase, track.note)
