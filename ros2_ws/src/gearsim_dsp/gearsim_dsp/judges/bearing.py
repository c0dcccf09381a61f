"""Bearings: which one, which part of it, from averaged squared envelope spectra.

A family of lines is a finding when three things hold together:

1. It is improbable as noise: the false-alarm probability of its comb, with all bands, channels, families and
   candidate orders searched accounted for, is below `ALARM_PROBABILITY`.
2. It is large: the squared envelope is modulated, as mean square of the family's lines relative to the
   squared mean, by `MODULATION_LIMIT` or more. Stationary Gaussian noise has 1 in all lines together; sound
   bearings and gears modulate by a few per cent at most.
3. It is this family and no other: no comb at an unrelated order in the same band is nearly as strong.

Families are accepted one by one, the strongest first; the lines of an accepted one no longer count for
others.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from gearsim_dsp.bands import Band
from gearsim_dsp.evidence import EvidencePool
from gearsim_dsp.families import FamilyEvidence, FamilySearch
from gearsim_dsp.judges.companions import accompanies, heard_at, is_companion
from gearsim_dsp.judges.confidence import confidence
from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.kinematics import FaultFamily, fault_families
from gearsim_dsp.quality import QualityIssue
from gearsim_dsp.speed import ShaftSpeed
from gearsim_io.nameplate import Machine

__all__ = [
    "ALARM_PROBABILITY",
    "DOMINANCE_LIMIT",
    "MODULATION_LIMIT",
    "Verdict",
    "find_faults",
    "is_fault",
]

ALARM_PROBABILITY = 1e-4
MODULATION_LIMIT = 0.12
DOMINANCE_LIMIT = 1.6
_MOST_FINDINGS = 4
_CAGE_FUNDAMENTAL_DB = 10.0
_SAME_COMB = 3e-3
# Power of the lines at the bearing over that at the loudest place elsewhere: 180 simulated spalls have 0.34
# and more, what is told in a bearing that is sound 0.09 and less.
_LEAST_HEARD = 0.2
# Of a family's lines from pure rolling: the eleven measured records have 0.22 % on average and up to 0.58 %;
# taken half again as wide, as they are of three rigs.
_MEAN_DEVIATION = 0.0035
# A damaged element passes the load zone once a turn of the cage: 18 simulated ones have sidebands (the
# median of three) 9 dB and more over the floor. One loaded all round need not, so without them an element is
# taken for half as likely.
_SWINGS_DB, _UNSWUNG = 6.0, math.log(0.5)


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the spectra say: findings, the evidence of every family on its best channel, notes, the speed.

    `by_channel` holds the evidence of every group of like families (under the name of its first) on every
    channel, before the lines of a finding were taken out for others.
    """

    findings: tuple[Finding, ...]
    evidence: tuple[FamilyEvidence, ...]
    notes: tuple[QualityIssue, ...]
    speed: ShaftSpeed
    by_channel: tuple[FamilyEvidence, ...] = ()


@dataclass(frozen=True, slots=True)
class _Group:
    """Families with the same lines (bearings of one type on shafts of one speed)."""

    families: tuple[FaultFamily, ...]

    @property
    def first(self) -> FaultFamily:
        return self.families[0]


