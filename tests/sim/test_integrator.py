"""The cubic exponential scheme against exact solutions, and the decimation filter."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import freqz

from gearsim_sim.integrate.coefficients import cubic_weights, make_propagator
from gearsim_sim.integrate.decimate import decimate, decimation_taps, padded_taps
from gearsim_sim.integrate.kernel import (
    advance,
    correct,
    interface_motion,
    pack_constants,
    pack_state,
    predict,
    remember_forces,
    site_accelerations,
    times,
)
from gearsim_sim.integrate.modes import complex_modes
from gearsim_sim.model.assembly import Assembly

STIFFNESS, DAMPING = 3e5, 20.0  # of the interface, beside its linear part
FORCING_HZ = 90.0


def chain():
    """Four masses with single dampers (not proportional), an overdamped link, and a rigid mode."""
    assembly = Assembly()
    for i, mass in enumerate((1.0, 0.4, 0.7, 0.2)):
        assembly.inertia(f"x{i}", mass)
    links = ((0, 1, 2e5, 3.0), (1, 2, 8e5, 1200.0), (2, 3, 4e5, 0.0))
    for a, b, stiffness, damping in links:
        assembly.spring({f"x{a}": 1.0, f"x{b}": -1.0}, stiffness)
        assembly.damper({f"x{a}": 1.0, f"x{b}": -1.0}, damping)
    assembly.interface("spring", {"x0": 1.0, "x3": -1.0})
    assembly.interface("force", {"x1": 1.0, "x2": -1.0})
    assembly.known_input("none", {"x0": 0.0})
    return assembly.build()


def exact(system):
    """State matrix of the closed loop with an oscillator that drives the second interface."""
    n = 4
    spring, force = system.interfaces.T
    stiffness = system.stiffness + STIFFNESS * np.outer(spring, spring)
    damping = system.damping + DAMPING * np.outer(spring, spring)
    inverse = np.diag(1 / np.diag(system.mass))
    omega = 2 * np.pi * FORCING_HZ
    matrix = np.zeros((2 * n + 2, 2 * n + 2))
    matrix[:n, n : 2 * n] = np.eye(n)
    matrix[n : 2 * n, :n], matrix[n : 2 * n, n : 2 * n] = -inverse @ stiffness, -inverse @ damping
    matrix[n : 2 * n, 2 * n] = inverse @ force
    matrix[2 * n, 2 * n + 1], matrix[2 * n + 1, 2 * n] = omega, -omega
    return matrix


def interface_forces(system, state):
    spring = system.interfaces[:, 0]
    return np.array([-STIFFNESS * spring @ state[:4] - DAMPING * spring @ state[4:8], state[8]])


def error_of_the_scheme(steps, duration=0.02, *, fused=True):
    """Largest error of the accelerations over a run, relative to their largest value."""
    system, matrix = chain(), exact(chain())
    step = duration / steps
    prop = make_propagator(system, step, np.eye(4), rates=True)
    start = np.array([1e-3, 0, -1e-3, 5e-4, 0, 0, 0, 0, 20.0, -5.0])
    start[4:8] = [0.3, -0.1, 0.2, -0.75]  # no rigid motion: sum of momenta is zero
    start[:4] -= np.diag(system.mass) @ start[:4] / np.trace(system.mass)
    start[4:8] -= np.diag(system.mass) @ start[4:8] / np.trace(system.mass)
    nm, ni, nq = prop.modes, prop.interfaces, prop.motions
    k = pack_constants(prop)
    s = pack_state(prop, prop.modal(start[:4], start[4:8]), np.zeros(2 * nm), np.zeros(ni))
    past = [expm(-matrix * j * step) @ start for j in range(3)]
    history = np.array([interface_forces(system, state) for state in past])
    now, before, first = history @ prop.within(prop.left.reshape(ni, 2 * nm))
    w1, w2, w3 = prop.ratios.reshape(3, 2 * nm)
    s[2 * nm : 4 * nm] = (
        times(prop.decay, s[: 2 * nm]) + times(w1, now) + times(w2, before) + times(w3, first)
    )
    s[8 * nm : 10 * nm] = times(w2, now) + times(w3, before)
    s[10 * nm : 12 * nm] = times(w3, now)
    s[12 * nm + 6 * ni : 12 * nm + 9 * ni] = history.ravel()
    forward, state = expm(matrix * step), start
    worst, largest = 0.0, 0.0
    for _ in range(steps):
        state = forward @ state
        q = interface_motion(s, k, 2 * nm, nm, ni, nq)
        spring = -STIFFNESS * s[q] - DAMPING * s[q + 2]
        forces, found = np.array([spring, state[8]]), np.zeros((4, 1))
        remember_forces(s, forces, 0, nm, ni)
        site_accelerations(s, k, 2 * nm, np.zeros(4), np.arange(4), found, 0, nm, ni)
        if fused:
            advance(s, k, forces, 0, nm, ni)
        else:
            correct(s, k, forces, 0, nm, ni)
            predict(s, k, nm)
        truth = (matrix @ state)[4:8]
        worst, largest = max(worst, np.abs(found[:, 0] - truth).max()), max(largest, np.abs(truth).max())
    return worst / largest


def test_the_scheme_is_of_fourth_order():
    steps = np.array([160, 320, 640, 1280])
    errors = np.array([error_of_the_scheme(int(n)) for n in steps])
    slope = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(4.0, abs=0.1), (slope, errors)
    assert errors[-1] < 1e-6
    assert error_of_the_scheme(320, fused=False) == pytest.approx(errors[1], rel=1e-6)


def test_free_motion_is_exact_at_any_step():
    system = chain()
    modes = complex_modes(system)
    x = np.array([1.0, 0.0, -0.5, 0.2])
    x -= np.diag(system.mass) @ x / np.trace(system.mass)
    zero, identity = np.zeros((4, 4)), np.eye(4)
    inverse = np.diag(1 / np.diag(system.mass))
    matrix = np.block([[zero, identity], [-inverse @ system.stiffness, -inverse @ system.damping]])
    for duration in (1e-4, 3e-3, 0.1):
        z = np.exp(modes.eigenvalues * duration) * (modes.from_position @ x)
        truth = expm(matrix * duration) @ np.concatenate([x, np.zeros(4)])
        assert (modes.shapes @ z).real == pytest.approx(truth[:4], abs=1e-10)
        assert (modes.shapes_rate @ z).real == pytest.approx(truth[4:], abs=1e-7)
        assert (modes.acceleration @ z).real == pytest.approx((matrix @ truth)[4:], abs=1e-4)


def test_real_and_complex_modes_both_occur():
    values = complex_modes(chain()).eigenvalues
    assert np.any(values.imag == 0)
    assert np.any(values.imag > 0)


def test_rigid_mode_must_be_free():
    system = chain()
    grounded = type(system)(**{**vars(system), "damping": system.damping + np.diag([1.0, 0, 0, 0])})
    with pytest.raises(ValueError, match="damper acts on a rigid mode"):
        complex_modes(grounded)


@pytest.mark.parametrize("rate", [-1e-3, -300.0, -2e5, complex(-5e3, 9.8e4), complex(-1e3, 8e5)])
def test_weights_integrate_cubics_exactly(rate):
    """z' = rate z + cubic: one step of the weights equals the closed solution by expm."""
    h = 1 / 262144
    weights = cubic_weights(np.array([complex(rate)]), h)[:, 0]
    coefficients = np.array([0.7, -1.1, 0.4, 2.0])  # of powers of t/h
    nodes = np.array([1.0, 0.0, -1.0, -2.0])
    values = np.polynomial.polynomial.polyval(nodes, coefficients)
    generator = np.zeros((5, 5), dtype=complex)  # z and 1, u, u^2, u^3 with u = t/h
    generator[0, 0] = rate
    generator[0, 1:] = coefficients
    for power in range(1, 4):
        generator[1 + power, power] = power / h
    found = weights @ values
    truth = (expm(generator * h) @ np.array([0, 1, 0, 0, 0]))[0]
    assert abs(found - truth) < 1e-12 * abs(truth)


@pytest.mark.parametrize("oversampling", [2, 4, 16])
def test_decimation_filter(oversampling):
    taps = decimation_taps(oversampling)
    assert np.array_equal(taps, taps[::-1])  # linear phase
    rate = np.linspace(0, oversampling / 2, 40001)
    _, response = freqz(taps, worN=rate, fs=oversampling)
    gain = 20 * np.log10(np.abs(response) + 1e-12)
    assert np.abs(gain[rate <= 0.45]).max() < 0.001
    assert gain[rate >= 0.55].max() < -80


def test_decimation_keeps_the_time_axis():
    oversampling, count = 4, 50
    lead = 27 * oversampling
    time = (np.arange(2 * lead + count * oversampling + 64) - lead) / oversampling
    signal = np.vstack([np.cos(2 * np.pi * 0.2 * time), np.sin(2 * np.pi * 0.31 * time)])
    out = np.zeros((2, count))
    decimate(signal, 0, padded_taps(oversampling), oversampling, out, 0, count)
    samples = np.arange(count)
    assert out[0] == pytest.approx(np.cos(2 * np.pi * 0.2 * samples), abs=1e-4)
    assert out[1] == pytest.approx(np.sin(2 * np.pi * 0.31 * samples), abs=1e-4)
