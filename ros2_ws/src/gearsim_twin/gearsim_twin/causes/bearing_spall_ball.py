"""A spall of one rolling element: it strikes both races in each of its turns while the load presses on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearsim_twin.causes.bearing_model import seat_of
from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_fault
from gearsim_twin.causes.spalls import SPALL_WIDTH, candidates, has_bearings, seen_again, width_starts

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["BearingSpallBall"]

_KIND = "rolling_element_spall"
_WIDEST = 0.98  # of the element's radius


class BearingSpallBall:
    """A pit in one ball or roller."""

    name = "bearing_spall_ball"
    superposes = True
    parameters: tuple[Parameter, ...] = (SPALL_WIDTH,)
    size = SPALL_WIDTH.name
    confused_with: tuple[tuple[str, str], ...] = (
        (
            "bearing_geometry",
            "lines of the races: other dimensions move them, a spall of an element adds its own",
        ),
    )

    def applies(self, context: Context) -> bool:
        """Wherever a bearing is modelled."""
        return has_bearings(context)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The bearing whose lines at twice the BSF stand out most, then those alike in their lines."""
        signs = candidates(context, "rolling_element")
        return width_starts(context, signs) if signs else []

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """The content with a pit in the first element of the first row: which one does not show."""
        component = str(values["component"])
        widest = _WIDEST * seat_of(content, component).law.ball_radius_m
        return with_fault(content, _KIND, component, {"width_m": min(float(values["width_m"]), widest)})

    def told_again(self, values: Values, context: Context, heldout: Context) -> float:
        """Nats for its lines being found, and found again in records held out."""
        return seen_again(str(values["component"]), "rolling_element", context, heldout)

    def signature(self, values: Values) -> str:
        """In plain words."""
        return (
            f"impacts at {float(values['line_hz']):.4g} Hz and multiples (order "
            f"{float(values['line_order']):.4g}, twice the spin of an element) with sidebands at the turns "
            f"of the cage: a spall of one rolling element of {values['component']}, about "
            f"{1e3 * float(values['width_m']):.2g} mm wide"
        )
