"""Gearboxes in a flexible casing, that of `lattice_casing`: rigid limit, statics, exact solutions."""

import dataclasses

import numpy as np
import pytest
from lattice_casing import BORES, full, lattice
from scipy.linalg import expm

from gearsim_io.errors import InputError
from gearsim_sim.engine import Engine
from gearsim_sim.ensemble import Ensemble, Variant
from gearsim_sim.events import FaultSpec
from gearsim_sim.integrate.carrier_kernel import Oscillators, oscillator_weights, pack_carrier_state
from gearsim_sim.integrate.modes import complex_modes
from gearsim_sim.model.casing.reduced import modal_damping
from gearsim_sim.model.on_casing import on_casing, own_modes, site_row
from gearsim_sim.model.plant import Moment
from gearsim_sim.model.plants import make_plant
from gearsim_sim.model.side_data import SideStructure
from gearsim_sim.model.statics import static_equilibrium
from gearsim_sim.params import load_parallel_params
from gearsim_sim.params.casing_gearbox import CasingGearboxParams
from gearsim_sim.verify.energy import LIMIT
from gearsim_sim.verify.ledger import ledger
from gearsim_sim.verify.reference import reference
from gearsim_sim.verify.trajectory import Course, run

LOAD_NM, RATE_HZ = 50.0, 65536.0
SEATS = tuple(f"b{number}_{axis}" for number in range(1, 5) for axis in "xy")


@pytest.fixture(scope="module")
def on_ground():
    return load_parallel_params().model_copy(update={"pedestals": False})


@pytest.fixture(scope="module")
def params(on_ground):
    return CasingGearboxParams(on_ground, lattice()[0])


@pytest.fixture(scope="module")
def plant(params):
    return make_plant(params, 3)


def engine(params, **more):
    return Engine(params, 3, RATE_HZ, **more)


def test_it_has_146_degrees_of_freedom_and_the_bearings_join_them(plant):
    system = plant.system
    assert len(system.dof_names) == 146
    inner = plant.internals.system
    assert inner.dof_names == system.dof_names[:22]
    # What the bearings do between shaft and ring is all that joins both.
    joint = system.stiffness[:22, 22:]
    seats = system.interfaces[:, [system.interface_names.index(name) for name in SEATS]]
    assert np.linalg.matrix_rank(joint) == 8
    assert joint == pytest.approx(1.5e8 * seats[:22] @ seats[22:].T, rel=1e-12)
    assert np.diag(system.damping)[22:].min() > 0


def test_the_internals_are_those_of_the_model_on_the_ground(plant, on_ground):
    lumped, inner = make_plant(on_ground, 3).system, plant.internals.system
    for name in ("mass", "stiffness", "damping", "interfaces", "inputs"):
        ours, theirs = getattr(inner, name), getattr(lumped, name)
        assert np.abs(ours - theirs).max() <= 1e-14 * np.abs(theirs).max(), name  # sums in another order


@pytest.mark.parametrize(("gravity", "within"), [(False, 1e-9), (True, 5e-3)])
def test_statics_are_those_of_the_full_lattice(params, gravity, within):
    """Bearing forces and weight on all 264 coordinates of the lattice move its rings as in the model.

    What forces at the bores do is exact. The weight is that of masters lifted together, and so much of it is
    off as mounts bend the walls then.
    """
    params = params.with_physics(gravity=gravity)
    plant = make_plant(params, 3)
    u = plant.known_inputs(LOAD_NM)
    rest = static_equilibrium(plant, complex_modes(plant.system), Moment(0.5, 0.0), u)
    q = plant.system.interfaces.T @ rest
    g = plant.interface_forces(q, np.zeros_like(q), Moment(0.5, 0.0))
    mass, stiffness, _ = full()
    push, lift = np.zeros((2, len(mass)))
    rows = {f"b{number + 1}_{axis}": 6 * number + "xy".index(axis) for number in range(4) for axis in "xy"}
    for name, row in rows.items():
        i = plant.system.interface_names.index(name)
        push[row] = 1.5e8 * q[i] - g[i]
    lift[[row for name, row in rows.items() if name.endswith("y")]] = 1.0
    lift[25::3] = 1.0
    moved = np.linalg.solve(stiffness, push - plant.gravity_m_per_s2 * mass @ lift)
    for name, row in rows.items():
        ours = plant.system.direction(plant.sites[name]) @ rest
        assert ours == pytest.approx(moved[row], rel=within, abs=1e-12), name
    # The mesh presses as much up as down: bearings carry the weight of the shafts, mounts that and their own.
    shafts = -make_plant(params.gearbox, 3).system.inputs[:, 2].sum() * plant.gravity_m_per_s2
    assert -sum(push[row] for name, row in rows.items() if name.endswith("y")) == pytest.approx(
        shafts, rel=1e-9, abs=1e-6
    )


