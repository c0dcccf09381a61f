"""Excess kurtosis of a complex envelope: closed forms, and a test that is honest about its error."""

from __future__ import annotations

import numpy as np
import pytest

from gearsim_dsp.impulsiveness import FULL_MODULATION_KURTOSIS, impulsiveness
from gearsim_io.errors import InputError

N = 20_000


def noise(rng, bands=1):
    return (rng.standard_normal((bands, N)) + 1j * rng.standard_normal((bands, N))) / np.sqrt(2)


def modulated(rng, depth, bands=1):
    return (1 + depth * np.cos(2 * np.pi * 20 * np.arange(N) / N)) * noise(rng, bands)


def squared(z):
    return (np.abs(z) ** 2).astype(np.float32)


def test_closed_forms():
    rng = np.random.default_rng(0)
    tone = np.exp(1j * 0.3 * np.arange(N))[None, :]
    assert impulsiveness(squared(tone), 20).kurtosis[0] == pytest.approx(-1.0, abs=1e-5)
    rows = impulsiveness(squared(noise(rng, 40)), 20)
    assert abs(rows.kurtosis.mean()) < 4 * np.sqrt(4 / N / 40)
    rows = impulsiveness(squared(modulated(rng, 1.0, 40)), 20)
    assert rows.kurtosis.mean() == pytest.approx(FULL_MODULATION_KURTOSIS, abs=0.05)
    a = 1 + np.cos(np.linspace(0, 2 * np.pi, 100_000, endpoint=False))
    closed = 2 * np.mean(a**4) / np.mean(a**2) ** 2 - 2
    assert pytest.approx(closed, rel=1e-9) == FULL_MODULATION_KURTOSIS


def test_the_steady_kurtosis_lies_lower_and_its_error_is_what_repetitions_scatter():
    rng = np.random.default_rng(1)
    rows = impulsiveness(squared(modulated(rng, 1.0, 300)), 20)
    assert np.mean(rows.steady_kurtosis < rows.kurtosis) > 0.9
    assert np.mean(rows.steady_kurtosis) == pytest.approx(np.mean(rows.kurtosis), rel=0.15)
    assert np.mean(rows.standard_error) == pytest.approx(np.std(rows.steady_kurtosis), rel=0.35)


def test_false_alarms_at_the_limit_are_no_more_than_promised():
    rng = np.random.default_rng(2)
    p = np.concatenate([impulsiveness(squared(modulated(rng, 1.0, 150)), 20).p_value for _ in range(6)])
    for level in (0.1, 0.03, 0.01):
        allowed = level + 3 * np.sqrt(level / p.size)
        assert np.mean(p < level) <= allowed
    assert np.mean(p < 0.5) > 0.01  # safe, but not dead


@pytest.mark.parametrize("knocks", [1, 2, 3, 4])
def test_a_few_knocks_are_not_significant(knocks):
    rng = np.random.default_rng(3)
    signal = noise(rng)
    for start in rng.choice(N // 100, knocks, replace=False) * 100:
        signal[0, start : start + 60] += 12.0
    found = impulsiveness(squared(signal), 20)
    assert found.kurtosis[0] > 5 * FULL_MODULATION_KURTOSIS
    assert found.p_value[0] > 0.5


def test_a_train_of_impacts_is_significant():
    rng = np.random.default_rng(3)
    train = noise(rng)
    for start in range(100, N - 60, 200):
        train[0, start : start + 20] += 4.0 + 0.3 * rng.standard_normal()
    assert impulsiveness(squared(train), 20).p_value[0] < 1e-8


@pytest.mark.parametrize(("n", "blocks"), [(100, 20), (1000, 4)])
def test_too_few_samples_for_the_blocks_are_refused(n, blocks):
    with pytest.raises(InputError, match="blocks"):
        impulsiveness(np.ones((1, n)), blocks)
