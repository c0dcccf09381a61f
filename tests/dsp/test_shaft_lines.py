"""Fault families that no record can part from a shaft's harmonics."""

from dataclasses import replace

import numpy as np
import pytest
from bearing_signals import Signal, defect, machine, noise, rotating_lines, turns_of
from pooling import verdict_of

from gearsim_dsp.kinematics import FaultFamily, bearing_orders
from gearsim_dsp.shaft_lines import (
    ShaftMultiple,
    SpectrumView,
    covering_multiple,
    other_shafts,
    over_shaft,
    strongest_other_multiple,
)
from gearsim_io.machines import load_machine
from gearsim_io.nameplate import Bearing, Shaft

RATE = 16_000.0
SPEED = 20.0
NUMBER = 5


def _plate(order=4.996, elements=12):
    """One bearing whose outer race is passed that many times a turn."""
    size = 1.0 - order / (0.5 * elements)
    bearing = Bearing("bearing_1", "shaft", elements, 40e-3 * size, 40e-3, 0.0, False, ("ch_1",))
    plate = replace(machine(SPEED, tacho=True), bearings=(bearing,))
    assert bearing_orders(bearing).bpfo == pytest.approx(order)
    return plate


def _verdict(x, turns, plate):
    made = Signal(x, RATE, turns)
    return verdict_of(x[None], RATE, plate, made.tacho())


@pytest.mark.parametrize("order", [4.996, 5.0, 5.003])
def test_an_outer_race_passed_five_times_a_turn_is_found_among_the_shafts_lines(order):
    for seed in range(3):
        rng = np.random.default_rng(seed)
        turns = turns_of(SPEED, 4.0, RATE)
        bad = defect(rng, turns, RATE, order, slip=0.002)
        swing = np.exp(rotating_lines(turns, {1: 0.3, 2: 0.2, 3: 0.1, 4: 0.1}))
        verdict = _verdict(noise(rng, turns.size) * swing + 0.8 * bad.x, turns, _plate(order))
        assert [finding.fault for finding in verdict.findings] == ["outer_race"]
        (finding,) = verdict.findings
        assert finding.found_order == pytest.approx(order, rel=2e-3)
        assert finding.evidence["covered_by"] == "5 x shaft"


def test_harmonics_that_are_parted_prove_a_race_whose_first_ones_are_not():
    """Sidebands of a narrow load zone raise all of the shaft's lines, against which the race is nothing."""
    order, elements = 5.985, 10
    size = order / (0.5 * elements) - 1.0
    bearing = Bearing("bearing_1", "shaft", elements, 40e-3 * size, 40e-3, 0.0, False, ("ch_1",))
    plate = replace(machine(SPEED, tacho=True), bearings=(bearing,))
    for seed in range(3):
        rng = np.random.default_rng(seed)
        turns = turns_of(SPEED, 4.0, RATE)
        zone = np.exp(-0.5 * ((np.mod(turns, 1.0) - 0.5) / 0.15) ** 2)
        x = defect(rng, turns, RATE, order, slip=0.0).x * zone
        (finding,) = _verdict(
            noise(rng, turns.size) + 1.5 * x / np.sqrt(np.mean(x**2)), turns, plate
        ).findings
        assert finding.fault == "inner_race"
        assert finding.evidence["covered_by"] == "6 x shaft"
        assert finding.evidence["features"]["covered"] == 1.0
        assert finding.evidence["dominance"] > 20.0


def test_harmonics_that_fall_on_a_shafts_count_as_those_that_do_not():
    """Of 1.992 the first five lines fall on the shaft's even ones; of 1.9 none; their impacts are alike."""
    sizes = []
    for order in (1.992, 1.9):
        rng = np.random.default_rng(0)
        turns = turns_of(SPEED, 4.0, RATE)
        bad = defect(rng, turns, RATE, order, slip=0.0)
        (finding,) = _verdict(noise(rng, turns.size) + 0.17 * bad.x, turns, _plate(order, 6)).findings
        assert finding.fault == "outer_race"
        assert finding.found_order == pytest.approx(order, rel=1e-3)
        sizes.append(finding.evidence["modulation"])
    assert 0.5 < sizes[0] / sizes[1] < 1.1, sizes


