"""Shafts: unbalance, misalignment, looseness by velocities at low orders."""

import numpy as np
import pytest
from judge_signals import gearbox, measured, steady, turns

from gearsim_dsp.judges.shaft import bearing_levels, judge_shafts

SPEED_HZ, SECONDS = 20.0, 3.0


def line(order, velocity_mm_s, phase=0.3):
    """Acceleration of an order with so much RMS velocity."""
    omega = 2 * np.pi * SPEED_HZ * order
    amplitude = velocity_mm_s * 1e-3 * np.sqrt(2) * omega
    return amplitude * np.cos(2 * np.pi * order * turns(SPEED_HZ, SECONDS) + phase)


def judge(rows, seed=1, unit="m/s^2"):
    rng = np.random.default_rng(seed)
    size = turns(SPEED_HZ, SECONDS).size
    names = ("in_y", "in_x", "out_y", "out_x")
    channels = {n: rows.get(n, 0.0) + 0.05 * rng.standard_normal(size) for n in names}
    box = measured(gearbox(), channels, steady(SPEED_HZ, SECONDS))
    if unit != "m/s^2":
        box = type(box)(box.machine, box.sample_rate_hz, unit, channels, box.speed)
    return box, judge_shafts(box)


def test_velocities_are_those_put_in():
    box, _ = judge({"in_y": line(1, 1.0) + line(2, 0.5) + line(2.5, 0.25)})
    (level,) = bearing_levels(box)["input"]
    expected = {0: 0.0, 1: 1.0, 3: 0.5, 4: 0.25, 5: 0.0}
    for index, value in expected.items():
        assert level.velocity_mm_s[index] == pytest.approx(value, rel=0.02, abs=1e-3)


def test_order_one_in_both_directions_is_unbalance():
    _, (finding,) = judge({"in_y": line(1, 3.0), "in_x": line(1, 2.5, 1.9)})
    assert (finding.component, finding.fault) == ("input", "unbalance")
    assert finding.evidence["velocity_mm_s"] == pytest.approx(2.5, rel=0.02)


def test_order_one_along_one_direction_is_not():
    _, findings = judge({"in_y": line(1, 5.0)})
    assert findings == ()


def test_strong_harmonics_are_misalignment():
    _, (finding,) = judge({"in_y": line(1, 1.0) + line(2, 2.0) + line(3, 1.0), "in_x": line(2, 1.5)})
    assert (finding.component, finding.fault) == ("input", "misalignment")


def test_many_orders_and_halves_on_one_foot_are_looseness():
    rattle = sum(line(k, 1.2) for k in (0.5, 1, 1.5, 2, 2.5, 3, 4, 5))
    _, (finding,) = judge({"in_y": rattle, "out_y": line(1, 0.5)})
    assert (finding.component, finding.fault) == ("bearing_1", "looseness")


@pytest.mark.parametrize("velocity", [0.3, 1.0])
def test_levels_of_sound_rigs_are_no_finding(velocity):
    """The MFPT baselines have 1.0 mm/s at order 1 and 0.5 mm/s at its harmonics."""
    _, findings = judge({"in_y": line(1, velocity) + line(2, 0.5 * velocity), "in_x": line(1, velocity, 1.5)})
    assert findings == ()


def test_levels_in_an_unknown_unit_are_not_judged():
    _, findings = judge({"in_y": line(1, 9.0), "in_x": line(1, 9.0)}, unit="1")
    assert findings == ()
