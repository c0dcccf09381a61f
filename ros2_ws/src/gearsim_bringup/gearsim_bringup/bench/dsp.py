"""Signal processing of 10 s at 65536 Hz, beside independent implementations of the same."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gearsim_bringup.bench import angle, cyclic, separation, synchronous
from gearsim_bringup.bench.clock import alternate, cpu_seconds
from gearsim_bringup.bench.figure import Figure, Goal
from gearsim_bringup.diagnosis_report.material import Material
from gearsim_bringup.diagnosis_report.page import make_page
from gearsim_bringup.ui import Voice
from gearsim_dsp.diagnose import diagnose_record
from gearsim_dsp.kurtogram import fast_kurtogram
from gearsim_io.machines import load_machine
from gearsim_io.record import Record

RATE_HZ = 65536.0
SECONDS = 10.0
LEVELS = 7


def measure(_voice: Voice) -> Iterator[Figure]:
    """Kurtogram, envelope spectra, coherence, separation; diagnosis and report of a record of one channel."""
    signal = _signal()
    single = signal.astype(np.float32)  # what records and streams hold
    try:
        from pysdkit.utils._kurtogram import fast_kurtogram as theirs
    except ImportError:  # a test oracle, absent where only the program is installed
        own = cpu_seconds(lambda: fast_kurtogram(single, RATE_HZ, LEVELS), 3)
        yield Figure("dsp.kurtogram_s", own, "s", Goal("<=", 0.5, on_ratio=True))
    else:
        own, peer = alternate(
            lambda: fast_kurtogram(single, RATE_HZ, LEVELS), lambda: theirs(single, LEVELS, RATE_HZ), 3
        )
        yield Figure("dsp.kurtogram_s", own, "s", Goal("<=", 0.5, on_ratio=True), ("PySDKit 0.5.0", peer))
    yield from cyclic.figures(signal, RATE_HZ)
    yield from separation.figures(signal)
    yield from angle.figures(signal, RATE_HZ)
    yield from synchronous.figures(signal, RATE_HZ)
    machine = load_machine("unsw_parallel")
    record = Record(RATE_HZ, (machine.channels[0].name,), "m/s^2", single[None, :])
    whole = cpu_seconds(lambda: diagnose_record(record, machine), 2)
    yield Figure("diagnose.record_s", whole, "s", Goal("<=", 4.0), ("the record's duration", SECONDS))
    diagnosis = diagnose_record(record, machine)
    page = cpu_seconds(lambda: make_page(Material.of(record, machine, diagnosis)), 2)
    yield Figure("diagnose.report_s", page, "s", Goal("<=", 4.0), ("the record's diagnosis", whole))


def _signal() -> NDArray[np.float64]:
    """Noise with decaying knocks 48.8 times a second, each with one percent of jitter."""
    generator = np.random.default_rng(7)
    count = round(RATE_HZ * SECONDS)
    knocks = np.zeros(count)
    times = np.cumsum(generator.normal(1 / 48.8, 0.01 / 48.8, math.ceil(48.8 * SECONDS)))
    knocks[(times[times < SECONDS] * RATE_HZ).astype(int)] = 1.0
    t = np.arange(800) / RATE_HZ
    ringing = np.exp(-1200 * t) * np.sin(2 * np.pi * 6000 * t)
    return generator.normal(0, 0.3, count) + np.convolve(knocks, ringing)[:count]
