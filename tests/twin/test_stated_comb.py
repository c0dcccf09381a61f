"""Speeds that share lines with another: which one has its multiples."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gearsim_dsp.quality import QualityIssue
from gearsim_dsp.speed import ShaftSpeed
from gearsim_io.machines import load_machine
from gearsim_io.record import Record
from gearsim_twin.causes import CAUSES
from gearsim_twin.labels import speed_label
from gearsim_twin.stated_comb import other_speed_hz
from gearsim_twin.view import View

RATE_HZ, SECONDS, TRUE_HZ = 8192.0, 4.0, 29.94


def view(taken_hz, lines_hz, source="estimated", machine="mfpt"):
    t = np.arange(int(RATE_HZ * SECONDS)) / RATE_HZ
    rng = np.random.default_rng(5)
    data = rng.standard_normal(t.size)
    for hz in lines_hz:
        data += 0.5 * np.cos(2 * np.pi * hz * t + rng.uniform(0, 6.28))
    record = Record(RATE_HZ, ("accel",), "m/s^2", data.astype(np.float32)[None])
    speed = ShaftSpeed(taken_hz, (0.999 * taken_hz, 1.001 * taken_hz), source)
    return View(record, load_machine(machine), speed)


SHAFT = [k * TRUE_HZ for k in range(1, 13)]
SPALL = [k * 3.245 * TRUE_HZ for k in range(1, 8)]


@pytest.mark.parametrize("ratio", [4 / 5, 5 / 6, 6 / 5, 2 / 3, 1.15])
def test_a_speed_that_shares_every_few_lines_is_contradicted_by_the_true_one(ratio):
    found = other_speed_hz(view(ratio * TRUE_HZ, SHAFT))
    assert found == pytest.approx(TRUE_HZ, rel=0.01)


@pytest.mark.parametrize("lines", [SHAFT, SHAFT[:5], SHAFT[:3] + SPALL, SPALL, []])
def test_a_right_speed_is_not_contradicted_by_lines_of_a_bearing_or_by_few_lines(lines):
    assert other_speed_hz(view(TRUE_HZ, lines)) is None


def test_a_speed_beyond_tolerance_at_a_rate_that_is_doubtful_is_no_offset():
    one = replace(
        view(0.97 * 25.0, SHAFT[:3]), issues=(QualityIssue("sampling_rate_doubtful", "", "50 Hz at 61"),)
    )
    label = speed_label([one], [], tuple(CAUSES.values()), 60.0)
    assert label is not None
    assert label.contradicted
    assert label.found.name == "mislabelled_record"
    plain = speed_label([replace(one, issues=())], [], tuple(CAUSES.values()), 60.0)
    assert plain is not None
    assert plain.found.name == "shaft_speed_offset"


def test_nothing_is_asked_where_a_tacho_or_gears_tell_or_no_speed_is_known():
    assert other_speed_hz(view(0.8 * TRUE_HZ, SHAFT, source="tacho")) is None
    assert other_speed_hz(view(0.8 * TRUE_HZ, SHAFT, machine="unsw_parallel")) is None
    assert other_speed_hz(view(float("nan"), SHAFT)) is None


def test_such_a_record_is_told_as_mislabelled_and_never_as_an_offset():
    """Lines near the 25 Hz stated tell 23.95 Hz, sharp and certain: four fifths of the truth."""
    one = view(0.8 * TRUE_HZ, SHAFT)
    label = speed_label([one], [], tuple(CAUSES.values()), 60.0)
    assert label is not None
    assert label.contradicted
    assert label.found.name == "mislabelled_record"
    (ratio,) = label.found.parameters
    assert ratio.ci95[0] <= TRUE_HZ / 25.0 <= ratio.ci95[1]
    assert "another machine" in label.found.signature
    assert speed_label([one], [], (SimpleNamespace(name="hum"),), 60.0) is None
