"""Impulses of planet teeth: counted, told apart, and not seen where there are none."""

import json

import numpy as np
import pytest
from judge_signals import RATE_HZ, measured, planetary, ring_down, steady, turns

from gearsim_bringup.evaluation.cases import draw_case
from gearsim_bringup.evaluation.run import simulate_case
from gearsim_dsp.diagnose import diagnose_record
from gearsim_dsp.judges.planet import find_impulses, fold_stage, judge_planets

CARRIER_HZ, SECONDS = 3.0, 4.0
PLANET_TURN_S = 1 / (4 * CARRIER_HZ)  # ring 80 over planet 20, against the carrier


def ring_signal(seed, places, amplitude=2.0, noise=0.1, pass_by=True):
    """Mesh at 80 orders, noise, and impulses at fractions of the planet's turn, near the sensor or far."""
    rng = np.random.default_rng(seed)
    angle = turns(CARRIER_HZ, SECONDS)
    x = 4.0 * np.cos(2 * np.pi * 80 * angle) + 1.5 * np.cos(2 * np.pi * 160 * angle + 1.0)
    x += noise * rng.standard_normal(x.size)
    for place in places:
        times = (np.arange(200) + place) * PLANET_TURN_S
        times = times[times < SECONDS]
        size = 1.0 + 0.8 * np.cos(2 * np.pi * CARRIER_HZ * times) if pass_by else 1.0
        x += ring_down(times, SECONDS, amplitude * size)
    return x


def judge(x):
    machine = planetary()
    return judge_planets(measured(machine, {"ring": x}, steady(CARRIER_HZ, SECONDS)))


@pytest.mark.parametrize("seed", range(3))
def test_one_place_is_a_spall_with_16_impulses(seed):
    (finding,) = judge(ring_signal(seed, [0.13]))
    assert finding.fault == "planet_tooth_spall"
    assert finding.component == "insert.planet"
    assert finding.evidence["impulses_per_4_carrier_turns"] == 16
    assert 12 <= finding.evidence["impulses_seen"] <= 16
    assert finding.found_hz == pytest.approx(12.0)
    assert finding.evidence["side"] == "not told"  # one sensor cannot
    json.dumps(finding.to_json(), allow_nan=False)


@pytest.mark.parametrize("seed", range(3))
def test_two_places_half_a_turn_less_half_a_tooth_apart_are_a_crack_with_32(seed):
    (finding,) = judge(ring_signal(seed, [0.13, 0.13 + 0.5 - 0.5 / 20]))
    assert finding.fault == "planet_tooth_crack"
    assert finding.evidence["impulses_per_4_carrier_turns"] == 32
    assert 24 <= finding.evidence["impulses_seen"] <= 32
    assert finding.expected_order == pytest.approx(8.0)


@pytest.mark.parametrize("seed", range(6))
def test_a_sound_stage_has_no_finding(seed):
    assert judge(ring_signal(seed, [])) == ()


def test_two_places_a_quarter_of_a_turn_apart_are_no_crack():
    found = judge(ring_signal(1, [0.13, 0.38]))
    assert all(finding.fault != "planet_tooth_crack" for finding in found)


def test_too_few_turns_say_nothing():
    machine = planetary()
    x = ring_signal(1, [0.13])[: round(0.5 * RATE_HZ)]
    short = measured(machine, {"ring": x}, steady(CARRIER_HZ, 0.5))
    assert fold_stage(short, machine.planetary_stages[0]) == []


def test_the_profile_of_pure_noise_does_not_stand_out():
    rng = np.random.default_rng(4)
    found = [find_impulses(rng.gamma(40.0, 1 / 40.0, 160)).stands_out() for _ in range(300)]
    assert not any(found)


@pytest.mark.parametrize("number", [0, 1, 2, 3])
def test_simulated_stages_of_table_7_7(number):
    """Healthy, slot, spall to the sun, spall to the ring; docs/evaluation.md has the rates of many."""
    case = draw_case("table77", 7, number)
    record, machine = simulate_case(case)
    findings = diagnose_record(record, machine).findings
    assert [f.fault for f in findings] == [t.fault for t in case.truths]
    if case.truths:
        wanted = 32 if case.truths[0].fault == "planet_tooth_crack" else 16
        assert findings[0].evidence["impulses_per_4_carrier_turns"] == wanted


def pushed_stage(number, seconds=6.0):
    """Blows of a tooth of planet `number`, in lines 120 degrees apart, heard by a sensor that stands."""
    samples = round(seconds * RATE_HZ)
    t = np.arange(samples) / RATE_HZ
    since = np.mod(t - 0.3 * PLANET_TURN_S, PLANET_TURN_S)
    blow = 0.5 * np.exp(-(((since - 1.5e-3) / 0.5e-3) ** 2)) * np.cos(2 * np.pi * 2500.0 * since)
    heard = np.cos(2 * np.pi * (CARRIER_HZ * t - number / 3 - 0.1))
    return blow * heard + 0.05 * np.random.default_rng(number).standard_normal(samples)


@pytest.mark.parametrize("number", [0, 1, 2])
def test_planets_differ_in_where_the_carrier_stands_when_they_push_the_ring(number):
    machine = planetary()
    (finding,) = judge_planets(measured(machine, {"ring": pushed_stage(number)}, steady(CARRIER_HZ, 6.0)))
    turn = finding.evidence["carrier_turn_of_push"]
    assert np.mod(turn - number / 3 - 0.1 + 0.25, 0.5) == pytest.approx(0.25, abs=0.02)
    assert f"{turn:.2f}" in finding.evidence["which_planet"]


def test_averaged_turns_find_what_single_turns_bury_in_noise():
    """The same tooth at a noise in which the residual shows nothing, and none without the tooth."""
    machine, speed = planetary(), steady(CARRIER_HZ, 12.0)
    tooth = pushed_stage(0, 12.0)
    for seed in range(3):
        noise = 0.3 * np.random.default_rng(seed).standard_normal(tooth.size)
        (finding,) = judge_planets(measured(machine, {"ring": tooth + noise}, speed))
        assert finding.evidence["stands_out_of"] == "turns averaged with the carrier"
        assert finding.fault == "planet_tooth_spall"
        assert judge_planets(measured(machine, {"ring": noise}, speed)) == ()
        folded = fold_stage(measured(machine, {"ring": tooth + noise}, speed), machine.planetary_stages[0])
        assert not find_impulses(folded[0].profile).stands_out()


def test_one_knock_is_no_tooth():
    """Loud, but in one half of the record only."""
    machine, speed = planetary(), steady(CARRIER_HZ, 6.0)
    x = 0.05 * np.random.default_rng(1).standard_normal(round(6 * RATE_HZ))
    x += ring_down([2.03], 6.0, 20.0)
    assert judge_planets(measured(machine, {"ring": x}, speed)) == ()
