"""Geometry of a planetary stage: radii, paths of contact, and the phases of all meshes.

The frame turns with the carrier, so the position psi_i of planet i is constant. The teeth of all meshes
pass at the same rate. Phases are counted in base pitches travelled along the line of action; at phase
zero (and every whole number) a pair of teeth is at the pitch point.

Planet i meets the ring at phase Z_r (u + psi_i / 2 pi), where u are the turns of the carrier against the
ring. Its mesh with the sun has that phase, too, plus one amount that is the same for all planets: half
the planet's pitch circle lies between the two pitch points, Z_p / 2 pitches, and it touches the sun with
the other flank of a tooth, half a pitch away. So it is one half if Z_p is even, zero if Z_p is odd. That
the sun's own phase, -Z_s psi_i / 2 pi, agrees with this is the condition of assembly, psi_i (Z_s + Z_r) /
2 pi being whole. Source: Parker and Lin, "Mesh phasing relationships in planetary and epicyclic gears",
J. Mech. Design 126 (2004); thesis 7.6.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gearsim_io.errors import InputError
from gearsim_io.nameplate import PlanetaryStage
from gearsim_sim.model.tooth.gear import SpurGear
from gearsim_sim.model.tooth.pair import GearPair
from gearsim_sim.params.planetary import PlanetaryParams, Teeth

SUN, RING = 0, 1
SIDES = ("sun", "ring")


@dataclass(frozen=True)
class Contact:
    """The path of contact of one pair of teeth in base pitches from the pitch point, in order of time.

    `sense` is +1 if contact moves from root to tip of the planet's tooth, else -1.
    """

    begin: float
    end: float
    sense: int

    @property
    def ratio(self) -> float:
        """Contact ratio."""
        return self.end - self.begin

    @property
    def middle(self) -> float:
        """Middle of the path; half a pitch from it is the middle of double contact."""
        return (self.begin + self.end) / 2


@dataclass(frozen=True)
class StageGeometry:
    """A planetary stage with its planets in place."""

    stage: PlanetaryStage
    sun: GearPair  # planet as pinion, sun as wheel
    ring: GearPair  # planet as pinion, ring around it
    contacts: tuple[Contact, Contact]

    @property
    def carrier_radius_m(self) -> float:
        """From the axis of the stage to that of a planet."""
        return self.sun.centre_distance_m

    @property
    def base_radii_m(self) -> tuple[float, float, float]:
        """Of sun, ring and planet."""
        sun, ring = self.sun.wheel.base_radius_m, self.ring.wheel.base_radius_m
        return sun, ring, self.sun.pinion.base_radius_m

    @property
    def pressure_angle_rad(self) -> float:
        """Of both meshes."""
        return self.sun.pressure_angle_rad

    @property
    def base_pitch_m(self) -> float:
        """Distance of neighbouring flanks along the line of action."""
        return self.sun.pinion.base_pitch_m

    @property
    def sun_ring_phase(self) -> float:
        """Phase of a planet's mesh with the sun against its mesh with the ring, in pitches."""
        return 0.5 if self.stage.planet_teeth % 2 == 0 else 0.0

    def pair(self, side: int) -> GearPair:
        """The gears of one side (SUN, RING)."""
        return (self.sun, self.ring)[side]

    def mesh_angle_rad(self, side: int, planet: int) -> float:
        """psi_s = psi - alpha, psi_r = psi + alpha: direction of the gear's tangential motion at the mesh."""
        sign = -1.0 if side == SUN else 1.0
        return self.stage.planet_angles_rad[planet] + sign * self.pressure_angle_rad

    def phase_offset(self, side: int, planet: int) -> float:
        """Phase of a mesh at carrier angle zero, in pitches within [0, 1)."""
        phase = self.stage.ring_teeth * self.stage.planet_angles_rad[planet] / (2 * math.pi)
        return (phase + (self.sun_ring_phase if side == SUN else 0.0)) % 1.0

    def planet_offset_turns(self, side: int, planet: int) -> float:
        """Where a planet's tooth 1 is at carrier angle zero, in turns past its pitch point on that side."""
        stage = self.stage
        turned = stage.ring_teeth * stage.planet_angles_rad[planet] / (2 * math.pi) / stage.planet_teeth
        # From the ring to the sun a tooth goes half a turn; there it meets with the other flank, which runs
        # half a pitch ahead where the planet drives the sun.
        ahead = 0.5 * self.contacts[SUN].sense / stage.planet_teeth
        half = 0.5 + ahead if side == SUN else 0.0
        return (turned + half) % 1.0


def make_geometry(params: PlanetaryParams) -> StageGeometry:
    """Gears of a stage and their contact.

    Raises
    ------
    InputError
        If these teeth cannot be cut, cannot mesh, or have less than one or more than two pairs in contact.
    """
    stage, teeth = params.stage, params.model.teeth
    planet = _gear("planet", stage.planet_teeth, teeth, teeth.planet_bore_radius_m)
    sun = _gear("sun", stage.sun_teeth, teeth, teeth.sun_bore_radius_m)
    ring = _gear("ring", stage.ring_teeth, teeth, teeth.ring_outer_radius_m, internal=True)
    pairs = GearPair(planet, sun), GearPair(planet, ring)
    # With the carrier as input, ring drives planet and planet drives sun, in the carrier's frame.
    outward = 1 if stage.input_member == "carrier" else -1
    contacts = tuple(_contact(pair, sense) for pair, sense in zip(pairs, (outward, -outward), strict=True))
    for pair, contact in zip(pairs, contacts, strict=True):
        if not 1 < contact.ratio < 2:
            expected = "between 1 and 2: the model alternates one and two pairs in contact"
            raise InputError(params.where, "teeth.addendum", f"{pair.where}: {contact.ratio:.3f}", expected)
    return StageGeometry(stage, pairs[0], pairs[1], (contacts[0], contacts[1]))


def _gear(name: str, count: int, teeth: Teeth, hub_radius_m: float, *, internal: bool = False) -> SpurGear:
    return SpurGear(
        teeth=count,
        module_m=teeth.module_m,
        face_width_m=teeth.face_width_m,
        hub_radius_m=hub_radius_m,
        pressure_angle_rad=teeth.pressure_angle_rad,
        internal=internal,
        addendum=teeth.addendum,
        name=name,
    )


def _contact(pair: GearPair, sense: int) -> Contact:
    ends = [sense * (place - pair.pitch_point_m) / pair.pinion.base_pitch_m for place in pair.path_m]
    return Contact(min(ends), max(ends), sense)
