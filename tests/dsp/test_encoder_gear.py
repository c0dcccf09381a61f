"""Single teeth and worn flanks in the transmission error between two encoders on soft couplings."""

import numpy as np
import pytest
from judge_signals import RATE_HZ, edges, gearbox, measured, mesh, steady, turns
from scipy.signal import lfilter

from gearsim_dsp.judges.combine import all_findings
from gearsim_dsp.judges.encoder_gear import spall_probability, stands_out
from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.judges.gear import judge_gears
from gearsim_dsp.judges.shaft import shaken_shafts
from gearsim_dsp.judges.tooth_errors import tooth_errors

SPEED_HZ, SECONDS = 20.0, 4.0
PINION, GEAR = 23, 37


def resonance(values, frequency_hz=550.0, damping=0.01):
    """An encoder on its coupling: rings on for tens of milliseconds; 1 at rest."""
    pole = np.exp(2 * np.pi * frequency_hz / RATE_HZ * (-damping + 1j * np.sqrt(1 - damping**2)))
    a = np.array([1.0, -2 * pole.real, abs(pole) ** 2])
    return lfilter([a.sum()], a, values)


def handed_over(angle, errors):
    """Error of each tooth handed to the next along cos^2."""
    teeth = errors.size
    place = np.mod(angle, 1.0) * teeth
    tooth = place.astype(int) % teeth
    share = np.sin(0.5 * np.pi * (place - np.floor(place))) ** 2
    return (1 - share) * errors[tooth] + share * errors[(tooth + 1) % teeth]


def trains(seed, *, cracked="", crack=0.0, worn="", worn_by=8.0, gear=GEAR):
    """Encoders of both shafts: run-out, pitch errors of 2e-5 pitches, and what is wrong."""
    rng = np.random.default_rng(seed)
    time = np.arange(-1.0, SECONDS, 1 / RATE_HZ)  # a second to settle
    total = np.zeros(time.size)
    for shaft, teeth in (("input", PINION), ("output", gear)):
        angle = SPEED_HZ * (PINION / teeth) * time
        errors = 2e-5 * rng.standard_normal(teeth) * (worn_by if shaft == worn else 1.0)
        # Between 0.2 and 0.9 of a pitch on, while the tooth is the only one in contact.
        place = np.mod(angle, 1.0) * teeth - 7.0
        soft = crack * ((place > 0.2) & (place < 0.9)) if shaft == cracked else 0.0
        total += 3e-3 * np.sin(2 * np.pi * angle + 1.0) + handed_over(angle, errors) + soft
        total += 1e-3 * np.cos(2 * np.pi * teeth * angle)
    total = resonance(total)
    at = SPEED_HZ * time

    def lag(turn):
        return np.interp(turn, at, total) / PINION

    return {
        "input": edges("input", SPEED_HZ, SECONDS, 900, error=lag),
        "output": edges("output", SPEED_HZ * PINION / gear, SECONDS, 900),
    }


def box_of(encoders, machine=None):
    rng = np.random.default_rng(1)
    angle = turns(SPEED_HZ, SECONDS)
    channels = {"in_y": mesh(angle, PINION) + 0.2 * rng.standard_normal(angle.size)}
    return measured(machine or gearbox(PINION, GEAR), channels, steady(SPEED_HZ, SECONDS), encoders)


@pytest.mark.parametrize(("shaft", "component"), [("input", "gears.pinion"), ("output", "gears.gear")])
@pytest.mark.parametrize("seed", range(4))
def test_a_cracked_tooth_that_shakes_nothing_is_found_by_the_encoders(seed, shaft, component):
    box = box_of(trains(seed, cracked=shaft, crack=7e-5))
    (finding,) = judge_gears(box)
    assert (finding.component, finding.fault) == (component, "gear_tooth_crack")
    assert finding.evidence["witness"] == "transmission error"
    teeth = PINION if shaft == "input" else GEAR
    assert finding.evidence["tooth_angle_turns"] * teeth == pytest.approx(7.5, abs=1.0)
    assert finding.evidence["features"]["over_median"] > 0


def test_a_deep_event_is_a_spall():
    (finding,) = judge_gears(box_of(trains(1, cracked="input", crack=4e-3)))
    assert (finding.component, finding.fault) == ("gears.pinion", "gear_tooth_spall")


@pytest.mark.parametrize("seed", range(12))
def test_sound_teeth_with_gaussian_errors_have_no_finding(seed):
    box = box_of(trains(seed))
    assert judge_gears(box) == ()
    assert not any(stands_out(one) for one in tooth_errors(box, box.machine.gear_meshes[0]))


