"""Sizes of spalls for findings on races, from the channel next to the bearing."""

from __future__ import annotations

from dataclasses import replace

from gearsim_dsp.judges.finding import Finding, Size
from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.sizing.spall_width import size_defect
from gearsim_io.errors import InputError

__all__ = ["with_size"]

_RACES = ("outer_race", "inner_race")


def with_size(finding: Finding, measured: Measured) -> Finding:
    """The finding with the width of its spall, or with the reason in the evidence why it cannot be told."""
    if finding.fault not in _RACES:
        return finding
    near = [
        name for name in measured.machine.bearing(finding.component).channels if name in measured.channels
    ]
    channel = finding.channel if finding.channel in near or not near else near[0]
    if channel not in measured.channels:
        return finding
    try:
        sizing = size_defect(
            measured.channels[channel], measured.sample_rate_hz, finding, measured.machine, measured.speed
        )
    except InputError as error:  # the record is too short for it, or its rate too low
        return replace(finding, evidence={**finding.evidence, "size_note": str(error)})
    width = sizing.width
    if width is None:
        return replace(finding, evidence={**finding.evidence, "size_note": sizing.reason})
    low, high = width.ci95_m
    size = Size(1e3 * width.value_m, (1e3 * low, 1e3 * high))
    evidence = {
        **finding.evidence,
        "size_pairs": width.pairs,
        "size_note": width.note,
        "size_channel": channel,
    }
    return replace(finding, size=size, evidence=evidence)
