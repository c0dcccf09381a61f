"""Measured records with their speed, as the judge reads them."""

from __future__ import annotations

from gearsim_bringup.method_figures.measured import Measured
from gearsim_twin.view import View, view_of

__all__ = ["learnt_and_held_out", "view_at"]


def view_at(records: Measured, relative: str) -> View:
    """The view of a record by its path below a data folder.

    Raises
    ------
    EnvironmentLackError
        If no data folder has it.
    """
    return view_of(records.record(relative), records.machine(relative))


def learnt_and_held_out(view: View) -> tuple[View, View]:
    """The first two thirds of a record that is the only one, to learn from, and the last third."""
    end = 2 * view.record.sample_count // 3
    return view.part(0, end), view.part(end, view.record.sample_count)
