"""Where gear faults speak: turns of wheels, mesh orders, and what meets what how often.

A wheel of z teeth on a shaft of order f meshes at z f. One bad tooth gives an impulse per turn of its wheel
and modulates the mesh once per turn: sidebands f apart around every mesh harmonic (Randall, J. Mech. Des. 104
(1982) 259-267). Two teeth that met meet again after lcm(z1, z2) meshes: the hunting-tooth order, at which a
damage of one tooth on either wheel speaks. Planetary stages: `planet_kinematics`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gearsim_dsp.kinematics import mesh_orders
from gearsim_io.nameplate import Machine

__all__ = ["GearWheel", "ToothFamily", "gear_wheels", "hunting_orders", "wheel_families"]


@dataclass(frozen=True, slots=True)
class GearWheel:
    """A wheel on a shaft that does not wander.

    Parameters
    ----------
    component : str
        Mesh and wheel, such as "gears.pinion": the pinion is the wheel with fewer teeth, of two alike the
        driving one; the other is the "gear".
    mesh, shaft : str
        As on the nameplate.
    teeth : int
    turn_order : float
        Speed of its shaft over the reference shaft's.
    mesh_order : float
        Mesh order, in multiples of the reference shaft's speed.
    mate : str
        Component that it meshes with.
    """

    component: str
    mesh: str
    shaft: str
    teeth: int
    turn_order: float
    mesh_order: float
    mate: str


@dataclass(frozen=True, slots=True)
class ToothFamily:
    """What one fault of one gear brings, in multiples of the reference shaft's speed.

    Parameters
    ----------
    component : str
        Wheel, such as "gears.pinion", "sun" or "planet_1".
    fault : str
        Fault word of the diagnosis contract.
    impulse_order : float
        Impulses per turn of the reference shaft; 0 where the fault makes none (wear, eccentricity).
    modulation_order : float
        Spacing of the sidebands around mesh harmonics and of those around the harmonics of `impulse_order`:
        the speed of the wheel past its mesh.
    mesh_order : float
    wander_order : float
        Speed at which the place where the fault strikes goes round a sensor that stands: further sidebands;
        0 where that place stands.
    per_carrier_turn : float
        Impulses in one turn of the planet carrier against the ring; 0 where there is none.
    label : str
        For markers.
    """

    component: str
    fault: str
    impulse_order: float
    modulation_order: float
    mesh_order: float
    wander_order: float = 0.0
    per_carrier_turn: float = 0.0
    label: str = ""

    def sidebands(self, harmonic: int = 1, count: int = 3) -> tuple[float, ...]:
        """Orders of the sidebands around a mesh harmonic, `count` on either side, ascending."""
        centre = harmonic * self.mesh_order
        return tuple(centre + k * self.modulation_order for k in range(-count, count + 1) if k)


def gear_wheels(machine: Machine) -> tuple[GearWheel, ...]:
    """Both wheels of every gear mesh on the nameplate, pinion first.

    Raises
    ------
    InputError
        When teeth and shaft ratios contradict each other.
    """
    orders = mesh_orders(machine)
    wheels: list[GearWheel] = []
    for mesh in machine.gear_meshes:
        sides = [(mesh.driving_shaft, mesh.driving_teeth), (mesh.driven_shaft, mesh.driven_teeth)]
        sides.sort(key=lambda side: side[1])  # stable: of two alike the driving one stays first
        names = (f"{mesh.name}.pinion", f"{mesh.name}.gear")
        for (shaft, teeth), name, mate in zip(sides, names, names[::-1], strict=True):
            ratio = machine.shaft(shaft).ratio
            wheels.append(GearWheel(name, mesh.name, shaft, teeth, ratio, orders[mesh.name], mate))
    return tuple(wheels)


def wheel_families(machine: Machine) -> tuple[ToothFamily, ...]:
    """Fault families of all wheels: cracked tooth, spalled tooth, wear, eccentricity of each."""
    families: list[ToothFamily] = []
    for wheel in gear_wheels(machine):
        turn = f"{wheel.turn_order:.4g}x"
        for fault, impulses, label in (
            ("gear_tooth_crack", wheel.turn_order, turn),
            ("gear_tooth_spall", wheel.turn_order, turn),
            ("gear_wear", 0.0, "GMF"),
            ("gear_eccentricity", 0.0, f"GMF +- {turn}"),
        ):
            families.append(
                ToothFamily(wheel.component, fault, impulses, wheel.turn_order, wheel.mesh_order, label=label)
            )
    return tuple(families)


def hunting_orders(machine: Machine) -> dict[str, float]:
    """Hunting-tooth order of each mesh: how often the same two teeth meet per turn of the reference shaft."""
    orders = mesh_orders(machine)
    return {
        mesh.name: orders[mesh.name] / math.lcm(mesh.driving_teeth, mesh.driven_teeth)
        for mesh in machine.gear_meshes
    }
