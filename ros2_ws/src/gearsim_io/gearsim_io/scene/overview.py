"""A first look at a bag: what happened, so that the views can put it in front."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gearsim_io import cdr
from gearsim_io.bags import BagMessage, decode, read_bag
from gearsim_io.batches import TORQUE_UNIT
from gearsim_io.errors import InputError
from gearsim_io.messages import from_msg, stamp_ns
from gearsim_io.nameplate import Machine
from gearsim_io.scene import style
from gearsim_io.scene.layout import TORQUE, Focus
from gearsim_io.scene.scene import Zoom
from gearsim_io.scene.style import Rgb

_ZOOM_S = 0.25
_BEFORE_FAULT_S = 0.5
_ERROR = 2


@dataclass(slots=True)
class Overview:
    """What a bag tells, as far as a reader of the views wants to know it.

    Times are seconds from the stamp `zero_ns` of the first samples; `log_ns` are the log times of the first
    and the last message.
    """

    zero_ns: int | None = None
    end_s: float = 0.0
    sample_rate_hz: float = math.nan
    channels: tuple[str, ...] = ()
    unit: str = "1"
    axis_unit: str = "order"
    machine: Machine | None = None
    alarms: list[Any] = field(default_factory=list)
    faults: dict[str, float] = field(default_factory=dict)
    speed_hz: float = math.nan
    load_nm: float = math.nan
    kinds: set[str] = field(default_factory=set)
    gaps: int = 0
    lost_samples: int = 0
    log_ns: tuple[int, int] = (0, 0)

    def time_s(self, t_ns: int) -> float:
        """Seconds from the first samples."""
        return (t_ns - (self.zero_ns or 0)) / 1e9

    def share(self, t_ns: int) -> float:
        """How far on in the bag a log time is, from 0 to 1."""
        first, last = self.log_ns
        return min(max((t_ns - first) / max(last - first, 1), 0.0), 1.0)

    @property
    def raised(self) -> list[Any]:
        """Alarms that rose, in order of time."""
        return [alarm for alarm in self.alarms if alarm.level > alarm.previous_level]

    @property
    def worst(self) -> Any:
        """The alarm that says most: of a named component before the machine's, then the highest."""
        return min(self.raised, key=lambda a: (not a.component, -a.level, stamp_ns(a)), default=None)

    def focus(self) -> Focus:
        """Which channel and which moments to show first."""
        channel = self._front()
        return Focus(
            channel=channel,
            channels=self.channels,
            parts=self._parts(channel),
            zooms=self._zooms(channel),
            unit=self.unit,
            axis_unit=self.axis_unit,
            kinds=frozenset(self.kinds),
        )

    def _front(self) -> str:
        """The channel nearest to the part that the alarm names, else the one that the alarm names."""
        worst = self.worst
        if worst is not None:
            bearings = self.machine.bearings if self.machine is not None else ()
            near = [name for b in bearings if b.name == worst.component for name in b.channels]
            for name in (*near, worst.channel):
                if name in self.channels:
                    return str(name)
        return self.channels[0] if self.channels else ""

    def _parts(self, channel: str) -> str:
        bearings = self.machine.bearings if self.machine is not None else ()
        near = [bearing.name for bearing in bearings if channel in bearing.channels]
        return ", ".join(near)

    def _zooms(self, channel: str) -> tuple[Zoom, ...]:
        if not channel:
            return ()
        length = min(_ZOOM_S, self.end_s)
        zooms = []
        start_s = min(self.faults.values(), default=None)
        if start_s is not None and start_s > length:
            begin = max(0.0, start_s - _BEFORE_FAULT_S - length)
            zooms.append(Zoom("Before the fault", channel, begin, begin + length))
        if self.worst is not None:
            end = min(self.end_s, max(length, self.time_s(stamp_ns(self.worst))))
            zooms.append(Zoom("At the alarm", channel, end - length, end))
        if not zooms:
            begin = max(0.0, 0.5 * (self.end_s - length))
            zooms.append(Zoom("In detail", channel, begin, begin + length))
        return tuple(zooms)

    def summary(self) -> str:
        """The story in Markdown."""
        machine = self.machine
        lines = [f"## {machine.name if machine is not None else 'Unknown machine'}"]
        if machine is not None and machine.description:
            lines.append(machine.description)
        count = len(self.channels)
        channels = f"{count} channel" if count == 1 else f"{count} channels"
        facts = f"{self.end_s:.1f} s, {channels} at {self.sample_rate_hz:g} Hz"
        point = [f"{self.speed_hz:g} Hz" if math.isfinite(self.speed_hz) else ""]
        point.append(f"{self.load_nm:g} N m" if math.isfinite(self.load_nm) else "")
        lines.append(", ".join([facts, *(text for text in point if text)]))
        if self.lost_samples:
            lines.append(f"**{self.lost_samples} samples are missing in {self.gaps} gaps**")
        lines += [f"{start:.2f} s: **{name}** begins (simulated)" for name, start in self.faults.items()]
        if self.worst is not None:
            lines.append(self._alarm_line(self.worst))
        elif "AlarmState" in self.kinds:
            lines.append("**No alarm was raised.**")
        else:
            lines.append("No diagnosis was recorded.")
        return "\n\n".join(lines) + "\n"

    def _alarm_line(self, alarm: Any) -> str:
        t_s = self.time_s(stamp_ns(alarm))
        after = [t_s - start for start in self.faults.values() if t_s >= start]
        late = f", {min(after):.2f} s after it began" if after else ""
        word = "Alarm" if alarm.level >= _ERROR else "Warning"
        return f"{t_s:.2f} s: **{word}{late}**: {alarm.reason}"

    def marks(self) -> list[tuple[str, float, Rgb]]:
        """Moments to draw into the plots: name, time, colour."""
        found = [("fault begins", start, style.FAULT_RUNNING) for start in self.faults.values()][:1]
        if self.worst is not None:
            colour = style.level(self.worst.level)[1]
            found.append(("alarm", self.time_s(stamp_ns(self.worst)), colour))
        return found


