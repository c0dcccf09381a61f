"""What a machine's structure has beside the model's masses: added resonances and transfer paths.

Both are entered into the linear system for good, as the section `structure` of a scenario asks. A
resonance is a mass on a spring and a damper at a measuring site (as the resonator of a pedestal is); a
path is a mass between two sites, each joined to it by a spring and a damper. The fault kinds `resonance`
and `transfer_path` do the same with a severity (`side_oscillator`), and must agree with this.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gearsim_io.quantities import Si, Strict
from gearsim_sim.model.assembly import LinearSystem, Vector
from gearsim_sim.model.side_oscillator import SideOscillator

if TYPE_CHECKING:  # a scenario is read, and refused, without the bearings that a plant imports
    from gearsim_sim.model.plant import Plant

Array = NDArray[np.float64]


class AddedMass(Strict):
    """A mass that swings: its frequency where its ends are held, and its damping."""

    mass_kg: Annotated[float, Si("kg", gt=0, le=1000), Field(alias="mass")]
    """Mass that swings."""
    frequency_hz: Annotated[float, Si("Hz", gt=0, le=20000), Field(alias="frequency")]
    """Its natural frequency where its ends are held."""
    damping_ratio: Annotated[float, Si("", ge=0, lt=1)]
    """Its damping over the critical one."""

    def oscillator(self, where: tuple[Vector, ...]) -> SideOscillator:
        """On these directions."""
        return SideOscillator(where, self.mass_kg, self.frequency_hz, self.damping_ratio)


class ResonanceModel(AddedMass):
    """A mass on a measuring site."""

    site: str
    """Measuring site that it hangs on."""


class PathModel(AddedMass):
    """A mass between two measuring sites; below its frequency a spring of m w^2 / 4."""

    from_site: Annotated[str, Field(alias="from")]
    """Measuring site where the path begins."""
    to: str
    """Measuring site where it ends."""


class StructureModel(Strict):
    """What the structure has beside the model's masses."""

    resonances: tuple[ResonanceModel, ...] = ()
    paths: tuple[PathModel, ...] = ()


def with_oscillators(system: LinearSystem, added: Mapping[str, SideOscillator]) -> LinearSystem:
    """The system with further masses; each key names the degree of freedom of one."""
    size, count = len(system.dof_names), len(added)
    mass, damping, stiffness = (np.zeros((size + count, size + count)) for _ in range(3))
    for matrix, own in ((mass, system.mass), (damping, system.damping), (stiffness, system.stiffness)):
        matrix[:size, :size] = own
    for number, one in enumerate(added.values()):
        mass[size + number, size + number] = one.mass_kg
        share = one.mass_kg / len(one.directions)
        for direction in one.directions:
            vector = np.zeros(size + count)
            vector[:size] = -system.direction(direction)
            vector[size + number] = 1.0
            stiffness += share * one.omega**2 * np.outer(vector, vector)
            damping += share * 2 * one.damping_ratio * one.omega * np.outer(vector, vector)
    return replace(
        system,
        dof_names=(*system.dof_names, *added),
        mass=mass,
        damping=damping,
        stiffness=stiffness,
        interfaces=np.vstack([system.interfaces, np.zeros((count, system.interfaces.shape[1]))]),
        inputs=np.vstack([system.inputs, np.zeros((count, system.inputs.shape[1]))]),
    )


def hung(plant: Plant, added: Mapping[str, SideOscillator]) -> Plant:
    """The machine with further masses for good; each key names the degree of freedom of one.

    Springs to places of a flexible casing are what its bearings are: interfaces that the casing carries.
    """
    system = with_oscillators(plant.system, added)
    names = system.dof_names
    joined = joined_parts(plant.parts, {name: one.directions for name, one in added.items()})
    plant = replace(
        plant,
        system=system,
        parts=tuple(tuple(dof for dof in names if dof in part) for part in joined),
        rigid=np.concatenate([plant.rigid, np.zeros(len(added))]),
    )
    carrier = plant.carrier
    if carrier is None:
        return plant
    labels, columns, numbers = [], [], []
    for name, one in added.items():
        share = one.mass_kg / len(one.directions)
        for end, direction in enumerate(one.directions, 1):
            if carrier.carries(direction):
                labels.append(f"{name}_{end}")
                columns.append(system.direction({name: 1.0}) - system.direction(direction))
                numbers.append((share * one.omega**2, share * 2 * one.damping_ratio * one.omega))
    first, new = len(system.interface_names), np.array(columns).reshape(-1, len(names)).T
    values = np.array(numbers).reshape(-1, 2)
    return replace(
        plant,
        system=replace(
            system,
            interface_names=(*system.interface_names, *labels),
            interfaces=np.hstack([system.interfaces, new]),
        ),
        carrier=replace(
            carrier,
            interfaces=(*carrier.interfaces, *range(first, first + len(labels))),
            stiffness_n_per_m=np.concatenate([carrier.stiffness_n_per_m, values[:, 0]]),
            damping_ns_per_m=np.concatenate([carrier.damping_ns_per_m, values[:, 1]]),
        ),
    )


def joined_parts(
    parts: Sequence[tuple[str, ...]], added: Mapping[str, Sequence[Vector]]
) -> tuple[tuple[str, ...], ...]:
    """The independent parts when further degrees of freedom join some: each key hangs on its directions.

    One that hangs on none of them, but on a casing, goes with the last one.
    """
    groups = [list(part) for part in parts]
    for name, directions in added.items():
        touched = {dof for direction in directions for dof in direction}
        together = [group for group in groups if touched & set(group)] or groups[-1:]
        apart = [group for group in groups if group not in together]
        groups = [*apart, [dof for group in together for dof in group] + [name]]
    return tuple(tuple(group) for group in groups)
