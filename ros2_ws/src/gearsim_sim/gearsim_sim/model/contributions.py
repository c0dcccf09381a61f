"""What a fault does to a machine, in the terms that the force elements understand.

A fault is a handful of contributions, each scaled by the fault's severity and added to what the machine
does by itself. A contribution belongs to one table of the compiled loop and knows its numbers there; the
readable model (`Plant`) asks the same object for its effect. A new kind of contribution is a class here
or beside its element, a table in `loop_data.Drive`, and the lines that add it in that element's loop.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.periodic import PeriodicSeries

STIFFNESS, ERROR = 0, 1


class Contribution(Protocol):
    """One row of one table."""

    table: ClassVar[str]  # a field of `loop_data.Drive`

    def numbers(self) -> tuple[float, ...]:
        """The row behind the four columns of severity, and before the two that say where `samples` are."""
        ...

    def samples(self) -> NDArray[np.float64] | None:
        """A table of a periodic function (`PeriodicSeries.table`) that the row refers to, if any."""
        ...


@dataclass(frozen=True, eq=False)
class MeshMod:
    """A periodic change of a mesh: of its stiffness [N/m] or of its transmission error [m].

    Positive errors press the teeth together.
    """

    table: ClassVar[str] = "mesh_mods"

    mesh: int
    what: int  # STIFFNESS or ERROR
    track: int  # over whose turn `series` is periodic
    series: PeriodicSeries

    def numbers(self) -> tuple[float, ...]:
        """Mesh, kind, track."""
        return (self.mesh, self.what, self.track)

    def samples(self) -> NDArray[np.float64]:
        """The series as a table."""
        return self._table

    @cached_property
    def _table(self) -> NDArray[np.float64]:
        return self.series.table()
