"""Synthetic gearboxes for judges: tooth meshes, impulses of single teeth, shaft lines, all known exactly."""

from __future__ import annotations

import numpy as np

from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.speed import Phase, ShaftSpeed
from gearsim_io.nameplate import Bearing, Channel, GearMesh, Machine, PlanetaryStage, Shaft
from gearsim_io.record import PulseTrain

RATE_HZ = 16384.0


def gearbox(pinion=23, gear=37) -> Machine:
    ratio = pinion / gear
    return Machine(
        name="gearbox",
        description="",
        reference_shaft="input",
        shafts=(Shaft("input", 1.0, 20.0), Shaft("output", ratio, 20.0 * ratio)),
        gear_meshes=(GearMesh("gears", "input", "output", pinion, gear),),
        bearings=(
            Bearing("bearing_1", "input", 9, 8e-3, 39e-3, channels=("in_y", "in_x")),
            Bearing("bearing_2", "output", 9, 8e-3, 39e-3, channels=("out_y", "out_x")),
        ),
        channels=tuple(Channel(name) for name in ("in_y", "in_x", "out_y", "out_x")),
        tacho_shafts=("input",),
    )


def planetary() -> Machine:
    stage = PlanetaryStage(
        "insert", "carrier", "output", "", "planet", "carrier", 40, 80, 20, (0.0, 2.1, 4.2)
    )
    return Machine(
        name="planetary",
        description="",
        reference_shaft="carrier",
        shafts=(Shaft("carrier", 1.0, 3.0), Shaft("output", 3.0, 9.0), Shaft("planet", 4.0, 12.0)),
        planetary_stages=(stage,),
        channels=(Channel("ring"),),
        tacho_shafts=("carrier",),
    )


def steady(speed_hz, seconds) -> ShaftSpeed:
    samples = np.array([0.0, seconds * RATE_HZ - 1.0])
    phase = Phase(samples, samples * speed_hz / RATE_HZ)
    return ShaftSpeed(speed_hz, (speed_hz * 0.9999, speed_hz * 1.0001), "tacho", phase)


def turns(speed_hz, seconds):
    return np.arange(round(seconds * RATE_HZ)) * speed_hz / RATE_HZ


def mesh(angle, teeth, amplitudes=(3.0, 0.3, 0.2)):
    """Harmonics of a tooth mesh over the angle of the wheel in turns."""
    lines = (a * np.cos(2 * np.pi * (k * teeth * angle + 0.1 * k)) for k, a in enumerate(amplitudes, 1))
    return np.sum(list(lines), axis=0)


def ring_down(times_s, seconds, amplitude=1.0, frequency_hz=2500.0, decay_s=1e-3):
    """A decaying oscillation from each time on."""
    out = np.zeros(round(seconds * RATE_HZ))
    length = round(8 * decay_s * RATE_HZ)
    for one, size in zip(times_s, np.broadcast_to(amplitude, len(times_s)), strict=True):
        first = int(np.ceil(one * RATE_HZ))
        t = (first + np.arange(length)) / RATE_HZ - one
        stop = min(first + length, out.size)
        if first < out.size:
            wave = size * np.exp(-t / decay_s) * np.sin(2 * np.pi * frequency_hz * t)
            out[first:stop] += wave[: stop - first]
    return out


def measured(machine, channels, speed, encoders=None) -> Measured:
    return Measured(machine, RATE_HZ, "m/s^2", channels, speed, encoders or {})


def edges(shaft, speed_hz, seconds, lines=512, error=lambda turn: 0.0 * turn) -> PulseTrain:
    """Encoder edges of a shaft whose angle leads its mean by `error` turns."""
    ideal = np.arange(0, speed_hz * seconds, 1 / lines)
    times = (ideal - error(ideal)) / speed_hz
    return PulseTrain(shaft, float(lines), times * RATE_HZ)
