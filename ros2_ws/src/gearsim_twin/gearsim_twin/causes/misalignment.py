"""Misalignment: a coupling out of line, or teeth that do not bear over their whole face."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_fault
from gearsim_twin.causes.gear_model import Part, parts_of
from gearsim_twin.causes.matched import Match, matches
from gearsim_twin.causes.prior import LogNormal, Uniform

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["Misalignment"]

_COUPLING, _MESH = "shaft_misalignment", "gear_misalignment"
_OFFSET_M, _ANGLE_RAD, _LEAD_RAD = 2e-4, 0.01, 5e-4
_OFFSETS_M, _ANGLES_RAD = (1e-6, 4e-3), (1e-5, 0.1)
_LEADS_RAD = (1e-5, 0.02)
_GROWS = 2.0  # the force of an angle between shafts grows with its square, that of an offset as it does
_BETWEEN = 1.5
# Alignment is held to 0.05 mm beside 0.5 mrad, couplings stand 0.2 mm beside 10 mrad: between both.
_RATIO = 25.0
_TOP = 13  # lines that couplings of shafts bring: forces are known up to order 6
# Across the load a coupling's force shakes the foot, against it balls and teeth unload: answers differ.
_DIRECTIONS = 8
_MOST = 4
_NONE_M, _NONE_RAD = 1e-5, 5e-4


class Misalignment:
    """Forces of a coupling whose shafts are not in line, or teeth that carry at one end."""

    name = "misalignment"
    superposes = True
    parameters: tuple[Parameter, ...] = (
        Parameter("offset_m", "m", LogNormal(_OFFSET_M, 3.0, *_OFFSETS_M)),
        Parameter("angle_rad", "rad", LogNormal(0.003, 4.0, *_ANGLES_RAD)),
        Parameter("direction_rad", "rad", Uniform(-math.pi, math.pi)),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        (
            "unbalance",
            "the coupling opened: an unbalance stays; or a second speed: a coupling's force does not grow "
            "with its square",
        ),
        (
            "looseness",
            "the direction across the foot: a coupling out of line shakes all round, a foot lifts one way",
        ),
        ("gear_runout", "encoders on both shafts: a coupling does not move the mesh"),
        (
            "unequal_load_sharing",
            "a second load: the end that carries spreads over the face as the load grows",
        ),
    )

    def applies(self, context: Context) -> bool:
        """Wherever the model has couplings, or meshes whose teeth are known."""
        return bool(context.contents) and bool(self._couplings(context) + self._meshes(context))

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """Shafts whose coupling answers most, by offset or by angle, and meshes by a lead error."""
        # Offset and angle at once tell the shaft and the direction; how much of which, each by itself.
        tried = [replace(part, side=str(d)) for part in self._couplings(context) for d in range(_DIRECTIONS)]
        both = matches(
            context, tried, self._both, _OFFSET_M, _OFFSETS_M, angle="any", power=_BETWEEN, top=_TOP
        )[:1]
        # An angle alone, of which each shaft would need as many again, is tried in every other direction.
        shafts = [match.part for match in both] or tried[::2]
        # On a shaft a coupling may stand at any angle.
        offset = matches(
            context, shafts[: len(both)], self._offset, _OFFSET_M, _OFFSETS_M, angle="any", top=_TOP
        )
        angle = matches(
            context,
            shafts,
            self._angle,
            _ANGLE_RAD,
            _ANGLES_RAD,
            angle="any",
            power=_GROWS,
            top=_TOP,
        )
        lead = matches(context, self._meshes(context)[:1], self._lead, _LEAD_RAD, _LEADS_RAD)
        guesses = [_guess(m, m.value, _NONE_RAD) for m in offset]
        guesses += [_guess(m, _NONE_M, m.value) for m in (*angle, *lead)]
        guesses += [_guess(m, m.value, _RATIO * m.value) for m in both]
        by_drop = sorted(guesses, key=lambda guess: -guess[0])
        return [guess for _, guess in by_drop[:_MOST]]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """With a coupling out of line, or a mesh with a lead error, where only the angle has a meaning."""
        component, angle = str(values["component"]), float(values["angle_rad"])
        if component in {part.name for part in parts_of(content, _MESH)}:
            return with_fault(content, _MESH, component, {"angle_rad": min(angle, _LEADS_RAD[1])})
        offset, direction = float(values["offset_m"]), float(values.get("direction_rad", math.pi / 2))
        params = {"offset_m": offset, "angle_rad": angle, "direction_rad": direction}
        return with_fault(content, _COUPLING, component, params)

    def signature(self, values: Values) -> str:
        """Multiples of the speed."""
        return (
            f"lines at the speed of {values['component']} and at its multiples, two and three "
            "times most of all, on "
            f"the bearings next to its coupling: {1e3 * float(values['offset_m']):.2g} mm and "
            f"{1e3 * float(values['angle_rad']):.2g} mrad out of line"
        )

    @staticmethod
    def _couplings(context: Context) -> list[Part]:
        return list(parts_of(context.contents[0], _COUPLING))

    @staticmethod
    def _meshes(context: Context) -> list[Part]:
        return list(parts_of(context.contents[0], _MESH))

    @staticmethod
    def _offset(content: Content, part: Part, value: float) -> Content:
        return _out_of_line(content, part, value, 0.0)

    @staticmethod
    def _angle(content: Content, part: Part, value: float) -> Content:
        return _out_of_line(content, part, 0.0, value)

    @staticmethod
    def _both(content: Content, part: Part, value: float) -> Content:
        return _out_of_line(content, part, value, _RATIO * value)

    @staticmethod
    def _lead(content: Content, part: Part, value: float) -> Content:
        return with_fault(content, _MESH, part.name, {"angle_rad": value})


def _direction(part: Part) -> float:
    """Of a coupling that is tried in several: the number of the direction is its side."""
    return math.remainder(2.0 * math.pi * int(part.side or 0) / _DIRECTIONS, 2.0 * math.pi)


def _out_of_line(content: Content, part: Part, offset_m: float, angle_rad: float) -> Content:
    params = {"offset_m": offset_m, "angle_rad": angle_rad, "direction_rad": _direction(part)}
    return with_fault(content, _COUPLING, part.name, params)


def _guess(match: Match, offset_m: float, angle_rad: float) -> tuple[float, dict[str, float | str]]:
    """What its weighted squares fall by, and the guess."""
    found: dict[str, float | str] = {"component": match.part.name, "offset_m": offset_m}
    return match.drop, {**found, "angle_rad": angle_rad, "direction_rad": _direction(match.part)}
