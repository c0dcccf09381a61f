"""A planetary stage in a flexible casing: it holds the ring, and the bearings of sun shaft and carrier.

The stage is that of `planetary`, in the plane that turns with the carrier; the casing stands. So what joins
them turns: each support acts on the motion of its body against that of its master, seen from the carrier
(`carrier.TurningPair`). The turning of the ring about its axis is the same in both frames.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from gearsim_sim.model.assembly import Elements, LinearSystem, Vector
from gearsim_sim.model.carrier import TurningPair
from gearsim_sim.model.on_casing import Joint, on_casing
from gearsim_sim.model.planet_plant import make_planetary
from gearsim_sim.model.plant import Plant
from gearsim_sim.params.planetary_casing import PlanetaryCasingParams

# Bodies that stand in masters of the casing, and the ring's support against turning.
_BODIES = {"ring": "r", "sun": "s", "carrier": "c"}
_TURNED = "ring_rz"


@dataclass(frozen=True)
class _Place:
    """Where the stage stands in the casing: an interface that is to be, and its master's displacement."""

    name: str
    vector: Vector
    master: str
    direction: str
    stiffness: float = 0.0  # beyond what the stage has there
    damping: float = 0.0


def make_planetary_casing(params: PlanetaryCasingParams, seed: int) -> Plant:
    """Assemble the model; `seed` gives the gears their random errors."""
    ground = make_planetary(params.gearbox, seed)
    places = _places(params)
    first = len(ground.system.interface_names)
    joints = [
        Joint(number, one.master, one.direction, f"the {one.master}")
        for number, one in zip(count(first), places, strict=False)
    ]
    track = ground.track(params.gearbox.stage.carrier_shaft)
    turning = tuple(TurningPair(number, track) for number, one in enumerate(places) if one.direction == "ux")
    where = f"{params.where}: casing {params.casing.name}"
    standing = replace(ground, system=_with_places(ground.system, places))
    plant = on_casing(standing, params.casing, where, joints=joints, turning=turning, gravity=False)
    return replace(plant, sites={**plant.sites, **ground.sites})


def _places(params: PlanetaryCasingParams) -> list[_Place]:
    own = params.joints
    found = []
    for master, body in _BODIES.items():
        further = (own.carrier_stiffness_n_per_m, own.carrier_damping_ns_per_m)
        for axis in "xy":
            vector = {f"{axis}_{body}": 1.0}
            numbers = further if master == "carrier" else (0.0, 0.0)
            found.append(_Place(f"{master}_{axis}", vector, master, f"u{axis}", *numbers))
    return [*found, _Place(_TURNED, {"theta_r": 1.0}, "ring", "rz")]


def _with_places(system: LinearSystem, places: list[_Place]) -> LinearSystem:
    """The stage with these interfaces, and with what stands there beyond its own springs."""
    columns = np.array([system.direction(one.vector) for one in places]).T
    stiffness = np.array([one.stiffness for one in places])
    damping = np.array([one.damping for one in places])

    def more(of: Elements, values: np.ndarray) -> Elements:
        return Elements(np.hstack([of.directions, columns]), np.concatenate([of.values, values]))

    return replace(
        system,
        stiffness=system.stiffness + (columns * stiffness) @ columns.T,
        damping=system.damping + (columns * damping) @ columns.T,
        interface_names=(*system.interface_names, *(one.name for one in places)),
        interfaces=np.hstack([system.interfaces, columns]),
        springs=more(system.springs, stiffness),
        dampers=more(system.dampers, damping),
    )
