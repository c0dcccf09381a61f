"""Autogram and protrugram: written out for one band, synthetic faults and traps, measured records."""

import numpy as np
import pytest
from bearing_signals import defect, noise, turns_of
from scipy.signal import firwin, hilbert, lfilter

from gearsim_dsp.band_choice import choose_band
from gearsim_dsp.envelope import window_spectrum
from gearsim_dsp.impulsive.autogram import autogram, choose_by_autogram
from gearsim_dsp.impulsive.protrugram import choose_by_protrugram, protrugram
from gearsim_dsp.kurtogram import fast_kurtogram
from gearsim_io.errors import InputError

RATE = 24_000.0
LEAST_HZ = 500.0


def _choices(x, rate=RATE, least_hz=LEAST_HZ, width_hz=400.0):
    rng = np.random.default_rng(7)
    return choose_by_autogram(x, rate, least_hz, rng), choose_by_protrugram(x, rate, width_hz, rng)


def _defect(seed, resonance_hz=7000.0, level=0.7):
    rng = np.random.default_rng(seed)
    turns = turns_of(25.0, 2.0, RATE)
    return noise(rng, turns.size) + level * defect(rng, turns, RATE, 3.245, resonance_hz=resonance_hz).x


def _analytic(x, low_hz, high_hz):
    """Analytic signal of a brick-wall band at the full rate, of the record tapered as the module does."""
    spectrum = window_spectrum(x, RATE)
    lines = spectrum.lines.astype(complex)
    frequency = np.arange(lines.size) * RATE / x.size
    lines[(frequency < low_hz - 0.01) | (frequency > high_hz + 0.01)] = 0
    return hilbert(np.fft.irfft(lines, x.size))


