"""Errors of tachos and encoders: counted, averaged over turns, and against closed forms."""

import itertools
import math

import numpy as np
import pytest
from rig_double import RigDouble
from scipy import signal, stats

from gearsim_io.errors import InputError
from gearsim_io.quantities import validate
from gearsim_sim.sensors.coupling import Coupling, SwingingEncoder
from gearsim_sim.sensors.edges import EdgeFinder
from gearsim_sim.sensors.marks import MarkReader, Pickup, mark_errors

RATE = 16_384.0
SPEED_HZ = 10.0


class _Steady:
    """A shaft at constant speed."""

    def __init__(self, speed_hz=SPEED_HZ, start=0.0555):
        self.speed_hz, self.start = speed_hz, start

    def angle_turns(self, k):
        return self.start + self.speed_hz / RATE * np.asarray(k, dtype=float)

    def speed(self, k):
        return np.full(np.shape(k), self.speed_hz)


def _read(pickup, marks, samples, shaft=None, cuts=(), seed=1, name="tacho input"):
    """All pulses of a run in sample indices, and the counter's number of the first."""
    shaft = shaft or _Steady()
    reader = MarkReader(name, marks, 0.0, pickup, RATE, seed)
    pulses, first = [], None
    for start, stop in itertools.pairwise([0, *cuts, samples]):
        begin, end = reader.stretch(stop - start)
        k = np.arange(start + begin, start + end + 1)
        angle = shaft.angle_turns(k)
        whole = np.floor(angle)
        number, offsets = reader.read(
            whole.astype(np.int64), angle - whole, shaft.speed(k) / RATE, stop - start
        )
        first = number if first is None else first
        assert number == first + sum(map(len, pulses))
        assert np.all((offsets >= 0) & (offsets < stop - start))
        assert np.all(np.diff(offsets) > 0)
        pulses.append(offsets + start)
    return first, np.concatenate(pulses)


def _clean(marks, samples, shaft=None):
    return _read(Pickup(), marks, samples, shaft)[1]


def test_everything_off_is_the_edge_finder():
    double = RigDouble(RATE)
    k = np.arange(8193)
    angle = double.angle_turns(k)
    whole = np.floor(angle)
    first, exact = EdgeFinder(900).find(whole.astype(np.int64), angle - whole, double.speed(k) / RATE)
    number, pulses = _read(Pickup(), 900, 8192, double)
    assert number == first
    np.testing.assert_array_equal(pulses, exact)


@pytest.mark.parametrize("marks", [1, 60])
def test_jitter_is_normal_white_and_of_its_size(marks):
    jitter = 20e-6
    samples = 200 * 16_384 // marks
    clean, shaken = _clean(marks, samples), _read(Pickup(jitter="20 us"), marks, samples)[1]
    error = (shaken - clean[: shaken.size]) / RATE
    count = error.size
    assert count >= 1900
    assert error.std() == pytest.approx(jitter, rel=4 / math.sqrt(2 * count))
    assert abs(error.mean()) < 4 * jitter / math.sqrt(count)
    assert abs(np.corrcoef(error[:-1], error[1:])[0, 1]) < 4 / math.sqrt(count)
    assert stats.kstest(error / jitter, "norm").pvalue > 1e-3


def test_jitter_over_many_seeds_at_one_pulse():
    first = [_read(Pickup(jitter="20 us"), 1, 4096, seed=seed)[1][0] for seed in range(400)]
    error = np.array(first) / RATE - 0.9445 / SPEED_HZ
    assert error.std() == pytest.approx(20e-6, rel=4 / math.sqrt(800))


def test_delay_is_a_shift():
    clean, late = _clean(1, 50_000), _read(Pickup(delay="1.7 ms"), 1, 50_000)[1]
    np.testing.assert_allclose(late, clean[: late.size] + 1.7e-3 * RATE, atol=1e-6)


def test_missing_and_double_pulses_come_with_their_probabilities():
    marks, samples, p = 60, 30 * 16_384, 0.07
    clean = _clean(marks, samples)
    count = clean.size
    sigma = math.sqrt(count * p * (1 - p))
    _, fewer = _read(Pickup(missing=p), marks, samples)
    assert abs(count - fewer.size - count * p) < 4 * sigma
    assert np.all(np.isin(fewer, clean))
    # independent: a miss after a miss is as likely as any
    missed = ~np.isin(clean, fewer)
    assert missed[1:][missed[:-1]].mean() == pytest.approx(p, abs=4 * math.sqrt(p / missed.sum()))
    _, more = _read(Pickup(double=p, double_after="150 us"), marks, samples)
    assert abs(more.size - count - count * p) < 4 * sigma
    extra = more[~np.isin(more, clean)]
    before = clean[np.searchsorted(clean, extra) - 1]
    np.testing.assert_allclose(extra - before, 150e-6 * RATE, atol=1e-6)


