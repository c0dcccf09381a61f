"""Which findings are right, and how often: detection, false findings, calibration of the confidence."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

__all__ = [
    "Bin",
    "Rate",
    "calibration",
    "is_right",
    "judged",
    "rate",
    "rate_of_healthy",
    "rates_by_kind",
    "solved",
]

Result = dict[str, Any]
BINS = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0)
_Z95 = 1.96


@dataclass(frozen=True)
class Rate:
    """Successes in trials, with Wilson's interval of 95 %."""

    hits: int
    trials: int

    @property
    def value(self) -> float:
        """Share of successes; NaN without trials."""
        return self.hits / self.trials if self.trials else math.nan

    @property
    def ci95(self) -> tuple[float, float]:
        """Wilson (1927): holds the true share with 95 % probability."""
        if not self.trials:
            return 0.0, 1.0
        n, p, z = self.trials, self.value, _Z95
        centre = (p + z * z / (2 * n)) / (1 + z * z / n)
        half = z / (1 + z * z / n) * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
        return max(0.0, centre - half), min(1.0, centre + half)

    def __str__(self) -> str:
        if not self.trials:
            return "none"
        low, high = self.ci95
        return f"{self.hits} of {self.trials} ({100 * self.value:.1f} %, {100 * low:.1f} to {100 * high:.1f})"


@dataclass(frozen=True)
class Bin:
    """Findings whose confidence lies in [low, high)."""

    low: float
    high: float
    mean_confidence: float
    right: Rate


def judged(results: Iterable[Result]) -> list[Result]:
    """Those that the simulator did not refuse."""
    return [one for one in results if "refused" not in one]


def is_right(finding: Result, result: Result) -> bool:
    """Component and fault are those of one of the truths.

    Of wheels that turn at one speed the mesh is all that can be named, of planets the stage. "unknown" is
    right on any machine that has a fault.
    """
    if finding["fault"] == "unknown":
        return bool(result["truths"])
    return any(_matches(finding, truth, bool(result["twin_wheels"])) for truth in result["truths"])


def _matches(finding: Result, truth: Result, twin_wheels: bool) -> bool:
    if finding["fault"] != truth["fault"]:
        return False
    told, true = str(finding["component"]), str(truth["component"])
    if truth["fault"].startswith("planet_tooth"):
        return told.endswith(".planet")
    if truth["fault"].startswith("gear_") and twin_wheels:
        return told.split(".")[0] == true.split(".")[0]
    return told == true


def solved(result: Result) -> bool:
    """All faults found, and nothing else."""
    findings, truths = result["findings"], result["truths"]
    twin = bool(result["twin_wheels"])
    named = all(any(_matches(one, truth, twin) for one in findings) for truth in truths)
    return named and all(is_right(one, result) for one in findings)


def rate(results: Sequence[Result]) -> Rate:
    """Cases in which exactly the truth was found."""
    return Rate(sum(solved(one) for one in results), len(results))


def rate_of_healthy(results: Sequence[Result]) -> Rate:
    """Healthy machines with a finding."""
    healthy = [one for one in results if not one["truths"]]
    return Rate(sum(bool(one["findings"]) for one in healthy), len(healthy))


def rates_by_kind(results: Sequence[Result]) -> dict[str, tuple[Rate, Rate]]:
    """For each fault word: how often it was found where it was, and how often right where it was said."""
    words = sorted({t["fault"] for one in results for t in one["truths"]})
    words += sorted({f["fault"] for one in results for f in one["findings"]} - set(words))
    table = {}
    for word in words:
        there = [(one, t) for one in results for t in one["truths"] if t["fault"] == word]
        said = [(one, f) for one in results for f in one["findings"] if f["fault"] == word]
        hits = sum(any(_matches(f, t, bool(one["twin_wheels"])) for f in one["findings"]) for one, t in there)
        right = sum(is_right(f, one) for one, f in said)
        table[word] = Rate(hits, len(there)), Rate(right, len(said))
    return table


def calibration(results: Sequence[Result], edges: Sequence[float] = BINS) -> list[Bin]:
    """Share of right findings by their confidence."""
    pairs = [(f["confidence"], is_right(f, one)) for one in results for f in one["findings"]]
    table = []
    for k, (low, high) in enumerate(pairwise(edges)):
        last = k == len(edges) - 2
        inside = [(c, ok) for c, ok in pairs if low <= c and (c < high or last)]
        mean = sum(c for c, _ in inside) / len(inside) if inside else math.nan
        table.append(Bin(low, high, mean, Rate(sum(ok for _, ok in inside), len(inside))))
    return table