def test_a_rigid_casing_gives_the_model_on_the_ground(params, on_ground):
    """A casing 100 times heavier with modes 100 times higher gives way by 1e-6 of what it does as it is."""
    casing = params.casing
    mass, stiffness = 1e2 * casing.mass, 1e6 * casing.stiffness
    damping = modal_damping(mass, stiffness, 0.04)
    hard = dataclasses.replace(casing, mass=mass, stiffness=stiffness, damping=damping, sites=())
    sites = {f"shaft_{name}": {f"{name[-1]}_s{name[1]}": 1.0} for name in SEATS}
    probes = [f"{name}.{what}" for name in SEATS for what in ("force_n", "displacement_m")]
    ours = engine(dataclasses.replace(params, casing=hard), sites=sites, probes=probes).advance(2000)
    ground = engine(on_ground, sites=sites, probes=probes).advance(2000)
    scale = ground.accel.std(axis=1)
    error = (ours.accel - ground.accel).std(axis=1) / scale.max()
    assert error.max() < 1e-3, error
    for name in probes:
        liveliest = max(np.ptp(value) for key, value in ground.probes.items() if key[4:] == name[4:])
        assert np.abs(ours.probes[name] - ground.probes[name]).max() < 1e-3 * liveliest, name
    # It is not the same machine: the lattice as it is differs by far more.
    soft = engine(params, sites=sites).advance(2000)
    assert (soft.accel - ground.accel).std(axis=1).max() > 0.2 * scale.max()


@pytest.fixture(scope="module")
def spall():
    return FaultSpec("outer_race_spall", "bearing_3", {"width_m": 8e-4})


def test_acceleration_against_dop853(plant, spall):
    """4 ms across a spall, at rings and walls; the forces' kinks at both edges are in it."""
    from gearsim_sim.model.faults import REGISTRY

    fault = REGISTRY[spall.kind].build(spall, plant, 3)
    passing = _turns_of_a_crossing(plant, fault)
    course = Course(0.004, 10.0, LOAD_NM, turns=passing, growth_s=0.001, begin_s=-0.002, lead_s=0.005)
    found = run(plant, course, 4 * RATE_HZ, (fault,))
    steps = np.arange(1, found.count - 1, 3)
    truth = reference(found, steps.astype(float))
    error = np.sqrt(np.mean((found.accel[:, steps - 1] - truth) ** 2, axis=1))
    error /= np.sqrt(np.mean(truth**2, axis=1)).max()
    assert error.max() < 1e-3, error
    normal = run(plant, course, 4 * RATE_HZ)
    assert np.abs(found.accel - normal.accel).max() > 0.1 * np.abs(normal.accel).max()
    # The energy that the same run stores, loses and is fed adds up, element by element.
    assert ledger(normal).relative_residual < LIMIT


def _turns_of_a_crossing(plant, fault):
    """Angle of the shaft at which a ball is about to roll into a spall in the middle of the load zone."""
    seat, row = plant.bearings[2], fault.contributions[0]
    cage, azimuths = plant.tracks[seat.cage], seat.law.azimuths_rad / (2 * np.pi)
    first = azimuths[row.row * seat.law.balls_per_row]
    place = row.position_turns if hasattr(row, "position_turns") else row.position_rad / (2 * np.pi)
    turns = np.linspace(0.5, 0.8, 3001)
    angle = cage.offset_turns + cage.rate * turns + first - place
    apart = np.abs((angle * seat.law.balls_per_row + 0.5) % 1 - 0.5)
    return float(turns[np.argmin(apart)]) - 10.0 * 0.002


def test_severity_zero_and_portions_change_no_bit(params, spall):
    whole = engine(params, forces=True).advance(3000)
    healthy = dataclasses.replace(spall, severity=0.0)
    rig = engine(params, forces=True, faults=(healthy,))
    portions = [rig.advance(n) for n in (1, 999, 2000)]
    assert np.array_equal(whole.accel, np.hstack([one.accel for one in portions]))
    for name in SEATS:
        assert np.array_equal(whole.forces[name], np.hstack([one.forces[name] for one in portions]))
    faulty = engine(params, faults=(spall,)).advance(3000)
    assert np.abs(faulty.accel - whole.accel).max() > 0.1


