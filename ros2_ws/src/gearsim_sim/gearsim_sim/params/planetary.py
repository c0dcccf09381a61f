"""Parameters of a planetary stage, read from the `model` section of its machine YAML.

As for the parallel-shaft gearbox, attributes are in SI units, named by their suffix, and keys in YAML are
the names without it. Teeth, positions of the planets and bearing geometry come from the nameplate.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from gearsim_io.errors import InputError
from gearsim_io.nameplate import Bearing, GearMesh, Machine, PlanetaryStage
from gearsim_io.quantities import Si, validate
from gearsim_sim.params.bearing import RollingBearing
from gearsim_sim.params.fields import Count, Strict
from gearsim_sim.params.parts import Drive
from gearsim_sim.params.section import read_model_section

MODEL_KIND = "planetary"


def _on_or_off(value: float) -> bool:
    if value not in (0.0, 1.0):
        raise ValueError("0 or 1")
    return value == 1.0


Mass = Annotated[float, Si("kg", gt=0), Field(alias="mass")]
Inertia = Annotated[float, Si("kg*m^2", gt=0), Field(alias="inertia")]
Stiffness = Annotated[float, Si("N/m", gt=0), Field(alias="stiffness")]
Damping = Annotated[float, Si("N*s/m", ge=0), Field(alias="damping")]
Switch = Annotated[float, Si("", ge=0, le=1), AfterValidator(_on_or_off)]


class Teeth(Strict):
    """What the nameplate does not tell of the teeth."""

    module_m: Annotated[float, Si("m", gt=0), Field(alias="module")]
    """Module."""
    pressure_angle_rad: Annotated[float, Si("rad", gt=0, lt=math.pi / 4), Field(alias="pressure_angle")]
    """Pressure angle."""
    addendum: Annotated[float, Si("", gt=0, le=1.5)]
    """Height of the tooth above the pitch circle in modules."""
    face_width_m: Annotated[float, Si("m", gt=0), Field(alias="face_width")]
    """Face width."""
    sun_bore_radius_m: Annotated[float, Si("m", gt=0), Field(alias="sun_bore_radius")]
    """Radius of the sun's bore."""
    planet_bore_radius_m: Annotated[float, Si("m", gt=0), Field(alias="planet_bore_radius")]
    """Radius of the planets' bore."""
    ring_outer_radius_m: Annotated[float, Si("m", gt=0), Field(alias="ring_outer_radius")]
    """Outer radius of the ring."""


class Body(Strict):
    """A rigid wheel or the carrier."""

    mass_kg: Mass
    """Mass."""
    inertia_kg_m2: Inertia
    """Moment of inertia."""


class Support(Strict):
    """The same spring and damper in x and in y."""

    stiffness_n_per_m: Stiffness
    """Stiffness in x and y."""
    damping_ns_per_m: Damping
    """Damping in x and y."""


class RingSupport(Support):
    """How the ring is held, against turning too."""

    torsional_stiffness_nm_per_rad: Annotated[float, Si("N*m/rad", gt=0), Field(alias="torsional_stiffness")]
    """Torsional stiffness that holds the ring."""
    torsional_damping_nms_per_rad: Annotated[float, Si("N*m*s/rad", ge=0), Field(alias="torsional_damping")]
    """Torsional damping of the ring."""


class PlanetaryMesh(Strict):
    """Stiffness and damping of the tooth contacts; contact ratios follow from the teeth."""

    mean_stiffness_n_per_m: Annotated[float, Si("N/m", gt=0), Field(alias="mean_stiffness")]
    """Mean stiffness of each mesh along its line of action."""
    damping_ns_per_m: Damping
    """Damping of each mesh."""
    pair_stiffness_n_per_m: Annotated[float, Si("N/m", ge=0), Field(alias="pair_stiffness")]
    """Stiffness of one pair of teeth; sets the mean through the contact ratio."""
    pair_stiffness_ratio: Annotated[float, Si("", ge=1, le=2)]
    """Stiffness of two pairs over that of one."""
    potential_energy: Switch
    """Stiffness from the teeth by the potential-energy method."""
    harmonics: Count
    """Number of tooth mesh lines of the stiffness."""


class PlanetaryErrors(Strict):
    """Transmission errors of the gears, (7.39) to (7.43) as smooth functions of angle."""

    runout_m: Annotated[float, Si("m", ge=0), Field(alias="runout")]
    """Amplitude of the first order of run-out."""
    runout_harmonics: Count
    """Number of orders of run-out."""
    profile_m: Annotated[float, Si("m", ge=0), Field(alias="profile")]
    """Amplitude of the first line of the tooth profile error."""
    profile_harmonics: Count
    """Number of lines of the tooth profile error."""
    pitch_rms_m: Annotated[float, Si("m", ge=0), Field(alias="pitch_rms")]
    """Standard deviation of the random error of each tooth."""
    surface_rms_m: Annotated[float, Si("m", ge=0), Field(alias="surface_rms")]
    """Standard deviation of the random surface."""
    identical_planets: Switch
    """All planets have the same errors, as the thesis assumes."""


