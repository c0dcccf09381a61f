"""What the spalls of bearings share: where they are, how wide as a first guess, and what fits in."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from gearsim_dsp.judges.bearing import ALARM_PROBABILITY
from gearsim_twin.causes.bearing_model import alike, bearings_of, has_defect, seat_of
from gearsim_twin.causes.bearing_signs import Sign, size_of, unexplained_signs
from gearsim_twin.causes.cause import REPEATED_NATS, Content, Parameter, Values
from gearsim_twin.causes.edit import with_fault
from gearsim_twin.causes.passage_signs import passage_signs, shown_again
from gearsim_twin.causes.prior import LogNormal

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = [
    "FAULT_NATS",
    "SPALL_WIDTH",
    "RaceSpall",
    "candidates",
    "damaged",
    "has_bearings",
    "known_width_m",
    "seen_again",
    "sign_words",
    "width_starts",
]

SPALL_WIDTH = Parameter("width_m", "m", LogNormal(0.8e-3, 2.0, 5e-5, 1e-2))
"""Width along the race or element: pits that are told in the literature have 0.2 to 3 mm."""

# First guesses where the width cannot be told, in parts of the element's diameter: a level goes up with the
# width until the element reaches the bottom, then shape and spacing of the events change.
_GUESSES = (0.05, 0.12, 0.27)
_MOST_STARTS = 4
_ROOM = 0.98
_NEARLY = 0.5
FAULT_NATS = min(-2.0 * math.log(ALARM_PROBABILITY), 15.0)
"""For lines that the diagnosis calls a fault in records for training and in those held out: its false alarms
are independent there, but a machine beside may show such lines once in some millions of cases."""
_ALIKE = 0.01  # slip changes from load to load by less
# How lines of a fault are called, and how far they must stand out of a healthy record to be no part of it.
_LINES_OF = {"outer_race": "BPFO", "inner_race": "BPFI", "rolling_element": "BSF"}
_NEWS_Z = 4.0
# Of a model that has a tenth of a line's power or less; tones and passages are what is asked about.
_RIGHT_DB, _FEWEST_LINES = 4.0, 4
_NO_LINES = ("tone", "passage", "ratio")
_FAR_LOG = 0.5  # a width by events that is further from the usual one has that as a second guess


def has_bearings(context: Context) -> bool:
    """Whether the model has bearings that are on the nameplate."""
    named = {bearing.name for bearing in context.case.machine.bearings}
    return bool(named & set(bearings_of(context.contents[0])))


def candidates(context: Context, fault: str, *, absent: bool = False) -> list[tuple[int, Sign]]:
    """Unexplained signs of bearings that the model has, where no defect of it gives these lines already.

    Those of the spectrum itself count where the envelope shows none of that kind.
    """
    content, machine = context.contents[0], context.case.machine
    known = bearings_of(content)
    found = unexplained_signs(context, fault, absent=absent)
    heard = {name for _, sign in found for name in alike(machine, sign.component)}
    found += [e for e in passage_signs(context, fault, absent=absent) if e[1].component not in heard]
    return [
        (record, sign)
        for record, sign in found
        if sign.component in known and not has_defect(content, alike(machine, sign.component), fault)
    ]


def seen_again(component: str, fault: str, context: Context, heldout: Context) -> float:
    """Nats for lines that the model lacks in the records for training and, alike, in those held out.

    Lines that the diagnosis would call a fault in both are as sure as its alarms: levels of a rig whose
    structure the model has not must not outweigh that.
    """
    if not (_is_news(context, fault) and _is_news(heldout, fault)):
        return 0.0
    own = [sign for _, sign in candidates(context, fault, absent=True) if sign.component == component]
    # Sound bearings pass their elements audibly, and a real spectrum is full of lines: that the model lacks
    # weak ones says as little as its other lines are right.
    right = _errs_db(context) < _RIGHT_DB
    if own and own[0].run is not None:
        # Found by as much as the diagnosis asks for, and again by as much as counts in itself.
        return FAULT_NATS if right and shown_again(own[0], heldout) else 0.0
    found: list[Sign] = []
    for each in (context, heldout):
        signs = candidates(each, fault, absent=True)
        mine = [sign for _, sign in signs if sign.component == component]
        if not mine:
            return 0.0
        found.append(mine[0])
    if abs(found[1].found_order / found[0].found_order - 1.0) >= _ALIKE:
        return 0.0
    if all(sign.is_fault for sign in found):
        return FAULT_NATS
    return REPEATED_NATS if right else 0.0


def _is_news(context: Context, fault: str) -> bool:
    """Whether lines of such a fault stand out of what healthy records show, if there are any."""
    if not context.healthy_views:
        return True
    return any(
        _LINES_OF[fault] in each.place.label and each.z >= _NEWS_Z
        for domain in ("envelope", "orders", "cyclic")
        for each in context.differences(domain)
    )


def _errs_db(context: Context) -> float:
    """By how much lines of shafts and races are wrong in the model, dB (median); 0 where nothing tells."""
    found = [
        abs(float(one.difference_db[k]))
        for one in context.comparison
        for k, place in enumerate(one.places)
        if one.counted[k] and place.domain == "orders" and place.kind not in _NO_LINES
    ]
    return float(np.median(found)) if len(found) >= _FEWEST_LINES else 0.0


def known_width_m(context: Context, record: int, sign: Sign) -> float | None:
    """Width of a spall by the events of its crossings, if they tell it."""
    if sign.run is not None:
        return None
    sizing = size_of(context.views[record], sign)
    return None if sizing is None or sizing.width is None else sizing.width.value_m


def sign_words(sign: Sign, context: Context, record: int) -> dict[str, float | str]:
    """What the plain words of a signature need."""
    return {
        "component": sign.component,
        "line_order": float(f"{sign.expected_order:.6g}"),
        "line_hz": float(f"{sign.expected_order * context.views[record].speed_hz:.4g}"),
    }


def damaged(fault: str, component: str) -> str:
    """What localised and wide spalls of a race have in common."""
    return f"a damaged {fault.replace('_', ' ')} of {component}"


def width_starts(
    context: Context, signs: list[tuple[int, Sign]], known_m: float | None = None
) -> list[dict[str, float | str]]:
    """Widths for the likeliest bearing, fewer where another one with the same lines is nearly as likely."""
    near = [each for each in signs if each[1].weight > _NEARLY * signs[0][1].weight]
    found: list[dict[str, float | str]] = []
    for number, (record, sign) in enumerate(signs):
        diameter = context.case.machine.bearing(sign.component).element_diameter_m
        widths = [part * diameter for part in _GUESSES]
        if len(near) > 1:
            widths = widths[1:]
        if number >= len(near):
            widths = [_GUESSES[1] * diameter]
        if known_m is not None:
            far = abs(math.log(known_m / (_GUESSES[1] * diameter))) > _FAR_LOG
            widths = [known_m, _GUESSES[1] * diameter] if far and number == 0 else [known_m]
        words = sign_words(sign, context, record)
        found += [{**words, "width_m": width} for width in widths]
    return found[:_MOST_STARTS]


class RaceSpall:
    """A localised spall of one race of a bearing.

    Parameters
    ----------
    name : str
        Published name of the cause.
    fault : str
        What the diagnosis calls it.
    kind : str
        Kind of fault of the simulator.
    confused_with : tuple of (str, str)
    """

    parameters: tuple[Parameter, ...] = (SPALL_WIDTH,)
    size = SPALL_WIDTH.name
    superposes = True

    def __init__(self, name: str, fault: str, kind: str, confused_with: tuple[tuple[str, str], ...]) -> None:
        self.name = name
        self.fault = fault
        self.kind = kind
        self.confused_with = confused_with

    def applies(self, context: Context) -> bool:
        """Wherever a bearing is modelled."""
        return has_bearings(context)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The bearing whose lines stand out most, as wide as its events tell; then those alike in lines."""
        signs = candidates(context, self.fault)
        if not signs:
            return []
        record, sign = signs[0]
        known = known_width_m(context, record, sign)
        return width_starts(context, signs, known)

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """The content with the spall, in the load zone of a ring that stands."""
        component = str(values["component"])
        law = seat_of(content, component).law
        inner = self.fault == "inner_race"
        radius = law.inner_race_radius_m if inner else law.outer_race_radius_m
        widest = _ROOM * min(law.ball_spacing_rad * radius, 2 * law.ball_radius_m)
        width = min(float(values["width_m"]), widest)
        return with_fault(content, self.kind, component, {"width_m": width})

    def told_again(self, values: Values, context: Context, heldout: Context) -> float:
        """Nats for its lines being found, and found again in records held out."""
        return seen_again(str(values["component"]), self.fault, context, heldout)

    def thing(self, values: Values) -> str:
        """What is damaged, by whichever name."""
        return damaged(self.fault, str(values["component"]))

    def signature(self, values: Values) -> str:
        """In plain words."""
        race = self.fault.replace("_race", "")
        sides = " with sidebands at the turns of the shaft" if self.fault == "inner_race" else ""
        return (
            f"impacts at {float(values['line_hz']):.4g} Hz and multiples (order "
            f"{float(values['line_order']):.4g}){sides} in the envelope: a spall of the {race} race of "
            f"{values['component']}, about {1e3 * float(values['width_m']):.2g} mm wide"
        )
