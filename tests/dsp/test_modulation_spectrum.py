import numpy as np
import pytest
from bearing_signals import defect, noise, turns_of
from scipy.signal import butter, hilbert, lfilter, sosfiltfilt

from gearsim_dsp.band_choice import choose_band
from gearsim_dsp.cyclic.correlation import cyclic_spectrum
from gearsim_dsp.cyclic.envelope_spectra import squared_envelope_spectrum
from gearsim_dsp.cyclic.envelopes_of_coherence import (
    best_band,
    carrier_profile,
    enhanced_envelope_spectrum,
    improved_envelope_spectrum,
)
from gearsim_dsp.cyclic.modulation import ModulationSpectrum
from gearsim_dsp.kinematics import fault_families
from gearsim_dsp.separation.cepstrum import prewhitened
from gearsim_dsp.speed import Phase
from gearsim_io.errors import InputError
from gearsim_io.importers import import_file
from gearsim_io.machines import load_machine

RATE = 8192.0
BAND = (1500.0, 3500.0)


def bearing(level, seed=1, seconds=8.0, carrier=0.0, resonance_hz=2500.0):
    """A defect at order 4.89 of a shaft of 10 Hz, `level` times as strong as the noise around it."""
    rng = np.random.default_rng(seed)
    turns = turns_of(10.0, seconds, RATE)
    signal = defect(rng, turns, RATE, 4.89, carrier_order=carrier, resonance_hz=resonance_hz)
    return signal, level * signal.x + noise(rng, turns.size)


@pytest.fixture(scope="module")
def noise_tests():
    """False-alarm probabilities that noise, white and coloured, gives to what is asked of its spectra."""
    rng = np.random.default_rng(11)
    found = {
        "lines": [],
        "averages": [],
        "comb": [],
        "sidebands": [],
        "line": [],
        "peaks": [],
        "averaged": [],
        "enhanced": [],
        "best": [],
    }
    for number in range(120):
        x = rng.standard_normal(round(4 * RATE))
        if number % 2:
            x = lfilter([1.0], [1.0, -1.2, 0.6], x)
        at = rng.uniform(20.0, 60.0)
        single = squared_envelope_spectrum(x, RATE, BAND, 500.0)
        found["comb"].append(single.comb(at, 0.02).false_alarm)
        found["sidebands"].append(single.comb(at, 0.02, 7.3, (10.0,)).false_alarm)
        found["line"].append(single.line(at, 2.0).false_alarm)
        found["peaks"].append(min((peak.false_alarm for peak in single.peaks(0.5)), default=1.0))
        averaged = squared_envelope_spectrum(x, RATE, BAND, 500.0, window_s=1.0)
        inner = slice(8, None)
        found["lines"].append(np.mean(single.false_alarm()[inner] < 1e-3))
        ratio = averaged.power[inner] / averaged.floor[inner]
        found["averages"].append(np.var(ratio) / np.mean(ratio) ** 2 * averaged.averages)
        found["averaged"].append(averaged.comb(at, 0.02).false_alarm)
        if number % 4 < 2:
            coherence = cyclic_spectrum(x, RATE, 64.0, 500.0).coherence_map()
            found["enhanced"].append(enhanced_envelope_spectrum(coherence).comb(at, 0.02).false_alarm)
            found["best"].append(best_band(coherence, at, 0.02)[1].false_alarm)
    return {name: np.array(values) for name, values in found.items()}


@pytest.mark.parametrize("what", ["comb", "sidebands", "line", "peaks", "averaged", "enhanced", "best"])
def test_false_alarms_on_noise_are_as_frequent_as_told(noise_tests, what):
    """Half of nominal (looks overlap) to nominal plus three standard errors of the count."""
    p = noise_tests[what]
    for level, share in ((0.3, 0.4), (0.1, 0.3)):
        rate = np.mean(p < level)
        error = np.sqrt(level * (1 - level) / p.size)
        assert level * share - 2 * error < rate < level + 3 * error
    assert np.mean(p < 0.005) <= 0.005 + 3 * np.sqrt(0.005 / p.size)


