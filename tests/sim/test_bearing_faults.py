"""Faults of bearings in the running model: against the readable forces, closed forms and spectra."""

import math

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from gearsim_io.nameplate import Bearing
from gearsim_sim.engine import Engine
from gearsim_sim.events import FaultSpec
from gearsim_sim.integrate.decimate import HALF_LENGTH_SAMPLES
from gearsim_sim.model.bearing_faults import SurfaceProfile
from gearsim_sim.model.cage_slip import jitter_key, knot_value
from gearsim_sim.model.faults import REGISTRY
from gearsim_sim.model.pit import inside_fraction
from gearsim_sim.model.plants import make_plant
from gearsim_sim.model.ring import Ring
from gearsim_sim.model.rolling_bearing import make_rolling_bearing
from gearsim_sim.model.surface import waviness_series
from gearsim_sim.params import load_parallel_params
from gearsim_sim.params.bearing import RollingBearing

RATE_HZ = 65536.0
SPEED_HZ = 10.0
START_TURNS, SETTLING_S = 0.5, 0.5  # of a run before sample 0
NAME, INDEX = "bearing_3", 2
PROBES = tuple(f"b3_{axis}.{what}" for axis in "xy" for what in ("displacement_m", "force_n"))


@pytest.fixture(scope="module")
def params():
    return load_parallel_params()


@pytest.fixture(scope="module")
def plant(params):
    return make_plant(params, 1)


def run(params, faults, samples, *, rate_hz=RATE_HZ, oversampling=4, load_nm=50.0):
    specs = [FaultSpec(kind, NAME, given, severity) for kind, given, severity in faults]
    engine = Engine(params, 1, rate_hz, oversampling, specs, load_nm=load_nm, probes=PROBES)
    return engine.advance(samples)


def motion_and_force(output):
    """Displacement and contact force of bearing_3, shapes (n, 2)."""
    q = np.column_stack([output.probes[f"b3_{axis}.displacement_m"] for axis in "xy"])
    return q, np.column_stack([output.probes[f"b3_{axis}.force_n"] for axis in "xy"])


def turns_at(samples, rate_hz=RATE_HZ):
    return START_TURNS + SPEED_HZ * np.asarray(samples) / rate_hz


def contributions(plant, kind, given, seed=1):
    return REGISTRY[kind].build(FaultSpec(kind, NAME, given), plant, seed).contributions


# --- the compiled loop against the readable forces -----------------------------------------------------

STATELESS = [
    ("outer_race_spall", {"width_m": "1.5 mm", "row": 2}),
    ("inner_race_spall", {"position_rad": 0.4}),
    ("rolling_element_spall", {"ball": 5, "position_rad": 1.0}),
    ("wide_spall", {"length_m": "14 mm"}),
    ("wide_spall", {"race": "inner", "length_m": "30 mm", "depth_m": "8 um"}),
    ("extended_roughness", {}),
    ("extended_roughness", {"race": "outer", "row": 2, "length_m": "9 mm"}),
    ("race_waviness", {"race": "outer"}),
    ("race_waviness", {}),
    ("ball_waviness", {}),
    ("off_size_ball", {"row": 2, "ball": 7}),
    ("bearing_clearance", {}),
    ("bearing_preload", {}),
]


@pytest.mark.parametrize(("kind", "given"), STATELESS)
def test_loop_has_the_readable_forces(params, plant, kind, given):
    """Half a turn of the shaft, at every hundredth sample, severity 0.7.

    The loop works with the predicted displacement, which differs from the corrected one by less than 1e-4 of
    what contact forces change in a step.
    """
    output = run(params, [(kind, given, 0.7)], 3300)
    faults = tuple((one, 0.7) for one in contributions(plant, kind, given))
    q, force = motion_and_force(output)
    seat = plant.bearings[INDEX]
    samples = np.arange(0, 3300, 100)
    expected = [
        seat.force(q[i], plant.phases(turns), faults)
        for i, turns in zip(samples, turns_at(samples), strict=True)
    ]
    assert force[samples] == pytest.approx(np.array(expected), rel=1e-4, abs=1e-4 * np.abs(force).max())
    without = [
        seat.force(q[i], plant.phases(turns)) for i, turns in zip(samples, turns_at(samples), strict=True)
    ]
    assert np.abs(np.array(without) - expected).max() > 0.01 * np.abs(force).max()


