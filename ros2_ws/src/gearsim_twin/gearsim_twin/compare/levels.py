"""What a representation hands out: levels at its places, how sure, and how nuisances would act on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError

__all__ = ["Levels", "difference_db", "joined", "nothing"]

Vector = NDArray[np.float64]

_SILENT_DB = -2500.0
"""Where nothing at all was measured; the least power that a float holds is -3000 dB."""


@dataclass(frozen=True, slots=True, eq=False)
class Levels:
    """Levels at places; all arrays float64 of shape (n,), read-only.

    Attributes
    ----------
    level_db : ndarray
        NaN where the place says nothing in this record.
    std_db : ndarray
        Sampling standard deviation; infinite where the place says nothing.
    height_db, clear_db : ndarray
        Height over what noise alone would give, and the height that noise hardly reaches; infinite and 0
        where there is no such thing as noise alone (bands, statistics).
    frequency_hz, bandwidth_hz : ndarray
        Of power: where it lies, and the noise bandwidth it takes in; NaN for what is no power.
    gauss_db : ndarray
        Of modulations and statistics: level of stationary Gaussian noise; NaN for what noise leaves alone.
    own : ndarray
        Share of a predicted level that rests on a model alone, 0 to 1; what records of the healthy machine
        had already is known better than models are (`familiar`). 1 where there are none.
    repeat_db : ndarray
        Standard deviation by which the rest differs from run to run of one machine.
    """

    level_db: Vector
    std_db: Vector
    height_db: Vector
    clear_db: Vector
    frequency_hz: Vector
    bandwidth_hz: Vector
    gauss_db: Vector
    own: Vector
    repeat_db: Vector

    def __post_init__(self) -> None:
        for entry in fields(self):
            array = getattr(self, entry.name)
            if array.shape != self.level_db.shape or array.ndim != 1:
                raise InputError("Levels", entry.name, array.shape, f"shape {self.level_db.shape}")
            array.flags.writeable = False

    @classmethod
    def of(
        cls,
        level_db: Vector,
        std_db: Vector,
        *,
        height_db: Vector | None = None,
        clear_db: Vector | None = None,
        frequency_hz: Vector | None = None,
        bandwidth_hz: Vector | None = None,
        gauss_db: Vector | None = None,
    ) -> Levels:
        """Levels with what is left out filled in; where there is no level the place says nothing."""
        level = np.array(level_db, dtype=np.float64)
        said = np.isfinite(level) & np.isfinite(std_db) & (level > _SILENT_DB)

        def filled(array: Vector | None, value: float) -> Vector:
            return np.full(level.size, value) if array is None else np.array(array, dtype=np.float64)

        return cls(
            np.where(said, level, np.nan),
            np.where(said, std_db, np.inf),
            np.where(said, filled(height_db, np.inf), np.nan),
            filled(clear_db, 0.0),
            filled(frequency_hz, np.nan),
            filled(bandwidth_hz, np.nan),
            filled(gauss_db, np.nan),
            np.ones(level.size),
            np.zeros(level.size),
        )


def nothing(count: int) -> Levels:
    """Levels that say nothing."""
    return Levels.of(np.full(count, np.nan), np.full(count, np.inf))


def joined(parts: Sequence[Levels]) -> Levels:
    """Levels one after the other."""
    return Levels(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Levels)))


def difference_db(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """Differences of levels, dB, shape (n,); 0 where one of the two is silent."""
    both = np.isfinite(one) & np.isfinite(other)
    return np.where(both, one, 0.0) - np.where(both, other, 0.0)
