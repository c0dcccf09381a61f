"""The engine: chunk invariance, events, angles, off switches, limits."""

import numpy as np
import pytest
from scipy.signal import butter, hilbert, sosfiltfilt

from gearsim_io.errors import InputError
from gearsim_sim.engine import Engine, probe_names
from gearsim_sim.events import Clear, FaultSpec, Inject, SetOperatingPoint
from gearsim_sim.model.faults import fault_kind
from gearsim_sim.model.plants import make_plant
from gearsim_sim.params import load_parallel_params

RATE_HZ = 65536.0
SPALL = FaultSpec("outer_race_spall", "bearing_3", {"position_rad": -1.2})


@pytest.fixture(scope="module")
def params():
    return load_parallel_params()


def run(engine, total, chunk, probe=None):
    parts = [engine.advance(min(chunk, total - at)) for at in range(0, total, chunk)]
    return {
        name: np.concatenate([getattr(part, name) for part in parts], axis=1)
        for name in ("accel", "turns", "fraction", "speed_hz")
    } | ({probe: np.concatenate([part.probes[probe] for part in parts])} if probe else {})


@pytest.mark.parametrize("chunk", [1, 7, 64, 1000])
def test_output_is_the_same_for_any_chunk(params, chunk):
    """Bit for bit, with events inside, across anchors and the ends of the buffer."""
    total, probe = 3000, "b3_y.force_n"

    def engine():
        result = Engine(params, 7, 16384.0, 8, probes=[probe])
        result.inject(SPALL, ramp_s=0.02, at_sample=201)
        result.set_operating_point(speed_hz=11.0, load_nm=60.0, ramp_s=0.05, at_sample=777)
        result.clear(ramp_s=0.03, at_sample=1500)
        return result

    whole, parts = run(engine(), total, total, probe), run(engine(), total, chunk, probe)
    for name, values in whole.items():
        assert np.array_equal(values, parts[name]), name


def test_two_engines_do_not_disturb_each_other(params):
    alone = Engine(params, 1, RATE_HZ).advance(600).accel
    first, second = Engine(params, 1, RATE_HZ), Engine(params, 2, RATE_HZ)
    pieces = []
    for _ in range(6):
        pieces.append(first.advance(100).accel)
        second.advance(130)
    assert np.array_equal(np.concatenate(pieces, axis=1), alone)


def test_compiled_forces_equal_the_readable_model(params):
    """Bearing forces of the loop against `Plant`, at the displacements of the loop."""
    fault = FaultSpec("inner_race_spall", "bearing_2", {"row": 2})
    faults = [SPALL, fault]
    plant = make_plant(params, 3)
    output = Engine(params, 3, RATE_HZ, 4, faults, probes=probe_names(plant)).advance(3000)
    spalls = [fault_kind(spec.kind).build(spec, plant).contributions[0] for spec in faults]
    crossed = 0
    for i in range(0, 3000, 13):
        phases = plant.phases(0.5 + 10.0 * i / RATE_HZ)
        q = np.array([output.probes[f"{name}.displacement_m"][i] for name in plant.system.interface_names])
        for bearing, seat in enumerate(plant.bearings):
            found = [output.probes[f"b{bearing + 1}_{axis}.force_n"][i] for axis in "xy"]
            own = tuple((spall, 1.0) for spall in spalls if spall.bearing == bearing)
            # The loop takes its forces at the predicted motion, which differs in the tenth digit.
            assert found == pytest.approx(seat.force(q[[seat.x, seat.y]], phases, own), abs=1e-3)
            crossed += np.any(seat.missing(phases, own) > 5e-6)
    assert crossed > 10


def test_probed_mesh_force_carries_the_torque(params):
    output = Engine(params, 3, RATE_HZ, probes=["mesh.force_n"]).advance(int(0.4 * RATE_HZ))
    assert np.mean(output.probes["mesh.force_n"]) == pytest.approx(50 / 0.0463, rel=1e-3)


def test_angles_turn_at_the_commanded_speed(params):
    engine = Engine(params, 1, RATE_HZ)
    output = engine.advance(int(RATE_HZ))
    turns = output.turns + output.fraction
    mean = (turns[:, -1] - turns[:, 0]) / (output.sample_count - 1) * RATE_HZ
    assert mean == pytest.approx([10.0, 10.0], rel=1e-4)
    assert output.turns.min() == 0  # counting starts at zero
    assert np.all((output.fraction >= 0) & (output.fraction < 1))


