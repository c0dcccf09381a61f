"""Gear faults in the running machine: against DOP853, contact loss, line structure, the registry's rules."""

import json
from dataclasses import replace

import numpy as np
import pytest
from oracles.plain_lpm34 import CM, KM, Plain
from scipy.integrate import solve_ivp

from gearsim_io.errors import InputError
from gearsim_sim.engine import Engine
from gearsim_sim.events import FaultSpec
from gearsim_sim.integrate.modes import complex_modes
from gearsim_sim.model.contributions import ERROR, STIFFNESS, MeshMod
from gearsim_sim.model.faults import REGISTRY
from gearsim_sim.model.mesh_terms import BACKLASH, LEAD_GAP, MeshPulse, MeshTerm, pulse_mean
from gearsim_sim.model.plant import Moment
from gearsim_sim.model.plants import make_plant
from gearsim_sim.model.statics import static_equilibrium
from gearsim_sim.model.tooth.stiffness import stiffness_series
from gearsim_sim.model.tooth.windows import scaled, stretched
from gearsim_sim.params import load_parallel_params
from gearsim_sim.params.planetary import load_planetary_params
from gearsim_sim.profile.profile import constant_profile
from gearsim_sim.schedule import ActiveFault, Schedule, Severity
from gearsim_sim.stepper import Stepper

RATE_HZ, DURATION_S, TURNS, SPEED_HZ, LOAD_NM = 65536.0, 0.025, 0.5, 10.0, 50.0
# Kind, component, parameters; tooth 20 is in contact between 0.5 and 0.75 turns.
CASES = {
    "gear_tooth_crack": ("gears.pinion", {"tooth": 20}),
    "gear_tooth_spall": ("gears.gear", {"tooth": 20, "contact_loss": 0.3}),
    "gear_wear": ("gears.gear", {"depth_m": 2e-5}),
    "gear_eccentricity": ("gears.pinion", {"eccentricity_m": 1e-4}),
    "tooth_pitch_error": ("gears.pinion", {"tooth": 20, "rms_m": 1e-6}),
    "profile_modification": ("gears.gear", {"tip_m": 4e-6}),
    "gear_backlash": ("gears", {"backlash_m": 1e-4}),
    "gear_misalignment": ("gears", {"angle_rad": 1e-3}),
}
KINDS = sorted(CASES)


@pytest.fixture(scope="module")
def params():
    return load_parallel_params()


@pytest.fixture(scope="module")
def gearbox(params):
    return make_plant(params, seed=3)


def spec(kind, severity=1.0, **extra):
    component, given = CASES[kind]
    return FaultSpec(kind, component, given | extra, severity=severity)


# The registry's rules


@pytest.mark.parametrize("kind", KINDS)
def test_zero_severity_equals_healthy_bit_for_bit(params, kind):
    healthy = Engine(params, 5, RATE_HZ).advance(3000)
    at_start = Engine(params, 5, RATE_HZ, 4, [spec(kind, 0.0)])
    later = Engine(params, 5, RATE_HZ)
    later.inject(spec(kind, 0.0), at_sample=700)
    for engine in (at_start, later):
        faulty = engine.advance(3000)
        assert np.array_equal(faulty.accel, healthy.accel)
        assert np.array_equal(faulty.fraction, healthy.fraction)


@pytest.mark.parametrize("kind", KINDS)
def test_severity_grows_smoothly_and_chunks_do_not_matter(params, kind):
    """A thousandth of the fault is a hundredth of its effect at most; any split gives the same bits."""
    load = 4.0 if kind == "gear_backlash" else LOAD_NM

    def run(severity, chunks=(3000,)):
        engine = Engine(params, 5, RATE_HZ, 4, [spec(kind, severity)], load_nm=load)
        return np.concatenate([engine.advance(n).accel for n in chunks], axis=1)

    healthy, slight, full = run(0.0), run(1e-3), run(1.0)
    effect = np.abs(full - healthy).max()
    assert effect > 1e-3
    assert 0 < np.abs(slight - healthy).max() < 0.02 * effect
    assert np.array_equal(full, run(1.0, (1, 999, 1000, 1000)))


