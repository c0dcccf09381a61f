"""From evidence to findings: which component, which fault, how sure."""

from __future__ import annotations

from dataclasses import dataclass, field

from gearsim_dsp.kinematics import FaultFamily
from gearsim_dsp.window import Band

__all__ = ["FamilyEvidence", "Finding"]


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
        The comb's fundamental, interpolated; NaN when nothing was found.
    harmonic_snr_db, sideband_snr_db : tuple of float
        Power over the local floor at harmonics 1, 2, ... and at the strongest pair around each of them.
    snr_db : float
        The strongest of the harmonics counted.
    false_alarm_probability : float
        That a signal without this fault shows as much anywhere in the bands and orders searched.
    modulation_depth : float
        Amplitude of the family's lines relative to the mean squared envelope (effect size, 0..1).
    windows : int
        Windows averaged.
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
    modulation_depth: float
    windows: int


@dataclass(frozen=True, slots=True)
class Finding:
    """One entry of `findings` in `diagnose --json`."""

    component: str
    fault: str
    expected_order: float
    found_order: float
    found_hz: float
    snr_db: float
    confidence: float
    severity: str
    channel: str
    evidence: dict[str, object] = field(default_factory=dict)
