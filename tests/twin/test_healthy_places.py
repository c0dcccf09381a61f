"""A closed-form rig whose model errs by several decibels everywhere, with and without healthy records."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from toy_rig import (
    AT,
    LOADS,
    PLACES,
    SAMPLING_DB,
    TUNING,
    NoNuisance,
    ToyCause,
    levels,
    model_error,
    solve,
    yard_of,
)
from toy_rig import CAUSES as TOYS

from gearsim_twin.calibrate import Prior, settled_on
from gearsim_twin.causes import spalls
from gearsim_twin.compare.features import Features
from gearsim_twin.compare.levels import Levels
from gearsim_twin.compare.places import Place
from gearsim_twin.had_before import had_before
from gearsim_twin.model import Extension, Model
from gearsim_twin.taught import Taught
from gearsim_twin.workbench import Workbench

ERROR_DB, REPEAT_DB = 3.0, 0.2
FULL = tuple(Place(p.domain, p.channel, p.kind, p.at, p.unit, p.width, "line") for p in PLACES)
LOOKED_FOR = tuple(cause for cause in TOYS if cause.name in ("outer", "inner", "runout", "pitch"))


def shown(level_db, std_db=SAMPLING_DB):
    n = len(FULL)
    made = Levels.of(level_db, np.full(n, std_db), frequency_hz=np.full(n, 1e3), bandwidth_hz=np.full(n, 1.0))
    return Features(FULL, made, 10.0)


def bench_of(seed, effects, healthy=True, other=False, had=()):
    """Records under two loads, two of them held out, and two healthy ones of this (or of another) machine."""
    rng = np.random.default_rng([seed, 9])
    scatter = ERROR_DB * rng.standard_normal(AT.size)
    before = ERROR_DB * rng.standard_normal(AT.size) if other else scatter

    def record(load, wrong, found):
        run = REPEAT_DB * rng.standard_normal(AT.size) + SAMPLING_DB * rng.standard_normal(AT.size)
        return shown(levels({"load": load, "effects": found}) + wrong + run)

    measured = tuple(record(LOADS[k % 2], scatter + model_error(rng, 0.0), effects) for k in range(4))
    conditions = tuple((10.0, LOADS[k % 2], 0.0) for k in range(4))
    tau = {place.domain: ERROR_DB for place in PLACES}
    known = Taught(
        tuple(record(load, before, had) for load in LOADS),
        tuple(shown(levels({"load": load}), 0.1) for load in LOADS),
        conditions[:2],
        tau,
        None,
    )

    def run(jobs):
        return [shown(levels(content), 0.1) for _, content in jobs]

    nominal = tuple({"load": LOADS[k % 2]} for k in range(4))
    taught = known if healthy else None
    return Workbench(measured, nominal, (0, 1), run, NoNuisance(), taught=taught, conditions=conditions)


def found(bench):
    return [choice.key[0] for choice in solve(bench, causes=LOOKED_FOR).choices]


def test_a_small_effect_stands_out_of_its_own_machine_and_not_among_all():
    effect = {"name": "runout", "values": {"size": 0.5}}
    with_them = [found(bench_of(seed, (effect,))) for seed in (1, 2, 3)]
    without = [found(bench_of(seed, (effect,), healthy=False)) for seed in (1, 2, 3)]
    assert with_them == [["runout"]] * 3
    assert not any(without)


def test_a_machine_as_it_was_is_as_it_was():
    assert not any(found(bench_of(seed, ())) for seed in (11, 12, 13))


def test_an_effect_that_was_there_before_is_no_news():
    """The healthy records have it too: what they show is what the others are expected to show."""
    effect = ({"name": "runout", "values": {"size": 2.0}},)
    bench = bench_of(5, effect, had=effect)
    (trial,) = bench.trials([Model(TUNING, TUNING.nominal)])
    z = (bench.measured[0].level_db - trial.features[0].level_db) / np.hypot(SAMPLING_DB, SAMPLING_DB)
    assert np.sqrt(np.mean(z**2)) < 1.3
    (alone,) = bench.by_models_alone().trials([Model(TUNING, TUNING.nominal)])
    away = bench.measured[0].level_db - alone.features[0].level_db
    assert np.std(away) > 0.8 * ERROR_DB


def test_healthy_records_of_another_machine_are_found_out():
    prior = Prior(TUNING, {place.domain: 0.3 for place in PLACES})
    kept, said = settled_on(bench_of(7, ()), prior)
    assert kept.taught is not None
    assert not said
    left, said = settled_on(bench_of(7, (), other=True), prior)
    assert left.taught is None
    assert "another machine" in said[0]


def test_healthy_records_of_another_speed_teach_no_places():
    bench = bench_of(7, ())
    bench.conditions = tuple((12.0, load, force) for _, load, force in bench.conditions)
    left, said = settled_on(bench, Prior(TUNING, {}))
    assert left.taught is None
    assert "speed and load" in said[0]


def test_what_scales_scales_what_the_machine_has():
    """A cause that halves all that is there, on top of one that adds."""

    class Half(ToyCause):
        scales = True

        def extend(self, content, *_):
            return {**content, "halved": True}

    bench = bench_of(3, ())
    run = bench.run

    def halved(jobs):
        plain = run(jobs)
        factors = [-3.0 if content.get("halved") else 0.0 for _, content in jobs]
        return [
            replace(each, levels=replace(each.levels, level_db=each.level_db + factor))
            for each, factor in zip(plain, factors, strict=True)
        ]

    bench.run = halved
    runout = next(cause for cause in TOYS if cause.name == "runout")
    model = Model(TUNING, TUNING.nominal)
    with_one = model.extended(Extension(runout, {"size": 1.0}, None))
    with_both = with_one.extended(Extension(Half("half", (), lambda _: []), {}, None))
    one, both = (trial.features[0].level_db for trial in bench.trials([with_one, with_both]))
    assert np.allclose(both, one - 3.0)


def test_the_measure_of_a_bench_with_healthy_records_is_sharp_where_they_are():
    bench = bench_of(3, ())
    (trial,) = bench.trials([Model(TUNING, TUNING.nominal)])
    yard = yard_of(bench)
    noise = yard.noise(yard.residual(trial.levels), trial.levels)
    told = yard.stack.part(bench.training)
    assert np.max(np.sqrt(yard.missed(trial.levels, noise)[told])) < 0.8


def test_faults_of_healthy_records_are_told(monkeypatch):
    signs = {
        "sound": [],
        "bad": [SimpleNamespace(fault="outer_race", component="bearing_3", is_fault=True)],
        "faint": [SimpleNamespace(fault="inner_race", component="bearing_3", is_fault=False)],
    }
    monkeypatch.setattr("gearsim_twin.had_before.signs_of", lambda view: signs[view.record.source])
    views = [SimpleNamespace(record=SimpleNamespace(source=name)) for name in signs]
    (said,) = had_before(views)
    assert said.startswith("bad, said to be healthy")
    assert "outer race of bearing_3" in said


@pytest.mark.parametrize(("z", "nats"), [(1.0, 0.0), (9.0, spalls.FAULT_NATS)])
def test_lines_that_healthy_records_have_prove_nothing(monkeypatch, z: float, nats: float):
    sign = SimpleNamespace(component="bearing_3", is_fault=True, run=None, found_order=3.2)
    monkeypatch.setattr(spalls, "candidates", lambda *_, **__: [(0, sign)])
    monkeypatch.setattr(spalls, "_errs_db", lambda _: 0.0)
    line = SimpleNamespace(place=SimpleNamespace(label="2 x BPFO of bearing_3"), z=z)
    looked_at = SimpleNamespace(healthy_views=(None,), differences=lambda _: (line,))
    assert spalls.seen_again("bearing_3", "outer_race", looked_at, looked_at) == nats
