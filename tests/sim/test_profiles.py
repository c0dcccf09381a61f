"""Operating profiles: closed forms, energy, measured traces, continuity at joints, random loads."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from gearsim_io.errors import InputError
from gearsim_io.quantities import validate
from gearsim_sim.profile.build import DriveLimits, Wanted, build_profile
from gearsim_sim.profile.curve import Constant, Laid, Stretch, hermite_stretch, ramp_from, ramp_stretch
from gearsim_sim.profile.dynamics import LawLoad, Rotor, TorqueSpeed, settles_at
from gearsim_sim.profile.laws import ConstantMotor, ControlledMotor, CurveMotor, LoadShape
from gearsim_sim.profile.noise import RandomLoad
from gearsim_sim.profile.profile import Profile
from gearsim_sim.profile.settings import ProfileModel
from gearsim_sim.profile.trace import Trace, read_columns, trace_curve

STEP_S = 1 / 262144
J, RATIO = 0.96, 0.5
UNLOADED = Constant(0.0)
FLAT = LoadShape(1.0, 0.0, 0.0, 10.0)


def plain_ramp(since, steps):
    """Value, slope and integral of the smooth rise, written out."""
    u = min(max(since / steps, 0.0), 1.0)
    beyond = max(since - steps, 0.0)
    value = 10 * u**3 - 15 * u**4 + 6 * u**5
    return value, 30 * (u - u * u) ** 2 / steps, (2.5 * u**4 - 3 * u**5 + u**6) * steps + beyond


def plain_fading_slope(since, steps):
    """The same of what a slope of one per step at the start adds."""
    u = min(since / steps, 1.0)
    value = (u - 6 * u**3 + 8 * u**4 - 3 * u**5) * steps
    slope = 1 - 18 * u**2 + 32 * u**3 - 15 * u**4
    return value, slope, (u**2 / 2 - 1.5 * u**4 + 1.6 * u**5 - 0.5 * u**6) * steps**2


def seconds(time_s):
    return round(time_s / STEP_S)


def profile(speed, load, noise=None):
    return Profile(speed, load, STEP_S, RATIO, J, noise)


def walk(course, first, last):
    """The segments from a step to another; each must cover the step that asked for it."""
    step, found = first, []
    while step < last:
        segment = course.segment(step)
        assert segment.start_step <= step < segment.end_step
        found.append(segment)
        step = segment.end_step
    return found


def assert_smooth(segments, accel_scale):
    """Speed and acceleration run on where a segment takes over, torques too: to rounding."""
    for a, b in itertools.pairwise(segments):
        at = b.start_step
        assert a.start_step < at <= a.end_step
        assert b.speed_hz(at) == pytest.approx(a.speed_hz(at), abs=1e-9)
        jump = b.acceleration_hz_per_s(at) - a.acceleration_hz_per_s(at)
        assert abs(jump) < 1e-6 * accel_scale
        assert b.load[0] == pytest.approx(a.load_nm(at), abs=1e-7)
        motor = np.polynomial.polynomial.polyval((at - a.start_step) / a.length_steps, a.motor)
        assert b.motor[0] == pytest.approx(motor, abs=1e-5 * accel_scale)


def test_a_constant_point_is_exact_and_steady():
    course = profile(Constant(10.0), Constant(50.0))
    for step in (-70000, 0, 65535, 65536, 86400 * 262144 + 5):
        segment = course.segment(step)
        assert segment.steady
        assert segment.turns_at(step) == pytest.approx((step - segment.start_step) * STEP_S * 10.0, rel=1e-15)
        assert (segment.load[0], segment.motor[0]) == (50.0, 25.0)


def test_a_ramp_is_the_polynomial_it_was():
    """Against the formulas of the value, slope and integral of a ramp that begins during another."""
    start, steps = 777, 200000.0
    first = Laid([ramp_stretch(0.0, 3000.0, 6.0, 14.0)], 6.0, 14.0)
    curve = ramp_from(first, start, 9.0, steps)
    slope0 = first.stretch(start).slope(float(start))
    assert slope0 > 1e-3
    course = profile(curve, Constant(30.0))
    turns, at = 0.0, start
    for segment in walk(course, start, start + int(steps) + 1000):
        for step in (segment.start_step, segment.start_step + int(segment.length_steps) // 3):
            since = float(step - start)
            value, slope, integral = plain_ramp(since, steps)
            fade, fade_slope, fade_integral = plain_fading_slope(since, steps)
            before = first.stretch(start).value(float(start))
            change = 9.0 - before
            want = before + change * value + slope0 * fade
            assert segment.speed_hz(step) == pytest.approx(want, abs=1e-11)
            want = (change * slope + slope0 * fade_slope) / STEP_S
            assert segment.acceleration_hz_per_s(step) == pytest.approx(want, abs=1e-7)
            want = STEP_S * (before * since + change * integral + slope0 * fade_integral)
            assert turns + segment.turns_at(step) == pytest.approx(want, abs=1e-12)
        turns += segment.turns_at(segment.end_step)
        at = segment.end_step
    assert at > start + steps
    assert course.speed_at(at) == 9.0


def test_motor_torque_moves_inertia_and_load():
    """Work of the motor = change of kinetic energy + work of the load, for a ramp of both."""
    speed = Laid([ramp_stretch(500.0, 300000.0, 4.0, 12.0)], 4.0, 12.0)
    load = Laid([ramp_stretch(9000.5, 100000.0, 20.0, 60.0)], 20.0, 60.0)
    work, taken = energies(profile(speed, load), 0, 400000)
    kinetic = 0.5 * J * (2 * math.pi) ** 2 * (12.0**2 - 4.0**2)
    assert work == pytest.approx(kinetic + taken, rel=1e-12)


def energies(course, first, last):
    """Work of the motor and work on the load, by quadrature that is exact for these polynomials."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    work = taken = 0.0
    for segment in walk(course, first, last):
        u = 0.5 * (nodes + 1)
        steps = segment.start_step + u * segment.length_steps
        rate = np.array([segment.speed_hz(step) for step in steps]) * 2 * math.pi
        motor = np.polynomial.polynomial.polyval(u, segment.motor)
        load = np.polynomial.polynomial.polyval(u, segment.load)
        scale = 0.5 * weights * segment.length_steps * STEP_S
        work += scale @ (motor * rate)
        taken += RATIO * (scale @ (load * rate))
    return work, taken


