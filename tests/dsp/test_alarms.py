"""Alarm levels: thresholds from false-alarm rates, minimum duration, hysteresis, attribution, latching."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gearsim_dsp.alarm_book import AlarmBook
from gearsim_dsp.alarms import AlarmSettings, Indication, Judgement, Latch, Thresholds, format_alarm
from gearsim_dsp.results import Level
from gearsim_io.errors import InputError

HOP_NS = 500_000_000
LIMITS = Thresholds(warn=8.0, error=14.0, clear=3.5)


def book(limits=LIMITS, **changes):
    return AlarmBook("envelope", "rig", replace(AlarmSettings(), **changes), limits)


def sign(significance, component="bearing_3", fault="outer_race", group="", channel="b3_y"):
    words = f"outer race of {component}: 48.9 Hz and 5 harmonics, 21 dB over the floor"
    group = group or f"{fault}@{component}"
    return Indication(
        component, fault, group, channel, significance, 4.89, 4.885, 48.85, 0.97, words if fault else ""
    )


def feed(alarms, rows, start=0):
    """`rows`: one significance, or a tuple of indications, for each window."""
    out = []
    for k, row in enumerate(rows, start):
        shown = row if isinstance(row, tuple) else (sign(row),)
        shown = tuple(i for i in shown if i.significance > 0)
        out.append(alarms.judge(Judgement(k * HOP_NS, 4096 * k, shown)))
    return out


def levels(changes):
    return [[(a.previous_level.name, a.level.name) for a in step] for step in changes]


def test_thresholds_are_the_union_bound():
    limits = Thresholds.derive(AlarmSettings(), tests_per_window=128, hop_s=0.5)
    windows = 600 / 0.5
    assert 10**-limits.warn * 128 * windows == pytest.approx(1e-3)
    assert 10**-limits.error * 128 * windows * (10 * 365.25 * 24 * 6) == pytest.approx(1e-3)
    assert 10**-limits.clear * 128 == pytest.approx(0.05)


def test_noise_raises_as_often_as_promised_and_not_more():
    """500 spans of ten minutes of independent tests, at a probability that can be counted."""
    demanded, tests, hop_s = 0.4, 6, 10.0
    limits = Thresholds.derive(AlarmSettings(warn_probability=demanded), tests, hop_s)
    rng = np.random.default_rng(7)
    raised = 0
    for _ in range(500):
        alarms = book(limits, raise_windows=1, of_windows=1)
        rows = []
        for p in rng.uniform(size=(60, tests)):
            rows.append(tuple(sign(-math.log10(v), f"bearing_{k}") for k, v in enumerate(p)))
        raised += any(any(a.level > Level.OK for a in step) for step in feed(alarms, rows))
    expected = 1 - math.exp(-demanded)  # 0.33 for independent tests; the bound says 0.4 for any
    assert abs(raised / 500 - expected) < 4 * math.sqrt(expected * (1 - expected) / 500)
    assert raised / 500 <= demanded


def test_a_level_needs_two_of_three_windows_and_comes_with_the_second():
    alarms = book()
    changes = feed(alarms, [0, 9, 0, 0, 9, 0, 9, 9])
    assert levels(changes) == [[], [], [], [], [], [], [("OK", "WARN")], []]
    alarm = changes[6][0]
    assert alarm.t_ns == 6 * HOP_NS
    assert alarm.sample == 6 * 4096
    assert (alarm.component, alarm.fault, alarm.channel) == ("bearing_3", "outer_race", "b3_y")
    assert alarm.alarm_id == "envelope/bearing_3/outer_race"
    assert alarm.value == 9
    assert alarm.threshold == 8
    assert alarm.reason.startswith("outer race of bearing_3: 48.9 Hz")


def test_a_strong_fault_is_an_error_at_once_and_is_left_step_by_step():
    alarms = book()
    changes = feed(alarms, [0] * 3 + [30] * 4 + [5] * 8 + [1] * 9)
    flat = [(k, a.previous_level.name, a.level.name) for k, step in enumerate(changes) for a in step]
    # 5 is under WARN (8) but not clean (3.5): down to WARN after 8 such windows, to OK after 8 clean ones
    assert flat == [(4, "OK", "ERROR"), (14, "ERROR", "WARN"), (22, "WARN", "OK")]
    assert "weaker" in changes[14][0].reason
    assert "not seen in the last 8 windows" in changes[22][0].reason
    assert alarms.state().level == Level.OK
    assert alarms.state().active == ()


def test_warn_grows_to_error_but_error_is_not_called_warn_again_at_once():
    flat = [a for step in feed(book(), [9, 9, 9, 20, 20, 9, 9, 20, 9]) for a in step]
    assert [(a.previous_level, a.level) for a in flat] == [
        (Level.OK, Level.WARN),
        (Level.WARN, Level.ERROR),
    ]


@pytest.mark.parametrize("threshold", ["warn", "error"])
def test_no_chatter_with_a_fault_exactly_at_the_threshold(threshold):
    at = getattr(LIMITS, threshold)
    values = at + 1.5 * np.random.default_rng(3).standard_normal(5000)
    crossings = np.count_nonzero(np.diff(values > at))
    assert crossings > 2000  # the test's signal does what its name says
    changes = [a for step in feed(book(), values.tolist()) for a in step]
    assert len(changes) <= (1 if threshold == "warn" else 2)
    naive = book(Thresholds(warn=at, error=1e9, clear=at), raise_windows=1, of_windows=1, clear_windows=1)
    assert sum(len(step) for step in feed(naive, values.tolist())) > 2000


@settings(max_examples=100, deadline=None)
@given(st.lists(st.sampled_from([0.0, 3.0, 5.0, 9.0, 20.0]), max_size=60))
def test_changes_form_a_chain_and_the_state_tells_the_last_of_them(values):
    alarms = book()
    level = Level.OK
    for k, value in enumerate(values):
        for alarm in feed(alarms, [value], start=k)[0]:
            assert alarm.previous_level == level != alarm.level
            level = alarm.level
        state = alarms.state()
        assert state.level == level
        assert [a.level for a in state.active] == ([level] if level > Level.OK else [])
        if values[max(0, k - 2) : k + 1].count(20.0) >= 2:
            assert level == Level.ERROR
        if k >= 7 and max(values[k - 7 : k + 1]) < LIMITS.clear:
            assert level == Level.OK


def test_equal_bearings_share_one_alarm_for_the_one_that_fits_best():
    rows = [
        (sign(9, "bearing_4", group="outer_race@4.89", channel="b4_y"),),
        (sign(30, "bearing_3", group="outer_race@4.89"),),
        (sign(31, "bearing_3", group="outer_race@4.89"),),
        (sign(9, "bearing_4", group="outer_race@4.89"),),
    ]
    alarms = book()
    flat = [a for step in feed(alarms, rows) for a in step]
    assert [(a.component, a.channel, a.level) for a in flat] == [
        ("bearing_3", "b3_y", Level.WARN),
        ("bearing_3", "b3_y", Level.ERROR),
    ]


def test_windows_that_are_surer_of_the_bearing_weigh_more():
    unsure = replace(sign(30, "bearing_4", group="g"), confidence=0.5)
    sure = replace(sign(30, "bearing_3", group="g"), confidence=0.6)
    flat = [a for step in feed(book(), [(unsure,), (sure,)]) for a in step]
    assert [a.component for a in flat] == ["bearing_3"]


def test_an_alarm_moves_to_another_bearing_only_when_all_recent_windows_say_so():
    def row(name):
        return (sign(9, name, group="g"),)

    alarms = book()
    feed(alarms, [row("bearing_3")] * 3)
    mixed = feed(alarms, [row("bearing_4"), row("bearing_3")] * 10, start=3)
    assert not any(mixed)
    moved = [a for step in feed(alarms, [row("bearing_4")] * 9, start=23) for a in step]
    assert [(a.component, a.level.name) for a in moved] == [("bearing_3", "OK"), ("bearing_4", "WARN")]
    assert "point to bearing_4" in moved[0].reason
    assert [a.component for a in alarms.state().active] == ["bearing_4"]


def test_a_sign_too_weak_in_size_keeps_an_alarm_but_raises_none():
    weak = (replace(sign(40), may_raise=False, component=""),)
    assert not any(feed(book(), [weak] * 20))
    alarms = book()
    assert levels(feed(alarms, [20, 20])) == [[], [("OK", "ERROR")]]
    assert not any(feed(alarms, [weak] * 20, start=2))
    assert [a.component for a in alarms.state().active] == ["bearing_3"]
    assert levels(feed(alarms, [1] * 8, start=22))[-1] == [("ERROR", "OK")]


def test_two_faults_have_two_alarms():
    row = (sign(9), sign(20, fault="inner_race"))
    flat = [a for step in feed(book(), [row] * 3) for a in step]
    assert [a.alarm_id for a in flat] == ["envelope/bearing_3/inner_race", "envelope/bearing_3/outer_race"]


def test_a_restart_takes_all_alarms_back():
    alarms = book()
    feed(alarms, [20] * 3)
    back = alarms.reset(99, 7, "the stream began again")
    assert [(a.level, a.previous_level, a.t_ns, a.reason) for a in back] == [
        (Level.OK, Level.ERROR, 99, "the stream began again")
    ]
    assert alarms.state().active == ()
    assert levels(feed(alarms, [9, 9])) == [[], [("OK", "WARN")]]


def test_the_state_is_due_on_every_tenth_second_of_the_stream():
    alarms = book()
    due = []
    for k in range(60):
        feed(alarms, [0], start=k)
        if alarms.state_due():
            due.append(k * HOP_NS / 1e9)
    assert due == [0.0, 10.0, 20.0]


def test_the_book_forgets_what_showed_nothing():
    alarms = book()
    rng = np.random.default_rng(0)
    for k in range(500):
        feed(alarms, [(sign(2, f"bearing_{rng.integers(10_000)}"),)], start=k)
        assert len(alarms._slots) <= 9


def test_a_line_for_people():
    alarm = feed(book(), [20, 20])[1][0]
    line = " ".join(format_alarm(alarm).split())
    reason = "outer race of bearing_3: 48.9 Hz and 5 harmonics, 21 dB over the floor"
    assert line == f"0.50 s ERROR {reason} [envelope, b3_y]"
    line = format_alarm(replace(alarm, t_ns=1795335447_690_000_000))
    assert line.startswith("08:17:27.69 UTC  ERROR  outer race")


@pytest.mark.parametrize(
    "bad",
    [{"warn_probability": 0.0}, {"error_probability": 1.5}, {"raise_windows": 4}, {"clear_windows": 0}],
)
def test_impossible_settings_are_refused(bad):
    with pytest.raises(InputError, match="alarm settings"):
        AlarmSettings(**bad)


# Latching, acknowledging, resetting


def flags(alarm):
    return alarm.level.name, alarm.present, alarm.acknowledged


def test_a_latched_alarm_stays_until_somebody_took_note():
    alarms = book(latch=Latch.ALL)
    flat = [a for step in feed(alarms, [30] * 3 + [0] * 12) for a in step]
    assert [flags(a) for a in flat] == [("ERROR", True, False), ("ERROR", False, False)]
    assert "not seen in the last 8 windows; ERROR is kept until it is acknowledged" in flat[-1].reason
    assert alarms.state().level == Level.ERROR
    # its cause comes back and goes again: both are told, the level stays
    again = [a for step in feed(alarms, [30] * 3 + [0] * 12, start=15) for a in step]
    assert [flags(a) for a in again] == [("ERROR", True, False), ("ERROR", False, False)]
    (over,) = alarms.acknowledge("envelope/bearing_3/outer_race", "Ada")
    assert flags(over) == ("OK", False, False)
    assert over.reason == "outer race of bearing_3: acknowledged by Ada, its cause has gone"
    assert alarms.state().active == ()
    assert over.t_ns == 29 * HOP_NS


def test_an_acknowledged_alarm_ends_with_its_cause_and_a_higher_level_wants_another():
    alarms = book(latch=Latch.ALL)
    feed(alarms, [9] * 3)
    (noted,) = alarms.acknowledge(operator="Ada")
    assert flags(noted) == ("WARN", True, True)
    assert noted.acknowledged_by == "Ada"
    assert noted.reason.endswith("21 dB over the floor (acknowledged by Ada)")
    assert alarms.acknowledge() == []  # nothing new
    assert alarms.state().active[0].acknowledged
    flat = [a for step in feed(alarms, [30] * 3, start=3) for a in step]
    assert [flags(a) for a in flat] == [("ERROR", True, False)]
    alarms.acknowledge()
    flat = [a for step in feed(alarms, [0] * 12, start=6) for a in step]
    assert [flags(a) for a in flat] == [("OK", False, False)]


def test_only_errors_latch_where_that_is_asked_for():
    alarms = book(latch=Latch.ERROR)
    flat = [a for step in feed(alarms, [9] * 3 + [0] * 12) for a in step]
    assert [a.level.name for a in flat] == ["WARN", "OK"]
    flat = [a for step in feed(alarms, [30] * 3 + [5] * 9, start=15) for a in step]
    assert [flags(a) for a in flat] == [("ERROR", True, False)]  # WARN is all that shows, ERROR is kept
    (noted,) = alarms.acknowledge()
    assert flags(noted) == ("WARN", True, True)
    assert noted.reason.endswith("it has come down to WARN meanwhile")


def test_a_reset_takes_an_alarm_back_and_a_fault_that_is_there_comes_again():
    alarms = book(latch=Latch.ALL)
    row = (sign(30), sign(30, fault="inner_race"))
    feed(alarms, [row] * 4)
    (back,) = alarms.clear("envelope/bearing_3/inner_race", "Ada")
    assert flags(back) == ("OK", False, False)
    assert back.reason == "inner race of bearing_3: reset by Ada"
    assert [a.fault for a in alarms.state().active] == ["outer_race"]
    assert [flags(a) for a in alarms.clear()] == [("OK", False, False)]
    again = feed(alarms, [row] * 3, start=4)
    assert [len(step) for step in again] == [0, 2, 0]  # as any new alarm: with the second window


@pytest.mark.parametrize("act", ["acknowledge", "clear"])
def test_an_alarm_that_is_not_there_is_told_with_those_that_are(act):
    alarms = book()
    assert getattr(alarms, act)() == []
    with pytest.raises(InputError, match="nothing: no alarm is active"):
        getattr(alarms, act)("envelope/x/y")
    feed(alarms, [30] * 3)
    with pytest.raises(InputError, match="one of envelope/bearing_3/outer_race"):
        getattr(alarms, act)("envelope/x/y")


@settings(max_examples=100, deadline=None)
@given(
    st.lists(
        st.one_of(st.sampled_from([0.0, 5.0, 9.0, 20.0]), st.sampled_from(["ack", "reset"])), max_size=60
    )
)
def test_latched_alarms_never_fall_by_themselves(steps):
    alarms, level, acknowledged = book(latch=Latch.ALL), Level.OK, False
    for k, step in enumerate(steps):
        if step == "ack":
            changes = alarms.acknowledge()
        elif step == "reset":
            changes = alarms.clear()
        else:
            changes = feed(alarms, [step], start=k)[0]
        for alarm in changes:
            assert alarm.previous_level == level
            if alarm.level < level:
                assert step in ("ack", "reset") or acknowledged
            assert alarm.present or not acknowledged or alarm.level == Level.OK
            level, acknowledged = alarm.level, alarm.acknowledged
        assert alarms.state().level == level


@pytest.mark.parametrize("latch", list(Latch))
def test_no_chatter_when_latched_either(latch):
    values = LIMITS.warn + 1.5 * np.random.default_rng(5).standard_normal(5000)
    alarms = book(latch=latch)
    assert len([a for step in feed(alarms, values.tolist()) for a in step]) <= 1
    alarms.acknowledge()
    assert not any(feed(alarms, values.tolist(), start=5000))


def test_a_place_makes_alarms_of_one_fault_distinct():
    row = tuple(replace(sign(20, group=c, channel=c), place=c) for c in ("b1_y", "b3_y"))
    flat = [a for step in feed(book(), [row] * 2) for a in step]
    assert [a.alarm_id for a in flat] == [f"envelope/bearing_3/outer_race/{c}" for c in ("b1_y", "b3_y")]


def test_a_detail_that_comes_late_is_told_once():
    wide, wider = ", about 0.8 mm wide", ", about 0.9 mm wide"
    rows = (
        [(sign(20),)] * 3 + [(replace(sign(20), detail=wide),)] * 3 + [(replace(sign(20), detail=wider),)] * 3
    )
    alarms = book()
    changes = feed(alarms, rows)
    assert [len(step) for step in changes] == [0, 1, 0, 1, 0, 0, 0, 0, 0]
    assert changes[1][0].reason.endswith("21 dB over the floor")
    assert changes[3][0].reason.endswith("21 dB over the floor, about 0.8 mm wide")
    assert (changes[3][0].previous_level, changes[3][0].level) == (Level.ERROR, Level.ERROR)
    # what is known when it is raised is told at once, and forgotten with the alarm
    feed(alarms, [0] * 9, start=9)
    again = feed(alarms, [(replace(sign(20), detail=wider),)] * 3, start=18)
    assert [[a.reason[-19:] for a in step] for step in again] == [[], [wider], []]
    feed(alarms, [0] * 9, start=21)
    assert not feed(alarms, [20, 20], start=30)[1][0].reason.endswith("wide")
    assert not any(
        feed(alarms, [(replace(sign(20, "bearing_4", group="outer_race@bearing_3"), detail=wide),)], start=32)
    )
