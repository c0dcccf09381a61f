"""What the bench measures is what it says: RK45's right-hand sides are those of the model."""

import numpy as np
import pytest

from gearsim_sim.bench import (
    PlainMachine,
    VectorisedGearbox,
    double_row_params,
    engine_real_time_factor,
    ensemble_real_time_factor,
    planetary_params,
    rest_state,
    rk45_real_time_factor,
)
from gearsim_sim.model.plant import Moment
from gearsim_sim.model.plants import make_plant
from gearsim_sim.params import load_parallel_params


@pytest.mark.parametrize(
    ("kind", "load"),
    [
        (PlainMachine, load_parallel_params),
        (VectorisedGearbox, load_parallel_params),
        (PlainMachine, planetary_params),
        (PlainMachine, double_row_params),
    ],
)
def test_numpy_right_hand_sides_equal_the_model(kind, load):
    plant = make_plant(load(), 1)
    size = len(plant.system.dof_names)
    state = rest_state(plant)
    state[:size] += np.random.default_rng(1).normal(size=size) * 1e-6
    found = kind(plant)(0.013, state)
    moment = Moment(0.5 + 10 * 0.013, 10.0)
    expected = plant.acceleration(state[:size], state[size:], moment, plant.known_inputs(50.0))
    inertia = np.diag(plant.system.mass)
    assert np.array_equal(found[:size], state[size:])
    # Tables interpolate to 1e-9 of the mesh forces, of which some meet at one wheel.
    forces = expected * inertia
    assert found[size:] * inertia == pytest.approx(forces, abs=4e-9 * np.abs(forces).max())


def test_double_row_bearings_have_24_balls_in_each_row():
    plant = make_plant(double_row_params(), 1)
    assert [seat.law.ball_count for seat in plant.bearings] == [48] * 4


def test_factors_follow_the_clock():
    ticks = iter(range(100))
    assert engine_real_time_factor(4, 0.25, 2, clock=lambda: next(ticks)) == 0.25
    ticks = iter(range(100))
    assert rk45_real_time_factor(1e-4, 1, clock=lambda: next(ticks)) == 1e-4
    ticks = iter(range(100))
    assert ensemble_real_time_factor(2, 0.125, 1, clock=lambda: next(ticks), own_matrices=False) == 0.25