class PlanetPositions(Strict):
    """Errors of the planet pins along their circle, drawn with this standard deviation."""

    error_m: Annotated[float, Si("m", ge=0), Field(alias="error")]
    """Displacement of each pin along its circle."""


class PlanetBearing(RollingBearing):
    """Planet bearings as Hertz contacts instead of linear springs; the springs' dampers stay."""

    included: Switch
    """Planets run on Hertz bearings in place of linear springs."""


class Casing(Strict):
    """A mass that carries sun shaft and ring, which the thesis's model lacks."""

    included: Switch
    """Sun shaft and ring are joined through the casing."""
    mass_kg: Mass
    """Mass of the casing's part in that path."""
    stiffness_n_per_m: Stiffness
    """Stiffness between the ring and that mass."""
    damping_ns_per_m: Damping
    """Damping between the ring and that mass."""
    sun_stiffness_n_per_m: Annotated[float, Si("N/m", gt=0), Field(alias="sun_stiffness")]
    """Stiffness between the sun shaft and that mass."""
    sun_damping_ns_per_m: Annotated[float, Si("N*s/m", ge=0), Field(alias="sun_damping")]
    """Damping between the sun shaft and that mass."""


class FlexibleCasing(Strict):
    """The flexible casing of the model with one: ring and sun stand in it by their supports."""

    reduced: str
    """Name of a shipped reduced casing, or path of one (.npz) from the folder of the file that names it."""
    responses: str | None = None
    """Frequency responses of the same casing, by name or path, for accelerometers with `path: frf`."""
    carrier_stiffness_n_per_m: Annotated[float, Si("N/m", ge=0), Field(alias="carrier_stiffness")]
    """Stiffness of the carrier's bearing in the casing, in x and y; 0: it has none."""
    carrier_damping_ns_per_m: Annotated[float, Si("N*s/m", ge=0), Field(alias="carrier_damping")]
    """Damping of that bearing."""


class FirstStage(Strict):
    """The spur stage that drives the carrier."""

    included: Switch
    """The spur stage before the planetary one is part of the model."""
    pinion_mass_kg: Annotated[float, Si("kg", gt=0), Field(alias="pinion_mass")]
    """Mass of the pinion."""
    pinion_inertia_kg_m2: Annotated[float, Si("kg*m^2", gt=0), Field(alias="pinion_inertia")]
    """Moment of inertia of the pinion."""
    wheel_mass_kg: Annotated[float, Si("kg", gt=0), Field(alias="wheel_mass")]
    """Mass of the wheel."""
    wheel_inertia_kg_m2: Annotated[float, Si("kg*m^2", gt=0), Field(alias="wheel_inertia")]
    """Moment of inertia of the wheel."""
    module_m: Annotated[float, Si("m", gt=0), Field(alias="module")]
    """Module of the spur stage."""
    shaft_stiffness_n_per_m: Annotated[float, Si("N/m", gt=0), Field(alias="shaft_stiffness")]
    """Stiffness of the shafts' supports in x and y."""
    shaft_damping_ns_per_m: Annotated[float, Si("N*s/m", ge=0), Field(alias="shaft_damping")]
    """Damping of the shafts' supports."""
    coupling_stiffness_nm_per_rad: Annotated[float, Si("N*m/rad", gt=0), Field(alias="coupling_stiffness")]
    """Torsional stiffness between the wheel and the carrier."""
    coupling_damping_nms_per_rad: Annotated[float, Si("N*m*s/rad", ge=0), Field(alias="coupling_damping")]
    """Torsional damping between the wheel and the carrier."""


class PlanetaryPhysics(Strict):
    """Off switches, one for each physics."""

    mesh_stiffness_variation: bool = True
    runout: bool = True
    tooth_profile: bool = True
    tooth_pitch: bool = True
    tooth_surface: bool = True
    ball_passing: bool = True
    clearance: bool = True
    faults: bool = True


