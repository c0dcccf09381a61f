"""The speed that goes with each window of a stream: followed without tacho, doubted with one."""

import numpy as np
import pytest
from bearing_signals import noise, rotating_lines, turns_of
from test_diagnose_angle import RATE, _plate, _record, _signal

from gearsim_dsp.angle.record_speed import record_speed
from gearsim_dsp.streams.assembler import WindowAssembler, WindowSettings
from gearsim_dsp.streams.envelope_monitor import EnvelopeMonitor, EnvelopeSettings
from gearsim_dsp.streams.window_speeds import KnownSpeeds, LiveSpeeds

SETTINGS = WindowSettings(window_s=2.0, hop_s=0.5)


def _windows(record, plate):
    assembler = WindowAssembler(plate, SETTINGS)
    windows = [w for batch in record.batches(8192) for w in assembler.push(batch)]
    return windows + assembler.finish()


def _true_hz(window, turns):
    ends = turns[[window.first_sample, window.end_sample - 1]]
    return float(ends[1] - ends[0]) / (window.sample_count - 1) * RATE


def test_a_changing_speed_is_followed_window_by_window():
    x, turns = _signal(1, [24.5, 25.5], faulty=False)
    speeds = LiveSpeeds(_plate())
    followed = 0
    for window in _windows(_record(x), _plate()):
        speed = speeds.of(window)
        assert not speeds.lost
        if speed.phase is not None:
            followed += 1
            assert speed.source == "estimated"
            assert speed.value_hz == pytest.approx(_true_hz(window, turns), rel=1e-3)
    assert followed >= 6  # of seven: the change shows within the first window already


def test_a_steady_speed_keeps_the_nameplates_axis():
    x, _ = _signal(2, [25.2, 25.2], faulty=False)
    speeds = LiveSpeeds(_plate())
    for window in _windows(_record(x), _plate()):
        speed = speeds.of(window)
        assert (speed.source, speed.phase, speeds.lost) == ("nameplate", None, False)


def test_windows_in_which_a_changing_speed_is_lost_are_not_judged():
    x, _ = _signal(3, [24.5, 25.5], faulty=True)
    rng = np.random.default_rng(9)
    later = noise(rng, round(4 * RATE))
    monitor = EnvelopeMonitor(_plate(), EnvelopeSettings(SETTINGS, kurtogram_every=0))
    record = _record(np.concatenate((x, later)))
    reports = [r for batch in record.batches(8192) for r in monitor.push(batch)] + monitor.finish()
    assert reports[0].judged
    # From 7 s on all of a window is noise: windows from sample 5 s on.
    silent = [r for r in reports if r.first_sample >= 5 * RATE]
    assert silent
    assert not any(r.judged for r in silent)
    assert "speed changes" in silent[0].note


def test_a_tacho_that_counts_double_is_left_in_a_stream_too():
    x, turns = _signal(4, [25.2, 25.2], faulty=False)
    pulses = np.interp(np.arange(1, 2 * turns[-1]) / 2, turns, np.arange(turns.size))
    speeds = LiveSpeeds(_plate(tacho=True))
    window = _windows(_record(x, pulses), _plate(tacho=True))[0]
    assert speeds.of(window).source != "tacho"
    assert [issue.issue for issue in speeds.issues] == ["angle_contradicted"]
    speeds.reset()
    assert speeds.issues == ()


def test_a_sound_tacho_costs_no_search(monkeypatch):
    x, turns = _signal(5, [24.5, 25.5], faulty=False)
    pulses = np.interp(np.arange(1, turns[-1]), turns, np.arange(turns.size))
    plate = _plate(tacho=True)
    monkeypatch.setattr("gearsim_dsp.streams.window_speeds.track_speed", None)
    speeds = LiveSpeeds(plate)
    for window in _windows(_record(x, pulses), plate):
        assert speeds.of(window).source == "tacho"


def test_parts_of_a_known_angle_are_those_of_the_record():
    turns = turns_of(np.array([24.5, 25.5]), 5.0, RATE)
    x = noise(np.random.default_rng(6), turns.size) + rotating_lines(turns, {1: 0.3, 32: 0.8, 64: 0.4})
    found = record_speed(_record(x), _plate())
    known = KnownSpeeds(found.speed, 0)
    window = _windows(_record(x), _plate())[3]
    speed = known.of(window)
    assert speed.value_hz == pytest.approx(_true_hz(window, turns), rel=5e-4)
    at = np.arange(window.sample_count)
    angle = np.interp(at, speed.phase.samples, speed.phase.turns)
    whole = np.interp(at + window.first_sample, found.speed.phase.samples, found.speed.phase.turns)
    assert angle == pytest.approx(whole, abs=1e-9)
    low, high = speed.ci95_hz
    assert low < speed.value_hz < high
