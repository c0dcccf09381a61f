"""One measured figure with its baseline and goal."""

from __future__ import annotations

import operator
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

_SIGNS: dict[str, Callable[[float, float], bool]] = {
    ">=": operator.ge,
    "<=": operator.le,
    "<": operator.lt,
    "==": operator.eq,
}


@dataclass(frozen=True)
class Goal:
    """A bound on the figure's value or, with `on_ratio`, on value / baseline."""

    sign: str
    bound: float
    on_ratio: bool = False

    def __str__(self) -> str:
        return f"{'ratio ' if self.on_ratio else ''}{self.sign} {self.bound:g}"


@dataclass(frozen=True)
class Figure:
    """A figure; `baseline` is (name, value) in the same unit, None where nothing comparable exists."""

    name: str
    value: float
    unit: str
    goal: Goal
    baseline: tuple[str, float] | None = None

    @property
    def ratio(self) -> float | None:
        """value / baseline, None without a baseline or with a baseline of zero."""
        if self.baseline is None or self.baseline[1] == 0:
            return None
        return self.value / self.baseline[1]

    @property
    def met(self) -> bool:
        """Whether the goal is reached."""
        measured = self.ratio if self.goal.on_ratio else self.value
        return measured is not None and _SIGNS[self.goal.sign](measured, self.goal.bound)

    def as_json(self) -> dict[str, Any]:
        """By the contract of `bench --json`."""
        named = None if self.baseline is None else {"name": self.baseline[0], "value": self.baseline[1]}
        return {
            "name": self.name,
            "value": self.value,
            "unit": self.unit,
            "baseline": named,
            "ratio": self.ratio,
            "goal": str(self.goal),
            "met": self.met,
        }