def find_faults(machine: Machine, pool: EvidencePool) -> Verdict:
    """Judge all fault families of the machine on the evidence pooled.

    Parameters
    ----------
    machine : Machine
    pool : EvidencePool

    Returns
    -------
    Verdict
        Findings strongest first; `evidence` has one entry per family, also for those not found.
    """
    speed = pool.speed()
    channels = pool.spectra()
    groups = _groups(machine)
    if not channels or not groups:
        return Verdict((), (), (), speed)
    looks = len(groups) * len(channels)
    loudest = max(spectra.whole for spectra in channels)
    searches = [FamilySearch(machine, spectra, speed, looks, loudest) for spectra in channels]
    latest = {id(group): _judge(group, searches) for group in groups}
    by_channel = tuple(evidence for group in groups for evidence in latest[id(group)])
    resolution = max(1.0 / spectra.turns for spectra in channels)
    findings: list[Finding] = []
    open_groups = list(groups)
    while open_groups and len(findings) < _MOST_FINDINGS:
        good = [g for g in open_groups if _stands(machine, g, latest[id(g)], findings, resolution)]
        if not good:
            break
        merit = {
            id(g): _merit(_best(latest[id(g)]), speed) + _unheard(machine, g, latest[id(g)]) for g in good
        }
        best = max(good, key=lambda g: merit[id(g)])
        alike = [g for g in good if _same_lines(_best(latest[id(g)]), _best(latest[id(best)]))]
        best = max(alike, key=lambda g: merit[id(g)] + _near(machine, g, latest[id(g)]))
        findings.append(_finding(machine, best, latest[id(best)], speed, findings))
        open_groups.remove(best)
        open_groups = [
            g for g in open_groups if g not in alike and not accompanies(machine, g.first, findings[-1])
        ]
        for search in searches:
            search.explain(best.first, _best(latest[id(best)]).found_order)
        for group in open_groups:
            latest[id(group)] = _judge(group, searches)
    evidence = tuple(replace(_best(latest[id(g)]), family=family) for g in groups for family in g.families)
    weak = [g for g in open_groups if _is_its_own(machine, g, latest[id(g)], findings, resolution)]
    return Verdict(tuple(findings), evidence, tuple(_notes(weak, latest)), speed, by_channel)


def _stands(
    machine: Machine,
    group: _Group,
    judged: list[FamilyEvidence],
    findings: list[Finding],
    resolution: float,
) -> bool:
    """True for a fault that its bearing's own channels hear, and that is no companion of one found before."""
    return is_fault(_best(judged)) and _is_its_own(machine, group, judged, findings, resolution)


def _is_its_own(
    machine: Machine,
    group: _Group,
    judged: list[FamilyEvidence],
    findings: list[Finding],
    resolution: float,
) -> bool:
    """True for lines that no finding brings along and that the family's own bearing hears."""
    best = _best(judged)
    component = _component(machine, group, judged)[0].component
    own = [e.channel for e in judged if e.channel in machine.bearing(component).channels]
    passed_on = _reached_by_the_shaft(machine, component, best.family)
    there = [e.channel for e in judged if e.channel not in own and e.channel not in passed_on]
    if own and heard_at(judged, own, there) < _LEAST_HEARD:
        return False
    return not any(is_companion(machine, component, judged, best, one, resolution) for one in findings)


def _reached_by_the_shaft(machine: Machine, component: str, family: FaultFamily) -> set[str]:
    """Channels that may hear a fault of the ring on the shaft louder than its own bearing's do.

    Its impacts go into the shaft as much as into the casing, and ring the pedestal on which the shaft
    presses; at a low load that may be another one.
    """
    bearing = machine.bearing(component)
    if not math.isclose(family.sideband_order, machine.shaft(bearing.shaft).ratio, rel_tol=1e-9):
        return set()
    return {name for one in machine.bearings if one.shaft == bearing.shaft for name in one.channels}


def _merit(evidence: FamilyEvidence, speed: ShaftSpeed) -> float:
    """Logarithm of how well a family explains the lines: its size, and how probable its deviation is.

    Slip and contact angles are taken to deviate as the Laplace distribution has it, beyond what the speed's
    own error explains.
    """
    deviation = abs(evidence.found_order / evidence.family.order - 1.0)
    own = max(deviation - speed.relative_error, 0.0)
    still = float(np.median(evidence.sideband_snr_db or 0.0)) < _SWINGS_DB
    swing = _UNSWUNG if still and evidence.family.fault == "rolling_element" else 0.0
    return math.log(max(evidence.modulation, 1e-12)) - own / _MEAN_DEVIATION + swing


def _unheard(machine: Machine, group: _Group, judged: list[FamilyEvidence]) -> float:
    """Logarithm of how far below the limit a bearing hears its lines; 0 above.

    Only a ring on the shaft may; the less its bearing hears, the likelier are lines of another one.
    """
    component = _component(machine, group, judged)[0].component
    own = [e.channel for e in judged if e.channel in machine.bearing(component).channels]
    heard = heard_at(judged, own, [e.channel for e in judged if e.channel not in own]) if own else 1.0
    return min(0.0, math.log(max(heard, 1e-6) / _LEAST_HEARD))


