"""Readable forces of shafts, couplings, loose feet and side oscillators against closed forms."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gearsim_sim.model.assembly import Assembly
from gearsim_sim.model.jaw_coupling import JawCoupling
from gearsim_sim.model.loose_foot import LooseFoot
from gearsim_sim.model.rotating_force import TIME_TRACK, RotatingForce, rotating_pair
from gearsim_sim.model.side_oscillator import SideOscillator
from gearsim_sim.model.structure import joined_parts, with_oscillators


def test_unbalance_is_minus_mass_times_acceleration_of_its_centre():
    """Against differences of the path of the centre, while the speed changes."""
    unbalance, rate, sense, phase = 3e-3, 0.7, -1.0, 0.4
    x, y = rotating_pair({"x": 1.0}, {"y": 1.0}, 0, rate, sense, unbalance, phase, inertial=True)

    def turns(t):
        return 3.0 * t + 1.5 * t**2

    def path(t):
        angle = 2 * np.pi * rate * turns(t) + phase
        return unbalance * np.array([np.cos(angle), sense * np.sin(angle)])

    h = 1e-4
    for t in (0.0, 0.31, 0.8):
        second = (path(t + h) - 2 * path(t) + path(t - h)) / h**2
        found = [one.force(rate * turns(t), 3.0 + 3.0 * t, 3.0) for one in (x, y)]
        assert found == pytest.approx((-second).tolist(), abs=1e-5 * unbalance * 400)
    w = 2 * np.pi * rate * 3.0
    assert math.hypot(*(one.force(0.2, 3.0) for one in (x, y))) == pytest.approx(unbalance * w**2)


def test_a_bow_does_not_depend_on_speed_and_ripple_fades_at_rest():
    x, y = rotating_pair({"x": 1.0}, {"y": 1.0}, 0, 1.0, 1.0, 500.0, 0.0, inertial=False)
    assert (x.force(0.25, 0.0), y.force(0.25, 0.0)) == pytest.approx((0.0, 500.0), abs=1e-9)
    assert x.force(0.1, 3.0, 9.0) == x.force(0.1, 0.0)
    ripple = RotatingForce({"theta": 1.0}, 0, 6.0, 2.0, 0.0, corner_hz=1.0)
    assert ripple.force(0.0, 0.0) == 0.0
    assert ripple.force(0.0, 10.0) == pytest.approx(2.0, rel=1e-6)
    hum = RotatingForce({"theta": 1.0}, TIME_TRACK, 100.0, 0.0, 2.0)
    assert hum.force(0.0025, 0.0) == pytest.approx(2.0)


COUPLING = JawCoupling((2e6, 2e6, 2e6), 0.03, 50.0)


def test_equal_elements_give_a_force_that_stands():
    """N k e / 2 against the offset, no harmonics, no change of the twist (Gibbons' reaction)."""
    fx, fy, twist = COUPLING.harmonics(1e-4, 0.0, 0.5, 8)
    assert math.hypot(fx[0].real, fy[0].real) == pytest.approx(3 * 2e6 * 1e-4 / 2, rel=1e-9)
    assert max(np.abs(fx[1:]).max(), np.abs(fy[1:]).max()) < 1e-9
    assert np.abs(twist).max() < 1e-15
    assert COUPLING.forces(np.zeros(1), 0.0, 0.0, 0.0)[2][0] == pytest.approx(50.0 / (3 * 2e6 * 0.03**2))


def test_unequal_elements_modulate_at_twice_the_speed():
    """Closed form of sum k_k t_k t_k^T e for small differences: 2x of k e |sum d_k exp(2 i alpha_k)| / 2."""
    uneven = np.array([0.0, 1e-4, -1e-4])
    coupling = JawCoupling(tuple(2e6 * (1 + uneven)), 0.03, 50.0)
    fx, fy, _ = coupling.harmonics(1e-4, 0.0, 0.0, 8)
    angles = 2 * np.pi * np.arange(3) / 3
    want = 2e6 * 1e-4 / 2 * abs(np.sum(uneven * np.exp(2j * angles)))
    assert abs(fx[2]) == pytest.approx(want, rel=1e-3)
    assert abs(fy[2]) == pytest.approx(want, rel=1e-3)
    assert abs(fx[3:]).max() < 1e-3 * want


def test_an_angle_gives_three_times_the_speed_with_three_jaws():
    """sum of k R beta^2/4 sin(2 alpha) t: order 3 of amplitude N k R beta^2 / 8 in x and y, no others."""
    fx, fy, _ = COUPLING.harmonics(0.0, 0.02, 0.0, 8)
    want = 3 * 2e6 * 0.03 * 0.02**2 / 8
    assert abs(fx[3]) == pytest.approx(want, rel=1e-9)
    assert abs(fy[3]) == pytest.approx(want, rel=1e-9)
    assert np.abs(fx[[1, 2, 4, 5, 7, 8]]).max() < 1e-9 * want


def test_jaws_that_lift_off_give_multiples_of_their_number():
    assert not COUPLING.lifts_off(1e-4, 0.0)
    assert COUPLING.lifts_off(6e-4, 0.0)  # k e = 1200 N against 556 N of each jaw
    fx, _, twist = COUPLING.harmonics(6e-4, 0.0, 0.0, 8)
    assert abs(twist[3]) * 0.03 > 1e-5
    assert np.abs(fx[3]) > 10
    assert np.abs(fx[[1, 5]]).max() < 1e-6
    angle = np.linspace(0, 2 * np.pi, 50)
    uneven = JawCoupling((1.5e6, 2e6, 2.2e6), 0.03, 50.0)
    _, _, psi = uneven.forces(angle, 6e-4, 0.01, 0.3)
    alpha = angle[None, :] + 2 * np.pi * np.arange(3)[:, None] / 3
    offset = 6e-4 * (-np.cos(0.3) * np.sin(alpha) + np.sin(0.3) * np.cos(alpha))
    given = offset - 0.03 * (0.01**2 / 4) * np.sin(2 * (alpha - 0.3))
    pressed = np.array([[1.5e6], [2e6], [2.2e6]]) * np.maximum(0.03 * psi + given, 0)
    assert np.sum(pressed, axis=0) * 0.03 == pytest.approx(50.0, rel=1e-12)  # the torque is carried
    assert np.any(pressed == 0)


FOOT = LooseFoot({"y": 1.0}, 1.5e7, 2000.0, 0.6, 2e-6, math.inf, 1e-9)


def test_a_loose_foot_is_a_potential_with_a_passive_damper():
    foot = LooseFoot({"y": 1.0}, 1.5e7, 2000.0, 0.6, 2e-6, 20e-6, 0.5e-6)
    h = 1e-10
    for y in (-5e-6, 1.6e-6, 2.3e-6, 9e-6, 21.9e-6, 40e-6):
        slope = (foot.energy(y + h, 0.8) - foot.energy(y - h, 0.8)) / (2 * h)
        assert foot.force(y, 0.0, 0.8) == pytest.approx(-slope, abs=1e-4)
        whole = foot.force(y, 1.0, 0.8) - foot.force(y, 0.0, 0.8) - 2000.0
        assert whole <= 0.0  # the base's damper never pushes
        assert -1.5e7 * y + foot.force(y, 0.0, 2.0) < -1.5e7 * (1 - foot.share(2.0)) * y + 1e-9 or y < 0
    assert foot.force(1e-6, 0.5, 1.0) == 0.0
    assert foot.force(12e-6, 0.0, 1.0) == pytest.approx(0.6 * 1.5e7 * 10e-6)
    assert foot.force(50e-6, 0.3, 1.0) == pytest.approx(0.6 * 1.5e7 * 20e-6)  # the bolt's head stops it
    assert foot.force(12e-6, 1.0, 0.0) == 0.0


def test_free_swing_of_a_loose_foot_has_the_bilinear_period():
    """pi / w_pressed + pi / w_lifted, at any amplitude (Shaw and Holmes, J. Sound Vib. 90, 1983, 129)."""
    mass = 12.6

    def swing(_, state):
        y, rate = state
        return [rate, (-1.5e7 * (y - 2e-6) + FOOT.force(y, 0.0, 1.0)) / mass]

    for amplitude in (3e-6, 50e-6):
        crossing = lambda t, s: s[0] - 2e-6  # noqa: E731, ARG005
        crossing.direction = -1
        found = solve_ivp(swing, (0, 0.05), [2e-6 - amplitude, 0.0], rtol=1e-10, atol=1e-15, events=crossing)
        period = np.mean(np.diff(found.t_events[0]))
        want = np.pi * (math.sqrt(mass / 1.5e7) + math.sqrt(mass / (0.4 * 1.5e7)))
        assert period == pytest.approx(want, rel=2e-3)  # the rounded corner: 1 nm of 3 um


def test_a_shaken_loose_foot_answers_at_half_the_speed_and_its_multiples():
    """Shaken at twice its bilinear frequency it swings at half of that (Thompson and Ghaffari 1982)."""
    mass, damping = 12.6, 1500.0
    mean = 1 / (0.5 * (math.sqrt(mass / 1.5e7) + math.sqrt(mass / (0.4 * 1.5e7))))
    shake = 2 * mean / (2 * np.pi)

    def shaken(severity):
        def rates(t, s):
            force = -1.5e7 * (s[0] - 2e-6) - damping * s[1] + FOOT.force(s[0], 0.0, severity)
            return [s[1], (force + 400 * np.cos(2 * np.pi * shake * t)) / mass]

        grid = np.arange(4096) / (64 * shake)
        sol = solve_ivp(rates, (0, grid[-1]), [2e-6, 0.0], t_eval=grid, rtol=1e-8, atol=1e-13)
        spectrum = np.abs(np.fft.rfft((sol.y[0] * np.hanning(4096))[2048:] * np.hanning(2048))) / 1024
        return spectrum[[16, 32, 48]]  # 0.5x, 1x, 1.5x

    loose, tight = shaken(1.0), shaken(0.0)
    assert loose[0] > 0.3 * loose[1]
    assert tight[0] < 1e-2 * tight[1]
    assert loose[2] > 3 * tight[2]


def test_a_side_oscillator_of_severity_one_is_the_structure_s_mass():
    """Same forces as `with_oscillators` gives, for a resonance and for a path, at random states."""
    assembly = Assembly()
    for name in ("a", "b"):
        assembly.inertia(name, 2.0)
        assembly.spring({name: 1.0}, 3e5)
        assembly.damper({name: 1.0}, 20.0)
    plain = assembly.build()
    resonance = SideOscillator(({"a": 1.0},), 0.3, 400.0, 0.04)
    path = SideOscillator(({"a": 1.0}, {"b": 1.0}), 0.5, 150.0, 0.1)
    system = with_oscillators(plain, {"r": resonance, "p": path})
    assert system.dof_names == ("a", "b", "r", "p")
    rng = np.random.default_rng(1)
    for _ in range(5):
        x, v = rng.standard_normal((2, 4))
        force = -system.stiffness @ x - system.damping @ v
        own = -plain.stiffness @ x[:2] - plain.damping @ v[:2]
        a, b = np.array([x[0], v[0]]), np.array([x[1], v[1]])
        assert force[2] / 0.3 == pytest.approx(resonance.acceleration(x[2], v[2], a[None]))
        assert force[3] / 0.5 == pytest.approx(path.acceleration(x[3], v[3], np.array([a, b])))
        back = np.array([resonance.forces(x[2], v[2], a[None], 1.0)[0], 0.0])
        back += path.forces(x[3], v[3], np.array([a, b]), 1.0)
        assert force[:2] == pytest.approx(own + back)
    assert not np.any(path.forces(x[3], v[3], np.array([a, b]), 0.0))


def test_a_path_joins_the_parts_that_it_connects():
    parts = (("x1", "x2"), ("y1", "y2"))
    assert joined_parts(parts, {"r": [{"x1": 1.0}]}) == (("y1", "y2"), ("x1", "x2", "r"))
    joined = joined_parts(parts, {"r": [{"x1": 1.0}], "p": [{"x2": 1.0}, {"y1": 1.0}]})
    assert len(joined) == 1
    assert set(joined[0]) == {"x1", "x2", "y1", "y2", "r", "p"}
