"""Window assembly: the same windows from the same batches, however they are cut, mixed and delayed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rig_stream import RATE_HZ, cut, interleave, machine, record

from gearsim_dsp.streams.assembler import WindowAssembler, WindowSettings
from gearsim_dsp.streams.ring import SignalBuffer
from gearsim_dsp.streams.sequencer import Link, Sequencer
from gearsim_io.batches import EncoderBatch
from gearsim_io.errors import InputError

SETTINGS = WindowSettings(window_s=0.5, hop_s=0.125, angle_wait_s=0.5)
LENGTH, HOP = 4096, 1024
RECORD = record(seconds=2.5)
SECOND = round(RATE_HZ)


def windows(batches, settings=SETTINGS, plate=None, finish=True):
    assembler = WindowAssembler(plate or machine(), settings)
    out = []
    for batch in batches:
        out += assembler.push(batch)
    return out + (assembler.finish() if finish else []), assembler


def pulse_bytes(window):
    return tuple(train.samples.tobytes() for train in window.pulses)


def signature(found):
    return [
        (
            w.run,
            w.first_sample,
            w.t0_ns,
            w.note,
            w.data.tobytes(),
            tuple(p.samples.tobytes() for p in w.pulses),
        )
        for w in found
    ]


REFERENCE = signature(windows(interleave(*cut(RECORD, [512]), 0))[0])


def test_windows_lie_at_multiples_of_the_hop_and_hold_the_signal_and_its_pulses():
    found, _ = windows(interleave(*cut(RECORD, [700]), 0))
    assert [w.first_sample for w in found] == list(range(0, RECORD.sample_count - LENGTH + 1, HOP))
    pulses = RECORD.tachos[0].samples
    for w in found:
        np.testing.assert_array_equal(w.data, RECORD.data[:, w.first_sample : w.end_sample])
        inside = pulses[(pulses >= w.first_sample) & (pulses < w.end_sample)] - w.first_sample
        np.testing.assert_allclose(w.pulses[0].samples, inside, atol=1e-9)
        assert w.t0_ns == round(w.first_sample * 1e9 / RATE_HZ)
        assert w.note == ""


@settings(max_examples=60, deadline=None)
@given(
    sizes=st.lists(st.integers(1, 6000), min_size=1, max_size=6).filter(lambda s: sum(s) > 300),
    lead=st.integers(-3000, 6000),
)
def test_same_windows_for_any_batch_sizes_and_interleaving(sizes, lead):
    # A tacho may lag by less than the wait, which counts from the window's end in whole batches.
    samples, tachos = cut(RECORD, sizes)
    if max(sizes) - lead >= SETTINGS.angle_wait_s * RATE_HZ:
        lead = max(sizes) - round(SETTINGS.angle_wait_s * RATE_HZ) + 1
    found, assembler = windows(interleave(samples, tachos, lead))
    mine = [(r, f, t, n, d) for r, f, t, n, d, _ in signature(found)]
    assert mine == [(r, f, t, n, d) for r, f, t, n, d, _ in REFERENCE]
    for w, ref in zip(found, windows(interleave(*cut(RECORD, [512]), 0))[0], strict=True):
        np.testing.assert_allclose(w.pulses[0].samples, ref.pulses[0].samples, atol=1e-9)
    assert assembler.stream_counts == (0, 0, 0, 0)


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_duplicates_and_swapped_neighbours_change_nothing(data):
    samples, tachos = cut(RECORD, [512])
    for batches in (samples, tachos):
        for _ in range(data.draw(st.integers(0, 4))):
            k = data.draw(st.integers(1, len(batches) - 2))
            batches[k], batches[k + 1] = batches[k + 1], batches[k]
        for _ in range(data.draw(st.integers(0, 4))):
            k = data.draw(st.integers(1, len(batches) - 1))
            batches.insert(k, batches[k - 1])
    mixed = [b for pair in zip(samples, tachos, strict=False) for b in pair]
    longer = samples if len(samples) > len(tachos) else tachos
    mixed += longer[min(len(samples), len(tachos)) :]
    assert signature(windows(mixed)[0]) == REFERENCE


@settings(max_examples=40, deadline=None)
@given(lost=st.lists(st.integers(1, 38), min_size=1, max_size=3, unique=True), lead=st.integers(-2000, 2000))
def test_a_window_never_spans_a_gap(lost, lead):
    samples, tachos = cut(RECORD, [512])
    kept = [b for k, b in enumerate(samples) if k not in lost]
    found, assembler = windows(interleave(kept, tachos, lead))
    for w in found:
        for k in lost:
            assert w.end_sample <= 512 * k or w.first_sample >= 512 * (k + 1)
        np.testing.assert_array_equal(w.data, RECORD.data[:, w.first_sample : w.end_sample])
        assert w.first_sample % HOP == 0
    possible = [
        f
        for f in range(0, RECORD.sample_count - LENGTH + 1, HOP)
        if not any(f < 512 * (k + 1) and f + LENGTH > 512 * k for k in lost)
    ]
    assert [w.first_sample for w in found] == possible
    assert assembler.stream_counts[1] == 512 * len(lost)
    assert "lost before sample" in assembler.counts.last_note


def test_without_tacho_batches_windows_come_after_the_wait_and_say_so():
    samples, _ = cut(RECORD, [512])
    assembler = WindowAssembler(machine(), SETTINGS)
    seen_at = {}
    for batch in samples:
        for w in assembler.push(batch):
            seen_at[w.first_sample] = batch
            assert w.pulses == ()
            assert "no complete tacho signal of shaft input" in w.note
    wait = round(SETTINGS.angle_wait_s * RATE_HZ)
    for first, batch in seen_at.items():
        assert batch.first_sample == first + LENGTH + wait
    assert len(seen_at) > 5
    assert assembler.counts.windows_without_angle == len(seen_at)


def test_a_hole_in_the_tacho_costs_only_the_windows_on_it():
    samples, tachos = cut(RECORD, [512])
    del tachos[20]
    found, _ = windows(interleave(samples, tachos, 0))
    for w in found:
        on_hole = w.first_sample < 512 * 21 and w.end_sample > 512 * 20
        assert bool(w.note) == on_hole
        assert (w.pulses == ()) == on_hole
    assert len(found) == len(REFERENCE)


def test_a_machine_without_tacho_does_not_wait_and_ignores_unlisted_ones():
    samples, tachos = cut(RECORD, [512])
    plate = machine(tachos=())
    with_tacho, assembler = windows(interleave(samples, tachos, 0), plate=plate, finish=False)
    without, _ = windows(samples, plate=plate, finish=False)
    assert signature(with_tacho) == signature(without)
    assert all(w.pulses == () and w.note == "" for w in without)
    assert assembler.counts.unlisted_angle_batches == len(tachos)


def test_an_encoder_serves_where_the_nameplate_lists_no_tacho():
    samples, tachos = cut(RECORD, [512])
    plate = replace(machine(tachos=()), encoder_shafts=("input",))
    encoders = [
        EncoderBatch(
            b.t0_ns,
            b.sample_rate_hz,
            b.first_sample,
            b.sample_count,
            b.shaft,
            1,
            b.first_pulse,
            b.pulse_offsets,
        )
        for b in tachos
    ]
    found, _ = windows(interleave(samples, encoders, -800), plate=plate)
    assert signature(found) == REFERENCE


@pytest.mark.parametrize("lead", [-1500, 0, 1500])
def test_a_player_that_loops_gives_the_same_windows_each_time(lead):
    once = interleave(*cut(RECORD, [512]), lead)
    loops, assembler = windows(once * 3)
    assert [s[1:] for s in signature(loops)] == [s[1:] for s in REFERENCE] * 3
    assert [w.run for w in loops] == [0] * len(REFERENCE) + [1] * len(REFERENCE) + [2] * len(REFERENCE)
    assert assembler.stream_counts[3] == 2


@pytest.mark.parametrize("skew", [-3, -1, 0, 1, 3])
def test_a_restart_seen_earlier_on_one_topic_does_not_mix_runs(skew):
    samples, tachos = cut(RECORD, [512])
    other = record(seconds=2.5, seed=2, speed_hz=11.0)
    new_samples, new_tachos = cut(other, [512], t0_ns=60_000_000_000)
    order = list(samples) + list(new_samples)
    angles = list(tachos) + list(new_tachos)
    runs = list(zip(order, angles, strict=True))
    mixed = order[: max(-skew, 0)] + angles[: max(skew, 0)]
    mixed += [b for a, t in zip(order[max(-skew, 0) :], angles[max(skew, 0) :], strict=False) for b in (a, t)]
    mixed += order[len(runs) + min(-skew, 0) :] + angles[len(runs) + min(skew, 0) :]
    assert len(mixed) == 2 * len(runs)
    found, _ = windows(mixed)
    first = [w for w in found if w.run == 0]
    second = [w for w in found if w.run == 1]
    assert signature(first) == REFERENCE
    reference = windows(interleave(new_samples, new_tachos, 0))[0]
    assert [s[1:] for s in signature(second)] == [s[1:] for s in signature(reference)]


def test_a_short_run_that_restarts_with_other_stamps_is_not_glued_to_the_new_one():
    short = cut(record(seconds=0.4), [512])
    long = cut(RECORD, [512], t0_ns=7_000_000_000)
    found, assembler = windows(interleave(*short, 0) + interleave(*long, 0))
    assert [w.run for w in found] == [1] * len(REFERENCE)
    assert [s[4] for s in signature(found)] == [s[4] for s in REFERENCE]
    assert assembler.stream_counts[3] == 1


def test_one_stray_old_batch_is_dropped_and_the_stream_goes_on():
    samples, tachos = cut(RECORD, [512])
    mixed = interleave(samples, tachos, 0)
    mixed.insert(mixed.index(samples[35]), samples[2])
    found, assembler = windows(mixed)
    assert signature(found) == REFERENCE
    assert assembler.stream_counts == (0, 0, 1, 0)


def test_a_late_joiner_sees_the_same_windows_as_everybody_else():
    samples, tachos = cut(RECORD, [512])
    found, _ = windows(interleave(samples[7:], tachos[7:], 0))
    assert found[0].first_sample == 4096
    assert [s[:5] for s in signature(found)] == [s[:5] for s in REFERENCE[4:]]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda b: replace(b, sample_rate_hz=2 * b.sample_rate_hz), "sample rate from 8192 to 16384 Hz"),
        (lambda b: replace(b, channels=("b1", "b4")), "channels from b1, b3 to b1, b4"),
        (lambda b: replace(b, unit="1"), "unit from m/s^2 to 1"),
    ],
)
def test_a_change_of_the_layout_starts_anew_with_a_note(change, words):
    samples, tachos = cut(RECORD, [512])
    samples = samples[:20] + [change(b) for b in samples[20:]]
    found, assembler = windows(interleave(samples, tachos, 0))
    assert words in assembler.counts.last_note
    assert {w.run for w in found} == {0, 1}
    for w in found:
        assert w.end_sample <= 20 * 512 or w.first_sample >= 20 * 512


def test_memory_stays_bounded_over_a_long_stream_and_under_a_dead_tacho():
    samples, tachos = cut(record(seconds=30.0), [512])
    for lag in (0, None):
        assembler = WindowAssembler(machine(), SETTINGS)
        peak = 0
        for sample, tacho in zip(samples, tachos, strict=False):
            assembler.push(sample)
            if lag is not None:
                assembler.push(tacho)
            peak = max(peak, assembler.nbytes)
        # two channels of float32, twice (window + wait + hop), with room for one doubling
        assert peak <= 2 * 4 * 2 * 2 * (LENGTH + HOP + SECOND)
    track = next(iter(WindowAssembler(machine(), SETTINGS)._tracks.values()))
    for tacho in tachos:
        track.push(tacho)
    assert track.kept_samples < 15 * SECOND


def test_a_batch_longer_than_all_buffers_is_taken_whole():
    found, _ = windows(interleave(*cut(RECORD, [RECORD.sample_count]), 0))
    assert signature(found) == REFERENCE


def test_stamps_follow_a_source_whose_clock_drifts():
    samples, tachos = cut(RECORD, [512])
    drift = [replace(b, t0_ns=round(b.t0_ns * 1.01)) for b in samples]
    found, _ = windows(interleave(drift, tachos, 0))
    for w in found:
        assert abs(w.t0_ns - w.first_sample * 1e9 / RATE_HZ * 1.01) < 2e6


def test_what_is_not_finite_stays_in_its_windows():
    rec = record(seconds=2.0)
    data = rec.data.copy()
    data[1, 6000] = np.nan
    found, _ = windows(interleave(*cut(replace(rec, data=data), [512]), 0))
    for w in found:
        assert np.isfinite(w.data[0]).all()
        assert np.isfinite(w.data[1]).all() != (w.first_sample <= 6000 < w.end_sample)


@pytest.mark.parametrize("bad", [{"window_s": 0.0}, {"hop_s": 3.0}, {"angle_wait_s": float("nan")}])
def test_impossible_settings_are_refused(bad):
    with pytest.raises(InputError, match="window settings"):
        WindowSettings(**bad)


def test_ring_keeps_what_was_appended_and_copies_little():
    rng = np.random.default_rng(0)
    signal = rng.standard_normal((2, 50_000)).astype(np.float32)
    ring = SignalBuffer(2, 1000, 0)
    pos = 0
    while pos < signal.shape[1]:
        step = int(rng.integers(1, 400))
        ring.append(signal[:, pos : pos + step])
        pos = min(pos + step, signal.shape[1])
        ring.drop_before(pos - 900)
        lo = max(pos - 900, 0)
        np.testing.assert_array_equal(ring.copy(lo, pos), signal[:, lo:pos])
    assert ring.nbytes <= 2 * 4 * 4000
    with pytest.raises(IndexError):
        ring.copy(0, 10)


def test_sequencer_waits_a_quarter_second_for_a_missing_batch():
    samples, _ = cut(RECORD, [512])
    late = Sequencer(lambda b, _: b)
    out = [late.push(b) for b in [*samples[:3], *samples[4:7], samples[3]]]
    assert [len(o) for o in out] == [1, 1, 1, 0, 0, 0, 4]
    lost = Sequencer(lambda b, _: b)
    out = [lost.push(b) for b in [*samples[:3], *samples[4:9]]]
    assert [len(o) for o in out] == [1, 1, 1, 0, 0, 0, 0, 5]
    assert out[-1][0].link is Link.GAP
    assert out[-1][0].lost == 512
