"""Parameters of the parallel-shaft gearbox, read from the `model` section of its machine YAML.

Attributes are in SI units, named by their suffix; the keys in YAML are the names without the suffix,
and each value there carries its unit and source. Teeth and bearing geometry come from the nameplate,
so that they have one home.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from gearsim_io.errors import InputError
from gearsim_io.nameplate import Bearing, GearMesh, Machine
from gearsim_io.quantities import Si, validate
from gearsim_sim.model.tooth.pair import GearPair
from gearsim_sim.model.tooth.stiffness import pair_compliance
from gearsim_sim.params.bearing import RollingBearing
from gearsim_sim.params.fields import Count, Strict
from gearsim_sim.params.finite_shafts import FiniteShafts
from gearsim_sim.params.parts import Drive, Gear, Pedestal, Seat, Shafts, TorsionalEnd
from gearsim_sim.params.section import read_model_section
from gearsim_sim.params.teeth import Teeth

BEARINGS = ("bearing_1", "bearing_2", "bearing_3", "bearing_4")
MODEL_KIND = "parallel_shaft"
Site = Literal["b1_x", "b1_y", "b2_x", "b2_y", "b3_x", "b3_y", "b4_x", "b4_y"]
# Working pressure angles of spur gears that can be made; 14.5 to 25 degrees are usual.
_FIT_M = 1e-7  # to which distances are written down
_PRESSURE_ANGLES_RAD = (math.radians(10), math.radians(35))
# Base radii of teeth and model may differ by this part: numbers of YAML are written with three digits.
_SAME_RADIUS = 1e-3


class GearboxSeat(Seat):
    """A seat of the gearbox."""

    bearing: RollingBearing | None = None
    """Numbers of the section `ball_bearing` that are different for this one."""


class MeshStiffness(Strict):
    """Stiffness and damping of the tooth contact along the line of action.

    `stiffness_model`: `tabulated` takes mean stiffness, contact ratio and stiffness ratio from here;
    `potential_energy` and `rectangular` take all that from the `teeth` section.
    """

    stiffness_model: Literal["tabulated", "potential_energy", "rectangular"] = "tabulated"
    """tabulated: two rounded levels from the numbers here; potential_energy: from the teeth; rectangular:
    1.4e10 N/m per metre of face for each pair in contact, with true jumps (thesis 7.5.1)."""
    mean_stiffness_n_per_m: Annotated[float, Si("N/m", gt=0), Field(alias="mean_stiffness")]
    """Mean over the mesh cycle."""
    damping_ns_per_m: Annotated[float, Si("N*s/m", ge=0), Field(alias="damping")]
    """Of the damper along the line of action."""
    contact_ratio: Annotated[float, Si("", gt=1, lt=2)]
    """Mean number of tooth pairs in contact."""
    pair_stiffness_ratio: Annotated[float, Si("", ge=1, le=2)]
    """Stiffness with two pairs in contact over that with one."""
    harmonics: Count
    """Lines of the tooth mesh that the stiffness keeps."""
    centre_distance_m: Annotated[Annotated[float, Si("m", gt=0)] | None, Field(alias="centre_distance")] = (
        None
    )
    """Distance of the axes, if it is to be checked against the teeth."""


class GearErrors(Strict):
    """Transmission error of each gear, added along the line of action."""

    runout_m: Annotated[float, Si("m", ge=0), Field(alias="runout")]
    """Amplitude once per turn of each gear, (4.15)."""
    profile_m: Annotated[float, Si("m", ge=0), Field(alias="profile")]
    """Amplitude at the tooth mesh, (4.16)."""
    pinion_phase_rad: Annotated[float, Si("rad"), Field(alias="pinion_phase")]
    """Of run-out and profile of the pinion."""
    gear_phase_rad: Annotated[float, Si("rad"), Field(alias="gear_phase")]
    """Of run-out and profile of the gear."""
    pitch_rms_m: Annotated[float, Si("m", ge=0), Field(alias="pitch_rms")]
    """Of the random errors of the single teeth."""
    surface_rms_m: Annotated[float, Si("m", ge=0), Field(alias="surface_rms")]
    """Of the random surface."""
    harmonics: Count
    """Pitch and surface errors reach this multiple of the tooth mesh order."""


class Casing(Strict):
    """The flexible casing of the models with one."""

    reduced: str
    """Name of a shipped reduced casing, or path of one (.npz) from the folder of the file that names it."""
    responses: str | None = None
    """Frequency responses of the same casing, by name or path, for accelerometers with `path: frf`."""


class Physics(Strict):
    """Off switches, one for each physics."""

    mesh_stiffness_variation: bool = True
    runout: bool = True
    tooth_profile: bool = True
    tooth_pitch: bool = True
    tooth_surface: bool = True
    ball_passing: bool = True
    clearance: bool = True
    gravity: bool = True
    faults: bool = True


class ParallelModel(Strict):
    """The `model` section."""

    kind: Literal["parallel_shaft"]
    """What kind of machine the section describes."""
    stage: str = ""
    """The gear mesh of the nameplate that is modelled, where there are several."""
    sites: dict[str, Site] = Field(default_factory=dict)
    """Where each channel is that is not named after its place."""
    drive: Drive
    flywheel_1: TorsionalEnd
    flywheel_2: TorsionalEnd
    encoder_1: TorsionalEnd
    encoder_2: TorsionalEnd
    pinion: Gear
    gear: Gear
    shafts: Shafts
    seats: dict[str, GearboxSeat]
    mesh: MeshStiffness
    teeth: Teeth | None = None
    gear_errors: GearErrors
    ball_bearing: RollingBearing
    pedestal: Pedestal
    casing: Casing | None = None
    finite_shafts: FiniteShafts | None = None
    gravity_m_per_s2: Annotated[float, Si("m/s^2", ge=0), Field(alias="gravity")]
    """Acceleration of gravity, against y."""


class ParallelParams(Strict):
    """What the models of 22 and 34 degrees of freedom need: `model` section, nameplate, switches."""

    where: str
    model: ParallelModel
    mesh: GearMesh
    bearings: tuple[Bearing, ...]
    input_shaft: str
    output_shaft: str
    pedestals: bool = True  # False: the 22 internal degrees of freedom on rigid ground
    physics: Physics = Physics()

    @property
    def speed_ratio(self) -> float:
        """Speed of the output shaft over that of the input shaft."""
        return self.mesh.driving_teeth / self.mesh.driven_teeth

    @property
    def rolling_bearings(self) -> tuple[RollingBearing, ...]:
        """What the nameplate does not tell of each bearing, in the order of `BEARINGS`."""
        seats = (self.model.seats[name] for name in BEARINGS)
        return tuple(seat.bearing or self.model.ball_bearing for seat in seats)

    @property
    def gear_pair(self) -> GearPair | None:
        """The teeth in mesh, if the model describes them; InputError if there are no such gears."""
        pair = self.tight_pair
        return None if pair is None else self._at_its_distance(pair)

    @property
    def tight_pair(self) -> GearPair | None:
        """The same without backlash."""
        if self.model.teeth is None:
            return None
        try:
            pair = self.model.teeth.pair(self.mesh.driving_teeth, self.mesh.driven_teeth)
            pair_compliance(pair, 0.0)  # fillets and wheel bodies must be possible, too
        except InputError as error:
            raise InputError(self.where, f"teeth.{error.field}", error.value, error.expected) from None
        return pair

    def _at_its_distance(self, pair: GearPair) -> GearPair:
        """The pair with its axes where `mesh.centre_distance` puts them."""
        distance = self.model.mesh.centre_distance_m
        if distance is None:
            return pair
        spread, field = distance - pair.centre_distance_m, "mesh.centre_distance"
        if spread < -_FIT_M:
            expected = f"at least {pair.centre_distance_m:.9g} m, where these teeth mesh without backlash"
            raise InputError(self.where, field, distance, expected)
        try:
            return replace(pair, spread_m=max(spread, 0.0))
        except InputError as error:
            expected = f"nearer to {pair.centre_distance_m:.9g} m: {error.field} {error.expected}"
            raise InputError(self.where, field, distance, expected) from None

    def with_physics(self, **switches: bool) -> ParallelParams:
        """The same machine with some physics switched (`gravity=False`)."""
        return self.model_copy(update={"physics": self.physics.model_copy(update=switches)})


def load_parallel_params(
    machine: str | Path = "unsw_parallel", overrides: Mapping[str, Any] | None = None, source: str = ""
) -> ParallelParams:
    """Parameters of a parallel-shaft machine.

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
    read = read_model_section(machine, MODEL_KIND, "unsw_parallel", overrides, source)
    plate, where = read.plate, read.where
    model = validate(ParallelModel, _with_own_bearings(read.content), where, require_source=True)
    mesh = _modelled_mesh(where, plate, model.stage)
    params = ParallelParams(
        where=where,
        model=model,
        mesh=mesh,
        bearings=_bearings(where, plate, mesh),
        input_shaft=mesh.driving_shaft,
        output_shaft=mesh.driven_shaft,
    )
    _check(params)
    _check_sites(params, plate)
    return params