@pytest.mark.parametrize("kind", KINDS)
def test_parameters_survive_json(gearbox, kind):
    component, given = CASES[kind]
    model = REGISTRY[kind].params_model
    there = model.model_validate(given)
    assert model.model_validate(json.loads(json.dumps(there.model_dump()))) == there
    fault = REGISTRY[kind].build(FaultSpec(kind, component, given), gearbox, 3)
    again = REGISTRY[kind].build(FaultSpec(kind, component, given), gearbox, 3)
    assert [one.numbers() for one in fault.contributions] == [one.numbers() for one in again.contributions]
    assert REGISTRY[kind].look_for


@pytest.mark.parametrize(
    ("kind", "component", "given", "field"),
    [
        ("gear_tooth_crack", "bearing_1", {}, "component"),
        ("gear_tooth_crack", "gears.pinion", {"tooth": 33}, "tooth"),
        ("gear_tooth_crack", "gears.pinion", {"depth_m": "9 mm"}, "depth_m"),
        ("gear_tooth_crack", "gears.pinion", {"width_m": 0.03}, "width_m"),
        ("gear_tooth_spall", "gears.pinion", {"width_m": 6e-3}, "width_m"),
        ("gear_tooth_spall", "gears.pinion", {"radius_m": 0.06}, "radius_m"),
        ("gear_tooth_spall", "gears.pinion", {"shape": "oval"}, "shape"),
        ("gear_eccentricity", "gears.gear", {"eccentricity_m": 2e-3}, "stiffness"),
        ("gear_backlash", "gears.pinion", {}, "component"),
        ("profile_modification", "gears.gear", {"load_nm": 0}, "load_nm"),
        ("gear_wear", "gears.gear", {"depth_m": "20 kg"}, "depth_m"),
    ],
)
def test_impossible_faults_are_named(gearbox, kind, component, given, field):
    with pytest.raises(InputError) as error:
        REGISTRY[kind].build(FaultSpec(kind, component, given), gearbox)
    assert error.value.field == field


def test_random_teeth_follow_the_seed(gearbox):
    def table(kind, seed):
        component, given = CASES[kind]
        fault = REGISTRY[kind].build(FaultSpec(kind, component, given), gearbox, seed)
        return fault.contributions[0].samples()

    for kind in ("gear_wear", "tooth_pitch_error"):
        assert np.array_equal(table(kind, 1), table(kind, 1))
        assert not np.array_equal(table(kind, 1), table(kind, 2))


# Accuracy


def accelerations(gearbox, faults, oversampling, load_nm=LOAD_NM):
    course = constant_profile(gearbox, 1 / (RATE_HZ * oversampling), SPEED_HZ, load_nm)
    schedule = Schedule(gearbox, course, 0, TURNS)
    for name, fault in faults.items():
        schedule.faults[name] = ActiveFault(fault, Severity(1.0, 1.0, 0, 0.0))
    stepper = Stepper(gearbox, schedule, gearbox.sites, oversampling)
    count = int(DURATION_S * RATE_HZ) * oversampling
    accel = np.zeros((8, count))
    stepper.advance(count, accel, 0)
    return accel


