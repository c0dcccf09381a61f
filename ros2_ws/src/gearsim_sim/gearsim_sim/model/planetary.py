"""The transverse-torsional model of a planetary stage (Kahraman 1994, thesis 7.7), from its elements.

Carrier c, ring r, sun s and planets p1, p2, ... move in x, y and theta each, in this order: 18 degrees of
freedom with three planets. Everything is seen in the frame that turns with the carrier, where planet i
stays at the angle psi_i from the x axis, anticlockwise, and theta is anticlockwise, too.

The element of a mesh acts on the thesis's relative displacement (7.24) with its sign turned, so that it
is positive when the teeth are pressed together: under a torque that drives the carrier forward and the
load that holds the sun back. Each spring and damper is entered as an element and has its reaction; so the
errata of (7.18) to (7.29), (7.38), Table C.1 and C.2 hold by construction.

Readings of the thesis, and what is left out:

- Base radii R = r cos(alpha), psi_s = psi - alpha, psi_r = psi + alpha: they reproduce Table 7.6.
- The stiff spring of C.2 acts between the centres of carrier and sun; the sun's support to the ground.
- Gyroscopic terms of the turning frame, 2 m Omega x' and m Omega^2 x, are left out: at the highest speed
  of 6 Hz they turn a mode of 640 Hz by 2 Omega / omega = 2 % into its twin, the next one by 0.4 %.
- The planets' spin does not couple to the carrier (thesis 7.7.2.2).
"""

from __future__ import annotations

import math

from gearsim_sim.model.assembly import Assembly, LinearSystem, Vector
from gearsim_sim.model.first_stage import add_first_stage
from gearsim_sim.model.planet_geometry import RING, SIDES, SUN, StageGeometry
from gearsim_sim.model.plant import BASE_INPUTS
from gearsim_sim.params.planetary import Casing, PlanetaryModel, PlanetaryParams, Support

AXES = ("x", "y")
MEMBERS = ("c", "r", "s")


def mesh_name(side: int, planet: int) -> str:
    """Name of the mesh of a planet (from 0) with sun or ring, such as `sun_1`."""
    return f"{SIDES[side]}_{planet + 1}"


def mesh_vector(geometry: StageGeometry, side: int, planet: int) -> Vector:
    """Gradient of the compression of the teeth, (7.24) with its sign turned; e presses them together."""
    sun, ring, own = geometry.base_radii_m
    angle = geometry.mesh_angle_rad(side, planet)
    gear, radius = (("s", sun), ("r", ring))[side]
    body = f"p{planet + 1}"
    return {
        f"x_{gear}": math.sin(angle),
        f"y_{gear}": -math.cos(angle),
        f"theta_{gear}": -radius,
        f"x_{body}": -math.sin(angle),
        f"y_{body}": math.cos(angle),
        f"theta_{body}": -own if side == SUN else own,
    }


def pin_vectors(geometry: StageGeometry, planet: int) -> tuple[Vector, Vector]:
    """Displacement (x, y) of the carrier's pin against the planet, (7.25) and (7.26)."""
    angle, radius = geometry.stage.planet_angles_rad[planet], geometry.carrier_radius_m
    body = f"p{planet + 1}"
    along_x = {"x_c": 1.0, f"x_{body}": -1.0, "theta_c": -radius * math.sin(angle)}
    along_y = {"y_c": 1.0, f"y_{body}": -1.0, "theta_c": radius * math.cos(angle)}
    return along_x, along_y


def rigid_vector(geometry: StageGeometry) -> Vector:
    """Motion of the stage for one radian of the carrier: Table 7.6, and the pins carried along."""
    stage, radius = geometry.stage, geometry.carrier_radius_m
    speed = stage.member_ratios()
    scale = 1 / speed["carrier"]
    rigid: dict[str, float] = {"theta_c": 1.0, "theta_s": speed["sun"] * scale}
    for i, angle in enumerate(stage.planet_angles_rad):
        rigid[f"x_p{i + 1}"] = -radius * math.sin(angle)
        rigid[f"y_p{i + 1}"] = radius * math.cos(angle)
        rigid[f"theta_p{i + 1}"] = (speed["planet"] + speed["carrier"]) * scale
    return rigid