@pytest.mark.parametrize(("shaft", "component"), [("input", "gears.pinion"), ("output", "gears.gear")])
@pytest.mark.parametrize("seed", range(3))
def test_teeth_far_more_uneven_than_their_mates_are_worn(seed, shaft, component):
    (finding,) = judge_gears(box_of(trains(seed, worn=shaft)))
    assert (finding.component, finding.fault) == (component, "gear_wear")
    assert finding.evidence["uneven_over_mate"] == pytest.approx(8.0, rel=0.5)


@pytest.mark.parametrize("seed", range(3))
def test_of_whole_multiples_of_teeth_wear_is_not_told(seed):
    """All that the pinion does lies in the average of a gear of twice as many teeth."""
    gear = 2 * PINION
    assert judge_gears(box_of(trains(seed, gear=gear), gearbox(PINION, gear))) == ()


def test_a_larger_event_is_the_likelier_spall():
    box = box_of(trains(2, cracked="input", crack=7e-5))
    small = max(tooth_errors(box, box.machine.gear_meshes[0]), key=lambda one: one.event.over_median)
    box = box_of(trains(2, cracked="input", crack=1e-3))
    large = max(tooth_errors(box, box.machine.gear_meshes[0]), key=lambda one: one.event.over_median)
    assert spall_probability(small) < 0.5 < spall_probability(large)


def test_one_encoder_or_too_few_turns_tell_nothing():
    encoders = trains(3, cracked="input", crack=7e-5)
    mesh_of = gearbox(PINION, GEAR).gear_meshes[0]
    assert tooth_errors(box_of({"input": encoders["input"]}), mesh_of) == ()
    few = {name: type(one)(one.shaft, 900.0, one.samples[:5000]) for name, one in encoders.items()}
    assert tooth_errors(box_of(few), mesh_of) == ()


def test_encoders_too_coarse_for_the_teeth_tell_nothing():
    coarse = {
        "input": edges("input", SPEED_HZ, SECONDS, 64),
        "output": edges("output", SPEED_HZ * PINION / GEAR, SECONDS, 64),
    }
    assert tooth_errors(box_of(coarse), gearbox(PINION, GEAR).gear_meshes[0]) == ()


def test_a_shaft_that_shakes_all_round_is_no_fault_of_its_wheel():
    """Unbalance of 1 mm/s moves the wheel along the line of action, once a turn: not its teeth's doing."""
    encoders = trains(1, cracked="input", crack=7e-5)
    still = box_of(encoders)
    shake = 1e-3 * np.sqrt(2) * 2 * np.pi * SPEED_HZ * np.cos(2 * np.pi * turns(SPEED_HZ, SECONDS))
    noise = 0.02 * np.random.default_rng(3).standard_normal(shake.size)
    shaken = measured(
        still.machine, {"in_y": still.channels["in_y"] + shake, "in_x": shake + noise}, still.speed, encoders
    )
    assert shaken_shafts(shaken) == {"input"}
    assert shaken_shafts(still) == set()
    assert judge_gears(shaken) == ()


@pytest.mark.parametrize(("order", "kept"), [(7.5009, False), (8.003, False), (7.4034, True), (7.75, True)])
def test_what_strikes_at_halves_of_a_bad_tooths_turns_is_the_tooth(monkeypatch, order, kept):
    """At a low load teeth part, and a bad one is met harder every other turn."""
    tooth = Finding("gears", "gear_tooth_spall", 1.0, 1.0, SPEED_HZ, 20.0, 0.95, "moderate", "in_y")
    monkeypatch.setattr("gearsim_dsp.judges.combine.judge_all", lambda _: (tooth,))
    details = {"modulation": 0.4, "dominance": 4.0}
    bearing = Finding("bearing_1", "inner_race", 7.54, order, 150.0, 12.0, 0.4, "moderate", "in_y", details)
    found = all_findings(box_of(trains(1)), (bearing,))
    assert ("inner_race" in [one.fault for one in found]) is kept


@pytest.mark.parametrize(("confidence", "wear"), [(0.9, False), (0.35, False), (0.2, True)])
def test_beside_a_bearing_that_is_told_nothing_is_said_of_wear(confidence, wear):
    bearing = Finding("bearing_1", "inner_race", 5.4, 5.4, 108.0, 20.0, confidence, "moderate", "in_y")
    found = all_findings(box_of(trains(1, worn="input")), (bearing,))
    assert ("gear_wear" in [one.fault for one in found]) is wear
    assert "inner_race" in [one.fault for one in found]
