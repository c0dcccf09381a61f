"""What faults add to a mesh beside smooth functions: numbers of the contact law, and rectangular pulses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

BACKLASH, LEAD_GAP = 0, 1


@dataclass(frozen=True)
class MeshTerm:
    """A part of a number of the contact law (`tooth.contact.ToothContact`).

    Any such part that is not zero lets the teeth of the mesh part.
    """

    table: ClassVar[str] = "mesh_terms"

    mesh: int
    what: int  # BACKLASH or LEAD_GAP
    value_m: float

    def numbers(self) -> tuple[float, ...]:
        """Mesh, kind, value."""
        return (self.mesh, self.what, self.value_m)

    def samples(self) -> None:
        """No table."""


@dataclass(frozen=True)
class MeshPulse:
    """A rectangular function of a track's turn, added to stiffness [N/m] or transmission error [m].

    The loop takes its exact mean over each step, and of the error also that of its rate.
    """

    table: ClassVar[str] = "mesh_pulses"

    mesh: int
    what: int  # `contributions.STIFFNESS` or `ERROR`
    track: int
    start_turns: float
    width_turns: float  # less than a turn
    height: float

    def numbers(self) -> tuple[float, ...]:
        """Mesh, kind, track, start, width, height."""
        return (self.mesh, self.what, self.track, self.start_turns, self.width_turns, self.height)

    def samples(self) -> None:
        """No table."""

    def mean(self, turns: float, step_turns: float) -> float:
        """Mean over the angles from `turns` - `step_turns` / 2 to `turns` + `step_turns` / 2."""
        return self.height * pulse_mean(turns - self.start_turns, step_turns, self.width_turns)


def plain_pulse_area(place: float, width: float) -> float:
    """Integral from 0 to `place` of a function that is 1 from 0 to `width` < 1 in each period of 1."""
    whole = place // 1.0
    return whole * width + min(place - whole, width)


def pulse_mean(place: float, length: float, width: float) -> float:
    """Mean of that function over `length` around `place`: a ramp of this length instead of a jump."""
    if length <= 0.0:
        return 1.0 if place - place // 1.0 < width else 0.0
    high, low = place + length / 2, place - length / 2
    return (plain_pulse_area(high, width) - plain_pulse_area(low, width)) / length