def test_a_counter_counts_what_it_sees():
    first, pulses = _read(Pickup(missing_marks=(17, 500)), 900, 16_384)
    clean = _clean(900, 16_384)
    assert first == 50  # the shaft starts at 0.0555 turns
    numbers = 50 + np.arange(clean.size)
    kept = ~np.isin(numbers % 900, (17, 500))
    np.testing.assert_array_equal(pulses, clean[kept])
    assert clean.size - pulses.size == 20  # two in each of ten turns


def test_timestamps_come_from_the_next_tick_of_a_clock():
    clock = 20_000.0
    _, pulses = _read(Pickup(clock="20 kHz"), 60, 100_000)
    clean = _clean(60, 100_000)
    ticks = pulses / RATE * clock
    np.testing.assert_allclose(ticks, np.rint(ticks), atol=1e-6)
    late = (pulses - clean[: pulses.size]) / RATE * clock
    assert late.min() > -1e-6
    assert late.max() < 1 + 1e-6


def test_quantised_times_have_the_variance_of_a_uniform_error():
    shaft = _Steady(speed_hz=10.123456789)
    _, pulses = _read(Pickup(clock="20 kHz"), 60, 400_000, shaft)
    late = (pulses - _clean(60, 400_000, shaft)[: pulses.size]) / RATE * 20_000
    assert late.std() == pytest.approx(1 / math.sqrt(12), rel=0.02)
    assert late.mean() == pytest.approx(0.5, abs=0.02)


def test_two_pulses_within_a_tick_are_one():
    _, pulses = _read(Pickup(clock="1 kHz"), 900, 16_384)
    assert pulses.size == 999  # ticks within a second


@pytest.mark.parametrize("marks", [60, 900])
def test_line_errors_are_recovered_by_averaging_over_turns(marks):
    pickup = Pickup(mark_error=0.02, eccentricity="0.001 rad", jitter="1 us")
    turns = 40
    first, edges = _read(pickup, marks, round((turns + 1) * RATE / SPEED_HZ), name="encoder input")
    angle = _Steady().angle_turns(edges)
    index = first + np.arange(edges.size)
    error = angle - index / marks
    whole = slice(-first % marks, -first % marks + (turns - 1) * marks)
    found = error[whole].reshape(-1, marks).mean(axis=0)
    true = mark_errors("encoder input", marks, pickup, 1)
    # Jitter of 1 us is 1e-5 turns; 39 turns average it; 5 sigma for the largest of 900.
    np.testing.assert_allclose(found, true, atol=5 * 1e-5 / math.sqrt(turns - 1))
    once = np.abs(np.fft.rfft(true))[1] * 2 / marks
    assert once == pytest.approx(
        0.001 / (2 * np.pi), rel=4 * 0.02 / marks * 2 * np.pi / 1e-3 / math.sqrt(marks)
    )
    rest = np.fft.irfft(np.concatenate([[0, 0], np.fft.rfft(true)[2:]]), marks)
    assert rest.std() == pytest.approx(0.02 / marks, rel=4 / math.sqrt(2 * marks))


def test_coupling_is_a_torsional_resonance():
    """A shaft that shakes at one frequency: amplitude and phase of the encoder over those of the shaft."""
    resonance_hz, q = 400.0, 15.0
    w0 = 2 * np.pi * resonance_hz
    for frequency in (50.0, 380.0, 400.0, 450.0, 1200.0):
        k = np.arange(3 * 16_384 + 1)
        w = 2 * np.pi * frequency
        swing = SwingingEncoder("x", Coupling(resonance=f"{resonance_hz} Hz", q=q), RATE)
        shaft = 1e-4 * np.sin(w * k / RATE)
        speed = SPEED_HZ / RATE + 1e-4 * w / RATE * np.cos(w * k / RATE)
        angle, rate = swing.swing(SPEED_HZ / RATE * k + shaft, speed)
        steady = slice(-16_384, None)
        wave = np.exp(-1j * w * k / RATE)
        motion = (angle - SPEED_HZ / RATE * k)[steady] @ wave[steady] / (shaft[steady] @ wave[steady])
        s = 1j * w
        exact = (w0**2 + s * w0 / q) / (s**2 + s * w0 / q + w0**2)
        # Straight lines of speed between samples: (w / rate)^2 / 12 of the twist.
        assert abs(motion - exact) < 2e-3 + abs(exact - 1) * ((w / RATE) ** 2 / 6 + 1e-3)
        turning = (
            (rate - SPEED_HZ / RATE)[steady]
            @ wave[steady]
            / ((speed - SPEED_HZ / RATE)[steady] @ wave[steady])
        )
        assert abs(turning - exact) < 2e-3 + abs(exact - 1) * ((w / RATE) ** 2 / 6 + 1e-3)


def test_coupling_twists_by_the_static_angle_under_constant_acceleration():
    swing = SwingingEncoder("x", Coupling(resonance="500 Hz", q=0.5), RATE)
    k = np.arange(3001)
    gain = 100.0 / RATE**2  # 100 turns/s^2
    angle, _ = swing.swing(0.5 * gain * k**2, gain * k)
    assert angle[-1] - 0.5 * gain * 3000**2 == pytest.approx(-100.0 / (2 * np.pi * 500) ** 2, rel=1e-6)


