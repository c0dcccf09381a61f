"""What the plots are made of: the only file here that knows the inside of a diagnosis."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.diagnose import Diagnosis
from gearsim_dsp.families import FamilyEvidence
from gearsim_dsp.features import is_signal
from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.kinematics import fault_families, mesh_orders
from gearsim_dsp.planet_kinematics import planetary_orders
from gearsim_dsp.speed import Phase, ShaftSpeed
from gearsim_io.errors import InputError
from gearsim_io.importers import machine_for
from gearsim_io.nameplate import Machine
from gearsim_io.record import Record

__all__ = ["BEARING_FAULTS", "LONGEST_S", "Material", "Mesh"]

BEARING_FAULTS = ("outer_race", "inner_race", "rolling_element", "cage")
LONGEST_S = 20.0
"""What costs much is computed from so much of the record; the captions say so."""

Samples = NDArray[np.float32] | NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Mesh:
    """A gear mesh: its order and the spacings of its sidebands, as orders of the reference shaft."""

    name: str
    order: float
    spacings: tuple[tuple[str, float], ...]  # whose turn, and how often


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """A record with its diagnosis, ready to be drawn.

    Parameters
    ----------
    record : Record
    machine : Machine
        With the nominal speed that the record states, if it does.
    diagnosis : Diagnosis
    channels : dict of str to ndarray, shape (n,)
        Finite samples of the machine's channels.
    turning : ShaftSpeed
        Of the reference shaft, with its angle over the record where that is known.
    phase : Phase or None
        Angle that the diagnosis resampled by: from tacho or encoder, or found while the speed changes.
    channel : str
        That shows most.
    """

    record: Record
    machine: Machine
    diagnosis: Diagnosis
    channels: dict[str, Samples]
    turning: ShaftSpeed
    phase: Phase | None
    channel: str

    @classmethod
    def of(cls, record: Record, machine: Machine, diagnosis: Diagnosis) -> Material:
        """Put together what belongs to a diagnosis of `record`."""
        plate, angle = machine_for(record, machine), diagnosis.angle
        known = {channel.name for channel in plate.channels} or set(record.channels)
        channels: dict[str, Samples] = {
            name: samples
            for name, samples in zip(record.channels, record.data, strict=True)
            if name in known and is_signal(samples)
        }
        phase = None
        if angle.speed is not None and (angle.replaces_angle or angle.speed.source in ("tacho", "encoder")):
            phase = angle.speed.phase
        turning = angle.speed or diagnosis.speed
        return cls(record, plate, diagnosis, channels, turning, phase, _channel(diagnosis, channels))

    @property
    def unit(self) -> str:
        """Of the samples; "as recorded" where the source states none."""
        return {"m/s^2": "m/s²", "1": "as recorded"}.get(self.record.unit, self.record.unit)

    @property
    def density_unit(self) -> str:
        """Of power spectral densities."""
        return "power density" if self.record.unit == "1" else f"({self.unit})²/Hz"

    @property
    def rate_hz(self) -> float:
        """Sampling rate."""
        return self.record.sample_rate_hz

    @property
    def speed_hz(self) -> float:
        """Mean speed of the reference shaft; NaN where it is not known."""
        return float(self.diagnosis.speed.value_hz)

    @property
    def speed_change(self) -> float:
        """Spread of the speed over tenths of the record, over its mean; 0 where the angle is not known."""
        if self.turning.phase is None:
            return 0.0
        ends = np.linspace(0.0, self.record.sample_count - 1.0, 11)
        speeds = np.diff(np.interp(ends, self.turning.phase.samples, self.turning.phase.turns))
        return float(np.ptp(speeds) / np.mean(speeds))

    @property
    def angle(self) -> Phase | None:
        """Angle over the record: measured, found, or of a constant speed."""
        if self.turning.phase is not None:
            return self.turning.phase
        if not math.isfinite(self.speed_hz):
            return None
        ends = np.array([0.0, self.record.sample_count - 1.0])
        return Phase(ends, ends * self.speed_hz / self.rate_hz)

    def samples(self, channel: str, longest_s: float | None = None) -> Samples:
        """A channel, or the beginning of it.

        Raises
        ------
        InputError
            When no such channel is fit to be drawn.
        """
        values = self.channels.get(channel)
        if values is None:
            raise InputError("report", "channel", channel or "none", "a channel that is fit to be judged")
        count = values.size if longest_s is None else min(values.size, round(longest_s * self.rate_hz))
        return values[:count]

    def cut(self, seconds: float | None) -> Phase | None:
        """`phase`, of the beginning of the record only where that is all that is looked at."""
        if self.phase is None or seconds is None or seconds >= self.record.seconds:
            return self.phase
        end = round(seconds * self.rate_hz)
        inside = self.phase.samples < end
        at = np.append(self.phase.samples[inside], float(end))
        return Phase(at, np.interp(at, self.phase.samples, self.phase.turns))

    def of_bearings(self) -> tuple[Finding, ...]:
        """Findings that show in the envelope of a band."""
        return tuple(f for f in self.diagnosis.findings if "band_hz" in f.evidence)

    def band_hz(self, finding: Finding) -> tuple[float, float]:
        """Band in which a finding of `of_bearings` shows best."""
        low, high = finding.evidence["band_hz"]  # type: ignore[misc]
        return float(low), float(high)  # type: ignore[has-type]

    def evidence(self) -> tuple[FamilyEvidence, ...]:
        """How strongly each fault family of the bearings shows, found or not."""
        return self.diagnosis.verdict.evidence if self.diagnosis.verdict else ()

    def closest(self) -> FamilyEvidence | None:
        """The family that comes closest to a finding; None where no bearing could be judged."""
        fit = [one for one in self.evidence() if one.channel in self.channels]
        return min(fit, key=lambda one: (one.false_alarm_probability, -one.modulation), default=None)

    def shafts(self) -> dict[float, str]:
        """Names of the shafts by their speed over the reference shaft's; shafts of one speed share a line."""
        names: dict[float, list[str]] = {}
        for shaft in self.machine.shafts:
            names.setdefault(round(shaft.ratio, 9), []).append(shaft.name)
        return {ratio: ", ".join(found) for ratio, found in names.items()}

    def meshes(self) -> tuple[Mesh, ...]:
        """Gear pairs and planetary stages."""
        orders = mesh_orders(self.machine)
        found = []
        for mesh in self.machine.gear_meshes:
            turns = {
                round(self.machine.shaft(name).ratio, 9): name
                for name in (mesh.driven_shaft, mesh.driving_shaft)
            }
            spacings = tuple((name, ratio) for ratio, name in turns.items())
            found.append(Mesh(mesh.name, orders[mesh.name], spacings))
        for stage in self.machine.planetary_stages:
            planet = planetary_orders(self.machine, stage)
            spacings = (("planet pass", planet.planet_pass), ("carrier", planet.ring_on_carrier))
            found.append(Mesh(stage.name, planet.mesh, spacings))
        return tuple(found)

    def expected(self) -> Iterator[tuple[str, str, float]]:
        """Label, bearings and order of every fault family of the bearings, like ones together."""
        together: dict[tuple[str, float], list[str]] = {}
        for family in fault_families(self.machine):
            together.setdefault((family.label, round(family.order, 6)), []).append(family.component)
        for (label, order), components in together.items():
            yield label, ", ".join(components), order

    def sideband(self, finding: Finding) -> float:
        """Spacing of the sidebands that a finding's family has, as an order; 0 where it has none."""
        for family in fault_families(self.machine):
            if family.component == finding.component and family.fault == finding.fault:
                return family.sideband_order
        return 0.0


def _channel(diagnosis: Diagnosis, channels: dict[str, Samples]) -> str:
    """The channel of the strongest finding, else that of the evidence that comes closest, else the first."""
    names = [finding.channel for finding in diagnosis.findings]
    if diagnosis.verdict:
        ranked = sorted(diagnosis.verdict.evidence, key=lambda one: one.false_alarm_probability)
        names += [one.channel for one in ranked]
    return next((name for name in [*names, *channels] if name in channels), "")
