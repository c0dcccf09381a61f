"""A speed that is stated: in which unit, how far from the nameplate it may be, and what is noted of it."""

import re
from dataclasses import replace

import numpy as np
import pytest

from gearsim_io.errors import InputError
from gearsim_io.importers import Overrides, import_file, machine_for
from gearsim_io.machines import load_machine
from gearsim_io.stated_speed import given_far_off, origin_words, parse_speed, with_speed

PLATE = load_machine("mfpt")  # 25 Hz


@pytest.mark.parametrize(
    ("text", "hz"),
    [("29.9", 29.9), ("29.9 Hz", 29.9), ("1794rpm", 29.9), ("1794 r/min", 29.9), ("3e1hz", 30.0)],
)
def test_a_speed_is_hz_unless_its_unit_is_told(text, hz):
    assert parse_speed(text) == pytest.approx(hz, rel=1e-12)


@pytest.mark.parametrize("text", ["fast", "0", "-3", "nan", "inf", "10 furlong", "", "1.2.3", "1e999"])
def test_what_is_no_speed_is_told_with_what_would_be_one(text):
    with pytest.raises(ValueError, match="expected a speed above 0 in Hz, or with its unit, such as 1796rpm"):
        parse_speed(text)


def _file(tmp_path):
    path = tmp_path / "x.npz"
    np.savez(path, accel=np.random.default_rng(0).standard_normal(1000))
    return path


def _imported(tmp_path, speed_hz):
    wanted = Overrides(rate_hz=1000.0, unit="g", variables=("accel",), speed_hz=speed_hz)
    return import_file(_file(tmp_path), "mfpt", wanted)


def test_rpm_taken_for_hz_are_refused_with_what_to_write(tmp_path):
    words = re.escape(
        "--speed: got 1500 Hz, expected 2.5 to 250 Hz, about the nameplate's 25 Hz; "
        "1500 rpm are 25 Hz: write --speed 1500rpm"
    )
    with pytest.raises(InputError, match=f"^{words}$"):
        machine_for(_imported(tmp_path, 1500.0), PLATE)


@pytest.mark.parametrize(("speed_hz", "fits"), [(2.4, False), (2.6, True), (249.0, True), (251.0, False)])
def test_a_speed_may_be_ten_times_off_the_nameplate(tmp_path, speed_hz, fits):
    record = _imported(tmp_path, speed_hz)
    if fits:
        assert machine_for(record, PLATE).nominal_speed_hz == pytest.approx(speed_hz)
        return
    with pytest.raises(InputError, match=r"expected 2\.5 to 250 Hz, about the nameplate's 25 Hz"):
        machine_for(record, PLATE)


def test_without_a_nominal_speed_the_fastest_machines_are_the_limit(tmp_path):
    shafts = tuple(replace(shaft, nominal_speed_hz=float("nan")) for shaft in PLATE.shafts)
    silent = replace(PLATE, shafts=shafts)
    assert machine_for(_imported(tmp_path, 480.0), silent).nominal_speed_hz == 480.0
    with pytest.raises(InputError, match=r"got 1500 Hz, expected at most 500 Hz; 1500 rpm are 25 Hz"):
        machine_for(_imported(tmp_path, 1500.0), silent)


def test_notes_tell_where_a_speed_comes_from(tmp_path):
    given = _imported(tmp_path, 30.0).notes
    assert (given["speed from"], given["speed on the nameplate"]) == ("given", "25 Hz")
    assert origin_words(given, 30.0) == "the 30 Hz given"
    assert (
        origin_words(with_speed({}, 30.0, "stated in the file", None), 30.0) == "the 30 Hz stated in the file"
    )
    assert origin_words({}, 25.0) == "the nameplate's 25 Hz"
    assert given_far_off(given, 0.02) == "the 30 Hz given are +20 % off the nameplate's 25 Hz"
    assert given_far_off(given, 0.25) == ""
    assert given_far_off(with_speed({}, 30.0, "stated in the file", PLATE), 0.02) == ""