def rotor(motor, *, shape=FLAT, rated=UNLOADED, takeover=0.05):
    rise = Laid([ramp_stretch(0.0, takeover / STEP_S, 0.0, 1.0)], 0.0, 1.0)
    return Rotor(motor, shape, rated, rise, J, RATIO, STEP_S)


def test_run_up_from_rest_is_the_exponential():
    """T = T0 (1 - v/v0), no load: v = v0 (1 - exp(-T0/(2 pi J v0) int takeover dt))."""
    line = CurveMotor(np.array([0.0, 40.0]), np.array([30.0, -30.0]))
    speed = TorqueSpeed(rotor(line), 0, 0.0, 0.0, 20.0)
    rate = 30.0 / (2 * math.pi * J * 20.0)
    for step in (0, 5000, seconds(0.05), seconds(0.7), seconds(3.3), seconds(20.0)):
        risen = plain_ramp(float(step), 0.05 / STEP_S)[2] * STEP_S
        want = 20.0 * (1 - math.exp(-rate * risen))
        assert speed.stretch(step).value(float(step)) == pytest.approx(want, abs=2e-8)
    assert speed.stretch(-5).value(-5.0) == 0.0
    assert speed.at_rest() == pytest.approx(20.0, abs=1e-7)
    assert_smooth(walk(profile(speed, Constant(0.0)), -1000, seconds(4.0)), 10.0)


def test_quadratic_load_gives_the_hyperbolic_tangent():
    """2 pi J v' = T - ratio L (v/vr)^2: v = v_inf tanh(k t) with v_inf = vr sqrt(T / (ratio L))."""
    fan = LoadShape(0.0, 0.0, 1.0, 10.0)
    speed = TorqueSpeed(rotor(ConstantMotor(20.0), shape=fan, rated=Constant(50.0)), 0, 0.0, 0.0, 10.0)
    final = 10.0 * math.sqrt(20.0 / (RATIO * 50.0))
    k = 20.0 / (2 * math.pi * J * final)
    for time_s in (0.5, 1.7, 6.0):
        # The takeover's integral lags by half of its length.
        effective = seconds(time_s) * STEP_S - 0.025
        found = speed.stretch(seconds(time_s)).value(float(seconds(time_s)))
        assert found == pytest.approx(final * math.tanh(k * effective), abs=2e-8)
    assert speed.at_rest() == pytest.approx(final, abs=1e-7)


