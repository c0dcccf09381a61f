"""What faults of shafts and structure need to know of a machine: planes, couplings, mounts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from gearsim_sim.model.assembly import Vector


@dataclass(frozen=True)
class Plane:
    """A place along a shaft that moves in x and y."""

    x: Vector
    y: Vector


@dataclass(frozen=True)
class Coupling:
    """Where a shaft is joined to its motor or its load.

    Attributes
    ----------
    near, far : str
        Planes of the bearings beside the coupling and at the other end, which share its force.
    driver, driven : Vector
        Rotation before and behind the coupling, in the direction of the power.
    stiffness_nm_per_rad : float
        Of the coupling in torsion.
    torque_per_load : float
        Torque that it carries per unit of load torque.
    drives_shaft : bool
        Whether the shaft is the driven one.
    """

    near: str
    far: str
    driver: Vector
    driven: Vector
    stiffness_nm_per_rad: float
    torque_per_load: float
    drives_shaft: bool


@dataclass(frozen=True)
class Shaft:
    """A turning shaft.

    Attributes
    ----------
    track : int
        Its angle, as seen in the frame of the model.
    rate : float
        Its absolute turns per turn of the reference shaft, in the sense of the track.
    sense : float
        1 if the track is counted anticlockwise in the plane of x and y, -1 if clockwise.
    planes : mapping
        Places along it; the first is that of its wheel.
    bends : mapping
        Bending stiffness between the wheel's plane and others [N/m].
    """

    name: str
    track: int
    rate: float
    sense: float
    planes: Mapping[str, Plane]
    bends: Mapping[str, float]
    coupling: Coupling | None = None

    @property
    def wheel(self) -> str:
        """Name of the plane of its wheel."""
        return next(iter(self.planes))


@dataclass(frozen=True)
class Mount:
    """A pedestal on its base: direction of lift, stiffness and damping of the base."""

    lift: Vector
    stiffness_n_per_m: float
    damping_ns_per_m: float
