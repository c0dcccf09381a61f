"""Sun and ring as gear wheels that meet every planet; the planets' own teeth are in `planet_faults`."""

from __future__ import annotations

import math

from gearsim_sim.model.gear_wheel import GearWheel
from gearsim_sim.model.planet_geometry import RING, SIDES, SUN, StageGeometry
from gearsim_sim.params.planetary import PlanetaryParams


def planetary_wheels(
    params: PlanetaryParams, geometry: StageGeometry, tracks: dict[str, int]
) -> tuple[GearWheel, ...]:
    """Sun and ring in each of their meshes, in the order of the meshes.

    A tooth of the sun that is at the pitch point of one planet is there at the next one when the sun has
    overtaken it; the ring lags. `tracks` are the indices of "sun_on_carrier" and "ring_on_carrier".
    """
    stage = params.stage
    teeth = (stage.sun_teeth, stage.ring_teeth)
    wheels = []
    for side in (SUN, RING):
        contact, count = geometry.contacts[side], teeth[side]
        for planet, angle in enumerate(stage.planet_angles_rad):
            met = angle / (2 * math.pi) * (-1 if side == SUN else 1)
            passed = geometry.sun_ring_phase if side == SUN else 0.0
            # Turn at which a tooth is at the pitch point, then at the middle of its path, then half a pitch
            # before that in the sense in which contact moves from the root to the tip of the planet's tooth.
            start = -met + (contact.middle - passed - 0.5 * contact.sense) / count
            wheels.append(
                GearWheel(
                    name=SIDES[side],
                    mesh=side * params.planets + planet,
                    track=tracks[f"{SIDES[side]}_on_carrier"],
                    pair=geometry.pair(side),
                    of_wheel=True,
                    start_turns=start,
                    force_per_load_n_per_nm=_force_per_load(params, geometry),
                    harmonics=int(params.model.mesh.harmonics),
                    sense=contact.sense,
                )
            )
    return tuple(wheels)


def _force_per_load(params: PlanetaryParams, geometry: StageGeometry) -> float:
    """Mean force of each mesh over the load torque: that on the sun, shared by the planets."""
    speed = params.stage.member_ratios()
    output = "sun" if params.stage.input_member == "carrier" else "carrier"
    sun_torque = abs(speed[output] / speed["sun"])
    return sun_torque / (params.planets * geometry.base_radii_m[SUN])