def _with_own_bearings(section: Mapping[str, Any]) -> dict[str, Any]:
    """The section with `seats.*.bearing` completed from `ball_bearing`, which all four share."""
    seats, common = section.get("seats"), section.get("ball_bearing")
    if not isinstance(seats, Mapping) or not isinstance(common, Mapping):
        return dict(section)  # the validation tells

    def completed(seat: Any) -> Any:
        own = seat.get("bearing") if isinstance(seat, Mapping) else None
        return {**seat, "bearing": {**common, **own}} if isinstance(own, Mapping) else seat

    return {**section, "seats": {name: completed(seat) for name, seat in seats.items()}}


def _modelled_mesh(where: str, plate: Machine, stage: str) -> GearMesh:
    """The stage with its pinion, the wheel that stands for the input, on the reference shaft.

    Where power flows to the reference shaft the other flanks carry, at the same orders.
    """
    meshes = [mesh for mesh in plate.gear_meshes if stage in ("", mesh.name)]
    if len(meshes) != 1:
        names = ", ".join(mesh.name for mesh in plate.gear_meshes)
        found = f"no gear mesh {stage}" if stage else f"{len(meshes)} gear meshes"
        expected = f"stage with one of {names}" if names else "one gear mesh in nameplate"
        raise InputError(where, "kind", found, expected)
    mesh = meshes[0]
    if mesh.driven_shaft == plate.reference_shaft:
        shafts = (mesh.driven_shaft, mesh.driving_shaft)
        return GearMesh(mesh.name, *shafts, mesh.driven_teeth, mesh.driving_teeth)
    if mesh.driving_shaft != plate.reference_shaft:
        expected = "the driving or the driven shaft as reference_shaft"
        raise InputError(where, "kind", plate.reference_shaft, expected)
    return mesh


