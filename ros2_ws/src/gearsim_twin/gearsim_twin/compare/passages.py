"""Lines that passages of rolling elements leave in the spectrum itself, where a resonance lifts them.

A squared envelope shows what a band modulates by the square of its share of the power. Events that ring in a
narrow resonance under loud noise are lost there, while each of their harmonics in that resonance stands out
of the noise of one line of the whole record, as long as elements do not slip at random. So combs k f, with
the sidebands next to them, are sought over the angle in windows as long as records, in runs of neighbouring
harmonics. A fundamental is told there to a part of a line over k. What turns of shafts and lines of clearer
families may bring is left out. Without marks of the angle, which alone tell high multiples of a turn, nothing
is looked for, nor where there are planets, which bring lines everywhere.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.angle.resample import to_angle
from gearsim_dsp.noise_floor import LineTail, comb_false_alarm
from gearsim_dsp.speed import Phase
from gearsim_io.nameplate import Machine
from gearsim_twin.compare.windows import WindowSpectra, cut, spectra_of

__all__ = [
    "ANGLE_MARKS",
    "LEAST_NATS",
    "FamilyLike",
    "Found",
    "LongLines",
    "Shown",
    "best_comb",
    "first_harmonic",
    "found_all",
    "long_lines",
    "orders_of",
    "probable",
    "shown",
]

ANGLE_MARKS = ("tacho", "encoder")
"""Sources of an angle that tells the multiples of a turn from lines next to them."""
LEAST_NATS = math.log(1e4)
"""What a comb must be improbable by, all looks counted."""

_MOST_TURNS = 64.0
_FEWEST_TURNS = 12.0
_PER_ORDER = 2.4
_FLOOR_WORTH = 14.0  # of the 64 bins of a floor: 1.5 to a line, a third of them for the trimming
_CAP = 12.0
_RUNS = (4, 8)
_CLEAR_OF = 6.0  # below so many times the highest family lie lines of sound bearings, shafts and meshes
_LOW_SHARE = 0.2
_HALF = 1.6  # half of a line's width, in lines of a Hann window
_LOOKS_PER_LINE = 0.6
_STEPS_PER_LINE = 3
_REACH, _FINE = 1.0, 41  # lines at the last harmonic, within which a fundamental is looked for more finely
_SIDES = 3
_BESIDE = 5e-5  # of an order: how unevenly a shaft turns between the marks of its angle
_SKIRT = 3.0  # the median of eight lines of noise is seldom so far above the floor
_TRUSTED = 0.1  # of the power of the strongest: below, lines may be combinations of that one's with turns
_FEWEST_ON = 0.6  # of a run's lines must be free


class FamilyLike(Protocol):
    """Fault lines: fundamental, spacing of sidebands (0: none), relative half-width of the search."""

    @property
    def fault(self) -> str:
        """What the diagnosis calls the fault."""

    @property
    def order(self) -> float:
        """Fundamental, in turns of the reference shaft."""

    @property
    def sideband_order(self) -> float:
        """Spacing of sidebands."""

    @property
    def tolerance(self) -> float:
        """Relative half-width of the search."""


F = TypeVar("F", bound=FamilyLike)


@dataclass(frozen=True, slots=True, eq=False)
class LongLines:
    """Order spectrum of one channel in windows as long as the record, or 64 turns.

    Attributes
    ----------
    spectra : WindowSpectra
    tail : ndarray of float64, shape (lines,)
        -ln of the probability that noise lifts a line so far, held at a cap.
    height : ndarray of float64, shape (lines,)
        Logarithm of a line over the noise beside it.
    usable : ndarray of bool, shape (lines,)
        Lines that no shaft has.
    """

    spectra: WindowSpectra
    tail: NDArray[np.float64]
    height: NDArray[np.float64]
    usable: NDArray[np.bool_]

    @classmethod
    def of(cls, spectra: WindowSpectra, floor: NDArray[np.float64], usable: NDArray[np.bool_]) -> LongLines:
        """Lines over a noise floor."""
        ratio = np.maximum(spectra.mean, np.finfo(np.float64).tiny) / floor
        averages = spectra.averages
        tail = np.minimum(LineTail(averages, averages * _FLOOR_WORTH)(ratio), _CAP)
        return cls(spectra, tail, np.log(ratio), usable)

    @property
    def size(self) -> int:
        """Number of lines."""
        return int(self.tail.size)

    def without(self, order: float, turns: Sequence[float]) -> LongLines:
        """The same without the multiples of an order and what lies turns beside them."""
        at = np.arange(self.size) * self.spectra.step
        width = _HALF * self.spectra.step + _BESIDE * at
        lines = np.zeros(self.size, dtype=np.bool_)
        for shift in {0.0, *turns, *(-turn for turn in turns)}:
            number = np.maximum(1.0, np.round((at - shift) / order))
            lines |= np.abs(at - shift - number * order) < width
        return replace(self, usable=self.usable & ~lines)

    def floored(self, floor: NDArray[np.float64]) -> LongLines:
        """The same as if it had another noise floor."""
        return LongLines.of(self.spectra, np.maximum(floor, _beside(self.spectra)), self.usable)


@dataclass(frozen=True, slots=True)
class Found:
    """A comb: its fundamental, the first of its harmonics, their number, and how improbable it is [nats]."""

    order: float
    first: int
    count: int
    nats: float


@dataclass(frozen=True, slots=True)
class Shown:
    """A run in one record: mean square of its lines above the noise, that of the noise under them, and the
    share of the lines in all between the first and the last.
    """

    power: float = 0.0
    noise: float = 0.0
    share: float = 0.0


def shown(lines: LongLines, family: FamilyLike, run: Found) -> Shown:
    """How strong a run is."""
    mean, floor = lines.spectra.mean, lines.spectra.floor
    places = np.array(orders_of(family, run.order, run.first, run.count))
    index = np.round(places / lines.spectra.step).astype(np.intp)
    index = index[(index > 1) & (index < lines.size - 1)]
    index = index[lines.usable[index]]
    if not index.size:
        return Shown()
    near = np.unique(index[:, None] + np.arange(-1, 2))
    excess, noise = float(np.sum(mean[near] - floor[near])), float(np.sum(floor[near]))
    whole = float(np.sum(mean[index.min() : index.max() + 1]))
    return Shown(max(excess, 0.0), noise, min(max(excess / max(whole, 1e-300), 0.0), 1.0))


def long_lines(
    signal: NDArray[np.float64], phase: Phase, rate_hz: float, top_hz: float, machine: Machine
) -> LongLines | None:
    """Lines of a channel; None where a record has too few turns, or planets.

    Parameters
    ----------
    signal : ndarray of float64, shape (n,)
    phase : Phase
        Angle of the reference shaft.
    rate_hz, top_hz : float
        Sampling rate, and the highest frequency wanted.
    machine : Machine
    """
    turns = float(phase.turns[-1] - phase.turns[0])
    if machine.planetary_stages or not machine.bearings or turns < _FEWEST_TURNS:
        return None
    samples = float(phase.samples[-1] - phase.samples[0])
    top_order = top_hz * samples / rate_hz / turns
    per_turn = int(sfft.next_fast_len(max(16, math.ceil(_PER_ORDER * top_order)), real=True))
    values = to_angle(signal - signal.mean(), phase, per_turn).values
    length = min(values.size, round(_MOST_TURNS * per_turn))
    spectra = spectra_of(cut(values, length), per_turn / length)
    kept = min(spectra.power.shape[1], math.floor(top_order / spectra.step))
    spectra = WindowSpectra(
        spectra.power[:, :kept], spectra.step, spectra.averages, np.asarray(spectra.floor[:kept])
    )
    return LongLines.of(spectra, _beside(spectra), _free(machine, kept, spectra.step))


def _beside(spectra: WindowSpectra) -> NDArray[np.float64]:
    """Noise at each line; on the skirts of a strong line what lies to its sides."""
    mean = spectra.mean
    floor = np.maximum(spectra.floor, np.finfo(np.float64).tiny)
    padded = np.pad(mean, 6, mode="reflect")
    near = np.stack([padded[6 + k : 6 + k + mean.size] for k in (-6, -5, -4, -3, 3, 4, 5, 6)])
    sides = np.median(near, axis=0)
    return np.asarray(np.where(sides > _SKIRT * floor, sides, floor))


def _free(machine: Machine, lines: int, step: float) -> NDArray[np.bool_]:
    """Lines next to no multiple of a shaft's turn; meshes with their sidebands are among these."""
    return _free_of(tuple(sorted({abs(shaft.ratio) for shaft in machine.shafts} | {1.0})), lines, step)


