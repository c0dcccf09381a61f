"""Another bearing than on the nameplate: other elements, another contact angle, another number of elements.

What counts for the races and the cage is d cos(a) / D alone; only the spin of the elements tells a larger
element from another angle. See `cage_motion`, and docs/twin_causes.md for what can be told from slip.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from gearsim_twin.causes.bearing_model import seat_of
from gearsim_twin.causes.bearing_signs import signs_of
from gearsim_twin.causes.cage_motion import (
    SLIP_OR_GEOMETRY,
    Deviation,
    cage_nats,
    deviations,
    movable,
    united_std,
)
from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_parameter
from gearsim_twin.causes.prior import Normal
from gearsim_twin.causes.spalls import has_bearings

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["BearingGeometry", "spin_of"]

_DIAMETER, _ANGLE, _COUNT = "element_diameter", "contact_angle", "rolling_elements"
_LEAST_SHARE, _LEAST_Z = 3e-4, 3.0
_MOST_CHANGE = 0.3
_SPIN_DOUBT = 3.0
_ROOM = 0.99
_MOST_STARTS = 4
_VARIANTS = {_ANGLE: "another contact angle", _DIAMETER: "elements of another diameter"}


class BearingGeometry:
    """Dimensions of a bearing that contradict its nameplate."""

    name = "bearing_geometry"
    parameters: tuple[Parameter, ...] = (
        Parameter("diameter_ratio_change", "1", Normal(0.0, 0.02, -_MOST_CHANGE, _MOST_CHANGE), step=0.004),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        ("cage_slip", SLIP_OR_GEOMETRY),
        ("shaft_speed_offset", "a line of the shaft or the BPFI: a speed moves BPFO and BPFI alike"),
        ("mislabelled_record", "orders of shafts and meshes: those of another machine differ too"),
    )

    def applies(self, context: Context) -> bool:
        """Wherever a bearing is modelled."""
        return has_bearings(context)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """Dimensions that put the cage where its lines are, the surest bearing first."""
        found = []
        for component in movable(context):
            one = _united(deviations(context, component))
            if one is not None:
                found.append((abs(one[0]) / one[1], _starts(context, component, *one)))
        found.sort(key=lambda each: -each[0])
        return [start for _, starts in found for start in starts][:_MOST_STARTS]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """The content with what is built in, the nameplate staying as it is."""
        component = str(values["component"])
        law = seat_of(content, component).law
        factor = 1.0 + float(values["diameter_ratio_change"])
        place = f"nameplate.bearings.{component}"
        elements = int(float(values["rolling_elements"]))
        if elements != law.balls_per_row:
            content = with_parameter(content, f"{place}.{_COUNT}", elements, "1")
        if values["by"] == _ANGLE:
            angle = math.acos(min(math.cos(law.contact_angle_rad) * factor, 1.0))
            return with_parameter(content, f"{place}.{_ANGLE}", angle, "rad")
        widest = _ROOM * 2 * law.pitch_radius_m * math.sin(math.pi / elements)
        diameter = min(2 * law.ball_radius_m * factor, widest)
        return with_parameter(content, f"{place}.{_DIAMETER}", diameter, "m")

    def told_again(self, values: Values, context: Context, heldout: Context) -> float:
        """Nats by which positions of lines speak for it, in records for training and in those held out."""
        component = str(values["component"])
        if values["told"] != _DIAMETER:
            return 0.0
        law = seat_of(context.contents[0], component).law
        turning = -1.0 if context.case.machine.bearing(component).outer_ring_rotates else 1.0
        gamma = law.gamma * (1.0 + float(values["diameter_ratio_change"]))
        share = (1.0 - turning * gamma) / (1.0 - turning * law.gamma) - 1.0
        return cage_nats(context, heldout, component, lambda _: share)

    def thing(self, values: Values) -> str:
        """What is wrong, whether by the elements or by the angle."""
        return f"other dimensions of {values['component']} than on the nameplate"

    def variant(self, values: Values) -> str:
        """What of the dimensions it is."""
        return _VARIANTS[str(values["by"])]

    def signature(self, values: Values) -> str:
        """In plain words."""
        change = 100 * float(values["diameter_ratio_change"])
        count = "" if values["told"] == _DIAMETER else f", {values['rolling_elements']} elements"
        return (
            f"BPFO and BPFI of {values['component']} off by as many hertz to either side, the same in all "
            f"records: d cos(a) / D is {change:+.2g} % off the nameplate's ({self.variant(values)}{count})"
        )


def _united(found: list[Deviation]) -> tuple[float, float, Deviation] | None:
    """Mean deviation of the cage over the records, its standard deviation, and the best record."""
    if not found:
        return None
    share, std = np.array([one.share for one in found]), np.array([one.std for one in found])
    mean = float(np.average(share, weights=std**-2.0))
    return mean, united_std(share, std), min(found, key=lambda one: one.motion.spin_std)


def _starts(
    context: Context, component: str, share: float, std: float, best: Deviation
) -> list[dict[str, float | str]]:
    bearing = context.case.machine.bearing(component)
    law = seat_of(context.contents[0], component).law
    counts = {s.elements for v in context.views for s in signs_of(v) if s.component == component}
    other = next((count for count in counts if count != bearing.rolling_elements), 0)
    sure = abs(share) > _LEAST_SHARE and abs(share) > _LEAST_Z * std
    if not other and not sure:
        return []
    turning = -1.0 if bearing.outer_ring_rotates else 1.0
    gamma = turning * (1.0 - (1.0 - turning * law.gamma) * (1.0 + share))
    change = gamma / law.gamma - 1.0 if sure else 0.0
    if abs(change) >= _MOST_CHANGE or other * math.asin(law.ball_radius_m / law.pitch_radius_m) > math.pi:
        return []
    start: dict[str, float | str] = {
        "component": component,
        "diameter_ratio_change": change,
        "std:diameter_ratio_change": std * (1.0 - turning * law.gamma) / law.gamma,
        "rolling_elements": float(other or bearing.rolling_elements),
        "told": _COUNT if other else _DIAMETER,
    }
    ways = [_DIAMETER, _ANGLE] if math.cos(law.contact_angle_rad) * (1.0 + change) < 1.0 else [_DIAMETER]
    if other:
        return [{**start, "by": _DIAMETER}]
    size = law.ball_radius_m / law.pitch_radius_m
    doubts = {way: _spin_doubt(best, spin_of(size, law.gamma, change, way)) for way in ways}
    ways = [way for way in ways if doubts[way] < _SPIN_DOUBT] or ways
    return [{**start, "by": way} for way in sorted(ways, key=lambda way: doubts[way])]


def spin_of(size: float, gamma: float, change: float, way: str) -> float:
    """Turns of an element per turn of the shaft, D (1 - g^2) / (2 d), after a change of g = d cos(a) / D.

    Parameters
    ----------
    size : float
        d / D before.
    gamma, change : float
        g before, and its relative change.
    way : str
        "element_diameter": d / D changes with it; "contact_angle": it stays.
    """
    now = gamma * (1.0 + change)
    return (1.0 - now**2) / (2.0 * (size * (1.0 + change) if way == _DIAMETER else size))


def _spin_doubt(one: Deviation, spin: float) -> float:
    """By how many standard deviations the spin is off; 0 where it is not told."""
    motion = one.motion
    return abs(motion.spin - spin) / motion.spin_std if math.isfinite(motion.spin) else 0.0
