"""Sampling with and without an anti-alias filter: response, aliases, delay, noise, portions."""

import itertools
import math

import numpy as np
import pytest
from scipy import signal

from gearsim_io.errors import InputError
from gearsim_io.quantities import validate
from gearsim_sim.sensors.chain import MeasuringChain
from gearsim_sim.sensors.dropouts import Dropouts
from gearsim_sim.sensors.mounting import Mounting
from gearsim_sim.sensors.rows import Row
from gearsim_sim.sensors.sampling import Sampling, filter_taps

RATE = 10_000.0
DELTA_SIGMA = Sampling(oversampling=4)
MISSING = Sampling(oversampling=4, antialias="none")


def _run(rows, sampling, motion_at, samples, cuts=(), rate=RATE):
    """Output samples of a chain that looks at `motion_at(index at the sensors' rate)`, zero before 0."""
    chain = MeasuringChain(rows, ("a", "b"), rate, 1, sampling)
    k = sampling.oversampling
    pieces = []
    for start, stop in itertools.pairwise([0, *cuts, samples]):
        index = np.arange((start - chain.past) * k, (stop + chain.ahead) * k)
        window = np.where(index >= 0, motion_at(index), 0.0)
        pieces.append(chain.process(np.vstack([window, -window]), start, stop - start))
    return np.concatenate(pieces, axis=1).astype(float)


def _sine(relative, phase=0.3):
    """A sine of `relative` times the sample rate, as a function of the index at four times that rate."""
    return lambda index: np.sin(2 * np.pi * relative / 4 * index + phase)


def test_the_filter_keeps_its_promises():
    for k, rejection in ((2, 100.0), (4, 100.0), (4, 60.0), (8, 120.0)):
        taps = filter_taps(Sampling(oversampling=k, rejection_db=rejection))
        np.testing.assert_allclose(taps, taps[::-1], rtol=0, atol=1e-15)  # linear phase
        frequency, response = signal.freqz(taps, worN=1 << 15, fs=float(k))
        gain = np.abs(response)
        # Kaiser's formulas meet the ripple within a decibel or two.
        limit = 10 ** (-(rejection - 2) / 20)
        assert gain[frequency >= 0.55].max() < limit
        assert np.abs(gain[frequency <= 0.45] - 1).max() < limit


def test_other_bands():
    taps = filter_taps(Sampling(oversampling=4, pass_band=0.3, stop_band=0.5, rejection_db=80))
    frequency, response = signal.freqz(taps, worN=1 << 14, fs=4.0)
    assert np.abs(response)[frequency >= 0.5].max() < 10 ** (-78 / 20)
    assert taps.size < filter_taps(DELTA_SIGMA).size / 2


@pytest.mark.parametrize("relative", [0.6, 0.7, 1.2, 1.9])
def test_what_lies_above_the_band_is_rejected_or_folds(relative):
    row = Row("c", "a")
    folded = abs(relative - round(relative))
    samples = 2000
    clean = _run([row], DELTA_SIGMA, _sine(relative), samples)[0][200:]
    assert np.abs(clean).max() < 10 ** (-98 / 20)
    bare = _run([row], MISSING, _sine(relative), samples)[0]
    lines = np.abs(np.fft.rfft(bare * signal.windows.hann(samples))) * 4 / samples
    assert lines[round(folded * samples)] == pytest.approx(1.0, rel=1e-3)


@pytest.mark.parametrize("relative", [0.01, 0.2, 0.44])
def test_what_lies_in_the_band_comes_through_without_delay(relative):
    out = _run([Row("c", "a")], DELTA_SIGMA, _sine(relative), 1000)[0]
    exact = np.sin(2 * np.pi * relative * np.arange(1000) + 0.3)
    np.testing.assert_allclose(out[100:], exact[100:], atol=3e-5)


