"""Clipping: peaks cut off at the end of the range of a sensor or converter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_sensor
from gearsim_twin.causes.prior import LogNormal

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["Clipping", "Limit", "find_limit"]

_FEWEST = 4  # samples at a limit: of a signal that is not cut off one is largest, and ties are codes
_MARGIN = 0.01  # of the range: the stretch below the limit that tells the density of the signal there
_EXCESS = 3.0
_ROUNDING = 2e-6
_CREST = 0.015
_SAME = 0.01


@dataclass(frozen=True, slots=True)
class Limit:
    """Where a channel is cut off: magnitude of the limit, middle of both, and how many samples lie there."""

    range_m_s2: float
    offset_m_s2: float
    count: int


def find_limit(samples: NDArray[np.floating]) -> Limit | None:
    """Look for a limit.

    Parameters
    ----------
    samples : ndarray, shape (n,)

    Returns
    -------
    Limit or None
        None where the extremes are as sparse as those of a smooth signal.

    Notes
    -----
    The samples within a hundredth of the range below the largest value tell how many a code there would
    hold; where peaks are cut off, the largest value itself holds far more. Where a mean was taken out of a
    record, the limits lie around its negative.
    """
    x = np.asarray(samples, dtype=np.float64)
    if x.size < 256 or not np.all(np.isfinite(x)):
        return None
    low, high = float(x.min()), float(x.max())
    if low == high:
        return None
    above, below = _piled(x, high, high - low), _piled(-x, -low, high - low)
    if above and below:
        return Limit(0.5 * (high - low), 0.5 * (high + low), above + below)
    if above:
        return Limit(abs(high), 0.0, above)
    if below:
        return Limit(abs(low), 0.0, below)
    return None


def _piled(x: NDArray[np.float64], top: float, span: float) -> int:
    """Samples at the top, if they are far more than the density just below it gives to one code."""
    # Rounding of float32 and of units spreads a limit by parts in a million.
    count = int(np.count_nonzero(x >= top - _ROUNDING * span))
    if count < _FEWEST:
        return 0
    near = np.unique(x[x >= top - _MARGIN * span])
    beneath = int(np.count_nonzero(x >= top - _MARGIN * span)) - count
    apart = np.diff(near)
    apart = apart[apart > _ROUNDING * span]
    code = float(apart.min()) if apart.size else _ROUNDING * span
    # A sine has sqrt(2e-6 / 1e-2), one per cent and a half, of that stretch at its very crest.
    expected = beneath * max(min(code / (_MARGIN * span), 1.0), _CREST)
    return count if count > _FEWEST + _EXCESS * (expected + expected**0.5) else 0


class Clipping:
    """The end of the range of a sensor or converter."""

    name = "clipping"
    proven = True  # its finder has a false alarm rate of its own
    parameters: tuple[Parameter, ...] = (Parameter("range_m_s2", "m/s^2", LogNormal(50.0, 10.0, 1e-6, 1e6)),)
    confused_with: tuple[tuple[str, str], ...] = (
        ("dropouts", "the waveform itself: a dropout begins and ends anywhere"),
        ("unit_or_gain_error", "the levels of small vibration: clipping leaves them as they are"),
    )

    def applies(self, context: Context) -> bool:
        """Wherever there are accelerometers."""
        return bool(context.views)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """All channels that are cut off, the range of the one with most samples there."""
        found: dict[str, Limit] = {}
        for view, model in zip(context.views, context.simulated_views, strict=True):
            for channel in view.record.channels:
                limit = find_limit(view.signal(channel))
                if limit is not None and channel in model.record.channels:
                    own = find_limit(model.signal(channel))
                    # The model has the very same: its sensors are known to end there.
                    if own is not None and abs(own.range_m_s2 / limit.range_m_s2 - 1) < _SAME:
                        continue
                if limit is not None and (channel not in found or limit.count > found[channel].count):
                    found[channel] = limit
        if not found:
            return []
        top = max(found.values(), key=lambda limit: limit.count)
        start: dict[str, float | str] = {
            "range_m_s2": top.range_m_s2,
            # A limit is a value that the samples themselves show.
            "std:range_m_s2": 1e-4 * top.range_m_s2,
        }
        return [start | {f"share:{name}": one.range_m_s2 / top.range_m_s2 for name, one in found.items()}]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """The content with that range on the channels that are cut off."""
        for key, share in values.items():
            if key.startswith("share:"):
                limit = float(values["range_m_s2"]) * float(share)
                content = with_sensor(content, key.removeprefix("share:"), "range", f"{limit:.9g} m/s^2")
        return content

    def signature(self, values: Values) -> str:
        """In plain words."""
        channels = ", ".join(key.removeprefix("share:") for key in values if key.startswith("share:"))
        return f"peaks of {channels} are cut off at {float(values['range_m_s2']):.4g} m/s^2"
