"""How the faults of random cases are drawn, and what a right diagnosis says of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Set
from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = ["FAULTS", "DrawnFault", "Truth"]

Content = dict[str, Any]


@dataclass(frozen=True)
class Truth:
    """A component and a fault word of the contract; `side` is the flank of a planet's spall."""

    component: str
    fault: str
    side: str = ""
    size_mm: float = math.nan


Drawn = tuple[list[Content], Truth, float]


@dataclass(frozen=True)
class DrawnFault:
    """A kind of fault: its model, and how one is drawn (machine, components taken, "any" or "thesis")."""

    planetary: bool
    draw: Callable[[np.random.Generator, Content, Set[str], str], Drawn]


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _bearing(fault: str) -> DrawnFault:
    def draw(rng: np.random.Generator, machine: Content, taken: Set[str], sizes: str) -> Drawn:
        names = [name for name in machine["nameplate"]["bearings"] if name not in taken]
        name = names[int(rng.integers(len(names)))]
        width = 0.8 if sizes == "thesis" else _log_uniform(rng, 0.25, 2.0)
        params = {"width_m": f"{width!r} mm"}
        if fault == "inner_race":
            params["position_rad"] = f"{float(rng.uniform(0, 2 * math.pi))!r} rad"
        spec = {"kind": f"{fault}_spall", "component": name, "params": params}
        return [spec], Truth(name, fault, size_mm=width), width

    return DrawnFault(False, draw)


def _wheel(
    fault: str, sizes_of: Callable[[np.random.Generator, str], tuple[dict[str, Any], float]]
) -> DrawnFault:
    def draw(rng: np.random.Generator, machine: Content, taken: Set[str], sizes: str) -> Drawn:  # noqa: ARG001
        wheel = ("pinion", "gear")[int(rng.integers(2))]
        mesh = machine["nameplate"]["gear_meshes"]["gears"]
        teeth = int(mesh["driving_teeth" if wheel == "pinion" else "driven_teeth"]["value"])
        params, size = sizes_of(rng, sizes)
        if fault in ("gear_tooth_crack", "gear_tooth_spall"):
            params["tooth"] = int(rng.integers(1, teeth + 1))
        name = f"gears.{wheel}"
        return [{"kind": fault, "component": name, "params": params}], Truth(name, fault), size

    return DrawnFault(False, draw)


def _crack_size(rng: np.random.Generator, sizes: str) -> tuple[dict[str, Any], float]:
    """Shares of the default depth, which is to the middle of the tooth."""
    del sizes
    angle = float(rng.uniform(35.0, 55.0))
    return {"angle_rad": f"{angle!r} deg"}, angle


def _spall_size(rng: np.random.Generator, sizes: str) -> tuple[dict[str, Any], float]:
    width = 1.0 if sizes == "thesis" else _log_uniform(rng, 0.4, 1.6)
    return {"width_m": f"{width!r} mm", "depth_m": "0.1 mm"}, width


def _wear_size(rng: np.random.Generator, sizes: str) -> tuple[dict[str, Any], float]:
    del sizes
    depth = _log_uniform(rng, 8.0, 50.0)
    return {"depth_m": f"{depth!r} um", "scatter": 0.15}, depth


def _eccentric_size(rng: np.random.Generator, sizes: str) -> tuple[dict[str, Any], float]:
    """Up to what leaves the teeth of the smallest module drawn in mesh."""
    del sizes
    offset = _log_uniform(rng, 0.05, 0.2)
    return {"eccentricity_m": f"{offset!r} mm", "phase_rad": f"{float(rng.uniform(0, 6.28))!r} rad"}, offset


def _on_shaft(
    fault: str, kind: str, low: float, high: float, write: Callable[[float], Content]
) -> DrawnFault:
    def draw(rng: np.random.Generator, machine: Content, taken: Set[str], sizes: str) -> Drawn:  # noqa: ARG001
        shaft = ("input", "output")[int(rng.integers(2))]
        size = _log_uniform(rng, low, high)
        return [{"kind": kind, "component": shaft, "params": write(size)}], Truth(shaft, fault), size

    return DrawnFault(False, draw)