def test_speed_is_the_derivative_of_the_angle(params):
    """Cubic Hermite between samples: what edge finding rests on."""
    output = Engine(params, 1, RATE_HZ).advance(4000)
    turns = (output.turns - output.turns[:, :1]) + output.fraction
    step = 1 / RATE_HZ
    left, right = turns[:, :-2:2], turns[:, 2::2]
    slopes = output.speed_hz[:, :-2:2], output.speed_hz[:, 2::2]
    middle = (left + right) / 2 + (slopes[0] - slopes[1]) * (2 * step) / 8
    assert np.abs(middle - turns[:, 1:-1:2]).max() < 1e-9  # turns; twice the spacing, so 16 times the error


def test_torsional_vibration_shows_in_the_encoders(params):
    """At the tooth mesh frequency the shafts turn unevenly, and differently."""
    output = Engine(params, 1, RATE_HZ).advance(int(0.5 * RATE_HZ))
    uneven = np.std(output.speed_hz, axis=1)
    assert np.all((uneven > 0.005) & (uneven < 0.5))


def test_events_act_at_their_sample(params):
    """Nothing before the filter's reach of the event, something after it."""
    quiet = Engine(params, 1, RATE_HZ).advance(3000)
    engine = Engine(params, 1, RATE_HZ)
    assert engine.inject(FaultSpec("outer_race_spall", "bearing_3"), 0.01, at_sample=1000) == 1000
    loud = engine.advance(3000)
    differs = np.flatnonzero(np.any(loud.accel != quiet.accel, axis=0))
    assert differs[0] >= 1000 - engine.lookahead_samples
    sites = {"flywheel": {"theta_f2": 1.0}}
    quiet = Engine(params, 1, RATE_HZ, sites=sites).advance(3000)
    engine = Engine(params, 1, RATE_HZ, sites=sites)
    engine.set_operating_point(load_nm=100.0, ramp_s=0.02, at_sample=1000)
    loaded = engine.advance(3000)
    differs = np.flatnonzero(loaded.accel[0] != quiet.accel[0])
    assert 1000 - engine.lookahead_samples <= differs[0] <= 1000
    assert np.array_equal(loaded.fraction[:, :1001], quiet.fraction[:, :1001])


def test_an_event_now_acts_behind_the_lookahead(params):
    engine = Engine(params, 1, RATE_HZ)
    assert engine.earliest_event_sample == 0
    engine.advance(500)
    assert engine.earliest_event_sample == 499 + engine.lookahead_samples
    assert engine.inject(SPALL) == 499 + engine.lookahead_samples
    with pytest.raises(InputError, match="526 or later"):
        engine.clear(at_sample=500)


def test_events_handed_to_advance_equal_those_scheduled(params):
    first, second = Engine(params, 1, RATE_HZ), Engine(params, 1, RATE_HZ)
    first.inject(SPALL, 0.01, at_sample=300)
    first.set_operating_point(9.0, 40.0, 0.1, at_sample=400)
    first.clear(SPALL.name, 0.01, at_sample=900)
    events = [
        Inject(SPALL, 0.01, 300),
        SetOperatingPoint(9.0, 40.0, 0.1, 400),
        Clear(SPALL.name, 0.01, 900),
    ]
    assert np.array_equal(first.advance(1500).accel, second.advance(1500, events).accel)


def test_ramp_of_speed_has_no_step(params):
    """Angle and speed run on smoothly, also where a second ramp interrupts the first; no click is heard."""
    engine = Engine(params, 1, RATE_HZ)
    start, cut, total = int(0.2 * RATE_HZ), int(0.5 * RATE_HZ), int(2.2 * RATE_HZ)
    engine.set_operating_point(speed_hz=11.0, ramp_s=1.0, at_sample=start)
    engine.set_operating_point(speed_hz=9.5, load_nm=70.0, ramp_s=1.0, at_sample=cut)
    output = engine.advance(total)
    turns = (output.turns + output.fraction)[0]
    speed = np.convolve(np.diff(turns) * RATE_HZ, np.ones(6554) / 6554, "valid")  # mesh ripple averaged away
    assert speed[-1] == pytest.approx(9.5, abs=0.01)
    assert speed.max() > 10.2
    assert np.abs(np.diff(speed) * RATE_HZ).max() < 15  # Hz/s; the drive's torque allows 8.3
    high = sosfiltfilt(butter(4, 5000, "high", fs=RATE_HZ, output="sos"), output.accel[1])
    background = np.abs(high[: start - 200]).max()
    for moment in (start, cut):
        assert np.abs(high[moment - 200 : moment + 200]).max() < 1.5 * background


