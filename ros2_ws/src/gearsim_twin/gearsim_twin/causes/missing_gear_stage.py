"""A gear stage that the model lacks: a family of orders with another number of teeth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_entry, with_parameter
from gearsim_twin.causes.mesh_orders import at_order, mesh_orders, order_amplitudes
from gearsim_twin.causes.prior import LogNormal, Uniform

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context
    from gearsim_twin.view import View

__all__ = ["Family", "MissingGearStage", "strange_families"]

Array = NDArray[np.float64]

_TEETH = (9, 160)
_TOP_ORDER = 400.0
_EXCESS_DB = 10.0  # over the model
_STANDS_OUT_DB = 14.0  # over the shaft's own orders beside it
_ALONE = 2.0  # times the highest of the three orders on either side
_LISTED_DB = 6.0
_BESIDE = 6
_FIRST_STAGE = "first_stage"
_SHARE_OF_LOAD = 0.02


@dataclass(frozen=True, slots=True)
class Family:
    """Teeth on a shaft that the model does not know: their order, and by how much it shows."""

    shaft: str
    teeth: int
    order: float
    size_db: float
    channel: str
    second: float


def strange_families(view: View, model: View) -> list[Family]:
    """Numbers of teeth whose first two lines stand out of the measurement and of the model, largest first.

    Parameters
    ----------
    view, model : View
        Measured and simulated, both with an angle.
    """
    known = [order for order in mesh_orders(view.machine).values() if _shown(model, order)]
    ratios = {shaft.name: abs(shaft.ratio) for shaft in view.machine.shafts if shaft.ratio}
    found: dict[float, Family] = {}
    for channel in view.record.channels:
        one, other = (order_amplitudes(v, channel, _TOP_ORDER) for v in (view, model))
        if one is None or other is None:
            continue
        for shaft, ratio in ratios.items():
            for teeth in range(*_TEETH):
                order = teeth * ratio
                if _of_known(order, known, ratio):
                    continue
                sizes = [_size(one, other, order * k, ratio) for k in (1, 2)]
                size = min(sizes)
                if size > 0 and size > found.get(order, _nothing()).size_db:
                    amplitudes = [at_order(one[0], one[1], order * k) for k in (1, 2)]
                    part = amplitudes[1] / max(amplitudes[0], 1e-300)
                    found[order] = Family(shaft, teeth, order, size, channel, part)
    families = sorted(found.values(), key=lambda family: (-family.size_db, family.order))
    # What a family explains by its multiples, or is itself a multiple of, is no other family.
    kept: list[Family] = []
    for family in families:
        if not any(_multiple(family.order, one.order) or _multiple(one.order, family.order) for one in kept):
            kept.append(family)
    return kept


def _nothing() -> Family:
    return Family("", 0, 0.0, 0.0, "", 0.0)


def _shown(model: View, order: float) -> bool:
    """Whether the model shows a mesh at all."""
    for channel in model.record.channels:
        found = order_amplitudes(model, channel, _TOP_ORDER)
        if found is not None and at_order(*found, order) > 3 * _median_beside(found[0], found[1], order, 1.0):
            return True
    return False


def _multiple(order: float, of: float) -> bool:
    return abs(order / of - round(order / of)) < 1e-6 * order / of


def _of_known(order: float, known: list[float], ratio: float) -> bool:
    """Whether an order is a multiple of a known mesh or a side line of it."""
    for mesh in known:
        number = round(order / mesh)
        if number >= 1 and abs(order - number * mesh) <= 3.5 * ratio:
            return True
    return False


def _median_beside(spectrum: Array, step: float, order: float, ratio: float) -> float:
    beside = [at_order(spectrum, step, order + k * ratio) for k in range(-_BESIDE, _BESIDE + 1) if k]
    return float(np.median(beside))


def _size(one: tuple[Array, float], other: tuple[Array, float], order: float, ratio: float) -> float:
    """The excess in dB over the model, and over the shaft's own orders beside it; 0 where it is not clear."""
    height = at_order(*one, order)
    if height <= 0:
        return 0.0
    beside = max(at_order(*one, order + k * ratio) for k in (-3, -2, -1, 1, 2, 3))
    usual = _median_beside(*one, order, ratio)
    over_model = 20 * np.log10(height / max(at_order(*other, order), 1e-12 * height))
    over_beside = 20 * np.log10(height / max(usual, 1e-12 * height))
    alone = height > _ALONE * beside
    if over_model < _EXCESS_DB or over_beside < _STANDS_OUT_DB or not alone:
        return 0.0
    return float(min(over_model, over_beside))


