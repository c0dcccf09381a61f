"""The 34-DOF lumped model of the parallel-shaft gearbox, put together from its elements.

22 degrees of freedom are the internals of thesis Figure A.1, in the thesis's order; the errata of its
Appendix A hold by construction, because every spring and damper is entered as an element. Twelve more
are four pedestals. Rotations are counted so that both shafts turn with positive speed; seen along the
shafts the input turns clockwise (`SENSE` -1) and the output counter-clockwise. y is the line of
action, upward, x is perpendicular to it; torque presses the pinion up and the gear down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.model.assembly import Assembly, LinearSystem
from gearsim_sim.model.ball_bearing import BallBearing, make_ball_bearing
from gearsim_sim.model.faults.spall import Spall
from gearsim_sim.model.gear_errors import gear_error
from gearsim_sim.model.gear_mesh import Mesh, add_mesh, mesh_direction, stiffness_series
from gearsim_sim.model.pedestal import add_pedestal
from gearsim_sim.model.shaft import bending_link, torsion_link
from gearsim_sim.params.parallel import BEARINGS, ParallelModel, ParallelParams

INPUT, OUTPUT = 0, 1
BEARING_SHAFT = (INPUT, INPUT, OUTPUT, OUTPUT)
SENSE = (-1.0, 1.0)
LOAD_DIRECTION_RAD = (math.pi / 2, math.pi / 2, -math.pi / 2, -math.pi / 2)
INTERNAL_DOFS = 22
INPUTS = ("motor_torque", "load_torque", "gravity")


@dataclass(frozen=True)
class Moment:
    """What the forces depend on beside the motion: angle and speed of the rigid rotation, the faults."""

    turns: float  # of the input shaft
    speed_hz: float
    spalls: tuple[Spall, ...] = ()


@dataclass(frozen=True, eq=False)
class Gearbox:
    """System matrices and force elements; a plain, slow, readable right-hand side for tests and statics."""

    params: ParallelParams
    system: LinearSystem
    mesh: Mesh
    bearings: tuple[BallBearing, ...]
    rigid: NDArray[np.float64]  # (n,) rotation of everything for one turn of the input

    @property
    def speed_ratio(self) -> float:
        """Speed of the output shaft over that of the input shaft."""
        return self.params.speed_ratio

    def shaft_turns(self, shaft: int, turns: float) -> float:
        """Angle of a shaft without sense."""
        return turns if shaft == INPUT else turns * self.speed_ratio

    def cage_angle_rad(self, bearing: int, turns: float) -> float:
        """Azimuth of a cage, counter-clockwise, zero at the start."""
        shaft = BEARING_SHAFT[bearing]
        ratio = self.bearings[bearing].cage_ratio * SENSE[shaft]
        return 2 * math.pi * ratio * self.shaft_turns(shaft, turns)

    def missing(self, bearing: int, moment: Moment) -> NDArray[np.float64]:
        """What the races lack under each ball because of spalls [m]; shape (balls,)."""
        element = self.bearings[bearing]
        missing = np.zeros(element.ball_count)
        if not self.params.physics.faults:
            return missing
        azimuths = element.azimuths_rad + self.cage_angle_rad(bearing, moment.turns)
        shaft = BEARING_SHAFT[bearing]
        for spall in (one for one in moment.spalls if one.bearing == bearing):
            middle = spall.position_rad
            if spall.on_inner_race:
                middle += 2 * math.pi * SENSE[shaft] * self.shaft_turns(shaft, moment.turns)
            first = spall.row * element.balls_per_row
            for ball in range(first, first + element.balls_per_row):
                missing[ball] += spall.drop(math.remainder(azimuths[ball] - middle, 2 * math.pi))
        return missing

    def bearing_force(self, bearing: int, q: NDArray[np.float64], moment: Moment) -> NDArray[np.float64]:
        """Contact force (x, y) of the shaft on the pedestal [N]; `q` are all interface displacements."""
        pair = q[2 * bearing : 2 * bearing + 2]
        angle = self.cage_angle_rad(bearing, moment.turns)
        return self.bearings[bearing].force(pair, angle, self.missing(bearing, moment))

    def mesh_force(self, q: float, rate: float, moment: Moment) -> float:
        """Force that presses the teeth together [N]; `q`, `rate` without the transmission error."""
        gear_turns = moment.turns * self.speed_ratio
        gear_speed = moment.speed_hz * self.speed_ratio
        error = self.mesh.error(moment.turns, gear_turns)
        error_rate = self.mesh.error_rate(moment.turns, gear_turns, moment.speed_hz, gear_speed)
        return self.mesh.force(q + error, rate + error_rate, moment.turns)

    def interface_forces(
        self, q: NDArray[np.float64], rate: NDArray[np.float64], moment: Moment
    ) -> NDArray[np.float64]:
        """g of M x'' + C x' + K x = W g + U u: what the elements do beyond the linear part in C and K."""
        nominal = self.params.model.ball_bearing.nominal_stiffness_n_per_m
        g = np.empty(q.size)
        for bearing in range(4):
            pair = slice(2 * bearing, 2 * bearing + 2)
            g[pair] = nominal * q[pair] - self.bearing_force(bearing, q, moment)
        linear = self.mesh.mean_stiffness_n_per_m * q[-1] + self.mesh.damping_ns_per_m * rate[-1]
        g[-1] = linear - self.mesh_force(q[-1], rate[-1], moment)
        return g

    def known_inputs(self, load_nm: float, acceleration_hz_per_s: float = 0.0) -> NDArray[np.float64]:
        """u: motor torque, load torque, gravity.

        The motor balances the load and gives the whole rotating inertia the commanded acceleration.
        """
        inertia = self.rigid @ self.system.mass @ self.rigid
        motor = load_nm * self.speed_ratio + inertia * 2 * math.pi * acceleration_hz_per_s
        gravity = self.params.model.gravity_m_per_s2 * self.params.physics.gravity
        return np.array([motor, load_nm, gravity])

    def acceleration(
        self, x: NDArray[np.float64], v: NDArray[np.float64], moment: Moment, u: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """x'' from the equation of motion; x and v without the rigid rotation or with it, it is the same."""
        system = self.system
        g = self.interface_forces(system.interfaces.T @ x, system.interfaces.T @ v, moment)
        force = system.interfaces @ g + system.inputs @ u - system.damping @ v - system.stiffness @ x
        return np.asarray(force / np.diag(system.mass))


def make_gearbox(params: ParallelParams, seed: int) -> Gearbox:
    """Assemble the model; `seed` gives the gears their random errors."""
    model, physics = params.model, params.physics
    teeth = (params.mesh.driving_teeth, params.mesh.driven_teeth)
    phases = (model.gear_errors.pinion_phase_rad, model.gear_errors.gear_phase_rad)
    errors = [gear_error(model.gear_errors, physics, teeth[i], phases[i], seed, i) for i in range(2)]
    mesh = Mesh(
        stiffness=stiffness_series(model.mesh, variation=physics.mesh_stiffness_variation),
        mean_stiffness_n_per_m=model.mesh.mean_stiffness_n_per_m,
        damping_ns_per_m=model.mesh.damping_ns_per_m,
        pinion_error=errors[0],
        gear_error=errors[1],
        pinion_teeth=teeth[0],
    )
    bearings = tuple(
        make_ball_bearing(
            plate,
            model.ball_bearing,
            load_direction_rad=LOAD_DIRECTION_RAD[i],
            passing=physics.ball_passing,
            clearance=physics.clearance,
        )
        for i, plate in enumerate(params.bearings)
    )
    _check_load_zones(params, bearings)
    system = _assemble(model)
    rigid = system.direction(
        dict.fromkeys(_ROTATIONS[INPUT], 1.0) | dict.fromkeys(_ROTATIONS[OUTPUT], params.speed_ratio)
    )
    return Gearbox(params=params, system=system, mesh=mesh, bearings=bearings, rigid=rigid)


def _check_load_zones(params: ParallelParams, bearings: tuple[BallBearing, ...]) -> None:
    """Under the nominal load each bearing must rest on more than a single ball at a time."""
    drive, clearance = params.model.drive, params.model.ball_bearing.radial_clearance_m
    load_n = drive.load_nm / params.model.gear.base_radius_m / 2
    for bearing in bearings:
        zone = 2 * bearing.load_zone_half_angle_rad(load_n)
        if load_n > 0 and zone < bearing.ball_spacing_rad / bearing.rows:
            expected = f"a clearance that leaves a load zone under {load_n:.3g} N (this: {zone:.2g} rad)"
            raise InputError(params.where, "ball_bearing.radial_clearance", clearance, expected)


_ROTATIONS = (
    ("theta_f1", "theta_s1", "theta_pin", "theta_s2", "theta_ec1"),
    ("theta_ge", "theta_s3", "theta_s4", "theta_ec2", "theta_f2"),
)
ENCODER_DOFS = ("theta_ec1", "theta_ec2")


def _assemble(model: ParallelModel) -> LinearSystem:
    assembly = Assembly()
    _add_inertias(assembly, model)
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
            across = {f"{axis}_s{number}": 1.0, f"{axis}_p{number}": -1.0}
            assembly.spring(across, model.ball_bearing.nominal_stiffness_n_per_m)
            assembly.damper(across, seat.damping_ns_per_m)
            assembly.interface(f"b{number}_{axis}", across)
    add_mesh(assembly, model.mesh, mesh_direction(model.pinion.base_radius_m, model.gear.base_radius_m))
    _add_inputs(assembly, model)
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


def _add_inputs(assembly: Assembly, model: ParallelModel) -> None:
    """Torques at the flywheels, and the weight of all masses that move in y (per unit of gravity)."""
    assembly.known_input("motor_torque", {"theta_f1": 1.0})
    assembly.known_input("load_torque", {"theta_f2": -1.0})
    weight = {f"y_{name}": -mass for name, mass in _translating_masses(model).items()}
    for number in range(1, 5):
        weight[f"y_p{number}"] = -model.pedestal.mass_kg
        weight[f"y_r{number}"] = -model.pedestal.resonator_mass_kg
    assembly.known_input("gravity", weight)
