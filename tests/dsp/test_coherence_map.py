import tracemalloc

import numpy as np
import pytest
from bearing_signals import defect, noise, turns_of
from scipy import stats

from gearsim_dsp.angle.tacholess import track_speed
from gearsim_dsp.cyclic.averaging import averaged_coherence
from gearsim_dsp.cyclic.coherence import CoherenceMap
from gearsim_dsp.cyclic.correlation import cyclic_spectrum
from gearsim_dsp.cyclic.envelopes_of_coherence import enhanced_envelope_spectrum
from gearsim_dsp.speed import Phase
from gearsim_io.errors import InputError
from gearsim_io.importers import import_file
from gearsim_io.machines import load_machine

RATE = 8192.0


def test_one_window_is_the_record():
    x = np.random.default_rng(1).standard_normal(20_000)
    whole = cyclic_spectrum(x, RATE, 64.0, 100.0).coherence_map()
    one = averaged_coherence(x, RATE, 64.0, 100.0, x.size / RATE)
    np.testing.assert_array_equal(one.values, whole.values)
    assert (one.windows, one.first_bin, one.alpha_step) == (1.0, whole.first_bin, whole.alpha_step)
    assert whole.first_bin * whole.resolution_hz >= 100.0


def test_windows_of_noise_are_worth_what_is_told():
    """Mean, variance and tails of the mean over overlapping windows, and of its mean over carriers."""
    values, means = [], []
    for seed in range(12):
        x = np.random.default_rng(seed).standard_normal(round(8 * RATE))
        c = averaged_coherence(x, RATE, 64.0, 100.0, 2.0)
        values.append(c.values[c.bins(), 20::4].ravel())
        enhanced = enhanced_envelope_spectrum(c)
        means.append(enhanced.power[20:])
    g, e = np.concatenate(values), np.concatenate(means)
    assert 4.5 < c.windows < 7.0  # seven windows, half of each shared
    assert np.mean(g) * c.averages == pytest.approx(1.0, abs=0.02)
    # 1 / averages of variance is lost by |g| <= 1, which is a percent here
    assert np.mean(g) ** 2 / np.var(g) == pytest.approx(c.windows, rel=0.06)
    assert np.mean(e) ** 2 / np.var(e) == pytest.approx(enhanced.averages, rel=0.15)
    for p in (0.1, 0.01, 0.001):
        assert np.mean(g > c.threshold(p)) == pytest.approx(p, rel=0.25)


def test_the_threshold_of_one_window_is_the_quantile_of_its_law():
    law = CoherenceMap(np.zeros((4, 40)), 64.0, 0.1, "Hz", 85.0, 1)
    for p in (0.3, 1e-3, 1e-9):
        # |g|^2 of n independent lines is Beta(1, n - 1)
        assert law.threshold(p) == pytest.approx(stats.beta.isf(p, 1, 84), rel=1e-6)


def test_a_map_for_a_picture_keeps_what_stands_out():
    t = np.arange(round(8 * RATE)) / RATE
    rng = np.random.default_rng(9)
    x = rng.standard_normal(t.size) * np.sqrt(1 + 0.7 * np.cos(2 * np.pi * 41.3 * t))
    c = cyclic_spectrum(x, RATE, 64.0, 100.0).coherence_map()
    shown, step = c.for_picture(200)
    assert shown.shape == (c.values.shape[0], 200)
    there = np.mean(~np.isnan(shown[c.bins()]), axis=0)
    assert there[int(41.3 / step)] > 0.95
    quiet, _ = (
        cyclic_spectrum(rng.standard_normal(t.size), RATE, 64.0, 100.0).coherence_map().for_picture(200)
    )
    # 12,000 places: three standard errors
    assert np.mean(~np.isnan(quiet[c.bins(), 5:])) == pytest.approx(1e-3, abs=3 * np.sqrt(1e-3 / 12_000))
    with pytest.raises(InputError, match="columns"):
        c.for_picture(c.values.shape[1] + 1)


