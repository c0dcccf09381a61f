"""Pacing with a clock in the test's hand."""

import math

import pytest

from gearsim_io.health import Level
from gearsim_sim.outbox import Outbox
from gearsim_sim.pacing import Pacer, PaceReport, StartGate, pace_status

RATE = 65536.0
BATCH = 4096


class Rig:
    """A machine that needs `cost` seconds per batch, a clock, and the loop of the node."""

    def __init__(self, factor=1.0, cost=0.004, start=1000.0, **kwargs):
        self.now = start
        self.cost = cost
        self.pacer = Pacer(RATE, factor, **kwargs)
        self.pacer.start(self.now)

    def turn(self):
        due = self.pacer.due(self.now, BATCH)
        if due:
            self.now += self.cost * due / BATCH
            self.pacer.add(due, self.now)
        return due

    def run(self, seconds, tick=0.01):
        end = self.now + seconds
        while self.now < end - 1e-9:
            if not self.turn():
                self.now = min(end, self.now + tick)
        for _ in range(64):  # what is due just now; a machine too slow never gets there
            if not self.turn():
                break


def test_count_is_exact_at_any_time():
    rig = Rig(cost=0.0)
    for seconds in (0.001, 0.7, 12.3456, 3600.0):
        rig.run(seconds)
        elapsed = rig.now - 1000.0
        assert rig.pacer.made == math.floor(elapsed * RATE + 1e-6)


def test_a_stall_of_200_ms_costs_no_sample():
    rig = Rig(cost=0.004)
    rig.run(1.0)
    before = rig.pacer.made
    rig.now += 0.2
    assert before + rig.pacer.due(rig.now, 10**9) == math.floor((rig.now - 1000.0) * RATE + 1e-6)
    rig.run(0.5)
    assert rig.pacer.made + rig.pacer.due(rig.now, 10**9) == math.floor((rig.now - 1000.0) * RATE + 1e-6)
    report = rig.pacer.report(rig.now)
    assert report.keeping_up
    assert report.slipped_s == 0
    assert report.lag_s < 0.01


def test_a_stall_shows_as_lag_and_is_caught_up():
    rig = Rig(cost=0.004)
    rig.run(1.0)
    rig.now += 0.7
    report = rig.pacer.report(rig.now)
    assert report.lag_s == pytest.approx(0.7, abs=0.01)
    assert not report.keeping_up
    rig.run(0.3)
    assert rig.pacer.report(rig.now).keeping_up


def test_a_machine_too_slow_falls_behind_in_simulated_time():
    rig = Rig(cost=2 * BATCH / RATE)  # needs two seconds for one
    rig.run(20.0)
    elapsed = rig.now - 1000.0
    report = rig.pacer.report(rig.now)
    assert rig.pacer.made == pytest.approx(elapsed / 2 * RATE, rel=0.02)
    assert report.achieved == pytest.approx(0.5, rel=0.05)
    assert not report.keeping_up
    assert report.lag_s <= 2.0 + 2 * BATCH / RATE
    # What it fell behind is what was put back plus what is due: nothing left out, nothing made up.
    assert report.slipped_s + report.lag_s == pytest.approx(elapsed - rig.pacer.made / RATE, abs=1e-3)
    rig.cost = 0.0
    rig.run(0.001)
    rig.run(5.0)
    after = rig.pacer.report(rig.now)
    assert after.keeping_up
    assert after.achieved == pytest.approx(1.0, rel=0.01)
    assert after.slipped_s == pytest.approx(report.slipped_s, abs=0.2)


@pytest.mark.parametrize("factor", [0.1, 0.5, 2.0, 10.0])
def test_rate_factor(factor):
    rig = Rig(factor=factor, cost=0.001)
    rig.run(8.0)
    elapsed = rig.now - 1000.0
    assert rig.pacer.made == pytest.approx(elapsed * factor * RATE, abs=0.01 * factor * RATE + 1)
    assert rig.pacer.report(rig.now).achieved == pytest.approx(factor, rel=0.02)


def test_as_fast_as_it_goes_always_has_work():
    rig = Rig(factor=0.0, cost=0.001)
    assert [rig.turn() for _ in range(100)] == [BATCH] * 100
    assert rig.pacer.report(rig.now).keeping_up
    assert rig.pacer.report(rig.now).lag_s == 0
    rig.run(3.0)
    assert rig.pacer.report(rig.now).achieved == pytest.approx(BATCH / RATE / 0.001, rel=0.02)


def test_change_of_rate_keeps_the_count_continuous():
    rig = Rig(cost=0.0)
    rig.run(2.0)
    rig.pacer.set_factor(0.5, rig.now)
    rig.run(2.0)
    assert rig.pacer.made == pytest.approx(3.0 * RATE, abs=2)
    rig.pacer.set_factor(0.0, rig.now)
    for _ in range(16):
        rig.turn()
    assert rig.pacer.made == pytest.approx(4.0 * RATE, abs=2)
    rig.pacer.set_factor(4.0, rig.now)  # from where it is now, not from a schedule that never was
    assert rig.pacer.due(rig.now, 10**9) == 0
    rig.run(1.0)
    assert rig.pacer.made == pytest.approx(8.0 * RATE, abs=2)


