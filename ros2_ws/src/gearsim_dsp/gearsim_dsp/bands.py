"""Which bands to demodulate: a bank that covers the spectrum, wide enough for the fault lines sought."""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy import fft as sfft

from gearsim_dsp.kinematics import fault_families
from gearsim_io.nameplate import Machine
from gearsim_io.numbers import number

__all__ = ["LEAST_TURNS", "Band", "BandPlan", "least_window_s", "plan_bands"]

TOP_SHARE = 0.46
"""Highest share of the sampling rate used: above lie anti-alias filters, where a few quanta look impulsive.
"""

LEAST_TURNS = 8.0
"""Turns of the reference shaft in a window, below which bearings cannot be judged."""

_MAX_BANDS = 12
_SLOWER = 1.1  # a machine may run that much slower than it is said to
_HARMONICS = 8
_BAND_HARMONICS = 4
_CLEAR_OF = 6.0
"""The bank begins at so many times the highest fault frequency: below it the fault lines of the signal itself
(ball passes, waviness) would beat against each other."""


@dataclass(frozen=True, slots=True)
class Band:
    """A frequency band in Hz, 0 < low < high.

    `why` tells who chose it: "bank" and "between" (`BandPlan`), "kurtogram", "given".
    """

    low_hz: float
    high_hz: float
    why: str = "given"


@dataclass(frozen=True, slots=True)
class BandPlan:
    """The bank of bands (all `width_hz` wide) and the order axis of their envelope spectra.

    `bank` covers the spectrum side by side. A resonance at a border is cut in two; the bands of `between` are
    centred on the borders.
    """

    bank: tuple[Band, ...]
    between: tuple[Band, ...]
    width_hz: float
    top_order: float
    order_step: float
    floor_hz: float
    ceiling_hz: float
    least_width_hz: float

    def fit(self, band: Band) -> Band:
        """The band moved and widened as little as needed to hold the lines sought inside the usable range."""
        width = min(max(band.high_hz - band.low_hz, self.least_width_hz), self.ceiling_hz - self.floor_hz)
        centre = 0.5 * (band.low_hz + band.high_hz)
        low = min(max(centre - 0.5 * width, self.floor_hz), self.ceiling_hz - width)
        return Band(low, low + width, band.why)


def least_window_s(speed_hz: float) -> float:
    """Length of windows that hold `LEAST_TURNS` of a shaft of about that speed, in tenths of a second."""
    return math.ceil(10 * _SLOWER * LEAST_TURNS / speed_hz) / 10


def plan_bands(
    samples: int, sample_rate_hz: float, speed_hz: float, machine: Machine
) -> tuple[BandPlan | None, list[tuple[str, str]]]:
    """Plan the bank for windows of `samples` samples.

    Parameters
    ----------
    samples : int
    sample_rate_hz, speed_hz : float
        `speed_hz` is the reference shaft's, by tacho or nameplate.
    machine : Machine
        Its fault families say how wide a band must be: twice the highest fundamental with its sidebands.

    Returns
    -------
    plan : BandPlan or None
        None when there is nothing to look for (no bearings, or no speed) or the window does not allow it.
    issues : list of (issue, detail)
        Why the window does not allow it: "too_short" or "rate_too_low".
    """
    families = fault_families(machine)
    if not families or not (math.isfinite(speed_hz) and speed_hz > 0):
        return None, []
    turns = samples / sample_rate_hz * speed_hz
    if turns < LEAST_TURNS:
        least_s = number(LEAST_TURNS / speed_hz, 2)
        need = f"at least {LEAST_TURNS:.0f} are needed ({least_s} s at {number(speed_hz, 3)} Hz)"
        detail = f"bearings cannot be judged by {turns:.1f} turns of the shaft; {need}"
        return None, [("too_short", detail)]
    plan_hz = _plan_speed(speed_hz, machine.nominal_speed_hz)
    reach_hz = plan_hz * max(f.order + f.sideband_order for f in families)
    least_width = 2.2 * reach_hz
    step_hz = sample_rate_hz / samples
    ceiling = TOP_SHARE * sample_rate_hz
    floor = max(4 * step_hz, 0.005 * sample_rate_hz, min(_CLEAR_OF * reach_hz, 0.2 * ceiling))
    if ceiling - floor < max(least_width, 32 * step_hz):
        need_hz = (least_width + floor) / TOP_SHARE
        detail = f"{sample_rate_hz:g} Hz; at least {need_hz:.0f} Hz are needed for the lines sought"
        return None, [("rate_too_low", detail)]
    good_width = max(_BAND_HARMONICS * least_width, 32 * step_hz)
    count = min(_MAX_BANDS, max(1, int((ceiling - floor) / good_width)))
    width = (ceiling - floor) / count
    bank = tuple(Band(floor + k * width, floor + (k + 1) * width, "bank") for k in range(count))
    between = tuple(
        Band(floor + (k + 0.5) * width, floor + (k + 1.5) * width, "between") for k in range(count - 1)
    )
    top = min(_HARMONICS * max(f.order for f in families), 0.8 * width / plan_hz)
    order_step = 0.5 / sfft.next_fast_len(math.ceil(samples / sample_rate_hz * plan_hz), real=True)
    return BandPlan(bank, between, width, top, order_step, floor, ceiling, least_width), []


def _plan_speed(speed_hz: float, nominal_hz: float) -> float:
    """A speed a little above the shaft's that is the same for all near it, so that windows share their bands.

    The steps are 25 % apart, the first one 10 % above the nominal speed (or above 1 Hz where that is
    unknown).
    """
    base = 1.1 * (nominal_hz if math.isfinite(nominal_hz) else 1.0)
    return float(base * 1.25 ** math.ceil(math.log(speed_hz / base) / math.log(1.25) - 1e-9))
