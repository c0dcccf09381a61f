"""Sections that several kinds of machines share: drive, shafts, wheels, seats, pedestals."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gearsim_io.quantities import Si
from gearsim_sim.params.fields import Strict


class TorsionalEnd(Strict):
    """A flywheel or an encoder at the end of a shaft, behind a torsion spring and damper."""

    inertia_kg_m2: Annotated[float, Si("kg*m^2", gt=0), Field(alias="inertia")]
    """Of the flywheel or encoder."""
    stiffness_nm_per_rad: Annotated[float, Si("N*m/rad", gt=0), Field(alias="stiffness")]
    """Of the coupling in torsion."""
    damping_nms_per_rad: Annotated[float, Si("N*m*s/rad", ge=0), Field(alias="damping")]
    """Of the coupling in torsion."""


class Gear(Strict):
    """A gear wheel, lumped."""

    inertia_kg_m2: Annotated[float, Si("kg*m^2", gt=0), Field(alias="inertia")]
    """About the axis, with its part of the shaft."""
    mass_kg: Annotated[float, Si("kg", gt=0), Field(alias="mass")]
    """With its part of the shaft."""
    base_radius_m: Annotated[float, Si("m", gt=0), Field(alias="base_radius")]
    """Radius of the base circle; those of both wheels are in the ratio of the teeth."""


class Seat(Strict):
    """The part of a shaft lumped at a bearing, and the damper of that bearing."""

    inertia_kg_m2: Annotated[float, Si("kg*m^2", gt=0), Field(alias="inertia")]
    """About the axis."""
    mass_kg: Annotated[float, Si("kg", gt=0), Field(alias="mass")]
    """What moves with the inner ring."""
    damping_ns_per_m: Annotated[float, Si("N*s/m", ge=0), Field(alias="damping")]
    """Of the linear damper between the rings."""


class Shafts(Strict):
    """Stiffness of each shaft half, from gear to bearing."""

    torsional_stiffness_nm_per_rad: Annotated[float, Si("N*m/rad", gt=0), Field(alias="torsional_stiffness")]
    """Between the gear and a bearing."""
    bending_stiffness_n_per_m: Annotated[float, Si("N/m", gt=0), Field(alias="bending_stiffness")]
    """Between the gear and a bearing, in x and in y."""


class Pedestal(Strict):
    """A bearing pedestal: a mass on springs, carrying a small mass that stands for a high resonance."""

    mass_kg: Annotated[float, Si("kg", gt=0), Field(alias="mass")]
    """Of the pedestal with the outer ring."""
    stiffness_n_per_m: Annotated[float, Si("N/m", gt=0), Field(alias="stiffness")]
    """Of its base, in x and in y."""
    damping_ns_per_m: Annotated[float, Si("N*s/m", ge=0), Field(alias="damping")]
    """Of its base, in x and in y."""
    resonator_mass_kg: Annotated[float, Si("kg", gt=0), Field(alias="resonator_mass")]
    """Of the small mass on the pedestal, which moves in y."""
    resonator_frequency_hz: Annotated[float, Si("Hz", gt=0), Field(alias="resonator_frequency")]
    """Of that mass on a pedestal that stands still."""
    resonator_damping_ratio: Annotated[float, Si("", ge=0, lt=1)]
    """Of critical."""


class Drive(Strict):
    """Operating point at the start, and its limits."""

    speed_hz: Annotated[float, Si("Hz", ge=0), Field(alias="speed")]
    """Of the reference shaft."""
    load_nm: Annotated[float, Si("N*m", ge=0), Field(alias="load")]
    """Torque of the driven machine."""
    speed_limit_hz: Annotated[float, Si("Hz", gt=0), Field(alias="speed_limit")]
    """Highest speed that may be asked for."""
    load_limit_nm: Annotated[float, Si("N*m", gt=0), Field(alias="load_limit")]
    """Highest load that may be asked for."""
    acceleration_torque_nm: Annotated[float, Si("N*m", gt=0), Field(alias="acceleration_torque")]
    """What the motor has to spare for changes of speed."""
