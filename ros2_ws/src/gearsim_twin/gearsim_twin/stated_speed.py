"""The mean speed that the content of a scenario states for a record, whatever part of it is simulated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from gearsim_io.quantities import Si

__all__ = ["stated_speed_hz"]

_SPEED: TypeAdapter[float] = TypeAdapter(Annotated[float, Si("Hz", gt=0)])
_POINTS = 4001


def stated_speed_hz(content: Mapping[str, Any], seconds: float) -> float | None:
    """Mean speed of the reference shaft over the first `seconds`, as the content has it.

    Returns
    -------
    float or None
        None where it states none that can be read here, such as a trace in a file.
    """
    profile = content.get("profile")
    trace = profile.get("trace") if isinstance(profile, Mapping) else None
    if trace is None:
        point = content.get("operating_point")
        try:
            return _SPEED.validate_python(point.get("speed") if isinstance(point, Mapping) else None)
        except ValidationError:
            return None
    columns = trace.get("columns") if isinstance(trace, Mapping) else None
    if not isinstance(columns, Mapping) or not {"time_s", "speed_hz"} <= set(columns):
        return None
    at = np.linspace(0.0, seconds, _POINTS)
    return float(np.mean(np.interp(at, columns["time_s"], columns["speed_hz"])))