def test_autogram_of_one_band_equals_its_definition_at_the_full_rate():
    """Decimation and the band's very edges differ; the lags are the same stretch of time."""
    x = _defect(0)[:24_000]
    band = next(b for b in autogram(x, RATE, 3).bands if b.level == 3 and b.low_hz == 6000.0)
    squared = np.abs(_analytic(x, 6000.0, 7500.0)) ** 2
    squared = squared[960:-960]
    centred = squared - squared.mean()
    count = centred.size
    full = np.correlate(centred, centred, "full")[count - 1 :] / (count - np.arange(count))
    r = full[int(np.ceil(4 * RATE / 1500.0)) : count // 2]
    r = r - r.min()
    want = r.size * np.sum(r**4) / np.sum(r**2) ** 2
    assert band.value == pytest.approx(want, rel=0.03)
    assert band.power == pytest.approx(0.5 * np.mean(squared), rel=0.01)


def test_protrugram_of_one_band_equals_its_definition_at_the_full_rate():
    x = _defect(1)[:24_000]
    band = min(protrugram(x, RATE, 500.0).bands, key=lambda b: abs(b.low_hz - 6750.0))
    envelope = np.abs(_analytic(x, band.low_hz, band.high_hz))[960:-960]
    centred = (envelope - envelope.mean()) * np.hanning(envelope.size)
    amplitude = np.abs(np.fft.rfft(centred))[3 : int(250.0 / RATE * envelope.size)]
    amplitude = amplitude - amplitude.mean()
    want = np.mean(amplitude**4) / np.mean(amplitude**2) ** 2
    assert band.value == pytest.approx(want, rel=0.05)


@pytest.mark.parametrize("resonance_hz", [1900.0, 4500.0, 7000.0, 9500.0])
def test_the_band_holds_the_resonance(resonance_hz):
    x = _defect(2, resonance_hz)
    autogram_choice, protrugram_choice = _choices(x)
    if resonance_hz > 2000:  # lower down the lines of the impacts themselves repeat as well as their ringing
        assert autogram_choice.band.low_hz <= resonance_hz <= autogram_choice.band.high_hz
    # The resonance is 10 % of its frequency wide; a narrow band within that is as good.
    centre = 0.5 * (protrugram_choice.band.low_hz + protrugram_choice.band.high_hz)
    assert centre == pytest.approx(resonance_hz, rel=0.15)


def test_noise_has_no_band():
    chosen = [_choices(noise(np.random.default_rng(seed), 24_000, 0.5)) for seed in range(12)]
    assert sum(pair[0].band is not None for pair in chosen) <= 1
    assert sum(pair[1].band is not None for pair in chosen) <= 1


@pytest.mark.parametrize(("height", "decay"), [(40.0, 15), (80.0, 15), (20.0, 100)])
def test_a_single_knock_does_not_win(height, decay):
    """Unlike in the kurtogram, it does not even without guards."""
    x = _defect(3)
    n = np.arange(4 * decay)
    x[20_000 : 20_000 + n.size] += height * np.sin(2 * np.pi * 2500 * n / RATE) * np.exp(-n / decay)
    plain = fast_kurtogram(x, RATE, 4).strongest
    assert not plain.low_hz <= 7000 <= plain.high_hz
    band = max(autogram(x, RATE, 4).bands, key=lambda b: b.value)
    assert 4500 < band.low_hz <= 7000 <= band.high_hz
    for choice in _choices(x):
        assert 4500 < choice.band.low_hz - 500 <= 7000 <= choice.band.high_hz + 500


def test_what_repeats_beyond_the_rolloff_does_not_win():
    """Quanta of a converter at nearly regular intervals, above the anti-alias filter."""
    x = lfilter(firwin(201, 0.86), 1.0, _defect(5))
    crumbs = np.zeros(x.size)
    crumbs[np.cumsum(np.random.default_rng(6).normal(240, 1.5, 195)).astype(int)] = 1.0
    x = x + lfilter(firwin(201, 0.92, pass_zero=False), 1.0, crumbs)
    plain = max(protrugram(x, RATE, 400.0).bands, key=lambda b: b.value)
    assert plain.low_hz > 10_500
    by_autogram, by_protrugram = _choices(x)
    assert max(by_autogram.band.high_hz, by_protrugram.band.high_hz) < 0.5 * 0.9 * RATE
    assert any("rolled off" in text for text in by_protrugram.rejected)


def test_beating_lines_do_not_win():
    t = np.arange(48_000) / RATE
    x = _defect(4) + 0.8 * sum(np.cos(2 * np.pi * (2000 + 25 * k) * t) for k in range(20))
    plain = protrugram(x, RATE, 400.0).strongest
    assert 1500 < plain.low_hz < 2600
    for choice in _choices(x):
        assert choice.band.low_hz - 500 <= 7000 <= choice.band.high_hz + 500


def test_what_cannot_be_searched_is_refused():
    rng = np.random.default_rng(0)
    with pytest.raises(InputError, match="at least 8192 samples"):
        autogram(np.zeros(5000), RATE, 6)
    with pytest.raises(InputError, match="least_width_hz"):
        choose_by_autogram(noise(rng, 2000), RATE, 0.0, rng)
    with pytest.raises(InputError, match="width_hz"):
        protrugram(noise(rng, 2000), RATE, 10.0)
    with pytest.raises(InputError, match="step_hz"):
        protrugram(noise(rng, 20_000), RATE, 500.0, 600.0)


@pytest.mark.records
def test_no_method_goes_to_an_inverters_carrier(record_file):
    """HIT-SM Normal 1200: a plain protrugram peaks beside the carrier of a 6 kHz inverter, or its double."""
    from gearsim_io.importers import import_file

    record = import_file(record_file("hit_sm/SQ_Normal_1200.mat"), "hit_sq")
    x, rate = record.data[0].astype(np.float64), record.sample_rate_hz
    plain = protrugram(x, rate, 345.0).strongest
    carriers_hz = np.array([6001.0, 12_002.0])
    assert np.min(np.abs(plain.low_hz - carriers_hz)) < 345.0
    rng = np.random.default_rng(1)
    choices = (
        choose_by_protrugram(x, rate, 345.0, rng),
        choose_by_autogram(x, rate, 216.0, rng),
        choose_band(x, rate, 216.0),
    )
    for choice in choices:
        if choice.band is not None:
            assert not np.any((carriers_hz > choice.band.low_hz) & (carriers_hz < choice.band.high_hz))


@pytest.mark.records
@pytest.mark.parametrize(
    ("name", "machine", "fault_hz"),
    [
        ("cwru/135_0.mat", "cwru_drive_end", 107.6),
        ("mfpt/OuterRaceFault_1.mat", "mfpt", 80.4),
        ("hit_sm/SQ_OR2_1200.mat", "hit_sq", 71.8),
    ],
)
def test_the_bands_chosen_on_records_show_the_fault(record_file, name, machine, fault_hz):
    """The line of the outer race in the envelope's spectrum of the band, 15 dB over its neighbours.

    On CWRU 135 the plain maxima of kurtogram and autogram lie in the slope of the anti-alias filter.
    """
    from gearsim_dsp.envelope import envelope_spectrum, squared_envelopes, suppress_lines
    from gearsim_io.importers import import_file

    record = import_file(record_file(name), machine)
    x, rate = record.data[0].astype(np.float64), record.sample_rate_hz
    autogram_choice, protrugram_choice = _choices(x, rate, 2 * fault_hz, 3.2 * fault_hz)
    spectrum = suppress_lines(window_spectrum(x, rate))
    for choice in (choose_band(x, rate, 2 * fault_hz), autogram_choice, protrugram_choice):
        low_hz, high_hz = choice.band.low_hz, choice.band.high_hz
        width_hz = high_hz - low_hz - 2 * spectrum.step_hz
        power, step_hz = envelope_spectrum(squared_envelopes(spectrum, np.array([low_hz]), width_hz))
        near = power[0][int(0.99 * fault_hz / step_hz) : int(1.01 * fault_hz / step_hz)]
        floor = np.median(power[0][int(0.5 * fault_hz / step_hz) : int(2 * fault_hz / step_hz)])
        assert near.max() > 10**1.5 * floor
        if name.startswith("cwru"):
            assert high_hz <= 21_600
            assert choice.rejected or choice is protrugram_choice
