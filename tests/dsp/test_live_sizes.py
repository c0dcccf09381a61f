"""Widths of spalls in a stream: measured once in a while, remembered, told in the reason."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from gearsim_dsp.sizing.spall_width import Width
from gearsim_dsp.streams import live_sizes
from gearsim_dsp.streams.live_sizes import LiveSizes, width_words
from gearsim_io.errors import InputError

WIDTH = Width(0.82e-3, (0.71e-3, 0.94e-3), 20, "")
FINDING = SimpleNamespace(component="bearing_3", fault="outer_race", channel="b3")


def window(value=1.0, channels=("b1", "b3")):
    return SimpleNamespace(
        channels=channels, data=np.full((len(channels), 8), value, dtype=np.float32), sample_rate_hz=8.0
    )


@pytest.fixture
def asked(monkeypatch):
    """What `spall_width` was asked, and what it answers, one after the other."""
    calls = SimpleNamespace(count=0, answers=[])

    def spall_width(*_):
        calls.count += 1
        answer = calls.answers.pop(0) if calls.answers else WIDTH
        if isinstance(answer, Exception):
            raise answer
        return answer

    monkeypatch.setattr(live_sizes, "spall_width", spall_width)
    return calls


def test_words():
    assert width_words(WIDTH) == ", about 0.8 mm wide (0.71 to 0.94 mm)"
    assert width_words(None) == ""


def test_it_is_measured_once_in_a_while_and_remembered(asked):
    sizes = LiveSizes(None, every=5)
    told = [sizes.of(window(), FINDING, None) for _ in range(11)]
    assert told == [WIDTH] * 11
    assert asked.count == 3
    sizes.reset()
    sizes.of(window(), FINDING, None)
    assert asked.count == 4


def test_a_window_that_tells_nothing_is_followed_by_another_soon_and_takes_nothing_back(asked):
    asked.answers = [None, WIDTH, InputError("spall_width", "signal", "short", "longer"), WIDTH]
    sizes = LiveSizes(None, every=20)
    told = [sizes.of(window(), FINDING, None) for _ in range(30)]
    assert told == [None] + [WIDTH] * 29
    assert asked.count == 3  # the third one was refused, which takes nothing back


def test_what_cannot_be_told_is_not_asked_for_in_every_window(asked):
    asked.answers = [None] * 100
    sizes = LiveSizes(None, every=64)
    assert not any(sizes.of(window(), FINDING, None) for _ in range(43))
    assert asked.count == 3 + 5


def test_it_can_be_left_out_and_is_where_samples_are_no_numbers(asked):
    assert LiveSizes(None, every=0).of(window(), FINDING, None) is None
    assert LiveSizes(None).of(window(np.nan), FINDING, None) is None
    assert LiveSizes(None).of(window(channels=("b1",)), FINDING, None) is None
    assert asked.count == 0


def test_its_memory_is_bounded(asked):
    sizes = LiveSizes(None)
    for k in range(500):
        sizes.of(window(), SimpleNamespace(component=f"b{k}", fault="outer_race", channel="b3"), None)
    assert len(sizes._known) == 64
    assert asked.count == 64
