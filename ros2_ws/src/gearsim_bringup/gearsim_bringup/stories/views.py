"""Measured records with their speed, as the judge reads them."""

from __future__ import annotations

from gearsim_bringup.method_figures.measured import Measured
from gearsim_twin.view import View, view_of

__all__ = ["view_at"]


def view_at(records: Measured, relative: str) -> View:
    """The view of a record by its path below a data folder.

    Raises
    ------
    EnvironmentLackError
        If no data folder has it.
    """
    return view_of(records.record(relative), records.machine(relative))