def test_energy_of_torque_dynamics():
    shape = LoadShape(0.2, 0.3, 0.5, 10.0)
    target = Laid([ramp_stretch(0.0, seconds(2.0), 0.0, 10.0)], 0.0, 10.0)
    motor = ControlledMotor(target, 40.0, 0.5, 60.0, STEP_S)
    rated = Laid([ramp_stretch(0.0, 0.05 / STEP_S, 0.0, 50.0)], 0.0, 50.0)
    speed = TorqueSpeed(rotor(motor, shape=shape, rated=rated), 0, 0.0, 0.0, 10.0)
    course = profile(speed, LawLoad(speed, shape, rated))
    end = seconds(6.0)
    work, taken = energies(course, 0, end)
    segment = course.segment(end)
    kinetic = 0.5 * J * (2 * math.pi * segment.speed_hz(segment.start_step)) ** 2
    work, taken = energies(course, 0, segment.start_step)
    assert taken > 100.0
    assert work == pytest.approx(kinetic + taken, rel=1e-10)
    assert speed.at_rest() == pytest.approx(10.0, abs=1e-6)
    for step in range(0, end, 100003):  # the laws themselves, point by point
        v = course.speed_at(step)
        assert course.load_at(step) == pytest.approx(rated.stretch(step).value(step) * shape(v), abs=1e-7)
    assert_smooth(walk(course, -1000, end), 10.0)


def test_torque_dynamics_do_not_depend_on_what_is_asked():
    def solved(steps):
        shape = LoadShape(0.5, 0.5, 0.0, 10.0)
        speed = TorqueSpeed(rotor(ConstantMotor(20.0), shape=shape, rated=Constant(30.0)), 0, 0.0, 0.0, 10.0)
        return {step: speed.stretch(step) for step in steps}

    steps = [5, seconds(0.4), seconds(2.5), seconds(7.0)]
    assert solved(steps) == {step: solved([step])[step] for step in reversed(steps)}


def test_another_load_during_torque_dynamics():
    """More load from 3 s on: speed and acceleration run on, and end where the torques meet."""
    shape = LoadShape(0.0, 1.0, 0.0, 10.0)
    line = CurveMotor(np.array([0.0, 20.0]), np.array([60.0, -60.0]))
    before = rotor(line, shape=shape, rated=Constant(20.0))
    speed = TorqueSpeed(before, 0, 0.0, 0.0, 10.0)
    step = seconds(3.0)
    rated = ramp_from(before.rated_nm, step, 60.0, 50000.0)
    after = speed.with_rated(step, rated)
    old, new = speed.stretch(step), after.stretch(step)
    assert new.value(float(step)) == pytest.approx(old.value(float(step)), abs=1e-10)
    assert new.slope(float(step)) == pytest.approx(old.slope(float(step)), abs=1e-13)
    # 60 (1 - v/10) = 0.5 * 60 v/10
    assert after.at_rest() == pytest.approx(60 / 9, abs=1e-7)


def test_a_motor_that_is_too_weak_settles_below():
    fan = LoadShape(0.0, 0.0, 1.0, 10.0)
    weak = rotor(ConstantMotor(10.0), shape=fan)
    assert settles_at(weak, 0.0, 50.0, 30.0) == pytest.approx(10.0 * math.sqrt(0.4), rel=1e-9)
    assert settles_at(rotor(ConstantMotor(10.0)), 0.0, 0.0, 30.0) == math.inf
    assert settles_at(rotor(ConstantMotor(10.0)), 8.0, 50.0, 30.0) < 0.05  # it crawls


def measured(points, noise=0.0):
    time_s = np.linspace(0.0, 8.0, points)
    clean = 10 + 3 * np.sin(2 * np.pi * 0.3 * time_s) * np.exp(-time_s / 6)
    return time_s, clean + noise * np.random.default_rng(3).standard_normal(points)


