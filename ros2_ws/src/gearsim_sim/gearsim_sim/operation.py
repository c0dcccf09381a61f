"""How a scenario wants a machine to be run beyond speed and load: its profile, its ripple, its structure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from gearsim_io.errors import InputError
from gearsim_io.places import entry
from gearsim_sim.model.assembly import Vector
from gearsim_sim.model.faults.on_site import hangable_sites, paired, site_directions
from gearsim_sim.model.plant import LOAD, MOTOR, Plant, Track
from gearsim_sim.model.rotating_force import TIME_TRACK, RotatingForce
from gearsim_sim.model.side_oscillator import SideOscillator
from gearsim_sim.model.structure import StructureModel, hung
from gearsim_sim.profile.build import DriveLimits, Wanted, build_profile, read_trace
from gearsim_sim.profile.profile import Profile, load_ratio
from gearsim_sim.profile.settings import ProfileModel, RippleModel

# Ripple fades out where it is slower: a standing shaft is held.
RIPPLE_CORNER_HZ = 1.0


@dataclass(frozen=True)
class Operation:
    """The sections `profile` and `structure` of a scenario, and where they come from."""

    profile: ProfileModel = field(default_factory=ProfileModel)
    structure: StructureModel = field(default_factory=StructureModel)
    where: str = "engine"
    folder: Path = Path()

    def machine(self, plant: Plant) -> Plant:
        """The machine with its added structure, and with an angle for each ripple.

        Raises
        ------
        InputError
            For sites that the machine does not have.
        """
        added = self._oscillators(plant)
        if added:
            plant = hung(plant, added)
        return replace(plant, tracks=(*plant.tracks, *_ripple_tracks(plant, self.profile.ripple)))

    def _oscillators(self, plant: Plant) -> dict[str, SideOscillator]:
        found = {}
        for number, one in enumerate(self.structure.resonances):
            where = entry("structure.resonances", number, len(self.structure.resonances)) + ".site"
            for axis, direction in enumerate(self._directions(plant, one.site, where)):
                found[f"resonance_{number + 1}_{axis}"] = one.oscillator((direction,))
        for number, path in enumerate(self.structure.paths):
            where = entry("structure.paths", number, len(self.structure.paths))
            for name, end in (("from", path.from_site), ("to", path.to)):
                self._directions(plant, end, f"{where}.{name}")
            try:
                pairs = paired(plant, path.from_site, path.to)
            except InputError as error:
                raise InputError(self.where, f"{where}.to", error.value, error.expected) from None
            for axis, ends in enumerate(pairs):
                found[f"path_{number + 1}_{axis}"] = path.oscillator(ends)
        return found

    def _directions(self, plant: Plant, site: str, field: str) -> tuple[Vector, ...]:
        known = hangable_sites(plant)
        if site not in known:
            raise InputError(self.where, field, site, "one of " + ", ".join(known))
        return site_directions(plant, site)

    def course(
        self, plant: Plant, step_s: float, speed_hz: float | None, load_nm: float, seed: int
    ) -> Profile:
        """The profile on a machine."""
        limits = plant.limits
        drive = DriveLimits(
            step_s=step_s,
            ratio=load_ratio(plant),
            inertia_kg_m2=plant.inertia_kg_m2,
            speed_hz=limits.speed_limit_hz,
            load_nm=limits.load_limit_nm,
            acceleration_torque_nm=limits.acceleration_torque_nm,
        )
        wanted = Wanted(speed_hz, load_nm, self.profile, self.where, self.folder, seed)
        return build_profile(wanted, drive)

    def first_speed_hz(self, given: float | None) -> float:
        """The speed at the start: as given, or that of the measured trace.

        Raises
        ------
        InputError
            If there is neither or both, or the trace cannot be read.
        """
        trace = self.profile.trace
        if (given is None) != (trace is not None):
            expected = "a speed, or else a profile.trace"
            raise InputError(
                self.where, "operating_point.speed", "nothing" if given is None else given, expected
            )
        if trace is None:
            assert given is not None
            return given
        return float(read_trace(trace, self.folder, self.where)[0].values[0])

    def first_load_nm(self, given: float | None) -> float:
        """The load at the start: as given, or that of the measured trace.

        Raises
        ------
        InputError
            If there is neither, or the trace cannot be read.
        """
        if given is not None:
            return given
        trace = self.profile.trace
        load = None if trace is None else read_trace(trace, self.folder, self.where)[1]
        if load is None:
            expected = "a load, or else a load column in profile.trace"
            raise InputError(self.where, "operating_point.load", "nothing", expected)
        return float(load.values[0])

    def forces(self, plant: Plant) -> tuple[RotatingForce, ...]:
        """Ripple of the torques, on the machine that `machine` has given."""
        ripple = self.profile.ripple
        first = len(plant.tracks) - len(ripple)
        return tuple(_ripple(plant, one, first + i) for i, one in enumerate(ripple))


def _ripple_tracks(plant: Plant, ripple: Sequence[RippleModel]) -> list[Track]:
    """The angle that each ripple follows: `order` times that of its shaft, also where it is not whole."""
    rates = {"motor": 1.0, "load": load_ratio(plant)}
    return [Track(f"ripple {i}", (one.order or 0.0) * rates[one.at]) for i, one in enumerate(ripple, 1)]


def _ripple(plant: Plant, one: RippleModel, track: int) -> RotatingForce:
    column = plant.system.inputs[:, MOTOR if one.at == "motor" else LOAD]
    direction: Vector = {
        name: float(value) for name, value in zip(plant.system.dof_names, column, strict=True) if value
    }
    cosine, sine = one.amplitude * math.cos(one.phase), -one.amplitude * math.sin(one.phase)
    if one.frequency is not None:
        return RotatingForce(direction, TIME_TRACK, one.frequency, cosine, sine)
    return RotatingForce(direction, track, 1.0, cosine, sine, corner_hz=RIPPLE_CORNER_HZ)