def test_fast_ramps_are_lengthened_to_what_the_drive_can_do(params):
    engine = Engine(params, 1, RATE_HZ)
    engine.set_operating_point(speed_hz=12.0, ramp_s=0.0, at_sample=0)
    speed = engine.advance(int(0.6 * RATE_HZ)).speed_hz[0]
    reached = np.convolve(speed, np.ones(6554) / 6554, "valid")
    assert reached[int(0.2 * RATE_HZ)] < 11.5
    assert reached[-1] == pytest.approx(12.0, abs=0.05)


def test_static_start_needs_no_settling(params):
    """The first 0.1 s are as the rest: mesh amplitude and mean angle do not drift."""
    output = Engine(params, 1, RATE_HZ).advance(int(0.5 * RATE_HZ))
    window = int(0.1 * RATE_HZ)
    first, last = output.accel[1, :window], output.accel[1, -window:]
    assert np.std(first) == pytest.approx(np.std(last), rel=2e-3)
    assert abs(np.mean(first)) < 2e-3


def line(accel, frequency_hz):
    window = np.hanning(accel.size)
    phase = np.exp(-2j * np.pi * frequency_hz * np.arange(accel.size) / RATE_HZ)
    return 2 * abs(np.sum(accel * window * phase)) / window.sum()


def test_mesh_line_falls_to_the_numerical_floor_when_all_is_off(params):
    total = int(0.3 * RATE_HZ)
    on = Engine(params, 1, RATE_HZ).advance(total).accel[1]
    gears_off = {"mesh_stiffness_variation": False, "runout": False, "tooth_profile": False}
    gears_off |= {"tooth_pitch": False, "tooth_surface": False}
    off = Engine(params.with_physics(**gears_off), 1, RATE_HZ).advance(total).accel[1]
    still = Engine(params.with_physics(**gears_off, ball_passing=False), 1, RATE_HZ).advance(total).accel[1]
    assert line(on, 320.0) > 1.0
    assert line(off, 320.0) < 1e-6 * line(on, 320.0)
    assert np.abs(still).max() < 1e-9 * line(on, 320.0)


@pytest.mark.parametrize(
    "switch", ["mesh_stiffness_variation", "runout", "tooth_profile", "tooth_pitch", "tooth_surface"]
)
def test_each_switch_changes_the_signal(params, switch):
    on = Engine(params, 1, RATE_HZ).advance(2000)
    off = Engine(params.with_physics(**{switch: False}), 1, RATE_HZ).advance(2000)
    assert not np.allclose(on.accel, off.accel, rtol=1e-6)


def test_switch_for_faults(params):
    healthy = Engine(params, 1, RATE_HZ).advance(2000).accel
    disabled = Engine(params.with_physics(faults=False), 1, RATE_HZ, 4, [SPALL]).advance(2000).accel
    assert np.array_equal(healthy, disabled)


def envelope_spectrum(accel, band_hz):
    band = butter(4, band_hz, "bandpass", fs=RATE_HZ, output="sos")
    squared = np.abs(hilbert(sosfiltfilt(band, accel))) ** 2
    spectrum = np.abs(np.fft.rfft((squared - squared.mean()) * np.hanning(squared.size)))
    return np.fft.rfftfreq(squared.size, 1 / RATE_HZ), spectrum


