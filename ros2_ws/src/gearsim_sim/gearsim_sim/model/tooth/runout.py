"""A gear that does not turn about its own axis: transmission error once per turn, and a modulated mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gearsim_sim.model.periodic import PeriodicSeries, sinusoid
from gearsim_sim.model.tooth.pair import GearPair
from gearsim_sim.model.tooth.stiffness import stiffness_series

# Change of the axes' distance for the derivative of the stiffness, over the module.
_STEP = 1e-3


def eccentricity_error(eccentricity_m: float, phase_rad: float) -> PeriodicSeries:
    """Offset along the line of action over the gear's turn [m]: e sin(2 pi u + phase)."""
    return sinusoid(1, eccentricity_m, phase_rad)


def eccentricity_stiffness(
    pair: GearPair, eccentricity_m: float, phase_rad: float, *, teeth: int, harmonics: int
) -> PeriodicSeries:
    """Deviation of the mesh stiffness [N/m] over the turn of an eccentric gear with this many teeth.

    The axes of the teeth are e sin(2 pi u + phase + 90 deg - a_w) further apart, which shortens the path of
    contact. To first order in e: the derivative of the mesh stiffness with respect to the distance, times
    this. The series has the orders n teeth - 1, n teeth, + 1.
    """
    step = _STEP * pair.pinion.module_m
    near, far = (
        stiffness_series(replace(pair, spread_m=pair.spread_m + sign * step), harmonics) for sign in (-1, 1)
    )
    slope = PeriodicSeries(
        (far.mean - near.mean) / (2 * step),
        far.orders,
        (far.cosine - near.cosine) / (2 * step),
        (far.sine - near.sine) / (2 * step),
    )
    across = phase_rad + np.pi / 2 - pair.pressure_angle_rad
    return modulated(slope, teeth, sinusoid(1, eccentricity_m, across))


def modulated(tooth_phase: PeriodicSeries, teeth: int, once: PeriodicSeries) -> PeriodicSeries:
    """Product of a function of the tooth phase and one of order 1, over the gear's turn."""
    carrier = (tooth_phase.cosine - 1j * tooth_phase.sine) / 2
    side = complex(once.cosine[0] - 1j * once.sine[0]) / 2
    at = tooth_phase.orders * teeth
    orders = np.concatenate([[1], at - 1, at + 1])
    spectrum = np.concatenate([[tooth_phase.mean * side], carrier * np.conj(side), carrier * side])
    return PeriodicSeries(0.0, orders, 2 * spectrum.real, -2 * spectrum.imag)