class PlainContact(Plain):
    """The oracle with teeth that can part: written out for one mesh, backlash and lead gap."""

    backlash = gap = 0.0

    def forces(self, t, q, rate):
        g = super().forces(t, q, rate)
        if self.backlash == 0 and self.gap == 0:
            return g
        turns = self.turns0 + self.speed * t
        orders, cosine, sine = self.stiffness
        km = KM + np.cos(2 * np.pi * orders * turns) @ cosine + np.sin(2 * np.pi * orders * turns) @ sine
        orders, cosine, sine = self.errors
        c, s = np.cos(2 * np.pi * orders * turns), np.sin(2 * np.pi * orders * turns)
        d = q[8] + c @ cosine + s @ sine
        v = rate[8] + 2 * np.pi * self.speed * (c @ (orders * sine) - s @ (orders * cosine))
        side = 1 if d > 0 else -1
        depth = max(0.0, d if d > 0 else -d - self.backlash)
        part = min(1.0, depth / self.gap) if self.gap else float(depth > 0)
        elastic = km * part * (depth - part * self.gap / 2)
        force = elastic + np.clip(CM * part * v * side, -elastic, elastic)
        g[8] = KM * q[8] + CM * rate[8] - force * side
        return g


def merged_series(parts):
    """(orders, cos, sin) per turn of series that are (series, orders per turn); means at order 0."""
    orders = np.concatenate([one.orders * per for one, per in parts] + [[0]])
    cosine = np.concatenate([one.cosine for one, _ in parts] + [[sum(one.mean for one, _ in parts)]])
    return orders, cosine, np.concatenate([one.sine for one, _ in parts] + [[0.0]])


def oracle_error(gearbox, faults, load_nm=LOAD_NM, rtol=1e-9):
    """Worst site's error of the compiled run, and the oracle's mesh compression over time."""
    mesh = gearbox.meshes[0]
    all_parts = [one for fault in faults.values() for one in fault.contributions]
    mods = [one for one in all_parts if isinstance(one, MeshMod)]
    stiffness = [(mesh.stiffness, 32)] + [(one.series, 1) for one in mods if one.what == STIFFNESS]
    errors = [(one.series, 1) for one in mesh.errors] + [(one.series, 1) for one in mods if one.what == ERROR]
    law = gearbox.bearings[0].law
    stiff = merged_series(stiffness)
    stiff[1][-1] -= KM  # the oracle's own mean
    plain = PlainContact(
        factor=law.load_factor, clearance=law.clearance_m, stiffness=stiff, errors=merged_series(errors),
        load=load_nm, speed=SPEED_HZ, turns=TURNS,
    )  # fmt: skip
    for one in all_parts:
        if isinstance(one, MeshTerm):
            setattr(plain, {BACKLASH: "backlash", LEAD_GAP: "gap"}[one.what], one.value_m)
    moment = Moment(TURNS, SPEED_HZ, tuple((one, 1.0) for one in all_parts))
    start = static_equilibrium(gearbox, complex_modes(gearbox.system), moment, gearbox.known_inputs(load_nm))
    accel = accelerations(gearbox, faults, 4, load_nm)
    every = 5
    times = np.arange(1, accel.shape[1] + 1)[::every] / (4 * RATE_HZ)
    solution = solve_ivp(
        plain, (0, DURATION_S), np.concatenate([start, np.zeros(34)]), method="DOP853", rtol=rtol,
        atol=1e-6 * rtol, max_step=4e-5, t_eval=times,
    )  # fmt: skip
    rows = [gearbox.system.dof(name) for vector in gearbox.sites.values() for name in vector]
    truth = np.array(
        [plain.acceleration(t, y[:34], y[34:])[rows] for t, y in zip(times, solution.y.T, strict=True)]
    ).T
    error = np.sqrt(np.mean((accel[:, ::every] - truth) ** 2, axis=1)) / np.std(truth, axis=1)
    turns = TURNS + SPEED_HZ * times
    orders, cosine, sine = plain.errors
    angle = 2 * np.pi * np.outer(turns, orders)
    d = (gearbox.system.interfaces.T @ solution.y[:34])[8] + np.cos(angle) @ cosine + np.sin(angle) @ sine
    return float(error.max()), d


def build(gearbox, kind, **given):
    component, own = CASES[kind]
    return REGISTRY[kind].build(FaultSpec(kind, component, own | given), gearbox, 3)


