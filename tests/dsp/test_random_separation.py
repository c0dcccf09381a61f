"""Discrete/random separation: openconmo's, lines in noise, impacts among gears, and a measured record."""

import numpy as np
import pytest
from bearing_signals import defect, noise, rotating_lines, turns_of

from gearsim_dsp.features import kurtosis
from gearsim_dsp.separation.random_separation import drs, separation_gain
from gearsim_io.errors import InputError

RATE = 24_000.0
N = 120_000


def test_equals_openconmo_where_it_is_right():
    """openconmo applies its filter without the delay and without centring it.

    Where all lines are periodic in a block and in the delay neither matters; its noise differs from ours by
    what two estimates of the gain differ, about 1 / sqrt(blocks) of the noise.
    """
    from openconmo.benchmark_methods import DRS as reference

    length, delay = 1024, 255  # openconmo's output leads by length + delay + 1 = 5 * 256
    t = np.arange(30_000)
    lines = 5 * np.cos(2 * np.pi * t / 256 * 20) + 3 * np.sin(2 * np.pi * t / 256 * 60)
    x = lines + 0.3 * noise(np.random.default_rng(0), t.size)
    theirs, _ = reference(x, length, delay)
    _, ours = drs(x, delay, length)
    inside = slice(2 * length, -2 * length)
    blocks = t.size / length
    assert np.std(theirs[inside] - ours[inside]) < 2 * 0.3 / np.sqrt(blocks)
    assert np.std(ours[inside]) < 1.1 * 0.3


def test_lines_at_any_frequency_go_to_the_deterministic_part():
    rng = np.random.default_rng(1)
    t = np.arange(N)
    lines = 10 * np.cos(0.31234 * t) + 4 * np.cos(1.2345 * t + 1) + 1.0 * np.cos(2.7 * t)
    rest = noise(rng, N, 0.5)
    deterministic, random = drs(lines + rest + 7.0, 200, 2048)
    np.testing.assert_allclose(deterministic + random, lines + rest + 7.0, atol=1e-12)
    blocks = N / 2048
    # Noise in the gain lets 1 / sqrt(2 blocks) of the noise pass; ends rest on one prediction, not two.
    for part in (slice(0, 5000), slice(N // 2, N // 2 + 5000), slice(N - 5000, N)):
        assert np.std(deterministic[part] - lines[part] - 7.0) < 2 / np.sqrt(blocks)
    assert abs(np.mean(random)) < 0.01


def test_the_gain_is_one_at_lines_and_small_elsewhere():
    x = 10 * np.cos(2 * np.pi * 100 / 1024 * np.arange(N)) + noise(np.random.default_rng(2), N)
    gain = np.abs(separation_gain(x, 100, 1024))
    assert np.max(gain) <= 1.0 + 1e-12
    assert gain[100] > 0.995
    away = np.delete(gain, np.arange(97, 104))
    # Hann blocks half over each other count as 1.9 / 2 of a block each: mean square 1 / independent blocks.
    assert np.sqrt(np.mean(away**2)) == pytest.approx(1 / np.sqrt(2 * N / 1024 * 0.95), rel=0.2)


def test_gears_go_and_slipping_impacts_stay():
    rng = np.random.default_rng(3)
    turns = turns_of(25.0, 5.0, RATE)
    ball = defect(rng, turns, RATE, 3.245, resonance_hz=5000.0, damping=0.04)
    mesh = rotating_lines(turns, {k * 19.0 + s: 5.0 / k for k in (1, 2, 3) for s in (-1, 0, 1)})
    deterministic, random = drs(mesh + ball.x, 500, 4096)
    assert np.std(random - ball.x) < 0.25 * np.std(ball.x)
    assert np.std(deterministic - mesh) < 0.03 * np.std(mesh)
    assert kurtosis(random) > 0.8 * kurtosis(ball.x)


def test_a_memory_longer_than_the_delay_is_taken_for_a_line():
    """Ringing over thousands of samples: with a short delay the gain sees it, with a long one it does not."""
    from scipy.signal import lfilter

    ringing = lfilter([1.0], [1.0, -2 * 0.9995 * np.cos(0.5), 0.9995**2], noise(np.random.default_rng(4), N))
    ringing /= np.std(ringing)
    short, _ = drs(ringing, 0, 512)
    long, _ = drs(ringing, 16_000, 512)
    assert np.std(short) > 0.5
    assert np.std(long) < 0.35


def test_short_and_unfit_signals_are_refused():
    with pytest.raises(InputError, match="at least 6096 samples"):
        drs(np.zeros(6000), 500, 1024)
    with pytest.raises(InputError, match="length"):
        drs(np.zeros(6000), 10, 8)
    with pytest.raises(InputError, match="delay"):
        drs(np.zeros(6000), -1, 64)


def test_the_shortest_signal_allowed_and_an_odd_length():
    x = noise(np.random.default_rng(5), 4 * (64 + 11))
    deterministic, random = drs(x, 11, 63)
    assert deterministic.shape == random.shape == x.shape
    np.testing.assert_allclose(deterministic + random, x)


@pytest.mark.records
def test_gear_lines_of_a_measured_record_go(record_file):
    """Gear0: the mesh of 23 teeth at 33.3 Hz falls by 20 dB, the noise between lines by less than 1 dB."""
    from gearsim_io.importers import import_file

    record = import_file(record_file("gear0/3027_217_Data_Chan12.mat"), "gear0")
    x, rate = record.data[0].astype(np.float64), record.sample_rate_hz
    _, random = drs(x, 500, 8192)

    def spectrum(signal):
        blocks = signal[: signal.size // 16384 * 16384].reshape(-1, 16384) * np.hanning(16384)
        return np.mean(np.abs(np.fft.rfft(blocks, axis=1)) ** 2, axis=0)

    before, after = spectrum(x), spectrum(random)
    low, high = (int(f / rate * 16384) for f in (740.0, 790.0))
    mesh = low + int(np.argmax(before[low:high]))
    assert before[mesh] / after[mesh] > 100
    assert np.median(before / after) < 10**0.1
