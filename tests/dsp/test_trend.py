"""Trends: of one indicator over any time, and the monitor that follows and judges all of them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from gearsim_dsp.alarms import AlarmSettings
from gearsim_dsp.results import Features, FeatureValue, Level
from gearsim_dsp.streams.report import AlarmedMonitor
from gearsim_dsp.streams.trend import Slope, TrendHistory
from gearsim_dsp.streams.trend_monitor import TrendMonitor, TrendSettings, hours_to
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine, Shaft

RATE_HZ, HOP_S = 1000.0, 0.5
MACHINE = Machine("rig", "", "input", (Shaft("input", 1.0, 10.0),))
SETTINGS = TrendSettings(learn_s=60.0)


# One indicator


def history(values, step_s=1.0, block_s=4.0):
    found = TrendHistory(block_s)
    for k, value in enumerate(values):
        found.add(k * step_s, value)
    return found


def test_a_ramp_has_its_slope_whatever_the_length():
    for count in (80, 400, 5000, 100_000):
        found = history(2.0 + np.arange(count) / 3600.0 * 5.0)
        assert found.slope().value == pytest.approx(5.0, rel=1e-9)
        assert found.slope().direction == "rising"
        assert found.span_s > 0.9 * (count - 12)
    assert history(-np.arange(400.0)).slope().direction == "falling"


def test_blocks_are_means_and_their_memory_does_not_grow():
    values = np.random.default_rng(1).standard_normal(50_000)
    found = history(values)
    times, means = found.blocks()
    assert times.size == means.size <= TrendHistory.CAPACITY
    per_block = round(found.block_s)
    assert per_block == 4 * 2 ** round(math.log2(per_block / 4))
    whole = values[: means.size * per_block].reshape(-1, per_block).mean(axis=1)
    assert means == pytest.approx(whole, abs=1e-12)
    assert times[0] == pytest.approx((per_block - 1) / 2)
    assert found.nbytes == history(values[:10]).nbytes


def test_noise_has_no_trend_and_knocks_make_none():
    rng = np.random.default_rng(2)
    told = [history(rng.standard_normal(800)).slope().direction for _ in range(300)]
    assert told.count("steady") >= 297  # at 99.9 % none or one is expected
    values = rng.standard_normal(800)
    values[rng.integers(0, 800, 12)] += 500.0
    assert history(values).slope().direction == "steady"


def test_without_enough_it_says_so():
    assert history([1.0] * 20).slope().direction == "unknown"
    assert math.isnan(TrendHistory(1.0).latest)
    assert history([1.0, math.nan, 3.0]).latest == 2.0


def test_time_to_a_limit():
    rising = Slope(2.0, 1.0, 3.0)
    assert hours_to(1.0, 5.0, rising) == pytest.approx(2.0)
    assert hours_to(6.0, 5.0, rising) == 0.0
    assert hours_to(1.0, 5.0, Slope(2.0, -1.0, 3.0)) == math.inf
    assert math.isnan(hours_to(1.0, math.nan, rising))
    assert math.isnan(hours_to(1.0, 5.0, Slope()))


# The monitor


def features(k, rms, kurtosis=3.0, source="kurtosis", channel="b3_y", speed_hz=10.0, **more):
    values = (FeatureValue("rms", "", rms, "m/s^2"), FeatureValue("kurtosis", "", kurtosis, "1"))
    first = round(k * HOP_S * RATE_HZ)
    t0_ns = round(k * HOP_S * 1e9)
    made = Features(
        t0_ns, "rig", source, channel, first, 2000, RATE_HZ, 0.0, 500.0, speed_hz, "tacho", values
    )
    return replace(made, **more)


def healthy(rng):
    return 2.0 * math.exp(0.05 * rng.standard_normal()), 3.0 + 0.1 * rng.standard_normal()


def monitor(settings=SETTINGS, baseline=None, **alarms):
    alarms = {"raise_windows": 8, "of_windows": 10, "clear_windows": 16} | alarms
    return AlarmedMonitor(TrendMonitor(MACHINE, settings, baseline=baseline), AlarmSettings(**alarms))


def run(watch, rows, start=0):
    """`rows` of (rms, kurtosis); the alarms by window."""
    out = []
    for k, (rms, kurtosis) in enumerate(rows, start):
        out.append([a for o in watch.push(features(k, rms, kurtosis)) for a in o.alarms])
    return out


def test_it_learns_for_as_long_as_it_should_and_then_judges():
    rng = np.random.default_rng(3)
    watch = monitor()
    run(watch, [healthy(rng) for _ in range(60)])
    assert watch.present.stale
    assert watch.present.note == "no baseline to judge by: it is being learnt from 60 s"
    run(watch, [healthy(rng) for _ in range(61)], 60)
    assert watch.monitor.keeper.words == "learnt from 60 s"
    assert watch.monitor.keeper.baseline.tests == 2
    assert not any(run(watch, [healthy(rng) for _ in range(400)], 121))
    assert not watch.present.stale
    steps = run(watch, [(9.0, 3.0)] * 12, 521)
    assert [len(step) for step in steps] == [0] * 7 + [1] + [0] * 4
    (alarm,) = steps[7]
    assert (alarm.level, alarm.alarm_id) == (Level.ERROR, "trend/machine/unknown/kurtosis/b3_y")
    words = "b3_y: rms 4.5 times as high, 9 m/s^2 where the healthy machine has 2.0"
    assert alarm.reason.startswith(words[:-2])
    assert [a.level for step in run(watch, [healthy(rng) for _ in range(20)], 533) for a in step] == [
        Level.OK
    ]


def test_a_change_that_does_not_matter_raises_nothing_however_sure_it_is():
    rng = np.random.default_rng(4)
    watch = monitor()
    run(watch, [healthy(rng) for _ in range(122)])
    assert not any(run(watch, [(3.2, 3.0)] * 100, 122))  # + 4 dB, ten standard deviations


def test_a_knock_that_a_few_windows_share_raises_nothing():
    rng = np.random.default_rng(5)
    watch = monitor()
    run(watch, [healthy(rng) for _ in range(122)])
    for start in range(122, 322, 20):
        assert not any(run(watch, [(9.0, 80.0)] * 4 + [healthy(rng) for _ in range(16)], start))


def test_no_chatter_with_an_indicator_at_its_limit():
    rng = np.random.default_rng(6)
    watch = monitor()
    run(watch, [healthy(rng) for _ in range(122)])
    row = next(v for v in watch.monitor.trends().values if v.name == "rms")
    values = row.limit * np.exp(0.05 * rng.standard_normal(3000))
    changes = [a for step in run(watch, [(float(v), 3.0) for v in values], 122) for a in step]
    assert len(changes) <= 2


def test_each_message_speaks_for_its_channel_only():
    rng = np.random.default_rng(7)
    watch = monitor()
    raised = []
    for k in range(200):
        bad = k > 150
        for channel in ("b1_y", "b3_y"):
            for source in ("kurtosis", "envelope"):
                rms, kurt = healthy(rng)
                if bad and channel == "b3_y" and source == "kurtosis":
                    rms = 9.0
                made = features(k, rms, kurt, source=source, channel=channel)
                raised += [a for o in watch.push(made) for a in o.alarms]
    assert [a.alarm_id for a in raised] == ["trend/machine/unknown/kurtosis/b3_y"]
    assert raised[0].sample == round((151 + 7) * HOP_S * RATE_HZ) + 1999


def test_a_speed_that_was_not_learnt_is_not_judged_and_can_be_added():
    rng = np.random.default_rng(8)
    watch = monitor()
    run(watch, [healthy(rng) for _ in range(122)])

    def at_20(k, rms):
        return [a for o in watch.push(features(k, rms, speed_hz=20.0)) for a in o.alarms]

    assert not any(at_20(k, 9.0) for k in range(122, 200))
    assert watch.present.note == "no baseline at 20 Hz: it was learnt near 9.85 Hz"
    watch.monitor.keeper.learn(60.0, extend=True)
    for k in range(200, 330):
        at_20(k, 8.0 * math.exp(0.05 * rng.standard_normal()))
    assert not any(at_20(k, 8.1) for k in range(330, 360))
    assert not watch.present.stale
    assert any(run(watch, [(9.0, 3.0)] * 12, 360))  # what was known of 10 Hz still is


def test_a_source_that_was_not_learnt_makes_no_chatter_of_the_state():
    """Learnt of one node alone; the other one's messages, in between, cannot be judged."""
    rng = np.random.default_rng(12)
    watch = monitor()
    run(watch, [healthy(rng) for _ in range(122)])
    due = []
    for k in range(122, 242):
        for source in ("kurtosis", "envelope"):
            made = features(k, *healthy(rng), source=source)
            due += [o.state_due for o in watch.push(made)]
    assert sum(due) <= 1 + 6  # the note about the other source, and every ten seconds
    assert not watch.present.stale  # one of them is judged
    assert "learnt without indicators of envelope: learn it anew" in watch.present.note


