"""Synthetic vibration of random machines whose speed changes, with the true angle; no tacho.

Lines of shafts and meshes with random amplitudes and sidebands, a transfer path with a few resonances
(so amplitudes and phases change with the speed), coloured noise, sometimes supply lines.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from gearsim_io.nameplate import Channel, GearMesh, Machine, Shaft

PROFILES = ("constant", "ramp", "swing", "walk")


@dataclass(frozen=True)
class Case:
    """Signal, rate, nameplate, true angle in turns at every sample, and its speed."""

    x: NDArray[np.float64]
    rate_hz: float
    machine: Machine
    turns: NDArray[np.float64]

    @property
    def speed_hz(self) -> NDArray[np.float64]:
        return np.gradient(self.turns) * self.rate_hz


def random_case(
    rng: np.random.Generator,
    *,
    seconds: float | None = None,
    profile: str | None = None,
    level_db: float | None = None,
    known_speed: bool = True,
) -> Case:
    """A machine of one or two gear stages at 6 to 30 Hz; `level_db`: of its strongest line over the noise in
    one hertz."""
    rate = 8192.0
    length = seconds or rng.uniform(3.0, 8.0)
    true_hz = rng.uniform(8.0, 30.0)
    machine = random_machine(rng, true_hz, known_speed)
    turns = _turns(rng, profile or str(rng.choice(PROFILES)), true_hz, round(length * rate), rate)
    tones = _resonances(rng, _tones(rng, machine, turns, rate), rate)
    noise = lfilter([1.0], [1.0, -rng.uniform(0.0, 0.7)], rng.standard_normal(turns.size))
    level = level_db if level_db is not None else rng.uniform(-5.0, 40.0)
    gain = 10 ** (level / 20) * np.std(noise) / np.sqrt(rate / 2) / max(float(np.std(tones)), 1e-12)
    x = noise + gain * tones
    if rng.random() < 0.3:
        t = np.arange(x.size) / rate
        supply = sum(np.cos(2 * np.pi * 50.02 * k * t + k) / k for k in range(1, 6))
        x = x + 10 ** (rng.uniform(0, 25) / 20) * np.std(noise) / np.sqrt(rate / 2) * supply
    return Case(x, rate, machine, turns)


def random_machine(rng: np.random.Generator, true_hz: float, known_speed: bool = True) -> Machine:
    """One or two stages; the nameplate's speed is off by up to one tolerance and a half."""
    nominal = true_hz / (1 + rng.uniform(-0.03, 0.03)) if known_speed else float("nan")
    stages = rng.integers(1, 3)
    shafts, meshes = [Shaft("s0", 1.0, nominal)], []
    for k in range(stages):
        driving, driven = int(rng.integers(17, 60)), int(rng.integers(25, 100))
        ratio = shafts[-1].ratio * driving / driven
        shafts.append(Shaft(f"s{k + 1}", ratio, nominal * ratio))
        meshes.append(GearMesh(f"m{k}", f"s{k}", f"s{k + 1}", driving, driven))
    return Machine(
        "random", "", "s0", tuple(shafts), tuple(meshes), channels=(Channel("a"),), speed_tolerance=0.02
    )


def _turns(rng, profile, mean_hz, count, rate):
    t = np.linspace(0, 1, count)
    change = {
        "constant": np.zeros(count),
        "ramp": rng.uniform(-0.04, 0.04) * (t - 0.5),
        "swing": rng.uniform(0, 0.01) * np.sin(2 * np.pi * (rng.uniform(0.2, 2.0) * t + rng.random())),
        "walk": 0.015 * np.interp(t, np.linspace(0, 1, 6), np.cumsum(rng.normal(0, 0.4, 6))),
    }[profile]
    return np.cumsum(mean_hz * (1 + change)) / rate


def _tones(rng, machine, turns, rate):
    x = np.zeros(turns.size)
    mean = (turns[-1] - turns[0]) / turns.size * rate
    orders: list[tuple[float, float]] = []
    for shaft in machine.shafts:
        orders += [(k * shaft.ratio, rng.lognormal(-1.5, 1.0) / k) for k in range(1, 7)]
    for mesh in machine.gear_meshes:
        shaft = machine.shaft(mesh.driving_shaft)
        for k in range(1, 5):
            strength = rng.lognormal(0.0, 0.8) / k
            centre = k * mesh.driving_teeth * shaft.ratio
            orders.append((centre, strength))
            orders += [(centre + j * shaft.ratio, strength * rng.uniform(0, 0.3)) for j in (-2, -1, 1, 2)]
    for order, strength in orders:
        if 0 < order * mean * 1.1 < 0.45 * rate:
            x += strength * np.cos(2 * np.pi * (order * turns + rng.random()))
    return x


def _resonances(rng, x, rate):
    """The direct path and two modes of 3 % damping."""
    total = x.copy()
    for _ in range(2):
        w, damping = 2 * np.pi * rng.uniform(200, 3000) / rate, 0.03
        r = np.exp(-damping * w)
        total += (1 - r) * lfilter([2.0], [1.0, -2 * r * np.cos(w), r * r], x)
    return total