def test_smooth_faults_against_dop853(gearbox):
    """Crack, spall, wear, eccentricity, pitch errors and relief all at once: stiffness and error add up."""
    faults = {
        kind: build(gearbox, kind) for kind in KINDS if kind not in ("gear_backlash", "gear_misalignment")
    }
    error, _ = oracle_error(gearbox, faults)
    assert error < 1e-4


def test_contact_against_dop853(gearbox):
    """At 4 N m the gears' errors tear the teeth apart: whole face, part of it, and the gap are met."""
    faults = {
        "play": build(gearbox, "gear_backlash", backlash_m=2e-5),
        "lead": build(gearbox, "gear_misalignment", angle_rad=5e-5),
    }
    error, d = oracle_error(gearbox, faults, load_nm=4.0, rtol=1e-8)
    assert error < 1e-3, error
    assert np.mean(d > 1e-6) > 0.01
    assert np.mean((d > 0) & (d < 1e-6)) > 0.1
    assert np.mean(d < 0) > 0.02


def test_rattling_converges(gearbox):
    """Impacts at 2 N m magnify what went before; within 7 ms twice the steps leave half the error."""
    faults = {
        "play": build(gearbox, "gear_backlash", backlash_m=2e-5),
        "thrown": build(gearbox, "tooth_pitch_error", error_m=5e-5),
    }
    runs = [accelerations(gearbox, faults, n, 2.0)[1::2, n - 1 :: n] for n in (4, 8, 64)]
    early = int(0.3 * runs[0].shape[1])
    errors = [np.std((run - runs[2])[:, :early]) / np.std(runs[2][:, :early]) for run in runs[:2]]
    assert errors[1] < 0.5 * errors[0]
    assert errors[0] < 0.01


def test_force_with_faults_is_the_slope_of_the_energy(gearbox):
    """On random states in and out of contact, frozen in time; dampers take energy or none."""
    mesh, rng = gearbox.meshes[0], np.random.default_rng(4)
    parts = [
        *build(gearbox, "gear_tooth_crack").contributions,
        *build(gearbox, "gear_tooth_spall", shape="rectangular").contributions,
        *build(gearbox, "gear_backlash", backlash_m=1e-5).contributions,
        *build(gearbox, "gear_misalignment").contributions,
    ]
    still, met = np.zeros(gearbox.rates.size), set()
    for severity in (0.3, 1.0, 2.0):
        mods = tuple((one, severity) for one in parts)
        for d in rng.uniform(-6e-5, 6e-5, 60):
            phases = gearbox.phases(rng.uniform(0, 1))
            step = 1e-11
            slope = (mesh.energy(d + step, phases, mods) - mesh.energy(d - step, phases, mods)) / (2 * step)
            force = mesh.force(d, 0.0, phases, still, mods)
            assert force == pytest.approx(slope, rel=1e-4, abs=0.1)
            rate = rng.normal() * 0.01
            assert (mesh.force(d, rate, phases, still, mods) - force) * rate >= 0
            tangent = mesh.force(d + step, 0.0, phases, still, mods) - mesh.force(
                d - step, 0.0, phases, still, mods
            )
            assert mesh.tangent(d, phases, mods) == pytest.approx(tangent / (2 * step), rel=1e-3, abs=1e5)
            met.add(np.sign(force))
    assert met == {-1.0, 0.0, 1.0}


# Contact loss


def test_contact_is_lost_and_never_pulls(params):
    """With 0.1 mm of play at 2 N m: drive force, stretches of exactly no force, force on the back flanks."""
    faults = [spec("gear_backlash"), spec("tooth_pitch_error", error_m=5e-5)]
    engine = Engine(
        params, 1, RATE_HZ, 4, faults, load_nm=2.0, probes=("mesh.force_n", "mesh.displacement_m")
    )
    output = engine.advance(int(0.4 * RATE_HZ))
    force = output.probes["mesh.force_n"]
    scale = np.abs(force).max()
    gap = np.abs(force) < 1e-6 * scale  # the loop adds and takes off the linear part: rounding is left
    assert np.mean(gap) > 0.05
    assert np.mean(force > 1e-3 * scale) > 0.2
    bilateral = Engine(params, 1, RATE_HZ, 4, faults[1:], load_nm=2.0, probes=("mesh.force_n",))
    pulling = bilateral.advance(int(0.4 * RATE_HZ)).probes["mesh.force_n"]
    assert pulling.min() < -0.3 * pulling.max()  # without the fault the mesh pulls the teeth together
    assert np.mean(np.abs(pulling) < 1e-6 * np.abs(pulling).max()) < 0.01


