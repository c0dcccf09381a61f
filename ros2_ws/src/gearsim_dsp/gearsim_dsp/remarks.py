"""What a record as a whole lets one say beside findings: doubts about orders, rate and nameplate."""

from __future__ import annotations

from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.judges.shaft import undecided_orders
from gearsim_dsp.judges.unlisted import unlisted_mesh
from gearsim_dsp.quality import QualityIssue
from gearsim_dsp.stated_rate import doubt_of_rate
from gearsim_io.nameplate import Machine
from gearsim_io.record import Record

__all__ = ["record_remarks", "what_is_lacking"]


def record_remarks(record: Record, measured: Measured) -> list[QualityIssue]:
    """Orders that may be hum, a sampling rate that may be wrong, gears that nobody listed.

    Parameters
    ----------
    record : Record
    measured : Measured
        Its channels and speed.
    """
    remarks = list(undecided_orders(measured))
    rate = doubt_of_rate(record, measured.machine, measured.speed)
    remarks += [rate] if rate else []
    mesh = None if _has_parts(measured.machine) else unlisted_mesh(measured)
    return remarks + ([mesh] if mesh else [])


def what_is_lacking(machine: Machine, measured: Measured) -> str:
    """Why nothing could be judged, as far as that is plain; for the end of a sentence."""
    if not _has_parts(machine):
        return ": the nameplate lists neither bearings nor pairs of gears"
    if not measured.channels:
        return ": no channel is fit for it"
    return "" if measured.phase is not None else ": the angle is not known"


def _has_parts(machine: Machine) -> bool:
    return bool(machine.bearings or machine.gear_meshes or machine.planetary_stages)
