"""Each effect of the measuring chain against its closed form, an independent simulation, or counting."""

import itertools
import math

import numpy as np
import pytest
from scipy import integrate, signal, special

from gearsim_io.errors import InputError
from gearsim_sim.sensors.chain import STAGES, MeasuringChain
from gearsim_sim.sensors.drift import Drift
from gearsim_sim.sensors.dropouts import Dropouts
from gearsim_sim.sensors.gain import Temperature
from gearsim_sim.sensors.highpass import HighPass
from gearsim_sim.sensors.interference import Inverter, Mains, PhaseClock
from gearsim_sim.sensors.mounting import Mounting, mountings, resonance
from gearsim_sim.sensors.noise import LOWEST_HZ, _Shape
from gearsim_sim.sensors.overload import Overload
from gearsim_sim.sensors.rows import Row
from gearsim_sim.sensors.settings import Accel

RATE = 65536.0


def _run(rows, motion, rate=RATE, seed=1, cuts=()):
    """The chain's output, from sample 0, in pieces that end at `cuts`; motion is (sites, samples)."""
    chain = MeasuringChain(rows, ("a", "b"), rate, seed)
    assert chain.past == chain.ahead == 0
    total = motion.shape[1]
    pieces = [
        chain.process(motion[:, start:stop], start, stop - start)
        for start, stop in itertools.pairwise([0, *cuts, total])
    ]
    return np.concatenate(pieces, axis=1).astype(float)


def _impulse(samples):
    motion = np.zeros((2, samples))
    motion[0, 0] = 1.0
    return motion


def _silence(samples):
    return np.zeros((2, samples))


def _full(name, **changes):
    """A row with every effect."""
    settings = {
        "full_scale": 30.0,
        "bandwidth_hz": 20_000.0,
        "noise_density": 1e-3,
        "adc_bits": 16,
        "noise_corner_hz": 500.0,
        "gain_error": 0.02,
        "offset": 0.1,
        "cross_axis": (("b", 0.03),),
        "mounting": Mounting(resonance="25 kHz", q=30),
        "high_pass": HighPass(corner="0.5 Hz", order=2),
        "temperature": Temperature(
            coefficient="0.001 1/K", rise="20 K", time="1 s", wander="1 K", wander_time="1 s"
        ),
        "drift": Drift[Accel](rms="0.5 m/s^2", time="0.1 s"),
        "mains": Mains[Accel](amplitude="0.5 m/s^2"),
        "inverter": Inverter[Accel](amplitude="1 m/s^2"),
        "dropouts": Dropouts(rate="20 Hz", shows="hold"),
        "overload": Overload(),
    }
    return Row(name, "a", **{**settings, **changes})


# --- mounting resonance


@pytest.mark.parametrize(
    ("resonance_hz", "q", "tolerance"),
    [
        (2000.0, 3.0, 0.003),
        (7000.0, 10.0, 0.003),
        (28_000.0, 25.0, 0.003),
        (32_000.0, 30.0, 0.003),
        (33_500.0, 30.0, 0.02),
        (50_000.0, 30.0, 0.006),
        (120_000.0, 0.7, 0.003),
    ],
)
def test_mounting_resonance_has_the_magnitude_of_a_mass_on_a_spring(resonance_hz, q, tolerance):
    row = Row("c", "a", mounting=Mounting(resonance=f"{resonance_hz} Hz", q=q))
    gain = np.abs(np.fft.rfft(_run([row], _impulse(1 << 15))[0]))
    frequency = np.fft.rfftfreq(1 << 15, 1 / RATE)
    s = 2j * np.pi * frequency
    w0 = 2 * np.pi * resonance_hz
    exact = np.abs(w0**2 / (s**2 + s * w0 / q + w0**2))
    band = frequency <= 0.45 * RATE  # the promised band
    # The tolerance is the promise of `mounting`: 0.2 %, 0.6 % or 2 %, and float32 for what is far above it.
    np.testing.assert_allclose(gain[band], exact[band], rtol=tolerance, atol=1e-6)
    if resonance_hz < 0.45 * RATE:
        assert gain[round(resonance_hz * (1 << 15) / RATE)] == pytest.approx(q, rel=0.01)


def test_mounting_filters_are_stable_and_keep_the_static_sensitivity():
    for resonance_hz in np.geomspace(20.0, 9e5, 60):
        for q in (0.5, 3.0, 200.0):
            for b0, b1, b2, a1, a2 in resonance(resonance_hz, q, RATE):
                assert np.abs(np.roots([1.0, a1, a2])).max(initial=0.0) < 1.0
                assert (b0 + b1 + b2) == pytest.approx(1.0 + a1 + a2, rel=1e-9)


