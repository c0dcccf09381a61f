"""What a signal may bring: each is named, none is stumbled over, and none makes a confident wrong finding."""

from dataclasses import replace

import numpy as np
import pytest
from bearing_signals import defect, machine, noise, turns_of

from gearsim_dsp.diagnose import Diagnosis, DiagnosisSettings, diagnose_record
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine, Shaft
from gearsim_io.record import PulseTrain, Record

RATE = 12_000.0
BPFO = 3.245


def _record(x, rate=RATE, tachos=(), channels=("ch_1",)):
    return Record(rate, channels, "m/s^2", np.atleast_2d(np.asarray(x, dtype=np.float32)), tachos)


def _faulty(seconds=6.0, speed=24.8, seed=1):
    rng = np.random.default_rng(seed)
    turns = turns_of(speed, seconds, RATE)
    return noise(rng, turns.size) + 0.8 * defect(rng, turns, RATE, BPFO).x, turns


def _kinds(diagnosis: Diagnosis):
    return {issue.issue for issue in diagnosis.quality}


def test_a_sound_signal_is_the_reference():
    x, _ = _faulty()
    diagnosis = diagnose_record(_record(x), machine())
    assert [f.fault for f in diagnosis.findings] == ["outer_race"]
    assert _kinds(diagnosis) <= {"speed_not_measured"}


@pytest.mark.parametrize(
    ("make", "kind"),
    [
        (lambda x: np.zeros_like(x), "constant_channel"),
        (lambda x: np.full_like(x, 9.81), "constant_channel"),
        (lambda x: np.where(np.arange(x.size) % 5000 == 17, np.nan, x), "not_finite"),
        (lambda x: x * np.inf, "not_finite"),
        (lambda x: x[:900], "too_short"),
        (lambda x: x[:30], "too_short"),
    ],
)
def test_what_cannot_be_judged_is_named_and_nothing_is_found(make, kind):
    x, _ = _faulty()
    with np.errstate(invalid="ignore"):
        diagnosis = diagnose_record(_record(make(x)), machine())
    assert diagnosis.findings == ()
    assert not diagnosis.judged
    assert kind in _kinds(diagnosis)
    assert any(issue.fatal for issue in diagnosis.quality)


def test_the_detail_says_how_long_it_must_be():
    x, _ = _faulty()
    diagnosis = diagnose_record(_record(x[:3000]), machine())
    (issue,) = [q for q in diagnosis.quality if q.issue == "too_short"]
    assert "6.2 turns" in issue.detail
    assert "at least 8" in issue.detail


def test_a_run_of_nan_costs_only_the_windows_it_lies_in():
    x, _ = _faulty(10.0)
    x[30_000:30_100] = np.nan
    diagnosis = diagnose_record(_record(x), machine())
    assert [f.fault for f in diagnosis.findings] == ["outer_race"]
    (issue,) = [q for q in diagnosis.quality if q.issue == "not_finite"]
    assert "of 17 windows" in issue.detail


def test_one_dead_channel_does_not_take_the_others_along():
    x, _ = _faulty()
    data = np.stack([x, np.zeros_like(x)])
    diagnosis = diagnose_record(_record(data, channels=("ch_1", "ch_2")), machine(bearings=2))
    assert [f.fault for f in diagnosis.findings] == ["outer_race"]
    (issue,) = [q for q in diagnosis.quality if q.issue == "constant_channel"]
    assert issue.channel == "ch_2"


def test_clipping_is_named_and_the_fault_still_found():
    x, _ = _faulty()
    diagnosis = diagnose_record(_record(np.clip(x, -2.0, 2.0)), machine())
    assert "clipping" in _kinds(diagnosis)
    assert [f.fault for f in diagnosis.findings] == ["outer_race"]


def test_clipped_noise_is_no_fault():
    x = np.clip(noise(np.random.default_rng(2), 72_000, 0.7), -1.0, 1.0)
    diagnosis = diagnose_record(_record(x), machine())
    assert diagnosis.findings == ()
    assert "clipping" in _kinds(diagnosis)


