"""Effects of operation, structure and labels."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from blind.build import Build
from gearsim_sim.model.plant import MOTOR

Array = NDArray[np.float64]
_SITES = {"parallel": ("b1_y", "b3_y"), "bearing": ("pedestal_y",), "planetary": ("ring", "sun")}
_OTHERS = {"planetary": "unsw_planetary_hunting"}
_STRANGE_TEETH = (17, 19, 21, 23, 25, 27, 29, 37, 41)


def speed_offset(build: Build, size: float) -> None:
    """A machine that runs `size` faster or slower than its nameplate says, without a tacho."""
    sign = 1.0 if build.rng.random() < 0.5 else -1.0
    build.speed_factor = 1 + sign * size
    build.tacho_factor = 0.0
    build.hide("shaft_speed_offset", speed_hz=build.speed_hz)
    build.truths[-1]["stated_hz"] = build.rig.speed_hz


def speed_fluctuation(build: Build, size: float) -> None:
    """A speed that swings at random by the share `size` (rms)."""
    build.swing, build.swing_hz = size, build.log_uniform(0.7, 4.0)
    build.hide("speed_fluctuation", rms_relative=size, bandwidth_hz=build.swing_hz)


def load_fluctuation(build: Build, size: float) -> None:
    """A load that swings at random by the share `size` (rms)."""
    build.load_rms_nm, build.load_hz = size * build.rig.load_nm, build.log_uniform(1.0, 6.0)
    build.hide("load_fluctuation", rms_nm=build.load_rms_nm, bandwidth_hz=build.load_hz)


def casing_resonance(build: Build, size: float) -> None:
    """A mass of `size` kg that swings at a measuring site."""
    band = (300.0, 3000.0) if build.rig.name != "bearing" else (400.0, 3500.0)
    at, damping = build.log_uniform(*band), build.log_uniform(0.015, 0.05)
    site = build.pick(_SITES[build.rig.name])
    build.resonances.append({"mass": size, "frequency": at, "damping_ratio": damping, "site": site})
    build.hide("casing_resonance", (at,), frequency_hz=at, damping_ratio=damping, mass_kg=size)


def transfer_path(build: Build, size: float) -> None:
    """A springy mass of `size` kg between two measuring sites."""
    at, damping = build.log_uniform(500.0, 2500.0), build.log_uniform(0.03, 0.1)
    ends = ("b1_y", "b3_y") if build.rig.name == "parallel" else ("ring", "sun")
    path = {"mass": size, "frequency": at, "damping_ratio": damping, "from": ends[0], "to": ends[1]}
    build.paths.append(path)
    build.hide("transfer_path", (at,), frequency_hz=at, damping_ratio=damping, mass_kg=size)


def missing_stage(build: Build, size: float) -> None:
    """Another gear stage before the motor shaft: its mesh pulsates in the torque by the share `size`."""
    teeth = int(build.rng.choice(_STRANGE_TEETH))
    amplitude, second = size * build.rig.load_nm, float(build.rng.uniform(0.2, 0.8))
    begin = build.rng.uniform(0, 2 * math.pi, 2)

    def torque(seconds: Array, turns: Array, rng: np.random.Generator) -> Array:  # noqa: ARG001
        angle = 2 * math.pi * teeth * turns
        wave = np.cos(angle + begin[0]) + second * np.cos(2 * angle + begin[1])
        return np.asarray(amplitude * wave)

    build.forces.append(({"": float(MOTOR)}, torque))
    build.hide("missing_gear_stage", (teeth * build.speed_hz,), amplitude_nm=amplitude, second=second)


def mislabelled(build: Build, size: float) -> None:
    """A tacho with other pulses than stated, a run at another speed, or (largest size) another machine."""
    kind = build.pick(("tacho", "speed"))
    if size >= 3.0 and build.rig.name in _OTHERS:
        build.machine = _OTHERS[build.rig.name]
        build.hide("mislabelled_record")
    elif kind == "tacho":
        build.tacho_factor = float(round(size)) if size >= 2.0 else 2.0
        build.hide("mislabelled_record", speed_ratio=1 / build.tacho_factor)
    else:
        build.speed_factor = 1 / size ** (1 / 3) if build.rng.random() < 0.5 else size ** (1 / 3)
        build.hide("mislabelled_record", speed_ratio=build.speed_factor)
        build.truths[-1]["stated_hz"] = build.rig.speed_hz
