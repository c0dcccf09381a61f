"""A spall of a race so long that elements roll over its floor: entry and exit are two events.

The way from entry to impact is fixed by the spall, so that their distance in time goes as one over the speed;
an echo or the ringing of a housing keeps its time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearsim_sim.model.pit import race_edge
from gearsim_twin.causes.bearing_model import seat_of
from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_fault
from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.causes.spalls import (
    candidates,
    damaged,
    has_bearings,
    known_width_m,
    seen_again,
    sign_words,
)

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["WideSpall"]

_KIND = "wide_spall"
_RACES = {"outer_race": "outer", "inner_race": "inner"}
_EDGE_RADIUS_M = 0.1e-3
_DEPTH_M = 20e-6
# Of the element's diameter. Two events that ring in one resonance add up or cancel as their distance changes
# by half a period of it, some tenths of a millimetre: a fit finds but the nearest such length.
_GUESSES = (0.9, 0.35, 0.6, 0.75, 0.48, 1.05, 0.68, 0.82)
_SHORT = 0.35  # of less likely races
# Shorter ones leave an element no time on the floor: they show what a localised spall shows.
_SHORTEST = 0.25  # of the element's diameter
_MOST_STARTS = 9
_REACHED = 0.9  # of the depth that an element reaches: beyond, it would not come down to the floor
_ROOM = 0.9  # of the race's circumference


class WideSpall:
    """A pit of a race with entry edge, floor and exit edge."""

    name = "wide_spall"
    superposes = True
    size = "depth_m"
    parameters: tuple[Parameter, ...] = (
        Parameter("length_m", "m", LogNormal(4e-3, 2.0, 1e-3, 0.1)),
        Parameter("depth_m", "m", LogNormal(20e-6, 2.5, 1e-6, 5e-4)),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        (
            "bearing_spall_outer",
            "a record at another speed: the way from entry to impact stays, its time goes as 1/speed",
        ),
        (
            "bearing_spall_inner",
            "a record at another speed: the way from entry to impact stays, its time goes as 1/speed",
        ),
    )

    def applies(self, context: Context) -> bool:
        """Wherever a bearing is modelled."""
        return has_bearings(context)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The race whose lines stand out most, as long as two separate events tell."""
        signs = [each for fault in _RACES for each in candidates(context, fault)]
        found: list[dict[str, float | str]] = []
        for number, (record, sign) in enumerate(sorted(signs, key=lambda each: -each[1].weight)):
            diameter = context.case.machine.bearing(sign.component).element_diameter_m
            lengths = [_SHORT * diameter]
            if number == 0:
                known = known_width_m(context, record, sign)
                lengths = [part * diameter for part in _GUESSES] if known is None else [known]
                if lengths[0] < _SHORTEST * diameter:
                    continue
            words = {**sign_words(sign, context, record), "race": _RACES[sign.fault]}
            found += [{**words, "length_m": length, "depth_m": _DEPTH_M} for length in lengths]
        return found[: _MOST_STARTS - 1]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """The content with the spall, in the load zone of a ring that stands."""
        component, race = str(values["component"]), str(values["race"])
        law = seat_of(content, component).law
        radius = law.inner_race_radius_m if race == "inner" else law.outer_race_radius_m
        length = min(float(values["length_m"]), _ROOM * (6.28 * radius - 2 * law.ball_radius_m))
        edge = race_edge(radius, law.ball_radius_m, inner=race == "inner", rounding_m=_EDGE_RADIUS_M)
        reach = float(edge.drop(min(length / (2 * radius), edge.greatest_angle_rad)))
        params = {
            "race": race,
            "length_m": length,
            "depth_m": min(float(values["depth_m"]), _REACHED * reach),
        }
        return with_fault(content, _KIND, component, params)

    def told_again(self, values: Values, context: Context, heldout: Context) -> float:
        """Nats for its lines being found, and found again in records held out."""
        fault = next(fault for fault, race in _RACES.items() if race == values["race"])
        return seen_again(str(values["component"]), fault, context, heldout)

    def thing(self, values: Values) -> str:
        """What is damaged, by whichever name."""
        return damaged(f"{values['race']}_race", str(values["component"]))

    def signature(self, values: Values) -> str:
        """In plain words."""
        return (
            f"two events in each passage, at {float(values['line_hz']):.4g} Hz and multiples (order "
            f"{float(values['line_order']):.4g}), whose distance goes as 1/speed: a spall of the "
            f"{values['race']} race of {values['component']}, {1e3 * float(values['length_m']):.2g} mm long "
            f"and {1e6 * float(values['depth_m']):.2g} um deep"
        )
