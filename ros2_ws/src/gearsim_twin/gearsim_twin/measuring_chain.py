"""The measuring chain as the workbench wants it: fitted, applied, and held to what is assumed of it.

A gain, a bandwidth or a coloured floor that is needed costs: otherwise the chain would explain a wrong unit,
a missing filter or a strange floor away, which are causes of their own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gearsim_twin.compare.chains import ChannelNuisance, Nuisance, apply
from gearsim_twin.compare.discrepancy import compare
from gearsim_twin.compare.features import Features, Plan
from gearsim_twin.compare.nuisances import Limits, fit_several
from gearsim_twin.stack import Assumed

__all__ = ["MeasuringChain", "measuring_chain"]

# A calibrated accelerometer on a stud is right to a tenth or so; its converter's filter is flat in the band
# compared; noise of sensors may rise as 1/f.
GAIN_STD_DB, TOP_STD_DB, COLOUR_STD_DB = 1.0, 1.0, 6.0
# Of a sensor that may have been taken off and put on again in the meantime.
_SAME_GAIN_DB = 0.5
_UNKNOWN_GAIN_DB = 30.0
_FEWEST_BANDS, _NOISY_DB = 4, 3.0
_MOST_DB = 60.0
_STIFF_DB = 0.1
# Of the places compared, how many are independent differences: as yardsticks begin with.
_SHARE = 0.3


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
        """The best chain for (measured, simulated) features of some records, with what it needed.

        Per channel the better of two, by the differences that it leaves and by what it costs: one with gain
        and bandwidth as the levels want them, and one with a floor alone. The former may make up for what a
        model lacks altogether by a gain that no sensor has.
        """
        free, stiff = fit_several(pairs, (self.limits, Limits(gain_std_db=_STIFF_DB)))
        bare = tuple(replace(stiff.of(name), gain_db=0.0, corner_hz=math.inf) for name in self.channels)
        rivals = (Nuisance(tuple(free.of(name) for name in self.channels)), Nuisance(bare))
        needs = [[self._needs(chain, pairs) for chain in rival.channels] for rival in rivals]
        costs = [self._costs(rival, each, pairs) for rival, each in zip(rivals, needs, strict=True)]
        best = [int(costs[1][k] < costs[0][k]) for k in range(len(self.channels))]
        chains = tuple(rivals[which].channels[k] for k, which in enumerate(best))
        corrections = tuple(need for k, which in enumerate(best) for need in needs[which][k])
        rest = tuple(chain for chain in free.channels if chain.channel not in self.channels)
        return Nuisance((*chains, *rest)), corrections

    def _needs(self, chain: ChannelNuisance, pairs: Sequence[tuple[Features, Features]]) -> tuple[float, ...]:
        """Gain, loss at the top and colour of the floor that a chain has, dB."""
        loss = 10.0 * math.log10(1.0 + (self.top_hz / chain.corner_hz) ** 4)
        needs = (chain.gain_db, loss, _colour_db(chain, [simulated for _, simulated in pairs]))
        return tuple(float(np.clip(each, -_MOST_DB, _MOST_DB)) for each in needs)

    def _costs(
        self,
        rival: Nuisance,
        needs: Sequence[tuple[float, ...]],
        pairs: Sequence[tuple[Features, Features]],
    ) -> list[float]:
        """Minus log likelihood of the differences left in each channel, and of what it needs, in nats."""
        stds = [[each.std_db for each in self.assumed if each.channel == name] for name in self.channels]
        costs = [
            0.5 * sum((need / std) ** 2 for need, std in zip(own, known, strict=True))
            for own, known in zip(needs, stds, strict=True)
        ]
        for measured, simulated in pairs:
            compared = compare(measured, apply(rival, simulated))
            density = compared.densities()
            channel = np.array([place.channel for place in measured.places])
            for k, name in enumerate(self.channels):
                costs[k] -= _SHARE * float(density[channel == name].sum())
        return costs

    def apply(self, nuisance: tuple[Nuisance, tuple[float, ...]], simulated: Features) -> Features:
        """Simulated features as the chain would show them."""
        return apply(nuisance[0], simulated)

    def corrections_db(self, nuisance: tuple[Nuisance, tuple[float, ...]]) -> tuple[float, ...]:
        """What it needed of each assumption."""
        return nuisance[1]


def measuring_chain(plan: Plan, levels_known: bool, as_before: bool = False) -> MeasuringChain:
    """The chain of the channels of a plan.

    Gains are free where the unit of the records is not known. `as_before` is for sensors that have measured
    the healthy machine as well.
    """
    channels = plan.frame.channels
    gain = (_SAME_GAIN_DB if as_before else GAIN_STD_DB) if levels_known else _UNKNOWN_GAIN_DB
    assumed = tuple(
        Assumed(channel, kind, std)
        for channel in channels
        for kind, std in (("gain", gain), ("top", TOP_STD_DB), ("colour", COLOUR_STD_DB))
    )
    limits = Limits(gain_std_db=gain)
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
