"""What one fault only looks like to another judge is not told."""

import math
from dataclasses import replace

import pytest
from bearing_signals import machine

from gearsim_dsp.judges import combine
from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.speed import nameplate_speed
from gearsim_io.nameplate import Shaft


def _finding(component, fault, order, **evidence):
    return Finding(component, fault, order, order, order, 20.0, 0.9, "severe", "ch_1", evidence)


def _told(monkeypatch, others, bearings):
    plate = machine(20.0)
    plate = replace(plate, shafts=(*plate.shafts, Shaft("other", 1.9949, math.nan)))
    monkeypatch.setattr(combine, "judge_all", lambda _measured: others)
    measured = Measured(plate, 16_000.0, "m/s^2", {}, nameplate_speed(plate))
    return combine.all_findings(measured, bearings)


@pytest.mark.parametrize(
    ("order", "covered", "told"),
    [
        (
            5.9846,
            {"covered_by": "6 x shaft"},
            False,
        ),
        (5.9846, {}, True),
        (5.9995, {}, False),
        (3.4990, {}, False),
        (5.9846, {"covered_by": "3 x other"}, True),
    ],
)
def test_lines_of_the_shaft_with_a_bad_tooth_are_no_bearings(monkeypatch, order, covered, told):
    tooth = _finding("gears.pinion", "gear_tooth_spall", 1.0)
    bearing = _finding("bearing_1", "inner_race", order, **covered)
    found = _told(monkeypatch, (tooth,), (bearing,))
    assert (bearing in found) == told
    assert tooth in found


@pytest.mark.parametrize(
    ("fault", "severity", "witness", "told"),
    [
        ("inner_race", "severe", "transmission error", False),
        ("inner_race", "moderate", "transmission error", True),
        ("outer_race", "severe", "transmission error", True),
        ("inner_race", "severe", None, True),
    ],
)
def test_a_shaft_that_yields_over_a_spalled_race_is_no_soft_tooth(
    monkeypatch, fault, severity, witness, told
):
    evidence = {"witness": witness} if witness else {}
    tooth = _finding("gears.pinion", "gear_tooth_crack", 1.0, **evidence)
    bearing = replace(_finding("bearing_1", fault, 5.58), severity=severity)
    found = _told(monkeypatch, (tooth,), (bearing,))
    assert bearing in found
    assert (tooth in found) == told


@pytest.mark.parametrize(
    ("fault", "told"), [("misalignment", False), ("unbalance", False), ("gear_eccentricity", True)]
)
def test_beside_a_shaft_that_shakes_nothing_is_said_by_drift(monkeypatch, fault, told):
    race = _finding("bearing_1", "inner_race", 6.003)
    monkeypatch.setattr(combine, "drifting_races", lambda _measured: (race,))
    assert (race in _told(monkeypatch, (_finding("shaft", fault, 1.0),), ())) == told
    other = _finding("bearing_2", "outer_race", 3.9)
    assert race not in _told(monkeypatch, (), (other,)), "asked only where nothing else is found"
