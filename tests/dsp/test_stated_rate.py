"""A sampling rate that a file states wrongly: told by the supply's lines, or by the speed of the machine."""

from dataclasses import replace

import numpy as np
import pytest
from bearing_signals import machine, noise, rotating_lines, turns_of

from gearsim_dsp.diagnose import diagnose_record
from gearsim_dsp.stated_rate import doubt_of_rate
from gearsim_io.nameplate import GearMesh, Shaft
from gearsim_io.record import PulseTrain, Record

SECONDS = 5.0
SPEED_HZ = 24.2


def plate(tacho=True):
    return replace(
        machine(SPEED_HZ, tacho=tacho),
        shafts=(Shaft("shaft", 1.0, SPEED_HZ), Shaft("slow", 32 / 80, SPEED_HZ * 32 / 80)),
        gear_meshes=(GearMesh("stage", "shaft", "slow", 32, 80),),
        speed_tolerance=0.02,
    )


def record(true_hz, stated_hz, supply_hz=0.0, speed_hz=SPEED_HZ, tacho=True, seed=1):
    """What a recorder at one rate writes under another."""
    turns = turns_of(speed_hz, SECONDS, true_hz)
    t = np.arange(turns.size) / true_hz
    x = noise(np.random.default_rng(seed), turns.size)
    x = x + rotating_lines(turns, {1: 0.3, 2: 0.2, 3: 0.2, 32: 0.6, 64: 0.4, 96: 0.2})
    if supply_hz:
        x = x + 0.2 * sum(np.cos(2 * np.pi * supply_hz * k * t + k) for k in (1, 2, 3, 5, 6, 7))
    pulses = np.interp(np.arange(1, turns[-1]), turns, np.arange(turns.size))
    trains = (PulseTrain("shaft", 1.0, pulses),) if tacho else ()
    return Record(stated_hz, ("ch_1",), "m/s^2", x[None].astype(np.float32), trains)


def doubts(*args, **kwargs):
    diagnosis = diagnose_record(record(*args, **kwargs), plate(kwargs.get("tacho", True)))
    return [q.detail for q in diagnosis.quality if q.issue == "sampling_rate_doubtful"]


@pytest.mark.parametrize("supply_hz", [50.0, 60.0])
@pytest.mark.parametrize("tacho", [True, False])
def test_supply_lines_out_of_place_tell_the_true_rate(supply_hz, tacho):
    (detail,) = doubts(25_600.0, 24_000.0, supply_hz, tacho=tacho)
    assert f"{supply_hz:g} Hz supply" in detail
    assert "was sampled at 25600 Hz, not at 24000 Hz" in detail
    assert "0.9375" in detail


def test_a_rate_that_no_recorder_offers_is_estimated_from_supply_and_speed():
    (detail,) = doubts(25_000.0, 23_130.0, 50.0)
    assert "25000 Hz" in detail
    (detail,) = doubts(23_130.0, 25_000.0, 50.0)
    assert "about 231" in detail


@pytest.mark.parametrize("tacho", [True, False])
def test_without_a_supply_the_speed_alone_makes_it_possible(tacho):
    (detail,) = doubts(25_600.0, 24_000.0, tacho=tacho)
    assert "may have been sampled at 25600 Hz" in detail


def test_a_right_rate_is_not_doubted():
    for seed in range(3):
        assert doubts(25_600.0, 25_600.0, 50.0, seed=seed) == []
        assert doubts(25_600.0, 25_600.0, seed=seed) == []


def test_a_machine_off_its_nameplate_beside_a_supply_in_its_place_is_not_a_wrong_rate():
    """The supply's lines are where they belong: it is the speed that is off."""
    slow = record(25_600.0, 25_600.0, 50.0, speed_hz=0.9375 * SPEED_HZ)
    found = diagnose_record(slow, plate())
    kinds = [q.issue for q in found.quality]
    assert "sampling_rate_doubtful" not in kinds
    assert "speed_off_nameplate" in kinds


def test_a_machine_run_at_twice_its_nameplate_is_no_matter_of_rates():
    fast = record(51_200.0, 51_200.0, speed_hz=2 * SPEED_HZ)
    assert doubt_of_rate(fast, plate(), diagnose_record(fast, plate()).speed) is None


def test_a_speed_off_by_no_ratio_of_rates_is_only_off():
    slow = record(25_600.0, 25_600.0, speed_hz=0.9 * SPEED_HZ)
    assert doubt_of_rate(slow, plate(), diagnose_record(slow, plate()).speed) is None
