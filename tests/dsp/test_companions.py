"""What one fault brings along is no second one; a second one is."""

from dataclasses import replace

import numpy as np
from bearing_signals import Signal, defect, machine, noise, turns_of
from pooling import verdict_of

from gearsim_dsp.bands import Band
from gearsim_dsp.diagnose import diagnose_record
from gearsim_dsp.families import BandLevel, FamilyEvidence
from gearsim_dsp.judges.companions import heard_at, is_companion
from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.kinematics import FaultFamily, bearing_orders
from gearsim_io.nameplate import Bearing, Shaft
from gearsim_io.record import PulseTrain, Record

RATE = 16_000.0
SPEED = 24.8
BPFI = 4.755


def _plate(second_bpfo, elements=10):
    """MFPT's bearing, and one whose outer race is passed `second_bpfo` times a turn, a channel for each."""
    plate = machine(SPEED, tacho=True, bearings=2)
    size = 1.0 - second_bpfo / (0.5 * elements)
    other = Bearing("bearing_2", "shaft", elements, 40e-3 * size, 40e-3, 0.0, False, ("ch_2",))
    assert abs(bearing_orders(other).bpfo - second_bpfo) < 1e-9
    return replace(plate, bearings=(plate.bearings[0], other))


def _spiky_inner_race(rng, turns):
    """A load zone of a twentieth of a turn: sidebands far out, all about as high as the harmonics."""
    bad = defect(rng, turns, RATE, BPFI, slip=0.002)
    zone = np.exp(-0.5 * ((np.mod(turns, 1.0) - 0.5) / 0.06) ** 2)
    x = bad.x * zone
    return x / np.sqrt(np.mean(x**2))


def test_sidebands_that_meet_another_bearings_order_are_no_fault_of_it():
    """BPFI minus one turn is the other bearing's BPFO; both channels hear it."""
    plate = _plate(BPFI - 1.0)
    for seed in range(4):
        rng = np.random.default_rng(seed)
        turns = turns_of(SPEED, 4.0, RATE)
        bad = _spiky_inner_race(rng, turns)
        data = np.stack([noise(rng, turns.size) + 1.5 * bad, noise(rng, turns.size) + 0.9 * bad])
        verdict = verdict_of(data, RATE, plate, Signal(bad, RATE, turns).tacho())
        assert [(f.component, f.fault) for f in verdict.findings] == [("bearing_1", "inner_race")]


def test_a_second_fault_that_is_loudest_at_its_own_bearing_is_found():
    plate = _plate(3.93)
    for seed in range(4):
        rng = np.random.default_rng(seed)
        turns = turns_of(SPEED, 4.0, RATE)
        first = defect(rng, turns, RATE, BPFI, carrier_order=1.0).x
        second = defect(rng, turns, RATE, 3.93, resonance_hz=5500.0).x
        data = np.stack(
            [
                noise(rng, turns.size) + 0.9 * first + 0.3 * second,
                noise(rng, turns.size) + 0.4 * first + 0.7 * second,
            ]
        )
        verdict = verdict_of(data, RATE, plate, Signal(first, RATE, turns).tacho())
        assert {(f.component, f.fault) for f in verdict.findings} == {
            ("bearing_1", "inner_race"),
            ("bearing_2", "outer_race"),
        }


def test_a_weak_second_family_is_noted_beside_a_finding_and_traces_of_that_are_not():
    plate = _plate(3.93)
    rng = np.random.default_rng(2)
    turns = turns_of(SPEED, 12.0, RATE)
    first = defect(rng, turns, RATE, BPFI, carrier_order=1.0).x
    second = defect(rng, turns, RATE, 3.93, resonance_hz=5500.0, slip=0.002).x
    for share, noted in ((0.2, True), (0.0, False)):
        data = np.stack(
            [noise(rng, turns.size) + first, noise(rng, turns.size) + 0.1 * first + share * second]
        )
        verdict = verdict_of(data, RATE, plate, Signal(first, RATE, turns).tacho())
        assert [(f.component, f.fault) for f in verdict.findings] == [("bearing_1", "inner_race")]
        weak = [note.detail for note in verdict.notes if note.issue == "weak_modulation"]
        assert any("BPFO of bearing_2" in one for one in weak) is noted
        assert len(weak) == noted
        if noted:
            tacho = PulseTrain("shaft", 1.0, Signal(first, RATE, turns).tacho())
            record = Record(RATE, ("ch_1", "ch_2"), "m/s^2", data.astype(np.float32), (tacho,))
            told = diagnose_record(record, plate)
            assert [f.component for f in told.findings] == ["bearing_1"]
            assert any("BPFO of bearing_2" in note.detail for note in told.quality)


def test_no_cage_is_blamed_for_the_beat_of_a_race_with_the_shaft():
    """BPFI less five turns of the shaft is -0.245, next to where the slow shaft's cage would be."""
    plate = _plate(3.93)
    slow = replace(plate.bearings[1], shaft="slow")
    cage = bearing_orders(slow).ftf
    ratio = (5.0 - BPFI) / cage
    shafts = (*plate.shafts, Shaft("slow", ratio, SPEED * ratio))
    plate = replace(plate, shafts=shafts, bearings=(plate.bearings[0], slow))
    for seed in range(4):
        rng = np.random.default_rng(seed)
        turns = turns_of(SPEED, 4.0, RATE)
        bad = _spiky_inner_race(rng, turns)
        data = np.stack([noise(rng, turns.size) + 2.0 * bad, noise(rng, turns.size) + 1.2 * bad])
        verdict = verdict_of(data, RATE, plate, Signal(bad, RATE, turns).tacho())
        assert [(f.component, f.fault) for f in verdict.findings] == [("bearing_1", "inner_race")]


