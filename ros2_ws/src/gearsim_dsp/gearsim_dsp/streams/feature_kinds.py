"""How each condition indicator is judged against what was learnt: as a ratio or a difference, upwards or not.

The least change that matters keeps significance from calling a trifle a fault: with a long baseline even a
change of a per cent is significant. For levels it is a doubling (6 dB), the custom of condition monitoring;
for ratios of moments and the like a value at which the literature speaks of a fault, as stated in the table.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fnmatch import fnmatchcase

__all__ = ["KINDS", "FeatureKind", "kind_of"]

_DB = math.log(10) / 20


@dataclass(frozen=True, slots=True)
class FeatureKind:
    """How an indicator is judged.

    Parameters
    ----------
    ratio : bool
        Judged by its logarithm (values above 0 only).
    least : float
        Least change that counts: nepers where `ratio`, else in the indicator's unit; 0: followed, not judged.
    falls : bool
        True where a fall is as bad as a rise.
    """

    ratio: bool
    least: float
    falls: bool = False

    @property
    def judged(self) -> bool:
        """True when alarms depend on it."""
        return self.least > 0

    def scaled(self, value: float) -> float:
        """The value on the scale it is judged on; NaN where it has none."""
        if not self.ratio:
            return value
        return math.log(value) if value > 0 else math.nan

    def plain(self, scaled: float) -> float:
        """Back from that scale."""
        return math.exp(scaled) if self.ratio else scaled


_FOLLOWED = FeatureKind(ratio=False, least=0.0)

KINDS: tuple[tuple[str, FeatureKind], ...] = (
    ("rms", FeatureKind(ratio=True, least=6 * _DB)),
    # 3 for noise, 1.5 for a sine; above about 4.5 impacts are taken for certain.
    ("kurtosis", FeatureKind(ratio=False, least=1.5)),
    ("crest_factor", FeatureKind(ratio=True, least=6 * _DB)),
    # The judge of bearings tells of a weak modulation from 0.03 on; a quarter of what a finding takes.
    ("*_modulation", FeatureKind(ratio=False, least=0.03)),
    # Gear indicators (Lebold et al., MFPT 54 (2000) 623-634): FM4 is 3 for a sound gear. FM0 is followed
    # only: the shaft's own lines are in it, and these are judged by themselves.
    ("fm4", FeatureKind(ratio=False, least=1.5)),
    ("m6a", FeatureKind(ratio=True, least=6 * _DB)),
    ("m8a", FeatureKind(ratio=True, least=9 * _DB)),
    ("na4", FeatureKind(ratio=True, least=6 * _DB)),
    ("nb4", FeatureKind(ratio=True, least=6 * _DB)),
    ("energy_ratio", FeatureKind(ratio=True, least=6 * _DB)),
    ("sideband_level", FeatureKind(ratio=True, least=6 * _DB)),
    ("mesh_level", FeatureKind(ratio=True, least=6 * _DB)),
    ("residual_rms", FeatureKind(ratio=True, least=6 * _DB)),
    ("shaft_order_*", FeatureKind(ratio=True, least=6 * _DB)),
    # Of the live twin, in dB: what a model misses may as well become less.
    ("*_residual", FeatureKind(ratio=False, least=6.0, falls=True)),
)
"""Pattern of the name, and the kind; the first that fits counts. What fits none is followed, not judged."""


def kind_of(name: str) -> FeatureKind:
    """The kind of an indicator by its name, such as "rms" or "bpfo_modulation"."""
    return next((kind for pattern, kind in KINDS if fnmatchcase(name, pattern)), _FOLLOWED)
