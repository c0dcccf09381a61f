"""The monitors on synthetic rigs: what they say, when, and that only the batches' content decides it."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rig_stream import BPFI_ORDER, BPFO_ORDER, RATE_HZ, cut, interleave, machine, record

from gearsim_dsp.alarms import AlarmSettings
from gearsim_dsp.judges.bearing import MODULATION_LIMIT, find_faults
from gearsim_dsp.results import Level
from gearsim_dsp.streams import assembler
from gearsim_dsp.streams.assembler import WindowSettings
from gearsim_dsp.streams.envelope_monitor import EnvelopeMonitor, EnvelopeSettings, indications
from gearsim_dsp.streams.kurtosis_monitor import KurtosisMonitor, KurtosisSettings
from gearsim_dsp.streams.report import AlarmedMonitor
from gearsim_io.batches import SampleBatch
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Bearing

MONITORS = {"envelope": EnvelopeMonitor, "kurtosis": KurtosisMonitor}


@cache
def faulty(order=BPFO_ORDER, amplitude=1.0):
    return record(seconds=8.0, fault_at_s=3.0, fault_order=order, amplitude=amplitude)


def outcomes(batches, monitor=None, alarms=None):
    alarmed = AlarmedMonitor(monitor or EnvelopeMonitor(machine()), alarms)
    out = [o for batch in batches for o in alarmed.push(batch)]
    return out + alarmed.finish()


def changes(found):
    return [alarm for o in found for alarm in o.alarms]


@pytest.mark.parametrize(
    ("order", "fault"), [(BPFO_ORDER, "outer_race"), (BPFI_ORDER, "inner_race")], ids=["outer", "inner"]
)
@pytest.mark.parametrize("amplitude", [0.3, 1.0])
def test_a_fault_is_named_on_the_right_bearing_soon_and_once(order, fault, amplitude):
    found = changes(outcomes(faulty(order, amplitude).batches(512)))
    assert [(a.component, a.fault, a.channel) for a in found] == [("bearing_3", fault, "b3")] * len(found)
    assert found[-1].level == Level.ERROR
    assert len(found) <= 2
    first = found[0]
    assert 3.0 < first.t_ns / 1e9 < 3.0 + 2.0
    assert first.sample == round(first.t_ns * RATE_HZ / 1e9)
    assert first.found_frequency_hz == pytest.approx(order * 10.0, rel=0.003)
    assert first.expected_order == pytest.approx(order, rel=1e-4)
    assert first.reason.startswith(f"{fault.replace('_', ' ')} of bearing_3: {order * 10:.1f} Hz and ")
    assert first.reason.endswith(" dB over the floor")


def test_impacts_are_told_by_their_kurtosis():
    strong = record(seconds=8.0, fault_at_s=3.0, amplitude=2.5, rate_hz=32768.0)
    found = changes(outcomes(strong.batches(4096), KurtosisMonitor(machine())))
    assert found[0].fault == "unknown"
    assert found[0].channel == "b3"
    assert found[0].level > Level.OK
    assert "impacts on b3: excess kurtosis" in found[0].reason
    assert found[0].t_ns / 1e9 > 3.0


@pytest.mark.parametrize("name", MONITORS)
def test_two_minutes_of_a_sound_machine_raise_nothing(name):
    sound = record(seconds=120.0, seed=11)
    found = outcomes(sound.batches(4096), MONITORS[name](machine()))
    assert len(found) == 237
    assert changes(found) == []
    assert all(not o.present.active for o in found)


@settings(max_examples=8, deadline=None)
@given(sizes=st.lists(st.integers(200, 4000), min_size=1, max_size=4), lead=st.integers(-3000, 3000))
@pytest.mark.parametrize("name", MONITORS)
def test_alarms_and_features_depend_on_the_content_alone(name, sizes, lead):
    samples, tachos = cut(faulty(), sizes)
    again = outcomes(interleave(samples, tachos, lead), MONITORS[name](machine()))
    once = outcomes(faulty().batches(512), MONITORS[name](machine()))
    assert repr([(o.alarms, o.report.features, o.report.indications, o.present) for o in again]) == repr(
        [(o.alarms, o.report.features, o.report.indications, o.present) for o in once]
    )


@pytest.mark.parametrize("memory", [0, 6])
def test_a_loop_of_a_player_tells_the_same_again_after_taking_the_alarms_back(memory):
    def told(batches):
        monitor = EnvelopeMonitor(machine(), EnvelopeSettings(memory_windows=memory))
        return changes(outcomes(batches, monitor))

    batches = list(faulty().batches(512))
    once, twice = told(batches), told(batches * 2)
    back = twice[len(once)]
    assert repr(twice[: len(once)]) == repr(once)
    assert (back.level, back.reason) == (Level.OK, "the stream began again")
    assert repr(twice[len(once) + 1 :]) == repr(once)


def test_windows_that_are_pooled_are_analysed_alike_but_not_judged():
    def reports(**how):
        monitor = EnvelopeMonitor(machine(), EnvelopeSettings(size_every=0), **how)
        return [o.report for o in outcomes(faulty().batches(512), monitor)], monitor

    judged, _ = reports()
    pooled, monitor = reports(by_window=False)
    assert len(judged) == len(pooled) > 0
    assert any(report.indications for report in judged)
    for one, other in zip(judged, pooled, strict=True):
        assert (other.features, other.spectra, other.indications) == ((), (), ())
        assert (one.judged, one.quality, one.end_sample) == (other.judged, other.quality, other.end_sample)
        for a, b in zip(one.results, other.results, strict=True):
            assert [s.power.tobytes() for s in a.spectra] == [s.power.tobytes() for s in b.spectra]
    assert not find_faults(machine(), monitor._pool).evidence


def test_monitors_that_share_a_window_share_its_spectra(monkeypatch):
    made = []
    real = assembler.both_spectra
    monkeypatch.setattr(assembler, "both_spectra", lambda *given: made.append(given) or real(*given))
    windows = assembler.WindowAssembler(machine(), EnvelopeSettings().window)
    window = next(w for batch in faulty().batches(512) for w in windows.push(batch))
    found = [monitor(machine()).judge(window) for monitor in (EnvelopeMonitor, KurtosisMonitor)]
    assert len(made) == len(window.channels)
    alone = [
        outcomes(faulty().batches(512), m(machine()))[0].report for m in (EnvelopeMonitor, KurtosisMonitor)
    ]
    assert [report.features for report in found] == [report.features for report in alone]


def test_features_and_spectra_say_where_they_come_from():
    report = outcomes(faulty().batches(512))[-1].report
    assert [f.channel for f in report.features] == ["b1", "b3"]
    by_name = {v.name: v for v in report.features[1].values}
    assert by_name["bpfo_snr"].component == "bearing_3"
    assert by_name["bpfo_snr"].value > 15
    assert by_name["bpfo_modulation"].value > 0.06 > by_name["bpfi_modulation"].value
    assert by_name["band_rms"].unit == "m/s^2"
    assert (report.features[1].speed_source, report.features[1].frame_id) == ("tacho", "test_rig")
    assert report.features[1].speed_hz == pytest.approx(10.0, rel=1e-6)
    spectrum = report.spectra[1]
    line = {m.label: m for m in spectrum.markers}["BPFO"]
    assert line.position == pytest.approx(BPFO_ORDER, rel=0.003)
    assert line.component == "bearing_3"
    k = round(line.position / spectrum.axis_step)
    near = spectrum.values[k - 3 : k + 4]
    assert near.max() > 20 * np.median(spectrum.values)
    assert spectrum.band_low_hz < 2500 + 600  # the ringing of the impacts
    assert spectrum.band_high_hz > 2500 - 600


def test_a_band_of_ones_own_is_the_one_shown():
    monitor = EnvelopeMonitor(machine(), EnvelopeSettings(band_hz=(1000.0, 1900.0)))
    report = outcomes(faulty().batches(512), monitor)[-1].report
    assert (report.spectra[0].band_low_hz, report.spectra[0].band_high_hz) == (1000.0, 1900.0)
    monitor = KurtosisMonitor(machine(), KurtosisSettings(band_hz=(1000.0, 1900.0)))
    report = outcomes(faulty().batches(512), monitor)[-1].report
    bands = [(f.band_low_hz, f.band_high_hz) for f in report.features]
    assert bands == [(0.0, RATE_HZ / 2), (1000.0, 1900.0)] * 2
    assert report.tests == 2


def test_numbers_of_the_kurtosis_monitor_against_closed_forms():
    n = 4 * round(RATE_HZ)
    t = np.arange(n) / RATE_HZ
    data = np.vstack([3.0 * np.sin(2 * np.pi * 100 * t) + 7.0, np.random.default_rng(0).normal(0, 2, n)])
    batch = SampleBatch(0, RATE_HZ, 0, ("b1", "b3"), "m/s^2", data.astype(np.float32))
    report = outcomes([batch], KurtosisMonitor(machine(tachos=())))[0].report
    sine = {v.name: v.value for v in report.features[0].values}
    noise = {v.name: v.value for v in report.features[2].values}
    assert sine["rms"] == pytest.approx(3 / math.sqrt(2), rel=1e-5)
    assert sine["kurtosis"] == pytest.approx(1.5, rel=1e-5)
    assert sine["crest_factor"] == pytest.approx(math.sqrt(2), rel=1e-4)
    assert noise["rms"] == pytest.approx(2.0, rel=0.02)
    assert noise["kurtosis"] == pytest.approx(3.0, abs=5 * math.sqrt(24 / 16384))


@pytest.mark.parametrize("name", MONITORS)
@pytest.mark.parametrize("what", ["nan", "constant"])
def test_a_bad_channel_is_left_out_and_the_others_go_on(name, what):
    rec = faulty()
    data = rec.data.copy()
    if what == "nan":
        data[0, ::5000] = np.nan
    else:
        data[0] = 4.0
    found = outcomes(replace(rec, data=data).batches(512), MONITORS[name](machine()))
    assert {f.channel for o in found for f in o.report.features} == {"b3"}
    issue = "not_finite" if what == "nan" else "constant_channel"
    assert {(q.issue, q.channel) for o in found for q in o.report.quality if q.fatal} == {(issue, "b1")}
    if name == "envelope":
        assert changes(found)[0].component == "bearing_3"


def test_what_cannot_be_judged_is_said_in_the_state_and_mends_itself():
    rec = faulty()
    data = rec.data.copy()
    data[:, :20_480] = 0.0
    found = outcomes(replace(rec, data=data).batches(512))
    dead = [o for o in found if not o.report.judged]
    assert len(dead) == 2  # windows that end at or before sample 20480
    assert all(o.present.stale and "all samples are 0" in o.present.note for o in dead)
    assert dead[0].state_due
    lively = found[len(dead)]
    assert not lively.present.stale
    assert lively.present.note == ""
    assert lively.state_due


@pytest.mark.parametrize("name", MONITORS)
def test_dropouts_steps_and_knocks_on_a_sound_machine_are_no_alarm(name):
    rec = record(seconds=24.0, seed=21)
    data = rec.data.copy()
    data[:, 20_000:30_000] = 0.0  # a dropout
    data[:, 60_000:] *= 4.0  # the gain changed
    data[1, 100_000:] += 3.0  # an offset
    for knock in (120_000, 150_000, 151_000):
        data[1, knock : knock + 40] += 30.0 * np.sin(np.arange(40) * 1.9)
    found = outcomes(replace(rec, data=data).batches(512), MONITORS[name](machine()))
    assert changes(found) == []


def test_a_rate_that_is_too_low_and_a_shaft_that_is_too_slow_are_said():
    slow = record(seconds=6.0, speed_hz=2.0)
    found = outcomes(slow.batches(512))
    assert all("turns of the shaft; at least 8" in o.present.note for o in found)
    low = record(seconds=6.0, rate_hz=256.0)
    found = outcomes(low.batches(64))
    assert all("256 Hz; at least" in o.present.note for o in found)


def test_a_nameplate_without_bearings_gives_features_only():
    plate = replace(machine(), bearings=())
    found = outcomes(faulty().batches(512), EnvelopeMonitor(plate))
    assert all("lists no bearings" in o.present.note for o in found)
    assert changes(found) == []


def test_an_impossible_nameplate_is_refused_at_once():
    bearing = Bearing("bearing_3", "input", 12, 50e-3, 38.5e-3)
    with pytest.raises(InputError, match="element_diameter"):
        EnvelopeMonitor(replace(machine(), bearings=(bearing,)))


def test_without_tacho_the_speed_is_estimated_and_said():
    rec = faulty()
    # a second harmonic of the shaft that an estimate can hold on to
    t = np.arange(rec.sample_count) / RATE_HZ
    hum = sum(0.1 * np.sin(2 * np.pi * k * 10.0 * t) for k in (1, 2, 3, 4))
    data = (rec.data + hum).astype(np.float32)
    samples = [b for b in replace(rec, data=data).batches(512) if isinstance(b, SampleBatch)]
    found = outcomes(samples, EnvelopeMonitor(machine(tachos=())))
    assert {f.speed_source for o in found for f in o.report.features} <= {"estimated", "nameplate"}
    assert changes(found)[0].component == "bearing_3"
    assert changes(found)[0].found_frequency_hz == pytest.approx(48.9, rel=0.003)


def joined(first, second):
    """One record after the other, as one stream."""
    tacho = first.tachos[0]
    pulses = np.concatenate([tacho.samples, second.tachos[0].samples + first.sample_count])
    data = np.concatenate([first.data, second.data], axis=1)
    return replace(first, data=data, tachos=(replace(tacho, samples=pulses),))


def test_a_healed_bearing_loses_its_alarm():
    found = changes(outcomes(joined(faulty(), record(seconds=12.0, seed=9)).batches(512)))
    assert [a.level for a in found][-1] == Level.OK
    # the last window with the fault ends 2 s after it; then 8 clean windows
    assert 8.0 + 3.5 < found[-1].t_ns / 1e9 <= 8.0 + 2.0 + 8 * 0.5 + 1.0


@pytest.mark.parametrize(("share", "kept"), [(0.4, False), (0.6, True), (0.95, True)])
def test_a_sign_half_as_large_as_a_fault_must_be_keeps_an_alarm_but_raises_none(share, kept):
    monitor = EnvelopeMonitor(machine())
    for batch in record(seconds=3.0, fault_at_s=0.0, amplitude=0.14).batches(512):
        monitor.push(batch)
    verdict = find_faults(machine(), monitor._pool)
    outer = next(e for e in verdict.evidence if e.family.fault == "outer_race")
    assert [i.may_raise for i in indications(verdict)] == [True]
    weak = replace(verdict, findings=(), evidence=(replace(outer, modulation=share * MODULATION_LIMIT),))
    assert [i.may_raise for i in indications(weak)] == ([False] if kept else [])


def test_stricter_settings_make_fewer_alarms():
    weak = record(seconds=8.0, fault_at_s=3.0, amplitude=0.25)
    usual = changes(outcomes(weak.batches(512)))
    strict = changes(outcomes(weak.batches(512), alarms=AlarmSettings(error_probability=1e-12)))
    assert usual
    assert max(a.level for a in strict) <= max(a.level for a in usual)
    many = AlarmSettings(raise_windows=10, of_windows=10)
    late = changes(outcomes(weak.batches(512), alarms=many))
    assert not late or late[0].t_ns > usual[0].t_ns


def test_windows_of_another_length_find_the_same():
    settings = EnvelopeSettings(WindowSettings(window_s=1.0, hop_s=0.25))
    found = changes(outcomes(faulty().batches(512), EnvelopeMonitor(machine(), settings)))
    assert found[0].component == "bearing_3"
    assert found[0].t_ns / 1e9 < 4.5
