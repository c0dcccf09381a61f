"""Machines of which little is documented: bearings assumed, a stage chosen, channels with other names."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from gearsim_dsp.kinematics import fault_families
from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine, machine_file
from gearsim_sim.model.plants import make_plant
from gearsim_sim.params import load_bearing_rig_params, load_parallel_params
from gearsim_sim.scenario import parse_scenario
from gearsim_sim.simulation import to_record
from gearsim_sim.verify.machines import documented_first

RATE_HZ, SECONDS = 12800.0, 2.0


def lines_hz(machine: str, channel: str, speed_hz: float, load: str) -> np.ndarray:
    """The ten highest lines of the nominal model at a speed."""
    content = {
        "machine": machine,
        "model": "lpm34",
        "sample_rate": f"{RATE_HZ} Hz",
        "operating_point": {"speed": f"{speed_hz} Hz", "load": load},
        "sensors": {
            "accelerometers": {"chain": "ideal", "channels": [channel]},
            "encoders": {"shafts": []},
            "tachos": {"shafts": []},
        },
    }
    record = to_record(parse_scenario(content, Path("rig.yaml")), SECONDS)
    assert record.channels == (channel,)
    x = record.data[0] - record.data[0].mean()
    height = np.abs(np.fft.rfft(x * np.hanning(x.size)))
    inner = height[1:-1]
    peaks = 1 + np.flatnonzero((inner > height[:-2]) & (inner > height[2:]))
    return peaks[np.argsort(-height[peaks])][:10] / SECONDS


@pytest.mark.parametrize(
    ("machine", "channel", "speed_hz", "load", "teeth"),
    # The turbine's reference shaft is the driven one; of the gearbox the first stage is modelled.
    [("wt_hss", "accel", 20.0, "20 kN*m", 22), ("sq_gearbox", "a1", 30.0, "3 N*m", 32)],
)
def test_the_mesh_of_the_reference_shaft_is_what_shows(machine, channel, speed_hz, load, teeth):
    found = lines_hz(machine, channel, speed_hz, load)
    assert np.min(np.abs(found - teeth * speed_hz)) <= 1.0 / SECONDS


def test_a_reference_shaft_that_is_driven_drives_in_the_model():
    params = load_parallel_params("wt_hss")
    assert (params.input_shaft, params.output_shaft) == ("high_speed", "intermediate")
    assert params.speed_ratio == pytest.approx(22 / 112)
    assert make_plant(params, 1).sites["accel"] == {"y_p2": 1.0}
    first = load_parallel_params("sq_gearbox")
    assert first.speed_ratio == pytest.approx(32 / 80)
    assert first.mesh.name == "stage_1"


@pytest.mark.parametrize("machine", ["wt_hss", "sq_gearbox", "gear0"])
def test_a_diagnosis_never_looks_for_assumed_bearings(machine):
    plate = load_machine(machine)
    assert plate.bearings == ()
    assert not [family for family in fault_families(plate) if family.fault in ("outer_race", "inner_race")]


def test_models_are_verified_on_machines_that_are_documented():
    names = documented_first()
    assert max(names.index(name) for name in ("unsw_parallel", "mfpt", "cwru_drive_end")) < min(
        names.index(name) for name in ("gear0", "sq_gearbox", "wt_hss")
    )


def test_an_assumed_bearing_is_the_one_of_the_model():
    params = load_bearing_rig_params("gear0")
    (seat,) = make_plant(params, 1).bearings
    assert seat.name == "pinion_bearing"
    assert seat.law.gamma == pytest.approx(9.525 / 46)
    wider = {"nameplate.bearings.pinion_bearing.pitch_diameter": "47 mm"}
    (changed,) = make_plant(load_bearing_rig_params("gear0", wider, "test"), 1).bearings
    assert changed.law.gamma == pytest.approx(9.525 / 47)
    assert math.isclose(seat.law.ball_radius_m, changed.law.ball_radius_m)


REFUSED = [
    ("gear0", "      shaft: pinion\n", "      shaft: wheel\n", "pinion_bearing.shaft.*wheel.*pinion"),
    (
        "gear0",
        ', source: "assumed: deep-groove ball bearing of the size 6206"}\n      pitch',
        "}\n      pitch",
        "source",
    ),
    ("sq_gearbox", "stage: stage_1", "stage: stage_3", "no gear mesh stage_3.*stage_1, stage_2"),
    ("sq_gearbox", "  stage: stage_1\n", "", "2 gear meshes.*stage_1, stage_2"),
    ("sq_gearbox", "stage: stage_1", "stage: stage_2", "kind.*input.*driving or the driven shaft"),
    ("wt_hss", "sites: {accel: b2_y}", "sites: {accel: b5_y}", "sites.accel.*b5_y"),
    ("wt_hss", "sites: {accel: b2_y}", "sites: {acel: b2_y}", "sites.acel.*accel"),
]


@pytest.mark.parametrize(("machine", "old", "new", "expected"), REFUSED)
def test_what_cannot_be_assumed_is_told(tmp_path, machine, old, new, expected):
    text = machine_file(machine).read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / f"{machine}.yaml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    load = load_bearing_rig_params if machine == "gear0" else load_parallel_params
    with pytest.raises(InputError, match=f"(?s){expected}"):
        load(path)


def test_assumed_bearings_beside_those_of_a_nameplate_are_refused(tmp_path):
    text = machine_file("mfpt").read_text(encoding="utf-8")
    path = tmp_path / "mfpt.yaml"
    path.write_text(
        text.replace("  sites: {accel: y}", "  sites: {accel: y}\n  assumed_bearings: {}"), "utf-8"
    )
    with pytest.raises(InputError, match=r"assumed_bearings.*beside test_bearing"):
        load_bearing_rig_params(path)