def test_a_delay_counts_in_seconds():
    delayed = Row("c", "a", delay_s=2.6 / RATE)
    for sampling in (DELTA_SIGMA, MISSING):
        out = _run([delayed], sampling, _sine(0.1), 1000)[0]
        exact = np.sin(2 * np.pi * 0.1 * (np.arange(1000) - 2.6) + 0.3)
        np.testing.assert_allclose(out[100:], exact[100:], atol=3e-4)


def test_dropped_samples_are_exactly_the_others():
    motion = np.random.default_rng(0).standard_normal(8000)
    out = _run([Row("c", "a")], MISSING, lambda index: motion[np.clip(index, 0, 7999)], 1900)
    np.testing.assert_array_equal(out[0], motion[: 4 * 1900 : 4].astype(np.float32))


def test_noise_folds_without_the_filter():
    row = Row("c", "a", noise_density=1e-2)
    silence = lambda index: np.zeros(index.size)  # noqa: E731
    for sampling, factor in ((Sampling(), 1.0), (DELTA_SIGMA, 1.0), (MISSING, 4.0)):
        noise = _run([row], sampling, silence, 200_000)[0]
        frequency, psd = signal.welch(noise, RATE, nperseg=512)
        level = psd[(frequency > 100) & (frequency < 0.44 * RATE)].mean()
        assert level == pytest.approx(1e-4 * factor, rel=0.02)


def test_a_resonance_above_the_band_folds_without_the_filter():
    """The mounted resonance at 0.8 of the sample rate rings at 0.2 of it."""
    row = Row("c", "a", mounting=Mounting(resonance="8 kHz", q=20))
    shock = lambda index: (index == 4000).astype(float)  # noqa: E731
    spectra = []
    for sampling in (DELTA_SIGMA, MISSING):
        out = _run([row], sampling, shock, 4000)[0]
        spectra.append(np.abs(np.fft.rfft(out)))
    frequency = np.fft.rfftfreq(4000, 1 / RATE)
    near = np.abs(frequency - 2000.0) < 150
    assert spectra[1][near].max() > 5 * spectra[0][near].max()
    assert abs(frequency[spectra[1].argmax()] - 2000.0) < 30


@pytest.mark.parametrize("sampling", [DELTA_SIGMA, MISSING, Sampling(oversampling=3, rejection_db=60)])
def test_portions_change_no_bit(sampling):
    motion = np.random.default_rng(0).standard_normal(60_000) * 5
    rows = [
        Row(
            "c",
            "a",
            full_scale=10.0,
            noise_density=1e-2,
            adc_bits=12,
            delay_s=3.3 / RATE,
            mounting=Mounting(resonance="12 kHz", q=20),
            dropouts=Dropouts(rate="20 Hz", shows="hold"),
        ),
        Row("d", "b", bandwidth_hz=3000.0),
    ]
    look = lambda index: motion[np.clip(index, 0, motion.size - 1)]  # noqa: E731
    whole = _run(rows, sampling, look, 10_000)
    rng = np.random.default_rng(3)
    cuts = np.unique(np.concatenate([rng.integers(1, 10_000, 60), [1, 2, 3]]))
    np.testing.assert_array_equal(_run(rows, sampling, look, 10_000, cuts), whole)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"antialias": "none"}, "an oversampling of 2 or more, or nothing is there to fold"),
        ({"oversampling": 17}, "oversampling: got 17"),
        ({"oversampling": 2, "antialias": "sinc"}, "antialias: got sinc"),
        ({"oversampling": 2, "stop_band": 0.45}, "a stop_band above the pass_band"),
    ],
)
def test_bad_settings_are_told(content, message):
    with pytest.raises(InputError, match=message):
        validate(Sampling, content, "s.yaml")


def test_the_filter_costs_as_many_samples_ahead_as_it_is_long():
    chain = MeasuringChain([Row("c", "a")], ("a", "b"), RATE, 1, DELTA_SIGMA)
    half_s = filter_taps(DELTA_SIGMA).size // 2 / (4 * RATE)
    assert chain.ahead == pytest.approx(half_s * RATE, abs=1)
    assert chain.past == math.ceil(3 / 4)
