"""What a judge says: one fault of one component, how sure, and the evidence for it."""

from __future__ import annotations

from dataclasses import dataclass, field

__all__ = ["FAULT_WORDS", "LEAST_CONFIDENCE", "Finding", "Size"]

LEAST_CONFIDENCE = 0.3
"""What is less sure is told as "doubtful_finding" in `quality`, and is no finding."""

FAULT_WORDS = (
    "outer_race",
    "inner_race",
    "rolling_element",
    "cage",
    "gear_tooth_crack",
    "gear_tooth_spall",
    "gear_wear",
    "gear_eccentricity",
    "unbalance",
    "misalignment",
    "looseness",
    "planet_tooth_crack",
    "planet_tooth_spall",
    "unknown",
)
"""Values of `fault`: part of the interface."""


@dataclass(frozen=True, slots=True)
class Size:
    """Width of a spall in millimetres, with the interval that holds it with 95 % probability."""

    value_mm: float
    ci95_mm: tuple[float, float]

    def to_json(self) -> dict[str, object]:
        """The `size_mm` object of `diagnose --json`."""
        return {"value": self.value_mm, "ci95": list(self.ci95_mm)}


@dataclass(frozen=True, slots=True)
class Finding:
    """One entry of `findings` in `diagnose --json`.

    Parameters
    ----------
    component : str
        As on the nameplate; empty for the machine as a whole.
    fault : str
        One of `FAULT_WORDS`.
    expected_order, found_order : float
        Of the fundamental, in multiples of the reference shaft's speed.
    found_hz : float
    snr_db : float
        Of the strongest line (or of the tooth that stands out) over the local floor.
    confidence : float
        Probability that component and fault are right, 0 to 1; calibrated, see `confidence`.
    severity : str
        "slight", "moderate" or "severe".
    channel : str
        That shows it best.
    evidence : dict
        Numbers that one can look at; only what JSON knows.
    size : Size or None
        Of a spall, where it could be estimated.
    """

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
    size: Size | None = None

    def to_json(self) -> dict[str, object]:
        """The finding as the contract has it."""
        return {
            "component": self.component,
            "fault": self.fault,
            "expected_order": self.expected_order,
            "found_order": self.found_order,
            "snr_db": self.snr_db,
            "confidence": self.confidence,
            "severity": self.severity,
            "size_mm": self.size.to_json() if self.size else None,
            "evidence": self.evidence,
        }
