"""A record as judges see it: channels that can be judged, the angle of the reference shaft, the nameplate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.speed import Phase, ShaftSpeed
from gearsim_dsp.synchronous.tsa import Average, shaft_average
from gearsim_io.errors import InputError
from gearsim_io.nameplate import GearMesh, Machine
from gearsim_io.record import PulseTrain, Record

__all__ = ["Measured", "wheels_on"]

Kept = TypeVar("Kept")


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """One stretch of all channels without gaps.

    Parameters
    ----------
    machine : Machine
    sample_rate_hz : float
    unit : str
        Of all channels; levels are judged in "m/s^2" only.
    channels : dict of str to ndarray, shape (n,)
        Finite samples of the channels fit to be judged.
    speed : ShaftSpeed
        Of the reference shaft; without `phase` nothing that needs the angle is judged.
    encoders : dict of str to PulseTrain
        Edges of encoders by shaft, for transmission errors.
    """

    machine: Machine
    sample_rate_hz: float
    unit: str
    channels: dict[str, NDArray[np.floating]]
    speed: ShaftSpeed
    encoders: dict[str, PulseTrain] = field(default_factory=dict)
    _averages: dict[tuple[object, ...], Average | None] = field(default_factory=dict)
    _kept: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        lengths = {values.size for values in self.channels.values()}
        if len(lengths) > 1:
            raise InputError("Measured", "channels", sorted(lengths), "channels of one length")

    @classmethod
    def of_record(cls, record: Record, machine: Machine, speed: ShaftSpeed) -> Measured:
        """The machine's channels in a record but for those that are constant or not finite.

        Parameters
        ----------
        record : Record
        machine : Machine
        speed : ShaftSpeed
            With its phase over the record, where that is known.
        """
        known = {channel.name for channel in machine.channels} or set(record.channels)
        channels = {
            name: record.data[row]
            for row, name in enumerate(record.channels)
            if name in known and bool(np.all(np.isfinite(record.data[row]))) and np.ptp(record.data[row]) > 0
        }
        encoders = {
            one.shaft: PulseTrain(one.shaft, float(one.lines_per_revolution), one.samples)
            for one in record.encoders
        }
        return cls(machine, record.sample_rate_hz, record.unit, channels, speed, encoders)

    @property
    def phase(self) -> Phase | None:
        """Angle of the reference shaft."""
        return self.speed.phase

    @property
    def sample_count(self) -> int:
        """Samples of each channel."""
        return next((values.size for values in self.channels.values()), 0)

    @property
    def turns(self) -> float:
        """Turns of the reference shaft; 0 where the angle is not known."""
        return float(self.phase.turns[-1] - self.phase.turns[0]) if self.phase else 0.0

    def last(self, share: float) -> Measured:
        """The end of the stretch, `share` of it; encoders, which judges of this do not read, are left out."""
        first = self.sample_count - round(share * self.sample_count)
        channels = {name: values[first:] for name, values in self.channels.items()}
        speed = self.speed
        if self.phase is not None:
            later = self.phase.samples > first
            start = float(np.interp(first, self.phase.samples, self.phase.turns))
            samples = np.concatenate(([0.0], self.phase.samples[later] - first))
            phase = Phase(samples, np.concatenate(([start], self.phase.turns[later])))
            value = (phase.turns[-1] - start) / samples[-1] * self.sample_rate_hz
            scale = float(value) / speed.value_hz
            low, high = speed.ci95_hz
            speed = replace(speed, value_hz=float(value), ci95_hz=(scale * low, scale * high), phase=phase)
        return Measured(self.machine, self.sample_rate_hz, self.unit, channels, speed)

    def once(self, name: str, make: Callable[[Measured], Kept]) -> Kept:
        """What several judges ask for, made by the first of them and kept under its name."""
        if name not in self._kept:
            self._kept[name] = make(self)
        return cast(Kept, self._kept[name])

    def average(self, channel: str, shaft_ratio: float, samples_per_turn: int) -> Average | None:
        """Synchronous average of a channel over one turn of a shaft; None with fewer than four turns."""
        key = (channel, round(shaft_ratio, 9), samples_per_turn)
        if key not in self._averages:
            enough = self.phase is not None and self.turns * shaft_ratio >= 4.0
            found = None
            if enough:
                assert self.phase is not None
                found = shaft_average(
                    self.channels[channel],
                    self.phase,
                    ratio=shaft_ratio,
                    samples_per_turn=samples_per_turn,
                )
            self._averages[key] = found
        return self._averages[key]


def wheels_on(machine: Machine, shaft_ratio: float) -> list[tuple[GearMesh, str, int]]:
    """Gears on shafts of one speed: their mesh, "pinion" or "gear", and teeth.

    The pinion is the wheel with fewer teeth; of two alike the driving one.
    """
    found = []
    for mesh in machine.gear_meshes:
        small = "driving" if mesh.driving_teeth <= mesh.driven_teeth else "driven"
        for side, shaft, teeth in (
            ("driving", mesh.driving_shaft, mesh.driving_teeth),
            ("driven", mesh.driven_shaft, mesh.driven_teeth),
        ):
            if abs(machine.shaft(shaft).ratio / shaft_ratio - 1.0) < 1e-6:
                found.append((mesh, "pinion" if side == small else "gear", teeth))
    return found
