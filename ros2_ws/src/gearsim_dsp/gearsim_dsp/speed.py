"""Speed and angle of the reference shaft: from tacho, encoder, the signal itself, or the nameplate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from gearsim_io.errors import InputError
from numpy.typing import NDArray

__all__ = ["Phase", "ShaftSpeed", "SpeedSource"]

SpeedSource = Literal["tacho", "encoder", "estimated", "nameplate"]


@dataclass(frozen=True, slots=True, eq=False)
class Phase:
    """Angle of the reference shaft at some moments: `turns[k]` at sample index `samples[k]`.

    Both float64, ascending, at least two of them; indices are relative to the first sample of the window.
    """

    samples: NDArray[np.float64]
    turns: NDArray[np.float64]

    def __post_init__(self) -> None:
        if self.samples.shape != self.turns.shape or self.samples.ndim != 1 or self.samples.size < 2:
            raise InputError("Phase", "samples", self.samples.shape, "two vectors of one length, 2 or more")
        if not (np.all(np.diff(self.samples) > 0) and np.all(np.diff(self.turns) > 0)):
            raise InputError("Phase", "samples, turns", "values out of order", "both strictly ascending")


@dataclass(frozen=True, slots=True, eq=False)
class ShaftSpeed:
    """Mean speed of the reference shaft over a window or record.

    Parameters
    ----------
    value_hz : float
        NaN when nothing is known.
    ci95_hz : tuple of float
        Interval that holds the true mean speed with 95 % probability (NaN, NaN when nothing is known).
    source : {"tacho", "encoder", "estimated", "nameplate"}
    phase : Phase or None
        Angle over the window; None: the speed is taken as constant.
    note : str
        What was mended or doubted on the way, for people.
    """

    value_hz: float
    ci95_hz: tuple[float, float]
    source: SpeedSource
    phase: Phase | None = None
    note: str = ""

    def to_json(self) -> dict[str, object]:
        """The `speed_hz` object of `diagnose --json` (null where nothing is known)."""
        known = bool(np.isfinite(self.value_hz))
        return {
            "value": float(self.value_hz) if known else None,
            "ci95": [float(v) for v in self.ci95_hz] if known else None,
            "source": self.source,
        }