def test_shipped_mountings_are_ordered_as_handbooks_say():
    shipped = mountings()
    order = sorted(shipped, key=lambda name: shipped[name].resonance)
    assert order == ["handheld", "magnet", "mica", "wax", "stud"]


# --- high-pass


@pytest.mark.parametrize(("corner", "order"), [(0.5, 1), (3.0, 2), (400.0, 1), (400.0, 2)])
def test_high_pass_is_scipys_butterworth_and_its_step_decays(corner, order):
    row = Row("c", "a", high_pass=HighPass(corner=f"{corner} Hz", order=order))
    motion = np.ones((2, 1 << 16))
    motion[:, 5000:] -= 3.0
    out = _run([row], motion)[0]
    b, a = signal.butter(order, corner, "highpass", fs=RATE)
    np.testing.assert_allclose(out, signal.lfilter(b, a, motion[0]), rtol=1e-5, atol=1e-5)
    if order == 1:
        time = np.arange(4000) / RATE
        np.testing.assert_allclose(out[:4000], np.exp(-2 * np.pi * corner * time), atol=2 * corner / RATE * 4)


# --- gain, temperature


def test_gain_error_and_cross_axis_sensitivity():
    motion = np.random.default_rng(0).standard_normal((2, 500))
    out = _run([Row("c", "a", gain_error=-0.05, cross_axis=(("b", 0.03),))], motion)[0]
    np.testing.assert_allclose(out, 0.95 * (motion[0] + 0.03 * motion[1]), rtol=1e-6, atol=1e-6)


def test_any_direction_is_a_sum_of_sites():
    motion = np.random.default_rng(0).standard_normal((2, 500))
    c, s = math.cos(0.3), math.sin(0.3)
    out = _run([Row("c", (("a", c), ("b", s)))], motion)[0]
    np.testing.assert_allclose(out, c * motion[0] + s * motion[1], rtol=1e-6, atol=1e-7)


def test_warming_changes_the_sensitivity_exponentially_and_shifts_the_zero():
    rate = 1000.0
    heat = Temperature(coefficient="0.01 1/K", offset="-5 K", rise="40 K", time="10 s")
    motion = np.vstack([np.ones(60_000), np.zeros(60_000)])
    row = Row("c", "a", temperature=heat, zero_per_k=0.2)
    out = _run([row], motion, rate)[0]
    kelvin = -5.0 + 40.0 * (1.0 - np.exp(-np.arange(60_000) / rate / 10.0))
    # Straight lines between knots of a 32nd of the time constant or less: (1/32)^2 / 8 of the rise at most.
    np.testing.assert_allclose(out, 1.0 + 0.01 * kelvin + 0.2 * kelvin, atol=0.21 * 40 / 32**2 / 8 + 1e-6)


def test_wandering_temperature_has_its_standard_deviation_and_memory():
    rate = 1000.0
    heat = Temperature(coefficient="0.01 1/K", wander="3 K", wander_time="1 s")
    motion = np.vstack([np.ones(4_000_000), np.zeros(4_000_000)])
    kelvin = (_run([Row("c", "a", temperature=heat)], motion, rate)[0] - 1.0) / 0.01
    # 4000 s with a memory of 1 s: 2000 independent values, and Gaussian: 4 sigma of the estimates.
    assert kelvin.std() == pytest.approx(3.0, rel=4 * math.sqrt(0.5 / 2000))
    lag = np.mean(kelvin[:-1000] * kelvin[1000:]) / kelvin.var()
    assert lag == pytest.approx(math.exp(-1.0), abs=4 / math.sqrt(2000))


# --- noise


def test_noise_rises_as_one_over_f_below_its_corner():
    rate, density, corner = 16_384.0, 2e-3, 200.0
    noise = _run([Row("c", "a", noise_density=density, noise_corner_hz=corner)], _silence(1 << 22), rate)[0]
    frequency, psd = signal.welch(noise, rate, nperseg=1 << 16, detrend=False)
    expected = density**2 * (1 + corner / frequency[1:])
    edges = [1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, 8000.0]
    for low, high in itertools.pairwise(edges):
        band = (frequency[1:] >= low) & (frequency[1:] < high)
        averages = 127 * band.sum()  # half-overlapping segments, bins
        ratio = np.mean(psd[1:][band] / expected[band])
        # 4 sigma of the estimate, and the promise of `noise`
        assert ratio == pytest.approx(1.0, abs=4 / math.sqrt(averages) + 0.01 + 2 * corner / rate)


