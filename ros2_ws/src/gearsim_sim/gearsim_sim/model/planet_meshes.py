"""Meshes of a planetary stage: stiffness in phase with the teeth, errors of sun, ring and planets.

An error belongs to a gear and is a function of that gear's angle against the carrier: the sun's as planet
i meets it, the ring's likewise, and of a planet one for each flank. They are the sums (7.39) to (7.43)
with the errata: run-out 20 um / k^2, tooth profile 1 um / k at the multiples k of the tooth order (7.41
and 7.43; 7.42 repeats a line with other amplitudes), random but fixed phases, and errors of single teeth
and of the surface as on the parallel shafts. All are periodic in their gear's own turn against the
carrier: the thesis's T is "the shaft's period", which for the sun must not be that of the carrier, or
lines at half the mesh order appear (docs/planetary.md).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.gear_errors import normal_draws, pitch_series, surface_series
from gearsim_sim.model.gear_mesh import Mesh, MeshError, two_pair_stiffness
from gearsim_sim.model.periodic import PeriodicSeries, merged
from gearsim_sim.model.planet_geometry import RING, SUN, StageGeometry
from gearsim_sim.model.planetary import mean_stiffness, mesh_name
from gearsim_sim.model.tooth.stiffness import stiffness_series
from gearsim_sim.model.tooth.windows import scaled
from gearsim_sim.params.planetary import PlanetaryParams

# Streams of the counter-based generator; 1 and 2 are those of gear_errors.
_PHASE_STREAM = 3
_POSITION_STREAM = 4
# Numbers of the wheels in the random streams: sun, ring, then two flanks for each planet.
_SUN_WHEEL, _RING_WHEEL, _FIRST_PLANET_WHEEL = 0, 1, 2


def turned(series: PeriodicSeries, turns: float) -> PeriodicSeries:
    """The function u -> series(u + turns)."""
    angle = 2 * np.pi * series.orders * turns
    c, s = np.cos(angle), np.sin(angle)
    return PeriodicSeries(
        mean=series.mean,
        orders=series.orders,
        cosine=series.cosine * c + series.sine * s,
        sine=series.sine * c - series.cosine * s,
    )


def reversed_series(series: PeriodicSeries) -> PeriodicSeries:
    """The function u -> series(-u)."""
    return PeriodicSeries(series.mean, series.orders, series.cosine, -series.sine)


def mesh_stiffness(params: PlanetaryParams, geometry: StageGeometry, side: int) -> PeriodicSeries:
    """Stiffness [N/m] of the meshes of one side over their phase, which is whole at the pitch point."""
    mesh = params.model.mesh
    mean, contact = mean_stiffness(params, geometry, side), geometry.contacts[side]
    if not params.physics.mesh_stiffness_variation:
        return two_pair_stiffness(mean, 1.0, contact.ratio, 0)
    if mesh.potential_energy:
        found = stiffness_series(geometry.pair(side), int(mesh.harmonics))
        shape = scaled(found, mean / found.mean)
        shape = shape if contact.sense > 0 else reversed_series(shape)
    else:
        shape = two_pair_stiffness(mean, mesh.pair_stiffness_ratio, contact.ratio, int(mesh.harmonics))
    return turned(shape, -(contact.middle + 0.5))


def wheel_error(params: PlanetaryParams, teeth: int, seed: int, wheel: int) -> PeriodicSeries:
    """Transmission error [m] of one wheel (or flank of a planet) over its turn against the carrier."""
    errors, physics = params.model.gear_errors, params.physics
    runs, profile = int(errors.runout_harmonics), int(errors.profile_harmonics)
    k = np.concatenate([np.arange(1, runs + 1), np.arange(1, profile + 1)])
    amplitude = np.concatenate(
        [
            errors.runout_m * physics.runout / np.arange(1, runs + 1) ** 2,
            errors.profile_m * physics.tooth_profile / np.arange(1, profile + 1),
        ]
    )
    phase = 2 * np.pi * _uniform(seed, wheel, k.size)
    parts = [
        PeriodicSeries(
            mean=0.0,
            orders=np.concatenate([k[:runs], teeth * k[runs:]]),
            cosine=amplitude * np.sin(phase),
            sine=amplitude * np.cos(phase),
        )
    ]
    top = profile * teeth
    if physics.tooth_pitch and errors.pitch_rms_m > 0:
        parts.append(pitch_series(errors.pitch_rms_m * normal_draws(seed, 1, wheel, teeth), top))
    if physics.tooth_surface and errors.surface_rms_m > 0:
        parts.append(surface_series(errors.surface_rms_m, normal_draws(seed, 2, wheel, 2 * top), top))
    return merged(*parts)


def planet_error(params: PlanetaryParams, seed: int, side: int, planet: int) -> PeriodicSeries:
    """Error of one flank of a planet over its turn, zero where tooth 1 is at the pitch point."""
    own = 0 if params.model.gear_errors.identical_planets else planet
    wheel = _FIRST_PLANET_WHEEL + 2 * own + side
    return wheel_error(params, params.stage.planet_teeth, seed, wheel)


def on_planet(geometry: StageGeometry, side: int, planet: int, series: PeriodicSeries) -> PeriodicSeries:
    """A function of the turns since tooth 1 was at a planet's pitch point, over the turns of "planet"."""
    return turned(series, geometry.planet_offset_turns(side, planet))


