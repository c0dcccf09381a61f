"""Causes of operation and structure: speeds, loads, labels, stages, resonances, paths, read off records."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gearsim_dsp.speed import Phase, ShaftSpeed
from gearsim_io.importers import import_file
from gearsim_io.machines import load_machine
from gearsim_io.record import PulseTrain, Record
from gearsim_sim.scenario import parse_scenario
from gearsim_twin.causes import CAUSES, Context
from gearsim_twin.causes.casing_resonance import absorber_db
from gearsim_twin.causes.shaft_speed_offset import stretch_between
from gearsim_twin.causes.speed_fluctuation import course_of, swing_of
from gearsim_twin.view import View, view_of
from tests.twin.chain_cases import BASES, context, healthy, record

LOAD_NM = {"parallel": 50.0, "planetary": 46.875}
SPEED_HZ = {rig: float(base["operating_point"]["speed"].split()[0]) for rig, base in BASES.items()}
RESONANCES = [
    ("parallel", "b3_y", 2200.0, 2.0, 0.03),
    ("parallel", "b3_y", 900.0, 2.0, 0.03),
    ("bearing", "accel", 2200.0, 0.5, 0.02),
]


def starts(name: str, seen: Context) -> list[dict[str, Any]]:
    """The guesses of a cause; the first one's extension must be a scenario that can be run."""
    cause = CAUSES[name]
    if not cause.applies(seen):
        return []
    found = cause.starts(seen)
    if found:
        before = copy.deepcopy(seen.contents[0])
        content = cause.extend(seen.contents[0], found[0], seen)
        assert seen.contents[0] == before
        parse_scenario(content, Path("extended.yaml"))
        assert cause.signature(found[0])
        for parameter in cause.parameters:
            assert parameter.prior.low <= float(found[0][parameter.name]) <= parameter.prior.high
    return found


@pytest.mark.parametrize("rig", ["parallel", "planetary"])
def test_healthy_records_swing_and_surge_no_more_than_models(rig: str) -> None:
    seen = healthy(rig, 3)
    for name in ("speed_fluctuation", "load_fluctuation", "mislabelled_record", "missing_gear_stage"):
        assert not starts(name, seen), name


@pytest.mark.parametrize("rig", ["parallel", "planetary"])
@pytest.mark.parametrize(("part", "bandwidth_hz"), [(0.002, 1.0), (0.01, 3.0)])
def test_swings_of_the_speed_are_measured(rig: str, part: float, bandwidth_hz: float) -> None:
    time_s = np.arange(0.0, 5.0, 0.04)
    course = 1 + part * course_of(time_s, bandwidth_hz, seed=5)
    columns = {"time_s": time_s.tolist(), "speed_hz": (SPEED_HZ[rig] * course).tolist()}
    content = {"profile": {"trace": {"columns": columns}}, "operating_point": {"load": f"{LOAD_NM[rig]} N*m"}}
    base = BASES[rig]["operating_point"]
    try:
        BASES[rig]["operating_point"] = {}
        measured = record(rig, 5, **content)
    finally:
        BASES[rig]["operating_point"] = base
    (start,) = starts("speed_fluctuation", context(rig, measured))
    true = part * float(np.std(course_of(np.arange(0.0, 4.0, 0.01), bandwidth_hz, seed=5)))
    assert abs(start["rms_relative"] - true) < 2.5 * start["std:rms_relative"]
    assert start["bandwidth_hz"] == pytest.approx(bandwidth_hz, rel=0.5)


def test_an_extended_speed_swings_as_asked() -> None:
    cause, seen = CAUSES["speed_fluctuation"], healthy("parallel", 3)
    content = cause.extend(seen.contents[0], {"rms_relative": 0.01, "bandwidth_hz": 2.0}, seen)
    columns = content["profile"]["trace"]["columns"]
    speed_hz = np.array(columns["speed_hz"])
    assert columns["time_s"][-1] > seen.views[0].record.seconds
    # Five seconds of 2 Hz are some twenty independent values: 16 % of the rms, three times that.
    assert np.std(speed_hz) / np.mean(speed_hz) == pytest.approx(0.01, rel=0.5)


