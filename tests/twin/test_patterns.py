"""What strange lines have in common: multiples, sidebands of others, the middle of a band that moves."""

from __future__ import annotations

import numpy as np
import pytest

from gearsim_twin.compare.windows import cut, spectra_of
from gearsim_twin.patterns import Lines, centre_of, family_of, lines_beside, spacing_of

RATE = 4096.0
STEP = 1.25


def strange(*at, known=()):
    """Lines of which those of `at` are strange; those of the machine are ten times as strong."""
    everything = np.array([*at, *known], dtype=float)
    order = np.argsort(everything)
    own = np.arange(everything.size) < len(at)
    return Lines(everything[order], np.where(own, 1.0, 10.0)[order], own[order], STEP)


def test_multiples_of_one_frequency_are_told_by_the_greatest_that_has_them():
    assert family_of(strange(105.3, 211.0, 316.9, 633.5, 487.0)) == pytest.approx(105.55, rel=2e-3)
    # The second and third multiple alone do not tell a family, nor do few of many lines.
    assert family_of(strange(211.0, 316.9)) is None
    assert family_of(strange(105.3, 211.0, 316.9)) == pytest.approx(105.5, rel=2e-3)


def test_sidebands_are_told_by_their_distance_from_lines_of_the_machine():
    carriers = (487.0, 568.5, 649.0, 811.0, 1138.0)
    assert spacing_of(strange(557.8, 579.2, 1127.4, known=carriers)) == pytest.approx(10.6, abs=0.2)
    assert spacing_of(strange(557.8, known=carriers)) is None
    # What is stronger than the line beside it is no sideband of that.
    weak = strange(557.8, 579.2, 1127.4, known=carriers)
    loud = Lines(weak.at, np.where(weak.strange, 100.0, 1.0), weak.strange, STEP)
    assert spacing_of(loud) is None


def test_strange_multiples_are_left_out_of_what_else_is_looked_for():
    lines = strange(105.3, 211.0, 557.8, known=(105.6, 568.5))
    left = lines.without(105.5)
    np.testing.assert_allclose(left.at, [105.6, 557.8, 568.5])
    assert left.strange.tolist() == [False, True, False]


def test_lines_anywhere_seldom_make_a_pattern():
    rng = np.random.default_rng(5)
    known = np.arange(1, 16) * 81.2
    found = []
    for _ in range(150):
        lines = strange(*rng.uniform(20.0, 1300.0, 5), known=known)
        found.append((family_of(lines) is not None, spacing_of(lines) is not None))
    # Each is told by chance in a twentieth; 150 draws know that to 0.018.
    assert np.all(np.mean(found, axis=0) < 0.1)


def spectra(x, length=4096):
    return spectra_of(cut(x, length), RATE / length)


def test_lines_that_the_model_has_are_not_strange():
    rng = np.random.default_rng(1)
    t = np.arange(16384) / RATE
    own = np.sin(2 * np.pi * 300.3 * t)
    real = spectra(own + 0.5 * np.sin(2 * np.pi * 411.0 * t) + 0.1 * rng.standard_normal(t.size))
    model = spectra(1.2 * own + 0.1 * rng.standard_normal(t.size))
    lines = lines_beside(real, model)
    np.testing.assert_allclose(lines.at, [300.3, 411.0], atol=0.1)
    assert lines.strange.tolist() == [False, True]


def test_the_middle_of_an_excess_is_told_and_whether_it_moves():
    rng = np.random.default_rng(2)
    count, t = 65536, np.arange(65536) / RATE
    phase = 2 * np.pi * np.cumsum(900.0 - 200.0 * t / t[-1]) / RATE
    low = np.convolve(rng.standard_normal(count), np.ones(64) / 8.0, "same")
    noise = 0.1 * rng.standard_normal(count)
    moving = spectra(low * np.cos(phase) + noise, 512)
    whole, first, last = centre_of(moving, spectra(0.1 * rng.standard_normal(count), 512), (500.0, 1200.0))
    assert whole == pytest.approx(800.0, abs=15.0)
    assert first == pytest.approx(867.0, abs=20.0)
    assert last == pytest.approx(733.0, abs=20.0)
    assert centre_of(moving, moving, (500.0, 510.0)) is None