def test_windows_of_different_speed_share_the_axis_of_orders():
    turns = turns_of(np.array([18.0, 23.0]), 8.0, RATE)
    signal = defect(np.random.default_rng(5), turns, RATE, 4.89, slip=0.0, resonance_hz=2500.0)
    x = signal.x + noise(np.random.default_rng(6), turns.size)
    at = np.append(np.arange(0, turns.size - 1, 50), turns.size - 1)
    phase = Phase(at.astype(float), turns[at])
    c = averaged_coherence(x, RATE, 128.0, 15.0, 2.0, phase)
    assert c.alpha_unit == "order"
    comb = enhanced_envelope_spectrum(c).comb(4.9, 0.01)
    assert comb.found == pytest.approx(4.89, rel=1e-3)
    assert comb.false_alarm < 1e-6


def test_a_longer_record_takes_no_more_memory(tmp_path):
    """Four times the record, from a file that is mapped, with the same peak."""
    peaks = []
    for seconds in (8, 32):
        path = tmp_path / f"{seconds}.npy"
        np.save(
            path, np.random.default_rng(seconds).standard_normal(round(seconds * RATE)).astype(np.float32)
        )
        x = np.load(path, mmap_mode="r")
        averaged_coherence(x[: 2 * round(RATE)], RATE, 64.0, 100.0, 2.0)  # tables of the FFT are kept
        tracemalloc.start()
        averaged_coherence(x, RATE, 64.0, 100.0, 2.0)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.05 * peaks[0]


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda x, _: averaged_coherence(x, RATE, 64.0, 100.0, 9.0), "at most 1.099 s"),
        (lambda x, _: averaged_coherence(x, RATE, 64.0, 100.0, 0.1), "at least 0.188 s"),
        (
            lambda x, _: averaged_coherence(
                x, RATE, 64.0, 10.0, 0.5, Phase(np.array([0.0, 8000.0]), np.array([0.0, 9.0]))
            ),
            "the angle over all samples",
        ),
        (
            lambda x, _: cyclic_spectrum(
                x, RATE, 64.0, 5.0, Phase(np.array([0.0, 8999.0]), np.array([0.0, 9.0])), order_step=0.3
            ),
            "one over a whole number, at most 0.05556",
        ),
        (lambda _, c: c.bins((5000.0, 6000.0)), "a band inside"),
        (lambda _, c: c.threshold(0.0), "between 0 and 1"),
    ],
)
def test_wrong_input_is_told(call, word):
    x = np.random.default_rng(0).standard_normal(9000)
    c = cyclic_spectrum(x, RATE, 64.0, 100.0).coherence_map()
    assert c.bins((640.0, 1280.0)) == slice(10, 20)
    with pytest.raises(InputError, match=word):
        call(x, c)


@pytest.mark.records
def test_a_turbine_that_slows_is_sharp_over_orders_without_a_tacho(record_file):
    """4.2 % of speed lost in 4 s, the angle taken from the signal: harmonics of the shaft stay lines."""
    machine = load_machine("wt_hss")
    record = import_file(record_file("wt_hss_gear/health_20160306171241_25600.csv"), "wt_hss")
    x, rate = record.data[0].astype(np.float64), record.sample_rate_hz
    track = track_speed(x, rate, machine)
    band = (500.0, 0.43 * rate)
    orders = cyclic_spectrum(x, rate, 200.0, 4.5, track.phase).coherence_map()
    in_orders = enhanced_envelope_spectrum(orders, band)
    mean_hz = track.phase.turns[-1] / x.size * rate
    hz = cyclic_spectrum(x, rate, 200.0, 4.5 * mean_hz).coherence_map()
    in_hz = enhanced_envelope_spectrum(hz, band)
    for k in (1, 2, 3, 4):
        line = in_orders.line(float(k), 0.05)
        assert line.found == pytest.approx(k, abs=in_orders.step)
        assert line.false_alarm < 1e-9
    # at the third harmonic the speed sweeps over ten resolutions
    assert in_orders.line(3.0, 0.05).snr_db > in_hz.line(3.0 * mean_hz, 0.05 * 3 * mean_hz).snr_db + 2
