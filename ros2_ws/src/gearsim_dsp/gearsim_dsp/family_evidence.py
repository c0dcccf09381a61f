"""What one channel shows of one fault family, and which of two ways to look at it shows more."""

from __future__ import annotations

from dataclasses import dataclass

from gearsim_dsp.bands import Band
from gearsim_dsp.kinematics import FaultFamily
from gearsim_dsp.shaft_lines import ShaftMultiple

__all__ = ["BandLevel", "FamilyEvidence", "proves", "weight"]

_SURE, _DOMINANT = 1e-4, 1.6
_LEAST_PROOF = 0.03  # sound bearings and gears stay below 0.022, see docs/diagnosis.md


@dataclass(frozen=True, slots=True)
class BandLevel:
    """A family in one band: modulated power in the signal's unit squared, and whether its comb is
    significant.
    """

    band: Band
    amplitude: float
    clear: bool


@dataclass(frozen=True, slots=True)
class FamilyEvidence:
    """How strongly one channel shows one fault family, after one or many windows.

    Parameters
    ----------
    family : FaultFamily
    channel : str
    band : Band
        Band in which it shows best.
    found_order, found_hz : float
        The comb's fundamental: its harmonics' interpolated peaks, weighted by their precision.
    harmonic_snr_db, sideband_snr_db : tuple of float
        Power over the local floor at harmonics 1, 2, ... and at the stronger sideband of each of the first.
    snr_db : float
        The strongest of the first four harmonics.
    false_alarm_probability : float
        That noise shows as much anywhere in the bands, channels, families and orders searched.
    modulation : float
        Mean square of the family's lines in the squared envelope over its squared mean (effect size).
    dominance : float
        The family's modulation over that of the strongest unrelated comb in the same band; 0 where the
        false-alarm probability is above 0.01 anyway.
    by_band : tuple of BandLevel
        The same band by band, to compare channels.
    windows : int
        Windows averaged.
    covered_by : ShaftMultiple or None
        The shaft's lines that the family's own cannot be told from; its other lines are then the floor.
    """

    family: FaultFamily
    channel: str
    band: Band
    found_order: float
    found_hz: float
    harmonic_snr_db: tuple[float, ...]
    sideband_snr_db: tuple[float, ...]
    snr_db: float
    false_alarm_probability: float
    modulation: float
    dominance: float
    by_band: tuple[BandLevel, ...]
    windows: int
    covered_by: ShaftMultiple | None = None


def proves(evidence: FamilyEvidence) -> bool:
    """Lines that noise does not make, and no other comb; sound bearings stay below the least modulation."""
    return (
        evidence.false_alarm_probability < _SURE
        and evidence.dominance >= _DOMINANT
        and evidence.modulation >= _LEAST_PROOF
    )


def weight(evidence: FamilyEvidence) -> tuple[bool, float]:
    """What is improbable counts first, then size, as far as it is dominant."""
    p = evidence.false_alarm_probability
    if p >= _SURE:
        return False, -p
    return True, evidence.modulation * min(evidence.dominance, _DOMINANT)
