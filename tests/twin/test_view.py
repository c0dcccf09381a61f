"""The angle, speed and load of a record, measured or simulated."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from rig_records import parallel_record, rig_record, turning

from gearsim_io.machines import load_machine
from gearsim_io.record import Record, Torques
from gearsim_twin.load import loaded_shaft, stated_force_n, stated_load_nm
from gearsim_twin.view import view_of

PARALLEL = load_machine("unsw_parallel")
MFPT = load_machine("mfpt")


def test_speed_and_angle_of_a_tacho():
    view = view_of(parallel_record(), PARALLEL)
    assert view.source == "tacho"
    assert view.speed_hz == pytest.approx(9.9, rel=1e-6)
    assert view.turns == pytest.approx(9.9 * 3.0, rel=1e-3)
    assert view.speed.ci95_hz[0] <= 9.9 <= view.speed.ci95_hz[1]
    assert not view.issues
    signal = view.angle("b1_y", 256)
    assert signal is view.angle("b1_y", 256)
    assert view.nbytes == view.record.data.nbytes + signal.values.nbytes
    assert signal.samples_per_turn == 256
    with pytest.raises(KeyError):
        view.signal("top")


def test_the_course_of_a_speed_that_wavers():
    rate_hz, seconds = 4096.0, 8.0
    t = np.arange(round(seconds * rate_hz)) / rate_hz
    speed_hz = 10.0 * (1 + 0.012 * np.sin(2 * np.pi * 0.4 * t))
    view = view_of(turning(speed_hz, rate_hz), PARALLEL)
    time_s, course_hz = view.speed_course(0.2)
    expected = 10.0 * (1 + 0.012 * np.sin(2 * np.pi * 0.4 * time_s))
    # Means over 0.2 s, two turns: by sinc(0.4 x 0.2) the wave loses 1 % of its 0.12 Hz; between pulses the
    # angle bends by 1/8 of the speed's change in a turn, 0.03 Hz, over 2 turns.
    assert np.max(np.abs(course_hz - expected)[1:-1]) < 0.01
    assert np.mean(course_hz) == pytest.approx(view.speed_hz, rel=1e-3)
    short, _ = view.speed_course(1e-6)
    assert short.size == pytest.approx(2 * seconds * 10, abs=2)  # not finer than half a turn


def test_a_part_keeps_the_angle_found_over_the_whole():
    view = view_of(parallel_record(), PARALLEL)
    first, end = 9001, 20011
    part = view.part(first, end)
    assert part.record.sample_count == end - first
    at = np.array([0.0, 777.0, end - first - 1.0])
    inner = np.interp(at, part.phase.samples, part.phase.turns)
    outer = np.interp(at + first, view.phase.samples, view.phase.turns)
    assert np.allclose(inner, outer, rtol=0, atol=1e-9)
    assert part.speed_hz == pytest.approx(9.9, rel=1e-4)
    assert np.array_equal(part.only(["b3_y"]).signal("b3_y"), view.signal("b3_y")[first:end])


def test_records_without_an_angle_signal_are_searched_for_it():
    with_tacho = parallel_record()
    bare = dataclasses.replace(with_tacho, tachos=())
    view = view_of(bare, PARALLEL)
    assert view.source == "estimated"
    assert view.phase is not None
    assert view.speed_hz == pytest.approx(9.9, rel=1e-4)


def test_noise_tells_no_speed_and_the_nameplate_does():
    noise = np.random.default_rng(3).standard_normal((1, 40000)).astype(np.float32)
    record = Record(20000.0, ("accel",), "m/s^2", noise)
    view = view_of(record, MFPT)
    assert (view.source, view.phase, view.speed_hz) == ("nameplate", None, 25.0)
    stated = view_of(dataclasses.replace(record, notes={"speed_hz": "20"}), MFPT)
    assert stated.speed_hz == 20.0
    assert stated.machine.nominal_speed_hz == 20.0
    nothing = dataclasses.replace(
        MFPT, shafts=tuple(dataclasses.replace(one, nominal_speed_hz=np.nan) for one in MFPT.shafts)
    )
    assert np.isnan(view_of(record, nothing).speed_hz)


def test_what_contradicts_the_description_is_told():
    record = parallel_record()
    other = view_of(dataclasses.replace(record, machine="mill_3"), PARALLEL)
    assert [one.issue for one in other.issues] == ["another_machine"]
    slow = dataclasses.replace(
        PARALLEL, shafts=tuple(dataclasses.replace(one, nominal_speed_hz=9.0) for one in PARALLEL.shafts)
    )
    view = view_of(record, slow)
    assert view.speed_hz == pytest.approx(9.9, rel=1e-3)  # the vibration sides with the tacho
    assert "speed_off_nameplate" in {one.issue for one in view.issues}
    assert any("+10 % off the 9 Hz" in one.detail for one in view.issues)


def test_loads_that_records_tell():
    assert loaded_shaft(PARALLEL) == "output"
    assert loaded_shaft(load_machine("unsw_planetary")) == "output"  # the sun's
    assert loaded_shaft(MFPT) == "shaft"
    # The transducer has a 0.2 % gain error, 0.1 N m of offset and drift.
    assert view_of(parallel_record(), PARALLEL).load_nm == pytest.approx(40.0, abs=0.4)
    reduced = dataclasses.replace(
        PARALLEL,
        shafts=(PARALLEL.shafts[0], dataclasses.replace(PARALLEL.shafts[1], ratio=0.5)),
    )
    record = Record(1000.0, ("b1_y",), "m/s^2", np.ones((1, 10), np.float32))
    torque = np.full((1, 10), -7.0, np.float32)
    at_input = dataclasses.replace(record, torques=Torques(("input_torque",), torque))
    assert stated_load_nm(at_input, reduced) == pytest.approx(14.0)  # half the speed, twice the torque
    at_output = dataclasses.replace(record, torques=Torques(("output_torque",), torque))
    assert stated_load_nm(at_output, reduced) == pytest.approx(7.0)
    both = Torques(("input_torque", "output_torque"), np.vstack([torque, 2.5 * torque]))
    assert stated_load_nm(dataclasses.replace(record, torques=both), reduced) == pytest.approx(17.5)


@pytest.mark.parametrize(
    ("note", "torque_nm", "force_n"),
    [("270 lbf", None, 1201.0198), ("50 N*m", 50.0, None), ("3 kg", None, None), ("", None, None)],
)
def test_loads_that_files_state(note, torque_nm, force_n):
    record = dataclasses.replace(rig_record(), notes={"load": note} if note else {})
    assert stated_load_nm(record, MFPT) == (None if torque_nm is None else pytest.approx(torque_nm))
    assert stated_force_n(record) == (None if force_n is None else pytest.approx(force_n, rel=1e-6))
