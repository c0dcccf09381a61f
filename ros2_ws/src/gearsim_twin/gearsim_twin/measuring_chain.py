"""The measuring chain as the workbench wants it: fitted, applied, and held to what is assumed of it.

A gain, a bandwidth or a coloured floor that is needed costs: otherwise the chain would explain a wrong unit,
a missing filter or a strange floor away, which are causes of their own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gearsim_twin.compare.chains import ChannelNuisance, Nuisance, apply
from gearsim_twin.compare.features import Features, Plan
from gearsim_twin.compare.nuisances import Limits, fit_nuisances
from gearsim_twin.stack import Assumed

__all__ = ["MeasuringChain", "measuring_chain"]

# A calibrated accelerometer on a stud is right to a tenth or so; its converter's filter is flat in the band
# compared; noise of sensors may rise as 1/f.
GAIN_STD_DB, TOP_STD_DB, COLOUR_STD_DB = 1.0, 1.0, 6.0
_UNKNOWN_GAIN_DB = 10.0
_FEWEST_BANDS, _NOISY_DB = 4, 3.0
_MOST_DB = 60.0


@dataclass(frozen=True, slots=True, eq=False)
class MeasuringChain:
    """Gains, floors and bandwidths of some channels.

    Attributes
    ----------
    channels : tuple of str
    top_hz : float
        Up to which records are compared.
    limits : Limits
    assumed : tuple of Assumed
        Of each channel: gain, loss at the top, colour of the floor.
    """

    channels: tuple[str, ...]
    top_hz: float
    limits: Limits
    assumed: tuple[Assumed, ...]

    def fit(self, pairs: Sequence[tuple[Features, Features]]) -> tuple[Nuisance, tuple[float, ...]]:
        """The best chain for (measured, simulated) features of some records, with what it needed."""
        found = fit_nuisances(pairs, self.limits)
        corrections: list[float] = []
        for channel in self.channels:
            chain = found.of(channel)
            loss = 10.0 * math.log10(1.0 + (self.top_hz / chain.corner_hz) ** 4)
            corrections += [chain.gain_db, loss, _colour_db(chain, [simulated for _, simulated in pairs])]
        return found, tuple(float(np.clip(each, -_MOST_DB, _MOST_DB)) for each in corrections)

    def apply(self, nuisance: tuple[Nuisance, tuple[float, ...]], simulated: Features) -> Features:
        """Simulated features as the chain would show them."""
        return apply(nuisance[0], simulated)

    def corrections_db(self, nuisance: tuple[Nuisance, tuple[float, ...]]) -> tuple[float, ...]:
        """What it needed of each assumption."""
        return nuisance[1]


def measuring_chain(plan: Plan, levels_known: bool) -> MeasuringChain:
    """The chain of the channels of a plan; gains are free where the unit of the records is not known."""
    channels = plan.frame.channels
    gain = GAIN_STD_DB if levels_known else _UNKNOWN_GAIN_DB
    assumed = tuple(
        Assumed(channel, kind, std)
        for channel in channels
        for kind, std in (("gain", gain), ("top", TOP_STD_DB), ("colour", COLOUR_STD_DB))
    )
    limits = Limits() if levels_known else Limits(gain_std_db=_UNKNOWN_GAIN_DB)
    return MeasuringChain(channels, plan.frame.top_hz, limits, assumed)


def _colour_db(chain: ChannelNuisance, simulated: Sequence[Features]) -> float:
    """Spread of the floor's density over the bands that it rules; 0 where it rules hardly any."""
    found = []
    for features in simulated:
        levels = features.levels
        for k, place in enumerate(features.places):
            if place.channel == chain.channel and place.domain == "psd" and np.isfinite(levels.level_db[k]):
                hz, width = levels.frequency_hz[k : k + 1], float(levels.bandwidth_hz[k])
                floor = float(chain.floor(hz)[0])
                model = float(chain.gain(hz)[0]) * 10 ** (0.1 * float(levels.level_db[k]))
                if floor * width > model * 10 ** (0.1 * _NOISY_DB):
                    found.append(10.0 * math.log10(floor))
    return float(np.std(found)) if len(found) >= _FEWEST_BANDS else 0.0
