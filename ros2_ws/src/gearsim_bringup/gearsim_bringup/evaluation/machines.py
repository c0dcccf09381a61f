"""Random machines: descriptions like the shipped ones with other teeth, bearings, masses and springs."""

from __future__ import annotations

import copy
import math
from functools import cache
from typing import Any

import numpy as np

from gearsim_io.machines import read_machine_file

__all__ = ["parallel_machine", "planetary_machine"]

Content = dict[str, Any]
_SOURCE = "drawn at random for the evaluation"
_MODULES_MM = (2.0, 2.5, 3.0, 4.0)
# Ring, planet and sun of stages with three equally spaced planets that can be assembled and do not undercut.
_STAGES = ((80, 20, 40), (83, 23, 37), (84, 24, 36), (75, 21, 33), (87, 24, 39), (90, 24, 42))


def parallel_machine(rng: np.random.Generator) -> Content:
    """A one-stage gearbox on four bearings, each of its own geometry.

    Parameters
    ----------
    rng : numpy.random.Generator

    Returns
    -------
    dict
        Content of a machine file for the model `lpm34`.
    """
    content = _copy_of("unsw_parallel", "evaluation_parallel")
    plate, model = content["nameplate"], content["model"]
    pinion = int(rng.integers(18, 46))
    gear = pinion if rng.random() < 0.2 else int(rng.integers(pinion, 71))
    module = float(rng.choice(_MODULES_MM))
    mesh = plate["gear_meshes"]["gears"]
    mesh["driving_teeth"], mesh["driven_teeth"] = _number(pinion, "1"), _number(gear, "1")
    plate["shafts"] = {"input": plate["shafts"]["input"], "output": {}}
    _set(model, "teeth.module", module, "mm")
    for part, teeth in (("pinion", pinion), ("gear", gear)):
        radius = 0.5e-3 * module * teeth * math.cos(math.radians(20))
        _set(model, f"{part}.base_radius", radius, "m")
        root = 0.5 * module * (teeth - 2.5)
        # The body's formula holds for root over bore radius between 1.4 and 7.
        _set(model, f"teeth.{part}_bore_radius", float(np.clip(15.0, root / 6.0, root / 1.6)), "mm")
        _scale(model, f"{part}.mass", rng, 0.3)
        _scale(model, f"{part}.inertia", rng, 0.3)
    _set(model, "mesh.mean_stiffness", float(rng.uniform(2.2e8, 4.5e8)), "N/m")
    _set(model, "mesh.contact_ratio", float(rng.uniform(1.5, 1.8)), "1")
    _set(model, "mesh.pair_stiffness_ratio", float(rng.uniform(1.4, 1.8)), "1")
    errors = {"runout": (10, 40), "profile": (4, 18), "pitch_rms": (0.05, 0.3), "surface_rms": (0.01, 0.05)}
    for name, (low, high) in errors.items():
        _set(model, f"gear_errors.{name}", float(rng.uniform(low, high)), "um")
    for name in ("stiffness", "damping", "mass"):
        _scale(model, f"pedestal.{name}", rng, 0.4)
    _set(model, "pedestal.resonator_frequency", float(rng.uniform(7.0, 13.0)), "kHz")
    _set(model, "pedestal.resonator_damping_ratio", float(rng.uniform(0.02, 0.08)), "1")
    _set(model, "ball_bearing.radial_clearance", float(rng.uniform(2.0, 8.0)), "um")
    for bearing in plate["bearings"].values():
        _draw_bearing(bearing, rng)
    return content


def planetary_machine(rng: np.random.Generator, own_teeth: bool = False) -> Content:
    """A planetary stage with fixed ring and three planets, for the model `planetary18`.

    Parameters
    ----------
    rng : numpy.random.Generator
    own_teeth : bool
        Keep the tooth numbers of the shipped machine, whose teeth do not hunt.
    """
    content = _copy_of("unsw_planetary", "evaluation_planetary")
    ring, planet, sun = _STAGES[0 if own_teeth else int(rng.integers(len(_STAGES)))]
    stage = content["nameplate"]["planetary_stages"]["insert"]
    for name, teeth in (("ring", ring), ("planet", planet), ("sun", sun)):
        stage[f"{name}_teeth"] = _number(teeth, "1")
    model = content["model"]
    _set(model, "teeth.ring_outer_radius", ring + 25.0, "mm")
    for name in ("planet_seat", "ring_support", "sun_support"):
        _scale(model, f"{name}.stiffness", rng, 0.4)
        _scale(model, f"{name}.damping", rng, 0.4)
    for name in ("carrier", "sun", "ring", "planet"):
        _scale(model, f"{name}.mass", rng, 0.25)
        _scale(model, f"{name}.inertia", rng, 0.25)
    _scale(model, "mesh.mean_stiffness", rng, 0.3)
    _set(model, "mesh.pair_stiffness_ratio", float(rng.uniform(1.4, 1.8)), "1")
    _set(model, "gear_errors.runout", float(rng.uniform(2.0, 8.0)), "um")
    _set(model, "gear_errors.profile", float(rng.uniform(0.5, 2.0)), "um")
    _set(model, "gear_errors.surface_rms", float(rng.uniform(0.01, 0.04)), "um")
    _set(model, "casing.included", float(rng.random() < 0.5), "1")
    return content


@cache
def _shipped(name: str) -> Content:
    return read_machine_file(name)[1]


def _copy_of(shipped: str, name: str) -> Content:
    """Without the section for importing files, which the evaluation does not need."""
    content: Content = copy.deepcopy(_shipped(shipped))
    content.pop("import", None)
    content["name"] = name
    return content


def _draw_bearing(bearing: Content, rng: np.random.Generator) -> None:
    """Eight to sixteen elements of 60 to 90 % of the diameter that fits."""
    count = int(rng.integers(8, 17))
    pitch = float(rng.uniform(30.0, 55.0))
    fits = min(pitch * math.sin(math.pi / count), 0.3 * pitch)
    bearing["rolling_elements"] = _number(count, "1")
    bearing["pitch_diameter"] = _number(pitch, "mm")
    bearing["element_diameter"] = _number(fits * float(rng.uniform(0.6, 0.9)), "mm")


def _number(value: float, unit: str) -> Content:
    return {"value": value, "unit": unit, "source": _SOURCE}


def _at(content: Content, dotted: str) -> tuple[Content, str]:
    *folders, last = dotted.split(".")
    for folder in folders:
        content = content[folder]
    return content, last


def _set(content: Content, dotted: str, value: float, unit: str) -> None:
    inner, last = _at(content, dotted)
    inner[last] = _number(value, unit)


def _scale(content: Content, dotted: str, rng: np.random.Generator, spread: float) -> None:
    """Times a factor between 1 / (1 + spread) and 1 + spread, evenly in its logarithm."""
    inner, last = _at(content, dotted)
    factor = math.exp(rng.uniform(-1.0, 1.0) * math.log1p(spread))
    inner[last] = _number(float(inner[last]["value"]) * factor, str(inner[last]["unit"]))