def test_trends_are_told_every_ten_seconds_with_limit_and_time_to_it():
    rng = np.random.default_rng(9)
    watch = monitor()
    told = []
    for k in range(1000):
        rms, kurt = healthy(rng)
        rms *= 1.0 + max(k - 122, 0) / 2000
        told += [o.report.trends for o in watch.push(features(k, rms, kurt)) if o.report.trends]
    seconds = np.diff([t.t_ns / 1e9 for t in told])
    assert seconds == pytest.approx(10.0)
    assert told[0].baseline.startswith("learning")
    rows = {value.name: value for value in told[-1].values}
    assert rows["rms"].direction == "rising"
    assert rows["rms"].slope == pytest.approx(2.0 / 2000 / HOP_S * 3600, rel=0.2)
    ahead = (rows["rms"].limit - rows["rms"].value) / rows["rms"].slope
    assert rows["rms"].hours_to_limit == pytest.approx(ahead)
    assert rows["rms"].expected == pytest.approx(2.0, rel=0.02)
    assert rows["kurtosis"].direction == "steady"
    assert rows["kurtosis"].hours_to_limit == math.inf


def test_learning_is_given_up_when_something_speaks_against_a_healthy_machine():
    watch = monitor()
    run(watch, [(2.0, 3.0)] * 40)
    assert watch.monitor.keeper.disturb("an alarm came: outer race of bearing_3")
    assert not watch.monitor.keeper.disturb("again")
    run(watch, [(2.0, 3.0)] * 200, 40)
    assert watch.monitor.keeper.baseline is None
    assert "learning was given up, an alarm came: outer race of bearing_3" in watch.present.note


