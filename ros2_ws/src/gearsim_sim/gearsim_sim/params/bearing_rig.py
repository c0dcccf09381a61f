"""Parameters of a single-bearing test rig, read from the `model` section of its machine YAML.

As for the gearboxes, attributes are in SI units, named by their suffix; keys in YAML are the names without
it. The geometry of the bearing comes from the nameplate.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from gearsim_io.errors import InputError
from gearsim_io.nameplate import Bearing, Machine
from gearsim_io.quantities import Si, validate
from gearsim_sim.params.bearing import RollingBearing
from gearsim_sim.params.fields import Strict
from gearsim_sim.params.parts import Drive, Pedestal, Seat
from gearsim_sim.params.section import read_model_section

MODEL_KIND = "bearing_rig"
Dofs = Literal[2, 4, 5]


class RigPhysics(Strict):
    """Off switches, one for each physics."""

    ball_passing: bool = True
    clearance: bool = True
    gravity: bool = True
    faults: bool = True


class BearingRigModel(Strict):
    """The `model` section."""

    kind: Literal["bearing_rig"]
    """What kind of machine the section describes."""
    drive: Drive
    shaft: Seat
    """What of the shaft moves with the inner ring, and the damper of the bearing."""
    radial_load_n: Annotated[float, Si("N", ge=0), Field(alias="radial_load")]
    """Standing force on the shaft beside its weight."""
    load_direction_rad: Annotated[
        float, Si("rad", ge=-2 * math.pi, le=2 * math.pi), Field(alias="load_direction")
    ]
    """Where it presses the inner ring to, from x counter-clockwise."""
    bearing: RollingBearing
    pedestal: Pedestal
    sites: dict[str, Literal["x", "y"]] = Field(min_length=1)
    """Direction of each channel: of the pedestal, or of the inner ring where there is no pedestal."""
    gravity_m_per_s2: Annotated[float, Si("m/s^2", gt=0), Field(alias="gravity")]
    """Against y."""


class BearingRigParams(Strict):
    """What the models of 2, 4 and 5 degrees of freedom need: `model` section, nameplate, switches."""

    where: str
    model: BearingRigModel
    bearing: Bearing
    shaft: str
    dofs: Dofs = 5
    physics: RigPhysics = RigPhysics()

    def with_physics(self, **switches: bool) -> BearingRigParams:
        """The same rig with some physics switched (`gravity=False`)."""
        return self.model_copy(update={"physics": self.physics.model_copy(update=switches)})

    def with_dofs(self, dofs: Dofs) -> BearingRigParams:
        """The same rig with 2, 4 or 5 degrees of freedom."""
        return self.model_copy(update={"dofs": dofs})


def load_bearing_rig_params(
    machine: str | Path = "mfpt", overrides: Mapping[str, Any] | None = None, source: str = ""
) -> BearingRigParams:
    """Parameters of a single-bearing rig.

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
    read = read_model_section(machine, MODEL_KIND, "mfpt", overrides, source)
    plate, where = read.plate, read.where
    model = validate(BearingRigModel, read.content, where, require_source=True)
    params = BearingRigParams(
        where=where, model=model, bearing=_single_bearing(where, plate), shaft=plate.reference_shaft
    )
    _check(params, plate)
    return params


def _single_bearing(where: str, plate: Machine) -> Bearing:
    if len(plate.bearings) != 1:
        found = ", ".join(bearing.name for bearing in plate.bearings) or "no bearing"
        raise InputError(where, "bearings", found, "one bearing in nameplate, which the rig tests")
    (bearing,) = plate.bearings
    if bearing.shaft != plate.reference_shaft:
        raise InputError(where, f"{bearing.name}.shaft", bearing.shaft, f"the shaft {plate.reference_shaft}")
    return bearing


def _check(params: BearingRigParams, plate: Machine) -> None:
    """Contradictions between sections."""
    model, where, drive = params.model, params.where, params.model.drive
    channels = [channel.name for channel in plate.channels]
    for name in model.sites:
        if name not in channels:
            raise InputError(where, f"sites.{name}", name, "one of the channels " + ", ".join(channels))
    if drive.speed_hz > drive.speed_limit_hz:
        raise InputError(where, "drive.speed", drive.speed_hz, f"<= {drive.speed_limit_hz} Hz")
    if drive.load_nm > drive.load_limit_nm:
        raise InputError(where, "drive.load", drive.load_nm, f"<= {drive.load_limit_nm} N m")