def test_single_lines_of_noise_have_the_law_told(noise_tests):
    # 120 records of 1800 independent lines: 220 expected, so three standard errors are 20 %; and the squared
    # envelope of a band is itself Gaussian only in the limit
    assert np.mean(noise_tests["lines"]) == pytest.approx(1e-3, rel=0.35)
    # the variance of 7 overlapping windows is that of `averages` independent ones
    assert np.mean(noise_tests["averages"]) == pytest.approx(1.0, abs=0.06)


def test_a_line_between_two_is_placed():
    """A depth of 0.9 between lines 551 and 552."""
    rng = np.random.default_rng(12)
    t = np.arange(round(30 * RATE)) / RATE
    x = rng.standard_normal(t.size)
    step = squared_envelope_spectrum(x, RATE, BAND, 200.0, window_s=10.0).step
    for place in (551.3, 551.7):
        y = x * np.sqrt(1 + 0.9 * np.cos(2 * np.pi * place * step * t))
        line = squared_envelope_spectrum(y, RATE, BAND, 200.0, window_s=10.0).line(551.5 * step)
        assert line.found / step == pytest.approx(place, abs=0.1)


def test_a_defect_is_found_at_the_mean_rate_of_its_impacts():
    signal, x = bearing(0.4)
    spectrum = squared_envelope_spectrum(x, RATE, BAND, 300.0)
    comb = spectrum.comb(48.9, 0.02, shafts=(10.0,))
    true_hz = (signal.impacts.size - 1) / (signal.impacts[-1] - signal.impacts[0]) * 10.0
    assert comb.false_alarm < 1e-8
    assert comb.found == pytest.approx(true_hz, rel=1e-3)
    assert comb.harmonics[0].found == pytest.approx(true_hz, abs=spectrum.resolution)
    assert comb.harmonics[0].false_alarm < 1e-4
    assert comb.snr_db > 10
    assert spectrum.comb(37.7, 0.02, shafts=(10.0,)).false_alarm > 1e-3
    assert spectrum.peaks(1e-4)[0].found == pytest.approx(true_hz, abs=spectrum.resolution)


def test_power_and_modulation_are_those_of_the_closed_form():
    """Noise of power 1 + m cos has m^2 / 4 at its line, mean square m^2 / 2, as scipy's envelope says."""
    rng = np.random.default_rng(3)
    t = np.arange(round(60 * RATE)) / RATE
    x = rng.standard_normal(t.size) * np.sqrt(1 + 0.6 * np.cos(2 * np.pi * 30.0 * t))
    spectrum = squared_envelope_spectrum(x, RATE, BAND, 200.0, window_s=10.0)
    line = spectrum.line(30.0)
    # the line is known to the error of a mean over B T independent values, in amplitude 1 / sqrt(B T)
    assert line.power == pytest.approx(0.09, rel=4 / 0.3 / np.sqrt(2000 * 60) + 0.02)
    assert line.found == pytest.approx(30.0, abs=0.02)
    assert spectrum.comb(30.0, 0.001).modulation == pytest.approx(0.18, rel=0.1)
    assert np.median(spectrum.floor) == pytest.approx(1.5 / (2000 * 9.2), rel=0.15)
    squared = np.abs(hilbert(sosfiltfilt(butter(6, BAND, "bandpass", fs=RATE, output="sos"), x))) ** 2
    theirs = np.mean((squared / squared.mean() - 1) * np.exp(-2j * np.pi * 30.0 * t))
    assert line.power == pytest.approx(np.abs(theirs) ** 2, rel=0.1)