def test_backlash_does_nothing_under_load(params):
    healthy = Engine(params, 1, RATE_HZ, load_nm=100.0).advance(4000).accel
    loose = Engine(params, 1, RATE_HZ, 4, [spec("gear_backlash")], load_nm=100.0).advance(4000).accel
    assert np.abs(loose - healthy).max() < 1e-9 * np.abs(healthy).max()


def test_a_lead_error_softens_the_mesh_at_low_load():
    """Twist of the mesh under torque: F = k d^2 / 2g up to d = g, k (d - g / 2) beyond."""
    off = ("mesh_stiffness_variation", "runout", "tooth_profile", "tooth_pitch", "tooth_surface")
    still = make_plant(load_parallel_params().with_physics(**dict.fromkeys(off, False)), 1)
    fault = build(still, "gear_misalignment", angle_rad=1e-3)
    gap = 20e-6
    assert [one.value_m for one in fault.contributions] == [pytest.approx(gap)]
    moment = Moment(0.0, 0.0, tuple((one, 1.0) for one in fault.contributions))
    for load in (20.0, 150.0):
        rest = static_equilibrium(still, complex_modes(still.system), moment, still.known_inputs(load))
        d = (still.system.interfaces.T @ rest)[8]
        force = load / 0.0463
        expected = np.sqrt(2 * gap * force / KM) if force < KM * gap / 2 else force / KM + gap / 2
        assert d == pytest.approx(expected, rel=1e-6)


def test_rest_without_load_in_the_gap(gearbox):
    """No torque, play, and an error that lifts the teeth off: there is nothing to rest on, and no failure."""
    fault = build(gearbox, "gear_backlash")
    moment = Moment(0.3, 0.0, tuple((one, 1.0) for one in fault.contributions))
    rest = static_equilibrium(gearbox, complex_modes(gearbox.system), moment, gearbox.known_inputs(0.0))
    force = gearbox.meshes[0].force(
        float((gearbox.system.interfaces.T @ rest)[8]), 0.0, gearbox.phases(0.3), 0 * gearbox.rates,
        moment.faults,
    )  # fmt: skip
    assert abs(force) < 1.0


# What is heard of it


def test_crack_is_heard_once_per_turn(params):
    """Difference to the healthy gear: lines at the shaft's speed, the burst at the cracked tooth's angle."""
    count = 10 * int(RATE_HZ / SPEED_HZ)
    healthy = Engine(params, 1, RATE_HZ, load_nm=100.0).advance(count)
    tooth = 9
    fault = spec("gear_tooth_crack", tooth=tooth)
    cracked = Engine(params, 1, RATE_HZ, 4, [fault], load_nm=100.0).advance(count)
    added = (cracked.accel - healthy.accel)[5]
    spectrum = np.abs(np.fft.rfft(added * np.hanning(count))) ** 2
    bins = np.arange(spectrum.size)
    near = np.abs((bins + 5) % 10 - 5) <= 2  # ten turns: shaft orders are every tenth bin
    assert spectrum[near].sum() > 0.98 * spectrum.sum()
    angle = cracked.fraction[0]
    contact = 0.5 * 1.668 / 32
    inside = np.abs((angle - (tooth - 0.5) / 32 + 0.5) % 1 - 0.5) < contact + 0.01
    # Bursts ring on: energy before the tooth comes into contact is what the last turn has left.
    before = np.abs((angle - (tooth - 5) / 32 + 0.5) % 1 - 0.5) < contact + 0.01
    assert np.mean(added[inside] ** 2) > 5 * np.mean(added[before] ** 2)


