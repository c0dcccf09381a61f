"""Mesh functions between nodes in time: how far they are off, and that nobody hears it."""

from dataclasses import replace

import numpy as np
import pytest

from gearsim_sim import stepper
from gearsim_sim.engine import Engine
from gearsim_sim.model.mesh_nodes import NODE_ROWS, between_nodes, node_order, node_stride
from gearsim_sim.model.periodic import sinusoid
from gearsim_sim.model.plants import make_plant
from gearsim_sim.params import load_parallel_params, load_planetary_params
from gearsim_sim.profile.profile import constant_profile

STEP_S = 1 / (4 * 65536)


@pytest.fixture(scope="module")
def plant():
    return make_plant(load_parallel_params(), 1)


def test_nodes_of_a_sine_leave_the_error_that_was_asked_for(plant):
    """One line of order 7: with as many nodes as it is said to need the cubic misses 1e-5 of it."""
    mesh = replace(plant.meshes[0], errors=(), stiffness=sinusoid(7, 2.0, 0.3), cycles=3.0, track=0)
    order = node_order(replace(plant, meshes=[mesh]))
    places = np.linspace(0, 1, 16, endpoint=False)
    nodes, work, errors = np.zeros((NODE_ROWS, 1)), np.zeros((5, 1)), []
    for node in range(40):
        ends = (node + np.array([0.0, 1.0])) / order
        for row, turns in ((0, ends[0]), (4, ends[1])):
            nodes[row, 0] = mesh.stiffness.value(3 * turns)
            nodes[row + 1, 0] = 3 * mesh.stiffness.slope(3 * turns) / order / 16
        for place in range(16):
            between_nodes(place, 16, 1.0, nodes, work)
            errors.append(work[0, 0] - mesh.stiffness.value(3 * (node + places[place]) / order))
    found = np.sqrt(np.mean(np.square(errors))) / np.sqrt(2)
    # x^4 / 384 is the most within an interval; its mean square is 0.8 of that, whose sine has its own.
    assert 0.5e-5 < found < 1e-5


def test_errors_and_their_rates_between_nodes():
    """Value and slope of the polynomial t^3 are exact at any place, in steps of 0.1 s."""
    nodes, work = np.zeros((NODE_ROWS, 2)), np.zeros((5, 2))
    nodes[6, 1], nodes[7, 1] = 64.0, 48.0  # at step 4; at step 0 all is zero
    for place in range(5):
        between_nodes(place, 4, 0.1, nodes, work)
        assert work[:3, 1] == pytest.approx([0.0, place**3, 10 * 3 * place**2])
        assert not np.any(work[:, 0])


def test_stride_follows_speed_and_course():
    def course(plant, speed_hz):
        return constant_profile(plant, STEP_S, speed_hz, 50.0).segment(0)

    plant = make_plant(load_parallel_params(), 1)
    order = node_order(plant)
    assert [node_stride(order, course(plant, speed)) for speed in (0.0, 10.0, 30.0)] == [4, 4, 2]
    limit = 1 / (order * STEP_S)
    assert [node_stride(order, course(plant, limit * part)) for part in (0.24, 0.26, 0.49, 0.51)] == [
        4,
        2,
        2,
        1,
    ]
    ramp = constant_profile(plant, STEP_S, 1.0, 50.0).changed(0, 2.0, None, 20.0).segment(0)
    assert not ramp.steady
    assert [ramp.length_steps, node_stride(order, ramp)] == [20, 2]  # at least eight nodes to a course


@pytest.mark.parametrize("load", [load_parallel_params, load_planetary_params])
def test_nobody_hears_the_nodes(load, monkeypatch):
    """Against look-ups at every step: accelerations differ by less than 1e-4, a tenth of what is promised.

    The functions themselves miss 1e-5 at most; resonances may lift what they miss by a few times.
    """
    sparse = Engine(load(), 1, 65536.0).advance(1500).accel
    monkeypatch.setattr(stepper, "node_stride", lambda *_: 1)
    dense = Engine(load(), 1, 65536.0).advance(1500).accel
    difference = np.sqrt(np.mean((sparse - dense) ** 2, axis=1) / np.mean(dense**2, axis=1))
    assert 0 < difference.max() < 1e-4