@lru_cache(maxsize=16)
def _free_of(ratios: tuple[float, ...], lines: int, step: float) -> NDArray[np.bool_]:
    at = np.arange(lines) * step
    free = at > 4 * step
    for ratio in ratios:
        distance = np.abs(at - np.round(at / ratio) * ratio)
        free &= distance > np.minimum(_HALF * step + _BESIDE * at, 0.3 * ratio)
    free.flags.writeable = False
    return np.asarray(free)


def orders_of(family: FamilyLike, order: float, first: int, count: int) -> list[float]:
    """Lines of a run of harmonics with the sidebands next to each."""
    return [k * order + side for k in range(first, first + count) for side in _sides(family)]


def first_harmonic(families: Sequence[FamilyLike], family: FamilyLike, top_order: float) -> int:
    """From which harmonic on a family is looked for."""
    reach = max(each.order + each.sideband_order for each in families)
    return math.ceil(min(_CLEAR_OF * reach, _LOW_SHARE * top_order) / family.order)


def probable(lines: Sequence[LongLines], family: FamilyLike, order: float, first: int, count: int) -> float:
    """-ln of the probability that noise shows a run of harmonics so, in some records together; one look."""
    total, counts = _sums(lines, family, np.array([order]), first, first + count - 1)
    return float(_nats(_robust(total), counts.sum(axis=1))[0])