def test_forces_on_the_casing_are_those_that_move_it(params, plant):
    """Through the rows of the lattice's own modes the forces give the accelerations at its walls."""
    output = engine(params, forces=True).advance(16384)
    omega, ratios, shapes = own_modes(params.casing, "test")
    frequencies = 2 * np.pi * np.fft.rfftfreq(16384, 1 / RATE_HZ)
    window = np.hanning(16384)
    inside = (frequencies > 2 * np.pi * 100) & (frequencies < 2 * np.pi * 2500)
    w = frequencies[inside][:, None]
    response = -(w**2) / (omega**2 - w**2 + 2j * ratios * omega * w)
    total = np.zeros(inside.sum(), dtype=complex)
    site = params.casing.site("wall_y")
    row = site_row(site, params.casing, omega, shapes)
    for name in SEATS:
        ring = shapes[params.casing.dof(name[:2], f"u{name[-1]}")]
        force = np.fft.rfft(window * (output.forces[name] - output.forces[name].mean()))[inside]
        total += (response * row * ring).sum(axis=1) * force
    found = np.fft.rfft(window * output.accel[output.site_names.index("wall_y")])[inside]
    assert np.linalg.norm(total - found) < 0.02 * np.linalg.norm(found)
    load = LOAD_NM / 0.0463
    up = sum(output.forces[f"b{number}_y"].mean() for number in (1, 2))
    weight = sum(params.gearbox.model.seats[f"bearing_{n}"].mass_kg for n in (1, 2)) + 2.1208
    assert up == pytest.approx(load - weight * plant.gravity_m_per_s2, rel=0.01)


def test_more_modes_and_the_correction_come_nearer_to_the_full_lattice():
    """Response of a wall to a bearing's force over 20 Hz to 1.6 kHz, against all 264 coordinates."""
    from scipy.linalg import eigh

    mass, stiffness, _ = full()
    squares, shapes = eigh(stiffness, mass)
    w = 2 * np.pi * np.linspace(20, 1600, 800)[:, None]

    def response(omega, first, second):
        return (first * second * -(w**2) / (omega**2 - w**2 + 2j * 0.04 * omega * w)).sum(axis=1)

    errors = []
    for modes in (30, 60, 100):
        casing, rows = lattice(modes)
        omega, _, own = own_modes(casing, "test")
        truth = response(np.sqrt(squares), shapes[rows[1]], shapes[7])
        bare = response(omega, casing.sites[1].rows @ own, own[7])
        corrected = response(omega, site_row(casing.sites[1], casing, omega, own), own[7])
        errors.append([np.linalg.norm(one - truth) / np.linalg.norm(truth) for one in (bare, corrected)])
    assert errors[0][0] > errors[1][0] > errors[2][0]
    assert all(corrected <= 1.02 * bare for bare, corrected in errors)
    assert errors[-1][1] < 0.02, errors  # the lattice has 240 modes: many are left out close above


def test_an_oscillator_follows_its_exact_solution():
    """q'' + 2 zeta w q' + w^2 q = cos: the divided sum is the scheme, of fourth order."""
    omega, ratio, drive = 2 * np.pi * 700.0, 0.04, 2 * np.pi * 300.0
    matrix = np.array(
        [[0, 1, 0, 0], [-(omega**2), -2 * ratio * omega, 1, 0], [0, 0, 0, drive], [0, 0, -drive, 0]]
    )
    errors = []
    for steps in (200, 400, 800):
        h = 0.01 / steps
        weights = oscillator_weights(np.array([omega]), np.array([ratio]), h)
        truth = expm(matrix * h)
        past = [np.linalg.matrix_power(np.linalg.inv(truth), j) @ [0, 0, 1, 0] for j in range(3)]
        f = [one[2] for one in past]
        z = 0.0 - sum(d[0] * one for d, one in zip(weights[4:], f, strict=True))
        state, worst = np.array([0.0, 0.0, 1.0, 0.0]), 0.0
        for _ in range(steps):
            state = truth @ state
            f = [state[2], *f[:2]]
            z = weights.decay[0] * z + weights.gain[0] * f[0]
            q = (z + sum(d[0] * one for d, one in zip(weights[4:], f, strict=True))).imag
            worst = max(worst, abs(q - state[0]))
        errors.append(worst)
    slope = -np.polyfit(np.log([1, 2, 4]), np.log(errors), 1)[0]
    assert slope == pytest.approx(4.0, abs=0.15), errors


