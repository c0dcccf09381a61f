"""Whether the sampling rate that a file states can be right.

With a wrong rate all frequencies are wrong by one ratio, stated over true: the speed, every line, and those
of the supply, which is the one clock in a record that nobody has to state. A machine that runs off its
nameplate moves its own lines and leaves the supply's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.angle.tacholess import track_speed
from gearsim_dsp.electrical import find_electrical_lines, supply_like_combs
from gearsim_dsp.kinematics import mesh_orders
from gearsim_dsp.quality import QualityIssue
from gearsim_dsp.speed import ShaftSpeed
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine
from gearsim_io.record import Record

__all__ = ["RATES_HZ", "doubt_of_rate"]

Row = NDArray[np.floating]

RATES_HZ = (
    *(8000, 8192, 10000, 10240, 11025, 12000, 12800, 16000, 16384, 20000, 20480, 22050, 24000, 25000, 25600),
    *(32000, 32768, 40000, 40960, 44100, 48000, 50000, 51200, 64000, 65536, 96000, 100000, 102400, 128000),
    *(131072, 192000, 200000, 204800, 250000, 256000),
)
"""What recorders offer."""

_SUPPLIES_HZ = (50.0, 60.0)
_REACH = (0.75, 1.35)  # stated over true
_PLACE = 0.01  # of a supply's frequency: within it the supply is where it belongs
_SAME_RATE = 0.003
_FEWEST_LINES = 5
_SURE = 0.9
_LINE_ERROR = 1e-4
_MOST_CHANNELS = 3


def doubt_of_rate(record: Record, machine: Machine, speed: ShaftSpeed) -> QualityIssue | None:
    """An entry "sampling_rate_doubtful" with the ratio, where the record speaks for another rate.

    Parameters
    ----------
    record : Record
    machine : Machine
    speed : ShaftSpeed
        As found with the stated rate.

    Notes
    -----
    Only where the speed is off the nameplate or was not found: a speed where it belongs speaks for the rate.
    Then the supply's lines decide, where there are any: in their place they prove the rate right; off it by
    the ratio of the speed, or of two rates that recorders offer, they prove it wrong. Without them a speed
    that another usual rate would put within 0.3 % of the nameplate is told as a possibility.
    """
    nominal, tolerance = machine.nominal_speed_hz, machine.speed_tolerance
    by_pulses = speed.source in ("tacho", "encoder")
    if speed.source != "nameplate" and abs(speed.value_hz / nominal - 1.0) <= tolerance:
        return None
    rows = [row for row in record.data if np.all(np.isfinite(row)) and np.ptp(row) > 0][:_MOST_CHANNELS]
    stated = record.sample_rate_hz
    # An estimate is looked for near the nameplate only; a wrong rate may have moved the truth beyond.
    turn = speed.value_hz if by_pulses else _wide_speed(np.array(rows), stated, machine)
    off = turn / nominal
    if abs(off - 1.0) <= tolerance:
        return None
    own: list[float] = []
    if math.isfinite(turn):
        orders = [shaft.ratio for shaft in machine.shafts] + list(mesh_orders(machine).values())
        own = [turn * order for order in orders]
    for row in rows:
        if find_electrical_lines(row, stated, machine.line_frequency_hz, own, _LINE_ERROR).supply_hz:
            return None
    by_supply = _ratio_by_supply(rows, stated, machine, off, own)
    if by_supply is not None:
        ratio, supply, fundamental = by_supply
        detail = f"lines like those of a {supply:g} Hz supply lie at multiples of {fundamental:.2f} Hz"
        return _issue(detail, ratio, stated, "was")
    usual = _usual_ratio(off, stated)
    if usual is None:
        return None
    detail = f"the lines of the machine lie at {off:.4f} of where the nameplate's speed would have them"
    return _issue(detail, usual, stated, "may have been")


def _issue(seen: str, ratio: float, stated_hz: float, verb: str) -> QualityIssue:
    true = stated_hz / ratio
    usual = min(RATES_HZ, key=lambda rate: abs(rate / true - 1.0))
    about = f"{usual} Hz" if abs(usual / true - 1.0) < _SAME_RATE else f"about {true:.0f} Hz"
    detail = f"{seen}: the record {verb} sampled at {about}, not at {stated_hz:g} Hz (all frequencies are "
    return QualityIssue("sampling_rate_doubtful", "", f"{detail}read at {ratio:.4f} of what they are)")


def _ratio_by_supply(
    rows: Sequence[Row], stated_hz: float, machine: Machine, off: float, own: Sequence[float]
) -> tuple[float, float, float] | None:
    """Ratio, supply and fundamental of the comb with most lines that a wrong rate would explain."""
    supplies = (machine.line_frequency_hz,) if machine.line_frequency_hz > 0 else _SUPPLIES_HZ
    span = min(supplies) * _REACH[0], max(supplies) * _REACH[1]
    best: tuple[float, float, float] | None = None
    most = _FEWEST_LINES - 1
    for row in rows:
        for fundamental, lines in supply_like_combs(row, stated_hz, span, own, _LINE_ERROR):
            if lines <= most or any(abs(fundamental / one - 1.0) <= _PLACE for one in supplies):
                continue
            # Of 50 and 60 Hz the one that would put the speed nearest to the nameplate, or the rate.
            wrong = {supply: _misfit(fundamental / supply, off, stated_hz) for supply in supplies}
            supply = min(supplies, key=lambda one: wrong[one])
            if wrong[supply] <= (machine.speed_tolerance if math.isfinite(off) else _SAME_RATE):
                best, most = (fundamental / supply, supply, fundamental), lines
    return best


def _misfit(ratio: float, off: float, stated_hz: float) -> float:
    """How far the ratio of rates is from that of the speeds, or from one of usual rates."""
    if not _REACH[0] <= ratio <= _REACH[1]:
        return math.inf
    if math.isfinite(off):
        return abs(off / ratio - 1.0)
    return min(abs(stated_hz / rate / ratio - 1.0) for rate in RATES_HZ)


def _usual_ratio(ratio: float, stated_hz: float) -> float | None:
    """Of the stated rate over a usual one, next to a ratio found; None if none is near."""
    if not np.isfinite(ratio):
        return None
    others = [stated_hz / rate for rate in RATES_HZ if abs(stated_hz / rate - 1.0) > _SAME_RATE]
    others = [one for one in others if _REACH[0] <= one <= _REACH[1]]
    near = min(others, key=lambda one: abs(one / ratio - 1.0), default=math.nan)
    return near if abs(near / ratio - 1.0) <= _SAME_RATE else None


def _wide_speed(signals: Row, rate_hz: float, machine: Machine) -> float:
    """Speed by the lines of shafts and meshes, far from the nameplate's, too; NaN where none is sure."""
    nominal = machine.nominal_speed_hz
    if not math.isfinite(nominal) or signals.size == 0:
        return float("nan")
    try:
        track = track_speed(signals, rate_hz, machine, range_hz=(_REACH[0] * nominal, _REACH[1] * nominal))
    except InputError:  # too short, or nothing to look at
        return float("nan")
    return track.mean_hz if track.confidence >= _SURE else float("nan")