def mean_stiffness(params: PlanetaryParams, geometry: StageGeometry, side: int) -> float:
    """Mean over a pitch [N/m]: as given, or from that of one pair of teeth and the contact ratio."""
    mesh = params.model.mesh
    if mesh.pair_stiffness_n_per_m == 0:
        return mesh.mean_stiffness_n_per_m
    double = geometry.contacts[side].ratio - 1
    return mesh.pair_stiffness_n_per_m * (1 + (mesh.pair_stiffness_ratio - 1) * double)


def assemble(params: PlanetaryParams, geometry: StageGeometry) -> LinearSystem:
    """Matrices, interfaces (meshes, then planet bearings) and inputs."""
    model, planets = params.model, range(params.planets)
    assembly = Assembly()
    _add_bodies(assembly, model, params.planets)
    if model.casing.included:
        for axis in AXES:
            assembly.inertia(f"{axis}_h", model.casing.mass_kg)
    if params.first_mesh is not None:
        add_first_stage(assembly, params)
    _add_supports(assembly, model)
    for side in (SUN, RING):
        stiffness = mean_stiffness(params, geometry, side)
        for planet in planets:
            vector = mesh_vector(geometry, side, planet)
            assembly.spring(vector, stiffness)
            assembly.damper(vector, model.mesh.damping_ns_per_m)
            assembly.interface(mesh_name(side, planet), vector)
    seat = model.planet_seat.stiffness_n_per_m
    if model.planet_bearing.included:
        seat = model.planet_bearing.nominal_stiffness_n_per_m
    for planet in planets:
        for axis, vector in zip(AXES, pin_vectors(geometry, planet), strict=True):
            assembly.spring(vector, seat)
            assembly.damper(vector, model.planet_seat.damping_ns_per_m)
            if model.planet_bearing.included:
                assembly.interface(f"planet_{planet + 1}_bearing_{axis}", vector)
    _add_inputs(assembly, params)
    return assembly.build()


def _add_bodies(assembly: Assembly, model: PlanetaryModel, planets: int) -> None:
    bodies = {"c": model.carrier, "r": model.ring, "s": model.sun}
    bodies |= {f"p{i + 1}": model.planet for i in range(planets)}
    for name, body in bodies.items():
        for axis in AXES:
            assembly.inertia(f"{axis}_{name}", body.mass_kg)
        assembly.inertia(f"theta_{name}", body.inertia_kg_m2)


def _between(assembly: Assembly, first: str, second: str, stiffness: float, damping: float) -> None:
    """The same spring and damper in x and y between two bodies; to the ground if `second` is empty."""
    for axis in AXES:
        vector = {f"{axis}_{first}": 1.0}
        if second:
            vector[f"{axis}_{second}"] = -1.0
        assembly.spring(vector, stiffness)
        assembly.damper(vector, damping)


def _add_supports(assembly: Assembly, model: PlanetaryModel) -> None:
    """How carrier, sun and ring are held (7.33), (7.34), C.2: by the ground, or by a casing.

    With a casing the bearings of the sun's shaft join sun and casing besides; its feet hold the casing.
    """
    casing, ring, base = model.casing, model.ring_support, "h" if model.casing.included else ""
    held: list[tuple[str, str, Support | Casing]] = [
        ("c", "s", model.carrier_on_sun),
        ("r", base, ring),
        ("s", base, model.sun_support),
    ]
    if casing.included:
        held.append(("h", "", casing))
        _between(assembly, "s", "h", casing.sun_stiffness_n_per_m, casing.sun_damping_ns_per_m)
    for first, second, support in held:
        _between(assembly, first, second, support.stiffness_n_per_m, support.damping_ns_per_m)
    assembly.spring({"theta_r": 1.0}, ring.torsional_stiffness_nm_per_rad)
    assembly.damper({"theta_r": 1.0}, ring.torsional_damping_nms_per_rad)


def _add_inputs(assembly: Assembly, params: PlanetaryParams) -> None:
    """Torques of motor and load, and no weight, which would turn in this frame (thesis has none)."""
    forward = params.stage.input_member == "carrier"
    motor, load = ("theta_c", "theta_s") if forward else ("theta_s", "theta_c")
    if params.first_mesh is not None:
        motor = "theta_pin"
    for name, column in zip(BASE_INPUTS, ({motor: 1.0}, {load: -1.0}, {}), strict=True):
        assembly.known_input(name, column)
