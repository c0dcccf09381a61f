"""The timing of a replay, on a clock that the test moves by hand."""

from __future__ import annotations

import threading
import time

import pytest

from gearsim_io.bags import BagMessage
from gearsim_io.playback import Playback, Timeline

SECOND = 1_000_000_000


class Clock:
    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


def test_bag_time_follows_the_clock_at_any_rate():
    clock = Clock()
    timeline = Timeline(clock, rate=2.0)
    assert timeline.now_ns() == 0
    timeline.start(5 * SECOND)
    clock.now += 1.5
    assert timeline.now_ns() == 8 * SECOND
    assert timeline.wait_s(8 * SECOND) == 0.0
    assert timeline.wait_s(10 * SECOND) == pytest.approx(1.0)
    assert timeline.wait_s(1 * SECOND) == 0.0, "what is late is due"


def test_a_change_of_rate_neither_jumps_nor_slips():
    clock = Clock()
    timeline = Timeline(clock, rate=1.0)
    timeline.start(0)
    clock.now += 2.0
    timeline.set_rate(0.5)
    assert timeline.now_ns() == 2 * SECOND
    clock.now += 2.0
    assert timeline.now_ns() == 3 * SECOND
    timeline.set_rate(10.0)
    clock.now += 0.1
    assert timeline.now_ns() == 4 * SECOND


def test_a_pause_stops_bag_time():
    clock = Clock()
    timeline = Timeline(clock, paused=True)
    timeline.start(SECOND)
    clock.now += 60.0
    assert timeline.now_ns() == SECOND
    assert timeline.wait_s(SECOND) == float("inf"), "nothing is sent in a pause, not even what is due"
    timeline.set_paused(False)
    clock.now += 1.0
    assert timeline.now_ns() == 2 * SECOND
    timeline.set_paused(True)
    clock.now += 5.0
    assert timeline.now_ns() == 2 * SECOND


def messages(count=20, step_ns=SECOND // 100):
    return [BagMessage("/t", k * step_ns, bytes([k]), "x/msg/X") for k in range(count)]


def test_everything_is_sent_in_order_at_its_time():
    sent = []
    start = time.monotonic()
    playback = Playback(
        Timeline(time.monotonic),
        lambda: iter(messages()),
        lambda message: sent.append((time.monotonic() - start, message.data)),
    )
    playback.run()
    assert [data for _, data in sent] == [message.data for message in messages()]
    assert all(t >= k * 0.01 for k, (t, _) in enumerate(sent)), "never too early"
    assert playback.loops == 1


def test_a_loop_begins_again_until_it_is_stopped():
    sent = []

    def send(message):
        sent.append(message.data)
        if len(sent) == 50:
            playback.stop()

    playback = Playback(Timeline(time.monotonic, rate=100.0), lambda: iter(messages()), send, loop=True)
    playback.run()
    expected = [message.data for message in messages()] * 3
    assert sent == expected[:50]


def test_stop_and_pause_take_effect_while_it_waits():
    sent = []
    timeline = Timeline(time.monotonic)
    late = [*messages(3), BagMessage("/t", 3600 * SECOND, b"late", "x/msg/X")]
    playback = Playback(timeline, lambda: iter(late), lambda message: sent.append(message.data))
    thread = threading.Thread(target=playback.run)
    thread.start()
    deadline = time.monotonic() + 10.0
    while len(sent) < 3 and time.monotonic() < deadline:
        time.sleep(0.01)
    timeline.set_rate(100.0)
    timeline.set_paused(True)
    playback.wake()
    playback.stop()
    thread.join(10.0)
    assert not thread.is_alive()
    assert len(sent) == 3
