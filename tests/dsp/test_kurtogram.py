import numpy as np
import pytest
from scipy.signal import firwin

from gearsim_dsp.kurtogram import fast_kurtogram, largest_level
from gearsim_io.errors import InputError

N = 3 * 2**14
LEVELS = 6


@pytest.fixture(scope="module")
def impulsive():
    rng = np.random.default_rng(0)
    x = rng.standard_normal(N)
    ring = 8 * np.exp(-np.arange(200) / 20) * np.cos(2 * np.pi * 0.31 * np.arange(200))
    for k in range(0, N - 200, 700):
        x[k : k + 200] += ring
    return x


def _rows(kurtogram, columns):
    levels = sorted({node.level for node in kurtogram.nodes})
    rows = []
    for level in levels:
        row = np.array([node.kurtosis for node in kurtogram.nodes if node.level == level])
        rows.append(np.repeat(row, columns // row.size))
    return np.array(levels), np.maximum(np.array(rows), 0.0)


def test_equals_pysdkit(impulsive):
    from pysdkit.utils._kurtogram import fast_kurtogram as reference

    theirs, info = reference(impulsive, LEVELS, 1000.0)
    ours = fast_kurtogram(impulsive, 1000.0, LEVELS)
    levels, rows = _rows(ours, theirs.shape[1])
    np.testing.assert_allclose(levels, info["level_w"], atol=1e-12)
    np.testing.assert_allclose(rows, theirs, atol=1e-9)
    best = ours.strongest
    assert 0.5 * (best.low_hz + best.high_hz) == pytest.approx(info["fc"])
    assert best.width_hz == pytest.approx(info["bw"])


def test_equals_openconmo_but_for_its_centring_in_place(impulsive):
    """openconmo takes the mean out of a node's array before it decimates it further; hence the tolerance."""
    pytest.importorskip("matplotlib")
    from openconmo.kurtogram import fast_kurtogram as reference

    theirs, levels, _, centre, width = reference(impulsive.copy(), 1000.0, LEVELS)
    ours = fast_kurtogram(impulsive, 1000.0, LEVELS)
    axis, rows = _rows(ours, theirs.shape[1])
    np.testing.assert_allclose(axis, levels, atol=1e-12)
    np.testing.assert_allclose(rows, theirs, atol=1e-3)
    assert 0.5 * (ours.strongest.low_hz + ours.strongest.high_hz) == pytest.approx(centre)
    assert ours.strongest.width_hz == pytest.approx(width)


def test_single_precision_is_good_enough(impulsive):
    double = fast_kurtogram(impulsive, 1.0, LEVELS)
    single = fast_kurtogram(impulsive.astype(np.float32), 1.0, LEVELS)
    for a, b in zip(double.nodes, single.nodes, strict=True):
        assert b.kurtosis == pytest.approx(a.kurtosis, abs=2e-4)
        assert b.mean_square == pytest.approx(a.mean_square, rel=1e-4)


def test_power_of_white_noise_is_that_of_the_filters_taps():
    x = np.random.default_rng(1).standard_normal(N)
    kurtogram = fast_kurtogram(x, 1.0, 2)
    taps = firwin(17, 0.4)
    for node in kurtogram.nodes:
        if node.level == 1.0:
            assert node.mean_square == pytest.approx(np.sum(taps**2), rel=0.03)


def test_one_spike_moves_the_kurtosis_but_not_the_median_over_segments():
    x = np.random.default_rng(2).standard_normal(N)
    x[N // 3] += 300.0
    kurtogram = fast_kurtogram(x, 1.0, 4)
    assert kurtogram.strongest.kurtosis > 100
    assert max(node.segment_kurtosis for node in kurtogram.nodes) < 1.5


def test_length_need_not_be_a_power_of_two():
    x = np.random.default_rng(3).standard_normal(131_071)
    kurtogram = fast_kurtogram(x, 1.0, 5)
    assert 0.98 * x.size < kurtogram.samples <= x.size


@pytest.mark.parametrize("levels", [0, 9])
def test_too_deep_a_tree_is_refused(levels):
    assert largest_level(N) == 8
    with pytest.raises(InputError, match="levels"):
        fast_kurtogram(np.zeros(N), 1.0, levels)
