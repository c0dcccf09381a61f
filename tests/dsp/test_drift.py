"""Inner races that are struck once a turn: what drifts against the shaft is not the shaft's."""

import math
from dataclasses import replace

import numpy as np
import pytest
from bearing_signals import Signal, defect, machine, noise, turns_of
from pooling import verdict_of

from gearsim_dsp.diagnose import diagnose_record
from gearsim_dsp.judges.drift import drift_of, drifting_races
from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.kinematics import bearing_orders
from gearsim_dsp.speed import Phase, nameplate_speed
from gearsim_io.nameplate import Bearing
from gearsim_io.record import PulseTrain, Record

RATE = 16_000.0
SPEED = 20.0
TURNS = 40


def _rows(rng, slope, height=1.0, turns=TURNS):
    """One pulse a turn, 1.5 % of it wide and uneven, in noise."""
    angle = np.arange(512) / 512
    at = 0.4 + slope * np.arange(turns)[:, None]
    strength = height * (1.0 + 0.3 * rng.standard_normal((turns, 1)))
    return strength * np.exp(-0.5 * ((angle - at) / 0.015) ** 2) + 0.1 * rng.standard_normal((turns, 512))


@pytest.mark.parametrize("slope", [0.0, 2e-4, -2e-3])
def test_the_drift_is_measured_with_its_error(slope):
    rng = np.random.default_rng(1)
    off = []
    for _ in range(60):
        drift = drift_of(_rows(rng, slope), 6)
        off.append((drift.per_turn - slope) / drift.error)
    assert 0.7 < np.std(off) < 1.4
    assert abs(np.mean(off)) < 0.6
    assert drift.error < 3e-5


def test_noise_has_no_sure_drift():
    rng = np.random.default_rng(2)
    for _ in range(60):
        assert drift_of(_rows(rng, 0.0, height=0.0), 6).sure < 6.0


def _plate(order=6.01, elements=10):
    """One bearing whose inner race passes that many elements a turn."""
    size = order / (0.5 * elements) - 1.0
    bearing = Bearing("bearing_1", "shaft", elements, 40e-3 * size, 40e-3, 0.0, False, ("ch_1",))
    assert bearing_orders(bearing).bpfi == pytest.approx(order)
    return replace(machine(SPEED, tacho=True), bearings=(bearing,))


def _once_a_turn(rng, turns, order):
    """What remains of the impacts of an inner race in a load zone far narrower than the elements' spacing."""
    bad = defect(rng, turns, RATE, order, slip=0.0)
    from_zone = np.mod(turns - bad.impacts[bad.impacts.size // 2] - 0.02 + 0.5, 1.0) - 0.5
    x = bad.x * np.exp(-0.5 * (from_zone / 0.04) ** 2)
    return 1.5 * x / np.sqrt(np.mean(x**2)) + noise(rng, turns.size)


def _record(x, turns, plate):
    tacho = PulseTrain("shaft", 1.0, Signal(x, RATE, turns).tacho())
    data = x[None].astype(np.float32)
    return Record(RATE, ("ch_1",), "m/s^2", data, (tacho,), machine=plate.name)


@pytest.mark.parametrize("order", [6.003, 5.996])
def test_a_race_struck_once_a_turn_is_told_from_the_shaft_by_its_drift(order):
    plate = _plate(order)
    turns = turns_of(SPEED, 4.0, RATE)
    x = _once_a_turn(np.random.default_rng(3), turns, order)
    assert verdict_of(x[None], RATE, plate, Signal(x, RATE, turns).tacho()).findings == ()
    (finding,) = diagnose_record(_record(x, turns, plate), plate).findings
    assert (finding.component, finding.fault) == ("bearing_1", "inner_race")
    assert finding.found_order == pytest.approx(order, rel=1e-4)
    assert finding.evidence["covered_by"] == "6 x shaft"


def _measured(x, turns, plate):
    phase = Phase(np.arange(0.0, x.size, 50.0), turns[::50])
    speed = replace(nameplate_speed(plate), phase=phase)
    return Measured(plate, RATE, "m/s^2", {"ch_1": x}, speed)


def test_what_comes_at_the_same_angle_of_every_turn_is_no_races():
    """A bad tooth; and one that a coupling twists by a tenth of a degree to and fro."""
    turns = turns_of(SPEED, 4.0, RATE)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        for sway in (0.0, 3e-4):
            seen = turns + sway * np.sin(2 * math.pi * turns / 37.0)
            tooth = defect(rng, seen, RATE, 1.0, slip=0.0).x
            measured = _measured(1.5 * tooth + noise(rng, turns.size), turns, _plate())
            assert drifting_races(measured) == ()


def test_a_drift_that_the_bearing_cannot_have_is_not_told():
    """Elements pass 5.95 times a turn there and 6.01 here: one per cent is more than races slip."""
    turns = turns_of(SPEED, 4.0, RATE)
    x = _once_a_turn(np.random.default_rng(3), turns, 6.003)
    assert drifting_races(_measured(x, turns, _plate(6.003))) != ()
    assert drifting_races(_measured(x, turns, _plate(5.95))) == ()


def test_an_outer_race_that_drifts_is_no_inner_race():
    """Four impacts a turn, not one: 4.003 elements pass the outer race, and 5.997 the inner."""
    turns = turns_of(SPEED, 4.0, RATE)
    rng = np.random.default_rng(4)
    x = 1.5 * defect(rng, turns, RATE, 4.003, slip=0.0).x + noise(rng, turns.size)
    assert drifting_races(_measured(x, turns, _plate(5.997))) == ()


def test_what_swings_by_less_than_impacts_do_is_not_told():
    """In nine times the noise the same drift is still sure, of half of what a swing of full depth may be."""
    turns = turns_of(SPEED, 4.0, RATE)
    x = _once_a_turn(np.random.default_rng(3), turns, 6.003)
    more = x + 8.0 * noise(np.random.default_rng(6), turns.size)
    assert drifting_races(_measured(more, turns, _plate(6.003))) == ()
