"""Rigs whose structure the model has not: a gain of any size, and lines that prove themselves."""

from types import SimpleNamespace

import numpy as np
import pytest

from gearsim_io.record import Record
from gearsim_twin.causes import bearing_signs, spalls
from gearsim_twin.choices import Candidate
from gearsim_twin.compare.features import Features
from gearsim_twin.compare.levels import Levels
from gearsim_twin.compare.nuisances import Limits, apply, fit_nuisance
from gearsim_twin.compare.places import Place
from gearsim_twin.measuring_chain import measuring_chain
from gearsim_twin.view import View

RATE_HZ = 20e3


def _levels(bands_db, lines_db):
    hz = np.concatenate(
        (np.geomspace(100.0, 9000.0, bands_db.size), np.linspace(150.0, 3000.0, lines_db.size))
    )
    places = [Place("psd", "accel", "band", at, "Hz", 0.1 * at) for at in hz[: bands_db.size].tolist()]
    places += [Place("orders", "accel", "line", at / 25, "order", 0.1) for at in hz[bands_db.size :].tolist()]
    level, std = np.concatenate((bands_db, lines_db)), np.full(hz.size, 0.3)
    return Features(tuple(places), Levels.of(level, std, frequency_hz=hz, bandwidth_hz=np.ones(hz.size)))


def test_a_gain_of_any_size_does_not_leave_the_chain_where_it_is_too_loud():
    """Lines that a gain of 0 dB meets, in noise that the model has 40 dB too loud: bands outnumber lines."""
    x = np.linspace(0.0, 1.0, 42)
    measured = _levels(np.full(42, -80.0), np.full(16, -60.0))
    loud = _levels(-80.0 + np.where(x < 0.6, 40.0 - 10.0 * x, 5.0 - 20.0 * x), np.full(16, -60.0))
    chain = fit_nuisance(measured, loud, Limits(gain_std_db=30.0))
    left = (apply(chain, loud).level_db - measured.level_db)[:42]
    assert np.sqrt(np.mean(left**2)) < 2.0


def test_an_unknown_unit_leaves_the_gain_open():
    """Volts, g and counts lie 20 to 80 dB apart: one standard deviation holds the smaller of these."""
    plan = SimpleNamespace(frame=SimpleNamespace(channels=("accel",), top_hz=1e4))
    gains = [
        next(one.std_db for one in measuring_chain(plan, known).assumed if one.kind == "gain")
        for known in (True, False)
    ]
    assert gains[0] == 1.0
    assert gains[1] >= 20.0


def _view(data):
    record = Record(RATE_HZ, ("accel",), "m/s^2", np.asarray(data, dtype=np.float32)[None])
    return View(record, SimpleNamespace(), None)


@pytest.mark.parametrize(
    ("model_size", "gain_db", "quiet"), [(0.05, 0.0, True), (0.05, 20.0, False), (1.0, 0.0, False)]
)
def test_a_model_that_gives_next_to_nothing_in_a_band_lacks_its_lines(model_size, gain_db, quiet):
    """A tenth of the amplitude is where it begins; what lies in other bands is no matter."""
    rng = np.random.default_rng(3)
    t = np.arange(20000) / RATE_HZ
    measured = _view(rng.standard_normal(t.size))
    model = _view(model_size * rng.standard_normal(t.size) + 50.0 * np.sin(2 * np.pi * 300.0 * t))
    finding = SimpleNamespace(evidence={"band_hz": [2000.0, 6000.0]})
    sign = SimpleNamespace(finding=finding, channel="accel")
    assert bearing_signs._is_quiet(model, measured, sign, {"accel": gain_db}) is quiet


def test_lines_that_the_diagnosis_calls_a_fault_twice_prove_more_than_weak_ones(monkeypatch):
    def shown(context, _, *, absent):
        assert absent
        return [
            (0, SimpleNamespace(component="b", found_order=3.24, run=None, is_fault=sure)) for sure in context
        ]

    monkeypatch.setattr(spalls, "candidates", shown)
    monkeypatch.setattr(spalls, "_errs_db", lambda _: 1.0)
    monkeypatch.setattr(spalls, "_is_news", lambda *_: True)
    assert spalls.seen_again("b", "outer_race", [True], [True]) == spalls.FAULT_NATS
    for pair in (([True], [False]), ([False], [True])):
        assert spalls.seen_again("b", "outer_race", *pair) == spalls.REPEATED_NATS
    assert spalls.FAULT_NATS > 2 * spalls.REPEATED_NATS
    assert spalls.seen_again("b", "outer_race", [True], []) == 0.0
    # Of a model whose lines are wrong by more than that weak ones prove nothing.
    monkeypatch.setattr(spalls, "_errs_db", lambda _: 6.0)
    assert spalls.seen_again("b", "outer_race", [True], [True]) == spalls.FAULT_NATS
    assert spalls.seen_again("b", "outer_race", [False], [False]) == 0.0


def test_how_wrong_lines_are_is_told_by_those_that_no_cause_is_asked_about():
    kinds = ["line"] * 4 + ["tone", "passage", "ratio"]
    places = [SimpleNamespace(domain="orders", kind=kind) for kind in kinds]
    places.append(SimpleNamespace(domain="psd", kind="band"))
    difference = np.array([5.0, -6.0, 7.0, -8.0, 40.0, 40.0, 40.0, 40.0])
    one = SimpleNamespace(places=places, difference_db=difference, counted=np.ones(8, dtype=bool))
    assert spalls._errs_db(SimpleNamespace(comparison=(one,))) == pytest.approx(6.5)
    few = SimpleNamespace(places=places[:2], difference_db=difference[:2], counted=np.ones(2, dtype=bool))
    assert spalls._errs_db(SimpleNamespace(comparison=(few,))) == 0.0


def _candidate(name, proof, thing="", confused=()):
    cause = SimpleNamespace(name=name, confused_with=confused, thing=lambda _: thing)
    extension = SimpleNamespace(cause=cause, key=(name, ""), values={})
    model = SimpleNamespace(extensions=(extension,))
    return Candidate(SimpleNamespace(trial=SimpleNamespace(model=model)), 5.0, proof_nats=proof)


def test_what_is_proven_by_itself_stands_beside_others_and_not_in_their_place():
    slip = _candidate("cage_slip", 15.0, confused=(("bearing_geometry", "a second load"),))
    spall = _candidate("bearing_spall_outer", 15.0, "the outer race")
    assert not spall.could_stand_for(slip)
    assert not slip.could_stand_for(spall)
    assert _candidate("bearing_geometry", 15.0).could_stand_for(slip)
    assert slip.could_stand_for(_candidate("bearing_geometry", 15.0))
    assert _candidate("wide_spall", 15.0, "the outer race").could_stand_for(spall)
    assert not _candidate("wide_spall", 15.0, "the inner race").could_stand_for(spall)
    assert _candidate("casing_resonance", 0.0).could_stand_for(spall)  # has only its levels to speak for it