def test_lines_are_those_of_openconmo():
    """Their spectrum of the whole bandwidth, untapered: depths of modulation, and noise between them."""
    reference = pytest.importorskip("openconmo.benchmark_methods").envelope
    rng = np.random.default_rng(13)
    t = np.arange(round(40 * RATE)) / RATE
    depth = {17.3: 0.6, 48.9: 0.3, 97.8: 0.15}
    power = 1 + sum(m * np.cos(2 * np.pi * f * t + f) for f, m in depth.items())
    x = lfilter([1.0, 0.5], [1.0], rng.standard_normal(t.size)) * np.sqrt(power)
    frequency, theirs = reference(x, RATE)
    whole = (RATE / 1000, RATE / 2 - RATE / 1000)
    ours = squared_envelope_spectrum(x, RATE, whole, 150.0, limit_lines=False)
    for f, m in depth.items():
        line = ours.line(f)
        near = np.abs(frequency - f) < 0.1
        assert line.found == pytest.approx(frequency[near][np.argmax(theirs[near])], abs=ours.resolution)
        # both see the same noise, but Hann's window weighs it differently: its share of a line, doubled
        share = np.sqrt(np.median(ours.floor)) * 2
        assert 2 * np.sqrt(line.power) == pytest.approx(theirs[near].max() / theirs[0], abs=2 * share)
        assert 2 * np.sqrt(line.power) == pytest.approx(m, abs=2 * share)
    # |c|^2 of noise in a line: ours has the 1.5 of Hann's window
    between = (frequency > 110) & (frequency < 145)
    noise_theirs = np.mean((theirs[between] / theirs[0] / 2) ** 2)
    noise_ours = np.mean(ours.power[(ours.axis > 110) & (ours.axis < 145)])
    # 1400 and 1300 independent lines: the ratio is known to 4 %
    assert noise_ours / noise_theirs == pytest.approx(1.5 / 0.92, rel=0.12)


def test_whole_numbers_of_a_converter_are_taken_as_they_are():
    _, x = bearing(0.4, seconds=4.0)
    counts = np.round(200 * x).astype(np.int16)
    ours = squared_envelope_spectrum(counts, RATE, BAND, 300.0)
    np.testing.assert_allclose(
        ours.power, squared_envelope_spectrum(counts.astype(np.float64), RATE, BAND, 300.0).power, rtol=1e-12
    )
    a, b = (cyclic_spectrum(one, RATE, 64.0, 100.0) for one in (counts, counts.astype(np.float64)))
    np.testing.assert_array_equal(a.correlation, b.correlation)


def test_sidebands_of_the_carrier_are_told():
    _, x = bearing(0.5, carrier=1.0)
    spectrum = squared_envelope_spectrum(x, RATE, BAND, 300.0)
    comb = spectrum.comb(48.9, 0.02, 10.0)
    (low, high) = comb.sidebands[0]
    assert (low.expected, high.expected) == pytest.approx((38.9, 58.9))
    assert min(low.false_alarm, high.false_alarm) < 1e-4
    assert spectrum.comb(48.9, 0.02).sidebands == ()


def test_lines_of_shafts_do_not_make_a_comb():
    """Modulation by the shaft alone: with its harmonics left out nothing remains of a comb on them."""
    rng = np.random.default_rng(4)
    t = np.arange(round(8 * RATE)) / RATE
    x = rng.standard_normal(t.size) * (1 + 0.8 * np.maximum(0, np.cos(2 * np.pi * 10.0 * t)))
    spectrum = squared_envelope_spectrum(x, RATE, BAND, 300.0)
    assert spectrum.comb(20.0, 0.01).false_alarm < 1e-3
    assert spectrum.comb(20.0, 0.01, shafts=(10.0,)).false_alarm > 0.01
    with pytest.raises(InputError, match="not theirs"):
        spectrum.comb(20.0, 0.001, shafts=(10.0,))


def test_orders_follow_a_changing_speed():
    turns = turns_of(np.array([18.0, 23.0]), 6.0, RATE)
    signal = defect(np.random.default_rng(5), turns, RATE, 4.89, slip=0.0)
    x = signal.x + noise(np.random.default_rng(6), turns.size)
    phase = Phase(np.arange(turns.size, dtype=float), turns)
    orders = squared_envelope_spectrum(x, RATE, BAND, 20.0, phase=phase, window_s=3.0)
    assert orders.unit == "order"
    assert orders.axis[-1] == pytest.approx(20.0, abs=2 * orders.step)
    comb = orders.comb(4.9, 0.01)
    assert comb.found == pytest.approx(4.89, rel=5e-4)
    assert comb.snr_db > 15
    smeared = squared_envelope_spectrum(x, RATE, BAND, 400.0, window_s=3.0).comb(100.0, 0.12)
    assert smeared.snr_db < comb.snr_db - 5


