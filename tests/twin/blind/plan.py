"""Which cases a run has: drawn by seed and number alone, so that any range of them can be made anywhere."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from blind.effects import CAUSES, OUTSIDE, SEVERITIES, size_of

KINDS = ("single", "pair", "none", "outside")
# Of twenty neighbours in number: twelve single effects, three pairs, two of nothing, three from outside.
_PATTERN = (
    "single", "pair", "single", "none", "single", "outside", "single", "single", "pair", "single",
    "single", "outside", "single", "single", "none", "single", "outside", "single", "pair", "single",
)  # fmt: skip
_RIGS = ("parallel", "planetary", "bearing")


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
