"""What is found again in held-out records is proven, and a gain that no sensor has is a difference."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from gearsim_twin.causes import CAUSES
from gearsim_twin.causes.cause import Parameter
from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.causes.speed_fluctuation import course_of
from gearsim_twin.chain_doubts import chain_doubts
from gearsim_twin.model import Extension
from gearsim_twin.proof import REPEATED_NATS, proof_nats, with_proofs
from gearsim_twin.stack import Assumed
from tests.twin.chain_cases import context, healthy, record


class Hum:
    """Reads an amplitude off whatever it is shown."""

    name = "mains_interference"
    parameters = (Parameter("size", "1", LogNormal(1.0, 3.0)),)
    confused_with = ()
    proven = True

    def __init__(self, proven=True):
        self.proven = proven

    def applies(self, _):
        return True

    def starts(self, context):
        return [{"size": size, "std:size": 0.01} for size in context]


def read(size=1.0, proven=True):
    return Extension(Hum(proven), {"size": size, "std:size": 0.01}, None)


def test_what_is_found_again_alike_is_proven_and_its_reading_costs_nothing():
    extension = read()
    assert extension.reading_nats > 1.0
    assert proof_nats(extension, [1.02]) == pytest.approx(REPEATED_NATS + extension.reading_nats)
    assert proof_nats(extension, [5.0, 1.2]) > 0.0


@pytest.mark.parametrize("again", [[], [2.0], [0.4]])
def test_what_is_not_found_again_or_otherwise_is_not(again):
    assert proof_nats(read(), again) == 0.0


def test_only_causes_with_a_false_alarm_rate_of_their_own_can_be_proven():
    assert proof_nats(read(proven=False), [1.0]) == 0.0
    fitted = Extension(Hum(), {"size": 1.0}, None)
    assert proof_nats(fitted, [1.0]) == 0.0


def test_held_out_records_are_looked_at_only_where_somebody_asks():
    def never():
        raise AssertionError("asked")

    assert with_proofs([read(proven=False)], never) == [0.0]
    assert with_proofs([read(proven=False), read()], lambda: [1.0])[1] > 0.0


def test_a_swing_of_the_speed_is_proven_by_another_record():
    cause = CAUSES["speed_fluctuation"]

    def shown(part, seed):
        time_s = np.arange(0.0, 5.0, 0.04)
        speed_hz = 24.8 * (1 + part * course_of(time_s, 3.0, seed))
        columns = {"time_s": time_s.tolist(), "speed_hz": speed_hz.tolist()}
        point = {"speed": None, "load": "0 N*m"}
        measured = record("bearing", seed, profile={"trace": {"columns": columns}}, operating_point=point)
        return context("bearing", measured)

    (start,) = cause.starts(shown(0.01, 5))
    found = Extension(cause, start, None)
    assert proof_nats(found, shown(0.01, 6)) > REPEATED_NATS
    assert proof_nats(found, shown(0.001, 6)) == 0.0
    assert proof_nats(found, healthy("bearing", 3)) == 0.0


def bench(std_db):
    channels = ("a", "b")
    assumed = [Assumed(c, kind, std_db) for c in channels for kind in ("gain", "top", "colour")]
    return SimpleNamespace(nuisances=SimpleNamespace(assumed=assumed, corrections_db=lambda needs: needs))


def doubts(needs, std_db=1.0):
    return chain_doubts(bench(std_db), SimpleNamespace(nuisance=tuple(needs)))


def test_a_gain_of_forty_decibels_is_no_gain():
    (found,) = doubts([-42.0, 0.0, 0.0, 0.5, 9.0, 9.0])
    assert (found.size_db, found.z, found.domain) == (-42.0, -42.0, "statistics")
    assert "level of all that a shows: measured 42.0 dB below the model" in found.words()


def test_gains_of_sensors_and_of_unknown_units_are():
    assert doubts([2.0, 0.0, 0.0, -2.9, 0.0, 0.0]) == ()
    assert doubts([-42.0, 0.0, 0.0, 0.0, 0.0, 0.0], std_db=10.0) == ()
    assert chain_doubts(bench(1.0), SimpleNamespace(nuisance=None)) == ()


def test_the_worst_comes_first():
    found = doubts([5.0, 0.0, 0.0, -8.0, 0.0, 0.0])
    assert [each.id for each in found] == ["g1", "g2"]
    assert np.allclose([each.z for each in found], [-8.0, 5.0])


def cages(monkeypatch, training, heldout, sure=True):
    """Two contexts whose records tell these deviations of a cage, each known to 0.0002."""
    from gearsim_twin.causes import cage_motion

    def told(context, component):
        motion = cage_motion.CageMotion(0.8, 1e-4, 0.0, 1e-4, sure=sure)
        return [cage_motion.Deviation(0, component, x, 2e-4, motion, 100.0, 0.0) for x in context]

    monkeypatch.setattr(cage_motion, "deviations", told)
    return cage_motion.cage_nats(training, heldout, "bearing", lambda _: -1e-3)


def test_lines_out_of_place_again_speak_for_a_cage_by_their_standard_deviations(monkeypatch):
    """log of N(x; -0.001, s) / N(x; 0, s) is 12.5 for x = -0.001, s = 0.0002, and falls as x nears 0."""
    assert cages(monkeypatch, [-7e-4], [-6e-4]) == pytest.approx(5.0 + 2.5)
    assert cages(monkeypatch, [-1e-3], [-4e-4]) == 0.0  # nearer to nothing than to what is stated
    assert cages(monkeypatch, [-1e-3], []) == 0.0
    assert cages(monkeypatch, [-2e-3], [-2e-3]) == 15.0  # however sure, not beyond what errors allow
    # A weak family of lines alone is no proof that they are the bearing's.
    assert cages(monkeypatch, [-2e-3], [-2e-3], sure=False) == REPEATED_NATS


def test_lines_of_a_spall_are_proven_where_both_sets_of_records_have_them_in_one_place(monkeypatch):
    from gearsim_twin.causes import spalls

    def found(orders, _, *, absent):
        assert absent  # not merely hidden by noise
        sign = {"component": "b", "run": None, "is_fault": False}
        return [(0, SimpleNamespace(found_order=order, **sign)) for order in orders]

    monkeypatch.setattr(spalls, "candidates", found)
    monkeypatch.setattr(spalls, "_errs_db", lambda _: 0.0)
    monkeypatch.setattr(spalls, "_is_news", lambda *_: True)
    assert spalls.seen_again("b", "outer_race", [3.24], [3.25]) == REPEATED_NATS
    for training, heldout in (([3.24], []), ([], [3.24]), ([3.24], [3.30])):
        assert spalls.seen_again("b", "outer_race", training, heldout) == 0.0
    assert spalls.seen_again("c", "outer_race", [3.24], [3.24]) == 0.0
