"""What records of the healthy machine teach of each place, brought to the conditions of another record.

Levels of the healthy records are taken over as they are, each shifted by what the calibrated model says that
the little difference in speed and load does. What runs of one machine differ by, beyond sampling, is learnt
where several healthy records are at hand, and assumed of one. Records under clearly other conditions teach
the numbers of the machine and nothing of places: lines lie beside other resonances there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gearsim_twin.compare.discrepancy import RATIO_DB
from gearsim_twin.compare.features import Features
from gearsim_twin.compare.levels import difference_db
from gearsim_twin.familiar import Familiar
from gearsim_twin.stack import Array, group_of

__all__ = ["NEAR", "REPEAT_DB", "Conditions", "Taught", "apart"]

Conditions = tuple[float, float, float]
"""Speed, load, and radial force."""
NEAR = 0.1
"""Records whose conditions differ by less (sum of the logarithms of their ratios) teach each other places."""
REPEAT_DB = {
    "orders": 0.4,
    "psd": 0.2,
    "envelope": 0.3,
    "cyclic": 0.3,
    "torsional": 0.3,
    "statistics": 0.1,
    "transient": 0.4,
    "tones": 0.8,
}
"""What runs of one machine differ by beyond sampling, where no line is beside a place.

Three runs of each of five sound machines of the blind tests (speed and load within 0.3 %) differed by 0 to
0.8 times as much.
"""
# Of what the model says that other conditions do, so much is not believed.
_DOUBT = 0.5
# Differences among healthy records that are as much as the assumption.
_PRIOR_PLACES = 10.0
_LEAST_REPEAT_DB = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Taught:
    """Healthy records beside the calibrated model.

    Parameters
    ----------
    measured, model : tuple of Features
        One entry for each healthy record; the model behind the measuring chain, without any cause.
    conditions : tuple of Conditions
    tau_db : mapping of str to float
        What the model misses, by domain.
    chain : object
        Measuring chain that fits the healthy records, as the workbench's nuisances have it.
    """

    measured: tuple[Features, ...]
    model: tuple[Features, ...]
    conditions: tuple[Conditions, ...]
    tau_db: Mapping[str, float]
    chain: Any

    @property
    def several(self) -> bool:
        """Whether repeatability is learnt."""
        return len(self.measured) > 1

    def near(self, here: Conditions) -> list[int]:
        """Healthy records under much the same conditions, the most similar first."""
        distance = [apart(own, here) for own in self.conditions]
        return sorted((k for k, own in enumerate(distance) if own < NEAR), key=lambda k: distance[k])

    def familiar(self, bare: Features, here: Conditions) -> Familiar | None:
        """The healthy machine under the conditions of a record; None where no healthy record is near.

        Parameters
        ----------
        bare : Features
            The calibrated model under these conditions, behind the measuring chain.
        here : Conditions
        """
        near = self.near(here)
        if not near:
            return None
        shifts = np.stack([difference_db(bare.level_db, self.model[k].level_db) for k in near])
        distance = np.array([apart(self.conditions[k], here) for k in near])[:, None] / NEAR
        domain = [group_of(place) for place in bare.places]
        # Distances of lines from their places are no decibels.
        unit = np.array([p.width / RATIO_DB if p.kind == "ratio" else 1.0 for p in bare.places])
        tau = unit * np.array([self.tau_db.get(name, 1.0) for name in domain])
        known = self.repeat_db
        usual = unit * np.array([known[name] for name in domain])
        # What is not believed of a shift, and what a model that does not know this machine would err by.
        doubt2 = (_DOUBT * shifts) ** 2 + (tau * distance) ** 2
        level = np.stack([self.measured[k].level_db for k in near]) + shifts
        sampling = np.stack([self.measured[k].std_db for k in near])
        told = np.isfinite(level) & np.isfinite(sampling)
        weight = np.where(told, 1.0 / (np.where(told, sampling, 1.0) ** 2 + usual**2 + doubt2 + 1e-9), 0.0)
        total = weight.sum(axis=0)
        share = weight / np.maximum(total, 1e-300)
        mean = np.sum(share * np.where(told, level, 0.0), axis=0)
        std = np.sqrt(np.sum((share * np.where(told, sampling, 0.0)) ** 2, axis=0))
        # The record to be told differs from the mean of n runs by its own run and by theirs.
        runs = 1.0 + np.sum(share**2, axis=0)
        repeat = np.sqrt(usual**2 * runs + np.sum(share * doubt2, axis=0))
        some = total > 0
        first = self.measured[near[0]].levels
        height = np.stack([self.measured[k].levels.height_db for k in near])
        levels = replace(
            first,
            level_db=np.where(some, mean, np.nan),
            std_db=np.where(some, std, np.inf),
            height_db=np.where(some, _mean(height, share, told), np.nan),
            own=np.zeros(mean.size),
            repeat_db=np.where(some, repeat, 0.0),
        )
        return Familiar(Features(bare.places, levels, bare.speed_hz))

    @property
    def repeat_db(self) -> dict[str, float]:
        """The same by domain: assumed, or learnt where healthy records are of like conditions."""
        places = self.measured[0].places
        domain = np.array([group_of(place) if place.kind != "ratio" else "" for place in places])
        square = {name: _PRIOR_PLACES * std**2 for name, std in REPEAT_DB.items()}
        number = dict.fromkeys(REPEAT_DB, _PRIOR_PLACES)
        for j in range(len(self.measured)):
            for k in range(j):
                if apart(self.conditions[j], self.conditions[k]) >= NEAR:
                    continue
                difference, sampling2 = _between(self, j, k)
                for name in REPEAT_DB:
                    mine = (domain == name) & np.isfinite(difference)
                    # Half of a difference's variance is that of one run.
                    square[name] += 0.5 * float(np.sum(difference[mine] ** 2 - sampling2[mine]))
                    number[name] += int(mine.sum())
        return {
            name: float(np.sqrt(max(square[name] / number[name], _LEAST_REPEAT_DB**2))) for name in REPEAT_DB
        }


def apart(one: Conditions, other: Conditions) -> float:
    """How different conditions are: speed, load and force by their ratios."""
    logs = np.log(np.maximum(one, 1e-9)) - np.log(np.maximum(other, 1e-9))
    return float(np.sum(np.abs(logs)))


def _between(taught: Taught, j: int, k: int) -> tuple[Array, Array]:
    """Difference of two healthy records beyond what conditions do, and the variance of its sampling."""
    one, other = taught.measured[j], taught.measured[k]
    told = np.isfinite(one.level_db) & np.isfinite(other.level_db) & (one.stands_out | other.stands_out)
    difference = np.where(told, one.level_db, 0.0) - np.where(told, other.level_db, 0.0)
    difference -= difference_db(taught.model[j].level_db, taught.model[k].level_db)
    # Held as outliers are: one place that is none of the machine's must not teach the rest.
    sampling2 = np.where(told, one.std_db, 1.0) ** 2 + np.where(told, other.std_db, 1.0) ** 2
    most = 3.0 * np.sqrt(sampling2 + 2.0 * max(REPEAT_DB.values()) ** 2)
    return np.where(told, np.clip(difference, -most, most), np.nan), sampling2


def _mean(values: Array, share: Array, told: np.ndarray) -> Array:
    """Mean of heights; infinite where there is no such thing as noise alone."""
    finite = np.isfinite(values) & told
    mean = np.sum(share * np.where(finite, values, 0.0), axis=0)
    return np.where(np.all(finite | ~told, axis=0), mean, np.inf)
