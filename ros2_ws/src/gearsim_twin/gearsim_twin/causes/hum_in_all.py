"""Hum that hides beside the shaft's orders, told by all records at once.

In a single short record a line of the supply some hundredths of a hertz from an order is nearly the order
itself. From record to record the speed differs a little, the supply and its hum do not: a height that fits
the distances in all records is the supply's. The odds are those of sines at the supply's multiples, of the
same heights in all records, against the orders alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from gearsim_twin.causes.expected_lines import odds_of_sine
from gearsim_twin.causes.lines import BESIDE, SKIRT, SlowPart, line_spectrum, machine_lines, slow_part

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context
    from gearsim_twin.view import View

__all__ = ["HumLines", "hum_in_all"]

Array = NDArray[np.float64]

_TOP_HZ = 800.0
_ORDERS = (1, 2, 3, 5, 7)  # those of most hum
_LOW = 3
_REACH = 0.001  # of the supply's frequency, and steps on each side
_STEPS = 6
_HEIGHTS = np.geomspace(1.0, 300.0, 24)  # in standard deviations of a line in noise
_LINE = 6.0  # evidence of a line that may be hum's first
_CONVINCING = 14.0  # nats: one of a million sound machines
_EACH = 5.0  # nats of two records at least, so that no order that swells in one record is hum
_HEIGHT_ERROR = 0.15  # heights are tried a quarter apart
_OVER = 2.0  # times the highest line beside it


@dataclass(frozen=True, slots=True, eq=False)
class HumLines:
    """Multiples of a supply in one channel of a record; `noise` and `highest` by multiple."""

    slow: SlowPart
    noise: dict[int, float]
    highest: dict[int, float]

    @classmethod
    def of(cls, view: View, channel: str, supply_hz: float, orders: Sequence[int]) -> HumLines:
        """With the noise beside each multiple and the height of the highest line there."""
        slow = slow_part(view, channel, _TOP_HZ)
        rest = slow.without_orders(_TOP_HZ)
        spectrum = line_spectrum(rest, slow.sample_rate_hz)
        highest = {}
        for k in orders:
            at = 0 if spectrum is None else round(k * supply_hz / spectrum.step_hz)
            beside = np.r_[at - BESIDE : at - SKIRT, at + SKIRT + 1 : at + BESIDE + 1]
            level = np.zeros(0) if spectrum is None else spectrum.amplitude
            highest[k] = float(level[beside[(beside > 0) & (beside < level.size)]].max(initial=0.0))
        return cls(slow, {k: slow.line_noise(k * supply_hz, rest) for k in orders}, highest)

    def sine(self, order: int, supply_hz: float) -> tuple[Array, Array]:
        """Amplitudes of cosine and sine at a multiple, and the inverse of their covariance."""
        return self.slow.sine(order * supply_hz, self.noise[order])


def hum_in_all(
    context: Context, channel: str, supplies_hz: Sequence[float]
) -> tuple[float, float, dict[int, float], float] | None:
    """Frequency of the supply, its standard deviation, amplitudes by multiple, and that of the first.

    None where no hum shows.

    Parameters
    ----------
    context : Context
        Two records at least, with angles counted by marks.
    channel : str
    supplies_hz : sequence of float
        Those whose first multiples an order may hide are looked at.
    """
    views = [view for view in (*context.views, *context.more_views) if channel in view.record.channels]
    known = [machine_lines(view) for view in views]
    if len(views) < 2 or not all(each.counted for each in known):
        return None
    best: tuple[float, float, float, dict[int, float]] | None = None
    for supply in supplies_hz:
        steps = [1.0 / view.record.seconds for view in views]
        if not any(
            lines.explain(k * supply, step)
            for lines, step in zip(known, steps, strict=True)
            for k in range(1, _LOW + 1)
        ):
            continue
        if not all(_shows(view, channel, supply) for view in views):
            continue
        looks = [HumLines.of(view, channel, supply, _ORDERS) for view in views]
        found = _at_supply(looks, supply)
        if found is not None and (best is None or found[0] > best[0]):
            best = found
    return None if best is None else (*best[1:], _HEIGHT_ERROR * best[3][1])


def _shows(view: View, channel: str, supply_hz: float) -> bool:
    """Whether there is a line at all, of order or supply; to look closer costs a hundred times as much."""
    slow = slow_part(view, channel, _TOP_HZ)
    spectrum = line_spectrum(slow.signal, slow.sample_rate_hz)
    return spectrum is not None and float(spectrum.at(np.array([supply_hz]))[0]) > _LINE


def _at_supply(
    looks: list[HumLines], supply_hz: float
) -> tuple[float, float, float, dict[int, float]] | None:
    """Odds, frequency with its standard deviation, amplitudes; None where the odds do not convince."""
    trials = supply_hz * (1 + _REACH * np.arange(-_STEPS, _STEPS + 1) / _STEPS)
    lowest = {k: min((2 * one.noise[k] / one.slow.signal.size) ** 0.5 for one in looks) for k in _ORDERS}
    heights = {k: _HEIGHTS * one for k, one in lowest.items()}
    # Odds by trial, multiple, record and height.
    odds = np.array(
        [
            [[odds_of_sine(*look.sine(k, f), heights[k]) for look in looks] for k in _ORDERS]
            for f in trials.tolist()
        ]
    )
    of_lines = logsumexp(odds.sum(axis=2), axis=2) - np.log(_HEIGHTS.size)
    total = np.logaddexp(0.0, of_lines).sum(axis=1) - len(_ORDERS) * np.log(2.0)
    at = int(np.argmax(total))
    top = np.argmax(odds.sum(axis=2)[at], axis=1)
    amplitude = {
        k: float(heights[k][top[n]])
        for n, k in enumerate(_ORDERS)
        if of_lines[at, n] > 0.0 and heights[k][top[n]] > _OVER * max(look.highest[k] for look in looks)
    }
    kept = [n for n, k in enumerate(_ORDERS) if k in amplitude]
    each = np.sum([odds[at, n, :, top[n]] for n in kept], axis=0) if kept else np.zeros(len(looks))
    convincing = float(np.sum(of_lines[at, kept])) - np.log(trials.size) > _CONVINCING
    if 1 not in amplitude or not convincing or np.count_nonzero(each > _EACH) < 2:
        return None
    weight = np.exp(total - total[at])
    mean = float(np.sum(weight * trials) / weight.sum())
    spread = float(np.sqrt(np.sum(weight * (trials - mean) ** 2) / weight.sum()))
    step = float(trials[1] - trials[0])
    return float(total[at]), mean, float(np.hypot(spread, step)), amplitude
