"""Tacho and encoder edges against angles in closed form, solved with scipy's brentq."""

import itertools

import numpy as np
import pytest
from rig_double import RigDouble
from scipy.optimize import brentq

from gearsim_sim.sensors.edges import EdgeFinder


def _find(double, marks, samples, phase=0.0, cuts=(), far=0):
    """Edges of `samples` samples, in pieces; `far` adds whole turns, as after a long run."""
    finder = EdgeFinder(marks, phase)
    edges, first = [], None
    for start, stop in itertools.pairwise([0, *cuts, samples]):
        k = np.arange(start, stop + 1)
        angle = double.angle_turns(k)
        whole = np.floor(angle)
        edge, offsets = finder.find(
            whole.astype(np.int64) + far, angle - whole, double.speed(k) / double.rate_hz
        )
        if first is None:
            first = edge
        assert edge == first + sum(map(len, edges))
        assert np.all((offsets >= 0) & (offsets < stop - start))
        assert np.all(np.diff(offsets) > 0)
        edges.append(offsets + start)
    return first, np.concatenate(edges)


def _truth(double, marks, samples, phase=0.0):
    angle = double.angle_turns(np.arange(samples + 1))
    first = int(np.ceil((angle[0] - phase) * marks))
    last = int(np.ceil((angle[-1] - phase) * marks))
    exact = [
        brentq(lambda s, k=k: double.angle_turns(s) - phase - k / marks, -1e-9, samples + 1e-9, xtol=1e-9)
        for k in range(first, last)
    ]
    return first, np.array(exact)


@pytest.mark.parametrize("rate_hz", [65536.0, 16384.0, 51200.0])
@pytest.mark.parametrize(("marks", "phase"), [(1, 0.0), (1, 0.3), (900, 0.0)])
def test_edges_are_where_the_angle_says(rate_hz, marks, phase):
    double = RigDouble(rate_hz, start_turns=0.1234)
    samples = round(rate_hz / 2)
    first, edges = _find(double, marks, samples, phase)
    true_first, exact = _truth(double, marks, samples, phase)
    assert first == true_first
    assert edges.size == exact.size >= 4
    error_turns = np.abs(double.angle_turns(edges) - phase - (first + np.arange(edges.size)) / marks)
    assert error_turns.max() < 1e-9
    assert np.abs(edges - exact).max() * double.speed_hz / rate_hz < 1e-6  # the promise: 1e-6 turns
    assert np.abs(edges - exact).max() < 1e-3


def test_straight_lines_would_not_do():
    """The interpolation is worth its name: a straight line between samples errs far more at low rates."""
    double = RigDouble(4096.0)
    _, edges = _find(double, 900, 2048)
    k = np.arange(2049)
    linear = np.interp(np.arange(edges.size) / 900, double.angle_turns(k), k)
    exact = _truth(double, 900, 2048)[1]
    assert np.abs(edges - exact)[1:].max() < 0.05 * np.abs(linear - exact)[1:].max()


def test_an_edge_on_a_sample_is_found_once():
    turns = np.arange(11) / 4.0
    whole = np.floor(turns)
    speed = np.full(11, 0.25)
    finder = EdgeFinder(2)
    first, offsets = finder.find(whole[:7].astype(np.int64), (turns - whole)[:7], speed[:7])
    assert first == 0
    np.testing.assert_allclose(offsets, [0, 2, 4], atol=1e-12)
    again, offsets = finder.find(whole[6:].astype(np.int64), (turns - whole)[6:], speed[6:])
    assert again == 3
    np.testing.assert_allclose(offsets, [0, 2], atol=1e-12)


def test_several_edges_in_one_sample():
    finder = EdgeFinder(900)
    turns = np.array([0.0, 0.1])
    _, offsets = finder.find(np.zeros(2, dtype=np.int64), turns, np.full(2, 0.1))
    np.testing.assert_allclose(offsets, np.arange(90) / 90, atol=1e-12)


def test_a_shaft_that_swings_back_makes_no_new_edge():
    k = np.arange(2001)
    angle = 0.3 + 0.4 * np.sin(2 * np.pi * k / 1000)
    speed = 0.4 * 2 * np.pi / 1000 * np.cos(2 * np.pi * k / 1000)
    whole = np.floor(angle)
    first, offsets = EdgeFinder(10).find(whole.astype(np.int64), angle - whole, speed)
    assert first == 3
    assert offsets.size == 4  # 0.3, 0.4, 0.5, 0.6; 0.7 is only touched
    assert offsets[-1] < 250
    standing = EdgeFinder(10).find(np.zeros(5, dtype=np.int64), np.full(5, 0.05), np.zeros(5))
    assert standing[1].size == 0


def test_pieces_give_the_same_bits():
    double = RigDouble(16384.0)
    cuts = tuple(np.cumsum(np.random.default_rng(2).integers(1, 400, 30)))
    first, edges = _find(double, 900, 8192)
    first_cut, edges_cut = _find(double, 900, 8192, cuts=cuts)
    assert first == first_cut
    # In pieces the offsets count from another sample, so only rounding may differ.
    np.testing.assert_allclose(edges_cut, edges, rtol=0, atol=4e-12)


def test_days_do_not_blur_the_edges():
    double = RigDouble(16384.0)
    _, edges = _find(double, 900, 4096)
    first, late = _find(double, 900, 4096, far=10 * 86400 * 10)
    assert first == 900 * 10 * 86400 * 10
    np.testing.assert_array_equal(late, edges)