def test_periodic_dropouts_are_no_bearing_fault():
    """A value held every tenth of a second: 0.4 times the shaft."""
    x = noise(np.random.default_rng(3), 72_000)
    for start in range(500, x.size - 300, 1200):
        x[start : start + 150] = x[start]
    diagnosis = diagnose_record(_record(x), machine())
    assert "dropout" in _kinds(diagnosis)
    assert diagnosis.findings == ()


def test_a_rate_too_low_for_the_lines_is_named():
    rng = np.random.default_rng(4)
    diagnosis = diagnose_record(_record(noise(rng, 6000), rate=600.0), machine())
    assert diagnosis.findings == ()
    (issue,) = [q for q in diagnosis.quality if q.issue == "rate_too_low"]
    assert "600 Hz" in issue.detail


def test_tacho_that_contradicts_the_nameplate_is_believed_and_told():
    x, turns = _faulty(speed=21.0)
    pulses = np.interp(np.arange(1, turns[-1]), turns, np.arange(turns.size))
    diagnosis = diagnose_record(_record(x, tachos=(PulseTrain("shaft", 1.0, pulses),)), machine(tacho=True))
    assert diagnosis.speed.source == "tacho"
    assert diagnosis.speed.value_hz == pytest.approx(21.0, rel=1e-4)
    assert "speed_off_nameplate" in _kinds(diagnosis)
    assert [f.fault for f in diagnosis.findings] == ["outer_race"]


def test_missing_pulses_are_told():
    x, turns = _faulty()
    pulses = np.delete(np.interp(np.arange(1, turns[-1]), turns, np.arange(turns.size)), [120, 121, 130])
    diagnosis = diagnose_record(_record(x, tachos=(PulseTrain("shaft", 1.0, pulses),)), machine(tacho=True))
    assert "tacho_mended" in _kinds(diagnosis)
    assert [f.fault for f in diagnosis.findings] == ["outer_race"]


def test_an_unknown_speed_is_said_and_nothing_found():
    diagnosis = diagnose_record(_record(noise(np.random.default_rng(5), 48_000)), machine(float("nan")))
    assert diagnosis.findings == ()
    assert "speed_unknown" in _kinds(diagnosis)
    assert diagnosis.to_json()["speed_hz"] == {"value": None, "ci95": None, "source": "nameplate"}
    assert diagnosis.lines()[0] == "speed: not known"


def test_channels_of_another_machine_are_refused():
    with pytest.raises(InputError, match="ch_1"):
        diagnose_record(_record(noise(np.random.default_rng(6), 24_000), channels=("x",)), machine())


def test_impossible_geometry_is_refused_before_anything_is_done():
    plate = machine()
    bad = replace(plate, bearings=(replace(plate.bearings[0], element_diameter_m=0.1),))
    with pytest.raises(InputError, match="element_diameter"):
        diagnose_record(_record(noise(np.random.default_rng(7), 24_000)), bad)


@pytest.mark.parametrize("bad", [{"window_s": 0.0}, {"least_turns": 0.0}, {"batch_samples": 0}])
def test_settings_out_of_range_are_refused(bad):
    with pytest.raises(InputError):
        DiagnosisSettings(**bad)


def test_a_machine_known_by_its_shaft_alone_has_its_speed_told():
    plate = machine()
    plate = Machine("m", "", "shaft", plate.shafts, channels=plate.channels)
    turns = turns_of(24.7, 6.0, RATE)
    x = noise(np.random.default_rng(8), turns.size)
    x += 0.3 * np.cos(2 * np.pi * turns) + 0.2 * np.cos(4 * np.pi * turns) + 0.2 * np.cos(6 * np.pi * turns)
    diagnosis = diagnose_record(_record(x), plate)
    assert diagnosis.speed.value_hz == pytest.approx(24.7, rel=1e-3)
    assert not diagnosis.judged


