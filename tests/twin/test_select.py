"""Causes found in a rig of closed forms: named, left alone, told apart, with intervals that cover.

Over other seeds than these: of no effect none of 260 cases got a name; of effects of some 3 dB 191 of 208
were named first and none by a wrong name, with 94 % of 217 intervals covering; of 40 pairs both were named in
27; of 40 effects outside the library none got a name. The seeds here are fixed: no bound fails by chance.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from toy_rig import CAUSES, NAMES, TUNING, context_of, effect, solve, toy_case, yard_of

from gearsim_twin import needed as needed_module
from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.choices import Candidate, Choice, Round
from gearsim_twin.fit import fit_tuning
from gearsim_twin.holdout import Gain
from gearsim_twin.intervals import numbers_of
from gearsim_twin.model import Model
from gearsim_twin.rivals import alternatives, rejected
from gearsim_twin.select import select
from gearsim_twin.settings import Settings


@pytest.fixture(scope="module")
def singles():
    """A medium effect of each kind, and what was found."""
    found = []
    for seed, name in enumerate(NAMES):
        one = effect(np.random.default_rng(40 + seed), name, 1.4)
        found.append((one, solve(toy_case(40 + seed, [one]))))
    return found


def names(selection):
    return [choice.key[0] for choice in selection.choices]


def test_single_effects_are_named_first_and_alone(singles):
    right = [names(selection) == [one["name"]] for one, selection in singles]
    assert sum(right) >= len(right) - 1


def test_intervals_cover_and_values_are_near(singles):
    inside, total = 0, 0
    for one, selection in singles:
        for k, choice in enumerate(selection.choices):
            if choice.key[0] != one["name"]:
                continue
            for number in numbers_of(selection.final, k):
                truth = one["values"][number.name]
                inside += number.ci95[0] <= truth <= number.ci95[1]
                total += 1
                assert number.ci95[0] < number.value < number.ci95[1]
                assert number.value == pytest.approx(truth, rel=0.5)
    assert total >= 7
    assert inside >= total - 3


def test_what_was_taken_predicts_held_out_records_better(singles):
    for _, selection in singles:
        for choice in selection.choices:
            assert choice.gain.gain_db > 0
            assert choice.gain.ci95_nats[0] > 0
            assert choice.gain.ci95_db[0] < choice.gain.gain_db < choice.gain.ci95_db[1]
            assert choice.probability > 0.5


def test_nothing_is_named_where_nothing_is_wrong():
    assert [names(solve(toy_case(seed, []))) for seed in range(8)] == [[]] * 8


@pytest.mark.parametrize("outside", ["whirl", "hum"])
def test_effects_outside_the_library_get_no_wrong_name(outside):
    for seed in (60, 61):
        case = toy_case(seed, [{"name": outside, "values": {"size": 1.0}}])
        assert names(solve(case)) == []


def test_two_effects_are_both_found_though_they_hide_each_other():
    rng = np.random.default_rng(7)
    pairs = [("outer", "runout"), ("resonance", "floor"), ("slip", "inner")]
    both = 0
    for seed, pair in enumerate(pairs):
        effects = [effect(rng, name, 1.4) for name in pair]
        both += set(names(solve(toy_case(80 + seed, effects)))) == set(pair)
    assert both >= 2


def test_the_same_seed_gives_the_same_findings():
    one = effect(np.random.default_rng(1), "outer", 1.0)
    twice = [solve(toy_case(5, [one])) for _ in range(2)]
    first, second = ([numbers_of(s.final, k) for k in range(len(s.choices))] for s in twice)
    assert first == second


def test_everything_that_lost_has_a_reason(singles):
    _, selection = singles[0]
    lost = rejected(selection, set())
    assert {each.name for each in lost} == set(NAMES) - set(names(selection))
    assert all(each.why for each in lost)
    json.dumps([each.why for each in lost])


class Copy:
    """A cause that shows exactly what another one shows."""

    def __init__(self, original):
        self.original, self.name = original, "copy"
        self.parameters, self.confused_with = original.parameters, (("outer", "a second load"),)

    def __getattr__(self, name):
        return getattr(self.original, name)


def test_causes_that_cannot_be_told_apart_are_both_told_with_what_would_decide():
    one = effect(np.random.default_rng(9), "outer", 1.5)
    selection = solve(toy_case(9, [one]), causes=(*CAUSES, Copy(CAUSES[0])))
    (choice,) = selection.choices
    (other,) = alternatives(choice, selection)
    assert {choice.key[0], other.name} == {"outer", "copy"}
    assert choice.probability == pytest.approx(0.5, abs=0.05)
    assert other.probability == pytest.approx(0.5, abs=0.05)
    assert "a second load would decide" in other.signature


class Named:
    """A cause that is one of several names of a thing."""

    def __init__(self, original, thing):
        self.original, self._thing = original, thing
        self.confused_with = getattr(original, "confused_with", ())

    def __getattr__(self, name):
        return getattr(self.original, name)

    def thing(self, values):  # noqa: ARG002
        return self._thing


@pytest.mark.parametrize(("things", "sure"), [(("a race", "a race"), True), (("a race", "a cage"), False)])
def test_two_names_of_one_thing_share_its_probability_and_leave_the_thing_sure(things, sure):
    """Half for each name; all for the thing, if it is one."""
    one = effect(np.random.default_rng(9), "outer", 1.5)
    causes = (Named(CAUSES[0], things[0]), *CAUSES[1:], Named(Copy(CAUSES[0]), things[1]))
    selection = solve(toy_case(9, [one]), causes=causes)
    (choice,) = selection.choices
    (other,) = alternatives(choice, selection)
    assert choice.probability == pytest.approx(0.5, abs=0.05)
    assert choice.thing_probability == pytest.approx(0.99 if sure else choice.probability, abs=0.02)
    assert (other.thing == "a race") is sure


def test_a_probability_counts_what_all_records_say():
    """The rival leads by 1 nat in training and falls back by 4 on held-out records: odds of e^3, not e^-1."""
    own, rival = (_candidate(name, lead, held) for name, lead, held in (("a", 9.0, 6.0), ("b", 10.0, 2.0)))
    choice = Choice(Round((rival, own), (), 1), own)
    found = needed_module._judged(choice, [choice], 9.0)
    assert found.probability == pytest.approx(1 / (1 + math.exp(-3) + math.exp(-9)), rel=1e-9)


def _candidate(name, lead, held):
    extension = SimpleNamespace(cause=SimpleNamespace(name=name), key=(name, ""), values={})
    fitted = SimpleNamespace(trial=SimpleNamespace(model=SimpleNamespace(extensions=(extension,))))
    return Candidate(fitted, lead, gain=Gain("psd", 1.0, (0.5, 1.5), held, (held - 1.0, held + 1.0)))


def test_freedom_costs():
    """A wider prior makes the same fit less convincing, by the logarithm of its width."""
    one = effect(np.random.default_rng(11), "outer", 1.0)
    leads = []
    for factor in (2.5, 2.5**3):
        wide = tuple(replace(p, prior=LogNormal(1.0, factor, 1e-4, 1e4)) for p in CAUSES[0].parameters)
        cause = Copy(CAUSES[0])
        cause.parameters, cause.confused_with = wide, ()
        found = solve(toy_case(11, [one]), causes=(cause,))
        leads.append(found.rounds[0].candidates[0].lead_nats)
    assert leads[0] - leads[1] == pytest.approx(np.log(3.0), abs=0.4)


def test_no_more_causes_than_allowed():
    rng = np.random.default_rng(12)
    case = toy_case(12, [effect(rng, name, 2.0) for name in ("outer", "runout", "floor")])
    assert len(solve(case, Settings(most_causes=1)).choices) == 1


def test_what_no_simulation_is_left_for_is_told():
    """With a few simulations only the first guesses of the first causes are tried; the others are named."""
    bench = toy_case(13, [])  # what is chosen is fitted to the end, which has simulations of its own
    found = solve(bench, Settings(most_simulations=10), causes=(*CAUSES, *more_of("outer", 8)))
    untried = found.rounds[0].untried
    assert untried
    reasons = {each.name: each.why for each in rejected(found, set())}
    assert all("not tried" in reasons[name] for name in untried)
    tuning = toy_case(13, [])
    fit_tuning(tuning, yard_of(tuning), Model(TUNING, TUNING.nominal))
    # What is begun is ended: the last eight guesses (of two records) and no fit.
    assert bench.simulations - tuning.simulations <= 10 + 2 * 8 + 2


def more_of(name, count):
    """Causes of other names that show what one shows."""
    copies = []
    for k in range(count):
        copies.append(Copy(CAUSES[NAMES.index(name)]))
        copies[-1].name = f"copy {k}"
    return copies


def test_no_further_cause_is_looked_for_where_nothing_is_left():
    one = effect(np.random.default_rng(14), "outer", 1.4)
    bench = toy_case(14, [one])
    yard = yard_of(bench)
    tuned = fit_tuning(bench, yard, Model(TUNING, TUNING.nominal))
    asked = []

    def content(context):
        asked.append(context)
        return True

    found = select(bench, yard, tuned, CAUSES, context_of(bench), Settings(), content=content)
    assert (names(found), len(found.rounds), len(asked)) == (["outer"], 1, 1)