def _bearings(where: str, plate: Machine, mesh: GearMesh) -> tuple[Bearing, ...]:
    """The four bearings in the order of the model: two on the input, two on the output shaft."""
    names = {bearing.name for bearing in plate.bearings}
    if names != set(BEARINGS):
        raise InputError(where, "bearings", sorted(names), ", ".join(BEARINGS))
    found = tuple(plate.bearing(name) for name in BEARINGS)
    shafts = (mesh.driving_shaft,) * 2 + (mesh.driven_shaft,) * 2
    for bearing, shaft in zip(found, shafts, strict=True):
        if bearing.shaft != shaft:
            raise InputError(where, f"{bearing.name}.shaft", bearing.shaft, shaft)
        if bearing.outer_ring_rotates:
            raise InputError(where, f"{bearing.name}.outer_ring_rotates", True, "false")
    return found


def _check(params: ParallelParams) -> None:
    """Contradictions between sections."""
    model, where = params.model, params.where
    if set(model.seats) != set(BEARINGS):
        raise InputError(where, "seats", sorted(model.seats), ", ".join(BEARINGS))
    _check_teeth(params)
    _check_tooth_data(params)
    if model.drive.speed_hz > model.drive.speed_limit_hz:
        raise InputError(where, "drive.speed", model.drive.speed_hz, f"<= {model.drive.speed_limit_hz} Hz")
    if model.drive.load_nm > model.drive.load_limit_nm:
        raise InputError(where, "drive.load", model.drive.load_nm, f"<= {model.drive.load_limit_nm} N m")


def _check_sites(params: ParallelParams, plate: Machine) -> None:
    channels = [channel.name for channel in plate.channels]
    for name in params.model.sites:
        if name not in channels:
            expected = "one of the channels " + ", ".join(channels)
            raise InputError(params.where, f"sites.{name}", name, expected)


def _check_teeth(params: ParallelParams) -> None:
    """Gears that cannot be put together: unlike pitches, or axes at a distance where teeth do not meet."""
    model, where = params.model, params.where
    pinion, gear, mesh = model.pinion.base_radius_m, model.gear.base_radius_m, params.mesh
    due = pinion * mesh.driven_teeth / mesh.driving_teeth
    if abs(gear / due - 1) > 1e-9:
        expected = (
            f"{due:.12g} m, so that {mesh.driving_teeth} and {mesh.driven_teeth} teeth have one base pitch"
        )
        raise InputError(where, "gear.base_radius", gear, expected)
    distance = model.mesh.centre_distance_m
    if distance is None:
        return
    low, high = ((pinion + gear) / math.cos(angle) for angle in _PRESSURE_ANGLES_RAD)
    if not low <= distance <= high:
        expected = (
            f"{low:.6g} to {high:.6g} m, where {mesh.driving_teeth} and {mesh.driven_teeth} teeth of these "
            f"base radii meet at a pressure angle of 10 to 35 degrees"
        )
        raise InputError(where, "mesh.centre_distance", distance, expected)


def _check_tooth_data(params: ParallelParams) -> None:
    """The teeth must be there if they are needed, possible, and those of the model's base circles."""
    model, pair = params.model, params.tight_pair
    if pair is None:
        if model.mesh.stiffness_model != "tabulated":
            expected = f"this section, since mesh.stiffness_model is {model.mesh.stiffness_model}"
            raise InputError(params.where, "teeth", "nothing", expected)
        return
    radius = model.pinion.base_radius_m
    if abs(pair.pinion.base_radius_m / radius - 1) > _SAME_RADIUS:
        expected = (
            f"teeth with the pinion's base radius {radius:g} m; these have {pair.pinion.base_radius_m:.6g} m"
        )
        raise InputError(params.where, "teeth.module", model.teeth and model.teeth.module_m, expected)
    _ = params.gear_pair  # refuses axes where these teeth do not meet
