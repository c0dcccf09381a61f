"""Any tooth numbers and any bearings in the parallel-shaft model: the reducer of `examples`, 19/47 teeth.

Roller, ball and two-row bearings; the frequencies of both shafts come about in the simulated signals, where
nobody has entered them. Expected frequencies are those of the nameplate (gearsim_dsp), within one bin of a
10 s record.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, hilbert, sosfiltfilt

from gearsim_dsp.kinematics import fault_families
from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine
from gearsim_sim.engine import Engine
from gearsim_sim.events import FaultSpec
from gearsim_sim.model.hertz import LINE_EXPONENT, POINT_EXPONENT
from gearsim_sim.model.plants import make_plant
from gearsim_sim.params import load_parallel_params
from gearsim_sim.scenario import load_scenario

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
MACHINE = EXAMPLES / "reducer_19_47.yaml"
RATE_HZ, SECONDS, SPEED_HZ = 32768.0, 10.0, 25.0  # 131072 steps a second, the fewest that there are
BAND_HZ = (9000.0, 14000.0)  # about the resonators of the pedestals at 12 kHz
BIN_HZ = 1 / SECONDS


@pytest.fixture(scope="module")
def params():
    return load_parallel_params(MACHINE)


@pytest.fixture(scope="module")
def healthy(params):
    return Engine(params, 1, RATE_HZ, sites={"b2_y": {"y_p2": 1.0}}).advance(round(SECONDS * RATE_HZ))


def strongest(spectrum, expected_hz, reach_hz=3.0):
    """Frequency of the highest line within `reach_hz` of the expected one, and its height over the median."""
    frequency = np.arange(spectrum.size) * BIN_HZ
    near = np.flatnonzero(np.abs(frequency - expected_hz) <= reach_hz)
    top = near[np.argmax(spectrum[near])]
    return frequency[top], spectrum[top] / np.median(spectrum[near])


def envelope_spectrum(x):
    sos = butter(4, BAND_HZ, "bandpass", fs=RATE_HZ, output="sos")
    envelope = np.abs(hilbert(sosfiltfilt(sos, x))) ** 2
    return np.abs(np.fft.rfft((envelope - envelope.mean()) * np.hanning(envelope.size)))


def test_each_bearing_has_its_own_numbers(params):
    plant = make_plant(params, 1)
    laws = [seat.law for seat in plant.bearings]
    assert [law.exponent for law in laws] == [LINE_EXPONENT, POINT_EXPONENT, POINT_EXPONENT, POINT_EXPONENT]
    assert [law.rows for law in laws] == [1, 1, 1, 2]
    assert [law.ball_count for law in laws] == [13, 9, 9, 24]
    assert [law.clearance_m for law in laws] == pytest.approx([4e-6, 3e-6, 3e-6, 5e-6])
    assert plant.sites["b3_y"] == {"y_p3": 1.0}
    stiffness = plant.system.stiffness
    for number, own in enumerate((3e8, 8e7, 8e7, 1.2e8), 1):
        shaft, pedestal = plant.system.dof(f"y_s{number}"), plant.system.dof(f"y_p{number}")
        assert -stiffness[shaft, pedestal] == own
        assert plant.bearings[number - 1].nominal_stiffness_n_per_m == own


def test_one_number_of_one_bearing_can_be_replaced():
    changed = load_parallel_params(MACHINE, {"seats.bearing_1.bearing.radial_clearance": "7 um"}, "test")
    assert [own.radial_clearance_m for own in changed.rolling_bearings] == pytest.approx(
        [7e-6, 3e-6, 3e-6, 5e-6]
    )
    shared = load_parallel_params(MACHINE, {"ball_bearing.radial_clearance": "2 um"}, "test")
    assert [own.radial_clearance_m for own in shared.rolling_bearings] == pytest.approx(
        [4e-6, 2e-6, 2e-6, 5e-6]
    )


def test_frequencies_of_shafts_and_mesh(healthy):
    """Run-out of either gear, tooth mesh and its sidebands of both shafts."""
    x = healthy.accel[healthy.site_names.index("b2_y")]
    spectrum = np.abs(np.fft.rfft(x * np.hanning(x.size)))
    output = SPEED_HZ * 19 / 47
    mesh = 19 * SPEED_HZ
    for expected in (SPEED_HZ, output, mesh, mesh - SPEED_HZ, mesh + SPEED_HZ, mesh - output, mesh + output):
        found, height = strongest(spectrum, expected)
        assert abs(found - expected) <= BIN_HZ
        assert height > 20


def test_teeth_in_contact_change_with_the_pinion(params):
    """Without any error of the teeth, their stiffness alone is heard: at the tooth mesh and its multiples."""
    off = dict.fromkeys(("runout", "tooth_profile", "tooth_pitch", "tooth_surface", "ball_passing"), False)
    engine = Engine(params.with_physics(**off), 1, RATE_HZ, sites={"b2_y": {"y_p2": 1.0}})
    x = engine.advance(round(SECONDS * RATE_HZ)).accel[0]
    spectrum = np.abs(np.fft.rfft(x * np.hanning(x.size)))
    mesh = 19 * SPEED_HZ
    found, height = strongest(spectrum, mesh, reach_hz=400.0)
    assert abs(found - mesh) <= BIN_HZ
    assert height > 1e6  # nothing else between 75 and 875 Hz but the ends of the window
    assert round(np.argmax(spectrum) * BIN_HZ / mesh, 3) % 1 == 0


def test_both_shafts_turn_as_the_teeth_say(healthy):
    angle = healthy.turns + healthy.fraction
    mean = (angle[:, -1] - angle[:, 0]) / (angle.shape[1] - 1) * RATE_HZ
    # Twists of encoders are below 1e-4 turns; over 10 s that is 1e-5 Hz.
    assert mean == pytest.approx([SPEED_HZ, SPEED_HZ * 19 / 47], abs=2e-5)


def test_power_goes_through(healthy, params):
    """Torque x speed is the same at both couplings, averaged over the time after which teeth meet again."""
    teeth_again = round(47 / SPEED_HZ * RATE_HZ)  # 47 turns of the pinion, 19 of the gear
    torque = {name: values[-teeth_again:].mean() for name, values in healthy.signals.items()}
    speed = healthy.speed_hz[:, -teeth_again:].mean(axis=1)
    assert torque["output_torque"] == pytest.approx(params.model.drive.load_nm, rel=1e-4)
    power = torque["input_torque"] * speed[0], torque["output_torque"] * speed[1]
    assert power[0] == pytest.approx(power[1], rel=2e-4)
    assert torque["input_torque"] == pytest.approx(100 * 19 / 47, rel=1e-4)


CASES = [
    ("bearing_1", "outer_race", 1),  # rollers, input shaft
    ("bearing_2", "inner_race", 1),  # balls, input shaft
    ("bearing_3", "outer_race", 1),  # balls, output shaft
    ("bearing_4", "inner_race", 2),  # second row of a two-row bearing, output shaft
]


@pytest.fixture(scope="module")
def faulty(params):
    """All faults at once; each pedestal hears its own bearing best."""
    faults = [FaultSpec(f"{race}_spall", bearing, {"row": row}) for bearing, race, row in CASES]
    sites = {f"b{number}_y": {f"y_p{number}": 1.0} for number in range(1, 5)}
    return Engine(params, 1, RATE_HZ, faults=faults, sites=sites).advance(round(SECONDS * RATE_HZ))


@pytest.mark.parametrize(("bearing", "race", "row"), CASES)
def test_frequencies_of_bearings(faulty, bearing, race, row):  # noqa: ARG001
    x = faulty.accel[faulty.site_names.index(f"b{bearing[-1]}_y")]
    plate = load_machine(MACHINE)
    (family,) = (f for f in fault_families(plate) if (f.component, f.fault) == (bearing, race))
    expected = family.order * SPEED_HZ
    found, height = strongest(envelope_spectrum(x), expected)
    assert abs(found - expected) <= BIN_HZ
    assert height > 20


def changed_file(tmp_path, *pairs):
    text = MACHINE.read_text(encoding="utf-8")
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "gearbox.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_teeth_and_radii_must_fit(tmp_path):
    path = changed_file(tmp_path, ("driven_teeth: {value: 47", "driven_teeth: {value: 48"))
    with pytest.raises(InputError, match=r"gear.base_radius.*0\.0676578.* 19 and 48 teeth"):
        load_parallel_params(path)


def without_teeth(tmp_path, *pairs):
    """The machine without the section that describes its teeth."""
    text = changed_file(tmp_path, *pairs).read_text(encoding="utf-8")
    before, rest = text.split("  teeth:  #")
    path = tmp_path / "plain.yaml"
    path.write_text(before + "  gear_errors:" + rest.split("  gear_errors:")[1], encoding="utf-8")
    return path


@pytest.mark.parametrize("distance", ["90", "130"])
def test_axes_must_be_where_teeth_meet(tmp_path, distance):
    """Closer than the base circles, or so far apart that the flanks pass each other."""
    pair = ("centre_distance: {value: 99,", f"centre_distance: {{value: {distance},")
    with pytest.raises(InputError, match=r"mesh.centre_distance.*0\.0944.* to 0\.11356.* m"):
        load_parallel_params(without_teeth(tmp_path, pair))


def test_axes_of_known_teeth(tmp_path):
    """Closer than 99 mm the teeth wedge; 100 mm leaves less contact, 104 mm none between two teeth."""
    for distance, expected in (
        ("98.9", r"at least 0\.099"),
        ("104", r"nearer to 0\.099 m: contact_ratio 1 or more"),
    ):
        pair = ("centre_distance: {value: 99,", f"centre_distance: {{value: {distance},")
        with pytest.raises(InputError, match=f"mesh.centre_distance.*{expected}"):
            load_parallel_params(changed_file(tmp_path, pair))
    pair = ("centre_distance: {value: 99,", "centre_distance: {value: 100,")
    wide = load_parallel_params(changed_file(tmp_path, pair)).gear_pair
    assert wide.centre_distance_m == pytest.approx(0.1, rel=1e-12)
    assert 1 < wide.contact_ratio < load_parallel_params(MACHINE).gear_pair.contact_ratio


def test_module_and_radii_must_fit(tmp_path):
    with pytest.raises(InputError, match=r"teeth.module.*base radius 0\.0267812"):
        load_parallel_params(changed_file(tmp_path, ("module: {value: 3,", "module: {value: 2.5,")))


IMPOSSIBLE = [
    ("        element_length:", "        length:", "seats.bearing_1.bearing.*element_length"),
    ("value: 7.5, unit: mm", "value: 9.5, unit: mm", "rolling_elements.*fit on a pitch circle"),
    ("  pedestal:\n", "  plinth:\n", "pedestal.*nothing|plinth.*pedestal"),
    ("    bearing_4:\n      inertia", "    bearing_5:\n      inertia", "seats.*bearing_1, bearing_2"),
    ("radial_clearance: {value: 4,", "radial_clearance: {value: 900,",
     "seats.bearing_1.bearing.radial_clearance.*load zone"),
    ("radial_clearance: {value: 3,", "radial_clearance: {value: 900,",
     "ball_bearing.radial_clearance.*load zone"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "expected"), IMPOSSIBLE)
def test_what_cannot_be_is_named(tmp_path, old, new, expected):
    path = changed_file(tmp_path, (old, new))
    with pytest.raises(InputError, match=expected):
        make_plant(load_parallel_params(path), 1)


def test_the_example_scenario_is_one():
    scenario = load_scenario(EXAMPLES / "reducer_run.yaml")
    assert scenario.machine.name == "reducer_19_47"
    assert [event.fault.component for event in scenario.events] == ["bearing_3"]
