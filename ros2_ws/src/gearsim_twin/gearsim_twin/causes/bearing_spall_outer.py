"""A localised spall of the outer race: each element falls in and strikes the far edge, at the BPFO."""

from __future__ import annotations

from gearsim_twin.causes.spalls import RaceSpall

__all__ = ["BEARING_SPALL_OUTER"]

BEARING_SPALL_OUTER = RaceSpall(
    "bearing_spall_outer",
    "outer_race",
    "outer_race_spall",
    (
        ("wide_spall", "time from entry to impact at another speed, or a record sampled faster"),
        ("bearing_clearance", "kurtosis: varying compliance pushes without impacts"),
    ),
)
"""The cause."""