def of_pair(geometry: StageGeometry, side: int, series: PeriodicSeries) -> PeriodicSeries:
    """A function of the planet's turn as the pinion of a `GearPair`, since tooth 1 was at the pitch point.

    There contact moves from root to tip of the planet's tooth, and a tooth's middle of contact is half a
    pitch after the start of its turn.
    """
    contact, teeth = geometry.contacts[side], geometry.stage.planet_teeth
    forward = series if contact.sense > 0 else reversed_series(series)
    return turned(forward, (0.5 * contact.sense - contact.middle) / teeth)


def position_errors_m(params: PlanetaryParams, seed: int) -> NDArray[np.float64]:
    """How far each pin is ahead along its circle [m]; shape (planets,)."""
    scale = params.model.planet_positions.error_m
    return scale * normal_draws(seed, _POSITION_STREAM, 0, params.planets)


def position_compression(geometry: StageGeometry, ahead_m: float) -> float:
    """Compression of both meshes of a planet whose pin is ahead along its circle [m].

    Both lines of action make the pressure angle with the circle of the pins.
    """
    return ahead_m * math.cos(geometry.pressure_angle_rad)


def make_meshes(
    params: PlanetaryParams,
    geometry: StageGeometry,
    seed: int,
    tracks: dict[str, int],
    interfaces: tuple[str, ...],
) -> tuple[Mesh, ...]:
    """All meshes: first the planets' with the sun, then with the ring.

    `tracks` are the indices of "ring_on_carrier", "sun_on_carrier" and "planet", all turning forward.
    """
    stage = params.stage
    positions = position_errors_m(params, seed)
    own = (
        wheel_error(params, stage.sun_teeth, seed, _SUN_WHEEL),
        wheel_error(params, stage.ring_teeth, seed, _RING_WHEEL),
    )
    wheel_tracks = tracks["sun_on_carrier"], tracks["ring_on_carrier"]
    result = []
    for side in (SUN, RING):
        stiffness = mesh_stiffness(params, geometry, side)
        for planet, angle in enumerate(stage.planet_angles_rad):
            name = mesh_name(side, planet)
            # The wheel meets the planets one after the other: the sun overtakes them, the ring lags.
            met = angle / (2 * math.pi) * (-1 if side == SUN else 1)
            flank = on_planet(geometry, side, planet, planet_error(params, seed, side, planet))
            ahead = position_compression(geometry, float(positions[planet]))
            constant = PeriodicSeries(ahead, np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0))
            result.append(
                Mesh(
                    name=name,
                    interface=interfaces.index(name),
                    stiffness=stiffness,
                    mean_stiffness_n_per_m=stiffness.mean,
                    damping_ns_per_m=params.model.mesh.damping_ns_per_m,
                    track=tracks["ring_on_carrier"],
                    cycles=float(stage.ring_teeth),
                    phase_offset=geometry.phase_offset(side, planet),
                    errors=(
                        MeshError(wheel_tracks[side], turned(own[side], met)),
                        MeshError(tracks["planet"], merged(flank, constant)),
                    ),
                )
            )
    return tuple(result)


def _uniform(seed: int, wheel: int, count: int) -> NDArray[np.float64]:
    """Uniform numbers in [0, 1) that depend on nothing but the arguments."""
    sequence = np.random.SeedSequence([seed, _PHASE_STREAM, wheel])
    return np.random.Generator(np.random.Philox(sequence)).random(count)