def test_spall_is_louder_than_crack_and_does_not_mind_the_load(params):
    def added(kind, load):
        output = [
            Engine(params, 1, RATE_HZ, 4, faults, load_nm=load).advance(int(0.3 * RATE_HZ)).accel[5]
            for faults in ([], [spec(kind)])
        ]
        return float(np.std(output[1] - output[0]))

    crack, spall = (
        [added(kind, load) for load in (40.0, 120.0)] for kind in ("gear_tooth_crack", "gear_tooth_spall")
    )
    assert spall[0] > 3 * crack[0]
    assert crack[1] / crack[0] > 2  # stiffness: with the load, but for the errors' part of the compression
    assert spall[1] / spall[0] < 1.3


def test_eccentricity_gives_one_pair_of_sidebands(params):
    count = 20 * 6554
    faults = [spec("gear_eccentricity", eccentricity_m=1e-4)]
    off = dict.fromkeys(("runout", "tooth_pitch", "tooth_surface", "ball_passing"), False)
    quiet = params.with_physics(**off)
    accel = Engine(quiet, 1, 65540.0, 4, faults).advance(count).accel[5]  # 6554 samples per turn
    spectrum = np.abs(np.fft.rfft(accel))[::20] / count  # lines of the shaft's speed
    assert spectrum[31] > 20 * spectrum[29]
    assert spectrum[33] > 20 * spectrum[35]
    healthy = np.abs(np.fft.rfft(Engine(quiet, 1, 65540.0).advance(count).accel[5]))[::20] / count
    assert spectrum[31] > 20 * healthy[31]


# Pulses and choices of stiffness


def test_mean_of_a_pulse():
    """Against plain averaging of 0 and 1, across jumps and whole periods."""
    for place, length in ((0.1, 0.05), (0.29, 0.07), (-0.01, 0.04), (0.5, 1.7), (3.31, 0.2)):
        at = place + (np.arange(200_000) + 0.5) / 200_000 * length - length / 2
        assert pulse_mean(place, length, 0.3) == pytest.approx(np.mean(at % 1 < 0.3), abs=1e-5)
    assert [pulse_mean(place, 0.0, 0.3) for place in (0.29, 0.31, 1.0)] == [1.0, 0.0, 1.0]


def test_rectangular_spall_is_pulses_of_its_depth(gearbox):
    fault = build(gearbox, "gear_tooth_spall", shape="rectangular", contact_loss=0.0)
    assert all(isinstance(one, MeshPulse) for one in fault.contributions)
    turns = (np.arange(20_000) + 0.5) / 20_000
    error = sum(np.array([one.mean(u, 0.0) for u in turns]) for one in fault.contributions)
    assert error.min() == pytest.approx(-1e-4)  # alone in contact: all of the depth
    width = 1e-3 / (0.0463 * np.tan(np.radians(20)) * 2 * np.pi)  # arc over radius of curvature
    assert np.mean(error < 0) == pytest.approx(width, rel=0.01)
    assert np.mean(turns[error < 0]) == pytest.approx(19.5 / 32, abs=1e-3)


def test_jumps_are_averaged_exactly(params):
    """Rectangular mesh stiffness and spall at 4 steps per sample against 64: -45 dB of the signal."""
    rough = load_parallel_params(overrides={"mesh.stiffness_model": "rectangular"})
    faults = [spec("gear_tooth_spall", shape="rectangular", contact_loss=0.0, depth_m=2e-5)]
    runs = [Engine(rough, 1, RATE_HZ, steps, faults).advance(8000).accel for steps in (4, 16, 64)]
    errors = [np.std(run - runs[2]) / np.std(runs[2]) for run in runs[:2]]
    assert errors[0] < 10 ** (-45 / 20)
    assert errors[1] < errors[0] / 4
    assert params.model.mesh.stiffness_model == "tabulated"


