"""Mass of a casing by plain geometry: what the mesh must come to."""

from __future__ import annotations

import math

from gearsim_sim.model.casing.params import CasingParams


def mass_kg(params: CasingParams) -> float:
    """Plates by their middle planes, rings with discs, without pads; uniform plate thicknesses only."""
    box, rings, rim = params.box, params.rings, params.rim
    hole = math.pi * rings.outer_radius_m**2
    ends = 2 * (box.length_m * box.height_m - 2 * hole)
    sides = 2 * box.width_m * box.height_m
    frame = (box.length_m + 2 * rim.width_m) * (box.width_m + 2 * rim.width_m) - box.length_m * box.width_m
    volume = (ends + sides) * box.wall_thickness_m
    volume += box.length_m * box.width_m * box.floor_thickness_m + frame * rim.thickness_m
    volume += 4 * (hole - math.pi * rings.bore_radius_m**2) * rings.thickness_m
    return params.steel.density_kg_per_m3 * volume
