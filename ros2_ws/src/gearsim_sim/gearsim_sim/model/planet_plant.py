"""The planetary machine as a plant: tracks, meshes, planet bearings, sensors on ring, carrier and sun.

The plane of x and y turns with the carrier. So a sensor on the ring, which stands, turns backwards in this
plane; forces that pass it with the planets come and go in its direction: the modulation by the carrier is
the geometry's doing. A sensor on the carrier keeps its direction and has none.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gearsim_sim.model.assembly import LinearSystem, Vector
from gearsim_sim.model.bearing_seat import BearingSeat
from gearsim_sim.model.first_stage import INTERFACE, first_stage_contact_ratio, first_stage_rigid, teeth_of
from gearsim_sim.model.gear_mesh import Mesh, MeshError, two_pair_stiffness
from gearsim_sim.model.planet_geometry import StageGeometry, make_geometry
from gearsim_sim.model.planet_meshes import make_meshes, wheel_error
from gearsim_sim.model.planet_wheels import planetary_wheels
from gearsim_sim.model.planetary import assemble, rigid_vector
from gearsim_sim.model.plant import Limits, Plant, RotatingSite, Track
from gearsim_sim.model.ring import Ring
from gearsim_sim.model.rolling_bearing import RollingBearing, make_rolling_bearing
from gearsim_sim.model.shafts import Plane, Shaft
from gearsim_sim.params.planetary import PlanetaryParams

# Numbers of the first stage's wheels in the random streams, behind those of any planets.
_PINION_WHEEL, _FIRST_WHEEL = 1000, 1001


@dataclass(frozen=True, eq=False, kw_only=True)
class PlanetaryPlant(Plant):
    """A plant that knows its planetary stage, for the faults of its gears."""

    params: PlanetaryParams
    geometry: StageGeometry

    @property
    def planet_names(self) -> tuple[str, ...]:
        """planet_1, planet_2, ..."""
        return tuple(f"planet_{i + 1}" for i in range(self.params.planets))


def make_planetary(params: PlanetaryParams, seed: int) -> PlanetaryPlant:
    """Assemble the machine; `seed` gives the gears their random errors."""
    geometry = make_geometry(params)
    system = assemble(params, geometry)
    laws = _bearing_laws(params)
    tracks = _tracks(params, laws)
    index = {track.name: i for i, track in enumerate(tracks)}
    rigid = dict(rigid_vector(geometry))
    meshes = make_meshes(params, geometry, seed, index, system.interface_names)
    if params.first_mesh is not None:
        rigid |= first_stage_rigid(params)
        meshes = (*meshes, _first_mesh(params, system, seed, index))
    drive = params.model.drive
    return PlanetaryPlant(
        name=params.where,
        system=system,
        parts=(system.dof_names,),
        tracks=tracks,
        bearings=tuple(_seat(params, system, i, law, index) for i, law in enumerate(laws)),
        meshes=meshes,
        rigid=system.direction(rigid),
        encoders=_encoders(params, index),
        sites=_sites(geometry, index),
        limits=Limits(
            speed_hz=drive.speed_hz,
            load_nm=drive.load_nm,
            speed_limit_hz=drive.speed_limit_hz,
            load_limit_nm=drive.load_limit_nm,
            acceleration_torque_nm=drive.acceleration_torque_nm,
        ),
        gravity_m_per_s2=0.0,
        faults_on=params.physics.faults,
        wheels=planetary_wheels(params, geometry, index),
        shafts=_shafts(params, index),
        params=params,
        geometry=geometry,
    )


def _shafts(params: PlanetaryParams, index: dict[str, int]) -> tuple[Shaft, ...]:
    """Sun and carrier, for unbalance; seen from the carrier its own stands still, the sun's runs ahead."""
    stage, speed = params.stage, params.stage.member_ratios()
    relative = speed["sun"] / speed["carrier"] - 1
    sense = math.copysign(1.0, relative)
    sun = Plane({"x_s": 1.0}, {"y_s": 1.0})
    carrier = Plane({"x_c": 1.0}, {"y_c": 1.0})
    rate = sense * speed["sun"] / speed["carrier"]
    return (
        Shaft(stage.sun_shaft, index["sun_on_carrier"], rate, sense, {"sun": sun}, {}),
        Shaft(stage.carrier_shaft, index["carrier_on_carrier"], 1.0, 1.0, {"carrier": carrier}, {}),
    )


