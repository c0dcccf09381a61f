"""System matrices against the flat oracle, and the errata of thesis Appendix A line by line."""

import numpy as np
import pytest
from oracles.plain_lpm34 import CB, KM, KTS, RG, RP, Plain, matrices

from gearsim_sim.model.plants import make_plant
from gearsim_sim.params import load_parallel_params


@pytest.fixture(scope="module")
def gearbox():
    return make_plant(load_parallel_params(), seed=3)


@pytest.fixture(scope="module")
def system(gearbox):
    return gearbox.system


def same(left, right, scale=None):
    scale = np.abs(right).max() if scale is None else scale
    return np.abs(left - right).max() <= 1e-12 * scale


def test_matrices_equal_the_flat_oracle(system):
    mass, damping, stiffness, interfaces, weight = matrices()
    assert len(system.dof_names) == 34
    assert same(system.mass, mass)
    assert same(system.damping, damping)
    assert same(system.stiffness, stiffness)
    assert same(system.interfaces, interfaces)
    assert same(system.inputs[:, 2], weight)


def series(one, per_turn=1):
    return one.orders * per_turn, one.cosine, one.sine


def both_errors(mesh):
    parts = [series(one.series) for one in mesh.errors]
    mean = sum(one.series.mean for one in mesh.errors)
    joined = [np.concatenate(arrays) for arrays in zip(*parts, strict=True)]
    return tuple(np.append(array, extra) for array, extra in zip(joined, (0, mean, 0), strict=True))


@pytest.mark.parametrize("trial", range(5))
def test_right_hand_side_equals_the_flat_oracle(gearbox, trial):
    """At random states, with contacts open and closed and a spall under a ball."""
    from gearsim_sim.events import FaultSpec
    from gearsim_sim.model.faults import REGISTRY
    from gearsim_sim.model.plant import Moment

    rng = np.random.default_rng(trial)
    inner = bool(trial % 2)
    bearing = gearbox.bearings[2].law
    turns = 0.5 + 10.0 * 0.0137 * trial
    cage = 2 * np.pi * bearing.cage_ratio * turns
    at = cage + bearing.azimuths_rad[3] + 0.3 * 0.8e-3 / bearing.outer_race_radius_m
    at = np.angle(np.exp(1j * (at - (2 * np.pi * turns if inner else 0))))
    kind = "inner_race_spall" if inner else "outer_race_spall"
    spec = FaultSpec(kind, "bearing_3", {"position_rad": float(at)})
    (spall,) = REGISTRY[kind].build(spec, gearbox).contributions
    plain = Plain(
        factor=bearing.load_factor,
        clearance=bearing.clearance_m,
        stiffness=series(gearbox.meshes[0].stiffness, 32),
        errors=both_errors(gearbox.meshes[0]),
        turns=turns,
        spall={"bearing": 2, "inner": inner, "radius": spall.race_radius_m, "width": 0.8e-3, "at": at},
    )
    x, v = rng.normal(size=34) * 2e-5, rng.normal(size=34) * 1e-2
    moment = Moment(turns, 10.0, ((spall, 1.0),))
    assert (
        gearbox.bearings[2].missing(gearbox.phases(turns), moment.faults)[3] > 1e-6
    )  # the ball is over the spall
    ours = gearbox.acceleration(x, v, moment, gearbox.known_inputs(50.0))
    theirs = plain.acceleration(0.0, x, v)
    # Compared as forces relative to the largest one: that is how sums of forces round.
    inertia = np.diag(gearbox.system.mass)
    assert same(ours * inertia, theirs * inertia)


def test_symmetry_and_definiteness(system):
    for matrix in (system.mass, system.damping, system.stiffness):
        assert np.array_equal(matrix, matrix.T)
        assert np.linalg.eigvalsh(matrix)[0] > -1e-9 * np.abs(matrix).max()


def test_rigid_rotation_is_free(gearbox):
    """One rigid mode and only one; neither springs, dampers nor interfaces feel it."""
    system, rigid = gearbox.system, gearbox.rigid
    assert np.abs(system.stiffness @ rigid).max() == 0
    assert np.abs(system.damping @ rigid).max() == 0
    inverse = 1 / np.sqrt(np.diag(system.mass))
    squared = np.linalg.eigvalsh(system.stiffness * np.outer(inverse, inverse))
    assert abs(squared[0]) < 1e-12 * squared[-1]
    assert squared[1] > (2 * np.pi * 1.0) ** 2


def test_transmission_error_does_no_work_on_the_rigid_rotation(gearbox):
    mesh = gearbox.system.interfaces[:, -1]
    assert mesh @ gearbox.rigid == 0
    torque = gearbox.known_inputs(50.0)
    assert gearbox.rigid @ gearbox.system.inputs @ torque == pytest.approx(0, abs=1e-12)


def test_motor_gives_the_whole_inertia_the_commanded_acceleration(gearbox):
    u = gearbox.known_inputs(50.0, acceleration_hz_per_s=2.0)
    inertia = np.diag(gearbox.system.mass)[:10].sum()
    assert gearbox.rigid @ gearbox.system.inputs @ u == pytest.approx(inertia * 2 * np.pi * 2.0)


