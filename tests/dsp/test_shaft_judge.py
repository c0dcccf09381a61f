"""Shafts: unbalance, misalignment, looseness by velocities at low orders."""

from dataclasses import replace

import numpy as np
import pytest
from judge_signals import gearbox, measured, steady, turns

from gearsim_dsp.judges import levels
from gearsim_dsp.judges.levels import bearing_levels
from gearsim_dsp.judges.registry import judge_all
from gearsim_dsp.judges.shaft import judge_shafts, undecided_orders
from gearsim_dsp.judges.supply import supply_shares
from gearsim_dsp.speed import Phase, ShaftSpeed

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
    # White noise of 0.05 m/s^2 gives a line of a record of N samples the amplitude 2 x 0.05 / sqrt(N).
    noise_mm_s = 1e3 * 2 * 0.05 / np.sqrt(2 * turns(SPEED_HZ, SECONDS).size) / (2 * np.pi * SPEED_HZ)
    assert finding.snr_db == pytest.approx(20 * np.log10(2.5 / noise_mm_s), abs=1.5)


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


@pytest.mark.parametrize(("across", "fault"), [(0.02, "looseness"), (0.5, "misalignment")])
def test_harmonics_in_one_direction_only_are_a_foot_that_lifts(across, fault):
    """Both bearings of one shaft hear them; a coupling out of line shakes all round."""
    rattle = sum(line(k, 3.0 / k, 0.3 * k) for k in (1, 2, 3, 4, 5))
    rows = {
        "in_y": rattle,
        "in_x": line(1, 2.0, 1.9) + across * (rattle - line(1, 3.0)),
        "out_y": 0.6 * rattle,
    }
    _, findings = judge(rows)
    assert findings[0].fault == fault
    assert findings[0].component == ("bearing_1" if fault == "looseness" else "input")


@pytest.mark.parametrize("velocity", [0.3, 1.0])
def test_levels_of_sound_rigs_are_no_finding(velocity):
    """The MFPT baselines have 1.0 mm/s at order 1 and 0.5 mm/s at its harmonics."""
    _, findings = judge({"in_y": line(1, velocity) + line(2, 0.5 * velocity), "in_x": line(1, velocity, 1.5)})
    assert findings == ()


def test_levels_in_an_unknown_unit_are_not_judged():
    _, findings = judge({"in_y": line(1, 9.0), "in_x": line(1, 9.0)}, unit="1")
    assert findings == ()


def test_a_fault_that_grows_counts_as_large_as_it_has_become():
    """From nothing to 3 mm/s in three seconds: 1.5 on average, under the limit of 1.8."""
    size = turns(SPEED_HZ, SECONDS).size
    growth = np.linspace(0.0, 1.0, size)
    _, (finding,) = judge({"in_y": growth * line(1, 3.0), "in_x": growth * line(1, 3.0, 1.9)})
    assert (finding.component, finding.fault) == ("input", "unbalance")
    # 5/6 of the growth in the middle of the last third.
    assert finding.evidence["velocity_mm_s"] == pytest.approx(2.5, rel=0.02)
    _, none = judge({"in_y": 0.5 * growth * line(1, 3.0), "in_x": 0.5 * growth * line(1, 3.0, 1.9)})
    assert none == ()


def hum(amplitudes_m_s2, frequency_hz=50.0):
    """Acceleration that a ground loop feigns: the supply and its multiples."""
    t = np.arange(round(SECONDS * 16384)) / 16384.0
    return sum(
        a * np.cos(2 * np.pi * k * frequency_hz * t + 0.7 * k) for k, a in enumerate(amplitudes_m_s2, 1)
    )


