"""Single-bearing test rigs of 2, 4 or 5 degrees of freedom, put together from the gearbox's elements.

2 (Sunnersjo 1978, Liew et al. 2002): the inner ring with its piece of shaft, x_s and y_s, in an outer ring
that the ground holds. 4 (Feng et al. 2002): the outer ring sits in a pedestal, x_p and y_p, on springs and
dampers. 5 (Sawalhi and Randall 2008): the pedestal carries a small mass, y_r, that stands for a high
resonance. With F = k sum d_j^n (cos, sin) the bearing's force on the outer ring, d its displacement
(x_s - x_p, y_s - y_p), c_b its damper and P the radial load and the weight,

    m_s x_s'' + c_b (x_s' - x_p') + F_x = P_x            m_s y_s'' + c_b (y_s' - y_p') + F_y = P_y
    m_p x_p'' + c_p x_p' + k_p x_p = F_x + c_b (x_s' - x_p')
    m_p y_p'' + c_p y_p' + k_p y_p + k_r (y_p - y_r) + c_r (y_p' - y_r') = F_y + c_b (y_s' - y_p') - m_p g
    m_r y_r'' + k_r (y_r - y_p) + c_r (y_r' - y_p') = -m_r g

The rotation is prescribed: `theta` is one rigid inertia that nothing elastic feels. The shaft turns
counter-clockwise in the plane of x (to the right) and y (upward).
"""

from __future__ import annotations

import math

from gearsim_sim.model.assembly import Assembly, LinearSystem, Vector
from gearsim_sim.model.bearing_seat import BearingSeat
from gearsim_sim.model.pedestal import add_pedestal
from gearsim_sim.model.plant import BASE_INPUTS, Limits, Plant, Track
from gearsim_sim.model.ring import Ring
from gearsim_sim.model.rolling_bearing import RollingBearing, make_rolling_bearing
from gearsim_sim.model.shafts import Mount, Plane, Shaft
from gearsim_sim.params.bearing_rig import BearingRigParams

SHAFT, CAGE, SPIN = 0, 1, 2
_TURNING, _STANDING = Ring(SHAFT, 1.0), Ring()


def make_bearing_rig(params: BearingRigParams, seed: int) -> Plant:  # noqa: ARG001
    """Assemble the model; nothing in it is random, so that `seed` changes nothing.

    Raises
    ------
    InputError
        For a bearing that cannot be, or a clearance that leaves no load zone under the rig's load.
    """
    model, physics = params.model, params.physics
    law = _law(params)
    system = _assemble(params)
    x_names = tuple(name for name in system.dof_names if name.startswith("x_"))
    inner, outer = (0.0, 1.0) if params.bearing.outer_ring_rotates else (1.0, 0.0)
    drive = model.drive
    return Plant(
        name=params.where,
        system=system,
        parts=(x_names, tuple(name for name in system.dof_names if name not in x_names)),
        tracks=(
            Track(params.shaft, 1.0),
            Track(f"{params.bearing.name} cage", law.cage_rate(inner, outer)),
            Track(f"{params.bearing.name} spin", law.spin_rate(inner, outer)),
        ),
        bearings=(_seat(params, system, law),),
        meshes=(),
        rigid=system.direction({"theta": 1.0}),
        encoders={params.shaft: (SHAFT, {"theta": 1.0})},
        sites=_sites(params, system),
        limits=Limits(
            speed_hz=drive.speed_hz,
            load_nm=drive.load_nm,
            speed_limit_hz=drive.speed_limit_hz,
            load_limit_nm=drive.load_limit_nm,
            acceleration_torque_nm=drive.acceleration_torque_nm,
        ),
        gravity_m_per_s2=model.gravity_m_per_s2,
        faults_on=physics.faults,
        shafts=(_shaft(params),),
        mounts=_mounts(params),
    )


def _shaft(params: BearingRigParams) -> Shaft:
    """The shaft for faults such as unbalance; of its bending and couplings the model knows nothing."""
    plane = Plane({"x_s": 1.0}, {"y_s": 1.0})
    return Shaft(params.shaft, SHAFT, 1.0, 1.0, {params.bearing.name: plane}, {})