def test_a_nameplate_four_per_cent_off_is_told_and_the_fault_still_named():
    x, turns = _faulty(speed=24.0)
    x = (
        x
        + 0.3 * np.cos(2 * np.pi * turns)
        + 0.3 * np.cos(4 * np.pi * turns)
        + 0.3 * np.cos(6 * np.pi * turns)
    )
    diagnosis = diagnose_record(_record(x), machine(25.0))
    assert diagnosis.speed.value_hz == pytest.approx(24.0, rel=1e-3)
    assert "speed_off_nameplate" in _kinds(diagnosis)
    assert [f.fault for f in diagnosis.findings] == ["outer_race"]


def test_a_record_of_hardly_a_moment_is_told_how_long_it_must_be():
    x, _ = _faulty()
    diagnosis = diagnose_record(_record(x[:100]), machine())
    (issue,) = [q for q in diagnosis.quality if q.issue == "too_short"]
    assert issue.detail == "100 samples, 0.0083 s; at least 0.32 s (8 turns at 25 Hz) are needed"
    assert "nothing could be judged: 0.0083 s are too short; at least 0.32 s" in diagnosis.lines()[-1]


def test_a_given_speed_is_not_called_the_nameplates():
    x, _ = _faulty()
    notes = {"speed_hz": "26", "speed from": "given", "speed on the nameplate": "25 Hz"}
    record = replace(_record(noise(np.random.default_rng(6), x.size)), notes=notes)
    diagnosis = diagnose_record(record, machine())
    details = {issue.issue: issue.detail for issue in diagnosis.quality}
    assert details["speed_not_measured"].startswith("the 26 Hz given +- 2 % is taken")
    assert details["speed_off_nameplate"] == "the 26 Hz given are +4 % off the nameplate's 25 Hz"
    assert diagnosis.lines()[0] == "speed: 26.000 Hz +- 2 % (as given, not measured)"
    assert diagnosis.to_json()["speed_hz"]["source"] == "nameplate"  # as the contract has it


def test_percents_have_no_exponent():
    x, turns = _faulty(speed=62.0)
    pulses = np.interp(np.arange(1, turns[-1]), turns, np.arange(turns.size))
    diagnosis = diagnose_record(_record(x, tachos=(PulseTrain("shaft", 1.0, pulses),)), machine(tacho=True))
    (off,) = [q.detail for q in diagnosis.quality if q.issue == "speed_off_nameplate"]
    assert off == "62 Hz is +150 % off the nameplate's 25 Hz"


@pytest.mark.parametrize(("seconds", "judged"), [(10.0, True), (3.0, False)])
def test_windows_of_a_slow_machine_are_long_enough_and_what_stays_unjudged_is_named(seconds, judged):
    """At 2 Hz eight turns take 4 s; a shorter record cannot tell of bearings, which says nothing of gears."""
    turns = turns_of(2.0, seconds, RATE)
    x = noise(np.random.default_rng(7), turns.size)
    pulses = np.interp(np.arange(1, turns[-1]), turns, np.arange(turns.size))
    slow = machine(2.0, tacho=True)
    fast_bearings = replace(
        slow,
        shafts=(*slow.shafts, Shaft("fast", 5.0, 10.0)),
        bearings=tuple(replace(bearing, shaft="fast") for bearing in slow.bearings),
    )
    diagnosis = diagnose_record(_record(x, tachos=(PulseTrain("shaft", 1.0, pulses),)), fast_bearings)
    short = [q.detail for q in diagnosis.quality if q.issue == "too_short"]
    assert ("bearings" in diagnosis.judged_parts) == judged
    assert diagnosis.speed.source == "tacho"
    if judged:
        assert short == []
    else:
        (detail,) = short
        assert "bearings cannot be judged by 6.0 turns" in detail
        assert "at least 8 are needed (4 s at 2 Hz)" in detail


def test_a_nameplate_without_parts_is_told_once():
    plate = replace(machine(), bearings=())
    diagnosis = diagnose_record(_record(noise(np.random.default_rng(8), 48_000)), plate)
    assert "nothing_to_look_for" in _kinds(diagnosis)
    told = [line for line in diagnosis.lines() if "nameplate lists" in line]
    assert told == [
        "no fault found: nothing could be judged: the nameplate lists neither bearings nor pairs of gears"
    ]