def test_a_measured_trace_is_met_at_its_points_and_between():
    time_s, speed = measured(81)
    curve = trace_curve(Trace("t.csv", time_s, speed).checked("speed", None), STEP_S, 0.0, "speed")
    course = profile(curve, Constant(20.0))
    for t, v in zip(time_s, speed, strict=True):
        assert course.speed_at(seconds(t)) == pytest.approx(v, abs=20 * STEP_S)  # 2 us of 9 Hz/s at most
    fine_t, fine_v = measured(8001)
    found = np.array([course.speed_at(seconds(t)) for t in fine_t])
    assert np.abs(found - fine_v).max() < 1e-4  # degree 5 through 33 points per period
    segments = walk(course, -80000, seconds(9.0))
    assert_smooth(segments, 6.0)
    assert segments[0].speed_hz(segments[0].start_step) == speed[0]
    assert segments[-1].speed_hz(segments[-1].end_step) == pytest.approx(speed[-1], abs=1e-12)


def test_a_noisy_trace_is_smoothed_to_its_tolerance():
    time_s, speed = measured(801, noise=0.02)
    curve = trace_curve(Trace("t.csv", time_s, speed), STEP_S, 0.02, "speed")
    found = np.array([curve.stretch(seconds(t)).value(t / STEP_S) for t in time_s[1:-1]])
    assert np.sqrt(np.mean((found - speed[1:-1]) ** 2)) == pytest.approx(0.02, rel=0.05)
    assert np.std(found - measured(801)[1][1:-1]) < 0.007  # far nearer to the truth than the points are
    rough = trace_curve(Trace("t.csv", time_s, speed), STEP_S, 0.0, "speed")
    accelerations = [
        max(abs(one.stretch(s).slope(float(s))) for s in range(0, seconds(8.0), 997)) / STEP_S
        for one in (curve, rough)
    ]
    assert accelerations[0] == pytest.approx(3 * 2 * np.pi * 0.3, rel=0.05)  # the clean curve's at 0 s
    assert accelerations[1] > 30


