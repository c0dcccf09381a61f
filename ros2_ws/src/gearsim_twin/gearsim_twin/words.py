"""Differences without a cause, described: where, how large, and when."""

from __future__ import annotations

from collections.abc import Sequence

from gearsim_twin.compare.merged import Discrepancy

__all__ = ["LEAST_DB", "LEAST_Z", "describe_rest", "material"]

_MOST = 8
# A difference of a few decibels at one place is what models of machines err by.
LEAST_DB, LEAST_Z = 3.0, 4.0


def material(discrepancies: Sequence[Discrepancy]) -> tuple[Discrepancy, ...]:
    """Discrepancies that are too large and too sure for a good model's own errors, the surest first.

    A floor between lines of modulation is none by itself: where noise and a quiet model share a band, how
    they beat is told to some ten decibels only.
    """
    return tuple(
        each
        for each in discrepancies
        if abs(each.size_db) >= LEAST_DB and abs(each.z) >= LEAST_Z and each.places[0].kind != "floor"
    )


def describe_rest(rest: Sequence[Discrepancy], patterns: Sequence[str] = ()) -> str:
    """The signature of what is left, in plain words with frequencies and orders; what is in excess first.

    `patterns` are what it has in common, and come before all.
    """
    first = sorted(rest, key=lambda each: (each.size_db < 0, -abs(each.z)))
    told = "; ".join(each.words() for each in first[:_MOST])
    more = len(rest) - _MOST
    return "; ".join([*patterns, told]) + (f"; and {more} more" if more > 0 else "")
