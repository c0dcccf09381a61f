"""Speed and angle over a whole record from the best source there is, and what is doubtful about it.

A tacho whose speed the nameplate does not allow may be right (the machine runs at another speed) or wrong
(another number of pulses in a turn, another shaft). The vibration decides: the lines of shafts and meshes
are either sharp over the tacho's angle, or over an angle at the nameplate's speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.angle.course import Comb, line_score
from gearsim_dsp.angle.resample import to_angle
from gearsim_dsp.angle.tacholess import SpeedTrack, speed_limits, track_speed
from gearsim_dsp.features import is_signal
from gearsim_dsp.quality import QualityIssue
from gearsim_dsp.speed import Phase, ShaftSpeed, SpeedSource, window_speed
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine
from gearsim_io.record import PulseTrain, Record

__all__ = ["Doubt", "RecordSpeed", "changes", "doubt_of_angle", "record_speed"]

_SURE = 0.9
_LEAST_CHANGE = 2e-3
_CLEARER = 1.25
_CLEAR_DB = 6.0
_TOP_SHARE = 0.4
_SIMPLE = (2.0, 3.0, 4.0, 0.5, 1 / 3, 0.25)
_SAME = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class Doubt:
    """A tacho or encoder that contradicts the nameplate's speed.

    Parameters
    ----------
    issue : QualityIssue
        For people.
    instead : ShaftSpeed or None
        What the vibration says, where it contradicts the angle signal too; None where nothing decides.
    """

    issue: QualityIssue
    instead: ShaftSpeed | None


@dataclass(frozen=True, slots=True, eq=False)
class RecordSpeed:
    """Speed over a record.

    Parameters
    ----------
    speed : ShaftSpeed or None
        With its phase; None where neither an angle signal nor the vibration gives one that is sure.
    replaces_angle : bool
        True where `speed` is to be used in place of what windows would find: a wrong angle signal, or none
        and a speed that changes.
    issues : tuple of QualityIssue
    """

    speed: ShaftSpeed | None
    replaces_angle: bool = False
    issues: tuple[QualityIssue, ...] = ()


def record_speed(record: Record, machine: Machine) -> RecordSpeed:
    """Speed and angle over a record: from its tachos or encoders unless they are wrong, else found.

    Parameters
    ----------
    record : Record
        Channels with values that are not finite are left out.
    machine : Machine
    """
    known = {channel.name for channel in machine.channels} or set(record.channels)
    named = zip(record.channels, record.data, strict=True)
    signals = record.data[[name in known and is_signal(samples) for name, samples in named]]
    source: SpeedSource = "tacho" if record.tachos else "encoder"
    trains = record.tachos or tuple(
        PulseTrain(e.shaft, float(e.lines_per_revolution), e.samples) for e in record.encoders
    )
    listed = {shaft.name for shaft in machine.shafts}
    trains = tuple(train for train in trains if train.shaft in listed)
    speed = window_speed(trains, record.sample_count, record.sample_rate_hz, machine, source)
    if speed.phase is not None:
        doubt = doubt_of_angle(signals, record.sample_rate_hz, machine, speed)
        if doubt is None:
            return RecordSpeed(speed)
        return RecordSpeed(doubt.instead or speed, doubt.instead is not None, (doubt.issue,))
    track = _tracked(signals, record.sample_rate_hz, machine)
    if track is None or track.confidence < _SURE:
        return RecordSpeed(None)
    return RecordSpeed(track.shaft_speed(), changes(track))


def changes(track: SpeedTrack) -> bool:
    """True when a track is sure and its speed changes by more than spectra of a constant one can bear.

    A change of 0.2 % smears the 40th order over four lines of a window of 50 turns.
    """
    return track.confidence >= _SURE and track.change >= max(_LEAST_CHANGE, 4 * track.relative_error)


def doubt_of_angle(
    signals: NDArray[np.float32] | NDArray[np.float64],
    sample_rate_hz: float,
    machine: Machine,
    speed: ShaftSpeed,
) -> Doubt | None:
    """Whether an angle signal is to be doubted, and what the vibration says instead.

    Parameters
    ----------
    signals : ndarray, shape (channels, n)
        Finite values.
    sample_rate_hz : float
    machine : Machine
    speed : ShaftSpeed
        From the angle signal, with its phase.

    Returns
    -------
    Doubt or None
        None where the nameplate allows the speed, or the vibration's lines fit it better than any speed that
        the nameplate allows: the machine then really runs at another speed.
    """
    low, high = speed_limits(machine)
    nominal = machine.nominal_speed_hz
    if speed.phase is None or not math.isfinite(nominal) or low <= speed.value_hz <= high:
        return None
    said = f"the {speed.source} gives {speed.value_hz:.4g} Hz, the nameplate {nominal:.4g} Hz"
    track = _tracked(signals, sample_rate_hz, machine)
    own = _clearness(signals, sample_rate_hz, machine, speed.phase)
    other = -math.inf
    if track is not None and track.confidence >= _SURE:
        other = _clearness(signals, sample_rate_hz, machine, track.phase)
        if other > _CLEARER * max(own, 0.0) + _CLEAR_DB:
            hint = _hint(speed, track.mean_hz, machine)
            detail = f"{said}; the lines in the vibration fit {track.mean_hz:.4g} Hz, which is used{hint}"
            return Doubt(QualityIssue("angle_contradicted", "", detail), track.shaft_speed())
    if own > _CLEARER * max(other, 0.0) + _CLEAR_DB:
        return None
    detail = f"{said}; the vibration does not tell which is right, the {speed.source} is used"
    return Doubt(QualityIssue("angle_doubtful", "", detail), None)


def _tracked(
    signals: NDArray[np.float32] | NDArray[np.float64], rate_hz: float, machine: Machine
) -> SpeedTrack | None:
    if signals.shape[0] == 0:
        return None
    try:
        return track_speed(signals, rate_hz, machine)
    except InputError:  # too short
        return None


def _clearness(
    signals: NDArray[np.float32] | NDArray[np.float64], rate_hz: float, machine: Machine, phase: Phase
) -> float:
    """How clearly the comb of shafts and meshes shows over an angle, in dB."""
    if signals.shape[0] == 0:
        return -math.inf
    mean_hz = (phase.turns[-1] - phase.turns[0]) / (phase.samples[-1] - phase.samples[0]) * rate_hz
    comb = Comb.of(machine, _TOP_SHARE * rate_hz / mean_hz)
    per_turn = max(16, math.ceil(2.6 * comb.top))
    return line_score(np.stack([to_angle(x, phase, per_turn).values for x in signals]), per_turn, comb)


def _hint(speed: ShaftSpeed, true_hz: float, machine: Machine) -> str:
    """What may be wrong with the angle signal, from how much it is off."""
    ratio = speed.value_hz / true_hz
    for factor in _SIMPLE:
        if abs(ratio / factor - 1) < _SAME:
            amount = f"{factor:.0f} times as many" if factor > 1 else f"1/{1 / factor:.0f} of the"
            return f" (as if it gave {amount} pulses in a turn that are listed)"
    for shaft in machine.shafts:
        if abs(ratio / shaft.ratio - 1) < _SAME:
            return f" (as if it sat on shaft {shaft.name!r})"
    return ""
