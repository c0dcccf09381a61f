"""A localised spall of the inner race: impacts at the BPFI, loudest under the load."""

from __future__ import annotations

from gearsim_twin.causes.spalls import RaceSpall

__all__ = ["BEARING_SPALL_INNER"]

BEARING_SPALL_INNER = RaceSpall(
    "bearing_spall_inner",
    "inner_race",
    "inner_race_spall",
    (("wide_spall", "time from entry to impact at another speed, or a record sampled faster"),),
)
"""The cause."""
