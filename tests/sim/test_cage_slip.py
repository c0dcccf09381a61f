"""Random functions of the cage: bounded, smooth, seeded, of no memory."""

import numpy as np
import pytest

from gearsim_sim.model.cage_slip import jitter, jitter_key, knot_value, mean_slip


def test_jitter_is_bounded_smooth_and_continuous():
    key = jitter_key(3, "cage")
    position = np.arange(0, 2000, 0.01)
    values = np.array([jitter(key, p) for p in position])
    assert np.abs(values).max() < 1.0
    assert np.abs(values).max() > 0.97  # of 2000 even numbers the greatest is beyond 0.97 but for 1e-26
    slope, bend = np.diff(values) / 0.01, np.diff(values, 2) / 0.01**2
    assert np.abs(slope).max() <= 2 * 1.875  # the quintic's greatest slope times the greatest step
    assert np.abs(np.diff(bend)).max() < 2 * 60 * 0.01 * 1.1  # its third derivative is 60 at most


def test_jitter_hits_its_knots_and_repeats_nothing():
    key = jitter_key(3, "cage")
    assert jitter(key, 7.0) == knot_value(key, 7)
    assert jitter_key(3, "cage") == key != jitter_key(4, "cage") != jitter_key(3, "other")
    assert 0 <= key < 2**52
    values = [knot_value(key, knot) for knot in range(5000)]
    assert len(set(values)) == 5000


def test_knots_are_even_and_independent():
    """Mean 0, variance 1/3, no correlation of neighbours or of two keys, within 4 sigma of 20000 draws."""
    first, second = (np.array([knot_value(jitter_key(s, "x"), k) for k in range(20000)]) for s in (1, 2))
    assert abs(first.mean()) < 4 * np.sqrt(1 / 3 / 20000)
    assert first.var() == pytest.approx(1 / 3, abs=4 * np.sqrt(4 / 45 / 20000))
    for other in (np.roll(first, 1), second):
        assert abs(np.mean(first * other)) < 4 / 3 / np.sqrt(20000)


def test_splitmix_of_its_authors():
    """First numbers of splitmix64 from seed 1234567 (reference implementation of Vigna)."""
    published = [6457827717110365317, 3203168211198807973, 9817491932198370423]
    for knot, number in enumerate(published):
        assert knot_value(1234567, knot) == (number >> 11) * 2.0**-52 - 1.0


def test_slip_falls_with_the_load():
    assert mean_slip(0.02, 0.0, 100.0) == 0.02
    assert mean_slip(0.02, 100.0, 100.0) == pytest.approx(0.01)
    assert mean_slip(0.02, 1e9, 100.0) < 1e-8