def test_rectangular_pits_are_averaged_in_the_loop(params, plant):
    """Force of the ball in the pit, weighed by the part of the step that it spends there."""
    given = {"geometry": "rectangular", "width_m": "0.8 mm", "depth_m": "6 um"}
    output = run(params, [("outer_race_spall", given, 1.0)], 8000)
    (spall,) = contributions(plant, "outer_race_spall", given)
    seat = plant.bearings[INDEX]
    law, rate = seat.law, plant.rates[seat.cage]
    travel = 2 * math.pi * abs(rate) * SPEED_HZ / (4 * RATE_HZ)
    q, force = motion_and_force(output)
    partial = 0
    for i, turns in enumerate(turns_at(np.arange(8000))):
        cage = 2 * math.pi * rate * turns
        azimuths = law.azimuths_rad[: law.balls_per_row] + cage
        away = np.angle(np.exp(1j * (azimuths - spall.position_rad)))
        parts = np.array([inside_fraction(a, spall.half_width_rad, travel) for a in away])
        if 0 < parts.max() < 1:
            partial += 1
        elif i % 100:
            continue
        part = np.concatenate([parts, np.zeros(law.balls_per_row)])
        inside = law.ball_forces(law.compressions(q[i], cage, 6e-6))
        outside = law.ball_forces(law.compressions(q[i], cage))
        forces = part * inside + (1 - part) * outside
        angles = law.azimuths_rad + cage
        expected = [forces @ np.cos(angles), forces @ np.sin(angles)]
        assert force[i] == pytest.approx(expected, rel=1e-4, abs=0.1)
    assert partial >= 2  # one step in four is a sample


def slow_jitter(key, position, stride=0):
    knot = math.floor(position)
    u = position - knot
    rise = u**3 * (10 - u * (15 - 6 * u))
    return knot_value(key, knot + stride) * (1 - rise) + knot_value(key, knot + stride + 1) * rise


@pytest.mark.parametrize("walk", [0.0, 0.8])
def test_slipping_cage_in_the_loop(params, plant, walk):
    """Forces with the cage and each ball where slip, jitter and play put them, worked out by themselves."""
    given = {"slip": 0.03, "jitter_rad": 0.05, "pocket_play_rad": 0.02, "knot_turns": 0.1, "walk": walk}
    count, step_s = 3000, 1 / (4 * RATE_HZ)
    q, force = motion_and_force(run(params, [("cage_slip", given, 1.0)], count))
    seat = plant.bearings[INDEX]
    law, rate = seat.law, plant.rates[seat.cage]
    slip_key, jitter_of, play_of = (jitter_key(1, f"{NAME}/{name}") for name in ("slip", "jitter", "play"))
    before = round(SETTLING_S / step_s) + 4 * HALF_LENGTH_SAMPLES  # steps of a run up to sample 0
    # each step reads the random functions where the cage was before it
    positions = abs(rate) * SPEED_HZ * step_s * np.arange(before + 4 * count) / 0.1
    wander = [slow_jitter(slip_key, position) if walk else 0.0 for position in positions]
    lag = np.cumsum(0.03 * (1 + walk * np.array(wander))) * 2 * math.pi * rate * SPEED_HZ * step_s
    for i in range(0, count, 250):
        last = before + 4 * i - 1
        ahead = 0.05 * slow_jitter(jitter_of, positions[last]) - lag[last]
        play = [0.02 * slow_jitter(play_of, positions[last], j << 40) for j in range(law.ball_count)]
        angles = law.azimuths_rad + 2 * math.pi * rate * turns_at(i) + ahead + play
        forces = law.ball_forces(q[i, 0] * np.cos(angles) + q[i, 1] * np.sin(angles) - law.clearance_m)
        expected = [forces @ np.cos(angles), forces @ np.sin(angles)]
        assert force[i] == pytest.approx(expected, rel=1e-4, abs=0.1)


