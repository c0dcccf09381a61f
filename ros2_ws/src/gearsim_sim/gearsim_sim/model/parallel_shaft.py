"""The parallel-shaft gearbox, put together from its elements: 22 degrees of freedom, 34 with pedestals.

The 22 are those of thesis Figure A.1, in the thesis's order; the errata of its Appendix A hold by
construction, because every spring and damper is entered as an element. Twelve more are four pedestals;
without them the outer races are held by the ground. Rotations are counted so that both shafts turn with
positive speed; seen along the shafts the input turns clockwise (`SENSE` -1) and the output
counter-clockwise. y is the line of action, upward, x is perpendicular to it; torque presses the pinion up
and the gear down.
"""

from __future__ import annotations

import math

from gearsim_sim.model.assembly import Assembly, LinearSystem, Vector
from gearsim_sim.model.bearing_seat import BearingSeat
from gearsim_sim.model.gear_errors import gear_error
from gearsim_sim.model.gear_mesh import Mesh, MeshError, add_mesh, mesh_direction
from gearsim_sim.model.gear_wheel import GearWheel
from gearsim_sim.model.mesh_stiffness import StiffnessCurve, stiffness_curve
from gearsim_sim.model.parallel_places import parallel_mounts, parallel_shafts
from gearsim_sim.model.pedestal import add_pedestal
from gearsim_sim.model.plant import BASE_INPUTS, Limits, Plant, StateRow, Track
from gearsim_sim.model.ring import Ring
from gearsim_sim.model.rolling_bearing import RollingBearing, make_rolling_bearing
from gearsim_sim.model.shaft import bending_link, torsion_link
from gearsim_sim.model.tooth.pair import GearPair
from gearsim_sim.params.parallel import BEARINGS, ParallelModel, ParallelParams
from gearsim_sim.params.parts import TorsionalEnd

INPUT, OUTPUT = 0, 1
BEARING_SHAFT = (INPUT, INPUT, OUTPUT, OUTPUT)
SENSE = (-1.0, 1.0)
LOAD_DIRECTION_RAD = (math.pi / 2, math.pi / 2, -math.pi / 2, -math.pi / 2)
INTERNAL_DOFS = 22
_ENCODERS = ("theta_ec1", "theta_ec2")


def make_parallel_shaft(params: ParallelParams, seed: int) -> Plant:
    """Assemble the model; `seed` gives the gears their random errors."""
    model, physics = params.model, params.physics
    pair = params.gear_pair
    curve = stiffness_curve(model.mesh, pair, variation=physics.mesh_stiffness_variation)
    system = _assemble(params, curve.mean_n_per_m)
    x_names = tuple(name for name in system.dof_names if name.startswith("x_"))
    rigid = dict.fromkeys(_ROTATIONS[INPUT], 1.0) | dict.fromkeys(_ROTATIONS[OUTPUT], params.speed_ratio)
    laws = _bearing_laws(params)
    _check_load_zones(params, laws)
    shafts = (params.input_shaft, params.output_shaft)
    drive = model.drive
    return Plant(
        name=params.where,
        system=system,
        parts=(x_names, tuple(name for name in system.dof_names if name not in x_names)),
        tracks=_tracks(params, laws),
        bearings=tuple(_seat(params, system, number, law) for number, law in enumerate(laws)),
        meshes=(_mesh(params, curve, system, seed),),
        wheels=() if pair is None else _wheels(params, pair),
        rigid=system.direction(rigid),
        encoders={shaft: (i, {_ENCODERS[i]: 1.0}) for i, shaft in enumerate(shafts)},
        sites=_sites(params),
        limits=Limits(
            speed_hz=drive.speed_hz,
            load_nm=drive.load_nm,
            speed_limit_hz=drive.speed_limit_hz,
            load_limit_nm=drive.load_limit_nm,
            acceleration_torque_nm=drive.acceleration_torque_nm,
        ),
        gravity_m_per_s2=model.gravity_m_per_s2 * physics.gravity,
        signals={
            f"{shafts[0]}_torque": _coupling(model.flywheel_1, "theta_f1", "theta_s1"),
            f"{shafts[1]}_torque": _coupling(model.flywheel_2, "theta_s4", "theta_f2"),
        },
        faults_on=physics.faults,
        shafts=parallel_shafts(params, SENSE),
        mounts=parallel_mounts(params),
    )


def _sites(params: ParallelParams) -> dict[str, Vector]:
    """Pedestals, else the shaft's ends in the bearings; channels by their own names as well."""
    body = "p" if params.pedestals else "s"
    places: dict[str, Vector] = {
        f"b{number}_{axis}": {f"{axis}_{body}{number}": 1.0} for number in range(1, 5) for axis in "xy"
    }
    return places | {channel: places[site] for channel, site in params.model.sites.items()}


