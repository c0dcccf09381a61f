"""What chance does to a model's levels: teeth are wrong at random, each machine's in its own way.

A simulation shows one machine of a kind; the measured one is another. Where a line comes from random errors
its level in one simulation says little: several seeds tell its mean and its scatter, and a model is compared
by these. What a cause adds is not random, so both fade where the level rises above what chance made of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.compare.features import Features
from gearsim_twin.stack import Array, group_of

__all__ = ["Realisations", "realisations_of"]

# Scatter over a few seeds is pooled with that of the same kind of places, as if that were so many more.
_PRIOR_SEEDS = 3.0
# Fewer machines, or places, tell nothing of how alike differences are.
_FEWEST = 4
# Twice for the measured machine, twice for the simulated one.
_BEATS = 4.0
# Places where machines differ by less tell nothing of how alike they differ.
_LEAST_DB = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Realisations:
    """Chance in one record's levels, all arrays of shape (n,), dB.

    Attributes
    ----------
    base_db : ndarray
        Level of the nominal model with the seed that all trials have.
    offset_db : ndarray
        Mean over seeds less that.
    std_db : ndarray
        Of another machine's level about that mean.
    effect : mapping of str to float
        By domain, how many of the differences between machines say as much as one that is independent.
    """

    base_db: Array
    offset_db: Array
    std_db: Array
    effect: Mapping[str, float] = field(default_factory=dict)

    def applied(self, simulated: Features) -> Features:
        """A simulation as the mean of its kind, with the scatter of its kind beside that of sampling.

        Notes
        -----
        Of a fixed amplitude beside a random one of mean square s^2 the power scatters by s^4 + 2 s^2 c^2
        (noncentral chi-square): what a cause adds beats with what chance drew. So it does in the simulation,
        with the errors of its own seed.
        """
        rise = np.maximum(np.nan_to_num(simulated.level_db - self.base_db), 0.0)
        fading = 10.0 ** (-0.1 * rise)
        offset = self.offset_db * fading
        beating = np.sqrt(1.0 + _BEATS * (1.0 / fading - 1.0))
        old = simulated.levels
        levels = replace(
            old,
            level_db=old.level_db + offset,
            height_db=old.height_db + offset,
            std_db=np.hypot(old.std_db, self.std_db * fading * beating),
        )
        return replace(simulated, levels=levels)


def realisations_of(seeds: Sequence[Features]) -> Realisations:
    """From one record's simulations with different seeds, the one that all trials have first."""
    level = np.stack([each.level_db for each in seeds])
    told = np.all(np.isfinite(level), axis=0)
    level = np.where(told, level, 0.0)
    count = len(seeds)
    mean = level.mean(axis=0)
    sampling = np.mean([np.where(np.isfinite(each.std_db), each.std_db, 0.0) ** 2 for each in seeds], axis=0)
    own = np.sum((level - mean) ** 2, axis=0)
    kinds: dict[tuple[str, str, str], int] = {}
    kind = np.array([kinds.setdefault((p.domain, p.kind, p.channel), len(kinds)) for p in seeds[0].places])
    total = np.bincount(kind[told], weights=own[told], minlength=len(kinds))
    number = np.bincount(kind[told], minlength=len(kinds)) * (count - 1)
    pooled = (total / np.maximum(number, 1))[kind]
    variance = (own + _PRIOR_SEEDS * pooled) / (count - 1 + _PRIOR_SEEDS)
    # Sampling scatters seeds as well and is counted on its own; the mean is known to a part of the scatter.
    scatter = np.maximum(variance - sampling, 0.0) * (1.0 + 1.0 / count)
    return Realisations(
        base_db=np.where(told, level[0], np.nan),
        offset_db=np.where(told, mean - level[0], 0.0),
        std_db=np.where(told, np.sqrt(scatter), 0.0),
        effect=_effects(seeds[0], level - mean, told & seeds[0].stands_out),
    )


def _effects(features: Features, error_db: Array, told: NDArray[np.bool_]) -> dict[str, float]:
    """By domain, places over the effective number of independent ones, k^2 / sum of squared correlations.

    That many independent differences would have sums of squares that scatter as much (Bretherton et al.,
    J. Climate 12 (1999) 1990-2009). Of n machines squared correlations of independent places are 1 / (n - 1).
    """
    count = error_db.shape[0]
    spread = error_db.std(axis=0, ddof=1)
    groups = np.array([group_of(place) for place in features.places])
    found = {}
    for name in dict.fromkeys(groups.tolist()):
        mine = told & (groups == name) & (spread > _LEAST_DB)
        number = int(np.count_nonzero(mine))
        if count < _FEWEST or number < _FEWEST:
            continue
        z = error_db[:, mine] / spread[mine] / np.sqrt(count - 1.0)
        square = (float(np.sum((z @ z.T) ** 2)) - number) / (number * (number - 1.0))
        chance = 1.0 / (count - 1.0)
        found[name] = 1.0 + (number - 1.0) * max((square - chance) / (1.0 - chance), 0.0)
    return found
