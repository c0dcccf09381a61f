"""Which cases a run has: drawn by seed and number alone, so that any range of them can be made anywhere."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from blind.effects import CAUSES, EFFECTS, OUTSIDE, SEVERITIES, noise_of, size_of
from blind.making import Hidden
from blind.sizing import OutOfReachError, plain_data, size_for

KINDS = ("single", "pair", "none", "outside")
# Of twenty neighbours in number: twelve single effects, three pairs, two of nothing, three from outside.
_PATTERN = (
    "single", "pair", "single", "none", "single", "outside", "single", "single", "pair", "single",
    "single", "outside", "single", "single", "none", "single", "outside", "single", "pair", "single",
)  # fmt: skip
_RIGS = ("parallel", "planetary", "bearing")
_GEARED = ("parallel", "planetary")
# Of the cases with records from before, every third by number is judged without them as well.
_COMPARED = 3
# Machines of a case that are tried until one shows its effects as they should show.
_MACHINES = 8
# Sensors of cases without any effect: as they are with effects.
_NONE_NOISE = {"bearing": (1.0, 0.05), "parallel": (1.0,), "planetary": (1.0,)}


@dataclass(frozen=True)
class Planned:
    """A case to be made.

    Attributes
    ----------
    seed, index : int
    kind : str
        One of KINDS.
    rig : str
    effects : tuple of (str, str)
        Names and severities.
    only : str
        The rig that all cases of the run are of; "" for all rigs.

    Notes
    -----
    Of machines with gears there are one or two records from before, where an effect is of the machine, and
    where there is none: so they tell nothing by being there. Some of these cases are judged without as well.
    """

    seed: int
    index: int
    kind: str
    rig: str
    effects: tuple[tuple[str, str], ...]
    only: str = ""

    @property
    def severity(self) -> str:
        """Of its effects; "" of none."""
        return self.effects[0][1] if self.effects else ""

    @property
    def healthy(self) -> int:
        """How many records there are from before."""
        geared = self.rig in _GEARED and self.kind in ("single", "pair", "none")
        known = not self.effects or any(EFFECTS[name].of_machine for name, _ in self.effects)
        return 1 + self.index % 2 if geared and known else 0

    @property
    def compared(self) -> bool:
        """Whether it is judged without these as well."""
        return self.index % _COMPARED == 0


@cache
def _singles(seed: int, only: str) -> tuple[tuple[str, str, str], ...]:
    """All causes at all severities on all rigs in random order, the causes dealt round by round."""
    rng = np.random.default_rng([seed, 77])
    piles = []
    for name, effect in CAUSES.items():
        pile = [
            (name, s, rig)
            for rig in effect.rigs
            for s in SEVERITIES
            if only in ("", rig) and size_of(name, rig, s) is not None
        ]
        piles.append([pile[i] for i in rng.permutation(len(pile))])
    dealt = []
    for turn in range(max(map(len, piles))):
        left = [pile[turn] for pile in piles if turn < len(pile)]
        dealt += [left[i] for i in rng.permutation(len(left))]
    return tuple(dealt)


@cache
def _outsides(seed: int, only: str) -> tuple[tuple[str, str, str], ...]:
    """Effects from outside the library, medium and strong."""
    rng = np.random.default_rng([seed, 78])
    found = [
        (name, severity, rig)
        for name, effect in OUTSIDE.items()
        for rig in effect.rigs
        for severity in SEVERITIES[1:]
        if only in ("", rig) and size_of(name, rig, severity) is not None
    ]
    return tuple(found[i] for i in rng.permutation(len(found)))


def planned(seed: int, index: int, only: str = "") -> Planned:
    """Case `index` of a seed; of one rig only, if it is named."""
    kind = _PATTERN[index % len(_PATTERN)]
    place = index // len(_PATTERN) * _PATTERN.count(kind) + _PATTERN[: index % len(_PATTERN)].count(kind)
    if kind in ("single", "outside"):
        dealt = _singles(seed, only) if kind == "single" else _outsides(seed, only)
        name, severity, rig = dealt[place % len(dealt)]
        return Planned(seed, index, kind, rig, ((name, severity),), only)
    rig = only or _RIGS[place % len(_RIGS)]
    if kind == "none":
        return Planned(seed, index, kind, rig, (), only)
    return Planned(seed, index, kind, *_pair(seed, index, rig), only)


def _pair(seed: int, index: int, rig: str) -> tuple[str, tuple[tuple[str, str], ...]]:
    """Two medium effects on one rig that do not make each other void: no two of labels and speed."""
    rng = np.random.default_rng([seed, index, 79])
    exclusive = {"shaft_speed_offset", "mislabelled_record", "speed_fluctuation", "unit_or_gain_error"}
    names = [n for n, e in CAUSES.items() if rig in e.rigs and size_of(n, rig, "medium") is not None]
    while True:
        first, second = (names[i] for i in rng.choice(len(names), 2, replace=False))
        if not {first, second} <= exclusive and "backlash_contact_loss" not in (first, second):
            return rig, ((first, "medium"), (second, "medium"))


def drawn(
    rig: str, effects: tuple[tuple[str, str], ...], seed: tuple[int, ...]
) -> tuple[Hidden, tuple[int, ...]]:
    """What is hidden, with sizes that make it stand out as its severity says, and the seed of the machine.

    Raises
    ------
    OutOfReachError
        If none of several machines shows it so.
    """
    if not effects:
        choices = _NONE_NOISE[rig]
        return Hidden(rig, (), choices[seed[-1] % len(choices)]), seed
    noise = noise_of([name for name, _ in effects], rig)
    for attempt in range(_MACHINES):
        machine = (*seed, attempt) if attempt else seed
        plain = plain_data(rig, noise, machine)
        try:
            sizes = [size_for(rig, name, how, noise, machine, plain) for name, how in effects]
        except OutOfReachError:
            if attempt + 1 == _MACHINES:
                raise
            continue
        named = tuple((name, size) for (name, _), size in zip(effects, sizes, strict=True))
        return Hidden(rig, named, noise), machine
    raise AssertionError("unreachable")
