"""Orders at which shafts, meshes and planets of a nameplate bring lines, the telling ones first."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from gearsim_dsp.gear_kinematics import gear_wheels
from gearsim_dsp.planet_kinematics import carrier_sidebands, planetary_orders
from gearsim_io.nameplate import Machine

__all__ = ["KnownOrder", "known_orders", "nearest_turn"]

_SHAFT_HARMONICS, _MANY_SHAFTS = 10, 2
_MESH_HARMONICS = 5
_LEAST_WEIGHT = 0.3
_CARRIER_REACH = 4


@dataclass(frozen=True, slots=True)
class KnownOrder:
    """A line: its order, what kind it is, its name, and its rank (least is most telling)."""

    order: float
    kind: str
    label: str
    rank: float


def known_orders(machine: Machine, top_order: float, apart: float) -> tuple[KnownOrder, ...]:
    """Lines up to `top_order`, of those closer than `apart` only the more telling, by rank."""
    found: list[KnownOrder] = []
    everything = [*_of_meshes(machine), *_of_stages(machine), *_of_shafts(machine)]
    for line in sorted(everything, key=lambda entry: (entry.rank, entry.order)):
        if not apart < line.order < top_order:
            continue
        if all(abs(line.order - other.order) >= apart for other in found):
            found.append(line)
    return tuple(found)


def _of_shafts(machine: Machine) -> Iterator[KnownOrder]:
    count = _SHAFT_HARMONICS if len(machine.shafts) <= _MANY_SHAFTS else _SHAFT_HARMONICS // 2
    for shaft in machine.shafts:
        for k in range(1, count + 1):
            rank = 1.0 if k <= 2 else 3.0 if k <= 5 else 5.0
            yield KnownOrder(k * shaft.ratio, "shaft", f"{k} x {shaft.name}", rank)
    reference = machine.shaft(machine.reference_shaft)
    for half in (0.5, 1.5, 2.5):
        yield KnownOrder(half * reference.ratio, "half", f"{half:g} x {reference.name}", 3.5)


def _of_meshes(machine: Machine) -> Iterator[KnownOrder]:
    for wheel in gear_wheels(machine):
        yield KnownOrder(0.5 * wheel.mesh_order, "half", f"0.5 x mesh {wheel.mesh}", 3.5)
        for k in range(1, _MESH_HARMONICS + 1):
            name = f"{k} x mesh {wheel.mesh}"
            yield KnownOrder(k * wheel.mesh_order, "mesh", name, 0.0 if k <= 3 else 2.5)
            for side in (-2, -1, 1, 2) if k <= 2 else (-1, 1) if k == 3 else ():
                rank = 2.0 if abs(side) == 1 and k <= 2 else 4.0
                order = k * wheel.mesh_order + side * wheel.turn_order
                yield KnownOrder(order, "sideband", f"{name} {side:+d} x {wheel.shaft}", rank)


def _of_stages(machine: Machine) -> Iterator[KnownOrder]:
    for stage in machine.planetary_stages:
        orders = planetary_orders(machine, stage)
        # A multiple of slower shafts, so that it is never told as a tone: misfits of models show there.
        yield KnownOrder(0.5 * orders.mesh, "half", f"0.5 x mesh {stage.name}", 1.8)
        yield KnownOrder(orders.planet_pass, "carrier", f"planet pass of {stage.name}", 1.5)
        for k in range(1, _MESH_HARMONICS + 1):
            name = f"{k} x mesh {stage.name}"
            yield KnownOrder(k * orders.mesh, "mesh", name, 0.0 if k <= 3 else 2.5)
            for line in carrier_sidebands(machine, stage, k, _CARRIER_REACH) if k <= 3 else ():
                # Lines that equal planets cancel tell that they are not equal.
                strong = line.weight >= _LEAST_WEIGHT
                rank = (1.2 if strong else 2.2) if k == 1 else (2.4 if strong else 4.5)
                yield KnownOrder(line.order, "carrier", f"{name} {line.offset:+d} x carrier", rank)
        yield KnownOrder(orders.planet_spin, "planet", f"planet spin of {stage.name}", 1.6)
        yield KnownOrder(2 * orders.planet_spin, "planet", f"2 x planet spin of {stage.name}", 1.7)


def nearest_turn(machine: Machine, order: float) -> float:
    """Distance of an order from the nearest multiple of any shaft's speed."""
    ratios = {shaft.ratio for shaft in machine.shafts} | {1.0}
    return min(abs(order - round(order / r) * r) for r in ratios)
