"""Gear and shaft indicators of one window of one channel, by synchronous averages.

Shafts that turn at one speed share an average and cannot be told apart; their wheels share a name.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import resample_poly

from gearsim_dsp.features import rms
from gearsim_dsp.speed import Phase
from gearsim_dsp.synchronous.indicators import gear_indicators
from gearsim_dsp.synchronous.signals import difference_signal
from gearsim_dsp.synchronous.tsa import Average, shaft_average
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine

__all__ = ["LEAST_TURNS", "Place", "Wheels", "WheelsResult", "analyse_wheels", "places_of", "thinned"]

LEAST_TURNS = 8.0
"""Turns of a shaft below which its average says nothing: noise is then only 9 dB down."""

_MESH_HARMONICS = 16
_LEAST_RATE_HZ = 10_000.0
_OVERSAMPLING = 2.56
_SHAFT_ORDERS = (1, 2)


@dataclass(frozen=True, slots=True)
class Wheels:
    """Wheels that turn together: names such as "gears.pinion", and their different numbers of teeth."""

    names: tuple[str, ...]
    teeth: tuple[int, ...]

    @property
    def label(self) -> str:
        """Name for people and messages."""
        return " or ".join(self.names)


@dataclass(frozen=True, slots=True)
class Place:
    """All shafts of one speed: their names, their speed over the reference shaft's, and their wheels."""

    shafts: tuple[str, ...]
    ratio: float
    wheels: Wheels | None

    @property
    def label(self) -> str:
        """Name of the shafts."""
        return " or ".join(self.shafts)


@dataclass(frozen=True, slots=True)
class WheelsResult:
    """Indicators by name with unit, and where in the turn the difference signal is largest (0 to 1)."""

    values: dict[str, tuple[float, str]]
    peak_turn: float
    residual_variance: float
    envelope_variance: float


def places_of(machine: Machine) -> tuple[Place, ...]:
    """The shafts of a machine by speed, with what meshes in their turn.

    That is the wheels of ordinary meshes, and of a planetary stage with a standing ring the whole stage in
    the turn of its carrier, where as many teeth mesh as the ring has.
    """
    found: list[Place] = []
    for ratio in sorted({round(shaft.ratio, 9) for shaft in machine.shafts}):
        shafts = tuple(s.name for s in machine.shafts if round(s.ratio, 9) == ratio)
        names, teeth = [], []
        for mesh in machine.gear_meshes:
            small = mesh.driving_shaft if mesh.driving_teeth <= mesh.driven_teeth else mesh.driven_shaft
            for shaft, count in (
                (mesh.driving_shaft, mesh.driving_teeth),
                (mesh.driven_shaft, mesh.driven_teeth),
            ):
                if shaft in shafts:
                    names.append(f"{mesh.name}.{'pinion' if shaft == small else 'gear'}")
                    teeth.append(count)
        for stage in machine.planetary_stages:
            if stage.carrier_shaft in shafts and not stage.ring_shaft:
                names.append(stage.name)
                teeth.append(stage.ring_teeth)
        wheels = Wheels(tuple(names), tuple(sorted(set(teeth)))) if names else None
        found.append(Place(shafts, ratio, wheels))
    return tuple(found)


def thinned(
    samples: NDArray[np.float32], rate_hz: float, phase: Phase, machine: Machine, speed_hz: float
) -> tuple[NDArray[np.float64], Phase]:
    """Signal and angle at the lowest rate (over a power of two) that keeps sixteen harmonics of all meshes.

    The averages then cost a fraction; impulses of teeth are seen through these harmonics and their sidebands.
    """
    orders = [max(p.wheels.teeth) * p.ratio for p in places_of(machine) if p.wheels is not None]
    highest = max(orders, default=1.0)
    wanted = max(_OVERSAMPLING * _MESH_HARMONICS * highest * speed_hz, _LEAST_RATE_HZ)
    factor = 2 ** max(0, math.floor(math.log2(rate_hz / wanted)))
    x = np.asarray(samples, dtype=np.float64)
    if factor == 1:
        return x, phase
    return np.asarray(resample_poly(x, 1, factor)), Phase(phase.samples / factor, phase.turns)


def analyse_wheels(
    samples: NDArray[np.float64],
    phase: Phase,
    place: Place,
    unit: str,
    earlier: tuple[float, float] | None = None,
) -> WheelsResult:
    """All indicators of the shafts and wheels of one speed.

    Parameters
    ----------
    samples : ndarray of float64, shape (n,)
    phase : Phase
        Angle of the reference shaft over the samples.
    place : Place
    unit : str
        Of the samples.
    earlier : tuple of float, optional
        Variances of residual and envelope of the healthy machine, for NA4 and NB4.

    Raises
    ------
    InputError
        When the window holds fewer than `LEAST_TURNS` turns of these shafts.
    """
    turns = float(phase.turns[-1] - phase.turns[0]) * place.ratio
    if turns < LEAST_TURNS:
        raise InputError(
            f"shaft {place.label}", "turns in a window", f"{turns:.1f}", f"{LEAST_TURNS:g} or more"
        )
    average = shaft_average(samples, phase, ratio=place.ratio)
    _, amplitude = average.spectrum()
    values = {f"shaft_order_{n}": (float(amplitude[average.line(n)]), unit) for n in _SHAFT_ORDERS}
    if place.wheels is None:
        return WheelsResult(values, math.nan, math.nan, math.nan)
    return _with_wheels(average, amplitude, place.wheels, values, unit, earlier)


def _with_wheels(
    average: Average,
    amplitude: NDArray[np.float64],
    wheels: Wheels,
    values: dict[str, tuple[float, str]],
    unit: str,
    earlier: tuple[float, float] | None,
) -> WheelsResult:
    first, *others = wheels.teeth
    many = 50  # earlier records that the healthy variance stands for: one new record hardly moves their mean
    residual, envelope = ([v] * many for v in earlier) if earlier else ([], [])
    found = gear_indicators(
        average,
        first,
        other_mesh_orders=others,
        earlier_residual=residual,
        earlier_envelope=envelope,
    )
    top = (average.values.size - 1) // 2
    lines = {k for teeth in wheels.teeth for k in range(average.line(teeth), top + 1, average.line(teeth))}
    values |= {
        "mesh_level": (float(np.sqrt(0.5 * np.sum(amplitude[sorted(lines)] ** 2))), unit),
        "residual_rms": (math.sqrt(found.residual_variance), unit),
        "envelope_rms": (math.sqrt(found.envelope_variance), unit),
        "sideband_level": (found.sideband_level, "1"),
        "energy_ratio": (found.energy_ratio, "1"),
        "fm0": (found.fm0, "1"),
        "fm4": (found.fm4, "1"),
        "m6a": (found.m6a, "1"),
        "na4": (found.na4, "1"),
        "nb4": (found.nb4, "1"),
        "tsa_rms": (rms(average.values), unit),
    }
    difference = difference_signal(average, wheels.teeth, 1)
    peak = float(np.argmax(np.abs(difference))) / average.values.size
    return WheelsResult(values, peak, found.residual_variance, found.envelope_variance)