def _mounts(params: BearingRigParams) -> dict[str, Mount]:
    """The pedestal's base, which can get loose."""
    if params.dofs == 2:
        return {}
    pedestal = params.model.pedestal
    return {params.bearing.name: Mount({"y_p": 1.0}, pedestal.stiffness_n_per_m, pedestal.damping_ns_per_m)}


def _law(params: BearingRigParams) -> RollingBearing:
    """The bearing, which must rest on more than a single element at a time."""
    law = make_rolling_bearing(
        params.bearing,
        params.model.bearing,
        load_direction_rad=math.remainder(params.model.load_direction_rad, 2 * math.pi),
        passing=params.physics.ball_passing,
        clearance=params.physics.clearance,
        where=f"{params.where}: {params.bearing.name}",
    )
    force = _standing_force(params)
    law.check_load_zone(params.where, "bearing.radial_clearance", math.hypot(force["x_s"], force["y_s"]))
    return law


def _seat(params: BearingRigParams, system: LinearSystem, law: RollingBearing) -> BearingSeat:
    outer_turns = params.bearing.outer_ring_rotates
    return BearingSeat(
        name=params.bearing.name,
        law=law,
        x=system.interface_names.index("b_x"),
        y=system.interface_names.index("b_y"),
        cage=CAGE,
        spin=SPIN,
        inner=_STANDING if outer_turns else _TURNING,
        outer=_TURNING if outer_turns else _STANDING,
        nominal_stiffness_n_per_m=params.model.bearing.nominal_stiffness_n_per_m,
    )


def _sites(params: BearingRigParams, system: LinearSystem) -> dict[str, Vector]:
    """The channels, where the rig has its sensor, and every mass under a name of its own."""
    places = {"shaft": "s", "pedestal": "p", "resonator": "r"}
    own = {f"{place}_{axis}": f"{axis}_{letter}" for place, letter in places.items() for axis in "xy"}
    sensed = "s" if params.dofs == 2 else "p"
    channels = {channel: f"{axis}_{sensed}" for channel, axis in params.model.sites.items()}
    return {site: {dof: 1.0} for site, dof in (own | channels).items() if dof in system.dof_names}


def _assemble(params: BearingRigParams) -> LinearSystem:
    model, assembly = params.model, Assembly()
    assembly.inertia("theta", model.shaft.inertia_kg_m2)
    assembly.inertia("x_s", model.shaft.mass_kg)
    assembly.inertia("y_s", model.shaft.mass_kg)
    if params.dofs > 2:
        add_pedestal(assembly, model.pedestal, "", resonator=params.dofs == 5)
    for axis in "xy":
        across = {f"{axis}_s": 1.0}
        if params.dofs > 2:
            across[f"{axis}_p"] = -1.0
        assembly.spring(across, model.bearing.nominal_stiffness_n_per_m)
        assembly.damper(across, model.shaft.damping_ns_per_m)
        assembly.interface(f"b_{axis}", across)
    # The third input is in units of gravity; the radial load never ends, as weight does.
    standing = {dof: force / model.gravity_m_per_s2 for dof, force in _standing_force(params).items()}
    columns: tuple[Vector, ...] = ({"theta": 1.0}, {"theta": -1.0}, standing)
    for name, column in zip(BASE_INPUTS, columns, strict=True):
        assembly.known_input(name, column)
    return assembly.build()


def _standing_force(params: BearingRigParams) -> dict[str, float]:
    """Radial load and weight on each degree of freedom [N]."""
    model = params.model
    gravity = model.gravity_m_per_s2 * params.physics.gravity
    force = {
        "x_s": model.radial_load_n * math.cos(model.load_direction_rad),
        "y_s": model.radial_load_n * math.sin(model.load_direction_rad) - model.shaft.mass_kg * gravity,
    }
    if params.dofs > 2:
        force["y_p"] = -model.pedestal.mass_kg * gravity
    if params.dofs == 5:
        force["y_r"] = -model.pedestal.resonator_mass_kg * gravity
    return force
