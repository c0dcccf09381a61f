"""Gears: one tooth that stands out, its kind, teeth uneven all round, a wheel off its axis."""

import numpy as np
import pytest
from judge_signals import edges, gearbox, measured, mesh, ring_down, steady, turns

from gearsim_dsp.judges.gear import judge_gears
from gearsim_dsp.judges.gear_signs import shaft_signs
from gearsim_dsp.judges.runout import wheel_runout

SPEED_HZ, SECONDS = 20.0, 3.0


def signals(seed, machine, *, tooth_of=None, amplitude=2.0, noise=0.2, scatter=0.02):
    """Both bearings hear the mesh, teeth a little uneven, noise, and one tooth of a wheel every turn."""
    rng = np.random.default_rng(seed)
    angle = turns(SPEED_HZ, SECONDS)
    teeth = machine.gear_meshes[0].driving_teeth
    uneven = scatter * rng.standard_normal(teeth)
    x = mesh(angle, teeth) * (1 + uneven[(angle * teeth).astype(int) % teeth])
    if tooth_of:
        hz = SPEED_HZ * machine.shaft(tooth_of).ratio
        x = x + ring_down((np.arange(300) + 0.37) / hz, SECONDS, amplitude, 1200.0)
    return {name: x + noise * rng.standard_normal(x.size) for name in ("in_y", "out_y")}


def judge(channels, machine, encoders=None):
    return judge_gears(measured(machine, channels, steady(SPEED_HZ, SECONDS), encoders))


@pytest.mark.parametrize(("shaft", "component"), [("input", "gears.pinion"), ("output", "gears.gear")])
def test_the_wheel_with_the_bad_tooth_is_named(shaft, component):
    machine = gearbox()
    (finding,) = judge(signals(1, machine, tooth_of=shaft), machine)
    assert finding.component == component
    assert finding.fault in ("gear_tooth_spall", "gear_tooth_crack")
    assert finding.found_order == machine.shaft(shaft).ratio
    # The event begins at 0.37 turns and rings for a pitch or so.
    assert 0.36 < finding.evidence["tooth_angle_turns"] < 0.37 + 1.5 / 23


def test_wheels_of_one_speed_are_named_together():
    machine = gearbox(29, 29)
    (finding,) = judge(signals(2, machine, tooth_of="output"), machine)
    assert finding.component == "gears"


@pytest.mark.parametrize("seed", range(8))
def test_sound_gears_have_no_finding(seed):
    machine = gearbox()
    assert judge(signals(seed, machine), machine) == ()


def test_noise_alone_has_no_finding():
    machine = gearbox()
    rng = np.random.default_rng(5)
    size = turns(SPEED_HZ, SECONDS).size
    assert judge({"in_y": rng.standard_normal(size)}, machine) == ()


def test_teeth_uneven_all_round_with_strong_harmonics_are_worn():
    machine = gearbox()
    rng = np.random.default_rng(3)
    angle = turns(SPEED_HZ, SECONDS)
    uneven = 1 + 0.4 * rng.standard_normal(23)
    x = mesh(angle, 23, (3.0, 1.5, 2.0, 1.0)) * uneven[(angle * 23).astype(int) % 23]
    x = x + 0.1 * rng.standard_normal(x.size)
    (finding,) = judge({"in_y": x}, machine)
    assert (finding.component, finding.fault) == ("gears.pinion", "gear_wear")


@pytest.mark.parametrize(("seconds", "side"), [(2.0, ""), (6.0, "pinion")])
def test_wheels_of_nearly_one_speed_add_up_where_the_record_does_not_part_them(seconds, side):
    """At 44 and 45 teeth the turns are a line apart in 45 turns; together both may have more than each."""
    machine = gearbox(44, 45)
    ratio, share = machine.shaft("output").ratio, 0.006
    trains = {
        "input": edges("input", SPEED_HZ, seconds, error=lambda t: share / 44 * np.sin(2 * np.pi * t)),
        "output": edges(
            "output", SPEED_HZ * ratio, seconds, error=lambda t: 0.5 * share / 45 * np.sin(2 * np.pi * t)
        ),
    }
    channels = {name: np.zeros(round(seconds * 16384)) for name in ("in_y", "in_x", "out_y", "out_x")}
    box = measured(machine, channels, steady(SPEED_HZ, seconds), trains)
    found = wheel_runout(box, machine.gear_meshes[0])
    assert found.side == side
    if side:
        assert found.share_of_pitch == pytest.approx(share, rel=0.02)
    else:
        assert 0.0075 < found.share_of_pitch < 1.5 * share
    assert "gear_eccentricity" not in [f.fault for f in judge_gears(box)]


@pytest.mark.parametrize(("pinion", "gear"), [(19, 57), (20, 57)])
def test_a_tooth_that_strikes_six_times_in_the_record_is_named_and_such_few_turns_are_not_wear(pinion, gear):
    """Of 19 and 57 teeth the one of the gear always meets the same of the pinion, and is not that one's."""
    machine, seconds = gearbox(pinion, gear), 6.4 * gear / pinion / SPEED_HZ
    ratio = machine.shaft("output").ratio
    rng = np.random.default_rng(4)
    angle = turns(SPEED_HZ, seconds)
    uneven = 1 + 0.02 * rng.standard_normal(gear)
    sound = mesh(angle, pinion) * uneven[(angle * pinion).astype(int) % gear]
    strikes = ring_down((np.arange(300) + 0.37) / (SPEED_HZ * ratio), seconds, 2.0, 1200.0)
    for added, expected in ((0.0, []), (strikes, ["gears.gear"])):
        channels = {n: sound + added + 0.2 * rng.standard_normal(angle.size) for n in ("in_y", "out_y")}
        found = judge_gears(measured(machine, channels, steady(SPEED_HZ, seconds)))
        assert [one.component for one in found] == expected
    rough = 1 + 0.4 * rng.standard_normal(gear)
    worn = mesh(angle, pinion, (3.0, 1.5, 2.0, 1.0)) * rough[(angle * pinion).astype(int) % gear]
    few = shaft_signs(measured(machine, {"in_y": worn}, steady(SPEED_HZ, seconds)), ratio)
    assert [one.turns for one in few] == [6]
    found = judge_gears(measured(machine, {"in_y": worn}, steady(SPEED_HZ, seconds)))
    assert "gears.gear" not in [one.component for one in found if one.fault == "gear_wear"]


def test_nothing_is_judged_without_the_angle_or_with_few_turns():
    machine = gearbox()
    channels = {name: x[: 16384 // 4] for name, x in signals(1, machine, tooth_of="input").items()}
    few = measured(machine, channels, steady(SPEED_HZ, 0.25))
    assert judge_gears(few) == ()
    assert shaft_signs(few, 1.0) == []


def test_runout_is_measured_in_parts_of_the_pitch():
    """A lead of a sin(2 pi turn) turns is 23 a pitches of the pinion."""
    machine = gearbox()
    share = 0.02
    ratio = machine.shaft("output").ratio
    trains = {
        "input": edges("input", SPEED_HZ, SECONDS, error=lambda t: share / 23 * np.sin(2 * np.pi * t)),
        "output": edges("output", SPEED_HZ * ratio, SECONDS),
    }
    box = measured(machine, signals(1, machine), steady(SPEED_HZ, SECONDS), trains)
    found = wheel_runout(box, machine.gear_meshes[0])
    assert found.side == "pinion"
    assert found.share_of_pitch == pytest.approx(share, rel=0.02)
    faults = {f.fault: f for f in judge_gears(box)}
    assert faults["gear_eccentricity"].component == "gears.pinion"
