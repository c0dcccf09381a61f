"""First guesses: one that is far too loud is tried again smaller, where the cause says what its size is."""

from __future__ import annotations

import numpy as np
import pytest
from toy_rig import SIZE, TUNING, ToyCause, context_of, effect, toy_case, yard_of

from gearsim_twin.causes.cause import Parameter
from gearsim_twin.causes.edit import with_entry
from gearsim_twin.causes.prior import Normal
from gearsim_twin.fit import fit_tuning
from gearsim_twin.model import Extension, Model
from gearsim_twin.screen import screen


class Pit(ToyCause):
    """An outer race's spall that brings out everything else, too, once it is wide."""

    def extend(self, content, values, _):
        size = float(values["size"])
        content = with_entry(content, "effects", {"name": "outer", "values": {"size": size}})
        wide = {"name": "pitch", "values": {"size": 20.0 * max(size - 1.5, 0.0)}}
        return with_entry(content, "effects", wide)


class SizedPit(Pit):
    size = "size"


def _screened(cause):
    bench = toy_case(71, [effect(np.random.default_rng(71), "outer", 1.0)])
    yard = yard_of(bench)
    base = fit_tuning(bench, yard, Model(TUNING, TUNING.nominal))
    guess = Extension(cause, {"size": 4.0}, context_of(bench)(base.trial))
    (found,) = screen(bench, yard, base, [(guess, 1)])
    return found


def test_a_guess_that_shows_too_much_is_tried_smaller():
    plain, sized = (_screened(kind("outer", (SIZE,), None)) for kind in (Pit, SizedPit))
    assert plain.extension.values["size"] == 4.0
    assert plain.strength < 1.0
    assert sized.extension.values["size"] < 1.5
    assert sized.nats > plain.nats + 5.0
    assert sized.plain_nats > 0.0
    assert sized.plain_nats == pytest.approx(sized.nats, abs=3.0)


def test_a_size_that_may_have_either_sign_is_tried_nearer_to_zero():
    signed = Parameter("size", "1", Normal(0.0, 8.0), step=0.1)
    found = _screened(SizedPit("outer", (signed,), None))
    # Half a standard deviation less would be zero, and more of it the opposite of what was seen.
    assert 0.3 < found.extension.values["size"] < 1.7
    assert found.plain_nats > 0.0


def test_the_search_for_a_size_costs_three_simulations_of_a_record():
    bench = toy_case(72, [effect(np.random.default_rng(72), "outer", 1.0)])
    yard = yard_of(bench)
    base = fit_tuning(bench, yard, Model(TUNING, TUNING.nominal))
    before = bench.simulations
    guess = Extension(SizedPit("outer", (SIZE,), None), {"size": 4.0}, context_of(bench)(base.trial))
    screen(bench, yard, base, [(guess, 1)])
    assert bench.simulations - before == 4 * len(bench.training)