def test_pause():
    rig = Rig(cost=0.0)
    rig.run(1.0)
    rig.pacer.pause(rig.now)
    assert rig.pacer.paused
    assert rig.pacer.seconds_until(10**6, rig.now) == math.inf
    rig.now += 100.0
    assert rig.pacer.due(rig.now, BATCH) == 0
    rig.pacer.set_factor(2.0, rig.now)
    rig.pacer.resume(rig.now)
    assert rig.pacer.due(rig.now, 10**9) <= 1
    rig.run(1.0)
    assert rig.pacer.made == pytest.approx(3.0 * RATE, abs=2)


def test_time_until_a_sample():
    rig = Rig(factor=2.0, cost=0.0)
    assert rig.pacer.seconds_until(BATCH, rig.now) == pytest.approx(BATCH / RATE / 2)
    rig.now += 1.0
    assert rig.pacer.seconds_until(BATCH, rig.now) == 0.0
    rig.now += rig.pacer.seconds_until(3 * 65536, rig.now)
    assert rig.pacer.due(rig.now, 10**9) == 3 * 65536  # woken just then, the sample is due


def test_a_stall_at_ten_times_real_time_is_exact_too():
    rig = Rig(factor=10.0, cost=0.0)
    rig.run(1.0)
    rig.now += 0.2
    assert rig.pacer.made + rig.pacer.due(rig.now, 10**9) == round(12.0 * RATE)


def test_nothing_is_due_before_the_start():
    pacer = Pacer(RATE)
    assert pacer.due(5.0, BATCH) == 0
    pacer.start(7.0)
    pacer.start(99.0)
    assert pacer.due(8.0, 10**9) == 65536


@pytest.mark.parametrize("factor", [-1.0, math.nan, math.inf])
def test_impossible_factor(factor):
    with pytest.raises(ValueError, match="rate factor"):
        Pacer(RATE, factor)
    with pytest.raises(ValueError, match="rate factor"):
        Pacer(RATE).set_factor(factor, 0.0)


def test_the_gate_opens_when_all_have_come_and_nothing_changes():
    gate = StartGate(2, settle_s=0.3)
    assert not gate.is_open((0, 0, 0), 0.0)
    assert not gate.is_open((1, 1, 0), 5.0)
    assert not gate.is_open((1, 1, 0), 9.0)  # one is still missing
    assert not gate.is_open((2, 1, 0), 10.0)
    assert not gate.is_open((2, 2, 0), 10.2)  # the second stream's connection came later
    assert not gate.is_open((2, 2, 0), 10.4)
    assert gate.is_open((2, 2, 0), 10.5)
    assert StartGate(0).is_open((0, 0, 0), 0.0)


def test_status_in_words():
    good = PaceReport(lag_s=0.01, achieved=1.0, wanted=1.0, slipped_s=0.0, keeping_up=True)
    slow = PaceReport(lag_s=2.0, achieved=0.62, wanted=1.0, slipped_s=3.0, keeping_up=False)
    fast = PaceReport(lag_s=0.0, achieved=11.8, wanted=0.0, slipped_s=0.0, keeping_up=True)
    assert pace_status(good, paused=False) == (Level.OK, "1 x real time")
    assert pace_status(good, paused=True) == (Level.OK, "paused")
    assert pace_status(fast, paused=False) == (Level.OK, "as fast as it goes: 11.80 x real time")
    begun = PaceReport(lag_s=0.0, achieved=math.nan, wanted=0.0, slipped_s=0.0, keeping_up=True)
    assert pace_status(begun, paused=False) == (Level.OK, "as fast as it goes")
    level, text = pace_status(slow, paused=False)
    assert level == Level.WARN
    assert text == "cannot keep up: 0.62 x real time in place of 1 x, 5.0 s behind"


class Transport:
    def __init__(self):
        self.got = []
        self.refuse = 0

    def send(self, message):
        if self.refuse > 0:
            self.refuse -= 1
            raise OSError("cannot publish\ndata")
        self.got.append(message)


def test_refused_messages_wait_and_keep_their_order():
    transport, outbox = Transport(), Outbox(OSError, room=3)
    outbox.put(transport.send, 1)
    assert outbox.flush()
    transport.refuse = 2
    for message in (2, 3, 4):
        outbox.put(transport.send, message)
    assert not outbox.flush()
    assert outbox.full
    assert (outbox.waiting, outbox.last_refusal) == (3, "cannot publish data")
    assert not outbox.flush()
    assert outbox.flush()
    assert transport.got == [1, 2, 3, 4]
    assert (outbox.sent, outbox.refused, outbox.waiting) == (4, 2, 0)
    outbox.put(lambda _: 1 / 0, 5)
    with pytest.raises(ZeroDivisionError):  # only what the transport refuses is kept for later
        outbox.flush()
