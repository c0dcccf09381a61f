"""Profiles, shaft faults and structure in the engine, end to end."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gearsim_io.batches import SampleBatch, TachoBatch
from gearsim_io.errors import InputError
from gearsim_io.quantities import validate
from gearsim_sim.engine import Engine
from gearsim_sim.events import FaultSpec
from gearsim_sim.integrate.modes import complex_modes
from gearsim_sim.model.faults import REGISTRY
from gearsim_sim.model.joint_loop import foot_force
from gearsim_sim.model.known_loop import rotating_force
from gearsim_sim.model.loose_foot import LooseFoot
from gearsim_sim.model.plant import MOTOR, Moment
from gearsim_sim.model.plants import make_plant
from gearsim_sim.model.rotating_force import TIME_TRACK, RotatingForce
from gearsim_sim.model.statics import static_equilibrium
from gearsim_sim.model.structure import StructureModel
from gearsim_sim.operation import Operation
from gearsim_sim.params import load_parallel_params
from gearsim_sim.profile.profile import constant_profile
from gearsim_sim.profile.settings import ProfileModel
from gearsim_sim.profile.trace import read_columns
from gearsim_sim.scenario import FOLDER, load_scenario
from gearsim_sim.schedule import ActiveFault, Schedule, Severity
from gearsim_sim.simulation import Simulation, simulate
from gearsim_sim.stepper import Stepper

RATE_HZ = 16384.0
CONTROLLER = {"gain": "40 N*m/Hz", "integral_time": "0.5 s", "limit": "80 N*m", "ramp": "1 s"}
RUN_UP = {"torques": {"motor": {"controller": CONTROLLER}}, "load_law": {"constant": 0.3, "quadratic": 0.7}}
SIDE_FAULTS = [
    FaultSpec("unbalance", "input", {"unbalance_kg_m": 0.05}),
    FaultSpec("shaft_bow", "output", {"bow_m": 2e-4}),
    FaultSpec("shaft_misalignment", "output"),
    FaultSpec("looseness", "bearing_3", {"rounding_m": 1e-6}),
    FaultSpec("resonance", "b1_y", {"mass_kg": 1.0, "frequency_hz": 2500.0}),
    FaultSpec("transfer_path", "b3_y", {"to": "b1_x", "mass_kg": 1.0, "frequency_hz": 900.0}),
]


@pytest.fixture(scope="module")
def params():
    return load_parallel_params()


def operation(profile=None, structure=None):
    return Operation(
        validate(ProfileModel, profile or {}, "rig.yaml"),
        validate(StructureModel, structure or {}, "rig.yaml"),
    )


def engine(params, profile=None, structure=None, faults=(), speed=10.0, load=50.0, sites=None):
    wanted = operation(profile, structure)
    return Engine(params, 1, RATE_HZ, 8, faults, speed_hz=speed, load_nm=load, operation=wanted, sites=sites)


def angle(output):
    return output.turns + output.fraction


def readable_acceleration(plant, faults, turns, speed):
    """Right-hand side of machine and oscillators from the readable classes, and its start."""
    contributions = [one for fault in faults for one in fault.contributions]
    known = [one for one in contributions if one.table == "forcings"]
    feet = [one for one in contributions if one.table == "feet"]
    hung = [one for one in contributions if one.table == "oscillators"]
    size = len(plant.system.dof_names)
    mass = np.diag(plant.system.mass)
    vector = plant.system.direction
    u = plant.known_inputs(50.0)

    def accelerations(t, x, v, z, z_rate):
        moment = Moment(turns + speed * t, speed)
        phases = plant.phases(moment.turns)
        force = np.zeros(size)
        for one in known:
            force += vector(one.direction) * one.force(phases[one.track], speed)
        for one in feet:
            d = vector(one.direction)
            force += d * one.force(d @ x, d @ v, 1.0)
        own = []
        for one, place, rate in zip(hung, z, z_rate, strict=True):
            ends = np.array([[vector(d) @ x, vector(d) @ v] for d in one.directions])
            for d, pull in zip(one.directions, one.forces(place, rate, ends, 1.0), strict=True):
                force += vector(d) * pull
            own.append(one.acceleration(place, rate, ends))
        # What turns the rigid rotation is not the elastic model's.
        force -= mass * plant.rigid * (plant.rigid @ force) / plant.inertia_kg_m2
        return plant.acceleration(x, v, moment, u) + force / mass, np.array(own)

    rest = static_equilibrium(plant, complex_modes(plant.system), Moment(turns, speed), u)
    start = [float(np.mean([vector(d) @ rest for d in one.directions])) for one in hung]
    return accelerations, rest, np.array(start)


def test_all_forces_beside_the_elements_against_dop853(params):
    """Six faults at once, 5 ms from rest at 4x: error of the accelerations of all sites."""
    plant = make_plant(params, 3)
    faults = [REGISTRY[spec.kind].build(spec, plant) for spec in SIDE_FAULTS]
    step_s, count = 1 / 262144, 1200
    schedule = Schedule(plant, constant_profile(plant, step_s, 10.0, 50.0), 0, 0.5)
    for number, fault in enumerate(faults, 1):
        schedule.faults[fault.name] = ActiveFault(fault, Severity(1.0, 1.0, 0, 0.0), number)
    sites = {name: site for name, site in plant.sites.items() if name.startswith(("b1", "b3"))}
    accel = np.zeros((len(sites), count))
    Stepper(plant, schedule, sites, 4).advance(count, accel, 0)
    accelerations, rest, start = readable_acceleration(plant, faults, 0.5, 10.0)
    n, k = rest.size, start.size

    def rates(t, y):
        a, own = accelerations(t, y[:n], y[n : 2 * n], y[2 * n : 2 * n + k], y[2 * n + k :])
        return np.concatenate([y[n : 2 * n], a, y[2 * n + k :], own])

    y0 = np.concatenate([rest, np.zeros(n), start, np.zeros(k)])
    times = np.arange(1, count + 1)[::11] * step_s
    solution = solve_ivp(
        rates, (0, times[-1]), y0, method="DOP853", rtol=1e-8, atol=1e-14, t_eval=times, max_step=5e-5
    )
    rows = [plant.system.direction(site) for site in sites.values()]
    truth = np.array([rows @ rates(t, y)[n : 2 * n] for t, y in zip(times, solution.y.T, strict=True)]).T
    error = np.sqrt(np.mean((accel[:, ::11] - truth) ** 2, axis=1)) / np.std(truth, axis=1)
    assert error.max() < 3e-4, error  # 1e-4; the contact of the loose foot and the first steps


def test_compiled_forces_equal_the_readable_ones(params):
    """A rotating force while the speed changes, in time, and near rest; a foot in all its zones."""
    plant = make_plant(params, 1)
    schedule = Schedule(plant, constant_profile(plant, 1 / 262144, 10.0, 50.0), 0, 0.5)
    data = Stepper(plant, schedule, plant.sites, 4).data
    phases = np.linspace(0.1, 0.9, plant.rates.size)
    forces = [
        RotatingForce({"y_s1": 1.0}, 1, 3.0, 2.0, -0.7, 0.4, 1.5, 0.8),
        RotatingForce({"y_s1": 1.0}, 0, 1.0, 2.0, 0.3, corner_hz=12.0),
        RotatingForce({"y_s1": 1.0}, TIME_TRACK, 40.0, 2.0, 0.3),
    ]
    for one in forces:
        row = np.array([0.2, 0.8, 0.0, 2000.0, 0.0, *one.numbers()])
        found = rotating_force.py_func(row, 1000, 10.0, 7.0, phases, plant.rates, data)
        place = 1000 / 262144 if one.track == TIME_TRACK else phases[one.track]
        # Half-way up the ramp from 0.2 to 0.8.
        assert found == pytest.approx(0.5 * one.force(place, 10.0, 7.0), rel=1e-12)
    foot = LooseFoot({"y_p1": 1.0}, 1.5e7, 2000.0, 0.6, 2e-6, 20e-6, 0.5e-6)
    row = np.array([0.7, 0.7, 0.0, 0.0, 0.0, *foot.numbers()])
    for y in (-1e-6, 1.8e-6, 2.2e-6, 9e-6, 21.8e-6, 60e-6):
        assert foot_force.py_func(row, 5, y, 0.3) == pytest.approx(foot.force(y, 0.3, 0.7), rel=1e-12)


def test_a_bow_is_in_balance_with_itself(params):
    plant = make_plant(params, 1)
    fault = REGISTRY["shaft_bow"].build(FaultSpec("shaft_bow", "input", {"bow_m": 1e-4}), plant)
    bending = params.model.shafts.bending_stiffness_n_per_m
    for one, axis in zip(fault.contributions, "xy", strict=True):
        assert one.direction[f"{axis}_pin"] == pytest.approx(2 * bending)
        assert sum(one.direction.values()) == pytest.approx(0.0, abs=1e-6)


def test_a_fault_of_structure_is_the_structure(params):
    """`resonance` and `transfer_path` of severity s against s times the mass in the linear system."""
    resonance = {"mass_kg": 1.0, "frequency_hz": 2500.0, "damping_ratio": 0.02}
    path = {"mass_kg": 1.0, "frequency_hz": 900.0, "damping_ratio": 0.05}
    faults = [
        FaultSpec("resonance", "b1_y", resonance, severity=0.5),
        FaultSpec("transfer_path", "b3_y", {**path, "to": "b1_x"}, severity=0.5),
    ]
    given = {
        "resonances": [{"site": "b1_y", "mass": "0.5 kg", "frequency": "2500 Hz", "damping_ratio": 0.02}],
        "paths": [
            {"from": "b3_y", "to": "b1_x", "mass": "0.5 kg", "frequency": "900 Hz", "damping_ratio": 0.05}
        ],
    }
    found = engine(params, faults=faults).advance(2000).accel
    truth = engine(params, structure=given).advance(2000).accel
    plain = engine(params).advance(2000).accel
    assert np.std(found - truth, axis=1).max() < 1e-6 * np.std(truth)
    assert np.std(plain - truth) > 0.1 * np.std(truth)


@pytest.mark.parametrize("chunk", [1, 77])
def test_everything_together_does_not_depend_on_the_chunks(params, chunk):
    profile = {**RUN_UP, "ripple": [{"at": "load", "order": 4.5, "amplitude": "4 N*m"}]}
    profile["load_noise"] = {"rms": "2 N*m", "low": "5 Hz", "high": "100 Hz"}

    def run(size):
        rig = engine(params, profile, faults=SIDE_FAULTS[:2])
        for number, spec in enumerate(SIDE_FAULTS[2:]):
            rig.inject(spec, 0.02, at_sample=100 + 300 * number)
        rig.clear(SIDE_FAULTS[5].name, 0.02, at_sample=1200)
        rig.set_operating_point(load_nm=80.0, ramp_s=0.03, at_sample=900)
        rig.set_operating_point(speed_hz=3.0, ramp_s=0.03, at_sample=1300)
        parts = [rig.advance(min(size, 1500 - at)) for at in range(0, 1500, size)]
        return [np.concatenate([getattr(p, name) for p in parts], axis=1) for name in ("accel", "fraction")]

    for whole, part in zip(run(1500), run(chunk), strict=True):
        assert np.array_equal(whole, part)


@pytest.mark.parametrize("spec", SIDE_FAULTS, ids=lambda spec: spec.kind)
def test_severity_zero_changes_no_bit(params, spec):
    healthy = engine(params).advance(400).accel
    none = engine(params, faults=[dataclasses.replace(spec, severity=0.0)]).advance(400).accel
    assert np.array_equal(healthy, none)
    assert not np.allclose(healthy, engine(params, faults=[spec]).advance(400).accel, rtol=1e-6)


def test_run_up_from_rest(params):
    """At rest nothing turns and nothing moves; then tacho edges come when the profile says so."""
    rig = engine(params, RUN_UP)
    output = rig.advance(int(6 * RATE_HZ))
    turns = angle(output)
    assert np.abs(output.speed_hz[:, 0]).max() < 1e-6
    assert np.abs(output.accel[:, 0]).max() < 1e-2
    assert turns[:, 0] == pytest.approx([0.5, 0.5], abs=1e-3)
    assert output.speed_hz[0, -2000:].mean() == pytest.approx(10.0, abs=1e-3)
    course = rig._schedule.profile
    for sample in range(0, output.sample_count, 9999):
        step = sample * 8
        want = 0.5 + (course.turns_between(0, step) if step else 0.0)
        # The shafts twist by 50 N m / 580 N m/rad = 0.014 turns at most.
        assert turns[0, sample] == pytest.approx(want, abs=0.02)
        assert rig.operating_point_at(sample)[0] == pytest.approx(course.speed_at(step))
    assert np.all(np.isfinite(output.accel))


def test_flywheels_and_torques_keep_the_energy(params):
    """The mean speed of the run-up follows from torque and inertia of the whole machine."""
    motor = {"curve": [{"speed": "0 Hz", "torque": "40 N*m"}, {"speed": "20 Hz", "torque": "0 N*m"}]}
    output = engine(params, {"torques": {"motor": motor}}, load=0.0, speed=19.0).advance(int(2 * RATE_HZ))
    plant = make_plant(params, 1)
    rate = 40.0 / (2 * np.pi * plant.inertia_kg_m2 * 20.0)
    # The flywheels swing against each other at 4.6 Hz after the start: 0.22 s is about one period.
    window = slice(-int(0.22 * RATE_HZ), None)
    t = np.arange(output.sample_count)[window] / RATE_HZ
    want = 20.0 * (1 - np.exp(-rate * (t - 0.05)))  # half of the takeover is lost
    assert output.speed_hz[0, window].mean() == pytest.approx(want.mean(), rel=5e-3)


def test_motor_ripple_turns_the_rigid_rotation(params):
    """Two harmonics of torque: the mean of both flywheels follows T / (J w^2), on both shafts alike."""
    profile = {"ripple": [{"at": "motor", "frequency": "2 Hz", "amplitude": "5 N*m"}]}
    rig, still = engine(params, profile), engine(params)
    count = int(2.0 * RATE_HZ)
    moved = angle(rig.advance(count)) - angle(still.advance(count))
    t = np.arange(count) / RATE_HZ
    plant = rig.plant
    gain = plant.rigid @ plant.system.inputs[:, MOTOR]
    w = 2 * np.pi * 2.0
    rows = np.stack([np.cos(w * t), np.sin(w * t), np.ones(count)])
    fit = np.linalg.lstsq(rows.T, 2 * np.pi * moved.mean(axis=0), rcond=None)[0]
    # The rig's first torsional mode (about 4.6 Hz) amplifies the twist; the rigid part is the mass mean.
    accel = engine(
        params, profile, sites={f"{i}": {name: 1.0} for i, name in enumerate(plant.system.dof_names)}
    ).advance(count)
    weight = np.diag(plant.system.mass) * plant.rigid / plant.inertia_kg_m2
    mean = weight @ accel.accel
    line = np.linalg.lstsq(rows.T, mean, rcond=None)[0]
    assert np.hypot(*line[:2]) == pytest.approx(5.0 * gain / plant.inertia_kg_m2, rel=1e-3)
    assert np.hypot(*fit[:2]) > 0.9 * 5.0 * gain / (plant.inertia_kg_m2 * w**2)


def test_ripple_of_an_order_that_is_not_whole(params):
    """Order 4.5 at 10 Hz is a line at 45 Hz, without jumps at whole turns."""
    profile = {"ripple": [{"at": "motor", "order": 4.5, "amplitude": "10 N*m"}]}
    output = engine(params, profile, sites={"f": {"theta_f1": 1.0}}).advance(int(RATE_HZ))
    spectrum = np.abs(np.fft.rfft(output.accel[0] * np.hanning(output.sample_count)))
    assert np.argmax(spectrum[20:80]) + 20 == 45
    assert spectrum[40] < 1e-2 * spectrum[45]


def test_load_noise_moves_the_machine_and_its_rms_is_as_asked(params):
    profile = {"load_noise": {"rms": "5 N*m", "low": "20 Hz", "high": "60 Hz"}}
    rig = engine(params, profile, sites={"f": {"theta_f2": 1.0}})
    output = rig.advance(int(2 * RATE_HZ))
    plain = engine(params, sites={"f": {"theta_f2": 1.0}}).advance(int(2 * RATE_HZ))
    # Above its coupling's resonance flywheel 2 is free: angular acceleration = torque / inertia.
    found = np.std(output.accel[0] - plain.accel[0]) * params.model.flywheel_2.inertia_kg_m2
    assert found == pytest.approx(5.0, rel=0.25)  # 160 free numbers; the coupling adds a little


def test_structure_of_unknown_sites_is_refused(params):
    path = {"from": "b3_y", "to": "b9_y", "mass": "1 kg", "frequency": "900 Hz", "damping_ratio": 0.1}
    with pytest.raises(InputError, match=r"structure\.paths \(entry 1 of 1\)\.to: got b9_y"):
        engine(params, structure={"paths": [path]})
    with pytest.raises(InputError, match="another site"):
        engine(params, structure={"paths": [{**path, "to": "b3_y"}]})


@pytest.mark.parametrize(
    ("spec", "field"),
    [
        (FaultSpec("unbalance", "bearing_1"), "component"),
        (FaultSpec("unbalance", "input", {"plane": "bearing_4"}), "plane"),
        (FaultSpec("transfer_path", "b1_y", {"to": "roof"}), "to"),
        (FaultSpec("shaft_misalignment", "input", {"elements": 1}), "elements"),
        (FaultSpec("looseness", "bearing_1", {"reduction": 1.0}), "reduction"),
    ],
)
def test_impossible_faults_are_named(params, spec, field):
    with pytest.raises(InputError) as error:
        engine(params, faults=[spec])
    assert error.value.field == field


def lines(accel, orders, speed_hz=10.0):
    """Amplitudes at multiples of the speed, over whole turns."""
    count = accel.size // int(RATE_HZ / speed_hz) * int(RATE_HZ / speed_hz)
    t = np.arange(count) / RATE_HZ
    window = np.hanning(count)
    return np.array(
        [
            2 * abs(np.sum(accel[:count] * window * np.exp(-2j * np.pi * o * speed_hz * t))) / window.sum()
            for o in orders
        ]
    )


def test_what_the_faults_look_like(params):
    """Unbalance: order 1 on its shaft, speed squared; misalignment: 1x, 2x, 3x; looseness: many orders."""
    count = int(1.6 * RATE_HZ)
    quiet = engine(params).advance(count).accel
    unbalance = [FaultSpec("unbalance", "input", {"unbalance_kg_m": 0.05})]
    slow = engine(params, faults=unbalance).advance(count).accel
    fast = engine(params, faults=unbalance, speed=20.0).advance(count).accel
    calm = engine(params, speed=20.0).advance(count).accel
    one = lines(slow[0] - quiet[0], [1])[0]
    assert one > 20 * lines(slow[4] - quiet[4], [1])[0]
    # Quasi-static: force m e w^2, acceleration w^2 times force over stiffness; 20 Hz is far below 100 Hz.
    assert lines(fast[0] - calm[0], [1], 20.0)[0] / one == pytest.approx(16.0, rel=0.1)
    far = FaultSpec("shaft_misalignment", "input", {"offset_m": 1e-3})  # jaws lift off
    bent = engine(params, faults=[far]).advance(count).accel
    assert np.all(lines(bent[0] - quiet[0], [1, 2, 3]) > 1e-3)
    faults = [*unbalance, FaultSpec("looseness", "bearing_1", {"reduction": 0.8})]
    loose = engine(params, faults=faults).advance(count).accel
    assert lines(loose[1], range(2, 9)).sum() > 3 * lines(slow[1], range(2, 9)).sum()


SLOW = {
    "sample_rate": "16384 Hz",
    "oversampling": 8,
    "sensors": {"accelerometers": {"channels": ["b1_y", "b3_y"]}},
}


def test_a_measured_trace_as_a_scenario():
    """Tacho pulses against the integral of the file's own speeds; the truth tells both by the second."""
    scenario = load_scenario("speed_trace", SLOW)
    rig = Simulation(scenario)
    batches = rig.advance(int(5 * RATE_HZ)) + rig.finish()
    pulses = np.concatenate(
        [
            b.first_sample + b.pulse_offsets
            for b in batches
            if isinstance(b, TachoBatch) and b.shaft == "input"
        ]
    )
    columns = read_columns(FOLDER / "speed_trace.csv", ("time_s", "speed_rpm", "load_nm"))
    speed = np.interp(np.arange(0, 5, 1e-3), columns["time_s"], columns["speed_rpm"] / 60)
    turns = 0.5 + np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 * 1e-3)])
    found = np.interp(pulses / RATE_HZ, np.arange(0, 5, 1e-3), turns)
    assert pulses.size == int(turns[-1])
    # Smoothing by 0.01 Hz over seconds, corners of the polygon, twist of the shafts.
    assert np.abs(found - np.arange(1, pulses.size + 1)).max() < 0.03
    truths = rig.truths(0, rig.samples_sent - 1)
    assert [truth.sample for truth in truths] == [round(k * RATE_HZ) for k in (1, 2, 3, 4)]
    for k, truth in enumerate(truths, 1):
        assert truth.speed_hz == pytest.approx(columns["speed_rpm"][10 * k] / 60, abs=0.04)
        assert truth.load_nm == pytest.approx(columns["load_nm"][10 * k], abs=0.5)