def test_the_shape_is_the_formula_down_to_the_lowest_frequency():
    shape = _Shape(700.0, RATE)
    frequency = np.geomspace(3 * LOWEST_HZ, 20_000.0, 300)
    _, response = signal.sosfreqz(
        np.array([[b0, b1, b2, 1.0, a1, a2] for b0, b1, b2, a1, a2 in shape.sections]), frequency, fs=RATE
    )
    error = np.abs(np.abs(response) ** 2 / (1 + 700.0 / frequency) - 1)
    # Lorentzians that lie a factor r apart ripple by 4 exp(-pi^2 / ln r) = 0.3 %; those missing above 0.45
    # of the rate are 0.3 corner / (0.45 rate) = 0.7 %, those missing below 0.01 Hz 0.2 pole / f.
    middle = (frequency > 1) & (frequency < 3000)
    assert np.all(error[middle] < 0.01)
    assert np.all(error < 0.01 + 2 * 700.0 / RATE + 0.5 * LOWEST_HZ / frequency)


def test_flicker_is_stationary_from_the_first_sample():
    rate, count = 2048.0, 400
    rows = [Row(f"c{k}", "a", noise_density=1.0, noise_corner_hz=200.0) for k in range(count)]
    noise = _run(rows, _silence(4096), rate)
    # White over half the rate and 1/f from 0.01 Hz up to about there.
    frequency = np.geomspace(1e-5, rate / 2, 40_000)
    zero = _Shape(200.0, rate)
    sos = np.array([[b0, b1, b2, 1.0, a1, a2] for b0, b1, b2, a1, a2 in zero.sections])
    _, response = signal.sosfreqz(sos, frequency, fs=rate)
    variance = integrate.trapezoid(np.abs(response) ** 2, frequency)
    for part in (noise[:, 0], noise[:, -1]):
        assert part.var() == pytest.approx(variance, rel=5 * math.sqrt(2 / count))


# --- drift


def test_charge_drift_is_a_lorentzian_of_its_rms_and_time():
    rate, rms, time = 4096.0, 0.7, 0.5
    drift = Drift[Accel](rms=f"{rms} m/s^2", time=f"{time} s")
    out = _run([Row("c", "a", drift=drift, offset=2.0)], _silence(1 << 23), rate)[0]
    values = out.size / rate / (2 * time)
    assert out.mean() == pytest.approx(2.0, abs=4 * rms / math.sqrt(values))
    assert out.std() == pytest.approx(rms, rel=4 / math.sqrt(2 * values))
    frequency, psd = signal.welch(out, rate, nperseg=1 << 17)
    expected = 4 * rms**2 * time / (1 + (2 * np.pi * frequency * time) ** 2)
    for low, high in ((0.1, 0.3), (0.3, 1.0), (1.0, 3.0)):
        band = (frequency >= low) & (frequency < high)
        averages = 127 * band.sum()
        # 4 sigma; straight lines between knots 1/64 s apart take (pi f / 64)^2 / 3 x 2 < 2 % below 3 Hz
        assert np.mean(psd[band] / expected[band]) == pytest.approx(1.0, abs=4 / math.sqrt(averages) + 0.02)


# --- interference


def test_mains_lines_have_their_amplitudes_and_one_phase_for_all_channels():
    harmonics = {3: 0.5, 4: 0.0, 90: 1.0}
    rows = [
        Row(name, "a", mains=Mains[Accel](amplitude=amplitude, harmonics=harmonics))
        for name, amplitude in (("c", "0.2 m/s^2"), ("d", "0.8 m/s^2"))
    ]
    out = _run(rows, _silence(16_384), 8192.0)
    lines = np.abs(np.fft.rfft(out[0])) * 2 / out.shape[1]
    assert lines[100] == pytest.approx(0.2, rel=1e-5)
    assert lines[300] == pytest.approx(0.1, rel=1e-5)
    rest = np.delete(lines, [100, 300])
    assert rest.max() < 1e-6  # float32; the 90th harmonic, 4500 Hz, is beyond half the rate
    np.testing.assert_allclose(out[1], 4 * out[0], atol=1e-6)


def test_mains_phase_is_exact_after_days():
    clock = PhaseClock(50.0, 65536.0)
    day = 86400 * 65536
    turns = clock.turns(3 * day + 12_345, 40_000)
    exact = np.array([(50 * (3 * day + 12_345 + k)) % 65536 for k in (0, 39_999)]) / 65536
    np.testing.assert_allclose(np.mod(turns[[0, -1]], 1.0), exact, rtol=0, atol=1e-12)