def _same_lines(one: FamilyEvidence, other: FamilyEvidence) -> bool:
    """Two families that were found at one and the same comb, which lies within the tolerance of both."""
    return abs(one.found_order / other.found_order - 1.0) < _SAME_COMB


def _near(machine: Machine, group: _Group, judged: list[FamilyEvidence]) -> float:
    """How loudly the lines are heard next to the group's bearings, over the loudest channel anywhere.

    Bands count in decibels, as in `_shares`.
    """
    own = {name for family in group.families for name in machine.bearing(family.component).channels}
    bands: dict[Band, dict[str, float]] = {}
    for evidence in judged:
        for one in evidence.by_band:
            if one.clear:
                bands.setdefault(one.band, {})[evidence.channel] = one.amplitude
    ratios = []
    for levels in bands.values():
        near = max((level for name, level in levels.items() if name in own), default=0.0)
        ratios.append(math.log(max(near, 1e-3 * max(levels.values())) / max(levels.values())))
    return float(np.mean(ratios)) if ratios else -math.inf


def _groups(machine: Machine) -> list[_Group]:
    found: dict[tuple[object, ...], list[FaultFamily]] = {}
    for family in fault_families(machine):
        key = (family.label, round(family.order, 4), round(family.sideband_order, 4))
        found.setdefault(key, []).append(family)
    return [_Group(tuple(families)) for families in found.values()]


def _judge(group: _Group, searches: list[FamilySearch]) -> list[FamilyEvidence]:
    return [search.judge(group.first) for search in searches]


def _best(judged: list[FamilyEvidence]) -> FamilyEvidence:
    """The channel that decides: the largest modulation among those improbable enough, else the least
    probable.
    """
    sure = [e for e in judged if e.false_alarm_probability < ALARM_PROBABILITY]
    if sure:
        return max(sure, key=lambda e: e.modulation * min(e.dominance, DOMINANCE_LIMIT))
    return min(judged, key=lambda e: e.false_alarm_probability)


def is_fault(evidence: FamilyEvidence) -> bool:
    """True when a family is improbable as noise, large, and no other's lines: all three limits hold."""
    return (
        evidence.false_alarm_probability < ALARM_PROBABILITY
        and evidence.modulation >= MODULATION_LIMIT
        and evidence.dominance >= DOMINANCE_LIMIT
        and (evidence.family.fault != "cage" or evidence.harmonic_snr_db[0] >= _CAGE_FUNDAMENTAL_DB)
    )


def _finding(
    machine: Machine,
    group: _Group,
    judged: list[FamilyEvidence],
    speed: ShaftSpeed,
    before: list[Finding],
) -> Finding:
    evidence = _best(judged)
    family, shares = _component(machine, group, judged)
    features = {
        "modulation": math.log(evidence.modulation / MODULATION_LIMIT),
        "dominance": math.log(max(evidence.dominance, 1e-3) / DOMINANCE_LIMIT),
        "share": _share_of_two(shares, family.component),
        "improbable": min(-math.log10(max(evidence.false_alarm_probability, 1e-30)), 30.0) / 10.0,
        "harmonics": float(sum(level >= 6.0 for level in evidence.harmonic_snr_db)) / 4.0,
        "beside": _beside(evidence, before),
        # Over a few other lines of a shaft nothing gets as improbable or as dominant as over a floor.
        "covered": float(evidence.covered_by is not None),
    }
    details: dict[str, object] = {
        "channel": evidence.channel,
        "band_hz": [evidence.band.low_hz, evidence.band.high_hz],
        "band_choice": evidence.band.why,
        "frequency_hz": evidence.found_hz,
        "harmonic_snr_db": [round(v, 2) for v in evidence.harmonic_snr_db],
        "sideband_snr_db": [round(v, 2) for v in evidence.sideband_snr_db],
        "false_alarm_probability": evidence.false_alarm_probability,
        "modulation": evidence.modulation,
        "dominance": evidence.dominance,
        "windows": evidence.windows,
        "speed_source": speed.source,
        "features": features,
    }
    if shares:
        details["component_shares"] = shares
    if evidence.covered_by is not None:
        details["covered_by"] = f"{evidence.covered_by.number} x {evidence.covered_by.shaft}"
    return Finding(
        family.component,
        family.fault,
        family.order,
        evidence.found_order,
        evidence.found_hz,
        evidence.snr_db,
        confidence(family.fault, features),
        severity_of(evidence.modulation),
        evidence.channel,
        details,
    )


