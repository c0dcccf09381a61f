"""The judge on simulated rigs: from records to a verdict, its JSON, and a model that simulates."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from rig_records import case_of

from gearsim_sim.scenario import load_scenario, parse_scenario
from gearsim_sim.simulation import to_record
from gearsim_twin.causes.cause import Parameter
from gearsim_twin.causes.edit import with_fault
from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.judge import Bench, judge
from gearsim_twin.settings import Settings

WIDTH_M = 8e-4
BASE = {
    "machine": "mfpt",
    "model": "bearing5",
    "sample_rate": "12000 Hz",
    "operating_point": {"speed": "25 Hz", "load": "0 N*m"},
    "sensors": {
        "accelerometers": {"chain": "ideal", "all": {"noise_density": "0.002 m/s^2/Hz^0.5"}},
        "encoders": {"shafts": []},
    },
    "parameters": {"pedestal.stiffness": "9.4e7 N/m", "shaft.mass": "2.05 kg"},
}
FAULT = {"kind": "outer_race_spall", "component": "test_bearing", "params": {"width_m": WIDTH_M}}


class Spall:
    """An outer-race spall, guessed at half its width."""

    name = "bearing_spall_outer"
    parameters = (Parameter("width_m", "m", LogNormal(1e-3, 2.0, 1e-4, 5e-3), 5e-5),)
    confused_with = ()

    def applies(self, _):
        return True

    def starts(self, _):
        return [{"width_m": 0.5 * WIDTH_M, "component": "test_bearing"}]

    def extend(self, content, values, _):
        return with_fault(
            content, "outer_race_spall", str(values["component"]), {"width_m": values["width_m"]}
        )

    def signature(self, values):
        return f"impacts of a spall {1e3 * values['width_m']:.2f} mm wide"


class Impossible(Spall):
    """One that no machine can have: the simulator refuses it."""

    name = "wide_spall"

    def extend(self, content, values, _):
        return with_fault(content, "outer_race_spall", str(values["component"]), {"width_m": 1.0})


def case(*faults, healthy=False, seconds=4.0):
    def record(seed, present):
        content = {**BASE, "seed": seed, "faults": list(present)}
        made = to_record(parse_scenario(content, Path("rig.yaml")), seconds)
        return dataclasses.replace(made, source=f"record {seed}")

    more = {"healthy": (record(9, ()),)} if healthy else {}
    return case_of("mfpt", "bearing5", record(3, faults), **more)


QUICK = Settings(most_causes=1, seeds=2)


@pytest.fixture(scope="module")
def spalled(tmp_path_factory):
    path = tmp_path_factory.mktemp("judge") / "extended.yaml"
    told = []
    return judge(case(FAULT), QUICK, path, told.append, (Spall(), Impossible())), path, told


def test_a_spall_is_named_measured_and_its_gain_told(spalled):
    verdict, _, told = spalled
    found = verdict.causes[0]
    assert (found.name, found.component) == ("bearing_spall_outer", "test_bearing")
    (width,) = found.parameters
    # Its interval is narrow (time from entry to impact); the simulated step of 5 um is what it may be off.
    assert width.value == pytest.approx(WIDTH_M, rel=0.05)
    assert found.heldout_ci95_db[0] > 0
    assert found.probability > 0.95
    assert "fitting bearing_spall_outer" in told


def test_the_held_out_error_falls_by_most_of_the_gap_to_the_noise_floor(spalled):
    verdict, _, _ = spalled
    assert verdict.scores.closed("tuned_only", "extended") > 0.8
    affected = verdict.causes[0].domain
    assert verdict.scores.closed("tuned_only", "extended", affected) > 0.8


def test_discrepancies_say_what_explains_them(spalled):
    verdict, _, _ = spalled
    assert verdict.discrepancies
    explained = [each.explained_by for each in verdict.discrepancies]
    assert explained.count("bearing_spall_outer") > 0.5 * len(explained)
    assert set(explained) <= {"bearing_spall_outer", None}


def test_the_json_is_the_contract(spalled):
    verdict, path, _ = spalled
    content = json.loads(json.dumps(verdict.to_json(), allow_nan=False))
    assert content["verdict"] in ("explained", "partly_explained")
    assert {"metric", "baseline", "tuned_only", "extended", "noise_floor", "heldout"} <= set(content["score"])
    assert {"id", "domain", "where", "size_db", "z", "explained_by"} <= set(content["discrepancies"][0])
    cause = content["causes"][0]
    assert {"name", "parameters", "heldout_gain_db", "probability", "signature"} <= set(cause)
    assert set(cause["parameters"]["width_m"]) == {"value", "unit", "ci95"}
    (lost,) = content["rejected"]
    assert lost["name"] == "wide_spall"
    assert lost["why"]
    assert content["extended_model"] == str(path)


def test_the_extended_model_is_a_scenario_and_says_what_was_fitted(spalled):
    verdict, path, _ = spalled
    scenario = load_scenario(path)
    (fault,) = scenario.faults
    assert fault.params["width_m"] == pytest.approx(verdict.causes[0].parameters[0].value, rel=0.05)
    assert to_record(scenario, 0.2).sample_count == 2400
    comments = [line for line in path.read_text().splitlines() if line.startswith("#")]
    assert any("width_m" in line for line in comments)
    assert any("Tuned" in line for line in comments)


def test_a_healthy_rig_is_consistent():
    verdict = judge(case(), QUICK, causes=(Spall(),))
    assert verdict.word == "consistent"
    assert verdict.causes == ()
    assert "consistent" in verdict.words()
    assert verdict.scores.overall.models["tuned_only"].value < 2.0


def test_without_the_cause_it_says_unknown_and_where():
    verdict = judge(case(FAULT), QUICK, causes=())
    assert verdict.word == "unknown"
    (unknown,) = verdict.causes
    assert unknown.name == "unknown"
    assert "BPFO" in unknown.signature
    assert "has no known cause" in verdict.words()


def test_records_of_the_healthy_machine_sharpen_what_is_known():
    plain = judge(case(FAULT), QUICK, causes=(Spall(),))
    taught = judge(case(FAULT, healthy=True), QUICK, causes=(Spall(),))
    assert taught.causes[0].name == "bearing_spall_outer"
    known = [
        [setting.prior.factor for setting in verdict.selection.tuned.trial.model.tuning.settings]
        for verdict in (plain, taught)
    ]
    assert np.all(np.array(known[1]) <= np.array(known[0]) + 1e-12)
    assert np.any(np.array(known[1]) < np.array(known[0]) - 1e-3)


def test_whoever_listens_may_stop_it():
    def stop(words):
        if words.startswith("tuning"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        judge(case(seconds=2.0), QUICK, tell=stop, causes=())


def test_what_chance_does_is_simulated_once_under_each_condition(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three records for training, two of them at 10 Hz: each seed is run at 10 Hz and at 14 Hz."""
    speeds = (10.0, 14.0, 10.02, 14.01)
    run: list[tuple[int, int]] = []

    def seeded(jobs, _then, _seconds):
        run.extend((record, seed) for record, _, seed in jobs)
        return [record for record, _, _ in jobs]

    bench = Bench(
        case=SimpleNamespace(
            machine=SimpleNamespace(gear_meshes=("mesh",)), training=[SimpleNamespace(seconds=1.0)]
        ),
        simulator=SimpleNamespace(seeded=seeded),
        views=tuple(SimpleNamespace(speed_hz=speed) for speed in speeds),
        nominal=({"operating_point": {"load": {"value": 5.0}}},) * len(speeds),
        plan=None,
        search=None,
        settings=Settings(gear_seeds=2),
    )
    monkeypatch.setattr("gearsim_twin.judge.least_seconds", lambda _: 0.1)
    monkeypatch.setattr("gearsim_twin.judge.realisations_of", tuple)
    known = bench.chance((0, 1, 2, 3), 3, None)
    assert run == [(0, 1), (0, 2), (1, 1), (1, 2)]
    assert known == {0: (0, 0), 1: (1, 1), 2: (0, 0), 3: (1, 1)}
