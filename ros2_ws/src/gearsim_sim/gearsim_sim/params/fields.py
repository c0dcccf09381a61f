"""Field types for the parameters of models and faults."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import AfterValidator

from gearsim_io.quantities import Si, Strict

__all__ = ["Count", "Fraction", "SiKeyed", "Strict"]


@dataclass(frozen=True)
class SiKeyed(Si):
    """Like `Si`, for a key that names the unit (`width_m`): there a bare number is in that unit."""

    def _split(self, raw: Any, require_source: bool) -> tuple[float, str]:
        value, unit = super()._split(raw, require_source)
        bare = isinstance(raw, (int, float)) and not isinstance(raw, bool)
        return value, self.unit if bare else unit


def _whole(value: float) -> int:
    if value != round(value):
        raise ValueError("a whole number")
    return round(value)


Count = Annotated[float, Si("", ge=1), AfterValidator(_whole)]
Fraction = Annotated[float, Si("", ge=0, le=1)]