BAND = Band(2000.0, 4000.0, "bank")
RESOLUTION = 0.02


def _evidence(order, modulation, levels, dominance=5.0):
    """A family found at an order, as loud as told on each channel."""
    family = FaultFamily("bearing_2", "outer_race", order, 0.0, "BPFO", 0.012)
    return [
        FamilyEvidence(
            family,
            channel,
            BAND,
            order,
            order * SPEED,
            (20.0, 15.0, 10.0),
            (),
            20.0,
            1e-12,
            modulation,
            dominance,
            (BandLevel(BAND, level, True),),
            1,
        )
        for channel, level in levels.items()
    ]


def _first(order=BPFI, modulation=3.0):
    details = {"modulation": modulation}
    return Finding(
        "bearing_1", "inner_race", order, order, order * SPEED, 30.0, 0.9, "severe", "ch_1", details
    )


def _companion(order, modulation, levels):
    judged = _evidence(order, modulation, levels)
    best = max(judged, key=lambda e: e.by_band[0].amplitude)
    return is_companion(_plate(3.93), "bearing_2", judged, best, _first(), RESOLUTION)


def test_sums_of_the_first_families_lines_turns_and_cage_are_companions():
    """Where it is loudest at the second bearing, only the order speaks against it."""
    plate = _plate(3.93)
    cage = bearing_orders(plate.bearings[0]).ftf
    loud_there = {"ch_1": 0.5, "ch_2": 1.0}
    for order in (BPFI - 1, BPFI + 6, 2 * BPFI - 5.005, 15.0 - 3 * BPFI, BPFI - 1 + cage, 8 - BPFI - cage):
        assert _companion(order, 0.3, loud_there), order
        assert not _companion(order, 2.0, loud_there), "as strong as the first one, it is one of its own"
    assert not _companion(3.93, 0.3, loud_there)


def test_what_is_louder_at_the_first_bearing_is_a_companion():
    assert not _companion(3.93, 0.3, {"ch_1": 0.5, "ch_2": 1.0})
    assert _companion(3.93, 0.3, {"ch_1": 1.0, "ch_2": 0.5})
    assert heard_at(_evidence(3.93, 0.3, {"ch_1": 1.0, "ch_2": 0.5}), ("ch_2",), ("ch_1",)) == 0.5
    assert heard_at(_evidence(3.93, 0.3, {"ch_1": 1.0}), ("ch_2",), ("ch_1",)) == 1.0


def test_a_bearing_that_hardly_hears_its_lines_is_not_the_one_that_makes_them():
    """A seventeenth of the power elsewhere is too little; a third is what casings pass on of their own."""
    plate = _plate(3.93)
    for here, found in ((0.06, []), (0.3, [("bearing_2", "outer_race")])):
        rng = np.random.default_rng(1)
        turns = turns_of(SPEED, 4.0, RATE)
        bad = defect(rng, turns, RATE, 3.93, slip=0.002).x
        data = np.stack(
            [0.02 * noise(rng, turns.size) + bad, 0.02 * noise(rng, turns.size) + np.sqrt(here) * bad]
        )
        verdict = verdict_of(data, RATE, plate, Signal(bad, RATE, turns).tacho())
        assert [(f.component, f.fault) for f in verdict.findings] == found


def test_a_ring_on_the_shaft_may_ring_the_pedestal_of_another_bearing_on_it():
    """At a low load the shaft need not press on the bearing whose inner race is bad."""
    order = 10 - 3.93
    rng = np.random.default_rng(1)
    turns = turns_of(SPEED, 4.0, RATE)
    swing = 1.0 + 0.5 * np.cos(2 * np.pi * turns)
    bad = defect(rng, turns, RATE, order, slip=0.002).x * swing
    data = np.stack([0.02 * noise(rng, turns.size) + bad, 0.02 * noise(rng, turns.size) + 0.25 * bad])
    tacho = Signal(bad, RATE, turns).tacho()
    (finding,) = verdict_of(data, RATE, _plate(3.93), tacho).findings
    assert (finding.component, finding.fault) == ("bearing_2", "inner_race")
    plate = _plate(3.93)
    apart = replace(
        plate,
        shafts=(*plate.shafts, Shaft("other", 0.83, float("nan"))),
        bearings=(replace(plate.bearings[0], shaft="other"), plate.bearings[1]),
    )
    assert verdict_of(data, RATE, apart, tacho).findings == ()


def test_of_two_rings_on_a_shaft_the_one_that_its_own_bearing_hears_is_told():
    """Slip takes the first one's lines off its order, and its upper sideband onto that of the second one."""
    order = 1.006 * BPFI
    rng = np.random.default_rng(1)
    turns = turns_of(SPEED, 4.0, RATE)
    zone = np.exp(-0.5 * ((np.mod(turns, 1.0) - 0.5) / 0.06) ** 2)
    x = defect(rng, turns, RATE, order, slip=0.002).x * zone
    x *= 2.0 / np.sqrt(np.mean(x**2))
    data = np.stack([noise(rng, turns.size) + x, noise(rng, turns.size) + 0.15 * x])
    (finding,) = verdict_of(data, RATE, _plate(10 - order - 1), Signal(x, RATE, turns).tacho()).findings
    assert (finding.component, finding.fault) == ("bearing_1", "inner_race")
