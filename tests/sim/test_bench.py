"""What the bench measures is what it says: RK45's right-hand sides are those of the model."""

import numpy as np
import pytest

from gearsim_sim.bench import (
    PlainGearbox,
    VectorisedGearbox,
    engine_real_time_factor,
    rest_state,
    rk45_real_time_factor,
)
from gearsim_sim.model.plant import Moment
from gearsim_sim.model.plants import make_plant
from gearsim_sim.params import load_parallel_params


@pytest.mark.parametrize("kind", [PlainGearbox, VectorisedGearbox])
def test_numpy_right_hand_sides_equal_the_model(kind):
    gearbox = make_plant(load_parallel_params(), 1)
    state = rest_state(gearbox) + np.random.default_rng(1).normal(size=68) * 1e-6
    found = kind(gearbox)(0.013, state)
    moment = Moment(0.5 + 10 * 0.013, 10.0)
    expected = gearbox.acceleration(state[:34], state[34:], moment, gearbox.known_inputs(50.0))
    inertia = np.diag(gearbox.system.mass)
    assert np.array_equal(found[:34], state[34:])
    # Tables interpolate to 1e-9 of the mesh force.
    assert found[34:] * inertia == pytest.approx(expected * inertia, abs=1e-5)


def test_factors_follow_the_clock():
    ticks = iter(range(100))
    assert engine_real_time_factor(4, 0.25, 2, clock=lambda: next(ticks)) == 0.25
    ticks = iter(range(100))
    assert rk45_real_time_factor(1e-4, 1, clock=lambda: next(ticks)) == 1e-4