def test_a_live_event_takes_over_from_a_profile_and_can_be_replayed():
    scenario = load_scenario("torque_dynamics", {**SLOW, "timeline": []})
    live = Simulation(scenario)
    batches = live.advance(int(1.5 * RATE_HZ))
    live.set_operating_point(speed_hz=3.0, ramp_s=0.5)
    batches += live.advance(int(2.0 * RATE_HZ)) + live.finish()
    assert live.truth().speed_hz == pytest.approx(3.0, abs=0.05)  # the ramp is nearly over
    again = list(simulate(scenario.with_events(live.truth().events), 3.5))
    for a, b in zip(batches, again, strict=True):
        if isinstance(a, SampleBatch):
            assert np.array_equal(a.data, b.data)


@pytest.mark.parametrize("name", ["torque_ripple", "looseness", "added_structure", "run_up"])
def test_scenarios_run(name):
    batches = list(simulate(load_scenario(name, SLOW), 0.5))
    data = np.concatenate([batch.data for batch in batches if isinstance(batch, SampleBatch)], axis=1)
    assert data.shape[1] == 8192
    assert np.all(np.isfinite(data))


def test_traces_that_miss_are_told_with_their_file(tmp_path):
    text = (FOLDER / "speed_trace.yaml").read_text().replace("speed_trace.csv", "none.csv")
    (tmp_path / "mine.yaml").write_text(text)
    with pytest.raises(InputError, match=r"none.csv: got no such file"):
        load_scenario(tmp_path / "mine.yaml")
    (tmp_path / "mine.yaml").write_text(text.replace("{load: 50 N*m}", "{speed: 3 Hz, load: 50 N*m}"))
    with pytest.raises(InputError, match=r"operating_point.speed: got 3.0, expected a speed, or else"):
        load_scenario(tmp_path / "mine.yaml")