def _bare_pwm(carrier_hz, output_hz, modulation, rate):
    """Sine against triangle, the way an inverter does it, at a rate far above the carrier."""
    time = np.arange(int(rate)) / rate
    triangle = 2 / np.pi * np.arcsin(np.sin(2 * np.pi * carrier_hz * time))
    return np.where(modulation * np.cos(2 * np.pi * output_hz * time) > triangle, 1.0, -1.0)


def test_inverter_lines_are_those_of_pulse_width_modulation():
    carrier, output, index = 4000.0, 50.0, 0.8
    inverter = Inverter[Accel](
        amplitude="1 m/s^2", carrier="4 kHz", output="50 Hz", modulation=index, multiples=3
    )
    out = _run([Row("c", "a", inverter=inverter)], _silence(65536))[0]
    lines = np.abs(np.fft.rfft(out)) * 2 / out.size  # 1 Hz per bin
    assert lines[4000] == pytest.approx(1.0, rel=1e-3)
    # Bessel amplitudes (Holmes and Lipo), times m for the capacitance
    for m in (1, 2, 3):
        for n in range(-6, 7):
            amplitude = special.jv(abs(n), m * np.pi * index / 2) if (m + n) % 2 else 0.0
            amplitude /= special.jv(0, np.pi * index / 2)
            assert lines[round(m * carrier + n * output)] == pytest.approx(abs(amplitude), abs=2e-3)
    # and against a comparator: its derivative, so each line times its frequency
    rate = 4_000_000.0
    bare = np.abs(np.fft.rfft(_bare_pwm(carrier, output, index, rate))) * np.arange(int(rate) // 2 + 1)
    bare /= bare[4000]
    for m, n in ((1, 2), (1, -2), (2, 1), (2, -3), (3, 0), (3, 2)):
        place = round(m * carrier + n * output)
        # The model leaves out the slow change of the duty cycle, n output / (m carrier) < 5 % of a line; a
        # comparator at 4 MHz errs by a sample in the 1000 of a carrier period.
        assert lines[place] == pytest.approx(bare[place], rel=0.06, abs=0.01)


def test_inverter_groups_beyond_the_band_are_left_out():
    inverter = Inverter[Accel](amplitude="1 m/s^2", carrier="10 kHz", multiples=8)
    out = _run([Row("c", "a", inverter=inverter)], _silence(65536))[0]
    lines = np.abs(np.fft.rfft(out)) * 2 / out.size
    assert lines[10_000] > 0.9
    near = np.abs(np.arange(lines.size)[:, None] - np.array([10_000, 20_000, 30_000])).min(axis=1)
    assert lines[near > 1500].max() < 1e-3  # 40 kHz would fold to 25.5 kHz


# --- dropouts


def _bursts(values):
    lost = np.concatenate([[False], values == 0.0, [False]])
    edges = np.flatnonzero(np.diff(lost.astype(int)))
    return edges[::2], edges[1::2]


def test_dropouts_come_and_last_as_they_should():
    rate = 10_000.0
    row = Row("c", "a", dropouts=Dropouts(rate="2 Hz", duration="20 ms"))
    out = _run([row], np.ones((2, 10_000_000)), rate)[0]
    starts, ends = _bursts(out)
    count = starts.size
    mean = 10_000_000 / ((0.5 + 0.02) * rate)  # a burst per gap and length
    assert count == pytest.approx(mean, abs=4 * math.sqrt(mean))
    lengths = (ends - starts)[:-1] / rate
    gaps = (starts[1:] - ends[:-1]) / rate
    for values, expected in ((lengths, 0.02), (gaps, 0.5)):
        assert values.mean() == pytest.approx(expected, rel=4 / math.sqrt(count))
        assert values.std() == pytest.approx(expected, rel=8 / math.sqrt(count))  # exponential
    assert set(np.unique(out)) == {0.0, 1.0}


def test_dropouts_hold_or_lie_at_the_rail():
    rate = 10_000.0
    ramp = np.vstack([np.arange(200_000) / 200_000] * 2)
    zero, hold, rail = _run(
        [
            Row("c", "a", full_scale=5.0, dropouts=Dropouts(rate="2 Hz", duration="20 ms", shows=shows))
            for shows in ("zero", "hold", "rail")
        ],
        ramp,
        rate,
    )
    starts, ends = _bursts(zero[1:])
    assert starts.size > 10
    for start, end in zip(starts + 1, ends + 1, strict=True):
        np.testing.assert_allclose(hold[start:end], ramp[0, start - 1], rtol=1e-6)
        assert np.all(rail[start:end] == 5.0)
    kept = zero != 0.0
    np.testing.assert_array_equal(hold[kept], zero[kept])


# --- overload


def test_overload_leaks_and_recovers_exponentially():
    limit, leak, recovery = 10.0, 2e-3, 20e-3
    row = Row("c", "a", full_scale=limit, overload=Overload(leak="2 ms", recovery="20 ms"))
    motion = np.zeros((2, 20_000))
    motion[0, 1000:1100] = 25.0
    out = _run([row], motion)[0]
    assert np.all(out[:1000] == 0.0)
    assert np.all(out[1000:1100] == limit)
    # During the overload e' = -(e - ...): d' = (15 - d) / leak - d / recovery from 0
    speed = 1 / leak + 1 / recovery
    shift = 15.0 / leak / speed * (1 - math.exp(-speed * 100 / RATE))
    # explicit steps of 1/131 of the time constant: half of that off
    assert out[1100] == pytest.approx(-shift, rel=0.5 / leak / RATE * 2)
    after = np.arange(15_000)
    np.testing.assert_allclose(
        out[1100:16_100], out[1100] * np.exp(-after / RATE / recovery), rtol=1e-4, atol=1e-6
    )


def test_no_overload_no_change():
    motion = np.random.default_rng(1).uniform(-5, 5, (2, 3000))
    with_it = _run([Row("c", "a", full_scale=5.0, overload=Overload())], motion)
    np.testing.assert_array_equal(with_it, _run([Row("c", "a", full_scale=5.0)], motion))


# --- all together


def test_portions_change_no_bit_of_any_effect():
    motion = np.random.default_rng(0).standard_normal((2, 70_000)) * 20
    rows = [_full("c"), _full("d", dropouts=Dropouts(rate="20 Hz", shows="rail"), noise_corner_hz=None)]
    whole = _run(rows, motion)
    rng = np.random.default_rng(3)
    cuts = np.unique(np.concatenate([rng.integers(1, 70_000, 120), [1, 2, 3, 16_384, 16_385]]))
    np.testing.assert_array_equal(_run(rows, motion, cuts=cuts), whole)


def test_channels_do_not_disturb_each_other_and_have_their_own_randomness():
    motion = np.random.default_rng(0).standard_normal((2, 20_000)) * 5
    alone = _run([_full("c")], motion)[0]
    both = _run([Row("x", "b", noise_density=1.0), _full("b"), _full("c")], motion)
    np.testing.assert_array_equal(both[2], alone)
    assert not np.array_equal(both[1], both[2])
    assert not np.array_equal(_run([_full("c")], motion, seed=2)[0], alone)


def test_effects_that_are_off_leave_every_bit():
    motion = np.random.default_rng(0).standard_normal((2, 3000)) * 20
    row = Row(
        "c",
        "a",
        noise_density=0.0,
        noise_corner_hz=100.0,
        drift=Drift[Accel](rms="0 m/s^2"),
        mains=Mains[Accel](amplitude="0 m/s^2"),
        inverter=Inverter[Accel](amplitude="0 m/s^2"),
    )
    assert [name for name, build in STAGES if build([row], RATE, 0).active] == []
    np.testing.assert_array_equal(_run([row], motion)[0], motion[0].astype(np.float32))


@pytest.mark.parametrize(
    ("row", "message"),
    [
        (
            Row("c", "a", high_pass=HighPass(corner="600 Hz")),
            "high_pass.corner: got 600.0, expected at most a qu",
        ),
        (
            Row("c", "a", noise_density=1.0, noise_corner_hz=300.0),
            "noise_corner: got 300.0, expected at most an",
        ),
        (
            Row("c", "a", mains=Mains[Accel](amplitude="1 m/s^2", frequency="1 kHz")),
            "below half the rate at whi",
        ),
        (
            Row("c", "a", inverter=Inverter[Accel](amplitude="1 m/s^2")),
            "inverter.carrier: got 4000.0, expected b",
        ),
        (Row("c", "a", dropouts=Dropouts(rate="1 Hz", shows="rail")), "rail, without a range"),
        (Row("c", "a", overload=Overload()), "overload without a range"),
        (
            Row("c", "a", full_scale=1.0, overload=Overload(leak="1 ms")),
            "overload.leak: got 0.001, expected at l",
        ),
    ],
)
def test_numbers_that_do_not_fit_the_rate_are_told(row, message):
    with pytest.raises(InputError, match=message) as caught:
        MeasuringChain([row], ("a", "b"), 2000.0, 1)
    assert "sensor c" in str(caught.value)
