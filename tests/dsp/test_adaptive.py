"""Self-adaptive noise cancellation: the rule written out, portions, theory of the line enhancer, a record."""

from itertools import pairwise

import numpy as np
import pytest
from bearing_signals import defect, noise, rotating_lines, turns_of

from gearsim_dsp.features import kurtosis
from gearsim_dsp.separation.adaptive import SelfAdaptiveCanceller, sanc
from gearsim_io.errors import InputError

RATE = 24_000.0


def plain(x, delay, length, step):
    weights, foretold = np.zeros(length), np.zeros(x.size)
    for n in range(x.size):
        past = np.array([x[n - delay - m] if n >= delay + m else 0.0 for m in range(length)])
        foretold[n] = weights @ past
        if past @ past > 0:
            weights += step * (x[n] - foretold[n]) * past / (past @ past)
    return foretold, weights


def test_equals_the_rule_written_out():
    x = np.cos(0.4 * np.arange(600)) + 0.3 * np.random.default_rng(0).standard_normal(600)
    canceller = SelfAdaptiveCanceller(7, 12, 0.1)
    deterministic, random = canceller.push(x)
    foretold, weights = plain(x, 7, 12, 0.1)
    np.testing.assert_allclose(deterministic, foretold, atol=1e-12)
    np.testing.assert_allclose(canceller.weights, weights, atol=1e-12)
    np.testing.assert_allclose(deterministic + random, x, atol=1e-15)


def test_portions_change_no_bit():
    x = np.random.default_rng(1).standard_normal(5000) + np.cos(0.2 * np.arange(5000))
    whole = SelfAdaptiveCanceller(20, 33).push(x)
    canceller = SelfAdaptiveCanceller(20, 33)
    cuts = [0, 1, 2, 40, 41, 1000, 1000, 4999, 5000]
    parts = [canceller.push(x[a:b]) for a, b in pairwise(cuts)]
    for k in range(2):
        assert np.array_equal(whole[k], np.concatenate([part[k] for part in parts]))


@pytest.mark.parametrize("amplitude", [0.1, 0.2, 0.5])
def test_a_line_passes_with_the_gain_of_theory(amplitude):
    """Zeidler et al.: g / (1 + g) with g = length A^2 / (4 v). The step is small enough for its own noise."""
    length, n = 200, 400_000
    t = np.arange(n)
    line = amplitude * np.cos(2 * np.pi * 0.1 * t)
    deterministic, _ = sanc(line + noise(np.random.default_rng(2), n), 5, length, step=0.002)
    half = slice(n // 2, n)
    gain = 2 * np.mean(deterministic[half] * line[half]) / amplitude**2
    g = length * amplitude**2 / 4
    assert gain == pytest.approx(g / (1 + g), abs=0.05)


def test_gears_go_and_slipping_impacts_stay():
    rng = np.random.default_rng(3)
    turns = turns_of(25.0, 5.0, RATE)
    ball = defect(rng, turns, RATE, 3.245, resonance_hz=5000.0, damping=0.04)
    mesh = rotating_lines(turns, {k * 19.0: 5.0 / k for k in (1, 2, 3)})
    _, random = sanc(mesh + ball.x, 500, 256, 0.01)
    assert np.std(random - ball.x) < 0.3 * np.std(ball.x)
    assert kurtosis(random) > 0.8 * kurtosis(ball.x)


def test_it_follows_a_speed_that_changes():
    """Mesh frequency up by 20 % within 10 s: what one filter for all (DRS) cannot do."""
    from gearsim_dsp.separation.random_separation import drs

    turns = turns_of(np.linspace(25.0, 30.0, 50), 10.0, RATE)
    mesh = rotating_lines(turns, {19.0: 5.0, 38.0: 3.0})
    x = mesh + noise(np.random.default_rng(4), turns.size)
    after = slice(turns.size // 2, turns.size)
    assert np.std(sanc(x, 50, 128, 0.02)[1][after]) < 1.3
    assert np.std(drs(x, 50, 4096)[1][after]) > 3.0


def test_the_mean_goes_with_the_lines_and_silence_is_fine():
    deterministic, random = sanc(np.full(500, 4.0), 10, 16)
    assert np.all(deterministic == 4.0)
    assert np.all(random == 0.0)


def test_what_does_not_fit_is_refused():
    with pytest.raises(InputError, match="step"):
        SelfAdaptiveCanceller(5, 16, 2.0)
    with pytest.raises(InputError, match="delay"):
        SelfAdaptiveCanceller(0, 16)
    with pytest.raises(InputError, match="at least 22 samples"):
        sanc(np.ones(20), 5, 16)
    with pytest.raises(InputError, match="not finite"):
        SelfAdaptiveCanceller(5, 16).push([np.nan])


@pytest.mark.records
def test_gear_lines_of_a_measured_record_go(record_file):
    """Gear0: the mesh at 766 Hz falls by 10 dB and more."""
    from gearsim_io.importers import import_file

    record = import_file(record_file("gear0/3027_217_Data_Chan12.mat"), "gear0")
    x, rate = record.data[0].astype(np.float64), record.sample_rate_hz
    _, random = sanc(x, 200, 512, 0.01)

    def mesh_power(signal):
        lines = np.abs(np.fft.rfft(signal * np.hanning(signal.size))) ** 2
        frequency = np.arange(lines.size) * rate / signal.size
        return lines[(frequency > 755) & (frequency < 775)].max()

    assert mesh_power(x) / mesh_power(random) > 10
