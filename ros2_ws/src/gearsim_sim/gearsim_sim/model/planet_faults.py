"""What faults of planet teeth do to the meshes of their planet, as functions of the planet's turn.

A planet's tooth meets the sun with one flank and the ring with the other, half a turn later. A root crack
takes stiffness from both meshes: in full where the load opens it, in part where the load presses it shut
(a slot, as in thesis 7.3.2, does not close). A spall is on one flank and only that mesh meets it.
"""

from __future__ import annotations

import math

import numpy as np

from gearsim_sim.model.periodic import PeriodicSeries
from gearsim_sim.model.planet_geometry import StageGeometry
from gearsim_sim.model.planet_meshes import of_pair, on_planet, turned
from gearsim_sim.model.planetary import mean_stiffness
from gearsim_sim.model.tooth.crack import Crack, crack_stiffness_loss
from gearsim_sim.model.tooth.flanks import ToothSpall, spall_error
from gearsim_sim.model.tooth.stiffness import stiffness_series
from gearsim_sim.model.tooth.windows import scaled, window_nodes, window_series
from gearsim_sim.params.planetary import PlanetaryParams


def crack_loss(
    params: PlanetaryParams,
    geometry: StageGeometry,
    side: int,
    planet: int,
    crack: Crack,
    tooth: int,
    opens: bool,
) -> PeriodicSeries:
    """Change of the stiffness [N/m, <= 0] of one mesh over the turns of "planet".

    The potential-energy method gives the loss as a fraction of its own mean stiffness; that fraction is
    applied to the mean stiffness of the model.

    Raises
    ------
    InputError
        If the crack is deeper than the tooth can bear.
    """
    harmonics, pair = int(params.model.mesh.harmonics), geometry.pair(side)
    loss = crack_stiffness_loss(pair, crack, tooth=0, opens=opens, harmonics=harmonics)
    scale = mean_stiffness(params, geometry, side) / stiffness_series(pair, 1).mean
    return _placed(geometry, side, planet, tooth, of_pair(geometry, side, scaled(loss, scale)))


def spall_drop(
    params: PlanetaryParams, geometry: StageGeometry, side: int, planet: int, spall: ToothSpall, tooth: int
) -> PeriodicSeries:
    """Transmission error [m, <= 0] of one mesh over the turns of "planet".

    A rounded spall lets the other flank dip in as far as its curvature allows, and other pairs in contact
    carry it in part. A rectangular one is the transmission error of thesis Figure 7.10: the same depth in
    the mesh with sun or ring, all along the width.

    Raises
    ------
    InputError
        If the spall is not on the part of the flank that is ever in contact.
    """
    harmonics, pair = int(params.model.mesh.harmonics), geometry.pair(side)
    if spall.shape == "rounded":
        drop = spall_error(pair, spall, tooth=0, harmonics=harmonics)
        return _placed(geometry, side, planet, tooth, of_pair(geometry, side, drop))
    return _placed(geometry, side, planet, tooth, _rectangle(geometry, side, spall, harmonics))


def _rectangle(geometry: StageGeometry, side: int, spall: ToothSpall, harmonics: int) -> PeriodicSeries:
    """Over the turn since tooth 1 was at the pitch point."""
    gear = geometry.pair(side).pinion
    # Along the involute at the pitch point, r_b tan(a) per radian of roll; a pitch is 2 pi / teeth of roll.
    per_pitch = gear.base_radius_m * math.tan(geometry.pressure_angle_rad) * 2 * math.pi / gear.teeth
    nodes = window_nodes(spall.width_m / per_pitch, harmonics)
    depth = np.full(nodes.phase.shape, -spall.depth_m * spall.face_fraction)
    return turned(window_series(nodes, depth, gear.teeth, 0, harmonics), 0.5 / gear.teeth)


def _placed(
    geometry: StageGeometry, side: int, planet: int, tooth: int, series: PeriodicSeries
) -> PeriodicSeries:
    """A function of the turn since tooth 1 was at the pitch point, for a later tooth, over "planet"."""
    later = turned(series, -tooth / geometry.stage.planet_teeth)
    return on_planet(geometry, side, planet, later)
