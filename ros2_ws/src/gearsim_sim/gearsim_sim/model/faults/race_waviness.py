"""Waviness of a race: lobes around its whole turn."""

from __future__ import annotations

import numpy as np

from gearsim_io.errors import InputError
from gearsim_sim.model.bearing_faults import SurfaceProfile
from gearsim_sim.model.faults.bearing_parts import Length, Race, balls_of, find_seat, race_of
from gearsim_sim.model.faults.kind import FaultKind, bearing_names
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.surface import uniform_numbers, waviness_series
from gearsim_sim.params.fields import Count, Strict


class WavinessParams(Strict):
    """Lobes around a race; their phases depend on the seed."""

    race: Race = Race.INNER
    """The race that has them."""
    orders: tuple[Count, ...] = (2, 3, 5, 7, 11, 13)
    """Numbers of lobes per turn."""
    amplitudes_m: tuple[Length, ...] = (1e-6, 0.7e-6, 0.4e-6, 0.3e-6, 0.2e-6, 0.15e-6)
    """Amplitude of each."""
    row: Count | None = None
    """Row of elements, from 1; all rows by default."""


def place(params: WavinessParams, component: str, plant: Plant, seed: int) -> tuple[SurfaceProfile]:
    """The lobes as a profile over the whole turn of the race."""
    index, seat = find_seat(plant, component)
    check_lobes(component, params.orders, params.amplitudes_m)
    ring, _ = race_of(seat, params.race)
    first, balls = balls_of(seat, params.row)
    draws = uniform_numbers(seed, f"{component}/race_waviness/{params.race}", len(params.orders))
    series = waviness_series(params.orders, params.amplitudes_m, 2 * np.pi * draws)
    return (SurfaceProfile(index, first, balls, ring, False, 0.0, 1.0, series.table()),)


def check_lobes(component: str, orders: tuple[float, ...], amplitudes: tuple[float, ...]) -> None:
    """One amplitude for each number of lobes, at most a thousand of them."""
    if not orders or len(orders) != len(amplitudes):
        expected = f"one for each of the {len(orders)} orders" if orders else "at least one order"
        raise InputError(component, "amplitudes_m", list(amplitudes), expected)
    if max(orders) > 1000:
        raise InputError(component, "orders", max(orders), "1 to 1000 lobes; shorter waves are roughness")


KIND = FaultKind(
    name="race_waviness",
    summary="lobes of the inner or outer race of given numbers and amplitudes",
    params_model=WavinessParams,
    components=bearing_names,
    place=place,
    look_for="lines without impulses: with Z elements in a row, lobes of orders k Z - 1 and k Z + 1 "
    "press radially, at k BPFI -/+ the shaft's speed for the inner race, at k BPFO for the "
    "outer",
)