def test_oil_film_in_the_loop(params, plant):
    """Films of all balls in 16 implicit substeps per sample, along the motion of a run with a spall."""
    given, count = {"viscosity_pa_s": 0.5}, 600
    faults = [("oil_film", given, 1.0), ("outer_race_spall", {}, 1.0)]
    q, force = motion_and_force(run(params, faults, count, rate_hz=4 * RATE_HZ, oversampling=2))
    seat, rate_hz = plant.bearings[INDEX], 4 * RATE_HZ
    law = seat.law
    (term,) = contributions(plant, "oil_film", given)
    unit, power, squeeze, _ = term.values
    unit *= SPEED_HZ**power
    (spall,) = contributions(plant, "outer_race_spall", {})
    time = np.arange(count) / rate_hz
    spline = CubicSpline(time, q)
    h = unit * np.full(law.ball_count, 100.0) ** (-1 / 15)
    substeps, first = 16, 100  # the films forget within 100 samples what they began with
    step = 1 / rate_hz / substeps
    for i in range(1, count):
        for k in range(1, substeps + 1):
            t = time[i - 1] + k * step
            phases = plant.phases(START_TURNS + SPEED_HZ * t)
            cage = seat.cage_angle_rad(phases)
            gaps = law.compressions(spline(t), cage, spall.missing(law, cage, phases))
            h = implicit_film(h, gaps, unit, squeeze, law.load_factor, step)
        if i > first and i % 20 == 0:
            angles = law.azimuths_rad + cage
            forces = law.ball_forces(gaps + h)
            expected = [forces @ np.cos(angles), forces @ np.sin(angles)]
            assert force[i] == pytest.approx(expected, rel=1e-3, abs=0.5)


def implicit_film(before, gaps, unit, squeeze, factor, step):
    """c(h) (h - before) / step = Q_s - Q by bisection of log h, for all balls."""
    low, high = np.log(before) - 1.0, np.log(before) + 1.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        h = np.exp(middle)
        force = factor * np.maximum(gaps + h, 0.0) ** 1.5
        rest = squeeze / h * (h - before) / step - ((unit / h) ** 15 - force)
        low, high = np.where(rest < 0, middle, low), np.where(rest < 0, high, middle)
    return np.exp(0.5 * (low + high))


# --- frequencies -------------------------------------------------------------------------------------


def added_spectrum(params, faults, base=(), seconds=10.0, rate_hz=2048.0):
    """Amplitudes of what faults add to the contact force in y, and the width of a bin [Hz]."""
    count = int(seconds * rate_hz)
    forces = [
        motion_and_force(run(params, list(one), count, rate_hz=rate_hz))[1][:, 1]
        for one in ((*base, *faults), base)
    ]
    added = (forces[0] - forces[1]) * np.hanning(count)
    return np.abs(np.fft.rfft(added)), 1 / seconds


def strongest(spectrum, bin_hz, count, top_hz=400.0):
    """Frequencies of the greatest separate peaks."""
    spectrum = spectrum[: int(top_hz / bin_hz)].copy()
    spectrum[:4] = 0
    found = []
    for _ in range(count):
        i = int(np.argmax(spectrum))
        found.append(i * bin_hz)
        spectrum[max(0, i - 3) : i + 4] = 0
    return np.array(found)


def off_grid(frequencies, *grids):
    """Distance of each frequency from the nearest sum of multiples of the grids (12 and 4 times at most)."""
    sums = np.array([0.0])
    for i, grid in enumerate(grids):
        multiples = np.arange(-12, 13) if i == 0 else np.arange(-4, 5)
        sums = (sums[:, None] + grid * multiples).ravel()
    return np.abs(frequencies[:, None] - np.abs(sums)).min(axis=1)