def test_coupling_shows_in_the_pulses():
    double = RigDouble(RATE, start_turns=0.01)  # mesh ripple at 320 Hz, 2e-5 turns
    samples = 5 * 16_384
    _, plain = _read(Pickup(), 900, samples, double)
    _, swinging = _read(Pickup(coupling=Coupling(resonance="320 Hz", q=10)), 900, samples, double)
    count = min(plain.size, swinging.size)
    late = (plain[:count] - swinging[:count])[-9000:] * SPEED_HZ / RATE
    # Q - i times the ripple beside the shaft's own: |H - 1| = Q at resonance
    assert np.abs(late).max() == pytest.approx(2e-5 * 10, rel=0.1)


PICKUPS = [
    Pickup(jitter="200 us", missing=0.05, double=0.05),
    Pickup(jitter="1 ms", double=0.1, delay="3 ms", clock="50 kHz"),
    Pickup(
        mark_error=0.05, eccentricity="0.01 rad", missing_marks=(3,), coupling=Coupling(resonance="300 Hz")
    ),
]


@pytest.mark.parametrize("pickup", PICKUPS)
@pytest.mark.parametrize("marks", [5, 300])
def test_portions_change_nothing(pickup, marks):
    double = RigDouble(RATE, start_turns=0.1234)
    whole = _read(pickup, marks, 20_000, double)
    rng = np.random.default_rng(2)
    cuts = tuple(np.unique(np.concatenate([rng.integers(1, 20_000, 40), [1, 2, 3]])))
    cut = _read(pickup, marks, 20_000, double, cuts)
    assert whole[0] == cut[0]
    assert whole[1].size == cut[1].size > 20
    # Offsets count from another sample, so only rounding may differ.
    np.testing.assert_allclose(cut[1], whole[1], rtol=0, atol=1e-10)


def test_seeds_and_names_have_their_own_numbers():
    pickup = Pickup(jitter="20 us", mark_error=0.01)
    runs = [
        _read(pickup, 60, 16_384)[1],
        _read(pickup, 60, 16_384, seed=2)[1],
        _read(pickup, 60, 16_384, name="tacho output")[1],
    ]
    np.testing.assert_array_equal(runs[0], _read(pickup, 60, 16_384)[1])
    for left, right in itertools.combinations(runs, 2):
        count = min(left.size, right.size)
        assert not np.array_equal(left[:count], right[:count])


def test_a_swinging_shaft_still_makes_no_second_edge_of_a_mark_that_lies_off():
    k = np.arange(2001)
    angle = 0.3 + 0.4 * np.sin(2 * np.pi * k / 1000)
    speed = 0.4 * 2 * np.pi / 1000 * np.cos(2 * np.pi * k / 1000)
    errors = np.linspace(-0.03, 0.03, 10)
    first, offsets = EdgeFinder(10, 0.0, errors).find(
        np.floor(angle).astype(np.int64), angle - np.floor(angle), speed
    )
    passed = [j for j in range(10) if 0.3 <= j / 10 + errors[j] < 0.7]
    assert first == passed[0]
    assert offsets.size == len(passed)
    np.testing.assert_allclose(
        0.3 + 0.4 * np.sin(2 * np.pi * offsets / 1000), np.array(passed) / 10 + errors[passed], atol=1e-9
    )


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"jitter": "1 s"}, "jitter: got 1 s, expected a number in s, >= 0 and <= 0.001"),
        ({"missing": 0.95}, "missing: got 0.95"),
        ({"mark_error": 0.2}, "mark_error: got 0.2"),
        (
            {"clock": "10 Hz"},
            "clock: got 10 Hz, expected a number in Hz, >= 1000 and <= 1e+10, or off".replace("+", r"\+"),
        ),
        ({"coupling": {"q": 3}}, "coupling.resonance: got nothing"),
    ],
)
def test_bad_pickups_are_told(content, message):
    with pytest.raises(InputError, match=message):
        validate(Pickup, content, "s.yaml")


def test_pickups_that_do_not_fit_are_told():
    with pytest.raises(
        InputError, match=r"sensor tacho x: missing_marks: got 60, expected a mark from 0 to 59"
    ):
        MarkReader("tacho x", 60, 0.0, Pickup(missing_marks=(60,)), RATE, 1)
    with pytest.raises(InputError, match="at least one mark that is seen"):
        MarkReader("tacho x", 1, 0.0, Pickup(missing_marks=(0,)), RATE, 1)
    with pytest.raises(InputError, match="at most a quarter of the sample rate, 4096 Hz"):
        MarkReader("tacho x", 1, 0.0, Pickup(coupling=Coupling(resonance="5 kHz")), RATE, 1)


def test_white_jitter_has_a_flat_spectrum():
    _, shaken = _read(Pickup(jitter="20 us"), 60, 100 * 16_384)
    error = shaken - np.polyval(np.polyfit(np.arange(shaken.size), shaken, 1), np.arange(shaken.size))
    _, psd = signal.welch(error, nperseg=256)
    parts = [part.mean() for part in np.array_split(psd[2:-2], 4)]
    assert max(parts) / min(parts) < 1.1