def _coupling(end: TorsionalEnd, first: str, second: str) -> StateRow:
    """Torque through the coupling of a flywheel, from `first` to `second` [N m]."""
    stiffness, damping = end.stiffness_nm_per_rad, end.damping_nms_per_rad
    return StateRow({first: stiffness, second: -stiffness}, {first: damping, second: -damping})


def _tracks(params: ParallelParams, laws: tuple[RollingBearing, ...]) -> tuple[Track, ...]:
    """Both shafts, turning positively, then the cages and the spin of their balls, counter-clockwise."""
    ratios = (1.0, params.speed_ratio)
    shafts = (Track(params.input_shaft, ratios[INPUT]), Track(params.output_shaft, ratios[OUTPUT]))
    inner = [SENSE[shaft] * ratios[shaft] for shaft in BEARING_SHAFT]
    named = list(zip(BEARINGS, laws, inner, strict=True))
    cages = (Track(f"{name} cage", law.cage_rate(rate)) for name, law, rate in named)
    spins = (Track(f"{name} spin", law.spin_rate(rate)) for name, law, rate in named)
    return (*shafts, *cages, *spins)


def _wheels(params: ParallelParams, pair: GearPair) -> tuple[GearWheel, ...]:
    """Pinion and gear; both meet tooth 0 when they begin to turn, as the tooth phase is 0 there."""
    model = params.model
    return tuple(
        GearWheel(
            name=f"{params.mesh.name}.{part}",
            mesh=0,
            track=track,
            pair=pair,
            of_wheel=track == OUTPUT,
            start_turns=0.0,
            force_per_load_n_per_nm=1 / model.gear.base_radius_m,
            harmonics=int(max(model.mesh.harmonics, model.gear_errors.harmonics)),
        )
        for track, part in ((INPUT, "pinion"), (OUTPUT, "gear"))
    )


def _mesh(params: ParallelParams, curve: StiffnessCurve, system: LinearSystem, seed: int) -> Mesh:
    model, physics = params.model, params.physics
    teeth = (params.mesh.driving_teeth, params.mesh.driven_teeth)
    phases = (model.gear_errors.pinion_phase_rad, model.gear_errors.gear_phase_rad)
    errors = [gear_error(model.gear_errors, physics, teeth[i], phases[i], seed, i) for i in range(2)]
    return Mesh(
        name=params.mesh.name,
        interface=system.interface_names.index("mesh"),
        stiffness=curve.series,
        mean_stiffness_n_per_m=curve.mean_n_per_m,
        damping_ns_per_m=model.mesh.damping_ns_per_m,
        track=INPUT,
        cycles=float(teeth[0]),
        phase_offset=0.0,
        errors=tuple(MeshError(shaft, errors[shaft]) for shaft in (INPUT, OUTPUT)),
        pulse=curve.pulse,
    )


def _bearing_laws(params: ParallelParams) -> tuple[RollingBearing, ...]:
    return tuple(
        make_rolling_bearing(
            plate,
            own,
            load_direction_rad=LOAD_DIRECTION_RAD[i],
            passing=params.physics.ball_passing,
            clearance=params.physics.clearance,
            where=f"{params.where}: {plate.name}",
        )
        for i, (plate, own) in enumerate(zip(params.bearings, params.rolling_bearings, strict=True))
    )


def _seat(params: ParallelParams, system: LinearSystem, number: int, law: RollingBearing) -> BearingSeat:
    shaft = BEARING_SHAFT[number]
    return BearingSeat(
        name=BEARINGS[number],
        law=law,
        x=system.interface_names.index(f"b{number + 1}_x"),
        y=system.interface_names.index(f"b{number + 1}_y"),
        cage=2 + number,
        spin=2 + len(BEARINGS) + number,
        inner=Ring(shaft, SENSE[shaft]),
        outer=Ring(),
        nominal_stiffness_n_per_m=params.rolling_bearings[number].nominal_stiffness_n_per_m,
    )


def _check_load_zones(params: ParallelParams, bearings: tuple[RollingBearing, ...]) -> None:
    """Under the nominal load each bearing must rest on more than a single ball at a time."""
    model = params.model
    load_n = model.drive.load_nm / model.gear.base_radius_m / 2
    for name, bearing in zip(BEARINGS, bearings, strict=True):
        own = model.seats[name].bearing is not None
        section = f"seats.{name}.bearing" if own else "ball_bearing"
        bearing.check_load_zone(params.where, f"{section}.radial_clearance", load_n)