FTF = 0.5 * SPEED_HZ * (1 - 7.12 / 38.5)
BPFO, BPFI = 12 * FTF, 12 * (SPEED_HZ - FTF)
BSF = 38.5 / (2 * 7.12) * SPEED_HZ * (1 - (7.12 / 38.5) ** 2)


@pytest.mark.parametrize(
    ("kind", "given", "grids"),
    [
        ("outer_race_spall", {}, (BPFO,)),
        ("inner_race_spall", {}, (BPFI, SPEED_HZ)),
        ("rolling_element_spall", {}, (2 * BSF, FTF)),
        ("wide_spall", {}, (BPFO,)),
        ("off_size_ball", {}, (FTF,)),
    ],
)
def test_lines_stand_where_kinematics_say(params, kind, given, grids):
    """The six greatest lines of what the fault adds, within one bin of a 10 s record (thesis 2.2.1, 5.5)."""
    quiet = params.with_physics(
        runout=False,
        tooth_profile=False,
        tooth_pitch=False,
        tooth_surface=False,
        mesh_stiffness_variation=False,
    )
    spectrum, bin_hz = added_spectrum(quiet, [(kind, given, 1.0)])
    lines = strongest(spectrum, bin_hz, 6)
    assert off_grid(lines, *grids).max() <= bin_hz, lines


@pytest.mark.parametrize(
    ("kind", "lines"),
    [
        ("outer_race_spall", (2 * BPFO, 4 * BPFO)),
        ("rolling_element_spall", (2 * BSF, 4 * BSF)),
        ("ball_waviness", (2 * BSF,)),
    ],
)
def test_slip_moves_lines_as_set(params, kind, lines):
    """By 2 % / (1 + F / F_1) with the measured mean force; bounded jitter leaves the line where it is."""
    halving, slip = 800.0, 0.02
    given = {"slip": slip, "halving_force_n": f"{halving} N", "jitter_rad": 0.01, "pocket_play_rad": 0.002}
    output = run(params, [("cage_slip", given, 1.0)], 2048, rate_hz=2048.0)
    _, force = motion_and_force(output)
    share = slip / (1 + np.hypot(*force.T).mean() / halving)
    one = {"ball": 1} if kind == "ball_waviness" else {}
    spectrum, bin_hz = added_spectrum(params, [(kind, one, 1.0)], (("cage_slip", given, 1.0),))
    for line in lines:
        expected = line * (1 - share)
        # between the sidebands of a ball's spall, which are the turns of the cage apart
        near = slice(int((expected - 2) / bin_hz), int((expected + 2) / bin_hz))
        found = (near.start + np.argmax(spectrum[near])) * bin_hz
        assert found == pytest.approx(expected, abs=bin_hz)
        assert abs(expected - line) > 3 * bin_hz


@pytest.mark.parametrize("race", ["inner", "outer"])
def test_lobes_beside_the_number_of_balls_push_radially(race):
    """One preloaded row of 12 balls: of these lobes only 11, 13, 23, 25 move the ring (Wardle 1988).

    Inner: at k BPFI -/+ shaft; outer: at k BPFO.
    """
    plate = Bearing("row", "shaft", 12, 7.12e-3, 38.5e-3)
    law = make_rolling_bearing(
        plate,
        RollingBearing.model_validate(
            {
                "radial_clearance": "-10 um",
                "inner_groove_conformity": 0.52,
                "youngs_modulus": "206 GPa",
                "poisson_ratio": 0.3,
                "nominal_stiffness": "1e8 N/m",
            }
        ),
        load_direction_rad=0.0,
    )
    cage = law.cage_rate(1.0)
    count, total = 2048, 20
    turns = np.arange(count) / count * total
    for order in (2, 3, 6, 10, 11, 12, 13, 14, 22, 23, 24, 25, 26):
        table = waviness_series((order,), (1e-9,), np.zeros(1)).table()
        ring = Ring(0, 1.0 if race == "inner" else 0.0)
        shape = SurfaceProfile(0, 0, 12, ring, False, 0.0, 1.0, table)
        force = []
        for shaft in turns:
            angle = 2 * math.pi * cage * shaft
            force.append(law.force(np.zeros(2), angle, shape.missing(law, angle, np.array([shaft])))[0])
        amplitude = np.abs(np.fft.rfft(np.array(force) * np.hanning(count))) / (count / 4)
        stiffness = law.stiffness(np.zeros(2), 0.0)[0, 0]
        if order not in (11, 13, 23, 25):
            assert amplitude.max() < 1e-3 * stiffness * 1e-9
            continue
        assert amplitude.max() > 0.7 * stiffness * 1e-9
        k = round(order / 12)
        line = k * 12 * (1 - cage) + (order - k * 12) if race == "inner" else k * 12 * cage
        assert np.argmax(amplitude) / total == pytest.approx(line, abs=1 / total)


