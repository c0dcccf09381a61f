"""Which lines tell the speed: harmonics of the shafts, and gear meshes with theirs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.kinematics import mesh_orders
from gearsim_dsp.planet_kinematics import planetary_orders
from gearsim_io.nameplate import Machine

__all__ = ["all_mesh_orders", "carrier_orders", "least_spacing", "tracked_orders"]

_SHAFT_HARMONICS = 8
_MESH_HARMONICS = 5
_SHAFT_WEIGHT = 0.5
_SIDEBANDS = 2


def all_mesh_orders(machine: Machine) -> tuple[float, ...]:
    """Mesh orders of all gear pairs and planetary stages, in multiples of the reference shaft's speed."""
    planets = [planetary_orders(machine, stage).mesh for stage in machine.planetary_stages]
    return (*mesh_orders(machine).values(), *planets)


def tracked_orders(machine: Machine) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Orders of the comb and their weights.

    Returns
    -------
    orders : ndarray of float64, shape (lines,)
        Harmonics 1 to 8 of each shaft, 1 to 5 of each mesh.
    weights : ndarray of float64, shape (lines,)
        1 / sqrt(k) for the k-th harmonic of a mesh, half of it for a shaft's. Falling weights break the tie
        between a speed and its fractions, which have all its lines among their higher harmonics.
    """
    found: dict[float, float] = {}
    for shaft in machine.shafts:
        for k in range(1, _SHAFT_HARMONICS + 1):
            _add(found, k * shaft.ratio, _SHAFT_WEIGHT / k**0.5)
    for mesh in all_mesh_orders(machine):
        for k in range(1, _MESH_HARMONICS + 1):
            _add(found, k * mesh, 1 / k**0.5)
    orders = np.array(sorted(found))
    return orders, np.array([found[order] for order in orders])


def _add(found: dict[float, float], order: float, weight: float) -> None:
    key = round(order, 9)
    found[key] = max(found.get(key, 0.0), weight)


def carrier_orders(machine: Machine, top: float) -> NDArray[np.float64]:
    """Orders up to `top` whose phases may tell the angle: the comb, all multiples of the reference shaft,
    and the meshes' sidebands at their shafts' speeds.
    """
    orders = {round(float(order), 9) for order in tracked_orders(machine)[0]}
    orders |= {float(k) for k in range(1, int(top) + 1)}
    for mesh in machine.gear_meshes:
        centre = mesh.driving_teeth * machine.shaft(mesh.driving_shaft).ratio
        for name in (mesh.driving_shaft, mesh.driven_shaft):
            ratio = machine.shaft(name).ratio
            for k in range(1, _MESH_HARMONICS + 1):
                for j in range(-_SIDEBANDS, _SIDEBANDS + 1):
                    orders.add(round(k * centre + j * ratio, 9))
    return np.array(sorted(order for order in orders if 0 < order <= top))


def least_spacing(machine: Machine) -> float:
    """Smallest distance of neighbouring lines: the slowest shaft's speed, in orders, at most 1."""
    return min(1.0, *(shaft.ratio for shaft in machine.shafts))
