"""Velocities at the bearings, at the low orders of their shafts: what the judges of shafts and gears read."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.angle.resample import to_angle
from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.judges.supply import supply_shares
from gearsim_dsp.synchronous.tsa import synchronous_average
from gearsim_io.nameplate import Bearing, Shaft

__all__ = ["BearingLevels", "bearing_levels"]

Array = NDArray[np.float64]

_LEAST_TURNS = 12.0
_SAMPLES_PER_TURN = 64
_PERIOD_TURNS = 2  # so that half orders have lines of their own
_TOP_ORDER = 8
_SURE = 5.0  # amplitudes of noise
_MAYBE = 0.5  # of what is sure
_SUPPLY_SHARE = 0.1  # of a tone's amplitude: with less of it left in an order, that order is the shaft's


@dataclass(frozen=True, slots=True, eq=False)
class BearingLevels:
    """Velocities at one bearing.

    Parameters
    ----------
    bearing : Bearing
    channel : str
        With the largest sum.
    velocity_mm_s : ndarray, shape (16,)
        RMS at orders 0.5, 1, 1.5 ... 8 of the shaft, of the strongest channel; what does not stand out of the
        noise is 0.
    sure_mm_s : ndarray, shape (16,)
        The same without the orders that may be the supply's: levels are made of these.
    undecided_mm_s : ndarray, shape (16,)
        RMS at those orders, 0 at the others, each of the channel that has most.
    all_round_mm_s : float
        Order 1 in the direction in which it is weakest; 0 where it may be the supply's.
    across_mm_s : float
        At most, orders 2 to 8 in the direction in which they are weakest; NaN with one direction.
    faint_mm_s : float
        Order 1 in the direction in which it is weakest, also where it is little above the noise.
    unseen_mm_s : float
        Order 1 that noise may hide.
    noise_mm_s : ndarray, shape (16,)
        RMS that noise alone gives these orders in that channel.
    """

    bearing: Bearing
    channel: str
    velocity_mm_s: Array
    sure_mm_s: Array
    undecided_mm_s: Array
    all_round_mm_s: float
    across_mm_s: float
    faint_mm_s: float
    unseen_mm_s: float
    noise_mm_s: Array

    @property
    def first(self) -> float:
        """Order 1."""
        return float(self.sure_mm_s[1])

    @property
    def harmonics(self) -> float:
        """Orders 2 to 8 together."""
        return float(np.sqrt(np.sum(self.sure_mm_s[3::2] ** 2)))

    @property
    def halves(self) -> float:
        """Orders 0.5, 1.5 ... together."""
        return float(np.sqrt(np.sum(self.sure_mm_s[0::2] ** 2)))

    @property
    def total(self) -> float:
        """All orders together."""
        return float(np.sqrt(np.sum(self.sure_mm_s**2)))

    @property
    def count(self) -> int:
        """Orders that stand out of the noise with a tenth of the strongest at least."""
        return int(np.count_nonzero(self.velocity_mm_s > 0.1 * self.velocity_mm_s.max(initial=0.0)))


def bearing_levels(measured: Measured) -> dict[str, list[BearingLevels]]:
    """Velocities at the bearings of each shaft that has sensors near them and turned often enough.

    Several judges ask for them; they are measured once.
    """
    return measured.once("bearing_levels", _measured_levels)


def _measured_levels(measured: Measured) -> dict[str, list[BearingLevels]]:
    found: dict[str, list[BearingLevels]] = {}
    hum: dict[float, NDArray[np.bool_]] = {}
    for bearing in measured.machine.bearings:
        shaft = measured.machine.shaft(bearing.shaft)
        channels = [name for name in bearing.channels if name in measured.channels]
        if not channels or measured.turns * shaft.ratio < _LEAST_TURNS or bearing.outer_ring_rotates:
            continue
        if shaft.ratio not in hum:
            hum[shaft.ratio] = _may_be_hum(measured, shaft)
        both = {name: _velocities(measured, name, shaft) for name in channels}
        every = {name: np.where(row > least, row, 0.0) for name, (row, least) in both.items()}
        upper = [np.maximum(row, _MAYBE * least)[3::2] for row, least in both.values()]
        faint = [float(row[1]) if row[1] > _MAYBE * least[1] else 0.0 for row, least in both.values()]
        across = min(float(np.sqrt(np.sum(row**2))) for row in upper) if len(upper) > 1 else math.nan
        rows = {name: np.where(hum[shaft.ratio], 0.0, row) for name, row in every.items()}
        loudest = max(rows, key=lambda name: float(np.sum(rows[name] ** 2)))
        found.setdefault(shaft.name, []).append(
            BearingLevels(
                bearing=bearing,
                channel=loudest,
                velocity_mm_s=every[loudest],
                sure_mm_s=rows[loudest],
                undecided_mm_s=np.max([every[name] - rows[name] for name in channels], axis=0),
                all_round_mm_s=min(float(row[1]) for row in rows.values()),
                across_mm_s=across,
                faint_mm_s=min(faint),
                unseen_mm_s=min(_MAYBE * float(least[1]) for _, least in both.values()),
                noise_mm_s=both[loudest][1] / _SURE,
            )
        )
    return found


def _velocities(measured: Measured, channel: str, shaft: Shaft) -> tuple[Array, Array]:
    """RMS velocities at orders 0.5, 1 ... 8 in mm/s, and what they must exceed to be sure."""
    assert measured.phase is not None
    signal = to_angle(measured.channels[channel], measured.phase, _SAMPLES_PER_TURN, ratio=shaft.ratio)
    average = synchronous_average(signal, _PERIOD_TURNS)
    _, amplitude = average.spectrum()
    # Of white noise each line has the amplitude 2 rms / sqrt(N).
    noise = 2.0 * average.noise_rms / math.sqrt(average.values.size)
    lines = np.arange(1, 2 * _TOP_ORDER + 1)
    speed = shaft.ratio * measured.speed.value_hz
    to_velocity = 1e3 / (2 * np.pi * 0.5 * lines * speed) / math.sqrt(2.0)
    velocity, least = amplitude[lines] * to_velocity, _SURE * noise * to_velocity
    return np.asarray(velocity), np.asarray(least)


def _may_be_hum(measured: Measured, shaft: Shaft) -> NDArray[np.bool_]:
    """Which of the orders 0.5, 1 ... 8 of a shaft a tone of the supply would come through to."""
    orders = np.asarray(shaft.ratio * 0.5 * np.arange(1, 2 * _TOP_ORDER + 1), dtype=np.float64)
    return supply_shares(measured, orders) > _SUPPLY_SHARE
