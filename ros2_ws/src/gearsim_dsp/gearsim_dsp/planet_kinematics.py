"""Orders of a planetary stage: speeds, mesh, planet pass, carrier sidebands, impulses of bad teeth.

Willis: seen from the carrier the stage is a train with standing axes, (w_s - w_c) Z_s = -(w_r - w_c) Z_r.
With N planets, and w_p the spin of a planet against the carrier::

    mesh         |w_r - w_c| Z_r = |w_s - w_c| Z_s = |w_p| Z_p
    planet pass  N |w_c - w_r|    planets that pass one place of the ring (its sensor, one of its teeth)
    sun tooth    N |w_s - w_c|    planets that one tooth of the sun meets
    planet tooth |w_p|            with the sun, and as often with the ring: 2 |w_p| together

(Thesis Table 7.4 and 7.9; Samuel and Pines, J. Sound Vib. 282 (2005) 475-508.) A spall is on one flank and
strikes in one of a planet's two meshes; a crack yields in both.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.gear_kinematics import ToothFamily
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine, PlanetaryStage

__all__ = [
    "CarrierLine",
    "PlanetaryOrders",
    "carrier_sidebands",
    "hunting_turns",
    "mesh_phases",
    "planet_families",
    "planetary_orders",
    "ring_to_sun_turn",
]


@dataclass(frozen=True, slots=True)
class PlanetaryOrders:
    """Orders of one stage, in multiples of the reference shaft's speed; all are magnitudes.

    Parameters
    ----------
    carrier, sun, ring : float
        Speeds of the members against the ground, 0 for the one that stands.
    planet : float
        Speed of a planet about its own centre against the ground.
    planet_spin : float
        Speed of a planet against the carrier.
    sun_on_carrier, ring_on_carrier : float
        Speeds of sun and ring against the carrier.
    mesh : float
        Mesh order, the same for sun and ring.
    planet_pass : float
        Planets that pass one place of the ring.
    """

    carrier: float
    sun: float
    ring: float
    planet: float
    planet_spin: float
    sun_on_carrier: float
    ring_on_carrier: float
    mesh: float
    planet_pass: float


@dataclass(frozen=True, slots=True)
class CarrierLine:
    """A line of the mesh as a sensor on the ring hears it.

    Parameters
    ----------
    order : float
        In multiples of the reference shaft's speed.
    offset : int
        Turns of the carrier against the ring from the mesh harmonic.
    weight : float
        Part of the planets' amplitudes that adds up, 0 to 1.
    """

    order: float
    offset: int
    weight: float


def planetary_orders(machine: Machine, stage: PlanetaryStage) -> PlanetaryOrders:
    """Orders of a stage of the machine."""
    scale = machine.shaft(getattr(stage, f"{stage.input_member}_shaft")).ratio
    speed = {member: scale * value for member, value in stage.member_ratios().items()}
    ring = abs(speed["ring"] - speed["carrier"])
    return PlanetaryOrders(
        carrier=abs(speed["carrier"]),
        sun=abs(speed["sun"]),
        ring=abs(speed["ring"]),
        planet=abs(speed["planet"] + speed["carrier"]),
        planet_spin=abs(speed["planet"]),
        sun_on_carrier=abs(speed["sun"] - speed["carrier"]),
        ring_on_carrier=ring,
        mesh=ring * stage.ring_teeth,
        planet_pass=ring * len(stage.planet_angles_rad),
    )


def mesh_phases(stage: PlanetaryStage) -> NDArray[np.float64]:
    """Phase of each planet's ring mesh against the first's, in pitches from 0 to below 1; shape (planets,).

    Z_r psi / 2 pi (Parker and Lin, J. Mech. Des. 126 (2004) 365-370), and the same at the sun. All nil: the
    planets mesh in phase; spread evenly: in sequence.
    """
    angles = np.asarray(stage.planet_angles_rad)
    turns = stage.ring_teeth * (angles - angles[0]) / (2 * math.pi)
    return np.asarray(np.mod(np.round(turns, 9), 1.0))  # rounded, so that nil is not 1 - 1e-16


def carrier_sidebands(
    machine: Machine, stage: PlanetaryStage, harmonic: int = 1, reach: int = 6
) -> tuple[CarrierLine, ...]:
    """Which lines around a mesh harmonic a sensor on the ring hears, and how much of the planets each unites.

    Parameters
    ----------
    machine : Machine
    stage : PlanetaryStage
    harmonic : int
    reach : int
        Lines on either side, each one turn of the carrier (against the ring) apart.

    Returns
    -------
    tuple of CarrierLine
        Ascending; `weight` is |sum exp(j (h Z_r + m) psi)| / N over the planets: 1, all add up; 0, they
        cancel. With N planets evenly spaced only multiples of N carrier orders are left (McFadden and Smith,
        Proc. Inst. Mech. Eng. C 199 (1985) 65-70), often not the mesh harmonic itself.
    """
    if harmonic < 1 or reach < 0:
        raise InputError("carrier_sidebands", "harmonic, reach", (harmonic, reach), "1 or more, 0 or more")
    unit = planetary_orders(machine, stage).ring_on_carrier
    turns = harmonic * stage.ring_teeth + np.arange(-reach, reach + 1)
    angles = np.asarray(stage.planet_angles_rad)
    weights = np.abs(np.exp(1j * np.outer(turns, angles)).sum(axis=1)) / angles.size
    return tuple(
        CarrierLine(float(t * unit), int(t - harmonic * stage.ring_teeth), float(round(w, 9)))
        for t, w in zip(turns, weights, strict=True)
        if t > 0
    )


def hunting_turns(stage: PlanetaryStage) -> dict[str, int]:
    """Turns of the carrier (against the ring) after which the same teeth meet again.

    "planet_ring": the same planet tooth at the same place of the ring; "sun_ring": the same sun tooth at a
    planet that is at the same place; "all": everything. A design is hunting where these are the numbers of
    the planet's and the sun's teeth: then every tooth passes every place.
    """
    planet = stage.planet_teeth // math.gcd(stage.planet_teeth, stage.ring_teeth)
    sun = stage.sun_teeth // math.gcd(stage.sun_teeth, stage.ring_teeth)
    return {"planet_ring": planet, "sun_ring": sun, "all": math.lcm(planet, sun)}


def ring_to_sun_turn(stage: PlanetaryStage) -> float:
    """Part of a planet's turn from a tooth's contact at the ring's pitch point to that at the sun's.

    Half a turn, less or more half a pitch, as its one flank meets the ring and the other the sun; less where
    the planets drive the sun in the carrier's plane (carrier drives, ring stands). The way back takes the
    rest, which tells the two apart in a train of a cracked tooth's impulses.
    """
    speed = stage.member_ratios()
    torque = -1.0 if stage.input_member == "carrier" else 1.0  # of the sun; that of the input is positive
    sun_drives = torque * (speed["sun"] - speed["carrier"]) > 0
    return 0.5 + (0.5 if sun_drives else -0.5) / stage.planet_teeth


def planet_families(machine: Machine) -> tuple[ToothFamily, ...]:
    """Fault families of all planetary stages: teeth of planets, sun and ring; wear, eccentricity."""
    families: list[ToothFamily] = []
    for stage in machine.planetary_stages:
        orders = planetary_orders(machine, stage)
        prefix = f"{stage.name}." if len(machine.planetary_stages) > 1 else ""
        families += _of_planets(stage, orders, prefix)
        families += _of_wheel(f"{prefix}sun", orders.sun_on_carrier, stage, orders, wander_order=orders.sun)
        families += _of_wheel(
            f"{prefix}ring", orders.ring_on_carrier, stage, orders, wander_order=orders.ring
        )
    return tuple(families)


def _of_planets(stage: PlanetaryStage, orders: PlanetaryOrders, prefix: str) -> Iterable[ToothFamily]:
    for number in range(1, len(stage.planet_angles_rad) + 1):
        for fault, times, label in (
            ("planet_tooth_crack", 2, "2 x planet spin"),
            ("planet_tooth_spall", 1, "planet spin"),
        ):
            yield ToothFamily(
                component=f"{prefix}planet_{number}",
                fault=fault,
                impulse_order=times * orders.planet_spin,
                modulation_order=orders.planet_spin,
                mesh_order=orders.mesh,
                wander_order=orders.carrier,
                per_carrier_turn=_per_carrier_turn(times * orders.planet_spin, orders),
                label=label,
            )


def _of_wheel(
    component: str, relative: float, stage: PlanetaryStage, orders: PlanetaryOrders, *, wander_order: float
) -> Iterable[ToothFamily]:
    """Faults of sun or ring: each tooth meets all planets once per turn against the carrier."""
    meets = relative * len(stage.planet_angles_rad)
    for fault in ("gear_tooth_crack", "gear_tooth_spall", "gear_wear", "gear_eccentricity"):
        impulses = meets if fault.startswith("gear_tooth") else 0.0
        yield ToothFamily(
            component=component,
            fault=fault,
            impulse_order=impulses,
            modulation_order=relative,
            mesh_order=orders.mesh,
            wander_order=wander_order,
            per_carrier_turn=_per_carrier_turn(impulses, orders),
            label=f"{component} tooth" if impulses else "mesh",
        )


def _per_carrier_turn(order: float, orders: PlanetaryOrders) -> float:
    """Per turn of the carrier against the ring, which is its turn where the ring stands."""
    return order / orders.ring_on_carrier