@pytest.mark.parametrize(
    ("kind", "expected_hz"),
    [
        ("outer_race_spall", 0.5 * 12 * 10 * (1 - 7.12 / 38.5)),
        ("inner_race_spall", 0.5 * 12 * 10 * (1 + 7.12 / 38.5)),
    ],
)
def test_ball_pass_frequencies_emerge_in_the_envelope(params, kind, expected_hz):
    """BPFO 48.9 Hz and BPFI 71.1 Hz, the latter with sidebands at the shaft's speed; healthy has neither."""
    total = int(2 * RATE_HZ)
    healthy = Engine(params, 1, RATE_HZ).advance(total).accel[5]
    faulty = Engine(params, 1, RATE_HZ, 4, [FaultSpec(kind, "bearing_3")]).advance(total).accel[5]
    frequency, spectrum = envelope_spectrum(faulty, (5000, 12000))
    _, before = envelope_spectrum(healthy, (5000, 12000))
    near = (frequency > expected_hz - 5) & (frequency < expected_hz + 5)
    found = frequency[near][np.argmax(spectrum[near])]
    assert found == pytest.approx(expected_hz, abs=0.5)
    floor = np.median(spectrum[(frequency > 20) & (frequency < 300)])
    assert spectrum[near].max() > 50 * floor
    assert spectrum[near].max() > 100 * before[near].max()
    sidebands = [spectrum[np.argmin(np.abs(frequency - expected_hz - side))] for side in (-10, 10)]
    if kind == "inner_race_spall":
        assert min(sidebands) > 0.3 * spectrum[near].max()
    else:
        assert max(sidebands) < 0.3 * spectrum[near].max()


def test_sites_are_linear_combinations(params):
    diagonal = {"x_p1": np.sqrt(0.5), "y_p1": np.sqrt(0.5)}
    sites = {
        **make_plant(params, 1).sites,
        "tilted": diagonal,
        "resonator": {"y_r1": 1.0},
        "spin": {"theta_pin": 1.0},
    }
    output = Engine(params, 1, RATE_HZ, sites=sites).advance(500)
    rows = dict(zip(output.site_names, output.accel, strict=True))
    assert rows["tilted"] == pytest.approx(np.sqrt(0.5) * (rows["b1_x"] + rows["b1_y"]), abs=1e-9)
    plain = Engine(params, 1, RATE_HZ).advance(500)
    assert output.accel[:8] == pytest.approx(plain.accel, abs=1e-9)


@pytest.mark.parametrize("rate_hz", [1000.0, 8192.0, 20000.0, 51200.0, 97656.25, 262144.0])
def test_any_sample_rate(params, rate_hz):
    """The mesh line has the same amplitude at every rate that can show it."""
    count = round(0.2 * rate_hz)
    output = Engine(params, 1, rate_hz).advance(count)
    window = np.hanning(count)
    phase = np.exp(-2j * np.pi * 320.0 * np.arange(count) / rate_hz)
    amplitude = 2 * abs(np.sum(output.accel[1] * window * phase)) / window.sum()
    assert amplitude == pytest.approx(5.756, rel=2e-3)


@pytest.mark.parametrize(
    ("given", "operating"),
    [
        ({}, {"speed_hz": 0.0}),
        ({}, {"speed_hz": 30.0, "load_nm": 200.0}),
        ({}, {"load_nm": 0.0}),
        ({"gravity": False, "clearance": False}, {"load_nm": 0.0}),
        ({"gravity": False}, {"load_nm": 1e-3}),
    ],
)
def test_extremes_stay_finite(params, given, operating):
    faults = [
        FaultSpec("outer_race_spall", "bearing_1", {"width_m": 7e-3, "depth_m": 1e-2}, severity=2.0),
        FaultSpec("inner_race_spall", "bearing_4", {"width_m": 1e-6, "depth_m": 1e-9}),
    ]
    output = Engine(params.with_physics(**given), 1, RATE_HZ, 2, faults, **operating).advance(5000)
    assert np.all(np.isfinite(output.accel))
    assert np.abs(output.accel).max() < 1e4
    assert np.all(np.isfinite(output.fraction))


