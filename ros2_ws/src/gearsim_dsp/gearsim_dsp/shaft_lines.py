"""Families of lines that fall on those of a shaft, judged against the shaft's other lines.

The outer race of a bearing with twelve elements may be passed 4.995 times a turn: no record is long enough to
part its lines from the fifth, tenth, fifteenth harmonic of the shaft. What a shaft does by itself (runout,
a bad tooth, a coupling) has harmonics of all numbers, or of the low ones, but nothing on it strikes just five
times a turn. So the lines at multiples of five are measured against the shaft's lines between them: taken as
exponentially distributed like those of noise, their mean stands for the floor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.kinematics import FaultFamily
from gearsim_dsp.noise_floor import LineTail
from gearsim_dsp.planet_kinematics import planetary_orders
from gearsim_io.nameplate import Machine

__all__ = [
    "ShaftMultiple",
    "SpectrumView",
    "covering_multiple",
    "other_shafts",
    "over_shaft",
    "strongest_other_multiple",
]

_LEAST_NUMBER = 3
_COVERED = 0.4  # of a resolution: then not even the fourth harmonic is parted from the shaft's
_SLIPS_ONTO = 0.0025
_HARMONICS = 8


@dataclass(frozen=True, slots=True)
class ShaftMultiple:
    """The `number`-th multiple of a shaft's speed `shaft_order`, in multiples of the reference shaft's."""

    shaft: str
    shaft_order: float
    number: int


@dataclass(frozen=True, slots=True, eq=False)
class SpectrumView:
    """What lines stand for: over a floor, how improbable, in excess of it, and whether they may be used.

    `ratio` and `tail` have shape (bands, lines), with one more row for the mean of several bands; `excess`
    has shape (bands, lines) and `usable` shape (lines,).
    """

    ratio: NDArray[np.float64]
    tail: NDArray[np.float64]
    excess: NDArray[np.float64]
    usable: NDArray[np.bool_]


def covering_multiple(
    machine: Machine, family: FaultFamily, resolution: float, doubt: float
) -> ShaftMultiple | None:
    """The multiple of a shaft's speed that cannot be told from a family's fundamental, if there is one.

    Parameters
    ----------
    machine : Machine
    family : FaultFamily
    resolution : float
        Distance of independent lines, in orders.
    doubt : float
        Relative error of the speed; with much of it nothing can be said to coincide.

    Notes
    -----
    Multiples below three are left out: unbalance, misalignment and ovality speak there. So are multiples of
    the rate at which planets pass.
    """
    reach = _COVERED * resolution + _SLIPS_ONTO * family.order
    if doubt * family.order > _COVERED * resolution:
        return None
    passes = _planets_pass(machine)
    for shaft in machine.shafts:
        number = round(family.order / shaft.ratio)
        order = number * shaft.ratio
        if number < _LEAST_NUMBER or abs(order - family.order) > reach:
            continue
        if any(abs(order - max(1, round(order / each)) * each) <= reach for each in passes):
            continue
        return ShaftMultiple(shaft.name, shaft.ratio, number)
    return None


def other_shafts(machine: Machine, multiple: ShaftMultiple, resolution: float) -> list[float]:
    """Orders of the shafts of which the multiple is no multiple as well; their lines still do not count."""
    order = multiple.shaft_order * multiple.number
    return [
        shaft.ratio
        for shaft in machine.shafts
        if abs(order - round(order / shaft.ratio) * shaft.ratio) > _COVERED * resolution
    ]


def _planets_pass(machine: Machine) -> list[float]:
    """Orders at which planets pass a place on the ring, and one on the sun."""
    found = []
    for stage in machine.planetary_stages:
        orders = planetary_orders(machine, stage)
        found += [orders.planet_pass, orders.sun_on_carrier * len(stage.planet_angles_rad)]
    return [order for order in found if order > 0]


def over_shaft(
    view: SpectrumView,
    power: NDArray[np.float64],
    step: float,
    half_width: int,
    shaft_order: float,
    number: int,
    free_of_others: NDArray[np.bool_],
) -> SpectrumView:
    """The view in which lines at multiples of `number` count, with the shaft's lines between as their floor.

    Parameters
    ----------
    view : SpectrumView
        With the noise as floor, and no line of a shaft usable.
    power : ndarray, shape (bands, lines)
    step : float
        Distance of two lines on the axis.
    half_width : int
        Lines on either side that belong to a multiple.
    shaft_order : float
        Of the shaft, on the axis.
    number : int
    free_of_others : ndarray of bool, shape (lines,)
        False where another shaft has its lines.

    Returns
    -------
    SpectrumView
    """
    places, height = _heights(power, step, half_width, shaft_order)
    ratio, tail, excess = view.ratio.copy(), view.tail.copy(), view.excess.copy()
    usable = view.usable.copy()
    bands = power.shape[0]
    for k in range(1, (places.size - 1) // number + 1):
        near = [j for j in range((k - 1) * number + 1, (k + 1) * number) if j % number and j < places.size]
        floor = np.maximum(height[:, near].mean(axis=1, keepdims=True), 1e-300)
        # A neighbour half a line away is the shaft's own; these lines stand for the multiple, too.
        lines = slice(places[k * number] - half_width, places[k * number] + half_width + 1)
        ratio[:bands, lines] = power[:, lines] / floor
        excess[:, lines] = power[:, lines] - floor
        ratio[bands:, lines] = ratio[:bands, lines].mean(axis=0)
        tail[:, lines] = LineTail(1.0, float(len(near)))(ratio[:, lines])
        usable[lines] = free_of_others[lines]
    return SpectrumView(ratio, tail, excess, usable)


def strongest_other_multiple(
    excess: NDArray[np.float64], step: float, half_width: int, shaft_order: float, number: int
) -> float:
    """Modulation by the strongest comb at another multiple of the shaft, between half and twice the number.

    Parameters
    ----------
    excess : ndarray, shape (lines,)
        Power over the noise's floor in one band.
    step, half_width, shaft_order, number
        As for `over_shaft`.

    Returns
    -------
    float
        Mean square of its first eight lines but for those at multiples of `number`; 0 where there is none.
    """
    places, height = _heights(np.maximum(excess, 0.0)[None], step, half_width, shaft_order)
    best = 0.0
    for other in range((number + 1) // 2, 2 * number + 1):
        lines = [j for j in range(other, min(_HARMONICS * other + 1, places.size), other) if j % number]
        best = max(best, 2.0 * float(height[0, lines].sum())) if other != number else best
    return best


def _heights(
    power: NDArray[np.float64], step: float, half_width: int, shaft_order: float
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Line of every multiple of the shaft from 0 on, and the highest power next to it, per band."""
    top = int(((power.shape[1] - 1 - half_width) * step) / shaft_order)
    places = np.round(np.arange(top + 1) * shaft_order / step).astype(np.intp)
    height = np.zeros((power.shape[0], top + 1))
    for j in range(1, top + 1):
        height[:, j] = power[:, max(places[j] - half_width, 1) : places[j] + half_width + 1].max(axis=1)
    return places, height
