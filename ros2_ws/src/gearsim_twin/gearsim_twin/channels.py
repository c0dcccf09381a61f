"""Which channels the search for causes looks at: those that differ most from the model.

What a cause does shows best where it is; the other channels cost time and tell little more. All channels
count again in the final scores.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearsim_twin.compare.chains import apply
from gearsim_twin.compare.discrepancy import compare
from gearsim_twin.compare.features import Features
from gearsim_twin.compare.nuisances import Limits, fit_nuisances

__all__ = ["telling_channels"]

# What one place counts for at most, in standard deviations: a channel that is wrong everywhere comes first.
_MOST_Z = 6.0


def telling_channels(
    pairs: Sequence[tuple[Features, Features]], channels: Sequence[str], most: int, limits: Limits
) -> tuple[str, ...]:
    """So many of the channels, in their order, that differ most once the measuring chain is fitted.

    Parameters
    ----------
    pairs : sequence of (measured, simulated)
        Of the nominal model.
    channels : sequence of str
    most : int
    limits : Limits
        Of the chain; where it may have any gain, a gain tells nothing.
    """
    if len(channels) <= most:
        return tuple(channels)
    chain = fit_nuisances(pairs, limits)
    score = dict.fromkeys(channels, 0.0)
    for measured, simulated in pairs:
        compared = compare(measured, apply(chain, simulated))
        excess = np.clip(compared.z**2, 0.0, _MOST_Z**2)
        where = np.array([place.channel for place in measured.places])
        for channel in channels:
            score[channel] += float(excess[where == channel].sum())
    best = sorted(channels, key=lambda channel: -score[channel])[:most]
    return tuple(channel for channel in channels if channel in best)