# --- what faults do ------------------------------------------------------------------------------------


def above(values, rate_hz, low_hz):
    """Rms of what lies above a frequency."""
    spectrum = np.fft.rfft((values - values.mean()) * np.hanning(values.size))
    frequency = np.fft.rfftfreq(values.size, 1 / rate_hz)
    return float(np.sqrt(np.sum(np.abs(spectrum[frequency > low_hz]) ** 2)))


@pytest.fixture(scope="module")
def healthy(params):
    return run(params, [], 8192)


def test_rough_zone_begins_and_ends_without_impulse(params, healthy):
    """The smooth bucket alone against a pit with edges of the same depth: 30 dB less above 5 kHz."""
    bucket = {"race": "outer", "length_m": "8 mm", "depth_m": "3 um", "roughness_m": "0.001 um", "row": 1}
    pit = {"race": "outer", "length_m": "8 mm", "depth_m": "3 um", "edge_radius_m": "0.01 mm"}
    added = {}
    for kind, given in (("extended_roughness", bucket), ("wide_spall", pit)):
        output = run(params, [(kind, given, 1.0)], 8192)
        change = motion_and_force(output)[1][:, 1] - motion_and_force(healthy)[1][:, 1]
        added[kind] = (above(change, RATE_HZ, 5000.0), np.abs(change).max())
    assert added["extended_roughness"][1] > 0.3 * added["wide_spall"][1]  # it is as deep
    assert added["extended_roughness"][0] < 10 ** (-30 / 20) * added["wide_spall"][0]


def test_oil_film_softens_the_exit(params):
    """What a spall adds to the contact force above 8 kHz, in cold thick oil against none."""
    added = []
    for film in ([], [("oil_film", {"viscosity_pa_s": 0.5}, 1.0)]):
        with_pit, without = (
            motion_and_force(run(params, [*film, *pit], 8192))[1][:, 1]
            for pit in ([("outer_race_spall", {}, 1.0)], [])
        )
        added.append(above(with_pit - without, RATE_HZ, 8000.0))
    assert added[1] < 0.8 * added[0]


def test_rectangular_pits_alias_little(params):
    """4 steps per sample against 64: the error is 50 dB below what the pit adds (measured: 57 dB)."""
    pit = [("outer_race_spall", {"geometry": "rectangular"}, 1.0)]
    fine, coarse = (run(params, pit, 4096, oversampling=steps).accel[5] for steps in (64, 4))
    effect = coarse - run(params, [], 4096).accel[5]
    assert np.std(coarse - fine) < 10 ** (-50 / 20) * np.std(effect)


def test_clearance_and_preload_change_the_stiffness(params):
    """A worn ring sinks deeper under the same load, a tight one less."""
    heights = []
    for faults in ([], [("bearing_clearance", {}, 1.0)], [("bearing_preload", {}, 1.0)]):
        q, _ = motion_and_force(run(params, faults, 2000))
        heights.append(-q[:, 1].mean())
    # the added gap of 15 um, and more as fewer balls carry; the tight ring loses its clearance of 5 um
    assert heights[1] - heights[0] > 15e-6
    assert heights[0] - heights[2] > 5e-6