def test_the_enhanced_spectrum_hears_a_weak_resonance_beside_a_loud_stationary_one():
    """The whole band's squared envelope is deaf to it; coherence weighs every carrier by its own noise."""
    _, x = bearing(0.25, seconds=16.0, resonance_hz=3200.0)
    rng = np.random.default_rng(7)
    omega, radius = 2 * np.pi * 1200.0 / RATE, 0.99
    loud = lfilter([1.0], [1.0, -2 * radius * np.cos(omega), radius**2], rng.standard_normal(x.size))
    x = x + 9 * loud / np.std(loud)
    whole = squared_envelope_spectrum(x, RATE, (300.0, 3900.0), 300.0).comb(48.9, 0.02)
    spectrum = cyclic_spectrum(x, RATE, 64.0, 300.0).coherence_map()
    enhanced = enhanced_envelope_spectrum(spectrum)
    comb = enhanced.comb(48.9, 0.02)
    assert whole.false_alarm > 1e-3
    assert comb.false_alarm < 1e-6
    assert comb.found == pytest.approx(48.9, rel=3e-3)
    assert enhanced.kind == "EES"
    # and the improved one knows where it is
    improved, better = best_band(spectrum, 48.9, 0.02)
    assert improved.kind == "IES"
    assert 3200.0 - 700 < improved.band_hz[0] < 3200.0 < improved.band_hz[1]
    assert better.snr_db > comb.snr_db + 2
    profile = carrier_profile(spectrum, better.found)
    assert spectrum.frequency_hz[np.argmax(profile)] == pytest.approx(3200.0, abs=300.0)
    # the same band, not chosen by looking, has nothing to pay for
    given = improved_envelope_spectrum(spectrum, improved.band_hz)
    assert given.looks == 1 < improved.looks
    np.testing.assert_allclose(given.power, improved.power, rtol=1e-9)


def test_coherence_of_stationary_noise_has_its_mean():
    x = np.random.default_rng(8).standard_normal(round(8 * RATE))
    spectrum = cyclic_spectrum(x, RATE, 64.0, 300.0).coherence_map()
    assert np.mean(enhanced_envelope_spectrum(spectrum).power[20:]) == pytest.approx(
        1 / spectrum.averages, rel=0.03
    )
    assert abs(np.mean(carrier_profile(spectrum, 41.3))) < 1 / spectrum.averages


@pytest.mark.records
@pytest.mark.parametrize(
    ("name", "machine", "shaft_hz", "expected_hz", "found_hz"),
    [
        # expected: rolling without slip; found: zoom into the whole record's envelope by scipy, see
        # test_diagnose_records.zoomed_line, which these must meet within 0.3 %
        ("mfpt/OuterRaceFault_1.mat", "mfpt", 25.0, 81.12, 80.47),
        ("hit_sm/SQ_OR8_600.mat", "hit_sq", 10.0, 35.85, 35.98),
        ("hit_sm/SQ_IR2_1200.mat", "hit_sq", 20.0, 108.30, 108.65),
        ("cwru/135_0.mat", "cwru_drive_end", 29.93, 107.30, 107.67),
    ],
)
def test_measured_faults(record_file, name, machine, shaft_hz, expected_hz, found_hz):
    record = import_file(record_file(name), machine)
    rate, x = record.sample_rate_hz, record.data[0]
    spectrum = cyclic_spectrum(x, rate, rate / 256, 5 * expected_hz).coherence_map()
    trusted = (0.03 * rate, 0.46 * rate)
    enhanced = enhanced_envelope_spectrum(spectrum, trusted).comb(expected_hz, 0.015, shafts=(shaft_hz,))
    improved, comb = best_band(spectrum, expected_hz, 0.015, shafts=(shaft_hz,), band_hz=trusted)
    chosen = choose_band(x, rate, 5 * expected_hz).band
    assert chosen is not None
    by_kurtosis = squared_envelope_spectrum(x, rate, (chosen.low_hz, chosen.high_hz), 5 * expected_hz)
    squared = by_kurtosis.comb(expected_hz, 0.015, shafts=(shaft_hz,))
    for test in (enhanced, comb, squared):
        assert test.false_alarm < 1e-8
        assert test.found == pytest.approx(found_hz, rel=3e-3)
    assert comb.snr_db > 20
    assert improved.looks > 10


