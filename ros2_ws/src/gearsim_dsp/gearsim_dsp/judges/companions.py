"""What one fault brings along that looks like a second one.

A damaged race puts more lines into the envelope than its harmonics: it is struck harder by some elements
than by others (lines of the cage), and its impacts swing with the shaft, so that sidebands k f + n s reach
far and meet the orders of other bearings by chance. A second finding must be more than that.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gearsim_dsp.bands import Band
from gearsim_dsp.families import FamilyEvidence
from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.kinematics import FaultFamily, fault_families
from gearsim_io.nameplate import Machine

__all__ = ["accompanies", "heard_at", "is_companion"]

_CAGES_ALIKE = 0.06
_SECOND_DOMINANCE = 3.0
_SECOND_SHARE = 0.2
_MIXED_SHARE = 0.5
_MIXTURES = ((1, 0), (-1, 0), (2, 0), (-2, 0), (3, 0), (-3, 0), (1, 1), (1, -1), (-1, 1), (-1, -1))
_MIXED_RESOLUTION = 0.75
_LEAST_HEARD = 0.8


def is_companion(
    machine: Machine,
    component: str,
    judged: Sequence[FamilyEvidence],
    best: FamilyEvidence,
    finding: Finding,
    resolution: float,
) -> bool:
    """True when a family may be nothing but a trace of a finding.

    Parameters
    ----------
    machine : Machine
    component : str
        The bearing that the family would be a fault of.
    judged : sequence of FamilyEvidence
        Of the family on every channel; `best` is the one that decides.
    finding : Finding
        Of a bearing, found before.
    resolution : float
        Distance of independent lines in orders.

    Notes
    -----
    On one bearing BPFO + BPFI = N turns: a fault of one race whose amplitude swings with the shaft has
    sidebands next to the other's lines, so a second fault of a bearing must be clearer than a first. On
    another bearing the lines must not be sums and differences of the first one's with the turns of its
    shaft and its cage, and must be heard at that bearing, not at the first one.
    """
    first = finding.evidence["modulation"]
    assert isinstance(first, float)
    if finding.component == component:
        return best.dominance < _SECOND_DOMINANCE or best.modulation < _SECOND_SHARE * first
    if best.modulation < _MIXED_SHARE * first and _is_mixture(machine, best, finding, resolution):
        return True
    there = machine.bearing(finding.component).channels
    here = machine.bearing(component).channels
    if set(here) & set(there):
        return False
    return heard_at(judged, here, there) < _LEAST_HEARD


def accompanies(machine: Machine, family: FaultFamily, finding: Finding) -> bool:
    """True for a cage that turns like that of a finding's bearing.

    A damaged race is struck harder by some elements than by others, so lines of its cage come with it.
    Cages of other bearings on the shaft turn at nearly the same speed, and cannot be told from it.
    """
    if family.fault != "cage":
        return False
    cages = [
        f.order for f in fault_families(machine) if f.fault == "cage" and f.component == finding.component
    ]
    return any(abs(family.order / order - 1.0) < _CAGES_ALIKE for order in cages)


def heard_at(judged: Sequence[FamilyEvidence], here: Sequence[str], there: Sequence[str]) -> float:
    """How loud a family is on some channels against others; bands where it is clear count in decibels.

    Returns
    -------
    float
        1 where nothing is clear, or nothing known of either place.
    """
    bands: dict[Band, dict[str, float]] = {}
    for evidence in judged:
        for one in evidence.by_band:
            if one.clear:
                bands.setdefault(one.band, {})[evidence.channel] = one.amplitude
    every = {e.channel: {b.band: b.amplitude for b in e.by_band} for e in judged}
    ratios = []
    for band in bands:
        near = max((every[name].get(band, 0.0) for name in here if name in every), default=0.0)
        far = max((every[name].get(band, 0.0) for name in there if name in every), default=0.0)
        if near > 0 and far > 0:
            ratios.append(math.log(near / far))
    return float(np.exp(np.mean(ratios))) if ratios else 1.0


def _is_mixture(machine: Machine, best: FamilyEvidence, finding: Finding, resolution: float) -> bool:
    """The fundamental lies at k f + n s + m c: f found before, c its cage, s its shaft.

    Any n, but few k and m, as with many of them every order is such a sum.
    """
    shaft = machine.shaft(machine.bearing(finding.component).shaft).ratio
    cage = next(
        f.order for f in fault_families(machine) if f.fault == "cage" and f.component == finding.component
    )
    for k, m in _MIXTURES:
        rest = abs(best.found_order - k * finding.found_order - m * cage)
        if abs(rest - round(rest / shaft) * shaft) < _MIXED_RESOLUTION * resolution:
            return True
    return False