@pytest.mark.parametrize(("rig", "part", "band_hz"), [("parallel", 0.05, 2.0), ("parallel", 0.2, 5.0)])
def test_a_load_that_swings_is_guessed_within_a_factor_of_three(
    rig: str, part: float, band_hz: float
) -> None:
    noise = {"rms": f"{part * LOAD_NM[rig]} N*m", "low": "0 Hz", "high": f"{band_hz} Hz"}
    found = starts("load_fluctuation", context(rig, record(rig, 5, profile={"load_noise": noise})))
    assert found
    assert 1 / 3 < found[0]["rms_nm"] / (part * LOAD_NM[rig]) < 3


@pytest.mark.parametrize("rig", ["parallel", "planetary", "bearing"])
@pytest.mark.parametrize("off", [-0.004, 0.03])
def test_spectra_tell_by_how_much_the_speed_is_off(rig: str, off: float) -> None:
    """Without any angle: the model's lines, moved by one factor, lie on the measured ones."""
    fault = {"kind": "outer_race_spall", "component": "test_bearing", "params": {"width_m": "0.5 mm"}}
    faults = {"faults": [fault]} if rig == "bearing" else {}
    speed = {"operating_point": {"speed": f"{SPEED_HZ[rig] * (1 + off)} Hz"}}
    bare = dataclasses.replace(record(rig, 5, **faults, **speed), tachos=(), encoders=())
    model = (
        healthy(rig, 3).simulated_views[0]
        if not faults
        else view_of(record(rig, 6, **faults), healthy(rig, 3).case.machine)
    )
    found = stretch_between(view_of(bare, healthy(rig, 3).case.machine), model)
    assert found is not None
    assert found.clear > 1.5
    assert abs(found.ratio - 1 - off) < 3 * found.std
    assert found.std < 5e-3


def test_a_speed_off_the_nameplate_is_told() -> None:
    (start,) = starts("shaft_speed_offset", context("parallel", record("parallel", 5)))
    assert start["speed_hz"] == pytest.approx(10.137, rel=1e-5)
    assert start["stated_hz"] == 10.0


def test_a_record_of_another_speed_is_mislabelled() -> None:
    measured = record("parallel", 5, operating_point={"speed": "12.3 Hz"})
    found = starts("mislabelled_record", context("parallel", measured))
    assert found[0]["component"] == "speed"
    assert found[0]["speed_ratio"] == pytest.approx(1.23, rel=1e-3)


@pytest.mark.parametrize("factor", [0.5, 1.3, 2.0])
def test_a_tacho_with_other_pulses_is_contradicted(factor: float) -> None:
    measured = record("parallel", 5, operating_point={"speed": "10 Hz"}, sensors={"encoders": {"shafts": []}})
    (train,) = (one for one in measured.tachos if one.shaft == "input")
    half = PulseTrain(train.shaft, factor * train.pulses_per_revolution, train.samples)
    found = starts("mislabelled_record", context("parallel", dataclasses.replace(measured, tachos=(half,))))
    assert found[0]["component"] == "tacho"
    assert found[0]["speed_ratio"] == pytest.approx(factor, rel=0.01)


@pytest.mark.parametrize("rig", ["parallel", "planetary"])
def test_teeth_that_the_model_lacks_are_counted(rig: str) -> None:
    ripple = [
        {"at": "motor", "order": 23, "amplitude": "3 N*m"},
        {"at": "motor", "order": 46, "amplitude": "2 N*m"},
    ]
    found = starts("missing_gear_stage", context(rig, record(rig, 5, profile={"ripple": ripple})))
    assert found
    assert (found[0]["teeth"], found[0]["order"]) == (23.0, 23.0)


def test_the_stage_that_the_nameplate_lists_is_taken_in() -> None:
    seen = context("planetary", record("planetary", 5, parameters={"first_stage.included": 1}))
    (start, *_) = starts("missing_gear_stage", seen)
    assert start["component"] == "first_stage"
    assert start["teeth"] == 32.0
    content = CAUSES["missing_gear_stage"].extend(seen.contents[0], start, seen)
    assert content["parameters"]["first_stage.included"]["value"] == 1.0