def thesis_row(matrix, row):
    return {column + 1: value for column, value in enumerate(matrix[row - 1][:22]) if value != 0}


def test_errata_stiffness_rows_3_and_6(system):
    row = thesis_row(system.stiffness, 3)
    assert list(row) == [2, 3, 4, 6, 14, 18]
    expected = [-KTS, 2 * KTS + KM * RP**2, -KTS, -KM * RP * RG, -KM * RP, KM * RP]
    assert list(row.values()) == pytest.approx(expected, rel=1e-14)
    row = thesis_row(system.stiffness, 6)
    assert list(row) == [3, 6, 7, 8, 14, 18]
    expected = [-KM * RP * RG, 2 * KTS + KM * RG**2, -KTS, -KTS, KM * RG, -KM * RG]
    assert list(row.values()) == pytest.approx(expected, rel=1e-14)


def test_errata_bearing_dampers_act_between_shaft_and_pedestal(system):
    """On rows 19 to 22 belong the dampers of bearings 3 and 4, and each has its reaction."""
    for number, damping in zip(range(1, 5), CB, strict=True):
        for axis in "xy":
            shaft, pedestal = system.dof(f"{axis}_s{number}"), system.dof(f"{axis}_p{number}")
            assert system.damping[shaft, shaft] == damping
            assert system.damping[shaft, pedestal] == -damping
            together = system.damping[shaft, shaft] + system.damping[shaft, pedestal]
            assert together == 0  # no damping of the shaft against the ground


def test_errata_damping_is_five_percent_of_the_linear_stiffness(system):
    """1.5e8 is a linear stiffness: with 5 % of critical it gives the tabulated c_b."""
    for number, damping in zip(range(1, 5), CB, strict=True):
        mass = system.mass[system.dof(f"x_s{number}"), system.dof(f"x_s{number}")]
        assert 2 * 0.05 * np.sqrt(1.5e8 * mass) == pytest.approx(damping, rel=1e-4)


def test_errata_mesh_acts_along_y_with_opposite_signs(system):
    column = dict(zip(system.dof_names, system.interfaces[:, -1], strict=True))
    assert {name: value for name, value in column.items() if value} == pytest.approx(
        {"theta_pin": RP, "theta_ge": -RG, "y_pin": -1.0, "y_ge": 1.0}
    )


def test_errata_4_15_and_4_16_count_turns():
    """T is the period: with the rotational speed in its place a run-out would come 1 / f^2 times a turn."""
    speed_hz = 10.0
    mesh = make_plant(load_parallel_params(), seed=3).meshes[0]
    runout = mesh.errors[0].series
    assert runout.orders[0] == 1  # once a turn: t / T with T = 1 / f
    seconds = np.arange(1000) / 1000 / speed_hz
    once = np.cos(2 * np.pi * seconds * speed_hz + 1.0)
    as_printed = np.cos(2 * np.pi * seconds / speed_hz + 1.0)
    assert abs(once.mean()) < 1e-12
    assert abs(as_printed.mean()) > 0.5  # hardly moves within a turn


@pytest.mark.parametrize("step_s", [1e-5, 1e-6])
def test_errata_4_17_error_has_a_rate_at_any_step(step_s):
    """A new random number each sample has no rate: its differences grow without bound as steps shrink."""
    mesh = make_plant(load_parallel_params(), seed=3).meshes[0]
    turns = 0.3 + 10.0 * step_s * np.arange(3)
    ours = np.diff([mesh.error(mesh_phases(turn)) for turn in turns]) / step_s
    assert ours[0] == pytest.approx(ours[1], rel=0.1)
    exact = mesh.error_rate(mesh_phases(turns[0] + 5 * step_s), np.full(2, 10.0))
    assert ours[0] == pytest.approx(exact, rel=0.02)
    printed = np.diff(0.2e-6 * np.random.default_rng(1).normal(size=1000)) / step_s
    assert printed.std() == pytest.approx(0.2e-6 * np.sqrt(2) / step_s, rel=0.1)


def mesh_phases(turns):
    return np.full(2, turns)


def test_errata_tables_a1_and_b1_are_two_models():
    """580 and 300 N m/rad belong to this model (Table A.1), 740 and 3000 to the one of Table B.1."""
    model = load_parallel_params().model
    assert (model.flywheel_1.stiffness_nm_per_rad, model.flywheel_2.stiffness_nm_per_rad) == (580, 580)
    assert (model.encoder_1.stiffness_nm_per_rad, model.encoder_2.stiffness_nm_per_rad) == (300, 300)


def test_errata_ball_spin_frequency_of_section_5_5():
    """26.1 Hz at 10 Hz, where 26.5 is printed; the bearing and the other frequencies are those of 5.5."""
    law = make_plant(load_parallel_params(), seed=3).bearings[2].law
    ball, pitch = 7.12, 38.5
    assert 10 * pitch / (2 * ball) * (1 - (ball / pitch) ** 2) == pytest.approx(26.1, abs=0.05)
    assert abs(law.spin_rate(10.0)) == pytest.approx(26.1, abs=0.05)
    assert abs(law.cage_rate(10.0)) == pytest.approx(4.1, abs=0.05)