def _tracks(params: PlanetaryParams, laws: tuple[RollingBearing, ...]) -> tuple[Track, ...]:
    """Shafts in space, then angles against the carrier that count forward, then cages and planets, signed."""
    stage, speed = params.stage, params.stage.member_ratios()
    carrier = speed["carrier"]
    shafts = [Track(stage.carrier_shaft, 1.0), Track(stage.sun_shaft, speed["sun"] / carrier)]
    if params.first_mesh is not None:
        pinion, wheel = teeth_of(params)
        shafts.append(Track(params.first_mesh.driving_shaft, wheel / pinion))
    spin = speed["planet"] / carrier
    tracks = [
        *shafts,
        Track("sun_on_carrier", abs(speed["sun"] / carrier - 1)),
        Track("ring_on_carrier", abs(speed["ring"] / carrier - 1)),
        Track("planet", abs(spin)),
        Track("carrier_on_carrier", 0.0),
    ]
    if laws:
        tracks.append(Track("planet counter-clockwise", spin))
    for i, law in enumerate(laws):
        name = params.bearings[i].name
        tracks.append(Track(f"{name} cage", law.cage_rate(0.0, spin)))
        tracks.append(Track(f"{name} spin", law.spin_rate(0.0, spin)))
    return tuple(tracks)


def _first_mesh(params: PlanetaryParams, system: LinearSystem, seed: int, index: dict[str, int]) -> Mesh:
    assert params.first_mesh is not None
    mesh, teeth = params.model.mesh, teeth_of(params)
    ratio = mesh.pair_stiffness_ratio if params.physics.mesh_stiffness_variation else 1.0
    stiffness = two_pair_stiffness(
        mesh.mean_stiffness_n_per_m, ratio, first_stage_contact_ratio(params), int(mesh.harmonics)
    )
    tracks = index[params.first_mesh.driving_shaft], index[params.stage.carrier_shaft]
    wheels = zip(tracks, teeth, (_PINION_WHEEL, _FIRST_WHEEL), strict=True)
    return Mesh(
        name=params.first_mesh.name,
        interface=system.interface_names.index(INTERFACE),
        stiffness=stiffness,
        mean_stiffness_n_per_m=mesh.mean_stiffness_n_per_m,
        damping_ns_per_m=mesh.damping_ns_per_m,
        track=tracks[0],
        cycles=float(teeth[0]),
        phase_offset=0.0,
        errors=tuple(
            MeshError(track, wheel_error(params, count, seed, wheel)) for track, count, wheel in wheels
        ),
    )


def _bearing_laws(params: PlanetaryParams) -> tuple[RollingBearing, ...]:
    """The pin drives its planet along the circle of the pins, forward if the carrier is the input."""
    ahead = math.pi / 2 if params.stage.input_member == "carrier" else -math.pi / 2
    return tuple(
        make_rolling_bearing(
            plate,
            params.model.planet_bearing,
            load_direction_rad=angle + ahead,
            passing=params.physics.ball_passing,
            clearance=params.physics.clearance,
            where=params.where,
        )
        for plate, angle in zip(params.bearings, params.stage.planet_angles_rad, strict=False)
    )


def _seat(
    params: PlanetaryParams, system: LinearSystem, planet: int, law: RollingBearing, index: dict[str, int]
) -> BearingSeat:
    """The inner ring is the carrier's pin and stands in this plane, the outer one turns with the planet."""
    name = params.bearings[planet].name
    return BearingSeat(
        name=name,
        law=law,
        x=system.interface_names.index(f"{name}_x"),
        y=system.interface_names.index(f"{name}_y"),
        cage=index[f"{name} cage"],
        spin=index[f"{name} spin"],
        inner=Ring(),
        outer=Ring(index["planet counter-clockwise"], 1.0),
        nominal_stiffness_n_per_m=params.model.planet_bearing.nominal_stiffness_n_per_m,
    )


def _encoders(params: PlanetaryParams, index: dict[str, int]) -> dict[str, tuple[int, Vector]]:
    stage = params.stage
    found: dict[str, tuple[int, Vector]] = {
        stage.carrier_shaft: (index[stage.carrier_shaft], {"theta_c": 1.0}),
        stage.sun_shaft: (index[stage.sun_shaft], {"theta_s": 1.0}),
    }
    if params.first_mesh is not None:
        shaft = params.first_mesh.driving_shaft
        found[shaft] = (index[shaft], {"theta_pin": 1.0})
    return found


def _sites(geometry: StageGeometry, index: dict[str, int]) -> dict[str, Vector | RotatingSite]:
    """Top of the ring and seat of the sun, vertical in space; beside planet 1 on the carrier."""
    stage = geometry.stage
    angle, radius = stage.planet_angles_rad[0], geometry.carrier_radius_m
    carrier = {"x_c": -math.sin(angle), "y_c": math.cos(angle), "theta_c": radius}
    turn = index[stage.carrier_shaft]
    fixed = {
        name: RotatingSite({f"x_{body}": 1.0}, {f"y_{body}": 1.0}, turn, -1.0, 0.25)
        for name, body in (("ring", "r"), ("sun", "s"))
    }
    return {"ring": fixed["ring"], "carrier": carrier, "sun": fixed["sun"]}
