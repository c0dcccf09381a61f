"""From whole signals to a verdict, for the tests of the decision."""

from __future__ import annotations

import numpy as np

from gearsim_dsp.evidence import EvidencePool
from gearsim_dsp.judges.bearing import Verdict, find_faults
from gearsim_dsp.speed import window_speed
from gearsim_dsp.window import WindowInput, analyse_window
from gearsim_io.nameplate import Machine
from gearsim_io.record import PulseTrain


def pool_of(
    data: np.ndarray,
    rate_hz: float,
    plate: Machine,
    tacho: np.ndarray | None = None,
    window_s: float = 2.0,
    *,
    between: bool = False,
) -> EvidencePool:
    """`data` has shape (channels, samples); windows overlap by half."""
    pool = EvidencePool(plate)
    length = round(window_s * rate_hz)
    for start in range(0, data.shape[1] - length + 1, length // 2):
        trains = []
        if tacho is not None:
            inside = tacho[(tacho >= start) & (tacho < start + length)] - start
            trains = [PulseTrain("shaft", 1.0, inside)]
        speed = window_speed(trains, length, rate_hz, plate)
        pool.add(
            [
                analyse_window(
                    WindowInput(
                        row[start : start + length],
                        rate_hz,
                        channel.name,
                        start,
                        speed,
                        plate,
                        between=between,
                    )
                )
                for channel, row in zip(plate.channels, data, strict=True)
            ]
        )
    return pool


def verdict_of(
    data: np.ndarray, rate_hz: float, plate: Machine, tacho: np.ndarray | None = None, window_s: float = 2.0
) -> Verdict:
    return find_faults(plate, pool_of(data, rate_hz, plate, tacho, window_s))
