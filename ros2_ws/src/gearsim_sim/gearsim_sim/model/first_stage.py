"""The spur stage that drives the carrier: a pinion on its shaft, and a wheel bolted to the carrier.

Pinion and wheel move in x and y of the ground, the stage behind them in the frame of the carrier. So the
wheel passes its torque on to the carrier, through a stiff coupling, and not its shaking across, which in
the carrier's frame would turn. The pinion is counted in its own sense, as on the parallel shafts: y is the
line of action, the teeth are compressed by d = r_pin theta_pin - r_w theta_w - y_pin + y_w + e.
"""

from __future__ import annotations

import math

from gearsim_sim.model.assembly import Assembly, Vector
from gearsim_sim.model.shaft import torsion_link
from gearsim_sim.model.tooth.contact_ratio import contact_ratio_external
from gearsim_sim.params.planetary import PlanetaryParams

INTERFACE = "first_stage"


def teeth_of(params: PlanetaryParams) -> tuple[int, int]:
    """Of pinion and wheel."""
    assert params.first_mesh is not None
    return params.first_mesh.driving_teeth, params.first_mesh.driven_teeth


def first_stage_vector(params: PlanetaryParams) -> Vector:
    """Gradient of the compression of the teeth."""
    scale = params.model.first_stage.module_m / 2 * math.cos(params.model.teeth.pressure_angle_rad)
    pinion, wheel = (scale * count for count in teeth_of(params))
    return {"theta_pin": pinion, "theta_w": -wheel, "y_pin": -1.0, "y_w": 1.0}


def first_stage_contact_ratio(params: PlanetaryParams) -> float:
    """Of full-depth teeth of this module and the pressure angle of the planetary stage."""
    module, angle = params.model.first_stage.module_m, params.model.teeth.pressure_angle_rad
    radii = [module * count / 2 for count in teeth_of(params)]
    tips = [radius + params.model.teeth.addendum * module for radius in radii]
    bases = [radius * math.cos(angle) for radius in radii]
    pitch = math.pi * module * math.cos(angle)
    return contact_ratio_external(tips[0], bases[0], tips[1], bases[1], sum(radii), angle, pitch)


def first_stage_rigid(params: PlanetaryParams) -> Vector:
    """Its motion for one radian of the carrier."""
    pinion, wheel = teeth_of(params)
    return {"theta_w": 1.0, "theta_pin": wheel / pinion}


def add_first_stage(assembly: Assembly, params: PlanetaryParams) -> None:
    """Six degrees of freedom, shaft supports, the coupling to the carrier and the mesh."""
    stage, mesh = params.model.first_stage, params.model.mesh
    bodies = {
        "pin": (stage.pinion_mass_kg, stage.pinion_inertia_kg_m2),
        "w": (stage.wheel_mass_kg, stage.wheel_inertia_kg_m2),
    }
    for name, (mass, inertia) in bodies.items():
        for axis in "xy":
            dof = f"{axis}_{name}"
            assembly.inertia(dof, mass)
            assembly.spring({dof: 1.0}, stage.shaft_stiffness_n_per_m)
            assembly.damper({dof: 1.0}, stage.shaft_damping_ns_per_m)
        assembly.inertia(f"theta_{name}", inertia)
    torsion_link(
        assembly,
        "theta_w",
        "theta_c",
        stage.coupling_stiffness_nm_per_rad,
        stage.coupling_damping_nms_per_rad,
    )
    vector = first_stage_vector(params)
    assembly.spring(vector, mesh.mean_stiffness_n_per_m)
    assembly.damper(vector, mesh.damping_ns_per_m)
    assembly.interface(INTERFACE, vector)