def test_other_sources_are_followed_but_raise_nothing():
    watch = monitor()
    changes = []
    for k in range(300):
        made = features(k, 2.0 if k < 122 else 50.0, source="stranger")
        changes += [a for o in watch.push(made) for a in o.alarms]
    assert changes == []
    assert {v.source for v in watch.monitor.trends().values} == {"stranger"}


def test_a_new_start_of_the_stream_keeps_the_baseline_and_takes_alarms_back():
    rng = np.random.default_rng(10)
    watch = monitor()
    run(watch, [healthy(rng) for _ in range(122)] + [(9.0, 3.0)] * 12)
    assert watch.present.level == Level.ERROR
    (back,) = [a for step in run(watch, [healthy(rng)]) for a in step]
    assert (back.level, back.reason) == (Level.OK, "the stream began again")
    assert any(run(watch, [(9.0, 3.0)] * 12, 1))


def test_its_memory_is_bounded():
    watch = TrendMonitor(MACHINE, SETTINGS)
    for k in range(TrendMonitor.MOST_SERIES):
        watch.push(features(0, 2.0, channel=f"c{k}"))
    assert len(watch._series) == TrendMonitor.MOST_SERIES
    assert watch.ignored == TrendMonitor.MOST_SERIES
    assert sum(s.history.nbytes for s in watch._series.values()) <= 8e6


def test_indicators_of_another_machine_are_left_out():
    watch = TrendMonitor(MACHINE, SETTINGS)
    assert watch.push(features(0, 2.0, frame_id="other")) == []
    assert watch.ignored == 1


def test_acknowledging_and_resetting_go_through_to_the_book():
    rng = np.random.default_rng(11)
    watch = monitor()
    assert watch.acknowledge() == []
    with pytest.raises(InputError, match="no alarm is active"):
        watch.clear("trend/x")
    run(watch, [healthy(rng) for _ in range(122)] + [(9.0, 3.0)] * 12)
    (noted,) = watch.acknowledge("trend/machine/unknown/kurtosis/b3_y", "Ada")
    assert noted.acknowledged
    (back,) = watch.clear(by="Ada")
    assert back.level == Level.OK
    assert watch.present.level == Level.OK


@pytest.mark.parametrize("bad", [{"learn_s": 0.0}, {"hop_s": -1.0}, {"publish_s": math.nan}])
def test_impossible_settings_are_refused(bad):
    with pytest.raises(InputError, match="trend settings"):
        TrendSettings(**bad)
    with pytest.raises(InputError, match="a finite time above 0 s"):
        TrendMonitor(MACHINE).keeper.learn(-3.0)
