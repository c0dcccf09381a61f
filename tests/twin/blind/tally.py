"""Results of many cases, counted against the goals."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

Result = dict[str, Any]
_Z = 1.959964


@dataclass(frozen=True)
class Share:
    """So many of so many, with Wilson's interval of 95 %."""

    hits: int
    of: int

    @property
    def value(self) -> float:
        """The share; nan of nothing."""
        return self.hits / self.of if self.of else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson (1927)."""
        if not self.of:
            return 0.0, 1.0
        n, p, z2 = self.of, self.value, _Z**2
        middle = (p + z2 / (2 * n)) / (1 + z2 / n)
        half = _Z / (1 + z2 / n) * math.sqrt(p * (1 - p) / n + z2 / (4 * n * n))
        return max(0.0, middle - half), min(1.0, middle + half)

    def __str__(self) -> str:
        if not self.of:
            return "none run"
        low, high = self.interval
        return f"{self.hits} of {self.of} ({100 * self.value:.1f} %, {100 * low:.1f} to {100 * high:.1f})"


def share(results: Iterable[Result], right: Callable[[Result], bool]) -> Share:
    """How many of the results are right."""
    told = [right(one) for one in results]
    return Share(sum(told), len(told))


def judged(results: Sequence[Result]) -> list[Result]:
    """Those with a verdict; a judge that breaks or is not done counts in `lost`, and as wrong there."""
    return [one for one in results if "score" in one]


def lost(results: Sequence[Result]) -> list[Result]:
    """Those without."""
    return [one for one in results if "score" not in one]


def of_kind(results: Sequence[Result], kind: str, *severities: str) -> list[Result]:
    """All of a kind, those that were lost too."""
    return [
        one for one in results if one["kind"] == kind and (not severities or one["severity"] in severities)
    ]


def right(key: str) -> Callable[[Result], bool]:
    """Whether the score says so; a lost case is wrong."""
    return lambda one: bool(one.get("score", {}).get(key, False))


def mild_enough(one: Result) -> bool:
    """Mild and missed, but as it may be: nothing said, or the right one second."""
    told = one.get("score")
    return bool(told) and (not told["causes"] or told["second"] == one["effects"][0][0])


def coverage(results: Sequence[Result]) -> tuple[Share, dict[str, Share]]:
    """Of all 95 % intervals those that hold the truth, in all and by parameter."""
    inside: dict[str, list[bool]] = {}
    for one in judged(results):
        for name, (truth, _, low, high) in one["score"]["parameters"].items():
            # What turns or runs to either side is told by its size where the sign is a choice of axes.
            inside.setdefault(name, []).append(low <= truth <= high)
    by_name = {name: Share(sum(told), len(told)) for name, told in sorted(inside.items())}
    return Share(sum(s.hits for s in by_name.values()), sum(s.of for s in by_name.values())), by_name


def closed(results: Sequence[Result], key: str = "closed") -> np.ndarray:
    """Shares of the gap that were closed, where there is one of half a dB and more and a cause was hidden."""
    return np.array(
        [
            one["score"][key]
            for one in judged(results)
            if one["kind"] in ("single", "pair") and one["score"].get("gap_db", 0.0) > 0.5
        ]
    )


def confusion(results: Sequence[Result]) -> dict[str, Counter[str]]:
    """Hidden cause to what was named first, of single effects and of nothing."""
    table: dict[str, Counter[str]] = {}
    for one in results:
        if one["kind"] in ("single", "none", "outside"):
            hidden = one["effects"][0][0] if one["effects"] else "nothing"
            told = one.get("score")
            said = "(not done)" if told is None else told["first"] or told["word"]
            table.setdefault(hidden, Counter())[said] += 1
    return dict(sorted(table.items()))
