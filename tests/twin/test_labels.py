"""A speed that is not the one stated has a place of its own, and is named for what it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gearsim_dsp.quality import QualityIssue
from gearsim_dsp.speed import ShaftSpeed
from gearsim_io.machines import load_machine
from gearsim_io.record import Record
from gearsim_twin.causes import CAUSES
from gearsim_twin.labels import speed_label
from gearsim_twin.view import View

KNOWN = tuple(CAUSES.values())
TURNS = 12.0


def view(speed_hz, source="tacho", half_hz=1e-3, issues=()):
    record = Record(1000.0, ("b1_y",), "m/s^2", np.zeros((1, 4000), dtype=np.float32), source="run")
    speed = ShaftSpeed(speed_hz, (speed_hz - half_hz, speed_hz + half_hz), source)
    return View(record, load_machine("unsw_parallel"), speed, None, issues)


def label(*speeds, held=(), **more):
    return speed_label([view(s, **more) for s in speeds], [view(s, **more) for s in held], KNOWN, TURNS)


def test_a_speed_within_the_tolerance_is_no_matter():
    assert label(10.15, 9.85) is None


def test_an_offset_is_named_with_its_size_and_gain():
    found = label(10.4, 10.42, held=(10.41,))
    assert (found.found.name, found.discrepancy.explained_by) == ("shaft_speed_offset",) * 2
    (speed,) = found.found.parameters
    assert speed.value == pytest.approx(10.41)
    assert speed.ci95[0] < 10.41 < speed.ci95[1]
    assert found.found.probability > 0.999
    # 4.1 % of 12 turns are half a line: 6 dB for each line.
    assert found.found.heldout_gain_db == pytest.approx(6.0 * np.log(1.041) * TURNS, rel=0.01)
    assert "10.41 Hz measured, 10 Hz stated" in found.discrepancy.where


def test_far_off_the_record_is_another_one():
    found = label(14.0, held=(14.0,))
    assert (found.found.name, found.found.component) == ("mislabelled_record", "speed")
    assert found.found.parameters[0].value == pytest.approx(1.4)


def test_an_angle_signal_that_contradicts_the_vibration_is_a_label_too():
    doubt = (QualityIssue("angle_contradicted", "", "half the speed"),)
    assert label(10.5, issues=doubt, source="estimated").found.name == "mislabelled_record"


def test_nothing_is_said_where_only_the_label_or_a_poor_reading_tells_the_speed():
    assert label(10.4, source="nameplate") is None
    assert label(10.4, source="estimated", half_hz=0.5) is None
    assert label(10.4, 10.0) is None


def test_only_known_causes_are_named():
    others = [cause for cause in KNOWN if cause.name != "shaft_speed_offset"]
    assert speed_label([view(10.4)], [], others, TURNS) is None


def test_where_nothing_is_held_out_the_gain_is_that_of_the_training():
    whole, none = label(10.4, held=(10.4,)), label(10.4)
    assert none.found.heldout_gain_db == pytest.approx(whole.found.heldout_gain_db)
    assert replace(none.discrepancy, z=0.0) == replace(whole.discrepancy, z=0.0)
