"""The judges of angle-based evidence; a new one costs a file and a line here.

The judge of bearings is not among them: it works on the averaged envelope spectra of `EvidencePool`, also
window by window in the live monitor (`bearing.find_faults`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.judges.gear import judge_gears
from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.judges.planet import judge_planets
from gearsim_dsp.judges.shaft import judge_shafts

__all__ = ["JUDGES", "judge_all"]

JUDGES: Mapping[str, Callable[[Measured], tuple[Finding, ...]]] = {
    "planets": judge_planets,
    "gears": judge_gears,
    "shafts": judge_shafts,
}


def judge_all(measured: Measured) -> tuple[Finding, ...]:
    """What all judges find, in their order; nothing where no channel is fit to be judged."""
    if not measured.channels:
        return ()
    return tuple(finding for judge in JUDGES.values() for finding in judge(measured))
