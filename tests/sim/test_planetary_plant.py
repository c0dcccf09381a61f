"""The planetary machine as it runs: accuracy, frequencies, phases, faults, planet bearings."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import butter, hilbert, sosfiltfilt

from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine
from gearsim_sim.engine import Engine
from gearsim_sim.events import FaultSpec
from gearsim_sim.integrate.modes import complex_modes
from gearsim_sim.model.faults import fault_kind
from gearsim_sim.model.planet_geometry import RING, SUN
from gearsim_sim.model.plant import Moment
from gearsim_sim.model.plants import make_plant
from gearsim_sim.model.statics import static_equilibrium
from gearsim_sim.params import load_planetary_params
from gearsim_sim.profile.profile import constant_profile
from gearsim_sim.schedule import ActiveFault, Schedule, Severity
from gearsim_sim.stepper import Stepper

CARRIER_HZ = 32 / 15
BIN_HZ = 0.1  # of a 10 s record


@pytest.fixture(scope="module")
def plant():
    return make_plant(load_planetary_params(), 3)


def placed(plant, kind, component="planet_1", severity=1.0, **params):
    fault = fault_kind(kind).build(FaultSpec(kind, component, params, severity), plant)
    return tuple((one, severity) for one in fault.contributions)


def mesh_forces(plant, faults=()):
    """Static forces of the six meshes at their mean stiffness: sun, then ring."""
    moment = Moment(0.0, 0.0, faults)
    u = plant.known_inputs(plant.limits.load_nm)
    x = static_equilibrium(plant, complex_modes(plant.system), moment, u)
    q, phases = plant.system.interfaces.T @ x, plant.phases(0.0)
    forces = []
    for index, mesh in enumerate(plant.meshes):
        mods = tuple(pair for pair in faults if pair[0].mesh == index)
        forces.append(mesh.stiffness_at(phases, mods) * (q[mesh.interface] + mesh.error(phases, mods)))
    return np.array(forces)


@pytest.mark.parametrize("faulty", [False, True])
def test_compiled_run_equals_dop853(plant, faulty):
    """Accelerations of carrier, and of ring and sun in the carrier's frame, against the readable plant.

    At 4 steps per sample of 65536 Hz. The start from rest on moving teeth is a jump, which the scheme takes
    less exactly (5e-3); compared is what follows after 2 ms, where all but the slowest modes forgot it.
    """
    turns, seconds, rate = 0.3, 5e-3, 65536 * 4
    names = ("y_c", "x_r", "y_r", "x_s", "y_s", "theta_p1")
    fault = fault_kind("planet_tooth_crack").build(FaultSpec("planet_tooth_crack", "planet_1"), plant)
    course = constant_profile(plant, 1 / rate, CARRIER_HZ, plant.limits.load_nm)
    schedule = Schedule(plant, course, 0, turns)
    if faulty:
        schedule.faults["crack"] = ActiveFault(fault, Severity(1.0, 1.0, 0, 0.0))
    count = int(seconds * rate)
    stepper = Stepper(plant, schedule, {name: {name: 1.0} for name in names}, 4)
    ours = np.zeros((stepper.row_count, count))
    stepper.advance(count, ours, 0)
    pairs = tuple((one, 1.0) for one in fault.contributions) if faulty else ()
    u = plant.known_inputs(plant.limits.load_nm)

    def derivative(t, state):
        moment = Moment(turns + CARRIER_HZ * t, CARRIER_HZ, pairs)
        return np.concatenate([state[18:], plant.acceleration(state[:18], state[18:], moment, u)])

    start = static_equilibrium(plant, complex_modes(plant.system), Moment(turns, CARRIER_HZ, pairs), u)
    times = np.arange(1, count + 1) / rate
    run = solve_ivp(
        derivative, (0, times[-1]), np.concatenate([start, np.zeros(18)]), "DOP853", times[::16],
        rtol=1e-9, atol=1e-15,
    )  # fmt: skip
    theirs = np.array([derivative(t, y)[18:] for t, y in zip(times[::16], run.y.T, strict=True)]).T
    theirs = theirs[[plant.system.dof(name) for name in names]]
    later = times[::16] > 2e-3
    ours, theirs = ours[:, ::16][:, later], theirs[:, later]
    error = np.sqrt(np.mean((ours - theirs) ** 2, axis=1) / np.mean(theirs**2, axis=1))
    assert error.max() < 1.2e-4


def test_mesh_order_cancels_in_rotation_and_not_in_translation():
    """Three equal planets in sequence: torsion is shaken at every third mesh order only."""
    params = load_planetary_params(
        overrides={"gear_errors.surface_rms": "0 um", "gear_errors.runout": "0 um"}
    )
    plant = make_plant(params, 3)
    turns = np.arange(1024) / 1024 / 80  # one mesh period
    loaded = np.full(6, 1.4e-6)
    forces = np.array([plant.interface_forces(loaded, np.zeros(6), Moment(u, 0.0)) for u in turns])
    shaking = forces @ plant.system.interfaces.T
    order = np.abs(np.fft.rfft(shaking, axis=0)) / len(turns)
    torsion, across = plant.system.dof("theta_s"), plant.system.dof("x_s")
    assert order[1, torsion] < 1e-9 * order[3, torsion]
    assert order[2, torsion] < 1e-9 * order[3, torsion]
    assert order[3, across] < 1e-9 * order[1, across]


def test_faulty_tooth_is_in_contact_with_ring_and_sun_in_turn(plant):
    """Ring first, the sun half a turn of the planet later less half a pitch; for contact ratio / 20 of it."""
    turns = np.arange(4000) / 4000
    crack = placed(plant, "planet_tooth_crack", closing=1.0)
    for (one, _), side in zip(crack, (SUN, RING), strict=True):
        value = one.series.value(turns)
        soft = value < 0.05 * value.min()
        assert np.mean(soft) == pytest.approx(plant.geometry.contacts[side].ratio / 20, abs=0.012)
        contact = plant.geometry.contacts[side]
        middle = np.angle(np.mean(np.exp(2j * np.pi * turns[soft]))) / (2 * np.pi)
        at_pitch_point = (0.5 - 0.5 / 20 if side == SUN else 0.0) + contact.middle / 20
        assert abs((middle - at_pitch_point + 0.5) % 1 - 0.5) < 0.3 / 20
    ((spall, _),) = placed(plant, "planet_tooth_spall", side="sun", tooth=3)
    value = spall.series.value(turns)
    assert turns[value.argmin()] == pytest.approx(0.475 + 2 / 20, abs=0.003)
    assert value.min() == pytest.approx(-26.5e-6, rel=0.05)  # 0.5 mm squared by 0.146 + 0.073 per mm, halved


def test_crack_is_deepest_where_it_opens(plant):
    """`opens_towards` and `closing` say how the loss is shared between the meshes with sun and ring."""
    losses = {}
    for towards in ("sun", "ring"):
        pairs = placed(plant, "planet_tooth_crack", opens_towards=towards)
        losses[towards] = [one.series.mean for one, _ in pairs]
    assert losses["sun"][SUN] < 2 * losses["ring"][SUN] < 0
    assert losses["ring"][RING] < 2 * losses["sun"][RING] < 0


@pytest.mark.parametrize("excess", [0.3, -0.4])
def test_unequal_load_sharing_has_the_excess_it_says(excess):
    params = load_planetary_params().with_physics(
        runout=False, tooth_profile=False, tooth_surface=False, mesh_stiffness_variation=False
    )
    plant = make_plant(params, 1)
    equal = mesh_forces(plant)
    assert equal == pytest.approx(np.full(6, 46.875 / 3 / 0.0375877), rel=1e-5)
    forces = mesh_forces(plant, placed(plant, "unequal_load_sharing", "planet_2", excess=excess))
    assert forces[1] == pytest.approx((1 + excess) * equal[1], rel=1e-6)
    # The torque of the sun is shared out among the others.
    assert forces[:3].sum() == pytest.approx(equal[:3].sum(), rel=1e-6)


def test_pin_ahead_takes_load_and_pin_outward_none_on_the_whole():
    params = load_planetary_params().with_physics(
        runout=False, tooth_profile=False, tooth_surface=False, mesh_stiffness_variation=False
    )
    plant = make_plant(params, 1)
    equal = mesh_forces(plant)
    ahead = mesh_forces(plant, placed(plant, "planet_position_error", ahead_m=1e-6)) - equal
    assert ahead[0] > 0 > ahead[1]
    assert ahead[0] == pytest.approx(ahead[3], rel=0.3)
    outward = mesh_forces(plant, placed(plant, "planet_position_error", ahead_m=0.0, outward_m=1e-6)) - equal
    assert abs(outward[:3].sum()) < 1e-6 * equal[0]
    assert np.abs(outward).max() < np.abs(ahead).max()


@pytest.mark.parametrize(
    ("kind", "component", "params", "field"),
    [
        ("planet_tooth_crack", "planet_4", {}, "component"),
        ("planet_tooth_crack", "planet_1", {"tooth": 21}, "tooth"),
        ("planet_tooth_crack", "planet_1", {"depth_m": "9 mm"}, "depth_m"),
        ("planet_tooth_spall", "planet_1", {"side": "left"}, "side"),
        ("planet_tooth_spall", "planet_1", {"width_m": "9 mm"}, "width_m"),
        ("unequal_load_sharing", "planet_1", {"excess": 5.0}, "excess"),
        ("planet_position_error", "planet_1", {"ahead_m": "900 um"}, "ahead_m"),
    ],
)
def test_impossible_faults_are_refused(plant, kind, component, params, field):
    with pytest.raises(InputError) as error:
        placed(plant, kind, component, **params)
    assert error.value.field == field


def test_nameplate_errors_name_what_is_possible():
    with pytest.raises(InputError, match="planetary"):
        load_planetary_params("unsw_parallel")
    with pytest.raises(InputError, match="<= 200"):
        load_planetary_params(overrides={"drive.load": "300 N*m"})


def line_hz(spectrum, expected_hz):
    """Frequency of the highest bin within 1 % or 4 bins of the expected one, if it stands out 20 dB."""
    reach = max(3, round(0.01 * expected_hz / BIN_HZ))
    middle = round(expected_hz / BIN_HZ)
    near = spectrum[max(1, middle - reach) : middle + reach + 1]
    assert near.max() > 10 * np.median(spectrum[max(1, middle - 30) : middle + 31])
    return (max(1, middle - reach) + int(near.argmax())) * BIN_HZ


@pytest.mark.parametrize("seed", [1])
def test_frequencies_of_table_7_4_emerge(seed):
    """With the first stage, each within one bin of a 10 s record, on a sensor where it belongs."""
    params = load_planetary_params(overrides={"first_stage.included": 1})
    sites = dict(make_plant(params, seed).sites) | {"torsion": {"theta_s": 1.0}}
    output = Engine(params, seed, 2048.0, sites=sites).advance(20480)
    window = np.hanning(20480)
    spectra = {
        name: np.abs(np.fft.rfft(accel * window))
        for name, accel in zip(output.site_names, output.accel, strict=True)
    }
    for site, expected in (
        ("torsion", 6.0),  # input shaft
        ("carrier", 192.0),  # spur gear mesh
        ("carrier", CARRIER_HZ),
        ("carrier", 80 * CARRIER_HZ),  # epicyclic mesh
        ("sun", 3 * CARRIER_HZ),  # rotation of the sun
        ("ring", 3 * CARRIER_HZ),  # planets passing
        # On the ring, which stands, the mesh is heard at the nearest multiple of the planets' passing.
        ("ring", 81 * CARRIER_HZ),
    ):
        assert abs(line_hz(spectra[site], expected) - expected) <= BIN_HZ, (site, expected)
    mesh_order, next_order = (spectra["ring"][round(k * CARRIER_HZ / BIN_HZ)] for k in (80, 81))
    assert mesh_order < 1e-3 * next_order
    turns = dict(zip(output.shaft_names, output.turns[:, -1] + output.fraction[:, -1], strict=True))
    assert turns["output"] / turns["carrier"] == pytest.approx(3, abs=1e-3)
    assert turns["input"] / turns["carrier"] == pytest.approx(90 / 32, abs=1e-3)


@pytest.mark.parametrize(("kind", "spins"), [("outer_race_spall", 0.5 * 15 * (1 - 2.5 / 20.5))])
def test_planet_bearing_faults_are_seen_on_ring_and_carrier(kind, spins):
    """Rollers pass a spall of the outer race, which turns with the planet, at the ring's speed on the pin.

    The pin presses always the same way, so the spall is loaded once for each turn of the planet: lines at
    BPFO and at the planet's spin from it.
    """
    overrides = {"planet_bearing.included": 1, "gear_errors.runout": "2 um", "mesh.harmonics": 8}
    params = load_planetary_params(overrides=overrides)
    plate = load_machine("unsw_planetary")
    spin_hz = plate.shaft("planet").nominal_speed_hz
    fault = FaultSpec(kind, "planet_1_bearing", {"width_m": "0.6 mm"})
    engine = Engine(params, 1, 16384.0, 8, [fault])
    signals = dict(zip(engine.site_names, engine.advance(10 * 16384).accel, strict=True))
    for site in ("carrier", "ring"):
        band = sosfiltfilt(butter(4, (2500, 6000), "band", fs=16384.0, output="sos"), signals[site])
        squared = np.abs(hilbert(band)) ** 2
        spectrum = np.abs(np.fft.rfft((squared - squared.mean()) * np.hanning(squared.size)))
        assert abs(line_hz(spectrum, spins * spin_hz) - spins * spin_hz) <= BIN_HZ, site


def test_any_number_of_planets_runs():
    """Four planets with the least mesh angle between neighbours uneven; the planets' names follow."""
    params = load_planetary_params()
    stage = dataclasses.replace(params.stage, planet_angles_rad=tuple(np.radians([0, 90, 180, 273])))
    plant = make_plant(params.model_copy(update={"stage": stage}), 1)
    assert plant.planet_names == ("planet_1", "planet_2", "planet_3", "planet_4")
    forces = mesh_forces(plant)
    assert forces[:4].sum() * 0.0375877 == pytest.approx(46.875, rel=1e-5)


def test_pitch_point_is_in_single_contact_at_the_sun_and_in_double_contact_at_the_ring():
    """From Table 7.5: pairs are in contact from -0.857 to 0.778 and from -0.778 to 1.111 base pitches."""
    plant = make_plant(load_planetary_params(), 1)
    levels = {}
    for side, ends in ((SUN, (-0.857, 0.778)), (RING, (-0.778, 1.111))):
        mesh = plant.meshes[3 * side]
        pitches = np.arange(200) / 200
        stiffness = [mesh.stiffness_at(plant.phases((p - mesh.phase_offset) / 80)) for p in pitches]
        pairs = np.array([sum(ends[0] < p + n < ends[1] for n in (-1, 0, 1)) for p in pitches])
        levels[side] = np.interp(0.0, pitches, stiffness)
        middle = (max(stiffness) + min(stiffness)) / 2
        # All but the places of the hand-over, which the series rounds over 1 / 40 of a pitch.
        assert np.mean((np.array(stiffness) > middle) == (pairs == 2)) > 0.95
    assert levels[SUN] < 0.8 * levels[RING]