def listed_stage(view: View, model: View, order: float) -> float:
    """Excess in dB of the first lines of a mesh that the nameplate lists and the model leaves out.

    The second largest of its first three lines over all channels: those lines may be other meshes' side lines
    in the model, too.
    """
    excess = []
    for channel in view.record.channels:
        one, other = (order_amplitudes(v, channel, _TOP_ORDER) for v in (view, model))
        if one is None or other is None:
            continue
        rows = []
        for k in (1, 2, 3):
            high, low = at_order(*one, k * order), at_order(*other, k * order)
            rows.append(20 * np.log10(max(high, 1e-12) / max(low, 1e-12)))
        excess.append(sorted(rows)[1])
    return float(max(excess, default=0.0))


class MissingGearStage:
    """A stage in front of those that the model has."""

    name = "missing_gear_stage"
    superposes = True
    parameters: tuple[Parameter, ...] = (
        Parameter("amplitude_nm", "N*m", LogNormal(0.5, 8.0, 1e-6, 1e5)),
        Parameter("second", "1", Uniform(0.0, 4.0)),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        ("gear_runout", "a record at the speed of another shaft: side lines are a shaft's turn apart"),
        ("mislabelled_record", "the teeth counted on the machine itself"),
    )

    def applies(self, context: Context) -> bool:
        """Where the model has gears and the angle is known."""
        geared = context.case.modelled.kind in ("parallel_shaft", "planetary")
        return geared and any(view.phase is not None for view in context.views)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The largest strange families; a stage that the nameplate lists comes as that."""
        found: list[Family] = []
        starts: list[dict[str, float | str]] = []
        for view, model in zip(context.views, context.simulated_views, strict=True):
            if view.phase is None or model.phase is None:
                continue
            found += strange_families(view, model)
            for order, teeth in _left_out(context).items():
                if listed_stage(view, model, order) > _LISTED_DB and not starts:
                    stage: dict[str, float | str] = {"order": order, "teeth": float(teeth)}
                    stage |= {"amplitude_nm": 1.0, "second": 0.5, "component": _FIRST_STAGE}
                    starts.append(stage)
        found.sort(key=lambda family: -family.size_db)
        for family in found:
            if any(start["order"] == family.order for start in starts):
                continue
            start: dict[str, float | str] = {
                "amplitude_nm": _SHARE_OF_LOAD * max(_load_nm(context), 1.0),
                "second": min(family.second, 4.0),
                "order": family.order,
                "teeth": float(family.teeth),
                "component": family.shaft,
            }
            starts.append(start)
        return starts[:4]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """The stage itself where the model can have it, else its pulsation of the motor's torque."""
        if values["component"] == _FIRST_STAGE:
            return with_parameter(content, "first_stage.included", 1.0, "1")
        for number, part in ((1, 1.0), (2, float(values["second"]))):
            ripple = {
                "at": "motor",
                "order": float(f"{number * float(values['order']):.9g}"),
                "amplitude": f"{float(values['amplitude_nm']) * part:.9g} N*m",
            }
            content = with_entry(content, "profile.ripple", ripple)
        return content

    def signature(self, values: Values) -> str:
        """In plain words."""
        order = float(values["order"])
        return (
            f"lines at {order:.5g} per turn of the reference shaft and multiples, as of a wheel with "
            f"{float(values['teeth']):.0f} teeth that the model does not have"
        )


def _left_out(context: Context) -> dict[float, int]:
    """Mesh orders of a first stage that the model can have and leaves out, and its driving teeth."""
    told = context.contents[0].get("parameters", {}).get("first_stage.included", {"value": 0.0})
    included = float(told["value"]) if isinstance(told, dict) else float(told)
    if context.case.modelled.kind != "planetary" or included:
        return {}
    machine = context.case.machine
    return {
        abs(mesh.driving_teeth * machine.shaft(mesh.driving_shaft).ratio): mesh.driving_teeth
        for mesh in machine.gear_meshes
        if mesh.driven_shaft == machine.reference_shaft
    }


def _load_nm(context: Context) -> float:
    loads = [view.load_nm for view in context.views if view.load_nm is not None]
    return float(np.mean(loads)) if loads else context.case.modelled.load_nm
