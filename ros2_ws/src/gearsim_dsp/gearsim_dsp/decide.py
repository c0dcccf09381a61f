"""From evidence to findings: which component, which fault, how sure.

The judges are in `judges/`, one file per kind of component; this module is where others find what they need
of them.
"""

from __future__ import annotations

from gearsim_dsp.judges.bearing import (
    ALARM_PROBABILITY,
    DOMINANCE_LIMIT,
    MODULATION_LIMIT,
    Verdict,
    find_faults,
    is_fault,
)
from gearsim_dsp.judges.finding import Finding, Size
from gearsim_dsp.judges.registry import JUDGES, judge_all

__all__ = [
    "ALARM_PROBABILITY",
    "DOMINANCE_LIMIT",
    "JUDGES",
    "MODULATION_LIMIT",
    "Finding",
    "Size",
    "Verdict",
    "find_faults",
    "is_fault",
    "judge_all",
]