def test_a_trace_through_rest_stays_at_rest():
    """Start, stop, stand and start again: never below zero, exactly zero in between."""
    speed = np.array([0, 0, 2, 5, 8, 9, 8, 5, 2, 0, 0, 0, 3, 6, 7, 7.0])
    time_s = np.arange(speed.size) * 0.5
    curve = trace_curve(Trace("t.csv", time_s, speed).checked("speed", None), STEP_S, 0.0, "speed")
    for time in (0.0, 0.3, 4.6, 5.0, 5.4):
        assert curve.stretch(seconds(time)).value(float(seconds(time))) == 0.0
    assert curve.stretch(seconds(2.5)).value(2.5 / STEP_S) == pytest.approx(9.0)
    segments = walk(profile(curve, Constant(20.0)), -1000, seconds(8.0))
    assert_smooth(segments, 6.0)
    assert (
        min(
            s.speed_hz(at) for s in segments for at in (s.start_step, s.start_step + int(s.length_steps) // 2)
        )
        > -1e-9
    )


def test_a_trace_that_ends_at_rest_stands_there():
    speed = np.array([6, 6.1, 6, 5, 3, 1, 0.0])
    curve = trace_curve(Trace("t.csv", np.arange(7.0), speed), STEP_S, 0.0, "speed")
    assert curve.stretch(seconds(6.5)).value(float(seconds(6.5))) == pytest.approx(0.0, abs=1e-9)
    assert_smooth(walk(profile(curve, Constant(20.0)), -1000, seconds(7.0)), 6.0)


@pytest.mark.parametrize(
    ("time_s", "values", "field"),
    [
        ([0, 1, 2, 3, np.nan], [1, 2, 3, 4, 5], "speed"),
        ([0, 1, 2, 3, 4], [1, 2, np.nan, 4, 5], "speed"),
        ([-1, 0, 1, 2, 3], [1, 2, 3, 4, 5], "time"),
        ([0, 1, 1, 2, 3], [1, 2, 3, 4, 5], "time"),
        ([0, 1, 2, 3, 14], [1, 2, 3, 4, 5], "time"),
        ([0, 1, 2, 3, 4], [1, 2, -3, 4, 5], "speed"),
        ([0, 1], [1, 2], "speed"),
    ],
)
def test_traces_that_cannot_be_followed(time_s, values, field):
    with pytest.raises(InputError) as error:
        Trace("t.csv", np.array(time_s, float), np.array(values, float)).checked("speed", None)
    assert error.value.field == field


def test_a_gap_may_be_allowed_and_an_undershoot_is_refused():
    time_s = np.array([0.0, 1, 2, 3, 14])
    Trace("t.csv", time_s, np.full(5, 4.0)).checked("speed", 12.0)
    sharp = np.array([9, 9, 9, 9, 0.05, 0.05, 0.05, 0.05, 0.05])
    with pytest.raises(InputError, match="falls to -"):
        trace_curve(Trace("t.csv", np.arange(9.0), sharp), STEP_S, 0.0, "speed")


def test_reading_columns(tmp_path):
    (tmp_path / "a.csv").write_text("# rig 3\ntime, speed\n0,1.5\n0.1,\n0.2,1.7\n", encoding="utf-8")
    found = read_columns(tmp_path / "a.csv", ("time", "speed"))
    assert found["time"].tolist() == [0, 0.1, 0.2]
    assert np.isnan(found["speed"][1])
    np.savez(tmp_path / "b.npz", t=[1.0, 2.0], v=[3, 4])
    assert read_columns(tmp_path / "b.npz", ("v",))["v"].tolist() == [3.0, 4.0]
    for path, names in (("a.csv", ("rpm",)), ("none.csv", ("a",)), ("b.npz", ("rpm",))):
        with pytest.raises(InputError):
            read_columns(tmp_path / path, names)


def test_random_load_has_its_rms_and_its_band():
    noise = RandomLoad(3.0, 5.0, 40.0, 1 / 8192, seed=5, name="load")
    steps = np.arange(-4096, 8192 * 120, 8)  # 1024 Hz
    values = np.array([noise.stretch(int(s)).value(float(s)) for s in steps])
    # 2 x 35 Hz x 120 s = 8400 free numbers: 0.8 % of one standard deviation
    assert np.std(values) == pytest.approx(3.0, rel=0.03)
    assert abs(np.mean(values)) < 0.02
    spectrum = np.abs(np.fft.rfft(values * np.hanning(values.size))) ** 2
    frequency = np.fft.rfftfreq(values.size, 8 / 8192)
    power = lambda low, high: spectrum[(frequency > low) & (frequency < high)].mean()  # noqa: E731
    inside = power(10, 20)
    assert power(28, 36) == pytest.approx(inside, rel=0.15)  # 960 lines of chi^2: 3 % each
    assert power(0, 1.0) < 1e-4 * inside
    assert power(60, 500) < 1e-4 * inside
    assert np.abs(np.diff(values, 3)).max() < 1.0  # smooth across the knots


def test_random_load_is_a_function_of_seed_and_step():
    first, again = (RandomLoad(1.0, 1.0, 20.0, STEP_S, seed=5, name="load") for _ in range(2))
    steps = [10**9, 5, -70000, 123456]
    assert [first.stretch(s) for s in steps] == [again.stretch(s) for s in reversed(steps)][::-1]
    other = RandomLoad(1.0, 1.0, 20.0, STEP_S, seed=6, name="load")
    assert other.stretch(5) != first.stretch(5)
    a, b = first.stretch(0), first.stretch(math.ceil(first.stretch(0).end))
    assert b.value(b.start) == pytest.approx(a.value(a.end), abs=1e-12)
    assert b.slope(b.start) == pytest.approx(a.slope(a.end), abs=1e-14)


def test_hermite_stretch_meets_both_ends():
    one = hermite_stretch(3.0, 40.0, (1.0, 0.2, -0.01), (2.5, -0.1, 0.02))
    assert one.value(3.0) == pytest.approx(1.0)
    assert one.slope(3.0) == pytest.approx(0.2)
    assert one.value(43.0) == pytest.approx(2.5)
    assert one.slope(43.0) == pytest.approx(-0.1)
    h = 1e-3
    assert (one.slope(43.0) - one.slope(43.0 - h)) / h == pytest.approx(0.02, rel=1e-3)
    assert one.cut(10.0, 5.0, 8)[:6] == pytest.approx(
        np.polynomial.polynomial.polyfit(
            np.linspace(0, 1, 6), [one.value(10 + 5 * u) for u in np.linspace(0, 1, 6)], 5
        )
    )
    assert Stretch(0.0, 1.0, (0.0, 4.0, -4.0)).extremes() == pytest.approx((0.0, 1.0))


LIMITS = DriveLimits(STEP_S, RATIO, J, 30.0, 200.0, 50.0)


def built(section, speed=10.0, load=50.0, folder=Path()):
    model = validate(ProfileModel, section, "rig.yaml")
    return build_profile(Wanted(speed, load, model, "rig.yaml", folder, 1), LIMITS)


CONTROLLER = {"gain": "40 N*m/Hz", "integral_time": "0.5 s", "limit": "60 N*m", "ramp": "2 s"}


def test_profiles_of_a_scenario(tmp_path):
    assert built({}).segment(0).steady
    fan = {"quadratic": 1.0}
    course = built({"torques": {"motor": {"controller": CONTROLLER}}, "load_law": fan})
    assert (course.speed_at(-10), course.load_at(-10)) == (0.0, 0.0)
    assert course.speed_at(seconds(30.0)) == pytest.approx(10.0, abs=1e-6)
    assert course.load_at(seconds(30.0)) == pytest.approx(50.0, abs=1e-4)
    points = "time_s,rpm,load\n" + "".join(f"{t},{600 + 12 * t},{40 + t}\n" for t in range(9))
    (tmp_path / "t.csv").write_text(points, encoding="utf-8")
    given = {"file": "t.csv", "speed": "rpm", "speed_unit": "rpm", "load": "load"}
    course = built({"trace": given}, speed=None, folder=tmp_path)
    assert course.speed_at(seconds(4.0)) == pytest.approx(10.8, abs=1e-9)
    assert course.load_at(seconds(4.0)) == pytest.approx(44.0, abs=1e-9)
    columns = {"t": range(9), "n": [600 + 12 * t for t in range(9)], "load": [40 + t for t in range(9)]}
    written = {"columns": columns, "time": "t", "speed": "n", "speed_unit": "rpm", "load": "load"}
    same = built({"trace": written}, speed=None)
    assert same.speed_at(seconds(3.3)) == course.speed_at(seconds(3.3))
    assert same.load_at(seconds(3.3)) == course.load_at(seconds(3.3))
    course = built({"load_noise": {"rms": "2 N*m", "high": "20 Hz"}})
    assert np.any(course.segment(5).fluctuation)
    assert course.segment(5).motor[0] == 25.0


@pytest.mark.parametrize(
    ("section", "changes", "message"),
    [
        ({"torques": {"motor": {"constant": "10 N*m"}}}, {}, "10 N m at rest.*does not start"),
        (
            {"torques": {"motor": {"constant": "30 N*m"}}, "load_law": {"quadratic": 1}},
            {"load": 120.0},
            "settles at 7.0",
        ),
        ({"torques": {"motor": {"constant": "30 N*m"}}}, {}, "runs away"),
        ({"torques": {"motor": {"controller": {**CONTROLLER, "limit": "20 N*m"}}}}, {}, "does not start"),
        ({"torques": {"motor": {"constant": "30 N*m"}}}, {"speed": 40.0}, "up to 30 Hz"),
        ({"torques": {"motor": {}}}, {}, "one of constant, curve, controller"),
        ({}, {"speed": 31.0}, "0 to 30 Hz"),
        ({}, {"speed": None}, "a speed, or a profile.trace"),
        ({"trace": {"file": "t.csv"}}, {}, "no speed beside"),
        ({"trace": {}}, {"speed": None}, "either a file or columns"),
        ({"trace": {"columns": {"time_s": [0, 1]}}}, {"speed": None}, "speed_hz: got nothing.*time_s"),
        (
            {"trace": {"columns": {"time_s": [0, 1, 2, 3], "speed_hz": [9, 9, 9]}}},
            {"speed": None},
            "speed_hz: got 3 values, expected 4",
        ),
        ({"load_law": {"linear": 0.5}}, {}, "add up to 1"),
        ({"load_noise": {"rms": "60 N*m", "high": "20 Hz"}}, {}, "at most 50 N m"),
        ({"load_noise": {"rms": "6 N*m", "low": "30 Hz", "high": "20 Hz"}}, {}, "low below high"),
        ({"ripple": [{"at": "motor", "amplitude": "1 N*m"}]}, {}, "either order"),
    ],
)
def test_impossible_profiles_are_refused(section, changes, message):
    with pytest.raises(InputError, match=message):
        built(section, **changes)


def test_traces_beyond_the_drive_are_refused(tmp_path):
    fast = "time_s,speed_hz\n" + "".join(f"{t},{5 * t}\n" for t in range(9))
    (tmp_path / "t.csv").write_text(fast, encoding="utf-8")
    with pytest.raises(InputError, match=r"up to 40\.24 Hz.*0 to 30 Hz"):
        built({"trace": {"file": "t.csv"}}, speed=None, folder=tmp_path)
    rough = "time_s,speed_hz\n" + "".join(f"{t / 10},{10 + t % 2}\n" for t in range(30))
    (tmp_path / "t.csv").write_text(rough, encoding="utf-8")
    with pytest.raises(InputError, match=r"Hz/s at .* at most 8.29 Hz/s.*tolerance"):
        built({"trace": {"file": "t.csv"}}, speed=None, folder=tmp_path)
    assert built({"trace": {"file": "t.csv", "tolerance": "0.6 Hz"}}, speed=None, folder=tmp_path)


def test_events_change_what_they_name():
    """A new load leaves a trace alone; under a law of torques the speed answers; a new speed ends the law."""
    time_s, speed = measured(81)
    curve = trace_curve(Trace("t.csv", time_s, speed), STEP_S, 0.0, "speed")
    step, later = seconds(3.3) + 17, seconds(7.0)
    course = profile(curve, Constant(20.0))
    loaded = course.changed(step, None, 40.0, 1e5)
    assert loaded.speed_at(later) == course.speed_at(later)
    assert (loaded.load_at(step), loaded.load_at(later)) == (20.0, 40.0)
    taken = course.changed(step, 9.0, None, 1e5)
    assert_smooth(walk(course, step - 1000, step) + walk(taken, step, later), 6.0)
    assert taken.speed_at(later) == 9.0
    course = built({"torques": {"motor": {"controller": CONTROLLER}}, "load_law": {"linear": 1.0}})
    loaded = course.changed(step, None, 80.0, 1e5)
    joint = walk(course, step - 1000, step) + walk(loaded, step, later)
    assert_smooth(joint, 6.0)
    assert min(one.speed_hz(one.start_step) for one in joint) < 9.9  # the controller has to catch up
    assert loaded.speed_at(seconds(30.0)) == pytest.approx(10.0, abs=1e-6)
    assert loaded.load_at(seconds(30.0)) == pytest.approx(80.0, abs=1e-4)
    taken = loaded.changed(later, 5.0, None, 1e5)
    assert (taken.speed_at(seconds(9.0)), taken.load_at(seconds(9.0))) == pytest.approx((5.0, 40.0))


def test_turns_between_is_the_integral_of_the_speed():
    time_s, speed = measured(81)
    course = profile(trace_curve(Trace("t.csv", time_s, speed), STEP_S, 0.0, "speed"), Constant(20.0))
    steps = np.linspace(seconds(1.0), seconds(5.0), 4097)
    values = np.array([course.speed_hz.stretch(int(s)).value(s) for s in steps])
    exact = course.turns_between(seconds(1.0), seconds(5.0))
    weights = np.tile([2.0, 4.0], 2048)
    weights[0] = 1.0
    simpson = (weights @ values[:-1] + values[-1]) / (3 * 4096) * 4.0
    assert exact == pytest.approx(simpson, rel=1e-9)
    assert course.turns_between(seconds(1.0), seconds(2.0) + 77) + course.turns_between(
        seconds(2.0) + 77, seconds(5.0)
    ) == pytest.approx(exact, rel=1e-14)