@pytest.mark.records
@pytest.mark.parametrize(
    ("name", "machine", "shaft_hz"),
    [
        ("cwru/97_Normal_0.mat", "cwru_drive_end", 29.93),
        ("mfpt/baseline_1.mat", "mfpt", 25.0),
        ("hit_sm/SQ_Normal_600.mat", "hit_sq", 10.0),
    ],
)
def test_measured_sound_bearings_modulate_next_to_nothing(record_file, name, machine, shaft_hz):
    """Pre-whitened, the lines of inverters and supplies that coherence would take for modulation are gone.

    The same number is 0.08 to 2.8 on the faulty records above and the weakest fault known here.
    """
    record = import_file(record_file(name), machine)
    rate = record.sample_rate_hz
    spectrum = cyclic_spectrum(prewhitened(record.data[0]), rate, rate / 256, 8.2 * 6 * shaft_hz)
    enhanced = enhanced_envelope_spectrum(spectrum.coherence_map(), (0.03 * rate, 0.46 * rate))
    for family in fault_families(load_machine(machine)):
        if family.fault in ("outer_race", "inner_race"):
            side = family.sideband_order * shaft_hz
            comb = enhanced.comb(family.order * shaft_hz, 0.02, side, shafts=(shaft_hz,))
            assert comb.modulation < 0.02


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"band_hz": (1500.0, 1600.0)}, "a band wider than the 300 Hz"),
        ({"samples": np.zeros(500)}, "at least 0.107 s"),
        ({"window_s": 0.01}, "at least 0.107 s"),
        ({"samples": np.full(9000, np.nan)}, "a finite vector"),
        ({"samples": np.zeros(9000)}, "a signal in that band"),
        ({"samples": 9.81 + 1e-9 * np.random.default_rng(0).standard_normal(9000)}, "a signal in that band"),
        ({"band_hz": (3500.0, 4500.0)}, "bands inside"),
    ],
)
def test_wrong_input_is_told(changes, word):
    arguments = {"samples": np.zeros(9000), "sample_rate_hz": RATE, "band_hz": BAND, "top": 300.0}
    with pytest.raises(InputError, match=word):
        squared_envelope_spectrum(**(arguments | changes))


def test_what_is_asked_of_a_spectrum_is_checked():
    power = np.random.default_rng(9).exponential(1.0, 600)
    spectrum = ModulationSpectrum(power, 0.5, "Hz", 1.0, BAND, "SES")
    with pytest.raises(InputError, match=r"at most 148\.02 Hz, half"):
        spectrum.comb(200.0, 0.01)
    with pytest.raises(InputError, match="above 2 Hz"):
        spectrum.comb(1.0, 0.01)
    with pytest.raises(InputError, match="speeds above 0"):
        spectrum.comb(50.0, 0.01, shafts=(0.0,))
    with pytest.raises(InputError, match=r"to 298\.5 Hz"):
        spectrum.line(400.0)
    with pytest.raises(InputError, match="1 or more"):
        ModulationSpectrum(power, 0.5, "Hz", 0.5, BAND, "SES")
    with pytest.raises(InputError, match="a finite vector"):
        ModulationSpectrum(power * np.nan, 0.5, "Hz", 1.0, BAND, "SES")
    coherence = cyclic_spectrum(np.random.default_rng(0).standard_normal(9000), RATE, 64.0, 100.0)
    coherence = coherence.coherence_map()
    with pytest.raises(InputError, match="at most 99"):
        carrier_profile(coherence, 150.0)