def _beside(evidence: FamilyEvidence, before: list[Finding]) -> float:
    """Logarithm of the modulation over that of the strongest finding before: 0 for the first, -3 at least.

    What is found beside a much stronger fault is more often a trace of that than a fault.
    """
    values = (one.evidence["modulation"] for one in before)
    strongest = max((value for value in values if isinstance(value, float)), default=evidence.modulation)
    return min(0.0, max(-3.0, math.log(evidence.modulation / strongest)))


def _share_of_two(shares: dict[str, float], component: str) -> float:
    """Logarithm of the bearing's share over that of the next one: 0 where they are alike, 3 at most."""
    if not shares:
        return 3.0
    other = max((value for name, value in shares.items() if name != component), default=0.0)
    return min(3.0, math.log(max(shares[component], 1e-12) / max(other, 1e-12)))


def _component(
    machine: Machine, group: _Group, judged: list[FamilyEvidence]
) -> tuple[FaultFamily, dict[str, float]]:
    """Which of several like bearings it is."""
    if len(group.families) == 1:
        return group.first, {}
    shares = _shares(machine, group, judged)
    best = max(group.families, key=lambda f: shares[f.component])
    return best, shares


def _shares(machine: Machine, group: _Group, judged: list[FamilyEvidence]) -> dict[str, float]:
    """Share of each bearing in the modulation, the mean over all bands where it is clear counted in decibels.

    What comes through the shaft and the casing from another bearing reaches a channel at low frequencies at
    almost full strength and at high frequencies hardly at all; so each band has a say, and not the loudest.
    """
    levels = {e.channel: {b.band: b.amplitude for b in e.by_band} for e in judged}
    common = set.intersection(*(set(bands) for bands in levels.values()))
    clear = {b.band for e in judged for b in e.by_band if b.clear} & common
    bands = sorted(clear or common, key=lambda band: band.low_hz)
    mean: dict[str, float] = {}
    for family in group.families:
        near = [levels[c] for c in machine.bearing(family.component).channels if c in levels]
        if near and bands:
            loudest = [max(max(level[band] for level in near), 1e-300) for band in bands]
            mean[family.component] = float(np.exp(np.mean(np.log(loudest))))
    total = sum(mean.values())
    if total <= 0:
        return {f.component: 1.0 / len(group.families) for f in group.families}
    return {f.component: mean.get(f.component, 0.0) / total for f in group.families}


def severity_of(modulation: float) -> str:
    if modulation >= 1.0:
        return "severe"
    return "moderate" if modulation >= 0.25 else "slight"


def _notes(groups: list[_Group], latest: dict[int, list[FamilyEvidence]]) -> list[QualityIssue]:
    """Families that are there without doubt, no other's lines, and too weak to be called a fault."""
    notes = []
    for group in groups:
        evidence = _best(latest[id(group)])
        weak = 0.25 * MODULATION_LIMIT <= evidence.modulation < MODULATION_LIMIT
        if (
            weak
            and evidence.false_alarm_probability < ALARM_PROBABILITY
            and evidence.dominance >= DOMINANCE_LIMIT
            and len(evidence.harmonic_snr_db) > 1
        ):
            names = ", ".join(f.component for f in group.families)
            detail = (
                f"{group.first.label} of {names} at {evidence.found_hz:.2f} Hz modulates the envelope by "
                f"{100 * evidence.modulation:.1f} %, below the {100 * MODULATION_LIMIT:.0f} % of a finding"
            )
            notes.append(QualityIssue("weak_modulation", evidence.channel, detail))
    return notes
