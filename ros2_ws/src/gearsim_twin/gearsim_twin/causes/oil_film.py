"""An oil film between elements and races, squeezed out before metal bears: softer exits and impacts.

On a sound bearing it hardly shows (it is stiff in the load zone, and adds its thickness of some tenths of a
micrometre as preload); on one with a defect it takes away what is high in frequency.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearsim_twin.causes.bearing_model import DEFECTS, bearings_of, fault_of
from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_fault
from gearsim_twin.causes.near_bearing import lacks_near
from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.causes.spalls import has_bearings

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["OilFilm"]

_KIND = "oil_film"
_GUESSES_PA_S = (0.1, 0.5)
_MOST_STARTS = 4


class OilFilm:
    """An elastohydrodynamic film."""

    name = "oil_film"
    parameters: tuple[Parameter, ...] = (
        Parameter("viscosity_pa_s", "Pa*s", LogNormal(0.1, 2.5, 2e-3, 20.0)),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        ("bearing_spall_outer", "a record when the oil is warm: a narrower spall stays as weak"),
        ("bearing_spall_inner", "a record when the oil is warm: a narrower spall stays as weak"),
        ("wide_spall", "a record when the oil is warm: worn edges stay as soft"),
        ("antialias_rolloff", "a record without the defect: a filter takes from all that is high"),
        ("transfer_path", "another source on the same path, such as a tap with a hammer"),
    )

    def applies(self, context: Context) -> bool:
        """Wherever a bearing is modelled."""
        return has_bearings(context)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """Bearings that have a defect in the model; else those near which the model shows too much."""
        content = context.contents[0]
        free = [name for name in bearings_of(content) if fault_of(content, _KIND, name) is None]
        able = [n for n in free if any(fault_of(content, kind, n) is not None for kind in DEFECTS)]
        able = able or [name for name in free if lacks_near(context, name)]
        starts: list[dict[str, float | str]] = [
            {"component": name, "viscosity_pa_s": viscosity} for name in able for viscosity in _GUESSES_PA_S
        ]
        return starts[:_MOST_STARTS]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """The content with the film."""
        params = {"viscosity_pa_s": float(values["viscosity_pa_s"])}
        return with_fault(content, _KIND, str(values["component"]), params)

    def signature(self, values: Values) -> str:
        """In plain words."""
        return (
            f"impacts of {values['component']} weaker the higher the frequency, as if cushioned: an oil film "
            f"of {float(values['viscosity_pa_s']):.2g} Pa s"
        )
