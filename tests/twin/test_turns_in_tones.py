"""High multiples of a turn: lines of shafts at whatever speed a record has, and no tones in Hz."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from gearsim_io.machines import load_machine
from gearsim_io.record import PulseTrain, Record
from gearsim_twin.compare.features import Features, Plan, features, make_plan
from gearsim_twin.compare.merged import base
from gearsim_twin.view import View, view_of

RATE_HZ, SECONDS = 16384.0, 3.2


def _view(speed_hz: float, orders: dict[int, float], seed: int, machine: str, shaft: str) -> View:
    """Lines at multiples of the turn of a reference shaft that runs at this speed, in noise."""
    t = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    data = 0.02 * np.random.default_rng(seed).standard_normal(t.size)
    for order, amplitude in orders.items():
        data += amplitude * np.sin(2 * np.pi * order * speed_hz * t + order)
    pulses = np.arange(0.0, t.size, RATE_HZ / speed_hz / 60)
    plate = load_machine(machine)
    row = data[None, :].astype(np.float32)
    trains = (PulseTrain(shaft, 60.0, pulses),)
    return view_of(Record(RATE_HZ, (plate.channels[0].name,), "m/s^2", row, tachos=trains), plate)


def _shown(views: list[View], machine: str) -> tuple[Plan, list[Features]]:
    plan = make_plan(SimpleNamespace(machine=load_machine(machine)), views)
    return plan, [features(view, plan) for view in views]


def _tones(plan: Plan) -> list[int]:
    return [k for k, place in enumerate(plan.places) if place.domain == "orders" and place.kind == "tone"]


def test_a_high_multiple_of_a_turn_has_one_place_at_all_speeds() -> None:
    views = [
        _view(speed, {1: 0.1, 467: 0.2}, k, "unsw_parallel", "input") for k, speed in enumerate((10.0, 10.06))
    ]
    plan, (slow, fast) = _shown(views, "unsw_parallel")
    (row,) = _tones(plan)
    place = plan.places[row]
    # 0.6 % of 4.67 kHz are 28 Hz, ten lines of the spectrum over time.
    assert (place.unit, place.at, place.label) == ("order", 467.0, "467 x input")
    for found in (slow, fast):
        assert found.level_db[row] == pytest.approx(10 * np.log10(0.2**2 / 2), abs=0.3)
        assert found.stands_out[row]


def test_lines_of_a_slow_turn_that_run_into_one_another_are_no_tones() -> None:
    # 2.13 Hz apart, where windows of 0.7 s tell lines 7 Hz apart: the top lies between both.
    orders = {80: 0.2, 600: 0.15, 601: 0.14}
    plan, _ = _shown([_view(2.1391, orders, 3, "unsw_planetary", "carrier")], "unsw_planetary")
    found = [plan.places[k] for k in _tones(plan)]
    assert found
    assert {place.unit for place in found} == {"order"}
    assert all(place.at in orders for place in found)


def test_a_neighbours_line_between_them_is_still_a_tone() -> None:
    plan, _ = _shown([_view(2.1391, {80: 0.2}, 4, "unsw_planetary", "carrier")], "unsw_planetary")
    assert not _tones(plan)
    t = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    view = _view(2.1391, {80: 0.2}, 4, "unsw_planetary", "carrier")
    strange_hz = 628.5 * 2.1391
    data = view.record.data + (0.15 * np.sin(2 * np.pi * strange_hz * t)).astype(np.float32)
    strange = view_of(
        Record(RATE_HZ, view.record.channels, "m/s^2", data, tachos=view.record.tachos), view.machine
    )
    plan, _ = _shown([strange], "unsw_planetary")
    (row,) = _tones(plan)
    assert (plan.places[row].unit, plan.places[row].label) == ("Hz", "tone")
    assert plan.places[row].at == pytest.approx(strange_hz, abs=0.2)


def test_where_windows_are_short_lines_of_bearings_are_first_those_of_gears_and_planets() -> None:
    plan, _ = _shown([_view(2.1391, {80: 0.2}, 4, "unsw_planetary", "carrier")], "unsw_planetary")
    names = {place.label for place in plan.places if place.domain == "envelope" and place.kind == "line"}
    # Orders 52.7 and 52 are 0.7 of a turn apart, the lines of a window of 2.7 turns as wide as 1.9.
    assert "13 x planet or 2 x BPFO of planet_1_bearing and 2 alike" in names
    things = {base(name) for name in names if "BPFO" in name}
    assert things == {
        f"{turn} or BPFO of planet_1_bearing and 2 alike" for turn in ("input", "output", "planet")
    }