class PlanetaryModel(Strict):
    """The `model` section."""

    kind: Literal["planetary"]
    """What kind of machine the section describes."""
    drive: Drive
    teeth: Teeth
    carrier: Body
    sun: Body
    ring: Body
    planet: Body
    planet_seat: Support
    ring_support: RingSupport
    sun_support: Support
    carrier_on_sun: Support
    mesh: PlanetaryMesh
    gear_errors: PlanetaryErrors
    planet_positions: PlanetPositions
    planet_bearing: PlanetBearing
    casing: Casing
    first_stage: FirstStage
    flexible_casing: FlexibleCasing | None = None


class PlanetaryParams(Strict):
    """Everything that the planetary model needs: `model` section, nameplate, switches."""

    where: str
    model: PlanetaryModel
    stage: PlanetaryStage
    bearings: tuple[Bearing, ...]  # one for each planet, or none
    first_mesh: GearMesh | None
    physics: PlanetaryPhysics = PlanetaryPhysics()

    @property
    def planets(self) -> int:
        """Number of planets."""
        return len(self.stage.planet_angles_rad)

    def with_physics(self, **switches: bool) -> PlanetaryParams:
        """The same machine with some physics switched (`runout=False`)."""
        return self.model_copy(update={"physics": self.physics.model_copy(update=switches)})


def load_planetary_params(
    machine: str | Path = "unsw_planetary", overrides: Mapping[str, Any] | None = None, source: str = ""
) -> PlanetaryParams:
    """Parameters of a planetary machine.

    Parameters
    ----------
    machine : str or Path
        Name of a shipped machine description or path of a YAML file.
    overrides : mapping, optional
        Dotted names of the `model` section and the numbers that replace it (see `override`).
    source : str
        Where the overrides come from, for errors.

    Raises
    ------
    InputError
        If there is no usable `model` section, a number lacks unit or source, or it contradicts the
        nameplate.
    """
    read = read_model_section(machine, MODEL_KIND, "unsw_planetary", overrides, source)
    plate, where = read.plate, read.where
    model = validate(PlanetaryModel, read.content, where, require_source=True)
    stage = _single_stage(where, plate)
    params = PlanetaryParams(
        where=where,
        model=model,
        stage=stage,
        bearings=_bearings(where, plate, stage) if model.planet_bearing.included else (),
        first_mesh=_first_mesh(where, plate, stage) if model.first_stage.included else None,
    )
    _check(params)
    return params


def _single_stage(where: str, plate: Machine) -> PlanetaryStage:
    if len(plate.planetary_stages) != 1:
        found = f"{len(plate.planetary_stages)} planetary stages"
        raise InputError(where, "kind", found, "one planetary stage in nameplate")
    (stage,) = plate.planetary_stages
    if stage.fixed_member != "ring":
        expected = "a fixed ring: the model holds the ring by its support and drives carrier or sun"
        raise InputError(where, "kind", f"fixed {stage.fixed_member}", expected)
    if plate.reference_shaft != stage.carrier_shaft:
        raise InputError(where, "kind", plate.reference_shaft, "the carrier's shaft as reference_shaft")
    return stage


def _bearings(where: str, plate: Machine, stage: PlanetaryStage) -> tuple[Bearing, ...]:
    """Bearings of the planets in order, named planet_1_bearing and so on."""
    found = []
    for number in range(1, len(stage.planet_angles_rad) + 1):
        name = f"planet_{number}_bearing"
        if name not in {bearing.name for bearing in plate.bearings}:
            raise InputError(where, "planet_bearing.included", 1, f"bearing {name} in nameplate")
        bearing = plate.bearing(name)
        if bearing.shaft != stage.planet_shaft or not bearing.outer_ring_rotates:
            expected = (
                f"shaft {stage.planet_shaft} and outer_ring_rotates: true, as the planet turns on its pin"
            )
            raise InputError(where, name, bearing.shaft, expected)
        found.append(bearing)
    return tuple(found)


def _first_mesh(where: str, plate: Machine, stage: PlanetaryStage) -> GearMesh:
    for mesh in plate.gear_meshes:
        if mesh.driven_shaft == stage.carrier_shaft:
            return mesh
    raise InputError(where, "first_stage.included", 1, "a gear mesh in nameplate that drives the carrier")


def _check(params: PlanetaryParams) -> None:
    drive, where = params.model.drive, params.where
    if drive.speed_hz > drive.speed_limit_hz:
        raise InputError(where, "drive.speed", drive.speed_hz, f"<= {drive.speed_limit_hz} Hz")
    if drive.load_nm > drive.load_limit_nm:
        raise InputError(where, "drive.load", drive.load_nm, f"<= {drive.load_limit_nm} N m")
    if params.first_mesh is not None and params.stage.input_member != "carrier":
        expected = "0, as the first stage drives the carrier, which is not the input here"
        raise InputError(where, "first_stage.included", 1, expected)
