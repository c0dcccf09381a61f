"""The compiled loop against DOP853 (rtol 1e-10) on the flat oracle's right-hand side.

Compared are the accelerations of all eight sites at the rate of integration, before decimation, over
25 ms from the same static start; the error is the rms difference over the rms of the oracle's signal,
site by site, the worst site counts. The first steps are the hardest: the scheme starts with a history
of forces that stand still.
"""

import numpy as np
import pytest
from oracles.plain_lpm34 import Plain
from scipy.integrate import solve_ivp

from gearsim_sim.events import FaultSpec
from gearsim_sim.integrate.modes import complex_modes
from gearsim_sim.model.faults import REGISTRY
from gearsim_sim.model.plant import Moment
from gearsim_sim.model.plants import make_plant
from gearsim_sim.model.statics import static_equilibrium
from gearsim_sim.params import load_parallel_params
from gearsim_sim.profile.profile import constant_profile
from gearsim_sim.schedule import ActiveFault, Schedule, Severity
from gearsim_sim.stepper import Stepper

RATE_HZ, DURATION_S, TURNS, SPEED_HZ, LOAD_NM = 65536.0, 0.025, 0.5, 10.0, 50.0


@pytest.fixture(scope="module")
def gearbox():
    return make_plant(load_parallel_params(), seed=3)


def fault_of(gearbox, kind):
    """A spall at bearing 3 that a loaded ball crosses soon after the start."""
    position = -np.pi / 2
    if kind == "inner_race_spall":  # in the middle of the load zone, in the middle of the run
        position -= 2 * np.pi * (TURNS + SPEED_HZ * DURATION_S / 2)
        position = float(np.angle(np.exp(1j * position)))
    return REGISTRY[kind].build(FaultSpec(kind, "bearing_3", {"position_rad": position}), gearbox)


def engine_accelerations(gearbox, fault, oversampling):
    course = constant_profile(gearbox, 1 / (RATE_HZ * oversampling), SPEED_HZ, LOAD_NM)
    schedule = Schedule(gearbox, course, 0, TURNS)
    if fault is not None:
        schedule.faults["spall"] = ActiveFault(fault, Severity(1.0, 1.0, 0, 0.0))
    stepper = Stepper(gearbox, schedule, gearbox.sites, oversampling)
    count = int(DURATION_S * RATE_HZ) * oversampling
    accel = np.zeros((8, count))
    stepper.advance(count, accel, 0)
    return accel


def plain_model(gearbox, spall):
    def series(one, per_turn=1):
        return one.orders * per_turn, one.cosine, one.sine

    mesh = gearbox.meshes[0]
    pinion, gear = (series(one.series) for one in mesh.errors)
    constant = sum(one.series.mean for one in mesh.errors)
    errors = tuple(
        np.concatenate([a, b, [extra]]) for a, b, extra in zip(pinion, gear, (0, constant, 0), strict=True)
    )
    described = None
    if spall is not None:
        described = {
            "bearing": spall.bearing,
            "inner": spall.on_inner_race,
            "radius": spall.race_radius_m,
            "width": 0.8e-3,
            "at": spall.position_rad,
        }
    bearing = gearbox.bearings[0].law
    return Plain(
        factor=bearing.load_factor,
        clearance=bearing.clearance_m,
        stiffness=series(mesh.stiffness, 32),
        errors=errors,
        load=LOAD_NM,
        speed=SPEED_HZ,
        turns=TURNS,
        spall=described,
    )


def reference(gearbox, spall, times):
    """Accelerations of the sites, and the least compression of a ball of bearing 3 over the spall."""
    plain = plain_model(gearbox, spall)
    moment = Moment(TURNS, SPEED_HZ, () if spall is None else ((spall, 1.0),))
    start = static_equilibrium(gearbox, complex_modes(gearbox.system), moment, gearbox.known_inputs(LOAD_NM))
    solution = solve_ivp(
        plain,
        (0, DURATION_S),
        np.concatenate([start, np.zeros(34)]),
        method="DOP853",
        rtol=1e-10,
        atol=1e-16,
        max_step=2e-5,
        dense_output=True,
    )
    states = solution.sol(times)
    rows = [gearbox.system.dof(name) for vector in gearbox.sites.values() for name in vector]
    accel = np.array(
        [plain.acceleration(t, y[:34], y[34:])[rows] for t, y in zip(times, states.T, strict=True)]
    )
    return accel.T, lost_contact(gearbox, spall, times, states)


def lost_contact(gearbox, spall, times, states):
    """Instants at which a ball inside the spall is loose although it would carry on a whole race."""
    if spall is None:
        return 0
    seat, found = gearbox.bearings[spall.bearing], 0
    for t, state in zip(times, states.T, strict=True):
        phases = gearbox.phases(TURNS + SPEED_HZ * t)
        q = (gearbox.system.interfaces.T @ state[:34])[[seat.x, seat.y]]
        angle, missing = seat.cage_angle_rad(phases), seat.missing(phases, ((spall, 1.0),))
        whole, real = seat.law.compressions(q, angle), seat.law.compressions(q, angle, missing)
        found += int(np.any((missing > 0) & (whole > 0) & (real < 0)))
    return found


@pytest.mark.parametrize("kind", [None, "outer_race_spall", "inner_race_spall"])
def test_acceleration_against_dop853(gearbox, kind):
    fault = None if kind is None else fault_of(gearbox, kind)
    spall = None if fault is None else fault.contributions[0]
    accel = engine_accelerations(gearbox, fault, 4)
    every = 3
    times = np.arange(1, accel.shape[1] + 1)[::every] / (4 * RATE_HZ)
    truth, loose = reference(gearbox, spall, times)
    error = np.sqrt(np.mean((accel[:, ::every] - truth) ** 2, axis=1)) / np.std(truth, axis=1)
    assert error.max() < 1e-4, error
    if kind is not None:
        assert loose > 20  # the ball has been in the spall and lost contact there


def test_more_oversampling_means_less_error(gearbox):
    """Against 16x: errors of 2x, 4x and 8x shrink at least fourfold each, although the spall has kinks."""
    fault = fault_of(gearbox, "outer_race_spall")
    finest = engine_accelerations(gearbox, fault, 16)[:, 15::16]
    errors = []
    for oversampling in (2, 4, 8):
        accel = engine_accelerations(gearbox, fault, oversampling)[:, oversampling - 1 :: oversampling]
        errors.append(float(np.sqrt(np.mean((accel - finest) ** 2))))
    assert errors[0] > 3 * errors[1] > 9 * errors[2]