def test_at_rest_nothing_moves():
    of = Oscillators(
        np.array([300.0, 900.0]), np.array([0.04, 0.1]), np.ones((2, 2)), np.ones((1, 2)), np.zeros(2)
    )
    forces = np.array([3.0, -1.0])
    position = of.shapes.T @ forces / of.omega**2
    state = pack_carrier_state(of, 1e-5, position, forces, of.shapes @ position, np.zeros(2))
    weights = oscillator_weights(of.omega, of.damping_ratios, 1e-5)
    w = state[0:2] + 1j * state[8:10] + weights.gain * (of.shapes.T @ forces)
    z = w + (weights.now + weights.before + weights.earlier) * (of.shapes.T @ forces)
    assert z.imag == pytest.approx(position, rel=1e-12)
    # What hangs itself up beside it finds the same place, standing still.
    structure = SideStructure(("one", "two"), of, np.zeros(0, dtype=np.int64), weights)
    found = structure.coordinates(state)
    assert found.imag == pytest.approx(position, rel=1e-12)
    assert (weights.rate * found).imag == pytest.approx(np.zeros(2), abs=1e-12 * np.abs(position * 900).max())


@pytest.mark.parametrize(
    ("spoil", "field"),
    [
        (lambda one: {"stiffness": one.stiffness - 1.02 * _mounts(one)}, "stiffness"),
        (lambda one: {"damping": one.damping + 1e3 * np.eye(one.size)}, "damping"),
        (lambda one: {"damping": -one.damping}, "damping"),
        (lambda _: {"masters": ("b1", "b2", "b3", "other")}, "masters"),
    ],
)
def test_casings_that_cannot_carry_are_refused(params, on_ground, spoil, field):
    casing = dataclasses.replace(params.casing, **spoil(params.casing))
    with pytest.raises(InputError) as caught:
        on_casing(make_plant(on_ground, 3), casing, "case")
    assert caught.value.field == field


def _mounts(casing):
    """Stiffness of the mounts alone against motion as a whole."""
    from lattice_casing import rigid

    motion = np.zeros((casing.size, 6))
    for number, bore in enumerate(BORES):
        motion[6 * number : 6 * number + 3] = rigid(bore, (0, 0, 0))
        motion[6 * number + 3 : 6 * number + 6, 3:] = np.eye(3)
    held = casing.stiffness @ motion
    return held @ np.linalg.solve(motion.T @ held, held.T)


def test_what_it_cannot_do_is_said(on_ground):
    with pytest.raises(InputError, match="flexible casing"):
        engine(on_ground, forces=True)


def test_an_ensemble_in_a_casing_is_one_engine_each(params, spall):
    variants = [
        Variant(params, 1, (), 10.0, 50.0),
        Variant(params, 2, (spall,), 9.0, 40.0),
        Variant(params, 1, (), 10.0, 50.0),
    ]
    sites = {"ring": {**make_plant(params, 1).sites["b3_y"]}}
    ensemble = Ensemble(variants, RATE_HZ, sites=sites, workers=2)
    at = ensemble.inject(2, dataclasses.replace(spall, fault_id="late"), ramp_s=0.01, at_sample=800)
    assert at == 800 > ensemble.earliest_event_sample
    found = np.concatenate([ensemble.advance(n).accel for n in (700, 2300)], axis=2)
    for number in (0, 1):
        one = variants[number]
        alone = Engine(
            params,
            one.seed,
            RATE_HZ,
            faults=one.faults,
            sites=sites,
            speed_hz=one.speed_hz,
            load_nm=one.load_nm,
        )
        assert np.array_equal(found[number], alone.advance(3000).accel)
    assert np.array_equal(found[2, :, : at - 64], found[0, :, : at - 64])
    assert np.std(found[2] - found[0]) > 0
    with pytest.raises(InputError, match="0 to 2"):
        ensemble.inject(3, spall)
    other = dataclasses.replace(params, casing=dataclasses.replace(params.casing, sites=()))
    with pytest.raises(InputError, match="the same casing in all variants"):
        Ensemble([variants[0], Variant(other, 1)], RATE_HZ)