def judge_at(speeds_hz, rows, seed=2):
    """The same gearbox at a speed that goes evenly from one value to another."""
    rng = np.random.default_rng(seed)
    at = np.arange(round(SECONDS * 16384), dtype=float)
    low, high = speeds_hz
    angle = (low * at + 0.5 * (high - low) * at**2 / at[-1]) / 16384.0
    mean = 0.5 * (low + high)
    speed = ShaftSpeed(mean, (0.9999 * mean, 1.0001 * mean), "tacho", Phase(at[::64], angle[::64]))
    names = ("in_y", "in_x", "out_y", "out_x")
    channels = {n: rows.get(n, 0.0) + 0.05 * rng.standard_normal(at.size) for n in names}
    return measured(gearbox(), channels, speed), angle


@pytest.mark.parametrize(("speed_hz", "supply_hz"), [(10.0, 50.0), (12.5, 50.0), (25.0, 50.0), (10.0, 60.0)])
def test_hum_at_a_whole_order_is_no_misalignment_and_is_told(speed_hz, supply_hz):
    """5 m/s^2 at 50 Hz read as a velocity are 11 mm/s: order 5 at 10 Hz, 4 at 12.5 Hz, 2 at 25 Hz."""
    tones = hum((5.0, 1.0, 2.0), supply_hz)
    box, _ = judge_at((speed_hz, speed_hz), dict.fromkeys(("in_y", "in_x", "out_y", "out_x"), tones))
    assert judge_shafts(box) == ()
    told = undecided_orders(box)
    assert {issue.issue for issue in told} == {"order_or_supply"}
    assert f"order {supply_hz / speed_hz:g} " in told[0].detail


def test_orders_at_hums_place_count_where_the_speed_changes():
    """Over 5 to 15 Hz order 5 sweeps 50 Hz: what stays in its line is the shaft's."""
    box, angle = judge_at((5.0, 15.0), {})
    omega = 2 * np.pi * 50.0
    order_five = 3e-3 * np.sqrt(2) * omega * np.cos(2 * np.pi * 5 * angle)
    box, _ = judge_at((5.0, 15.0), {"in_y": order_five, "in_x": order_five})
    (finding,) = judge_shafts(box)
    assert finding.fault == "misalignment"
    assert undecided_orders(box) == ()
    # The supply itself, though, is averaged out.
    box, _ = judge_at((5.0, 15.0), dict.fromkeys(("in_y", "in_x"), hum((5.0,))))
    assert judge_shafts(box) == ()


def test_orders_beside_hums_place_carry_their_finding_at_constant_speed():
    """Jaws speak at order 3, 30 Hz here; the hum at order 5 is told, and takes nothing away."""
    omega = 2 * np.pi * 30.0
    box, angle = judge_at((10.0, 10.0), {})
    jaws = 2e-3 * np.sqrt(2) * omega * np.cos(2 * np.pi * 3 * angle)
    box, _ = judge_at((10.0, 10.0), {"in_y": jaws + hum((5.0,)), "in_x": jaws})
    (finding,) = judge_shafts(box)
    assert (finding.component, finding.fault) == ("input", "misalignment")
    assert finding.evidence["velocity_mm_s"] == pytest.approx(2.0, rel=0.03)
    assert len(undecided_orders(box)) == 1


def test_the_supply_that_the_nameplate_states_is_the_only_one_in_doubt():
    box, _ = judge_at((10.0, 10.0), {})
    stated = replace(box.machine, line_frequency_hz=60.0)
    shares = supply_shares(replace(box, machine=stated), np.arange(1.0, 9.0))
    assert np.flatnonzero(shares > 0.5).tolist() == [5]


def test_the_levels_are_measured_once_for_all_judges(monkeypatch):
    """Gears, shafts and remarks ask for them."""
    measured_at = []
    original = levels._velocities

    def counted(box, channel, shaft):
        measured_at.append((box.sample_count, channel))
        return original(box, channel, shaft)

    monkeypatch.setattr(levels, "_velocities", counted)
    box, _ = judge({})
    judge_all(box)
    undecided_orders(box)
    whole = [channel for samples, channel in measured_at if samples == box.sample_count]
    assert sorted(whole) == sorted(box.channels)