_ROTATIONS = (
    ("theta_f1", "theta_s1", "theta_pin", "theta_s2", "theta_ec1"),
    ("theta_ge", "theta_s3", "theta_s4", "theta_ec2", "theta_f2"),
)


def _assemble(params: ParallelParams, mesh_stiffness_n_per_m: float) -> LinearSystem:
    model, pedestals, assembly = params.model, params.pedestals, Assembly()
    _add_inertias(assembly, model)
    if pedestals:
        for number in range(1, 5):
            add_pedestal(assembly, model.pedestal, number)
    _add_torsion(assembly, model)
    for number in range(1, 5):
        gear = "pin" if BEARING_SHAFT[number - 1] == INPUT else "ge"
        seat = model.seats[BEARINGS[number - 1]]
        for axis in "xy":
            bending_link(
                assembly, f"{axis}_{gear}", f"{axis}_s{number}", model.shafts.bending_stiffness_n_per_m
            )
            across = {f"{axis}_s{number}": 1.0}
            if pedestals:
                across[f"{axis}_p{number}"] = -1.0
            assembly.spring(across, params.rolling_bearings[number - 1].nominal_stiffness_n_per_m)
            assembly.damper(across, seat.damping_ns_per_m)
            assembly.interface(f"b{number}_{axis}", across)
    along = mesh_direction(model.pinion.base_radius_m, model.gear.base_radius_m)
    add_mesh(assembly, mesh_stiffness_n_per_m, model.mesh.damping_ns_per_m, along)
    _add_inputs(assembly, model, pedestals=pedestals)
    return assembly.build()


def _add_inertias(assembly: Assembly, model: ParallelModel) -> None:
    """The 22 internal degrees of freedom in the order of thesis A.2.1."""
    seat = {number: model.seats[f"bearing_{number}"].inertia_kg_m2 for number in range(1, 5)}
    rotations = {
        "theta_f1": model.flywheel_1.inertia_kg_m2,
        "theta_s1": seat[1],
        "theta_pin": model.pinion.inertia_kg_m2,
        "theta_s2": seat[2],
        "theta_ec1": model.encoder_1.inertia_kg_m2,
        "theta_ge": model.gear.inertia_kg_m2,
        "theta_s3": seat[3],
        "theta_s4": seat[4],
        "theta_ec2": model.encoder_2.inertia_kg_m2,
        "theta_f2": model.flywheel_2.inertia_kg_m2,
    }
    for name, inertia in rotations.items():
        assembly.inertia(name, inertia)
    for name, mass in _translating_masses(model).items():
        assembly.inertia(f"x_{name}", mass)
        assembly.inertia(f"y_{name}", mass)


def _translating_masses(model: ParallelModel) -> dict[str, float]:
    seat = {number: model.seats[f"bearing_{number}"].mass_kg for number in range(1, 5)}
    return {
        "s1": seat[1],
        "pin": model.pinion.mass_kg,
        "s2": seat[2],
        "ge": model.gear.mass_kg,
        "s3": seat[3],
        "s4": seat[4],
    }


def _add_torsion(assembly: Assembly, model: ParallelModel) -> None:
    """Flywheel - bearing - gear - bearing - encoder, on both shafts."""
    stiffness = model.shafts.torsional_stiffness_nm_per_rad
    ends = (
        ("theta_f1", "theta_s1", model.flywheel_1),
        ("theta_s2", "theta_ec1", model.encoder_1),
        ("theta_s3", "theta_ec2", model.encoder_2),
        ("theta_s4", "theta_f2", model.flywheel_2),
    )
    for first, second, end in ends:
        torsion_link(assembly, first, second, end.stiffness_nm_per_rad, end.damping_nms_per_rad)
    for gear, seats in (("theta_pin", ("s1", "s2")), ("theta_ge", ("s3", "s4"))):
        for seat in seats:
            torsion_link(assembly, gear, f"theta_{seat}", stiffness)


def _add_inputs(assembly: Assembly, model: ParallelModel, *, pedestals: bool) -> None:
    """Torques at the flywheels, and the weight of all masses that move in y (per unit of gravity)."""
    weight = {f"y_{name}": -mass for name, mass in _translating_masses(model).items()}
    if pedestals:
        for number in range(1, 5):
            weight[f"y_p{number}"] = -model.pedestal.mass_kg
            weight[f"y_r{number}"] = -model.pedestal.resonator_mass_kg
    columns: tuple[Vector, ...] = ({"theta_f1": 1.0}, {"theta_f2": -1.0}, weight)
    for name, column in zip(BASE_INPUTS, columns, strict=True):
        assembly.known_input(name, column)
