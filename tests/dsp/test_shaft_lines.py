"""Fault families that no record can part from a shaft's harmonics."""

from dataclasses import replace

import numpy as np
import pytest
from bearing_signals import Signal, defect, machine, noise, rotating_lines, turns_of
from pooling import verdict_of

from gearsim_dsp.kinematics import FaultFamily, bearing_orders
from gearsim_dsp.shaft_lines import covering_multiple
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
