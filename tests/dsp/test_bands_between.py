"""Bands centred on the borders of the bank's: what they are for, and that they cost no false alarms."""

from dataclasses import replace

import numpy as np
from bearing_signals import Signal, defect, machine, noise, turns_of
from pooling import pool_of
from scipy import stats

from gearsim_dsp.bands import plan_bands
from gearsim_dsp.diagnose import DiagnosisSettings, diagnose_record
from gearsim_dsp.judges.bearing import find_faults
from gearsim_io.nameplate import Shaft
from gearsim_io.record import Record

RATE = 25_600.0
SPEED = 24.8
BPFO = 3.245


def test_they_lie_half_way_and_inside_the_bank():
    plan, _ = plan_bands(51_200, RATE, SPEED, machine(SPEED))
    assert len(plan.between) == len(plan.bank) - 1 >= 2
    for left, band, right in zip(plan.bank, plan.between, plan.bank[1:], strict=False):
        assert abs(band.low_hz - 0.5 * (left.low_hz + right.low_hz)) < 1e-6
        assert abs(band.high_hz - 0.5 * (left.high_hz + right.high_hz)) < 1e-6


def test_a_resonance_on_a_border_shows_better():
    plate = machine(SPEED, tacho=True)
    plan, _ = plan_bands(51_200, RATE, SPEED, plate)
    border = plan.bank[1].low_hz
    for seed in range(3):
        rng = np.random.default_rng(seed)
        turns = turns_of(SPEED, 4.0, RATE)
        bad = defect(rng, turns, RATE, BPFO, resonance_hz=border, damping=0.05)
        data = (noise(rng, turns.size) + 0.5 * bad.x)[None]
        tacho = Signal(data[0], RATE, turns).tacho()
        single = find_faults(plate, pool_of(data, RATE, plate, tacho)).evidence[0]
        double = find_faults(plate, pool_of(data, RATE, plate, tacho, between=True)).evidence[0]
        assert single.family.fault == double.family.fault == "outer_race"
        assert double.band.why == "between"
        assert double.modulation > 1.3 * single.modulation


def test_false_alarms_stay_as_rare_as_they_say():
    plate = machine(tacho=True)
    values = []
    for seed in range(110):
        rng = np.random.default_rng(2000 + seed)
        turns = turns_of(25.0, 2.0, 12_000.0)
        x = noise(rng, turns.size, 0.8 * (seed % 2))
        pool = pool_of(x[None], 12_000.0, plate, Signal(x, 12_000.0, turns).tacho(), between=True)
        evidence = find_faults(plate, pool).evidence
        values += [1 - (1 - e.false_alarm_probability) ** 0.25 for e in evidence]
    p = np.array(values)
    for alpha in (0.3, 0.1, 0.03):
        _, high = stats.binom.interval(0.997, p.size, alpha)
        assert np.count_nonzero(p < alpha) <= high


def test_windows_are_as_long_as_the_slowest_shaft_with_bearings_needs():
    """Twenty turns of the slow shaft are four seconds, and windows are a quarter of that apart."""
    plate = machine(SPEED, tacho=True)
    slow = replace(plate.bearings[0], shaft="slow")
    shafts = (*plate.shafts, Shaft("slow", 0.2, 0.2 * SPEED))
    plate = replace(plate, shafts=shafts, bearings=(slow,))
    rng = np.random.default_rng(5)
    turns = turns_of(SPEED, 8.0, RATE)
    record = Record(RATE, ("ch_1",), "m/s^2", noise(rng, turns.size)[None].astype(np.float32))
    (evidence, *_) = diagnose_record(record, plate).verdict.evidence
    assert evidence.windows <= 5
    (evidence, *_) = diagnose_record(record, plate, DiagnosisSettings(least_turns=1.0)).verdict.evidence
    assert evidence.windows > 5
