"""A small synthetic rig for the streaming tests: known geometry, known signal, batches cut at will."""

from __future__ import annotations

import math

import numpy as np

from gearsim_io.batches import SampleBatch, TachoBatch
from gearsim_io.nameplate import Bearing, Channel, Machine, Shaft
from gearsim_io.record import PulseTrain, Record

RATE_HZ = 8192.0
SPEED_HZ = 10.0
BPFO_ORDER = 4.89039  # 12 / 2 (1 - 7.12 / 38.5)
BPFI_ORDER = 7.10961


def machine(channels=("b1", "b3"), tachos=("input",)) -> Machine:
    bearings = tuple(
        Bearing(f"bearing_{name[1:]}", "input", 12, 7.12e-3, 38.5e-3, channels=(name,)) for name in channels
    )
    return Machine(
        name="test_rig",
        description="",
        reference_shaft="input",
        shafts=(Shaft("input", 1.0, SPEED_HZ),),
        bearings=bearings,
        channels=tuple(Channel(name) for name in channels),
        tacho_shafts=tachos,
    )


def impacts(times_s, seconds, rate_hz, resonance_hz=2500.0, decay_s=1.5e-3):
    """Ringing impulses at exact (sub-sample) times, unit amplitude."""
    n = round(seconds * rate_hz)
    out = np.zeros(n)
    length = round(8 * decay_s * rate_hz)
    for time in times_s:
        first = math.ceil(time * rate_hz)
        t = (first + np.arange(length)) / rate_hz - time
        ring = np.exp(-t / decay_s) * np.sin(2 * np.pi * resonance_hz * t)
        stop = min(first + length, n)
        if first < n:
            out[first:stop] += ring[: stop - first]
    return out


def record(
    seconds=6.0,
    rate_hz=RATE_HZ,
    speed_hz=SPEED_HZ,
    fault_at_s=math.inf,
    fault_order=BPFO_ORDER,
    amplitude=1.0,
    noise=0.1,
    seed=1,
    channels=("b1", "b3"),
    faulty="b3",
    jitter=0.01,
) -> Record:
    """Noise with gear-like tones; from `fault_at_s` on, impacts at `fault_order` on channel `faulty`."""
    rng = np.random.default_rng(seed)
    n = round(seconds * rate_hz)
    t = np.arange(n) / rate_hz
    data = noise * rng.standard_normal((len(channels), n))
    data += 0.2 * np.sin(2 * np.pi * 32 * speed_hz * t)
    period = 1 / (fault_order * speed_hz)
    if fault_at_s < seconds:
        times = np.arange(fault_at_s, seconds, period)
        times = times + jitter * period * rng.standard_normal(times.size)
        data[channels.index(faulty)] += amplitude * impacts(times[times > 0], seconds, rate_hz)
    pulses = np.arange(0.3 / speed_hz, seconds, 1 / speed_hz) * rate_hz
    tacho = PulseTrain("input", 1.0, pulses[pulses < n])
    return Record(rate_hz, channels, "m/s^2", data.astype(np.float32), (tacho,), machine="test_rig")


def cut(rec: Record, sizes, first=0, t0_ns=0):
    """The record's sample batches and tacho batches, cut at independent places; `sizes` are cycled."""
    samples, tachos = [], []
    start, k = 0, 0
    while start < rec.sample_count:
        stop = min(start + sizes[k % len(sizes)], rec.sample_count)
        t = t0_ns + round(start * 1e9 / rec.sample_rate_hz)
        block = np.ascontiguousarray(rec.data[:, start:stop])
        samples.append(SampleBatch(t, rec.sample_rate_hz, first + start, rec.channels, rec.unit, block))
        start, k = stop, k + 1
    start, k = 0, 1
    for tacho in rec.tachos:
        while start < rec.sample_count:
            stop = min(start + sizes[k % len(sizes)], rec.sample_count)
            t = t0_ns + round(start * 1e9 / rec.sample_rate_hz)
            lo, hi = np.searchsorted(tacho.samples, (start, stop))
            offsets = tacho.samples[lo:hi] - start
            tachos.append(
                TachoBatch(
                    t, rec.sample_rate_hz, first + start, stop - start, tacho.shaft, 1.0, int(lo), offsets
                )
            )
            start, k = stop, k + 1
    return samples, tachos


def interleave(samples, tachos, lead):
    """Both lists merged so that tachos run `lead` samples ahead (negative: behind) of the samples."""
    keyed = [(b.end_sample, 0, b) for b in samples] + [(b.end_sample - lead, 1, b) for b in tachos]
    return [b for _, _, b in sorted(keyed, key=lambda item: item[:2])]
