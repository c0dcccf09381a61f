"""Waviness of rolling elements: lobes over their spin; even ones lift both races apart."""

from __future__ import annotations

import numpy as np

from gearsim_sim.model.bearing_faults import SurfaceProfile
from gearsim_sim.model.faults.bearing_parts import Length, ball_number, balls_of, find_seat
from gearsim_sim.model.faults.kind import FaultKind, bearing_names
from gearsim_sim.model.faults.race_waviness import check_lobes
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.ring import Ring
from gearsim_sim.model.surface import ball_series, uniform_numbers, waviness_series
from gearsim_sim.params.fields import Count, Strict


class BallWavinessParams(Strict):
    """Lobes around rolling elements; their phases depend on the seed."""

    orders: tuple[Count, ...] = (2, 4, 6, 8)
    """Numbers of lobes per turn; odd ones are not felt."""
    amplitudes_m: tuple[Length, ...] = (0.3e-6, 0.15e-6, 0.1e-6, 0.07e-6)
    """Amplitude of each, of the radius."""
    row: Count = 1
    """Row of the element, from 1."""
    ball: Count | None = None
    """Element of the row, from 1; by default all of all rows, each in a phase of its own."""


def place(params: BallWavinessParams, component: str, plant: Plant, seed: int) -> tuple[SurfaceProfile, ...]:
    """One profile for each element, at a phase of its own."""
    index, seat = find_seat(plant, component)
    check_lobes(component, params.orders, params.amplitudes_m)
    balls_of(seat, params.row)  # is there such a row?
    if params.ball is None:
        balls = range(seat.law.ball_count)
    else:
        number = ball_number(seat, int(params.row), int(params.ball))
        balls = range(number, number + 1)
    draws = uniform_numbers(seed, f"{component}/ball_waviness", len(params.orders) + seat.law.ball_count)
    lobes = waviness_series(params.orders, params.amplitudes_m, 2 * np.pi * draws[: len(params.orders)])
    table = ball_series(lobes).table()
    phases = draws[len(params.orders) :]
    return tuple(
        # what stands out of a ball is not missing, but too much
        SurfaceProfile(index, ball, 1, Ring(seat.spin, 1.0), True, float(phases[ball]), 1.0, -table)
        for ball in balls
    )


KIND = FaultKind(
    name="ball_waviness",
    summary="lobes of one or all rolling elements; only even numbers of lobes are felt",
    params_model=BallWavinessParams,
    components=bearing_names,
    place=place,
    look_for="lines at even multiples of the BSF with sidebands at the FTF, without impulses",
)
