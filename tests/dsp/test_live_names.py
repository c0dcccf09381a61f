"""What judges make of windows that a baseline has found to be changed."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from gearsim_dsp.streams import live_names
from gearsim_dsp.streams.live_names import LiveNames, looks_like
from gearsim_io.errors import InputError


def finding(component, confidence, fault="gear_tooth_crack"):
    return SimpleNamespace(component=component, confidence=confidence, fault=fault)


WINDOW = SimpleNamespace(
    channels=("a", "b"),
    data=np.array([[1.0, 2.0], [3.0, 3.0]], dtype=np.float32),
    sample_rate_hz=2.0,
    unit="1",
    pulses=(),
)


@pytest.fixture
def asked(monkeypatch):
    seen = []

    def judge_all(measured):
        seen.append(measured)
        if len(seen) == 2:
            raise InputError("x", "signal", "short", "longer")
        return (finding("gears", 0.9),)

    monkeypatch.setattr(live_names, "judge_all", judge_all)
    return seen


def test_the_judges_are_asked_once_in_a_while_and_only_for_sound_channels(asked):
    names = LiveNames(None, every=3)
    told = [len(names.of(WINDOW, None)) for _ in range(7)]
    assert told == [1] * 3 + [0] + [1] * 3  # where nothing is found the next window is looked at
    assert len(asked) == 3
    assert list(asked[0].channels) == ["a"]
    names.reset()
    names.of(WINDOW, None)
    assert len(asked) == 4
    assert LiveNames(None, every=0).of(WINDOW, None) == ()


@pytest.mark.parametrize(
    ("component", "findings", "words"),
    [
        ("gears.pinion", [], ""),
        ("gears.pinion", [finding("other.pinion", 0.9)], ""),
        ("gears.pinion", [finding("gears.gear", 0.9)], ""),
        (
            "gears.pinion or gears.gear",
            [finding("gears", 0.87)],
            "; it looks like gear tooth crack (confidence 0.87)",
        ),
        (
            "gears.pinion",
            [finding("gears.pinion", 0.5), finding("gears", 0.9, "gear_wear")],
            "; it looks like gear wear (confidence 0.90)",
        ),
        ("input", [finding("input", 0.7, "unbalance")], "; it looks like unbalance (confidence 0.70)"),
    ],
)
def test_words_come_from_the_surest_finding_on_the_same_component(component, findings, words):
    assert looks_like(component, tuple(findings)) == words