def _unbalance(rng: np.random.Generator, machine: Content, taken: Set[str], sizes: str) -> Drawn:  # noqa: ARG001
    """So large that the pedestals of about 1.5e7 N/m move by 1 to 15 mm/s RMS at the speed of the case."""
    shaft = ("input", "output")[int(rng.integers(2))]
    plate = machine["nameplate"]
    teeth = plate["gear_meshes"]["gears"]
    ratio = 1.0 if shaft == "input" else teeth["driving_teeth"]["value"] / teeth["driven_teeth"]["value"]
    omega = 2 * math.pi * ratio * float(plate["shafts"]["input"]["nominal_speed"]["value"])
    velocity = _log_uniform(rng, 1.0, 15.0)
    size = min(math.sqrt(2) * 1e-3 * velocity * 2 * 1.5e7 / omega**3, 9.9)
    spec = {"kind": "unbalance", "component": shaft, "params": {"unbalance_kg_m": f"{size!r} kg*m"}}
    return [spec], Truth(shaft, "unbalance"), velocity


def _loose(rng: np.random.Generator, machine: Content, taken: Set[str], sizes: str) -> Drawn:  # noqa: ARG001
    """A loose foot alone: it speaks only where what the gears do lifts it, so most cannot be heard."""
    number = int(rng.integers(1, 5))
    reduction = float(rng.uniform(0.5, 0.9))
    foot = {"kind": "looseness", "component": f"bearing_{number}", "params": {"reduction": reduction}}
    return [foot], Truth(f"bearing_{number}", "looseness"), reduction


def _planet_crack(rng: np.random.Generator, machine: Content, taken: Set[str], sizes: str) -> Drawn:  # noqa: ARG001
    """A slot, which is as soft pressed shut as pulled open, or a crack, which is not."""
    planet, teeth = _planet(rng, machine)
    closing = 1.0 if sizes == "thesis" else float(rng.uniform(0.5, 1.0))
    side = ("sun", "ring")[int(rng.integers(2))]
    params = {"opens_towards": side, "closing": closing, "tooth": int(rng.integers(1, teeth + 1))}
    spec = {"kind": "planet_tooth_crack", "component": planet, "params": params}
    return [spec], Truth(planet, "planet_tooth_crack"), closing


def _planet_spall(side: str) -> DrawnFault:
    def draw(rng: np.random.Generator, machine: Content, taken: Set[str], sizes: str) -> Drawn:  # noqa: ARG001
        planet, teeth = _planet(rng, machine)
        flank = side or ("sun", "ring")[int(rng.integers(2))]
        width = 1.0 if sizes == "thesis" else _log_uniform(rng, 0.5, 1.4)
        params = {"side": flank, "width_m": f"{width!r} mm", "tooth": int(rng.integers(1, teeth + 1))}
        spec = {"kind": "planet_tooth_spall", "component": planet, "params": params}
        return [spec], Truth(planet, "planet_tooth_spall", flank), width

    return DrawnFault(True, draw)


def _planet(rng: np.random.Generator, machine: Content) -> tuple[str, int]:
    teeth = machine["nameplate"]["planetary_stages"]["insert"]["planet_teeth"]["value"]
    return f"planet_{int(rng.integers(1, 4))}", int(teeth)


FAULTS: dict[str, DrawnFault] = {
    "outer_race": _bearing("outer_race"),
    "inner_race": _bearing("inner_race"),
    "rolling_element": _bearing("rolling_element"),
    "gear_tooth_crack": _wheel("gear_tooth_crack", _crack_size),
    "gear_tooth_spall": _wheel("gear_tooth_spall", _spall_size),
    "gear_wear": _wheel("gear_wear", _wear_size),
    "gear_eccentricity": _wheel("gear_eccentricity", _eccentric_size),
    "unbalance": DrawnFault(False, _unbalance),
    "misalignment": _on_shaft(
        "misalignment",
        "shaft_misalignment",
        0.03,
        0.19,
        lambda s: {"offset_m": f"{20 * s!r} mm", "angle_rad": f"{s!r} rad"},
    ),
    "looseness": DrawnFault(False, _loose),
    "planet_tooth_crack": DrawnFault(True, _planet_crack),
    "planet_tooth_spall": _planet_spall(""),
    "planet_tooth_spall_sun": _planet_spall("sun"),
    "planet_tooth_spall_ring": _planet_spall("ring"),
}
