import numpy as np
import pytest
from bearing_signals import turns_of
from scipy.signal import lfilter, welch

from gearsim_dsp.angle.resample import to_angle
from gearsim_dsp.cyclic.slices import gain_db, slices_before_and_after, spectral_slices
from gearsim_dsp.separation.random_separation import drs
from gearsim_dsp.speed import Phase
from gearsim_io.errors import InputError
from gearsim_io.importers import import_file

RATE = 8192.0


def rough_bearing_beside_gears(depth, seconds=16.0, seed=1):
    """Gear mesh of 32 teeth with sidebands, and a random vibration that a rough zone makes once per turn.

    Good and faulty share the gears and a noise floor; the rough zone adds modulated noise 26 dB below them.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * RATE)) / RATE
    turns = 10.0 * t
    gears = sum(np.cos(2 * np.pi * k * 32 * turns) * (1 + 0.3 * np.cos(2 * np.pi * turns)) for k in (1, 2, 3))
    load = np.maximum(0.0, np.cos(2 * np.pi * turns)) ** 1.5
    return gears + 0.02 * rng.standard_normal(t.size) + depth * load * rng.standard_normal(t.size)


def test_slice_zero_is_the_power_spectral_density():
    x = np.random.default_rng(1).standard_normal(40_000)
    slices = spectral_slices(x, RATE, [0.0], 32.0)
    frequency, density = welch(x - x.mean(), RATE, "hann", 256, 192, detrend=False)
    np.testing.assert_allclose(slices.frequency_hz, frequency)
    np.testing.assert_allclose(slices.density[0, 1:-1].real, density[1:-1], rtol=1e-9)
    np.testing.assert_allclose(np.abs(slices.density[0]), slices.bound[0], rtol=1e-9)


def test_the_bound_is_made_of_the_densities_half_a_cyclic_frequency_up_and_down():
    x = lfilter([1.0], [1.0, -0.95], np.random.default_rng(4).standard_normal(40_000))
    slices = spectral_slices(x, RATE, [0.0, 256.0], 32.0)  # four lines up, four lines down
    density = slices.bound[0]
    np.testing.assert_allclose(slices.bound[1, 5:-5], np.sqrt(density[9:-1] * density[1:-9]), rtol=1e-6)
    assert slices.squared_coherence().max() <= 1.0


def test_modulated_noise_has_its_closed_form_on_either_side_of_the_carrier():
    """Noise in 1 + m cos(2 pi a t + p) of power: m / 2 of the density, at the phase p; nothing elsewhere."""
    rng = np.random.default_rng(2)
    t = np.arange(round(40 * RATE)) / RATE
    x = rng.standard_normal(t.size) * np.sqrt(1 + 0.6 * np.cos(2 * np.pi * 41.3 * t - 0.5))
    slices = spectral_slices(x, RATE, [41.3, 60.0], 64.0)
    inner = slice(4, -4)
    ratio = slices.density[:, inner] / slices.bound[:, inner]
    error = 5 / np.sqrt(2 * slices.averages * ratio.shape[1] / 2)  # neighbouring Hann lines go in pairs
    assert np.mean(ratio[0]) == pytest.approx(0.3 * np.exp(-0.5j), abs=error)
    assert abs(np.mean(ratio[1])) < error


def test_chance_is_what_noise_reaches_that_often():
    rng = np.random.default_rng(3)
    above = []
    for _ in range(60):
        slices = spectral_slices(rng.standard_normal(16_384), RATE, [50.0], 64.0)
        above.append(slices.level_db()[0, 4:-4:2] > slices.chance_db(0.01)[0, 4:-4:2])
    # 3600 values: three standard errors of the rate
    assert np.mean(above) == pytest.approx(0.01, abs=3 * np.sqrt(0.01 / 3600))


def test_removal_of_gears_uncovers_the_rough_zone():
    """The picture of the thesis: masked by gears before, at the shaft's speed alone after."""
    good, faulty = rough_bearing_beside_gears(0.0), rough_bearing_beside_gears(0.1)
    pair = [
        slices_before_and_after(x, RATE, [0.0, 10.0], 64.0, lambda x: drs(x, 512, 8192)[1])
        for x in (good, faulty)
    ]
    (sound, ill) = pair
    assert sound.removed_share > 0.99
    band = (100.0, 1500.0)
    # <load^2> = 0.21: 10 log10((0.02^2 + 0.1^2 * 0.21) / 0.02^2) = 8 dB of noise, under 26 dB more of gears
    assert gain_db(ill.before, sound.before, 0, *band) < 1.0
    assert gain_db(ill.after, sound.after, 0, *band) == pytest.approx(8.0, abs=1.5)
    assert gain_db(ill.after, sound.after, 1, *band) > gain_db(ill.after, sound.after, 0, *band) + 3.0
    clear = (ill.after.frequency_hz > 100) & (ill.after.frequency_hz < 3900)
    assert np.mean(ill.after.squared_coherence()[1, clear]) > 20 / ill.after.averages
    assert np.mean(sound.after.squared_coherence()[1, clear]) < 2 / sound.after.averages


