"""What records of the healthy machine teach of each place: all that a model misses of this very machine.

At a place where the healthy record has the power P_h and the model P_m, a model with a cause, P_c, predicts

    P_h + (P_c - P_m)   where the cause adds,     P_h P_c / P_m   where it takes away, or scales all

so that teeth wrong at random, resonances and paths are those of the machine, and only what a cause changes is
the model's word. What superposes itself on a line does so at an angle that is not known: of an addition
of the power B^2 the model, whose own line stands at another angle, shows D = B^2 + 2 A B cos(phi). Then
B^2 = D^2 / (|D| + 2 P_m), right for D far above P_m and in the mean over angles far below, is added, and
the level is known to 10 / ln(10) sqrt(2 (P_h + P_m) B^2) / P only. Shapes of a band with the power P add as
cumulants:

    (X - X_Gauss) P^2     squared envelope spectra, coherence, kurtosis, scatter
    (X - X_Gauss) P       peaks of the squared signal

Everything else is shifted by as many decibels. A share w = 1 - 10^(-|change| / 10) of the level then rests on
the model, with the model's errors; the rest on the healthy record, with its sampling, and with what runs of
one machine differ by (`taught`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.compare.features import Features
from gearsim_twin.compare.levels import Levels, difference_db
from gearsim_twin.compare.places import Place
from gearsim_twin.stack import Array

__all__ = ["Familiar"]

_DB = 10.0 / np.log(10.0)
_FIRST_ORDER = ("crest", "peak", "quiet", "loud")
# Figures of what follows an impact are those of the loudest impacts: a change of so many decibels makes them
# those of the cause.
_OF_IMPACTS, _IMPACT_DB = ("decay", "centre", "spacing"), 3.0
# Least share of a shape that cumulants may leave; what would be less is taken as a ratio.
_LEAST_LEFT = 0.05
_MOST_DB = 60.0
_BESIDE = 2
_OF_LINES = ("orders", "torsional", "envelope", "cyclic")
# Of a level that may be anything.
_MOST_OPEN_DB = 10.0


@dataclass(frozen=True, slots=True, eq=False)
class Familiar:
    """The healthy machine under the conditions of one record, as the measuring chain shows it.

    Parameters
    ----------
    healthy : Features
        Levels of the healthy records, brought to these conditions. `std_db` is their sampling, `repeat_db`
        what runs differ by.
    """

    healthy: Features

    def with_cause(
        self, bare: Features, added: Features, whole: Features, plain: Features, superposed: bool
    ) -> Features:
        """What the healthy machine would show with a cause.

        Parameters
        ----------
        bare : Features
            The model without any cause.
        added : Features
            With the causes that add to what is there.
        whole : Features
            With those as well that scale what is there.
        plain : Features
            The last as it is taken where no healthy record says anything.
        superposed : bool
            Whether what is added adds its oscillation, at an angle that is not known, to those there.

        Returns
        -------
        Features
            Where the healthy records or the model say nothing, `plain` as it is.
        """
        h = self.healthy.levels
        rows = _Rows.of(self.healthy.places, h)
        level, scatter = rows.sum(h, bare.levels, added.levels, superposed)
        scaled = np.clip(difference_db(whole.level_db, added.level_db), -_MOST_DB, _MOST_DB)
        known = np.isfinite(h.level_db) & np.isfinite(h.std_db) & np.isfinite(level)
        # What only the model with the cause has is the cause's.
        known &= np.isfinite(whole.level_db) | ~np.isfinite(bare.level_db)
        known &= np.isfinite(bare.level_db) | ~np.isfinite(whole.level_db)
        level = level + scaled
        change = np.abs(difference_db(level - scaled, h.level_db)) * rows.scale
        kept = 10 ** (-0.1 * (change + np.abs(scaled) * rows.scale))
        own = np.where(rows.of_impacts, np.minimum((change / _IMPACT_DB), 1.0), 1.0 - kept)
        w = plain.levels
        sampling, simulated = (np.where(np.isfinite(each), each, 0.0) for each in (h.std_db, w.std_db))
        std = np.sqrt(((1 - own) * sampling) ** 2 + (own * simulated) ** 2 + scatter**2)
        height = h.height_db + np.where(np.isfinite(level), level - scaled - h.level_db, 0.0)
        levels = Levels(
            np.where(known, level, w.level_db),
            np.where(known, std, w.std_db),
            np.where(known, height, w.height_db),
            np.where(known, h.clear_db, w.clear_db),
            np.where(known, h.frequency_hz, w.frequency_hz),
            np.where(known, h.bandwidth_hz, w.bandwidth_hz),
            np.where(known, h.gauss_db, w.gauss_db),
            np.where(known, own, 1.0),
            np.where(known, (1 - own) * h.repeat_db, 0.0),
        )
        return replace(plain, levels=levels)


@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """How places add up: of which kind each is, and which place has the power of its band (-1: none)."""

    power: NDArray[np.bool_]
    line: NDArray[np.bool_]
    shape: NDArray[np.bool_]
    of_impacts: NDArray[np.bool_]
    order: Array
    of_band: NDArray[np.intp]
    run: NDArray[np.intp]
    scale: Array

    @classmethod
    def of(cls, places: tuple[Place, ...], levels: Levels) -> _Rows:
        bands = {(p.channel, p.band_hz): k for k, p in enumerate(places) if p.kind == "rms"}
        of_band = np.array([bands.get((p.channel, p.band_hz), -1) for p in places], dtype=np.intp)
        power = np.isfinite(levels.frequency_hz) | np.array([p.kind == "rms" for p in places])
        return cls(
            power=power,
            line=np.array([p.domain in _OF_LINES and p.kind not in ("floor", "ratio") for p in places]),
            shape=np.isfinite(levels.gauss_db) & (of_band >= 0) & ~power,
            of_impacts=np.array([p.domain == "transient" and p.kind in _OF_IMPACTS for p in places]),
            order=np.array([1.0 if p.kind in _FIRST_ORDER else 2.0 for p in places]),
            of_band=of_band,
            run=np.unique([f"{p.domain} {p.channel} {p.band_hz}" for p in places], return_inverse=True)[1],
            scale=np.array([6.0 / p.width if p.kind == "ratio" else 1.0 for p in places]),
        )

    def sum(self, h: Levels, bare: Levels, added: Levels, superposed: bool) -> tuple[Array, Array]:
        """Levels with what a cause adds, and how much the unknown angle of lines scatters them, dB."""
        change = np.clip(difference_db(added.level_db, bare.level_db), -_MOST_DB, _MOST_DB)
        level = h.level_db + change  # what takes away, and what no sum is known of
        scatter = np.zeros(level.size)
        p, q = _power(h.level_db), _power(bare.level_db)
        d = _power(added.level_db) - q
        angled = self.line & (h.height_db > h.clear_db) & superposed
        summed = self.power & angled
        with np.errstate(divide="ignore", invalid="ignore"):
            more = np.where(summed, _squared(d, q), d)
            total = np.where(self.power & (summed | (d > 0)), p + more, _power(level))
            scatter = np.where(summed, self._scattered(p, q, more, total), 0.0)
            level = np.where(self.power, 10 * np.log10(total), level)
        level, scatter = self._shapes(h, bare, added, level, scatter, angled)
        share = np.minimum(np.abs(change) / _IMPACT_DB, 1.0)
        mixed = (1 - share) * h.level_db + share * added.level_db
        return np.where(self.of_impacts, mixed, level), np.nan_to_num(scatter)

    def _scattered(self, p: Array, q: Array, more: Array, total: Array) -> Array:
        """What an angle that is not known leaves open of a level, dB.

        An angle at which a line hides what is added to it tells its neighbours, not the line.
        """
        most = np.maximum(np.maximum(more, self._beside(more)), 0.0)
        return np.asarray(_DB * np.sqrt(2.0 * (np.maximum(p, 0.0) + q) * most) / total)

    def _beside(self, power: Array) -> Array:
        """Of each line the median over itself and two neighbours to either side, along each channel."""
        out = np.zeros(power.size)
        for run in np.unique(self.run[self.line]):
            rows = np.flatnonzero(self.line & (self.run == run))
            values = np.pad(
                np.nan_to_num(power[rows]), _BESIDE, mode="reflect" if rows.size > _BESIDE else "edge"
            )
            windows = np.lib.stride_tricks.sliding_window_view(values, 2 * _BESIDE + 1)
            out[rows] = np.median(windows, axis=1)
        return out

    def _shapes(
        self,
        h: Levels,
        bare: Levels,
        added: Levels,
        level: Array,
        scatter: Array,
        angled: NDArray[np.bool_],
    ) -> tuple[Array, Array]:
        """The same for shapes of bands, by cumulants; `level` has powers of bands and ratios of the rest."""
        k = np.flatnonzero(self.shape)
        band = self.of_band[k]
        power = [_power(each)[band] ** self.order[k] for each in (bare.level_db, added.level_db)]
        before, after = _power(h.level_db)[band] ** self.order[k], _power(level)[band] ** self.order[k]
        gauss = [_power(each.gauss_db[k]) for each in (h, bare, added)]
        own = (_power(h.level_db[k]) - gauss[0]) * before
        more = (_power(added.level_db[k]) - gauss[2]) * power[1]
        there = (_power(bare.level_db[k]) - gauss[1]) * power[0]
        more -= there
        with np.errstate(divide="ignore", invalid="ignore"):
            more = np.where(angled[k], _squared(more, np.maximum(there, 0.0)), more)
            shape = gauss[0] + (own + more) / after
            plain = _power(level[k])
            least = _LEAST_LEFT * np.minimum(_power(h.level_db[k]), plain)
            found = 10 * np.log10(np.where(shape > least, shape, np.maximum(plain, 1e-300)))
        level, scatter = level.copy(), scatter.copy()
        level[k] = np.where(np.isfinite(found), found, level[k])
        sides = [np.zeros(level.size) for _ in range(3)]
        for side, values in zip(sides, (own, np.maximum(there, 0.0), more), strict=True):
            side[k] = np.nan_to_num(values)
        total = np.ones(level.size)
        total[k] = np.maximum(_power(level[k]) * after, 1e-300)
        machine, model, change = sides
        open_db = np.nan_to_num(self._scattered(machine, model, change, total))
        return level, np.where(self.shape & angled, np.minimum(open_db, _MOST_OPEN_DB), scatter)


def _squared(difference: Array, model: Array) -> Array:
    """Power of what was added to a line of the model at an angle, by how much the line's power changed."""
    return np.asarray(difference**2 / (np.abs(difference) + 2.0 * model))


def _power(level_db: Array) -> Array:
    return np.asarray(10.0 ** (0.1 * level_db))
