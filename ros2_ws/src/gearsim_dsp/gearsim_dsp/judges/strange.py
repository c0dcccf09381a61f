"""Periodic impacts that belong to nothing on the nameplate: fault "unknown"."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gearsim_dsp.evidence import EvidencePool
from gearsim_dsp.families import FamilyEvidence, FamilySearch
from gearsim_dsp.judges.bearing import DOMINANCE_LIMIT, severity_of
from gearsim_dsp.judges.confidence import confidence
from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.kinematics import FaultFamily, fault_families
from gearsim_dsp.speed import ShaftSpeed
from gearsim_io.nameplate import Machine

__all__ = ["find_strange_comb"]

_STRANGE_LOW, _STRANGE_HIGH, _STRANGE_REACH = 1.5, 15.0, 0.15
_STRANGE_PROBABILITY = 1e-8
_STRANGE_MODULATION = 0.25
_STRANGE_DB = 10.0


def find_strange_comb(machine: Machine, pool: EvidencePool, skip_hz: Sequence[float] = ()) -> Finding | None:
    """A strong family of lines that belongs to nothing on the nameplate, as a finding of fault "unknown".

    Parameters
    ----------
    machine : Machine
    pool : EvidencePool
    skip_hz : sequence of float
        Frequencies (supply and the like) whose multiples have another explanation.

    Notes
    -----
    Fundamentals from 1.3 to 15 orders, in stretches of 15 % either way. The limits are stricter than those of
    families that the nameplate expects: what nobody expects needs better evidence.
    """
    speed = pool.speed()
    channels = pool.spectra()
    if not channels or not np.isfinite(speed.value_hz):
        return None
    centres = _STRANGE_LOW * ((1 + _STRANGE_REACH) / (1 - _STRANGE_REACH)) ** np.arange(9)
    families = [
        FaultFamily("", "unknown", float(centre), 0.0, "unknown", _STRANGE_REACH)
        for centre in centres
        if centre < _STRANGE_HIGH
    ]
    looks = len(families) * len(channels)
    loudest = max(spectra.whole for spectra in channels)
    searches = [FamilySearch(machine, spectra, speed, looks, loudest) for spectra in channels]
    expected = [family.order for family in fault_families(machine)]
    best: FamilyEvidence | None = None
    for search in searches:
        for family in families:
            found = search.judge(family)
            if _is_strange(found, expected, skip_hz) and (best is None or found.modulation > best.modulation):
                best = found
    return None if best is None else _strange_finding(best, speed)


def _is_strange(evidence: FamilyEvidence, expected: Sequence[float], skip_hz: Sequence[float]) -> bool:
    clear = sum(level >= _STRANGE_DB for level in evidence.harmonic_snr_db[:4])
    if (
        evidence.false_alarm_probability > _STRANGE_PROBABILITY
        or evidence.modulation < _STRANGE_MODULATION
        or evidence.dominance < DOMINANCE_LIMIT
        or clear < 3
    ):
        return False
    # A multiple or an even part of what a bearing does is that bearing's affair.
    for order in expected:
        for factor in (1 / 3, 0.5, 1.0, 2.0, 3.0):
            if abs(evidence.found_order / (order * factor) - 1.0) < 0.02:
                return False
    return not any(
        abs(evidence.found_hz / hz - max(1.0, round(evidence.found_hz / hz))) * hz < 0.004 * evidence.found_hz
        for hz in skip_hz
        if hz > 0
    )


def _strange_finding(evidence: FamilyEvidence, speed: ShaftSpeed) -> Finding:
    features = {"modulation": math.log(evidence.modulation / _STRANGE_MODULATION)}
    details: dict[str, object] = {
        "what": "impacts at a rate that belongs to nothing on the nameplate",
        "channel": evidence.channel,
        "band_hz": [evidence.band.low_hz, evidence.band.high_hz],
        "frequency_hz": evidence.found_hz,
        "harmonic_snr_db": [round(v, 2) for v in evidence.harmonic_snr_db],
        "false_alarm_probability": evidence.false_alarm_probability,
        "modulation": evidence.modulation,
        "dominance": evidence.dominance,
        "speed_source": speed.source,
        "features": features,
    }
    return Finding(
        "",
        "unknown",
        evidence.found_order,
        evidence.found_order,
        evidence.found_hz,
        evidence.snr_db,
        confidence("unknown", features),
        severity_of(evidence.modulation),
        evidence.channel,
        details,
    )
