"""Effects in bearings, teeth and shafts: faults of the elements, at a size and in a place drawn at random."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blind.build import Build
from blind.draws import bounded_walk

Array = NDArray[np.float64]
_BEARINGS = {
    "parallel": ("bearing_1", "bearing_3"),
    "bearing": ("test_bearing",),
}
_WHEELS = {"parallel": ("gears.pinion", "gears.gear"), "planetary": ("sun", "ring")}
_DIAMETER_M = {"parallel": 7.12e-3, "bearing": 0.235 * 25.4e-3}


def _fault(
    name: str,
    kind: str,
    places: dict[str, tuple[str, ...]],
    key: str,
    told: str = "",
    **fixed: Any,
) -> Callable[[Build, float], None]:
    """An effect that is one fault with one number for its size."""

    def enter(build: Build, size: float) -> None:
        build.faults.append((kind, build.pick(places[build.rig.name]), {key: size, **fixed}))
        build.hide(name, **{told or key: size})

    return enter


def _phased(
    name: str, kind: str, places: dict[str, tuple[str, ...]], key: str
) -> Callable[[Build, float], None]:
    """The same with a phase, which a tacho of unknown place makes unknowable."""

    def enter(build: Build, size: float) -> None:
        phase = float(build.rng.uniform(-math.pi, math.pi))
        build.faults.append((kind, build.pick(places[build.rig.name]), {key: size, "phase_rad": phase}))
        build.hide(name, **{key: size})

    return enter


def cage_slip(build: Build, size: float) -> None:
    """A cage that lags by a share `size` and runs ahead and behind at random."""
    jitter_rad = build.log_uniform(0.003, 0.012)
    name = build.pick(_BEARINGS[build.rig.name])

    def lagging(rng: np.random.Generator) -> Callable[[Array], Array]:
        seed = int(rng.integers(1 << 32))
        reach = np.arange(-200.0, 200.0, 0.02)
        walk = bounded_walk(reach, 0.3, jitter_rad / (2 * math.pi), np.random.default_rng(seed))
        return lambda turns: size * turns + np.interp(turns, reach, walk)

    build.lags[name] = lagging
    build.hide("cage_slip", slip=size, jitter_rad=jitter_rad)


def bearing_geometry(build: Build, size: float) -> None:
    """Elements larger or smaller by the share `size`; the signal's frequencies follow."""
    name, sign = build.pick(_BEARINGS[build.rig.name]), build.pick(("-", "+"))
    change = size if sign == "+" else -size
    diameter = _DIAMETER_M[build.rig.name] * (1 + change)
    build.parameters[f"nameplate.bearings.{name}.element_diameter"] = f"{diameter:.9g} m"
    build.hide("bearing_geometry", diameter_ratio_change=change)


def wide_spall(build: Build, size: float) -> None:
    """A pit of a race with a floor; `size` is its depth."""
    name = build.pick(_BEARINGS[build.rig.name])
    length = build.rng.uniform(0.45, 1.0) * _DIAMETER_M[build.rig.name]
    race = build.pick(("outer", "inner"))
    build.faults.append(("wide_spall", name, {"length_m": length, "depth_m": size, "race": race}))
    build.hide("wide_spall", length_m=length, depth_m=size)


def tooth_pitch_error(build: Build, size: float) -> None:
    """One tooth out of its place."""
    wheel = build.pick(_WHEELS[build.rig.name])
    tooth = int(build.rng.integers(1, 30))
    build.faults.append(("tooth_pitch_error", wheel, {"error_m": size, "tooth": tooth}))
    build.hide("tooth_pitch_error", error_m=size)


def _tooth(name: str, kinds: dict[str, str], key: str) -> Callable[[Build, float], None]:
    def enter(build: Build, size: float) -> None:
        planets = build.rig.name == "planetary"
        places = ("planet_1", "planet_2", "planet_3") if planets else _WHEELS["parallel"]
        params: dict[str, Any] = {key: size, "tooth": int(build.rng.integers(1, 20))}
        if planets:
            params["side" if "spall" in name else "opens_towards"] = build.pick(("sun", "ring"))
        build.faults.append((kinds[build.rig.name], build.pick(places), params))
        build.hide(name, **{key: size})

    return enter


def misalignment(build: Build, size: float) -> None:
    """A coupling out of line by `size`, and by an angle in proportion."""
    angle = size * build.log_uniform(10.0, 40.0)
    direction = float(build.rng.uniform(-math.pi, math.pi))
    params = {"offset_m": size, "angle_rad": angle, "direction_rad": direction}
    build.faults.append(("shaft_misalignment", build.pick(("input", "output")), params))
    build.hide("misalignment", offset_m=size, angle_rad=angle)


def planet_position_error(build: Build, size: float) -> None:
    """The pin of a planet ahead of its place."""
    params = {"ahead_m": size}
    build.faults.append(("planet_position_error", build.pick(("planet_1", "planet_2", "planet_3")), params))
    build.hide("planet_position_error", ahead_m=size)


_PLANETS = {"planetary": ("planet_1", "planet_2", "planet_3")}
_KINDS = {"parallel": "gear_tooth_{}", "planetary": "planet_tooth_{}"}
outer = _fault("bearing_spall_outer", "outer_race_spall", _BEARINGS, "width_m")
inner = _fault("bearing_spall_inner", "inner_race_spall", _BEARINGS, "width_m")
ball = _fault("bearing_spall_ball", "rolling_element_spall", _BEARINGS, "width_m")
clearance = _fault("bearing_clearance", "bearing_clearance", _BEARINGS, "growth_m")
wear = _fault("tooth_wear", "gear_wear", _WHEELS, "depth_m")
looseness = _fault(
    "looseness",
    "looseness",
    {"parallel": ("bearing_1", "bearing_3"), "bearing": ("test_bearing",)},
    "reduction",
)
sharing = _fault("unequal_load_sharing", "unequal_load_sharing", _PLANETS, "excess")
runout = _phased("gear_runout", "gear_eccentricity", {**_WHEELS, "planetary": ("sun",)}, "eccentricity_m")
carrier = _phased("carrier_modulation", "gear_eccentricity", {"planetary": ("ring",)}, "eccentricity_m")
unbalance = _phased(
    "unbalance", "unbalance",
    {"parallel": ("input", "output"), "bearing": ("shaft",), "planetary": ("carrier", "output")},
    "unbalance_kg_m",
)  # fmt: skip
crack = _tooth("tooth_crack", {rig: kind.format("crack") for rig, kind in _KINDS.items()}, "depth_m")
spall = _tooth("tooth_spall", {rig: kind.format("spall") for rig, kind in _KINDS.items()}, "width_m")


def backlash(build: Build, size: float) -> None:
    """Teeth that can part, under so little load that they do."""
    build.faults.append(("gear_backlash", build.pick(("gears",)), {"backlash_m": size}))
    build.hide("backlash_contact_loss", backlash_m=size)