def test_a_wrong_cyclic_frequency_reads_low():
    x = rough_bearing_beside_gears(0.1) - rough_bearing_beside_gears(0.0)
    slices = spectral_slices(x, RATE, [10.0, 10.2], 64.0)
    assert slices.mean_level(0, 200, 3900) > 5 * slices.mean_level(1, 200, 3900)


def test_at_changing_speed_slices_are_taken_over_angle():
    """Speed up by 10 %: once per turn stays one order, while in Hz it is spread."""
    turns = turns_of(np.array([9.5, 10.5]), 12.0, RATE)
    rng = np.random.default_rng(5)
    load = np.maximum(0.0, np.cos(2 * np.pi * turns)) ** 1.5
    x = (0.2 + load) * rng.standard_normal(turns.size)
    phase = Phase(np.arange(0, turns.size, 64, dtype=float), turns[::64])
    angle = to_angle(x, phase, 1024)
    orders = spectral_slices(angle.values, 1024.0, [1.0], 8.0)
    hz = spectral_slices(x, RATE, [10.0], 80.0)
    inside = slice(4, 40)  # below the lowest cut-off of the resampling filter
    sharp = np.mean(orders.squared_coherence()[0, inside])
    assert sharp > 0.4
    # a sweep of 1 Hz over 12 s spreads its power over 12 resolutions
    assert np.mean(hz.squared_coherence()[0, inside]) < sharp / 6


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"samples": np.zeros(100)}, "at least 0.0625 s"),
        ({"samples": np.full(8192, np.inf)}, "a vector of finite values"),
        ({"alphas_hz": [5000.0]}, "0 to 4096 Hz"),
        ({"alphas_hz": [-1.0]}, "0 to 4096 Hz"),
        ({"step_hz": 0.0}, "a step of at most"),
    ],
)
def test_wrong_input_is_told(changes, word):
    arguments = {
        "samples": np.random.default_rng(0).standard_normal(8192),
        "sample_rate_hz": RATE,
        "alphas_hz": [0.0, 10.0],
        "step_hz": 64.0,
    }
    with pytest.raises(InputError, match=word):
        spectral_slices(**(arguments | changes))


def test_what_is_asked_of_slices_is_checked():
    x = np.random.default_rng(0).standard_normal(8192)
    slices = spectral_slices(x, RATE, [0.0], 64.0)
    with pytest.raises(InputError, match="a band inside"):
        slices.mean_level(0, 5000.0, 6000.0)
    with pytest.raises(InputError, match="between 0 and 1"):
        slices.chance_db(1.0)
    with pytest.raises(InputError, match="remove"):
        slices_before_and_after(x, RATE, [0.0], 64.0, lambda x: x[:-1])


@pytest.mark.records
def test_a_measured_wide_defect_stands_out_at_its_ball_passes(record_file):
    """HIT-SM, a defect of 8 degrees on the outer race against a sound bearing, each by its own coherence."""
    shares = {}
    for name in ("SQ_OR8_600", "SQ_Normal_600"):
        record = import_file(record_file(f"hit_sm/{name}.mat"), "hit_sq")
        length = round(record.sample_rate_hz / 8) * 2
        pair = slices_before_and_after(
            record.data[0],
            record.sample_rate_hz,
            [0.0, 35.98],
            100.0,
            lambda x, n=length: drs(x, n // 8, n)[1],
        )
        low = (pair.after.frequency_hz > 500) & (pair.after.frequency_hz < 10_000)
        shares[name] = np.mean(pair.after.level_db()[1, low] > pair.after.chance_db()[1, low])
        removed = pair.removed_share
    assert shares["SQ_OR8_600"] > 0.95
    assert shares["SQ_Normal_600"] < 0.15
    assert removed > 0.9  # the sound record is nearly all inverter
