"""One record and its angle: what every comparison, measured or simulated, starts from.

A measured record and a simulated one become a `View` by the same code, so that whatever the way from
samples to features does wrong it does wrong on both sides.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from gearsim_dsp.angle.record_speed import RecordSpeed, record_speed
from gearsim_dsp.angle.resample import AngleSignal, to_angle
from gearsim_dsp.features import is_signal
from gearsim_dsp.noise_floor import effective_averages
from gearsim_dsp.quality import QualityIssue, check_levels
from gearsim_dsp.speed import Phase, ShaftSpeed, SpeedSource
from gearsim_dsp.speed_estimate import estimate_speed
from gearsim_dsp.stated_rate import doubt_of_rate
from gearsim_io.importers import machine_for
from gearsim_io.nameplate import Machine
from gearsim_io.record import Record
from gearsim_twin.load import stated_load_nm
from gearsim_twin.recordings import cut, only

__all__ = ["View", "view_of"]

# Spectra for the speed: as long as the diagnosis's windows, and the lines of shafts and meshes lie below.
_WINDOW_S, _HOPS, _TOP_HZ = 2.0, 4, 4000.0


@dataclass(frozen=True, eq=False)
class View:
    """A record, the angle of the reference shaft over it, and what is derived from both.

    Parameters
    ----------
    record : Record
        Only the channels that are compared.
    machine : Machine
        Nameplate, with the nominal speed that the record's file states, if it does.
    speed : ShaftSpeed
        Mean speed of the reference shaft, how sure, and from where; its value is NaN if nothing tells it.
    load_nm : float or None
        Mean load torque that the record states or its transducers measured.
    issues : tuple of QualityIssue
        What is doubtful: an angle signal that contradicts the nameplate, another machine's name, levels.

    Notes
    -----
    A view is equal only to itself. What it derives is kept with it; arrays it hands out are read-only.
    """

    record: Record
    machine: Machine
    speed: ShaftSpeed
    load_nm: float | None = None
    issues: tuple[QualityIssue, ...] = ()
    _kept: dict[tuple[str, int], AngleSignal] = field(default_factory=dict, repr=False)

    @property
    def phase(self) -> Phase | None:
        """Angle of the reference shaft over the record; None where only a mean speed is known."""
        return self.speed.phase

    @property
    def speed_hz(self) -> float:
        """Mean speed of the reference shaft; NaN if nothing tells it."""
        return self.speed.value_hz

    @property
    def source(self) -> SpeedSource:
        """What the speed is from: tacho, encoder, estimated from the vibration, or the nameplate."""
        return self.speed.source

    @property
    def nbytes(self) -> int:
        """Memory of its samples and of what it keeps."""
        return self.record.data.nbytes + sum(one.values.nbytes for one in self._kept.values())

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is doubtful, a sentence each for people."""
        name = self.record.source or "record"
        places = [f"{name}, {one.channel}" if one.channel else name for one in self.issues]
        return tuple(f"{place}: {one.detail}" for place, one in zip(places, self.issues, strict=True))

    @property
    def turns(self) -> float:
        """Turns of the reference shaft in the record; NaN where the speed is not known."""
        if self.phase is not None:
            return float(self.phase.turns[-1] - self.phase.turns[0])
        return self.speed_hz * self.record.seconds

    def signal(self, channel: str) -> NDArray[np.float64]:
        """Samples of a channel, float64 of shape (n,), in the record's unit; KeyError if it has no such."""
        if channel not in self.record.channels:
            raise KeyError(channel)
        return np.asarray(self.record.data[self.record.channels.index(channel)], dtype=np.float64)

    def angle(self, channel: str, samples_per_turn: int) -> AngleSignal | None:
        """A channel sampled at equal angles; None where the angle is not known."""
        if self.phase is None:
            return None
        key = (channel, samples_per_turn)
        if key not in self._kept:
            self._kept[key] = to_angle(self.signal(channel), self.phase, samples_per_turn)
        return self._kept[key]

    def speed_course(self, step_s: float = 0.05) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Time [s] and speed of the reference shaft [Hz] over the record, each float64 of shape (m,).

        Every value is the mean over `step_s` (over half a turn at least, since torsion within a turn is no
        course of the speed); a constant speed where the angle is not known.
        """
        seconds = self.record.sample_count / self.record.sample_rate_hz
        step_s = max(step_s, 0.5 / self.speed_hz) if math.isfinite(self.speed_hz) else step_s
        edges = np.linspace(0.0, seconds, max(1, round(seconds / step_s)) + 1)
        middles = 0.5 * (edges[1:] + edges[:-1])
        if self.phase is None:
            return middles, np.full(middles.size, self.speed_hz)
        turns = np.interp(edges * self.record.sample_rate_hz, self.phase.samples, self.phase.turns)
        last = min(edges[-1], float(self.phase.samples[-1]) / self.record.sample_rate_hz)
        edges[-1] = max(last, edges[-2] + 1.0 / self.record.sample_rate_hz)
        return middles, np.diff(turns) / np.diff(edges)

    def only(self, channels: Sequence[str]) -> View:
        """The view of these channels alone, in this order."""
        issues = tuple(one for one in self.issues if not one.channel or one.channel in channels)
        return View(only(self.record, channels), self.machine, self.speed, self.load_nm, issues)

    def part(self, first: int, end: int) -> View:
        """The view of samples `first` to `end` (not included), with the angle found over the whole."""
        record = cut(self.record, first, end)
        load_nm = stated_load_nm(record, self.machine)
        phase = self.phase
        if phase is None:
            return View(record, self.machine, self.speed, load_nm, self.issues)
        inside = (phase.samples > first) & (phase.samples < end - 1)
        samples = np.concatenate(([first], phase.samples[inside], [end - 1.0]))
        turns = np.interp(samples, phase.samples, phase.turns)
        value = float(turns[-1] - turns[0]) / (end - 1 - first) * record.sample_rate_hz
        half = self.speed.relative_error * value
        ends = (value - half, value + half)
        speed = replace(self.speed, value_hz=value, ci95_hz=ends, phase=Phase(samples - first, turns))
        return View(record, self.machine, speed, load_nm, self.issues)


def view_of(record: Record, machine: Machine) -> View:
    """A record with the best angle there is: its tachos or encoders, else found in the vibration.

    Parameters
    ----------
    record : Record
    machine : Machine
        Nameplate; a speed that the record's file states takes the place of its nominal one.
    """
    plate = machine_for(record, machine)
    found = record_speed(record, plate)
    issues = found.issues
    speed = found.speed
    if speed is None:
        speed = _mean_speed(record, plate)
    elif speed.source == "estimated":
        speed, doubts = _second_opinion(speed, _mean_speed(record, plate), record.seconds)
        issues = (*issues, *doubts)
    issues = (*issues, *_issues(record, plate, found, speed))
    return View(record, plate, speed, stated_load_nm(record, plate), issues)


def _second_opinion(
    tracked: ShaftSpeed, mean: ShaftSpeed, seconds: float
) -> tuple[ShaftSpeed, tuple[QualityIssue, ...]]:
    """The tracked speed; where mean spectra tell clearly another, its interval holds both, and that is told.

    A spectrum tells the speed no better than half a line of the record at the first order.
    """
    if mean.source != "estimated":
        return tracked, ()
    apart = abs(tracked.value_hz - mean.value_hz)
    known = math.hypot(*(0.5 * (one.ci95_hz[1] - one.ci95_hz[0]) for one in (tracked, mean)), 0.5 / seconds)
    if apart <= known:
        return tracked, ()
    low = min(*tracked.ci95_hz, *mean.ci95_hz)
    high = max(*tracked.ci95_hz, *mean.ci95_hz)
    detail = (
        f"followed through the record its lines tell {tracked.value_hz:.5g} Hz, those of its mean spectrum "
        f"{mean.value_hz:.5g} Hz; a tacho would decide"
    )
    return replace(tracked, ci95_hz=(low, high)), (QualityIssue("speed_doubtful", "", detail),)


def _mean_speed(record: Record, machine: Machine) -> ShaftSpeed:
    """The speed whose lines stand out of mean spectra, or the nameplate's."""
    rows = [np.asarray(row, dtype=np.float64) for row in record.data if is_signal(row)]
    length = min(record.sample_count // 2, round(_WINDOW_S * record.sample_rate_hz))
    if not rows or length < 64:
        return estimate_speed([], 1.0, 1.0, machine)
    hop = max(1, length // _HOPS)
    step_hz = record.sample_rate_hz / length
    lines = math.ceil(_TOP_HZ / step_hz)
    rate_hz, overlap = record.sample_rate_hz, length - hop
    power = [welch(row, rate_hz, "hann", length, overlap, detrend="constant")[1][:lines] for row in rows]
    averages = effective_averages(np.arange(0, record.sample_count - length + 1, hop), length)
    return estimate_speed(power, step_hz, averages, machine)


def _issues(
    record: Record, machine: Machine, found: RecordSpeed, speed: ShaftSpeed
) -> tuple[QualityIssue, ...]:
    """What speaks against the record being what it is said to be."""
    issues = []
    if record.machine and record.machine != machine.name:
        detail = f"the record says that it is of machine {record.machine!r}, not of {machine.name!r}"
        issues.append(QualityIssue("another_machine", "", detail))
    nominal, tolerance = machine.nominal_speed_hz, machine.speed_tolerance
    told = math.isfinite(speed.value_hz) and math.isfinite(nominal) and speed.source != "nameplate"
    if told and not found.issues and abs(speed.value_hz / nominal - 1) > tolerance:
        percent = 100 * (speed.value_hz / nominal - 1)
        detail = (
            f"{speed.value_hz:.5g} Hz ({speed.source}) is {percent:+.3g} % off the {nominal:.5g} Hz stated"
        )
        issues.append(QualityIssue("speed_off_nameplate", "", detail))
    rate = doubt_of_rate(record, machine, speed)
    issues += [rate] if rate is not None else []
    return (*issues, *check_levels(record, machine))