def test_impacts_once_a_turn_and_low_harmonics_are_not_taken_for_it():
    """A bad tooth has all harmonics alike; runout and couplings the low ones."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        turns = turns_of(SPEED, 4.0, RATE)
        tooth = defect(rng, turns, RATE, 1.0, slip=0.0)
        assert _verdict(noise(rng, turns.size) + tooth.x, turns, _plate()).findings == ()
        swing = np.exp(rotating_lines(turns, {k: 0.6 / k for k in range(1, 11)}))
        assert _verdict(noise(rng, turns.size) * swing, turns, _plate()).findings == ()


def test_a_shaft_that_swings_at_neighbouring_harmonics_as_well_is_not_taken_for_it():
    for seed in range(4):
        rng = np.random.default_rng(seed)
        turns = turns_of(SPEED, 4.0, RATE)
        swing = np.exp(rotating_lines(turns, dict.fromkeys((4, 5, 6, 8, 10, 12, 15), 0.35)))
        assert _verdict(noise(rng, turns.size) * swing, turns, _plate()).findings == ()


def test_only_what_cannot_be_parted_counts_as_covered():
    plate = _plate()

    def covered(order, resolution=0.02, doubt=0.0, of=plate):
        family = FaultFamily("b", "outer_race", order, 0.0, "BPFO", 0.012)
        return covering_multiple(of, family, resolution, doubt)

    assert covered(4.996) is not None
    assert covered(4.996).number == NUMBER
    assert covered(4.97) is None
    assert covered(2.001) is None, "orders 1 and 2 have too many other sources"
    assert covered(4.996, doubt=0.01) is None, "the speed is not known well enough"
    two = replace(plate, shafts=(Shaft("shaft", 1.0, SPEED), Shaft("output", 0.75, 15.0)))
    assert covered(3.7505, of=two).shaft == "output"


def test_planets_that_pass_are_no_bearing():
    plate = load_machine("unsw_planetary")
    stage = plate.planetary_stages[0]
    family = FaultFamily("b", "outer_race", 3.0 * plate.shaft(stage.carrier_shaft).ratio, 0.0, "BPFO", 0.012)
    assert covering_multiple(plate, family, 0.02, 0.0) is None
    (bare,) = [replace(plate, planetary_stages=())]
    assert covering_multiple(bare, family, 0.02, 0.0) is not None


STEP, WIDE = 0.02, 2


def _spectrum(heights):
    """Lines at orders over an axis up to 50, on a floor of 1e-6; shape (1, lines)."""
    power = np.full((1, 2501), 1e-6)
    for order, height in heights.items():
        power[0, round(order / STEP)] = height
    return power


def test_the_shafts_other_multiples_are_rivals():
    power = _spectrum({4.0 * k: 0.01 for k in range(1, 13)} | {5.0 * k: 0.5 for k in range(1, 10)})
    # Of 4, 8 ... 32 that at 20 is one of the fives, too.
    assert strongest_other_multiple(power[0], STEP, WIDE, 1.0, 5) == pytest.approx(2 * 7 * 0.01, rel=0.01)
    assert strongest_other_multiple(_spectrum({})[0], STEP, WIDE, 1.0, 5) < 1e-4


def test_lines_are_measured_against_those_between():
    heights = {float(k): 0.01 for k in range(1, 50)} | {5.0 * k: 0.3 for k in range(1, 10)}
    power = _spectrum(heights)
    view = SpectrumView(power / 1e-6, np.zeros_like(power), power - 1e-6, np.zeros(2501, dtype=bool))
    free = np.ones(2501, dtype=bool)
    free[round(15 / STEP)] = False
    over = over_shaft(view, power, STEP, WIDE, 1.0, 5, free)
    for k in (1, 2, 4):
        at = round(5 * k / STEP)
        assert over.usable[at]
        assert over.ratio[0, at] == pytest.approx(30.0)
        assert over.excess[0, at] == pytest.approx(0.29)
        assert over.tail[0, at] == pytest.approx(8 * np.log(1 + 30 / 8), rel=0.01), "F(2, 16) at 30"
    assert not over.usable[round(15 / STEP)], "another shaft's line"
    assert not over.usable[round(4 / STEP)]


def test_shafts_that_share_the_multiple_do_not_forbid_it():
    plate = replace(_plate(), shafts=(Shaft("shaft", 1.0, SPEED), Shaft("output", 0.75, 15.0)))
    assert other_shafts(plate, ShaftMultiple("output", 0.75, 5), 0.02) == [1.0]
    assert other_shafts(plate, ShaftMultiple("output", 0.75, 4), 0.02) == []
