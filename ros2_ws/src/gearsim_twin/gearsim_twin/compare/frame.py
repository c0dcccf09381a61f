"""What all representations of a case share: channels, resolutions, carrier bands and fault families.

Made once from the machine and the measured views, so that measured and simulated records are looked at
through the same windows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gearsim_dsp.angle.tracked_orders import least_spacing
from gearsim_dsp.bands import TOP_SHARE
from gearsim_dsp.kinematics import fault_families
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine
from gearsim_twin.view import View

__all__ = ["Family", "Frame", "make_frame"]

# Lines take five bins of a Hann window. Windows hold so many that neighbours are apart, are never fewer than
# four of a record (2.5 lengths, half overlapping), and seldom more than seven: cage lines are near others.
_BINS_APART = 6.0
_FEWEST_WINDOWS, _MOST_WINDOWS = 2.5, 4.0
# Of the slow reference shaft of a planetary stage, whose lines lie whole turns apart.
_LEAST_TURNS = 5.0
_TIME_WINDOWS, _LONGEST_S = 4.5, 2.0
_LEAST_SECONDS = 0.25
# Carrier bands: above the fault lines themselves (they would beat), each wide enough for four harmonics.
_CLEAR_OF, _LOW_SHARE, _HARMONIC_WIDTHS = 6.0, 0.01, 8.8
_SAME_ORDER = 1e-3
_BEYOND = 1.25  # of how far a record has a family off its place


@dataclass(frozen=True, slots=True)
class Family:
    """Fault lines of one order; bearings of one kind on shafts of one speed share them.

    `sideband_order` is the spacing of sidebands (0: none); `tolerance` the relative half-width of the search.
    """

    label: str
    fault: str
    order: float
    sideband_order: float
    tolerance: float


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """Common settings of the representations.

    Attributes
    ----------
    machine : Machine
    channels : tuple of str
        Those that all measured views have.
    speed_hz : float
        Median speed of the views' reference shaft; NaN where none is known, and no orders then.
    window_s, window_turns : float
        Lengths of the windows of spectra over time and over angle; NaN turns: no orders.
    top_hz : float
        Highest frequency that all views hold.
    bands_hz : tuple of (low, high)
        Carrier bands, side by side.
    families : tuple of Family
    masked_orders : tuple of float
        Turns of shafts whose harmonics are left out of noise spectra.
    smear : float
        Relative width of lines by a speed that is known as a mean alone.
    tones : tuple of (channel, at, unit)
        Lines that belong to no shaft and are compared by themselves; left out of noise spectra.
    """

    machine: Machine
    channels: tuple[str, ...]
    speed_hz: float
    window_s: float
    window_turns: float
    top_hz: float
    bands_hz: tuple[tuple[float, float], ...]
    families: tuple[Family, ...]
    masked_orders: tuple[float, ...]
    smear: float
    tones: tuple[tuple[str, float, str], ...] = ()

    @property
    def has_orders(self) -> bool:
        """Whether speed and length allow spectra over the angle."""
        return math.isfinite(self.window_turns)

    @property
    def highest_envelope_order(self) -> float:
        """Up to where envelope spectra are wanted: eight harmonics of families, eight turns of a shaft."""
        orders = [f.order for f in self.families] + [s.ratio for s in self.machine.shafts] + [1.0]
        return 8.2 * max(orders)

    def half_bins(self, order: float) -> int:
        """Half the width of a line in bins of the order spectra, beside its middle one."""
        return max(2, math.ceil(self.smear * order * self.window_turns))


def make_frame(
    machine: Machine, views: Sequence[View], shifted: Sequence[tuple[str, float, float]] = ()
) -> Frame:
    """The settings for a case.

    Parameters
    ----------
    machine : Machine
    views : sequence of View
    shifted : sequence of (fault, order, share)
        Families of a nameplate's order that lie off it by a share of it: they are looked for so far.

    Raises
    ------
    InputError
        When there are no views, no common channels, or less than a quarter of a second of signal.
    """
    channels, seconds, rate_hz = _common(views)
    speeds = [view.speed_hz for view in views if math.isfinite(view.speed_hz) and view.speed_hz > 0]
    speed_hz = float(np.median(speeds)) if len(speeds) == len(views) else math.nan
    turns = min(view.turns for view in views) if math.isfinite(speed_hz) else math.nan
    window_turns = _window_turns(machine, turns)
    window_s = min(seconds / _TIME_WINDOWS, _LONGEST_S)
    top_hz = TOP_SHARE * rate_hz
    families = _families(machine, shifted) if math.isfinite(window_turns) else ()
    loose = [view.speed.relative_error for view in views if view.phase is None]
    return Frame(
        machine,
        channels,
        speed_hz,
        window_s,
        window_turns,
        top_hz,
        _bands(top_hz, max(speeds, default=math.nan), families, len(channels)),
        families,
        _masked(machine, speed_hz, window_s),
        float(max((x for x in loose if math.isfinite(x)), default=0.0)),
    )


def _common(views: Sequence[View]) -> tuple[tuple[str, ...], float, float]:
    if not views:
        raise InputError("comparison", "views", 0, "one record or more")
    shared = set.intersection(*(set(view.record.channels) for view in views))
    channels = tuple(name for name in views[0].record.channels if name in shared)
    if not channels:
        lists = "; ".join(", ".join(view.record.channels) for view in views)
        raise InputError("comparison", "channels", lists, "at least one that all records have")
    seconds = min(view.record.seconds for view in views)
    if seconds < _LEAST_SECONDS:
        raise InputError("comparison", "duration", f"{seconds:.3g} s", f"{_LEAST_SECONDS:g} s or more")
    return channels, seconds, min(view.record.sample_rate_hz for view in views)


def _window_turns(machine: Machine, turns: float) -> float:
    if not turns >= _LEAST_TURNS:
        return math.nan
    apart = _BINS_APART / min(0.5, least_spacing(machine))
    return min(max(apart, turns / _MOST_WINDOWS), turns / _FEWEST_WINDOWS)


def _families(machine: Machine, shifted: Sequence[tuple[str, float, float]]) -> tuple[Family, ...]:
    groups: list[tuple[list[str], Family]] = []
    for family in fault_families(machine):
        for names, first in groups:
            if first.fault == family.fault and abs(family.order / first.order - 1) < _SAME_ORDER:
                names.append(family.component)
                break
        else:
            new = Family(family.label, family.fault, family.order, family.sideband_order, family.tolerance)
            groups.append(([family.component], new))
    return tuple(
        Family(f"{f.label} of {_listed(names)}", f.fault, f.order, f.sideband_order, _reach(f, shifted))
        for names, f in groups
    )


def _reach(family: Family, shifted: Sequence[tuple[str, float, float]]) -> float:
    """How far a family is looked for: as the nameplate has it, or beyond where a record has it."""
    own = [
        _BEYOND * abs(share)
        for fault, order, share in shifted
        if fault == family.fault and abs(order / family.order - 1) < _SAME_ORDER
    ]
    return max([family.tolerance, *own])


def _listed(names: list[str]) -> str:
    return ", ".join(names) if len(names) <= 2 else f"{names[0]} and {len(names) - 1} alike"


def _bands(
    top_hz: float, speed_hz: float, families: tuple[Family, ...], channels: int
) -> tuple[tuple[float, float], ...]:
    reach = max((f.order + f.sideband_order for f in families), default=0.0)
    reach_hz = 0.0 if math.isnan(speed_hz) else reach * speed_hz
    low = max(_LOW_SHARE * top_hz, min(_CLEAR_OF * reach_hz, 0.2 * top_hz))
    count = 4 if channels <= 2 else 3 if channels <= 4 else 2
    while count > 1:
        edges = np.geomspace(low, top_hz, count + 1)
        if edges[1] - edges[0] >= _HARMONIC_WIDTHS / 2 * reach_hz:
            break
        count -= 1
    edges = np.geomspace(low, top_hz, count + 1)
    return tuple((float(a), float(b)) for a, b in pairwise(edges))


def _masked(machine: Machine, speed_hz: float, window_s: float) -> tuple[float, ...]:
    """The fastest shafts, as long as two fifths of a spectrum's lines are left between their harmonics."""
    if math.isnan(speed_hz):
        return ()
    left = 1.0
    masked = []
    for ratio in sorted({round(shaft.ratio, 9) for shaft in machine.shafts}, reverse=True):
        left *= 1 - 5 / (ratio * speed_hz * window_s)
        if left < 0.4:
            break
        masked.append(ratio)
    return tuple(masked)
