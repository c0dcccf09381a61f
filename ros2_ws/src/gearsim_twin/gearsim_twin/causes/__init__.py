"""The causes, one file each: physics that a model may lack.

A new cause costs one file and one line in `_ALL` (with its import): an instance of its class.
"""

from __future__ import annotations

from gearsim_twin.causes.cause import Cause, Content, Parameter, Values
from gearsim_twin.causes.context import Context, Difference
from gearsim_twin.causes.prior import LogNormal, Normal, Prior, Uniform

_ALL: tuple[Cause, ...] = ()

CAUSES: dict[str, Cause] = {cause.name: cause for cause in _ALL}
"""By published name."""

__all__ = [
    "CAUSES",
    "Cause",
    "Content",
    "Context",
    "Difference",
    "LogNormal",
    "Normal",
    "Parameter",
    "Prior",
    "Uniform",
    "Values",
]
