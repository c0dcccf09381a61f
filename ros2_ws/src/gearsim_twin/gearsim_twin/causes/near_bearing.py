"""Which bearing is near what differs between measurement and model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context, Difference

__all__ = ["by_distance", "lacks_near"]

# Not the orders: what random teeth do to them has nothing to do with bearings.
_DOMAINS = ("psd", "envelope", "statistics")
_CLEAR_Z = 2.5
_MOST_Z = 6.0  # more than that one place may not say


def by_distance(context: Context, components: Sequence[str]) -> list[str]:
    """Of some bearings those near which anything differs clearly, the one with most differences first.

    Differences count on the channels that the nameplate puts near a bearing (all of them where it tells
    none), relative to how much they differ elsewhere: what all channels share is not the bearing's.
    """
    found = _differences(context)
    ranked = []
    for name in components:
        near = set(context.case.machine.bearing(name).channels) or {d.place.channel for d in found}
        own = [min(abs(d.z), _MOST_Z) for d in found if d.place.channel in near]
        if own and max(own) >= _CLEAR_Z:
            ranked.append((sum(z * z for z in own) / len(own), name))
    return [name for _, name in sorted(ranked, reverse=True)]


def lacks_near(context: Context, component: str) -> bool:
    """Whether near a bearing the measurement is clearly below the model somewhere."""
    near = set(context.case.machine.bearing(component).channels)
    return any(
        d.z < -_CLEAR_Z and (d.place.channel in near or not near)
        for d in _differences(context)
        if d.place.domain in ("psd", "envelope")
    )


def _differences(context: Context) -> list[Difference]:
    return [d for domain in _DOMAINS for d in context.differences(domain) if d.z == d.z]