@pytest.mark.parametrize("choice", ["potential_energy", "rectangular"])
def test_choices_of_stiffness_keep_the_balance(choice):
    """The mean is that of the linear part, so that the mesh carries the load wherever it is."""
    plant = make_plant(load_parallel_params(overrides={"mesh.stiffness_model": choice}), 1)
    mesh = plant.meshes[0]
    turns = (np.arange(3200) + 0.5) / 3200 / 32
    values = [mesh.stiffness_at(plant.phases(u)) for u in turns]
    assert np.mean(values) == pytest.approx(mesh.mean_stiffness_n_per_m, rel=1e-3)
    assert max(values) / min(values) > 1.5
    off = load_parallel_params(overrides={"mesh.stiffness_model": choice}).with_physics(
        mesh_stiffness_variation=False
    )
    flat = make_plant(off, 1).meshes[0]
    assert (
        flat.stiffness_at(plant.phases(0.1))
        == flat.mean_stiffness_n_per_m
        == pytest.approx(mesh.mean_stiffness_n_per_m)
    )


@pytest.mark.parametrize(
    ("overrides", "field"),
    [
        ({"teeth.module": "3 mm"}, "teeth.module"),
        ({"teeth.fillet": 0.9}, "teeth.fillet"),
        ({"mesh.stiffness_model": "finite_element"}, "mesh.stiffness_model"),
        ({"teeth.addendum": 1.4}, "teeth.gear.dedendum"),
    ],
)
def test_impossible_teeth_of_the_machine(overrides, field):
    with pytest.raises(InputError) as error:
        make_plant(load_parallel_params(overrides=overrides), 1)
    assert error.value.field == field


# Sun and ring


@pytest.mark.parametrize("input_member", ["carrier", "sun"])
def test_teeth_of_sun_and_ring_meet_the_planets_in_phase(input_member):
    """All teeth of a wheel together make the mesh stiffness of the model, in every mesh, at every angle."""
    params = load_planetary_params(overrides={"mesh.potential_energy": 1})
    stage = replace(params.stage, input_member=input_member)
    plant = make_plant(params.model_copy(update={"stage": stage}), 1)
    assert {wheel.mesh for wheel in plant.wheels} == set(range(6))
    for wheel in plant.wheels:
        mesh = plant.meshes[wheel.mesh]
        whole = stretched(stiffness_series(wheel.pair, int(params.model.mesh.harmonics)), wheel.gear.teeth)
        placed = wheel.placed(scaled(whole, mesh.mean_stiffness_n_per_m / whole.mean))
        for turns in (0.0, 0.137, 0.81):
            phases = plant.phases(turns)
            assert placed.value(phases[wheel.track]) == pytest.approx(mesh.stiffness_at(phases), rel=1e-9)


def test_a_cracked_sun_tooth_meets_every_planet_once_per_turn():
    """The sun overtakes the planets a third of a turn apart: one tooth, three times per relative turn."""
    plant = make_plant(load_planetary_params(), 1)
    fault = REGISTRY["gear_tooth_crack"].build(FaultSpec("gear_tooth_crack", "sun", {"tooth": 7}), plant)
    assert [one.mesh for one in fault.contributions] == [0, 1, 2]
    turns = np.arange(6000) / 6000
    at = [turns[np.argmin(one.series.value(turns))] for one in fault.contributions]
    assert np.diff(at) % 1 == pytest.approx([1 / 3, 1 / 3], abs=1e-3)
    teeth = plant.wheels[0].gear.teeth
    assert fault.contributions[0].series.mean == pytest.approx(fault.contributions[1].series.mean)
    assert -fault.contributions[0].series.mean * teeth > 0.01 * plant.meshes[0].mean_stiffness_n_per_m
