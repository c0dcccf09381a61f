"""Parts of records, and whether two records are the same recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import firwin, oaconvolve

from gearsim_io.record import EdgeTrain, PulseTrain, Record

__all__ = ["cut", "only", "same_recording", "thinned"]

# The filter of a thinned record: flat to 0.45 of the new rate, shut from 0.55, as delta-sigma converters.
_PASS, _STOP, _KAISER_BETA, _TAPS_PER_BAND = 0.45, 0.55, 10.0, 6.4
_EXCERPT = 1024
# Correlation that float32 rounding leaves of a record times a factor; two runs of one machine, which repeat
# themselves but for the sensors' noise, stay far below.
_SAME = 1e-9


def cut(record: Record, first: int, end: int) -> Record:
    """Samples `first` to `end` (not included) of a record with their pulses, edges and torques."""
    torques = record.torques
    if torques is not None:
        torques = replace(torques, data_nm=torques.data_nm[:, first:end])
    return replace(
        record,
        data=record.data[:, first:end],
        tachos=tuple(_pulses(train, first, end) for train in record.tachos),
        encoders=tuple(_edges(train, first, end) for train in record.encoders),
        t0_ns=record.t0_ns + round(first * 1e9 / record.sample_rate_hz),
        first_sample=record.first_sample + first,
        torques=torques,
    )


def only(record: Record, channels: Sequence[str]) -> Record:
    """The record with these channels alone, in this order."""
    rows = [record.channels.index(name) for name in channels]
    return replace(record, channels=tuple(channels), data=np.ascontiguousarray(record.data[rows]))


def thinned(record: Record, factor: int) -> Record:
    """The record at a whole fraction of its rate, through a linear-phase low-pass filter."""
    if factor == 1:
        return record
    width = (_STOP - _PASS) * 2.0 / factor
    taps = 2 * round(_TAPS_PER_BAND / width) + 1
    low_pass = firwin(taps, 1.0 / factor, window=("kaiser", _KAISER_BETA))
    torques = record.torques
    if torques is not None:
        torques = replace(torques, data_nm=_every(torques.data_nm, factor, low_pass))
    return replace(
        record,
        sample_rate_hz=record.sample_rate_hz / factor,
        data=_every(record.data, factor, low_pass),
        tachos=tuple(replace(train, samples=train.samples / factor) for train in record.tachos),
        encoders=tuple(replace(train, samples=train.samples / factor) for train in record.encoders),
        first_sample=0,
        torques=torques,
    )


def same_recording(one: Record, other: Record) -> bool:
    """Whether the samples of one record are those of the other, or an excerpt of them, whatever the gain.

    Looked for are the middle samples of each channel of the shorter record, bit for bit, in those of the
    longer; records of one length are also the same where they differ by a factor only.
    """
    short, long = sorted((one, other), key=lambda record: record.sample_count)
    rows = [(a, b) for a in short.data for b in long.data]
    if any(_within(a, b) for a, b in rows):
        return True
    return short.sample_count == long.sample_count and any(_proportional(a, b) for a, b in rows)


def _within(short: NDArray[np.float32], long: NDArray[np.float32]) -> bool:
    size = min(_EXCERPT, short.size)
    excerpt = np.ascontiguousarray(short[(short.size - size) // 2 :][:size])
    if excerpt.size == 0 or float(np.ptp(excerpt)) == 0.0:
        return False
    return np.ascontiguousarray(long).tobytes().find(excerpt.tobytes()) >= 0


def _proportional(one: NDArray[np.float32], other: NDArray[np.float32]) -> bool:
    a, b = (np.asarray(row, dtype=np.float64) - float(np.mean(row, dtype=np.float64)) for row in (one, other))
    both = float(np.sqrt(np.mean(a**2) * np.mean(b**2)))
    return both > 0.0 and abs(float(np.mean(a * b))) > (1.0 - _SAME) * both


def _pulses(train: PulseTrain, first: int, end: int) -> PulseTrain:
    inside = (train.samples >= first) & (train.samples < end)
    return replace(train, samples=train.samples[inside] - first)


def _edges(train: EdgeTrain, first: int, end: int) -> EdgeTrain:
    inside = (train.samples >= first) & (train.samples < end)
    before = int(np.count_nonzero(train.samples < first))
    return replace(train, first_edge=train.first_edge + before, samples=train.samples[inside] - first)


def _every(rows: NDArray[np.float32], factor: int, low_pass: NDArray[np.float64]) -> NDArray[np.float32]:
    wide = np.asarray(rows, dtype=np.float64)
    smooth = oaconvolve(wide, low_pass[np.newaxis], mode="same", axes=1)
    return np.ascontiguousarray(smooth[:, ::factor], dtype=np.float32)
