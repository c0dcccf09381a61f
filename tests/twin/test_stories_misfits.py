"""What the thesis knows its simulations to miss, as cases: records that have it, the model that has not.

The records come from another seed, stiffness and noise than the models beside them.
"""

from __future__ import annotations

import copy
import dataclasses
from pathlib import Path
from typing import Any

import pytest
from rig_records import case_of

from gearsim_io.record import Record
from gearsim_sim.model import planet_plant
from gearsim_sim.scenario import parse_scenario
from gearsim_sim.simulation import to_record
from gearsim_twin.baseline import scenario_content
from gearsim_twin.case import Case
from gearsim_twin.causes import CAUSES
from gearsim_twin.causes.context import Context
from gearsim_twin.compare.features import features, make_plan
from gearsim_twin.simulated import Simulator
from gearsim_twin.stated import score_stated

NOISE = {"accelerometers": {"chain": "ideal", "all": {"noise_density": "0.002 m/s^2/Hz^0.5"}}}


def record_of(content: dict[str, Any], seconds: float, load: str = "") -> Record:
    made = to_record(parse_scenario({"seed": 5, **copy.deepcopy(content)}, Path("rig.yaml")), seconds)
    return dataclasses.replace(made, source="rig", notes={"load": load} if load else {})


def context_of(
    case: Case, faults: tuple[dict[str, Any], ...] = (), noise: dict[str, Any] | None = None
) -> Context:
    """The training records beside the model, with faults and the sensors' noise where it has them already."""
    views = case.views()[: len(case.training)]
    contents = tuple({**scenario_content(case, view), "faults": list(faults)} for view in views)
    for content in contents:
        content["sensors"]["accelerometers"]["all"] = noise or {}
    with Simulator(case, 1, case.views()) as simulator:
        shown = tuple(simulator.views(dict(enumerate(contents))))
    return Context(case, views, (), (), (), contents, shown)


# The extended fault of an outer race, too impulsive without an oil film -----------------------------------

WIDE = {"race": "outer", "length_m": 3e-3, "depth_m": 15e-6}
FILM_PA_S = 0.5


@pytest.fixture(scope="module")
def oiled() -> Case:
    """A wide spall under a light load, in oil."""
    content = {
        "machine": "mfpt",
        "model": "bearing5",
        "sample_rate": "24000 Hz",
        "operating_point": {"speed": "25 Hz", "load": "0 N*m"},
        "sensors": {**NOISE, "encoders": {"shafts": []}, "tachos": {"shafts": ["shaft"], "pulses": 1}},
        "parameters": {"pedestal.stiffness": "9.5e7 N/m", "radial_load": "25 lbf"},
        "faults": [
            {"kind": "wide_spall", "component": "test_bearing", "params": WIDE},
            {"kind": "oil_film", "component": "test_bearing", "params": {"viscosity_pa_s": FILM_PA_S}},
        ],
    }
    return case_of("mfpt", "bearing5", record_of(content, 4.0, "25 lbf"))


def test_an_extended_fault_is_too_impulsive_without_its_film(oiled):
    bare = {"kind": "wide_spall", "component": "test_bearing", "params": WIDE}
    starts = CAUSES["oil_film"].starts(context_of(oiled, (bare,)))
    assert starts
    spall = (CAUSES["wide_spall"], {"component": "test_bearing", **WIDE})
    film = [(CAUSES["oil_film"], start) for start in starts]
    shallow = (CAUSES["wide_spall"], {**spall[1], "depth_m": 5e-6})
    models = {
        "bare": [spall],
        **{f"film {start['viscosity_pa_s']}": [spall, (cause, start)] for cause, start in film},
        "shallower": [shallow],
        "no spall": [],
    }
    scores = score_stated(oiled, models, seconds=2.0)
    errors = {name: one.value for name, one in scores.overall.models.items()}
    assert min(errors, key=lambda name: errors[name]) == f"film {FILM_PA_S}", errors
    assert scores.closed("bare", f"film {FILM_PA_S}") > 0.8


# Casing resonances at 2 to 4 kHz that the model of 34 degrees of freedom has not ---------------------------

RESONANCES = (("b3_y", 2200.0, 2.0, 0.03), ("b1_y", 2900.0, 3.0, 0.03))
# Between its lines the model has nothing: with more noise than this the second one is not seen beside it.
QUIET = {"noise_density": "1e-4 m/s^2/Hz^0.5"}


