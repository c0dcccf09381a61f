"""Force elements account for energy: forces are gradients, dampers dissipate, reactions cancel."""

import numpy as np
import pytest

from gearsim_sim.model.plant import Moment
from gearsim_sim.model.plants import make_plant
from gearsim_sim.model.statics import static_equilibrium
from gearsim_sim.params import load_parallel_params


@pytest.fixture(scope="module")
def gearbox():
    return make_plant(load_parallel_params(), seed=3)


def gradient(energy, x, step):
    """Fourth-order central differences."""
    result = np.empty(x.size)
    for i in range(x.size):
        at = [energy(x + factor * step * np.eye(x.size)[i]) for factor in (-2, -1, 1, 2)]
        result[i] = (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * step)
    return result


def displacement(rng):
    """Somewhere beyond the clearance."""
    direction = rng.uniform(0, 2 * np.pi)
    return rng.uniform(1.2e-5, 3e-5) * np.array([np.cos(direction), np.sin(direction)])


@pytest.mark.parametrize("trial", range(6))
def test_bearing_force_is_the_gradient_of_its_energy(gearbox, trial):
    rng = np.random.default_rng(trial)
    bearing = gearbox.bearings[trial % 4].law
    q, angle = displacement(rng), rng.uniform(0, 2 * np.pi)
    missing = rng.uniform(0, 5e-6, bearing.ball_count)
    found = gradient(lambda p: bearing.energy(p, angle, missing), q, 1e-8)
    force = bearing.force(q, angle, missing)
    assert np.linalg.norm(force) > 10
    assert found == pytest.approx(force, rel=1e-5, abs=1e-5 * np.linalg.norm(force))


@pytest.mark.parametrize("trial", range(4))
def test_bearing_stiffness_is_the_gradient_of_its_force(gearbox, trial):
    rng = np.random.default_rng(trial)
    bearing = gearbox.bearings[0].law
    q, angle = displacement(rng), rng.uniform(0, 2 * np.pi)
    stiffness = bearing.stiffness(q, angle)
    assert stiffness == pytest.approx(stiffness.T, rel=1e-12)
    for axis in range(2):
        found = gradient(lambda p, axis=axis: bearing.force(p, angle)[axis], q, 1e-9)
        assert found == pytest.approx(stiffness[axis], rel=1e-3, abs=1e-4 * np.abs(stiffness).max())


def test_mesh_force_is_the_gradient_of_its_energy(gearbox):
    mesh, still = gearbox.meshes[0], np.zeros(6)
    for turns in (0.1, 0.734, 2.2):
        phases = gearbox.phases(turns)
        found = gradient(lambda d, p=phases: mesh.energy(float(d[0]), p), np.array([5e-6]), 1e-9)
        assert found[0] == pytest.approx(mesh.force(5e-6, 0.0, phases, still), rel=1e-6)


@pytest.mark.parametrize("trial", range(4))
def test_power_balance_of_the_whole(gearbox, trial):
    """d/dt (kinetic + potential) = power of known inputs - dissipation, angles of balls and teeth frozen."""
    rng = np.random.default_rng(trial)
    system, moment = gearbox.system, Moment(rng.uniform(0, 3), 0.0)
    x, v = rng.normal(size=34) * 1e-5, rng.normal(size=34) * 1e-2
    u = gearbox.known_inputs(50.0)
    acceleration = gearbox.acceleration(x, v, moment, u)
    potential = gradient(lambda e: gearbox.potential_energy(x + e[0] * v, moment), np.zeros(1), 1e-6)[0]
    stored = v @ system.mass @ acceleration + potential
    dissipated = v @ system.damping @ v
    throughput = np.abs(v) @ np.abs(system.mass @ acceleration)
    assert dissipated > 0
    assert stored == pytest.approx(v @ system.inputs @ u - dissipated, abs=1e-7 * throughput)


def test_dampers_never_give_energy(gearbox):
    rng = np.random.default_rng(0)
    for v in rng.normal(size=(200, 34)):
        assert v @ gearbox.system.damping @ v >= 0


def test_action_equals_reaction(gearbox):
    """Every interface pushes one body as much as it pulls the other; the mesh's moments follow the radii."""
    system = gearbox.system
    for axis in "xy":
        across = np.array([name.startswith(axis) for name in system.dof_names])
        assert np.abs(across @ system.interfaces).max() == 0
    mesh = dict(zip(system.dof_names, system.interfaces[:, -1], strict=True))
    assert mesh["theta_pin"] == -0.0463 * mesh["y_pin"]
    assert mesh["theta_ge"] == -0.0463 * mesh["y_ge"]


def test_balls_only_push_and_touch_softly(gearbox):
    bearing = gearbox.bearings[0].law
    gaps = np.linspace(-5e-6, 5e-6, 2001)
    force = bearing.ball_forces(gaps)
    assert np.all(force[gaps <= 0] == 0)
    assert np.all(force[gaps > 0] > 0)
    slope = np.diff(force) / np.diff(gaps)
    assert slope[1000] < 0.05 * slope[-1]  # stiffness begins at zero
    assert np.array_equal(bearing.force(np.zeros(2), 0.3), np.zeros(2))  # clearance: no contact at the centre


def test_load_zone_lies_where_the_load_presses(gearbox):
    """Torque presses the pinion up and the gear down; weight shows in the sum over both shafts."""
    from gearsim_sim.integrate.modes import complex_modes

    moment, u = Moment(0.5, 10.0), gearbox.known_inputs(50.0)
    x = static_equilibrium(gearbox, complex_modes(gearbox.system), moment, u)
    q, phases = gearbox.system.interfaces.T @ x, gearbox.phases(moment.turns)
    forces = np.array([seat.force(q[[seat.x, seat.y]], phases) for seat in gearbox.bearings])
    tooth_force = 50.0 / 0.0463
    weight = 9.80665 * (1.2638 + 2.1208 + 0.5134)
    assert forces[:2, 1].sum() == pytest.approx(tooth_force - weight, rel=1e-9)
    assert forces[2:, 1].sum() == pytest.approx(-tooth_force - weight, rel=1e-9)
    for i, seat in enumerate(gearbox.bearings):
        bearing, angle = seat.law, seat.cage_angle_rad(phases)
        loaded = bearing.compressions(q[[seat.x, seat.y]], angle) > 0
        away = np.angle(np.exp(1j * (bearing.azimuths_rad + angle - bearing.load_direction_rad)))
        assert 5 <= loaded.sum() < 13
        assert np.abs(away[loaded]).max() < np.abs(away[~loaded]).min()
        half = bearing.load_zone_half_angle_rad(abs(forces[i, 1]))
        assert np.abs(away[loaded]).max() <= half + bearing.ball_spacing_rad / 2


def test_static_state_has_no_acceleration(gearbox):
    from gearsim_sim.integrate.modes import complex_modes

    for load in (0.0, 2.0, 50.0, 200.0):
        moment, u = Moment(0.123, 0.0), gearbox.known_inputs(load)
        x = static_equilibrium(gearbox, complex_modes(gearbox.system), moment, u)
        acceleration = gearbox.acceleration(x, np.zeros(34), moment, u)
        assert np.abs(np.diag(gearbox.system.mass) * acceleration).max() < 1e-6  # N or N m