def best_comb(
    lines: Sequence[LongLines],
    family: FamilyLike,
    lowest: int,
    near: float | None = None,
    runs: Sequence[tuple[int, int]] | None = None,
) -> Found | None:
    """The most improbable run of harmonics of a family in some records together, its looks counted.

    Parameters
    ----------
    lines : sequence of LongLines
        One channel in each record.
    family : FamilyLike
    lowest : int
        Least harmonic.
    near : float, optional
        Relative half-width of the search, in place of the family's.
    runs : sequence of (first, count), optional
        In place of all runs of four and eight.
    """
    top = min(one.size * one.spectra.step for one in lines)
    step = min(one.spectra.step for one in lines)
    last = math.floor(top / (family.order * (1.0 + family.tolerance))) - 1
    wanted = runs or [
        (first, count)
        for count in _RUNS
        for first in range(max(lowest, 1), last - count + 2, max(1, count // 2))
    ]
    wanted = [(first, count) for first, count in wanted if first + count - 1 <= last]
    if not wanted:
        return None
    half = family.tolerance if near is None else near
    highest = max(first + count - 1 for first, count in wanted)
    steps = 2 * math.ceil(half * family.order * highest * _STEPS_PER_LINE / step) + 1
    orders = family.order * (1.0 + half * np.linspace(-1.0, 1.0, max(steps, 3)))
    low = min(first for first, _ in wanted)
    total, counts = _sums(lines, family, orders, low, highest)
    best: Found | None = None
    for first, count in wanted:
        a, b = first - low, first - low + count
        looks = 1.0 + _LOOKS_PER_LINE * 2 * half * family.order * (first + count - 1) / step
        number = counts[:, a:b].sum(axis=1)
        nats = _nats(_robust(total[:, a:b]), number) - math.log(looks * len(wanted))
        k = int(np.argmax(np.where(number >= _FEWEST_ON * max(int(number.max()), 1), nats, -np.inf)))
        if best is None or nats[k] > best.nats:
            best = Found(float(orders[k]), first, count, float(nats[k]))
    return None if best is None else replace(best, order=_refined(lines, family, best))


def _refined(lines: Sequence[LongLines], family: FamilyLike, run: Found) -> float:
    """The fundamental near one found at which lines are highest: clear ones are held at a cap before."""
    last = run.first + run.count - 1
    reach = _REACH * min(one.spectra.step for one in lines) / last
    orders = run.order + reach * np.linspace(-1.0, 1.0, _FINE)
    height = np.zeros(orders.size)
    for one in lines:
        for side in _sides(family):
            index = _index(one, orders[:, None] * np.arange(run.first, last + 1) + side)
            height += np.where(index >= 0, one.height[index], 0.0).sum(axis=1)
    top = orders[height >= height.max() - 1e-9]
    return float(top.mean())


def _sides(family: FamilyLike) -> tuple[float, ...]:
    """Where lines lie beside a harmonic, itself among them."""
    side = family.sideband_order
    return (0.0,) if side <= 0 else (0.0, -side, side)


def _sums(
    lines: Sequence[LongLines], family: FamilyLike, orders: NDArray[np.float64], low: int, highest: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sums of tails and numbers of lines of each harmonic from `low` on, shape (orders, harmonics)."""
    shape = (orders.size, highest - low + 1)
    total, counts = np.zeros(shape), np.zeros(shape)
    numbers = np.arange(low, highest + 1)
    for one in lines:
        for side in _sides(family):
            index = _index(one, orders[:, None] * numbers + side)
            on = index >= 0
            total += np.where(on, one.tail[index], 0.0)
            counts += on
    return total, counts


def _robust(total: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sums over harmonics, of which the clearest counts as the second one: a single tone is no comb."""
    two = np.partition(total, -2, axis=1)[:, -2:]
    return np.asarray(total.sum(axis=1) - two[:, 1] + two[:, 0])


def _index(one: LongLines, orders: NDArray[np.float64]) -> NDArray[np.intp]:
    """Lines nearest to some orders; -1 where they are not usable."""
    index = np.round(orders / one.spectra.step).astype(np.intp)
    inside = (index > 0) & (index < one.size)
    index = np.where(inside, index, 0)
    return np.where(inside & one.usable[index], index, -1)


def _nats(total: NDArray[np.float64], counts: NDArray[np.float64]) -> NDArray[np.float64]:
    """-ln of the Gamma tail."""
    p = comb_false_alarm(total, np.asarray(counts, dtype=np.int64))
    return np.asarray(-np.log(np.maximum(p, 1e-300)))


def found_all(
    lines: Sequence[LongLines], families: Sequence[F], turns: Sequence[float], looks: float
) -> list[tuple[F, Found]]:
    """Families whose runs noise does not show, the clearest first; lines of one are no evidence for another.

    Parameters
    ----------
    lines : sequence of LongLines
        One channel in each record.
    families : sequence of FamilyLike
    turns : sequence of float
        Turns of shafts, which may lie beside lines of a family.
    looks : float
        How many channels are looked at.
    """
    left = [family for family in families if family.fault != "cage"]
    if not left or not lines:
        return []
    price = math.log(len(left) * looks)
    top = min(one.size * one.spectra.step for one in lines)
    out: list[tuple[F, Found]] = []
    most = 0.0
    while left:
        tried = [(best_comb(lines, f, first_harmonic(families, f, top)), f) for f in left]
        able = [(found, f) for found, f in tried if found is not None and found.nats - price > LEAST_NATS]
        if not able:
            break
        found, family = max(able, key=lambda each: each[0].nats)
        left.remove(family)
        power = sum(shown(one, family, found).power for one in lines)
        if power > _TRUSTED * most:
            out.append((family, found))
            most = max(most, power)
        own = [k * family.sideband_order for k in range(1, _SIDES + 1) if family.sideband_order > 0]
        beside = [*own, *(k * turn for turn in turns for k in (1, 2))]
        lines = [one.without(found.order, beside) for one in lines]
    return out
