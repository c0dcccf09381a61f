"""Between subscriptions and analysis: bounded queue, stream verdicts, a latched state that stays honest."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest
from rig_stream import RATE_HZ, cut, machine, record

from gearsim_dsp.results import AlarmState
from gearsim_dsp.streams.assembler import WindowAssembler, WindowSettings
from gearsim_dsp.streams.feed import BatchQueue, StateKeeper, StreamStatus, StreamWatch
from gearsim_io.health import Health, Level

SAMPLES, TACHOS = cut(record(seconds=2.0), [512])


class Clock:
    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def lines():
    return []


@pytest.fixture
def watch(clock, lines):
    return StreamWatch(clock, 3.0, lines.append)


def test_queue_keeps_order_and_drops_the_oldest_beyond_its_limit():
    queue = BatchQueue(limit_s=0.5)
    for sample, tacho in zip(SAMPLES, TACHOS, strict=True):
        queue.put(0.0, sample)
        queue.put(0.0, tacho)
    assert queue.seconds <= 0.5 + 512 / RATE_HZ
    kept = []
    while (entry := queue.get(0.0)) is not None:
        kept.append(entry[1])
    assert kept == [b for pair in zip(SAMPLES, TACHOS, strict=True) for b in pair][-len(kept) :]
    assert queue.seconds == pytest.approx(0.0, abs=1e-9)
    assert queue.dropped == 2 * len(SAMPLES) - len(kept)
    assert queue.dropped_samples == 512 * (len(SAMPLES) - sum(b in SAMPLES for b in kept))


def test_queue_knows_what_is_not_analysed_yet():
    queue = BatchQueue(limit_s=0.5)
    for sample in SAMPLES:
        queue.put(0.0, sample)
    assert queue.unfinished == len(SAMPLES) - queue.dropped > 1
    while queue.get(0.0) is not None:
        before = queue.unfinished
        assert before > 0  # taken, but not analysed
        queue.finished()
        assert queue.unfinished == before - 1
    assert queue.unfinished == 0


def test_what_is_not_analysed_yet_is_told(watch):
    queue = BatchQueue(limit_s=100.0)
    for sample in SAMPLES[:3]:
        queue.put(0.0, sample)
    queue.get(0.0)
    values = watch.verdict(StreamStatus.of(None, queue)).values
    assert values["batches not analysed yet"] == 3
    assembler = WindowAssembler(machine(), WindowSettings())
    assert StreamStatus.of(assembler, queue).unfinished_batches == 3


def test_queue_hands_everything_from_one_thread_to_another_and_ends():
    queue = BatchQueue(limit_s=100.0)
    got = []

    def take():
        while (entry := queue.get(5.0)) is not None:
            got.append(entry)

    thread = threading.Thread(target=take)
    thread.start()
    for k, sample in enumerate(SAMPLES):
        queue.put(float(k), sample)
    queue.close()
    thread.join(5.0)
    assert not thread.is_alive()
    assert got == [(float(k), sample) for k, sample in enumerate(SAMPLES)]


def test_silence_becomes_stale_and_samples_mend_it(watch, clock):
    assert watch.verdict(StreamStatus()).level == Level.OK
    clock.now += 3.5
    assert watch.stale
    assert watch.verdict(StreamStatus()).message == "no samples yet for 4 s"
    watch.received(SAMPLES[0])
    assert watch.verdict(StreamStatus()).level == Level.OK
    clock.now += 5
    watch.received(TACHOS[0])
    assert watch.verdict(StreamStatus()).level == Level.STALE
    assert watch.verdict(StreamStatus()).message == "no samples for 5 s"


def test_a_gap_is_told_for_ten_seconds_and_logged_once(watch, clock, lines):
    watch.received(SAMPLES[0])
    gap = StreamStatus(gaps=1, lost_samples=512, last_note="512 samples lost before sample 1024")
    verdict = watch.verdict(gap)
    assert (verdict.level, verdict.message) == (Level.WARN, gap.last_note)
    assert verdict.values["lost samples"] == 512
    clock.now += 9
    watch.received(SAMPLES[1])
    assert watch.verdict(gap).level == Level.WARN
    clock.now += 2
    assert watch.verdict(gap).level == Level.OK
    assert lines == [gap.last_note]


@pytest.mark.parametrize(
    ("status", "words"),
    [
        (StreamStatus(restarts=1, last_note="the stream began again at sample 0"), "began again"),
        (StreamStatus(layout_changes=1, last_note="the source changed unit from a to b"), "unit from a to b"),
        (StreamStatus(dropped_batches=3), "cannot keep up"),
        (StreamStatus(windows_without_angle=1), "without a complete tacho"),
    ],
)
def test_every_break_of_the_stream_is_a_warning_in_words(watch, status, words):
    watch.received(SAMPLES[0])
    verdict = watch.verdict(status)
    assert verdict.level == Level.WARN
    assert words in verdict.message


def test_samples_that_are_not_finite_are_told_by_channel_and_counted(watch, lines):
    data = SAMPLES[3].data.copy()
    data[1, 5] = np.inf
    for _ in range(5):
        watch.received(replace(SAMPLES[3], data=data))
    verdict = watch.verdict(StreamStatus())
    assert verdict.level == Level.WARN
    assert verdict.message == "samples that are not finite on b3 (sample 1536)"
    assert verdict.values["batches not finite"] == 5
    assert len(lines) == 3  # the 1st, 2nd and 4th time


def test_refused_messages_are_told_and_counted(watch, lines):
    watch.refused("accel", "data: got 5 values, expected 2 channels x 3 samples")
    assert watch.verdict(StreamStatus()).values["refused messages"] == 1
    assert lines == ["message on accel refused: data: got 5 values, expected 2 channels x 3 samples"]


def test_what_lasts_is_told_as_long_as_it_lasts_but_logged_once(watch, clock, lines):
    for _ in range(30):
        watch.lasting("type accel", "accel: /x sends a, expected b")
        watch.received(SAMPLES[0])
        clock.now += 1
        assert watch.verdict(StreamStatus()).level == Level.WARN
    clock.now += 10
    watch.received(SAMPLES[0])
    assert watch.verdict(StreamStatus()).level == Level.OK
    assert len(lines) == 1


def test_the_latched_state_says_why_nothing_is_judged_and_recovers():
    keeper = StateKeeper("envelope")
    assert keeper.troubled("", "") is None
    told = keeper.troubled("machine", "no nameplate")
    assert told.stale
    assert told.note == "no nameplate"
    assert keeper.troubled("machine", "no nameplate") is None
    assert keeper.troubled("stale", "no samples for 4 s").note == "no samples for 4 s"
    assert keeper.troubled("stale", "no samples for 5 s") is None
    judged = AlarmState(5, "rig", "envelope", Level.WARN, False, "", 7)
    keeper.judged(judged)
    assert keeper.troubled("", "") is None
    stale = keeper.troubled("stale", "no samples for 4 s")
    assert (stale.stale, stale.level, stale.sample) == (True, Level.WARN, 7)
    assert keeper.troubled("", "") == judged


def test_health_sends_at_once_on_a_change_of_level_and_else_once_a_second(clock):
    sent = []
    health = Health("envelope", "rig", clock, sent.append)
    health.report("stream", Level.OK, "fine", {"rate": 0.5})
    assert [(s.name, s.level, s.values) for s in sent.pop()] == [
        ("envelope: stream", Level.OK, (("rate", "0.5"),))
    ]
    health.report("stream", Level.OK, "still fine")
    assert sent == []
    health.report("stream", Level.STALE, "silent")
    assert [s.level for s in sent.pop()] == [Level.STALE]
    health.report("alarms", Level.OK, "none")
    sent.clear()
    assert health.tick()
    assert [s.name for s in sent.pop()] == ["envelope: stream", "envelope: alarms"]
    clock.now += 0.5
    assert not health.tick()
    clock.now += 5.5
    assert health.tick()
    assert not health.tick()
    assert len(sent) == 1
    assert health.level("stream") == Level.STALE
    assert health.level("unknown") is None
