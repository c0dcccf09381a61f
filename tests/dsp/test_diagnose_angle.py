"""The whole diagnosis where the angle is the difficulty: a changing speed without tacho, a wrong tacho."""

from dataclasses import replace

import numpy as np
import pytest
from bearing_signals import defect, machine, noise, rotating_lines, turns_of

from gearsim_dsp import diagnose
from gearsim_dsp.diagnose import diagnose_record
from gearsim_dsp.judges.bearing import find_faults
from gearsim_dsp.kinematics import fault_families
from gearsim_dsp.speed import nameplate_speed
from gearsim_dsp.streams.envelope_monitor import EnvelopeMonitor
from gearsim_dsp.streams.kurtosis_monitor import KurtosisMonitor
from gearsim_dsp.streams.window_speeds import KnownSpeeds
from gearsim_io.errors import InputError
from gearsim_io.nameplate import GearMesh, Machine, Shaft
from gearsim_io.record import PulseTrain, Record

RATE = 20_000.0
SECONDS = 5.0


def _plate(tacho: bool = False) -> Machine:
    """A bearing and a gear stage, so that there are lines to tell the speed by."""
    return replace(
        machine(25.0, tacho=tacho),
        shafts=(Shaft("shaft", 1.0, 25.0), Shaft("slow", 32 / 80, 10.0)),
        gear_meshes=(GearMesh("stage", "shaft", "slow", 32, 80),),
    )


def _signal(seed, speeds_hz, faulty):
    rng = np.random.default_rng(seed)
    turns = turns_of(np.array(speeds_hz), SECONDS, RATE)
    x = noise(rng, turns.size) + rotating_lines(turns, {1: 0.3, 2: 0.2, 32: 0.6, 64: 0.4, 96: 0.2})
    if faulty:
        (outer,) = (f for f in fault_families(_plate()) if f.fault == "outer_race")
        x = x + 0.7 * defect(rng, turns, RATE, outer.order).x
    return x, turns


def _record(x, pulses=None):
    trains = () if pulses is None else (PulseTrain("shaft", 1.0, pulses),)
    return Record(RATE, ("ch_1",), "m/s^2", x[None].astype(np.float32), trains)


def test_a_fault_is_found_without_tacho_while_the_speed_rises_by_four_percent():
    x, turns = _signal(1, [24.5, 25.5], faulty=True)
    diagnosis = diagnose_record(_record(x), _plate())
    assert diagnosis.speed.source == "estimated"
    mean = (turns[-1] - turns[0]) / (turns.size - 1) * RATE
    assert diagnosis.speed.value_hz == pytest.approx(mean, rel=2e-3)
    bearing = [f for f in diagnosis.findings if f.component == "bearing_1"]
    assert [f.fault for f in bearing] == ["outer_race"]
    # Slip is random by 1 % from impact to impact: the mean of 400 is known to 0.05 %.
    assert bearing[0].found_order == pytest.approx(bearing[0].expected_order, rel=2e-3)


def test_a_sound_machine_whose_speed_rises_shows_no_bearing_fault():
    x, _ = _signal(2, [24.5, 25.5], faulty=False)
    diagnosis = diagnose_record(_record(x), _plate())
    assert not [f for f in diagnosis.findings if f.component == "bearing_1"]


def test_a_tacho_with_twice_the_pulses_is_told_and_not_followed():
    x, turns = _signal(3, [25.2, 25.2], faulty=True)
    pulses = np.interp(np.arange(1, 2 * turns[-1]) / 2, turns, np.arange(turns.size))
    diagnosis = diagnose_record(_record(x, pulses), _plate(tacho=True))
    told = [q for q in diagnosis.quality if q.issue == "angle_contradicted"]
    assert len(told) == 1
    assert "2 times as many" in told[0].detail
    assert diagnosis.speed.value_hz == pytest.approx(25.2, rel=1e-3)
    assert [f.fault for f in diagnosis.findings if f.component == "bearing_1"] == ["outer_race"]


def test_a_tacho_that_is_missing_pulses_and_jitters_is_mended():
    x, turns = _signal(4, [25.0, 26.0], faulty=True)
    rng = np.random.default_rng(5)
    pulses = np.interp(np.arange(1, turns[-1]), turns, np.arange(turns.size))
    pulses += 3.0 * rng.standard_normal(pulses.size)
    pulses = np.delete(pulses, rng.choice(pulses.size - 2, 9, replace=False) + 1)
    doubles = pulses[[7, 40, 77]] + 30.0
    diagnosis = diagnose_record(_record(x, np.sort(np.concatenate((pulses, doubles)))), _plate(tacho=True))
    assert any(q.issue == "tacho_mended" for q in diagnosis.quality)
    assert [f.fault for f in diagnosis.findings if f.component == "bearing_1"] == ["outer_race"]
    assert diagnosis.speed.source == "tacho"


def test_known_speeds_need_a_phase():
    with pytest.raises(InputError, match="phase"):
        KnownSpeeds(nameplate_speed(_plate()), 0)


def test_a_second_look_with_the_speed_of_the_record_repeats_only_what_needs_a_speed(monkeypatch):
    """Where the windows do not tell the speed, the envelope is taken anew; impacts are counted once."""
    looks = {"envelope": 0, "kurtosis": 0, "verdicts": 0}

    def counted(name, original):
        def judge(self, window):
            looks[name] += 1
            return original(self, window)

        return judge

    def untold(plate, pool):
        looks["verdicts"] += 1
        verdict = find_faults(plate, pool)
        return replace(verdict, speed=nameplate_speed(plate)) if looks["verdicts"] == 1 else verdict

    monkeypatch.setattr(EnvelopeMonitor, "judge", counted("envelope", EnvelopeMonitor.judge))
    monkeypatch.setattr(KurtosisMonitor, "judge", counted("kurtosis", KurtosisMonitor.judge))
    monkeypatch.setattr(diagnose, "find_faults", untold)
    x, _ = _signal(6, [25.2, 25.2], faulty=True)
    diagnosis = diagnose_record(_record(x), _plate())
    assert looks["verdicts"] == 2
    assert looks["envelope"] == 2 * looks["kurtosis"] > 0
    assert [f.fault for f in diagnosis.findings if f.component == "bearing_1"] == ["outer_race"]
