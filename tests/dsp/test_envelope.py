import numpy as np
import pytest
from bearing_signals import turns_of
from scipy.signal import butter, hilbert, sosfiltfilt

from gearsim_dsp.envelope import (
    envelope_spectrum,
    order_spectrum,
    squared_envelopes,
    suppress_lines,
    window_spectrum,
)
from gearsim_dsp.speed import Phase
from gearsim_io.errors import InputError

RATE = 20_000.0


def _envelopes(x, low=2000.0, width=2000.0, rate=RATE):
    return squared_envelopes(window_spectrum(x, rate), np.array([low]), width)


def test_a_tone_has_its_mean_square_as_envelope():
    t = np.arange(20_000) / RATE
    e = _envelopes(1.5 * np.sin(2 * np.pi * 3001.3 * t))
    assert np.mean(e.values) == pytest.approx(1.5**2 / 2, rel=1e-3)
    assert np.std(e.values) < 0.02 * np.mean(e.values)


def test_modulation_depth_reads_as_its_square_over_four():
    t = np.arange(40_000) / RATE
    depth, f = 0.6, 37.0
    x = np.sqrt(1 + depth * np.cos(2 * np.pi * f * t)) * np.sin(2 * np.pi * 3000.0 * t)
    power, step = envelope_spectrum(_envelopes(x))
    line = round(f / step)
    assert step * np.argmax(power[0, 20:]) + 20 * step == pytest.approx(f, abs=step)
    assert power[0, line - 1 : line + 2].max() == pytest.approx(depth**2 / 4, rel=0.02)


def test_envelope_agrees_with_band_pass_and_hilbert():
    """scipy's Butterworth and Hilbert give the same modulation of an amplitude-modulated noise band."""
    rng = np.random.default_rng(3)
    t = np.arange(100_000) / RATE
    x = rng.standard_normal(t.size) * (1 + 0.7 * np.cos(2 * np.pi * 53.0 * t))
    e = _envelopes(x)
    sos = butter(6, [2000.0, 4000.0], "bandpass", fs=RATE, output="sos")
    theirs = np.abs(hilbert(sosfiltfilt(sos, x))) ** 2 / 2
    at = (e.first + e.stride * np.arange(e.values.shape[1])).astype(int)
    # The Butterworth's edges are soft (6 dB down at the corners, run twice), so a little less power passes.
    assert np.corrcoef(e.values[0], theirs[at])[0, 1] > 0.9
    assert e.values.mean() == pytest.approx(theirs.mean(), rel=0.08)


def test_noise_has_the_floor_of_the_closed_form():
    """1.5 / (B T) at low frequency, falling as a triangle to zero at B."""
    rng = np.random.default_rng(4)
    width, total = 2000.0, []
    for _ in range(40):
        power, step = envelope_spectrum(_envelopes(rng.standard_normal(40_000)), padding=1)
        total.append(power[0])
    seconds = 0.92 * 2.0
    mean = np.mean(total, axis=0)
    low = mean[10:100].mean()
    middle = mean[round(1000 / step) - 50 : round(1000 / step) + 50].mean()
    assert low == pytest.approx(1.5 / (width * seconds), rel=0.05)
    assert middle == pytest.approx(0.5 * 1.5 / (width * seconds), rel=0.08)


def test_order_spectrum_follows_a_changing_speed():
    turns = turns_of(np.array([18.0, 22.0]), 2.0, RATE)
    x = np.sqrt(1 + 0.8 * np.cos(2 * np.pi * 4.89 * turns)) * np.sin(
        2 * np.pi * 3000 * np.arange(turns.size) / RATE
    )
    phase = Phase(np.arange(turns.size, dtype=float)[::50], turns[::50])
    step = 0.5 / 45
    power = order_spectrum(_envelopes(x), phase, 20.0, step)[0]
    line = round(4.89 / step)
    assert abs(int(np.argmax(power[10:])) + 10 - line) <= 1
    assert power[line - 1 : line + 2].max() == pytest.approx(0.8**2 / 4, rel=0.05)
    constant = Phase(np.array([0.0, turns.size - 1.0]), np.array([0.0, turns[-1]]))
    smeared = order_spectrum(_envelopes(x), constant, 20.0, step)[0]
    assert smeared[line - 3 : line + 4].max() < 0.25 * power[line - 1 : line + 2].max()


def test_window_longer_than_the_axis_is_refused():
    e = _envelopes(np.random.default_rng(0).standard_normal(20_000))
    phase = Phase(np.array([0.0, 19_999.0]), np.array([0.0, 50.0]))
    with pytest.raises(InputError, match="order_step"):
        order_spectrum(e, phase, 10.0, 1 / 20)


def test_lines_are_limited_and_noise_is_left_alone():
    rng = np.random.default_rng(5)
    t = np.arange(40_000) / RATE
    quiet = rng.standard_normal(t.size)
    loud = quiet + 30 * np.sin(2 * np.pi * 2500 * t) + 30 * np.sin(2 * np.pi * 2610 * t)
    plain = window_spectrum(quiet, RATE)
    limited = suppress_lines(plain)
    changed = np.mean(limited.lines != plain.lines)
    assert changed < 1e-3
    before, step = envelope_spectrum(_envelopes(loud))
    beat = round(110 / step)
    assert before[0, beat] > 0.2
    clean = suppress_lines(window_spectrum(loud, RATE))
    after, _ = envelope_spectrum(squared_envelopes(clean, np.array([2000.0]), 2000.0))
    assert after[0, beat] < 0.2 * before[0, beat]


@pytest.mark.parametrize(
    ("lows", "width"), [([0.0], 1000.0), ([9500.0], 1000.0), ([3000.0], 2.0), ([], 1000.0)]
)
def test_bands_outside_the_spectrum_are_refused(lows, width):
    spectrum = window_spectrum(np.random.default_rng(0).standard_normal(20_000), RATE)
    with pytest.raises(InputError):
        squared_envelopes(spectrum, np.array(lows), width)