def look_through(path: Path | str) -> Overview:
    """Go through a bag once.

    Raises
    ------
    InputError
        As `read_bag`, or if it holds no samples.
    """
    found = Overview()
    gaps = cdr.GapCounter()
    for message in read_bag(path):
        found.log_ns = (found.log_ns[0] or message.t_ns, message.t_ns)
        _take(found, gaps, message)
    if found.zero_ns is None:
        raise InputError(str(path), "", "no samples", "a bag with at least one SampleBatch")
    found.gaps, found.lost_samples = gaps.gaps, gaps.lost_samples
    return found


def _take(found: Overview, gaps: cdr.GapCounter, message: BagMessage) -> None:
    short = message.type.rsplit("/", 1)[-1]
    found.kinds.add(short)
    if short == "SampleBatch":
        gaps.add(message.topic, message.data, message.type)
        batch = from_msg(decode(message))
        if batch.unit == TORQUE_UNIT:
            found.kinds.add(TORQUE)
            return
        if found.zero_ns is None:
            found.zero_ns = batch.t0_ns
            found.channels, found.unit = batch.channels, batch.unit
            found.sample_rate_hz = batch.sample_rate_hz
        end_s = found.time_s(batch.t0_ns) + batch.sample_count / batch.sample_rate_hz
        found.end_s = max(found.end_s, end_s)
    elif short == "MachineInfo":
        found.machine = from_msg(decode(message))
    elif short == "Alarm":
        found.alarms.append(decode(message))
    elif short == "Spectrum":
        found.axis_unit = decode(message).axis_unit
    elif short == "GroundTruth":
        _take_faults(found, decode(message))


def _take_faults(found: Overview, truth: Any) -> None:
    found.speed_hz, found.load_nm = truth.speed, truth.load
    for fault in truth.faults:
        name = f"{fault.kind.replace('_', ' ')} on {fault.component}"
        found.faults.setdefault(name, max(0.0, found.time_s(stamp_ns(truth))))