@pytest.mark.parametrize(
    ("build", "field"),
    [
        (lambda p: Engine(p, -1, RATE_HZ), "seed"),
        (lambda p: Engine(p, 1, 0.0), "sample_rate_hz"),
        (lambda p: Engine(p, 1, float("nan")), "sample_rate_hz"),
        (lambda p: Engine(p, 1, RATE_HZ, 1), "oversampling"),
        (lambda p: Engine(p, 1, RATE_HZ, 257), "oversampling"),
        (lambda p: Engine(p, 1, RATE_HZ, speed_hz=1e3), "speed_hz"),
        (lambda p: Engine(p, 1, RATE_HZ, speed_hz=float("nan")), "speed_hz"),
        (lambda p: Engine(p, 1, RATE_HZ, load_nm=-5.0), "load_nm"),
        (lambda p: Engine(p, 1, RATE_HZ, sites={"a": {"y_p9": 1.0}}), "sites.a"),
        (lambda p: Engine(p, 1, RATE_HZ, sites={}), "sites"),
        (lambda p: Engine(p, 1, RATE_HZ, probes=["b9_y.force_n"]), "probes"),
        (lambda p: Engine(p, 1, RATE_HZ, 4, [SPALL, SPALL]), "fault_id"),
    ],
)
def test_bad_input_is_named(params, build, field):
    with pytest.raises(InputError) as error:
        build(params)
    assert error.value.field == field


def test_bad_events_are_named_when_they_are_asked_for(params):
    engine = Engine(params, 1, RATE_HZ)
    engine.inject(SPALL)
    cases = [
        (lambda: engine.clear("nothing"), "fault_id"),
        (lambda: engine.inject(FaultSpec("outer_race_spall", "bearing_3", {"width_m": 1e-3})), "fault_id"),
        (lambda: engine.inject(SPALL, ramp_s=-1.0), "ramp_s"),
        (lambda: engine.set_operating_point(load_nm=float("inf")), "load_nm"),
        (lambda: engine.set_operating_point(ramp_s=float("nan")), "ramp_s"),
        (lambda: engine.advance(0), "n"),
    ]
    for call, field in cases:
        with pytest.raises(InputError) as error:
            call()
        assert error.value.field == field


def test_a_fault_may_be_cleared_and_return_larger(params):
    engine = Engine(params, 1, RATE_HZ)
    engine.inject(SPALL, 0.01, at_sample=0)
    engine.clear(SPALL.name, 0.01, at_sample=1000)
    larger = FaultSpec(SPALL.kind, SPALL.component, {"width_m": 2e-3, "position_rad": -1.2})
    engine.inject(larger, 0.01, at_sample=1200)  # while the first still fades
    output = engine.advance(6000)
    assert np.all(np.isfinite(output.accel))
    again = Engine(params, 1, RATE_HZ)
    again.inject(larger, 0.01, at_sample=1200)
    apart = np.abs(output.accel[5] - again.advance(6000).accel[5])
    assert apart[4500:].max() < 0.2 * apart[:1500].max()


def test_clearance_without_load_zone_is_refused(params):
    bearing = params.model.ball_bearing.model_copy(update={"radial_clearance_m": 5e-3})
    impossible = params.model_copy(
        update={"model": params.model.model_copy(update={"ball_bearing": bearing})}
    )
    with pytest.raises(InputError, match="load zone"):
        Engine(impossible, 1, RATE_HZ)


def test_one_row_of_balls_works_too(params):
    bearing = params.model.ball_bearing.model_copy(update={"rows": 1})
    single = params.model_copy(update={"model": params.model.model_copy(update={"ball_bearing": bearing})})
    output = Engine(single, 1, RATE_HZ, 4, [FaultSpec("outer_race_spall", "bearing_3")]).advance(3000)
    assert np.all(np.isfinite(output.accel))
    with pytest.raises(InputError) as error:
        Engine(single, 1, RATE_HZ, 4, [FaultSpec("outer_race_spall", "bearing_3", {"row": 2})])
    assert error.value.field == "row"


def test_long_runs_keep_their_digits(params):
    """After ten days of turning, an anchor's fraction is as good as at the start."""
    from gearsim_sim.profile.profile import constant_profile
    from gearsim_sim.schedule import Schedule

    plant = make_plant(params, 1)
    schedule = Schedule(plant, constant_profile(plant, 1 / 262144, 10.0, 50.0), 0, 0.5)
    for number in range(1, 40001):
        schedule.rebase(number * 65536)
    exact = 0.5 + 10.0 * 40000 * 65536 / 262144
    assert schedule.anchor_turns[0] + schedule.anchor_phases[0] == pytest.approx(exact, abs=1e-10)
    cage = plant.bearings[2].law.cage_ratio
    passed = schedule.anchor_turns[4] + schedule.anchor_phases[4]
    assert passed == pytest.approx(cage * exact, rel=1e-14)
