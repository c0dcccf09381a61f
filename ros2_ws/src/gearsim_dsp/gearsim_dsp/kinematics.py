"""Expected orders: at which multiples of the reference shaft's speed bearings and gears speak.

Rolling without slip between rings that turn at f_i (inner) and f_o (outer), with q = d cos(a) / D
(d element diameter, D pitch diameter, a contact angle, N elements)::

    cage            FTF  = (f_i (1 - q) + f_o (1 + q)) / 2
    outer race      BPFO = N |FTF - f_o| = N/2 (1 - q) |f_i - f_o|
    inner race      BPFI = N |f_i - FTF| = N/2 (1 + q) |f_i - f_o|
    rolling element BSF  = D/(2 d) (1 - q^2) |f_i - f_o|

(Harris, Rolling Bearing Analysis, ch. 8; Randall and Antoni, Mech. Syst. Signal Process. 25 (2011)
485-520, eq. 1-4.) A defect is modulated by what carries it through the load zone: a defect on a ring that
turns by that ring's speed, a defect on an element by the cage, and an element strikes both races, so it
speaks at 2 BSF. Wheels and planets: `gear_kinematics`, `planet_kinematics`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gearsim_io.errors import InputError
from gearsim_io.nameplate import Bearing, GearMesh, Machine

__all__ = [
    "SLIP_TOLERANCE",
    "BearingOrders",
    "FaultFamily",
    "bearing_orders",
    "fault_families",
    "mesh_orders",
]

SLIP_TOLERANCE = 0.012
"""Relative deviation of a bearing's lines from pure rolling, by slip and by contact angle under load.

Randall and Antoni (2011) give 1 to 2 % of slip at most; the measured rigs show up to 0.7 %."""


@dataclass(frozen=True, slots=True)
class FaultFamily:
    """A family of lines that one fault of one component puts into an envelope spectrum.

    Parameters
    ----------
    component : str
        Bearing or gear, as on the nameplate.
    fault : str
        Fault word of the diagnosis contract, such as "outer_race".
    order : float
        Fundamental, in multiples of the reference shaft's speed.
    sideband_order : float
        Spacing of the sidebands around each harmonic; 0: none expected.
    label : str
        For markers: "BPFO", "BPFI", "2xBSF", "FTF".
    tolerance : float
        Relative half-width within which the true line may lie (slip and geometry; not the speed's error).
    """

    component: str
    fault: str
    order: float
    sideband_order: float
    label: str
    tolerance: float


@dataclass(frozen=True, slots=True)
class BearingOrders:
    """Kinematic orders of one bearing, in multiples of the reference shaft's speed."""

    ftf: float
    bpfo: float
    bpfi: float
    bsf: float


def bearing_orders(bearing: Bearing, shaft_ratio: float = 1.0) -> BearingOrders:
    """Orders of a bearing whose turning ring runs at `shaft_ratio` times the reference shaft.

    Parameters
    ----------
    bearing : Bearing
        Geometry in metres and radians; one ring stands.
    shaft_ratio : float
        Speed of the bearing's shaft over the reference shaft's, > 0.

    Raises
    ------
    InputError
        When the geometry is impossible.
    """
    where = f"bearing {bearing.name!r}"
    if bearing.rolling_elements < 3:
        raise InputError(where, "rolling_elements", bearing.rolling_elements, "3 or more")
    if not 0 < bearing.element_diameter_m < bearing.pitch_diameter_m:
        got = f"{bearing.element_diameter_m} m in {bearing.pitch_diameter_m} m"
        raise InputError(where, "element_diameter", got, "above 0 and below the pitch diameter")
    if not abs(bearing.contact_angle_rad) < math.pi / 2:
        raise InputError(where, "contact_angle", bearing.contact_angle_rad, "below 90 degrees")
    if not shaft_ratio > 0:
        raise InputError(where, "shaft ratio", shaft_ratio, "> 0")
    n = bearing.rolling_elements
    size = bearing.element_diameter_m / bearing.pitch_diameter_m
    q = size * math.cos(bearing.contact_angle_rad)
    cage = 0.5 * (1 + q) if bearing.outer_ring_rotates else 0.5 * (1 - q)
    return BearingOrders(
        ftf=shaft_ratio * cage,
        bpfo=shaft_ratio * 0.5 * n * (1 - q),
        bpfi=shaft_ratio * 0.5 * n * (1 + q),
        bsf=shaft_ratio * (1 - q * q) / (2 * size),
    )


def fault_families(machine: Machine) -> tuple[FaultFamily, ...]:
    """All fault families of the machine's bearings: outer race, inner race, rolling element, cage of each."""
    families: list[FaultFamily] = []
    for bearing in machine.bearings:
        ratio = machine.shaft(bearing.shaft).ratio
        orders = bearing_orders(bearing, ratio)
        outer_carrier, inner_carrier = (ratio, 0.0) if bearing.outer_ring_rotates else (0.0, ratio)
        rows = (
            ("outer_race", orders.bpfo, outer_carrier, "BPFO"),
            ("inner_race", orders.bpfi, inner_carrier, "BPFI"),
            ("rolling_element", 2 * orders.bsf, orders.ftf, "2xBSF"),
            ("cage", orders.ftf, 0.0, "FTF"),
        )
        families += [
            FaultFamily(bearing.name, fault, order, sideband, label, SLIP_TOLERANCE)
            for fault, order, sideband, label in rows
        ]
    return tuple(families)


def mesh_orders(machine: Machine) -> dict[str, float]:
    """Gear mesh order of each mesh, in multiples of the reference shaft's speed.

    Raises
    ------
    InputError
        When teeth and shaft ratios contradict each other by more than 1e-6.
    """
    return {mesh.name: _mesh_order(machine, mesh) for mesh in machine.gear_meshes}


def _mesh_order(machine: Machine, mesh: GearMesh) -> float:
    driving = mesh.driving_teeth * machine.shaft(mesh.driving_shaft).ratio
    driven = mesh.driven_teeth * machine.shaft(mesh.driven_shaft).ratio
    if not math.isclose(driving, driven, rel_tol=1e-6):
        raise InputError(
            f"gear mesh {mesh.name!r}", "teeth", f"{driving:g} and {driven:g} per turn", "one mesh order"
        )
    return driving
