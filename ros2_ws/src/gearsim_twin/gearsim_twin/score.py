"""How far a model is from held-out records, in dB, and how far a perfect one would be.

The score is a weighted root mean square of the differences over the places of all held-out records::

    rms^2 = sum w d^2 / sum w,     w = 1 / (s0^2 + var),   s0 = 1 dB

with var the sampling variance of both sides (of the first model given), so that a place that is not known
to a decibel counts less. The noise floor is what the sampling alone would give, sum w var / sum w. All are
scored at the same places: those that stand out in the record or in any of the models.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_twin.compare.discrepancy import RATIO_DB
from gearsim_twin.compare.features import Features
from gearsim_twin.compare.places import DOMAINS, Place

__all__ = ["METRIC", "DomainScore", "Interval", "Scores", "score_models"]

METRIC = "rms_db"
_OWN_DB = 1.0
# What is wholly absent is as wrong as it can be at 40 dB; without noise it would be at any number.
_MOST_DB = 40.0
_DRAWS, _BLOCK = 400, 6


@dataclass(frozen=True, slots=True)
class Interval:
    """A score and its 95 % interval."""

    value: float
    ci95: tuple[float, float]


@dataclass(frozen=True, slots=True)
class DomainScore:
    """Scores of one domain, or of all: per model, and the floor that sampling sets."""

    models: Mapping[str, Interval]
    noise_floor: float
    places: int


@dataclass(frozen=True, slots=True)
class Scores:
    """Scores of all models, over all places and domain by domain."""

    overall: DomainScore
    by_domain: Mapping[str, DomainScore]

    def closed(self, before: str, after: str, domain: str | None = None) -> float:
        """Share of the gap between the score of one model and the noise floor that another one closes.

        Gaps are taken in squares, as what adds up; NaN where there is none.
        """
        score = self.overall if domain is None else self.by_domain[domain]
        floor = score.noise_floor**2
        gap = score.models[before].value ** 2 - floor
        if gap <= 0:
            return float("nan")
        return float((score.models[before].value ** 2 - score.models[after].value ** 2) / gap)


def score_models(
    measured: Sequence[Features], models: Mapping[str, Sequence[Features]], seed: int = 0
) -> Scores:
    """Score models on records.

    Parameters
    ----------
    measured : sequence of Features
        Held-out records.
    models : mapping of str to sequence of Features
        Of each model its levels under the conditions of these records, in their order.
    seed : int
        Of the bootstrap behind the intervals: runs of six neighbouring places are drawn anew.

    Raises
    ------
    InputError
        When there is nothing to score, or the places differ.
    """
    if not measured or not models:
        raise InputError("score_models", "measured, models", (len(measured), len(models)), "one or more each")
    for name, sides in models.items():
        if len(sides) != len(measured) or any(
            m.places != s.places for m, s in zip(measured, sides, strict=True)
        ):
            raise InputError("score_models", name, "other records or places", "those of the measured records")
    tables = [_table(m, [sides[k] for sides in models.values()]) for k, m in enumerate(measured)]
    square = np.concatenate([table[0] for table in tables], axis=1)
    variance = np.concatenate([table[1] for table in tables])
    domain = np.concatenate([table[2] for table in tables])
    weight = 1 / (_OWN_DB**2 + variance)
    names = list(models)
    rng = np.random.default_rng(seed)
    everything = np.ones(domain.size, dtype=np.bool_)
    overall = _scored(names, square, variance, weight, everything, rng)
    by_domain: dict[str, DomainScore] = {
        name: _scored(names, square, variance, weight, domain == name, rng)
        for name in DOMAINS
        if np.any(domain == name)
    }
    return Scores(overall, by_domain)


def _table(
    measured: Features, sides: Sequence[Features]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.str_]]:
    """Squared differences (models, places), sampling variances and domains of the places that count."""
    scale = np.array([_scale(place) for place in measured.places])
    told = np.isfinite(measured.level_db)
    clear = measured.stands_out.copy()
    for side in sides:
        told &= np.isfinite(side.level_db)
        clear |= side.stands_out
    use = told & clear
    rows = []
    for side in sides:
        difference = scale[use] * (measured.level_db[use] - side.level_db[use])
        rows.append(np.clip(difference, -_MOST_DB, _MOST_DB) ** 2)
    variance = scale[use] ** 2 * (measured.std_db[use] ** 2 + sides[0].std_db[use] ** 2)
    domain = np.array([place.domain for place in measured.places])[use]
    return np.array(rows).reshape(len(sides), -1), variance, domain


def _scale(place: Place) -> float:
    return RATIO_DB / place.width if place.kind == "ratio" else 1.0


def _scored(
    names: Sequence[str],
    square: NDArray[np.float64],
    variance: NDArray[np.float64],
    weight: NDArray[np.float64],
    rows: NDArray[np.bool_],
    rng: np.random.Generator,
) -> DomainScore:
    w = weight[rows]
    count = int(w.size)
    if count == 0:
        nothing = Interval(float("nan"), (float("nan"), float("nan")))
        return DomainScore(dict.fromkeys(names, nothing), float("nan"), 0)
    floor = float(np.sqrt(np.sum(w * variance[rows]) / np.sum(w)))
    starts = rng.integers(0, count, (_DRAWS, -(-count // _BLOCK)))
    drawn = (starts[:, :, None] + np.arange(_BLOCK)).reshape(_DRAWS, -1)[:, :count] % count
    models = {}
    for name, values in zip(names, square[:, rows], strict=True):
        value = float(np.sqrt(np.sum(w * values) / np.sum(w)))
        again = np.sqrt(np.sum((w * values)[drawn], axis=1) / np.sum(w[drawn], axis=1))
        low, high = np.quantile(again, (0.025, 0.975))
        models[name] = Interval(value, (float(low), float(high)))
    return DomainScore(models, floor, count)