@pytest.fixture(scope="module")
def cased() -> Case:
    """The parallel rig with two resonances of its casing."""
    entries = [
        {"site": site, "mass": f"{mass} kg", "frequency": f"{hz} Hz", "damping_ratio": damping}
        for site, hz, mass, damping in RESONANCES
    ]
    content = {
        "machine": "unsw_parallel",
        "model": "lpm34",
        "sample_rate": "25600 Hz",
        "operating_point": {"speed": "10 Hz", "load": "50 N*m"},
        "sensors": {
            "accelerometers": {"chain": "ideal", "all": QUIET, "channels": ["b1_y", "b3_y"]},
            "encoders": {"shafts": []},
        },
        "parameters": {"mesh.mean_stiffness": "3.25e8 N/m"},
        "structure": {"resonances": entries},
    }
    return case_of("unsw_parallel", "lpm34", record_of(content, 4.5))


def test_missing_casing_resonances_are_named_and_close_the_gap(cased):
    seen = context_of(cased, noise=QUIET)
    cause = CAUSES["casing_resonance"]
    starts = cause.starts(seen)
    found = []
    for site, hz, _, _ in RESONANCES:
        near = [s for s in starts if s["component"] == site and abs(s["frequency_hz"] / hz - 1) < 0.05]
        assert near, (site, starts)
        found.append((cause, near[0]))
    # What else could lift a band there is offered for neither.
    assert not CAUSES["coloured_floor"].starts(seen)
    scores = score_stated(cased, {"nominal": [], "one": found[:1], "both": found}, seconds=3.0)
    errors = {name: one.value for name, one in scores.by_domain["psd"].models.items()}
    assert errors["both"] < errors["one"] < errors["nominal"]
    assert scores.closed("nominal", "both", "psd") > 0.5


# Lines at half the mesh order that only the thesis's simulation has ----------------------------------------

PLANETARY = {
    "machine": "unsw_planetary",
    "model": "planetary18",
    "sample_rate": "8192 Hz",
    "operating_point": {"speed": "2.1333333 Hz", "load": "46.875 N*m"},
    "sensors": {**NOISE, "encoders": {"shafts": []}},
    "parameters": {"gear_errors.runout": "5 um"},
}
HALF_MESH = 40.0


@pytest.fixture
def told_over_the_carrier(monkeypatch):
    """The sun's errors over the carrier's turn, as the thesis prints them."""
    right = planet_plant.make_meshes

    def wrong(params, geometry, seed, tracks, interfaces):
        tracks = {**tracks, "sun_on_carrier": tracks["ring_on_carrier"]}
        return right(params, geometry, seed, tracks, interfaces)

    monkeypatch.setattr(planet_plant, "make_meshes", wrong)


@pytest.fixture(scope="module")
def planetary() -> Record:
    """The sensor on the carrier, which turns with the planets: lines have no sidebands there."""
    sensors = {
        "accelerometers": {**NOISE["accelerometers"], "channels": ["carrier"]},
        "encoders": {"shafts": []},
    }
    return record_of({**PLANETARY, "sample_rate": "4096 Hz", "sensors": sensors}, 12.0)


def half_mesh_excess_db(measured: Record) -> float:
    """Model over record at half the mesh order, on the carrier."""
    case = case_of("unsw_planetary", "planetary18", measured)
    with Simulator(case) as simulator:
        view = simulator.measured[0]
        content = {**scenario_content(case, view), "parameters": PLANETARY["parameters"]}
        (model,) = simulator.views({0: content})
    plan = make_plan(case, [view, model])
    one, other = features(view, plan), features(model, plan)
    (at,) = (
        k for k, place in enumerate(one.places) if place.kind == "half" and abs(place.at - HALF_MESH) < 1e-6
    )
    return float(other.level_db[at] - one.level_db[at])


def test_half_mesh_orders_of_the_model_stand_out(planetary, told_over_the_carrier):  # noqa: ARG001
    # 20 dB below the lines of the mesh, and more than 30 dB over the noise of the record's sensor.
    assert half_mesh_excess_db(planetary) > 20.0


def test_half_mesh_orders_vanish_with_the_suns_own_turns(planetary):
    assert half_mesh_excess_db(planetary) < 3.0


# The sun's path through the casing that the planetary model has not ----------------------------------------


def test_a_missing_path_of_the_sun_is_asked_for_and_mends_its_seat():
    joined = {**PLANETARY, "parameters": {**PLANETARY["parameters"], "casing.included": 1}}
    case = case_of("unsw_planetary", "planetary18", record_of(joined, 6.0))
    cause = CAUSES["transfer_path"]
    starts = [start for start in cause.starts(context_of(case)) if start["component"] == "casing"]
    assert starts
    scores = score_stated(case, {"nominal": [], "casing": [(cause, starts[0])]}, seconds=3.0)
    assert scores.closed("nominal", "casing", "psd") > 0.3