@pytest.mark.parametrize(("rig", "site", "frequency_hz", "mass_kg", "damping"), RESONANCES)
def test_an_added_resonance_is_told_with_mass_and_damping(
    rig: str, site: str, frequency_hz: float, mass_kg: float, damping: float
) -> None:
    entry = {
        "site": site,
        "mass": f"{mass_kg} kg",
        "frequency": f"{frequency_hz} Hz",
        "damping_ratio": damping,
    }
    found = starts("casing_resonance", context(rig, record(rig, 5, structure={"resonances": [entry]})))
    near = [one for one in found if abs(one["frequency_hz"] / frequency_hz - 1) < 0.04]
    right = [one for one in near if one["component"] == site]
    assert right
    # The site is taken to be as heavy as its pedestal alone.
    assert 0.5 < right[0]["mass_kg"] / mass_kg < 2
    assert 0.4 < right[0]["damping_ratio"] / damping < 2.5


def test_a_mass_on_a_site_moves_it_as_two_equations_say() -> None:
    """Force on M with m on a spring beside it, solved directly."""
    big, small, own, zeta = 12.0, 0.6, 2200.0, 0.02
    f = np.array([500.0, 2100.0, 2200.0, 2260.0, 6000.0])
    w, w0 = 2 * np.pi * f, 2 * np.pi * own
    link = small * (w0**2 + 2j * zeta * w0 * w)
    alone = 1 / (-(w**2) * big)
    with_mass = 1 / (-(w**2) * big + link - link**2 / (link - w**2 * small))
    expected = 20 * np.log10(np.abs(with_mass / alone))
    # The curve leaves out the gain of the low end, where both move together.
    low = 20 * np.log10(1 + small / big)
    assert absorber_db(f, own, small / big, zeta) == pytest.approx(expected + low, abs=1e-6)


def test_a_path_is_seen_at_its_far_end() -> None:
    entry = {"from": "b3_y", "to": "b3_x", "mass": "1 kg", "frequency": "700 Hz", "damping_ratio": 0.05}
    found = starts("transfer_path", context("parallel", record("parallel", 5, structure={"paths": [entry]})))
    assert found
    assert found[0]["to"] == "b3_x"
    assert 0.1 < found[0]["mass_kg"] < 10
    assert not starts("transfer_path", healthy("parallel", 3))


@pytest.mark.records
def test_the_speed_of_a_bearing_rig_without_tacho_is_off_its_nameplate(
    record_file: Callable[[str], Path],
) -> None:
    """A steady rig: what swings is nothing, and the speed found is within its motor's slip of 25 Hz."""
    measured = import_file(record_file("mfpt/OuterRaceFault_1.mat"), "mfpt")
    view = view_of(measured, load_machine("mfpt"))
    swing = swing_of(view)
    assert swing is None or swing.relative < 1e-4
    assert 0.98 < view.speed_hz / 25.0 < 1.0


def test_the_swing_of_a_long_record_is_that_of_its_course() -> None:
    """A tacho of 40 pulses over 200 s: some 800 independent values of a swing of 2 Hz."""
    time_s = np.arange(0.0, 200.0, 1e-3)
    speed_hz = 10.0 * (1 + 0.005 * course_of(time_s, 2.0, seed=7))
    turns = np.concatenate(([0.0], np.cumsum(speed_hz[:-1]) * 1e-3))
    marks = np.arange(1, int(turns[-1] * 40)) / 40
    phase = Phase(np.interp(marks, turns, time_s) * 1000.0, marks)
    silence = Record(1000.0, ("b1_y",), "m/s^2", np.zeros((1, time_s.size), dtype=np.float32))
    speed = ShaftSpeed(10.0, (9.9, 10.1), "tacho", phase)
    swing = swing_of(View(silence, load_machine("unsw_parallel"), speed))
    assert swing is not None
    assert swing.relative == pytest.approx(0.005, rel=0.08)
    assert swing.bandwidth_hz == pytest.approx(2.0, rel=0.2)
