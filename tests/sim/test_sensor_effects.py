"""Each effect on the signal against its closed form or scipy, and all effects together."""

import math

import numpy as np
import pytest
from chain_runs import RATE, run_chain
from scipy import signal

from gearsim_io.errors import InputError
from gearsim_sim.sensors.chain import STAGES, MeasuringChain
from gearsim_sim.sensors.drift import Drift
from gearsim_sim.sensors.dropouts import Dropouts
from gearsim_sim.sensors.gain import Temperature
from gearsim_sim.sensors.highpass import HighPass
from gearsim_sim.sensors.interference import Inverter, Mains
from gearsim_sim.sensors.mounting import Mounting, mountings, resonance
from gearsim_sim.sensors.overload import Overload
from gearsim_sim.sensors.rows import Row
from gearsim_sim.sensors.settings import Accel


def _impulse(samples):
    motion = np.zeros((2, samples))
    motion[0, 0] = 1.0
    return motion


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
    gain = np.abs(np.fft.rfft(run_chain([row], _impulse(1 << 15))[0]))
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
    out = run_chain([row], motion)[0]
    b, a = signal.butter(order, corner, "highpass", fs=RATE)
    np.testing.assert_allclose(out, signal.lfilter(b, a, motion[0]), rtol=1e-5, atol=1e-5)
    if order == 1:
        time = np.arange(4000) / RATE
        np.testing.assert_allclose(out[:4000], np.exp(-2 * np.pi * corner * time), atol=2 * corner / RATE * 4)


# --- gain, temperature


def test_gain_error_and_cross_axis_sensitivity():
    motion = np.random.default_rng(0).standard_normal((2, 500))
    out = run_chain([Row("c", "a", gain_error=-0.05, cross_axis=(("b", 0.03),))], motion)[0]
    np.testing.assert_allclose(out, 0.95 * (motion[0] + 0.03 * motion[1]), rtol=1e-6, atol=1e-6)


def test_any_direction_is_a_sum_of_sites():
    motion = np.random.default_rng(0).standard_normal((2, 500))
    c, s = math.cos(0.3), math.sin(0.3)
    out = run_chain([Row("c", (("a", c), ("b", s)))], motion)[0]
    np.testing.assert_allclose(out, c * motion[0] + s * motion[1], rtol=1e-6, atol=1e-7)


def test_warming_changes_the_sensitivity_exponentially_and_shifts_the_zero():
    rate = 1000.0
    heat = Temperature(coefficient="0.01 1/K", offset="-5 K", rise="40 K", time="10 s")
    motion = np.vstack([np.ones(60_000), np.zeros(60_000)])
    row = Row("c", "a", temperature=heat, zero_per_k=0.2)
    out = run_chain([row], motion, rate)[0]
    kelvin = -5.0 + 40.0 * (1.0 - np.exp(-np.arange(60_000) / rate / 10.0))
    # Straight lines between knots of a 32nd of the time constant or less: (1/32)^2 / 8 of the rise at most.
    np.testing.assert_allclose(out, 1.0 + 0.01 * kelvin + 0.2 * kelvin, atol=0.21 * 40 / 32**2 / 8 + 1e-6)


def test_wandering_temperature_has_its_standard_deviation_and_memory():
    rate = 1000.0
    heat = Temperature(coefficient="0.01 1/K", wander="3 K", wander_time="1 s")
    motion = np.vstack([np.ones(4_000_000), np.zeros(4_000_000)])
    kelvin = (run_chain([Row("c", "a", temperature=heat)], motion, rate)[0] - 1.0) / 0.01
    # 4000 s with a memory of 1 s: 2000 independent values, and Gaussian: 4 sigma of the estimates.
    assert kelvin.std() == pytest.approx(3.0, rel=4 * math.sqrt(0.5 / 2000))
    lag = np.mean(kelvin[:-1000] * kelvin[1000:]) / kelvin.var()
    assert lag == pytest.approx(math.exp(-1.0), abs=4 / math.sqrt(2000))


# --- overload


def test_overload_leaks_and_recovers_exponentially():
    limit, leak, recovery = 10.0, 2e-3, 20e-3
    row = Row("c", "a", full_scale=limit, overload=Overload(leak="2 ms", recovery="20 ms"))
    motion = np.zeros((2, 20_000))
    motion[0, 1000:1100] = 25.0
    out = run_chain([row], motion)[0]
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
    with_it = run_chain([Row("c", "a", full_scale=5.0, overload=Overload())], motion)
    np.testing.assert_array_equal(with_it, run_chain([Row("c", "a", full_scale=5.0)], motion))


# --- all together


def test_portions_change_no_bit_of_any_effect():
    assert all(build([_full("c")], RATE, 0).active for _, build in STAGES)
    motion = np.random.default_rng(0).standard_normal((2, 70_000)) * 20
    rows = [_full("c"), _full("d", dropouts=Dropouts(rate="20 Hz", shows="rail"), noise_corner_hz=None)]
    whole = run_chain(rows, motion)
    rng = np.random.default_rng(3)
    cuts = np.unique(np.concatenate([rng.integers(1, 70_000, 120), [1, 2, 3, 16_384, 16_385]]))
    np.testing.assert_array_equal(run_chain(rows, motion, cuts=cuts), whole)


def test_channels_do_not_disturb_each_other_and_have_their_own_randomness():
    motion = np.random.default_rng(0).standard_normal((2, 20_000)) * 5
    alone = run_chain([_full("c")], motion)[0]
    both = run_chain([Row("x", "b", noise_density=1.0), _full("b"), _full("c")], motion)
    np.testing.assert_array_equal(both[2], alone)
    assert not np.array_equal(both[1], both[2])
    assert not np.array_equal(run_chain([_full("c")], motion, seed=2)[0], alone)


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
    np.testing.assert_array_equal(run_chain([row], motion)[0], motion[0].astype(np.float32))


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
