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
    monkeypatch.setattr(combine, "judge_all", lambda _measured: (tooth,))
    plate = machine(20.0)
    plate = replace(plate, shafts=(*plate.shafts, Shaft("other", 1.9949, math.nan)))
    measured = Measured(plate, 16_000.0, "m/s^2", {}, nameplate_speed(plate))
    found = combine.all_findings(measured, (bearing,))
    assert (bearing in found) == told
    assert tooth in found
