"""The places of several records as one set of arrays, and which of them are neighbours."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.compare.discrepancy import RATIO_DB

if TYPE_CHECKING:
    from gearsim_twin.compare.features import Features
    from gearsim_twin.compare.places import Place
    from gearsim_twin.realisations import Realisations

__all__ = ["ASSUMED", "TONES", "Assumed", "Levels", "Stack", "group_of", "levels_of", "stack_of"]

ASSUMED = "assumed"
"""Name of the domain of assumptions."""
TONES = "tones"
"""Name of the tones and passages of the domain orders: of these few no model errs by a little all over."""
_NO_RECORD = -1
# Where only the measured record says something the model says that anything may be.
SILENT_DB = 20.0

Array = NDArray[np.float64]
Codes = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Assumed:
    """What is taken as known, beside what is measured, such as that a sensor's gain is right.

    It counts like a place at which 0 dB was measured with the standard deviation `std_db`; what the model
    has there is the correction that it needed.
    """

    channel: str
    kind: str
    std_db: float
    domain: str = ASSUMED
    at: float = 0.0
    width: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Levels:
    """Levels at all places of a stack.

    Attributes
    ----------
    level_db, std_db : ndarray, shape (n,)
        With their sampling standard deviations.
    clear : ndarray of bool, shape (n,)
        Where the level is more than noise alone would give.
    own, repeat_db : ndarray, shape (n,)
        Share that rests on a model alone, and what the rest differs by from run to run (`familiar`).
    """

    level_db: Array
    std_db: Array
    clear: NDArray[np.bool_]
    own: Array
    repeat_db: Array


@dataclass(frozen=True, slots=True, eq=False)
class Stack:
    """Measured levels of several records, and after them what is assumed.

    Attributes
    ----------
    places : tuple of Place or Assumed, length n
    measured : Levels
    domains : tuple of str
        Names that `domain` counts.
    record, domain : ndarray of int, shape (n,)
        Which record and which domain a place belongs to; -1 is the record of what is assumed.
    line : ndarray of int, shape (n,)
        The same number for one place seen by other channels or in other records.
    channel : ndarray of int, shape (n,)
        The same number for one channel.
    run : ndarray of int, shape (n,)
        The same number along one representation of one channel and band of one record.
    band : ndarray of int, shape (n,)
        The same number for one carrier band.
    order : ndarray of int, shape (n,)
        Sorts places along each run.
    chance_db : ndarray, shape (n,)
        What machines of the kind differ by (`realisations`); 0 where that is not known.
    chance_effect : ndarray, shape (domains,)
        How many of those differences say as much as one that is independent.
    """

    places: tuple[Place | Assumed, ...]
    measured: Levels
    domains: tuple[str, ...]
    record: Codes
    domain: Codes
    line: Codes
    channel: Codes
    run: Codes
    band: Codes
    order: Codes
    chance_db: Array
    chance_effect: Array

    @property
    def told(self) -> NDArray[np.bool_]:
        """Which places the measured records say something of, shape (n,)."""
        return np.isfinite(self.measured.level_db) & np.isfinite(self.measured.std_db)

    @property
    def size(self) -> int:
        """Number of places of all records together."""
        return len(self.places)

    def part(self, records: Sequence[int]) -> NDArray[np.bool_]:
        """Which places belong to some of the records, shape (n,)."""
        return np.isin(self.record, np.asarray(records))

    def filled(self, features: Mapping[int, Features], corrections_db: Sequence[float] = ()) -> Levels:
        """Predicted levels of some records; elsewhere those measured, without uncertainty.

        `corrections_db` has what the model needed of each assumption, in the order of `stack_of`.
        """
        level, std = self.measured.level_db.copy(), np.zeros(self.size)
        clear = self.measured.clear.copy()
        own, repeat = np.ones(self.size), np.zeros(self.size)
        for record, each in features.items():
            mine = self.record == record
            part = levels_of([each])
            silent = ~(np.isfinite(part.level_db) & np.isfinite(part.std_db))
            level[mine] = np.where(silent, level[mine], part.level_db)
            std[mine] = np.where(silent, SILENT_DB, part.std_db)
            clear[mine] = part.clear
            own[mine], repeat[mine] = part.own, part.repeat_db
        if corrections_db:
            level[self.record == _NO_RECORD] = np.asarray(corrections_db, dtype=np.float64)
        return Levels(level, std, clear, own, repeat)


def group_of(place: Place | Assumed) -> str:
    """Name of what a place belongs to in a stack: its domain, or `TONES`."""
    return TONES if place.domain == "orders" and place.kind in ("tone", "passage") else place.domain


def _codes(keys: Sequence[Hashable]) -> Codes:
    numbers: dict[Hashable, int] = {}
    return np.array([numbers.setdefault(key, len(numbers)) for key in keys], dtype=np.intp)


def stack_of(
    measured: Sequence[Features],
    assumed: Sequence[Assumed] = (),
    chance: Mapping[int, Realisations] | None = None,
) -> Stack:
    """The measured features of several records, one entry per record, and what is assumed.

    `chance` tells of some records what machines of the kind differ by.
    """
    places: tuple[Place | Assumed, ...] = (
        *(place for features in measured for place in features.places),
        *assumed,
    )
    counts = [len(features.places) for features in measured]
    record = np.repeat([*range(len(measured)), _NO_RECORD], [*counts, len(assumed)]).astype(np.intp)
    groups = [group_of(place) for place in places]
    names = tuple(dict.fromkeys(groups))
    at = np.array([place.at for place in places], dtype=np.float64)
    run = _codes(
        [
            (k, p.domain, p.channel, p.kind, getattr(p, "band_hz", None))
            for k, p in zip(record.tolist(), places, strict=True)
        ]
    )
    found = levels_of(measured)
    return Stack(
        places=places,
        measured=Levels(
            np.concatenate([found.level_db, np.zeros(len(assumed))]),
            np.concatenate([found.std_db, np.array([each.std_db for each in assumed], dtype=np.float64)]),
            np.concatenate([found.clear, np.ones(len(assumed), dtype=np.bool_)]),
            np.ones(len(places)),
            np.zeros(len(places)),
        ),
        domains=names,
        record=record,
        domain=np.array([names.index(group) for group in groups], dtype=np.intp),
        line=_codes([(place.domain, place.kind, place.at) for place in places]),
        channel=_codes([place.channel for place in places]),
        run=run,
        band=_codes([getattr(place, "band_hz", None) for place in places]),
        order=np.lexsort((at, run)),
        chance_db=np.concatenate([*_chance_db(measured, chance or {}), np.zeros(len(assumed))]),
        chance_effect=_chance_effect(names, tuple((chance or {}).values())),
    )


def _chance_db(measured: Sequence[Features], chance: Mapping[int, Realisations]) -> Iterator[Array]:
    for record, features in enumerate(measured):
        scale = np.array([_scale(place) for place in features.places], dtype=np.float64)
        yield chance[record].std_db * scale if record in chance else 0.0 * scale


def _chance_effect(names: Sequence[str], chance: Sequence[Realisations]) -> Array:
    """By the domains' names; 1 where nothing is known."""
    found = [[each.effect.get(name, 1.0) for each in chance] or [1.0] for name in names]
    return np.array([float(np.mean(each)) for each in found])


def levels_of(features: Sequence[Features]) -> Levels:
    """Levels of several records behind one another; distances of lines from their places as levels."""
    empty = np.zeros(0)
    scale = np.array([_scale(place) for each in features for place in each.places], dtype=np.float64)
    return Levels(
        np.concatenate([empty, *(each.level_db for each in features)]) * scale,
        np.concatenate([empty, *(each.std_db for each in features)]) * scale,
        np.concatenate([np.zeros(0, dtype=np.bool_), *(each.stands_out for each in features)]),
        np.concatenate([empty, *(each.own for each in features)]),
        np.concatenate([empty, *(each.repeat_db for each in features)]) * scale,
    )


def _scale(place: Place) -> float:
    return RATIO_DB / place.width if place.kind == "ratio" else 1.0
