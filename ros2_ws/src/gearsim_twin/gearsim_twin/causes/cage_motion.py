"""How fast a cage turns, by all fault lines of its bearing together, and how fast the model has it.

With one ring at rest, Z elements, the shaft at r times the reference shaft and the cage at c r / 2, every
family of lines is a count of passages:

    race at rest  Z r c / 2,    turning race  Z r (2 - c) / 2,    cage  r c / 2

so one number c tells them all, whatever moved it: with g = d cos(a) / D it is 1 - g where the inner ring
turns and 1 + g where the outer one does, times (1 - s) with slip. The two races move by equal and opposite
amounts, Z r dc / 2; their sum Z r stays, and a deviation of the sum is one of the shaft's speed (or of Z).
The spin of the elements is apart: it is b = D (1 - g^2) / (2 d) r, times (1 - s) where the elements lag with
their cage.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.causes.bearing_model import DEFECTS, alike, bearings_of, fault_of, force_n, seat_of
from gearsim_twin.causes.bearing_signs import Sign, signs_of
from gearsim_twin.causes.cause import REPEATED_NATS, Content

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context
    from gearsim_twin.view import View

__all__ = [
    "SLIP_OR_GEOMETRY",
    "CageMotion",
    "Deviation",
    "cage_motion",
    "cage_nats",
    "deviations",
    "model_share",
    "model_spin",
    "movable",
    "slip_share",
    "united_std",
]

SLIP_OR_GEOMETRY = (
    "the spin of an element (BSF), a second load, or how lines widen with their number: slip moves the BSF "
    "by the share of the BPFO, other elements by four times as much, another contact angle by a third, and "
    "only slip falls with the load and jitters; the BPFI does not tell, for it moves against the BPFO alike"
)
"""What decides between the two causes that move a cage."""

# Speed of the shaft where its angle is measured; what is left is torsion and the clock.
_LEAST_SPEED_ERROR = 2e-5
# Below this part of the strongest sign, lines may be others' (third-order combinations of the strongest).
_TRUSTED = 0.1
_BALL_TRUSTED = 0.2
# However well positions are told, a systematic error of theirs is possible once in so many cases.
_MOST_NATS = 15.0


@dataclass(frozen=True, slots=True)
class CageMotion:
    """What the fault lines of a bearing tell of its motion in one record.

    Attributes
    ----------
    share, std : float
        c: twice the cage's speed over the shaft's, and its standard deviation.
    speed_error, speed_std : float
        By which share the shaft turns faster than assumed; told by both races together, else not known
        better than before.
    spin, spin_std : float
        Turns of an element about itself per turn of the shaft, relative to the cage; NaN where no sign
        tells it.
    sure : bool
        Whether these are the bearing's lines for sure: two families of them, or one that the diagnosis would
        call a fault. A weak one alone, off its place, may be another machine's.
    """

    share: float
    std: float
    speed_error: float
    speed_std: float
    spin: float = math.nan
    spin_std: float = math.inf
    sure: bool = True


@dataclass(frozen=True, slots=True)
class Deviation:
    """A bearing whose cage is measured at another speed than modelled, in one record.

    `share` is the relative deviation of c (below 0: slower), `std` its standard deviation; `force_n` the
    radial force on the bearing; `spin` that of the elements in the model, in the unit of the motion's.
    """

    record: int
    component: str
    share: float
    std: float
    motion: CageMotion
    force_n: float
    spin: float


def cage_motion(view: View, component: str) -> CageMotion | None:
    """What all signs of a bearing in a record tell together; None where there are none."""
    own = [sign for sign in signs_of(view) if sign.component == component]
    strongest = max((sign.weight for sign in own), default=0.0)
    if strongest <= 0:
        return None
    bearing = view.machine.bearing(component)
    ratio = view.machine.shaft(bearing.shaft).ratio
    speed_std = max(view.speed.relative_error / 1.96, _LEAST_SPEED_ERROR)
    # Unknowns: c and the relative error of the speed; rows (by c, by the error, value, weight).
    gamma = bearing.element_diameter_m * math.cos(bearing.contact_angle_rad) / bearing.pitch_diameter_m
    nominal = 1.0 + gamma if bearing.outer_ring_rotates else 1.0 - gamma
    rows = [(0.0, 1.0, 0.0, 1.0 / speed_std)]
    for sign in own:
        row = _row(sign, ratio, nominal, outer_turns=bearing.outer_ring_rotates)
        if row is not None and (sign.weight >= _TRUSTED * strongest or sign.fault == "cage"):
            rows.append(row)
    if len(rows) < 2:
        return None
    table = np.array(rows)
    left = table[:, :2] * table[:, 3:]
    (share, error), *_ = np.linalg.lstsq(left, table[:, 2] * table[:, 3], rcond=None)
    covariance = np.linalg.inv(left.T @ left)
    std, error_std = np.sqrt(np.diag(covariance))
    spin, spin_std = _spin(own, strongest, ratio, float(error), float(error_std))
    told = [sign for sign in own if sign.fault == "cage" or sign.weight >= _TRUSTED * strongest]
    sure = any(sign.is_fault for sign in own) or len({sign.fault for sign in told}) > 1
    return CageMotion(float(share), float(std), float(error), float(error_std), spin, spin_std, sure)


def _row(
    sign: Sign, ratio: float, nominal: float, *, outer_turns: bool
) -> tuple[float, float, float, float] | None:
    """One sign as an equation for c and the relative error of the speed."""
    slow = {"outer_race": not outer_turns, "inner_race": outer_turns, "cage": True}.get(sign.fault)
    if slow is None:
        return None
    count = 1.0 if sign.fault == "cage" else float(sign.elements)
    scale = 0.5 * count * ratio
    value, std = sign.found_order / scale, sign.std_order / scale
    if slow:
        return 1.0, nominal, value, 1.0 / std
    return -1.0, 2.0 - nominal, value - 2.0, 1.0 / std


def _spin(
    own: Sequence[Sign], strongest: float, ratio: float, error: float, error_std: float
) -> tuple[float, float]:
    balls = [s for s in own if s.fault == "rolling_element" and s.weight >= _BALL_TRUSTED * strongest]
    if not balls:
        return math.nan, math.inf
    best = max(balls, key=lambda sign: sign.weight)
    spin = best.found_order / 2 / ratio * (1 - error)
    return spin, math.hypot(best.std_order / 2 / ratio, spin * error_std)


def slip_share(content: Content, component: str) -> float:
    """Slip that a content has at a bearing, under its load."""
    params = fault_of(content, "cage_slip", component)
    if params is None:
        return 0.0
    slip = float(params.get("slip", 0.01))
    halving = params.get("halving_force_n")
    return slip if halving is None else slip / (1.0 + force_n(content, component) / float(halving))


def model_share(content: Content, component: str, *, outer_turns: bool = False) -> float:
    """c of a content: of its geometry and its slip."""
    gamma = seat_of(content, component).law.gamma
    return (1.0 + gamma if outer_turns else 1.0 - gamma) * (1.0 - slip_share(content, component))


def model_spin(content: Content, component: str) -> float:
    """Turns of an element about itself per turn of the shaft in a content, relative to the cage."""
    law = seat_of(content, component).law
    return abs(law.spin_rate(1.0)) * (1.0 - slip_share(content, component))


def movable(context: Context) -> list[str]:
    """Bearings whose cage may be off the model.

    Where the model has a defect in one of several bearings with the same lines, the lines are of that one.
    """
    content, machine = context.contents[0], context.case.machine
    named = {bearing.name for bearing in machine.bearings}
    known = [name for name in bearings_of(content) if name in named]
    spoilt = {name for name in known if any(fault_of(content, kind, name) for kind in DEFECTS)}
    return [name for name in known if name in spoilt or not spoilt & set(alike(machine, name))]


def united_std(values: NDArray[np.float64], std: NDArray[np.float64]) -> float:
    """Standard deviation of the weighted mean of some values, greater where they scatter more than told.

    Parameters
    ----------
    values, std : ndarray, shape (n,)
    """
    weight = 1.0 / std**2
    mean = np.sum(weight * values) / np.sum(weight)
    scatter = float(np.sum(weight * (values - mean) ** 2)) / max(values.size - 1, 1)
    return float(np.sum(weight) ** -0.5) * math.sqrt(max(scatter, 1.0))


def deviations(context: Context, component: str) -> list[Deviation]:
    """By how much the cage is off the model, in every record that tells it."""
    found = []
    views, contents = (*context.views, *context.more_views), (*context.contents, *context.more_contents)
    for record, (view, content) in enumerate(zip(views, contents, strict=True)):
        motion = cage_motion(view, component)
        if motion is not None:
            turns = view.machine.bearing(component).outer_ring_rotates
            model = model_share(content, component, outer_turns=turns)
            off, std = motion.share / model - 1.0, motion.std / model
            force, spin = force_n(content, component), model_spin(content, component)
            found.append(Deviation(record, component, off, std, motion, force, spin))
    return found


def cage_nats(
    context: Context, heldout: Context, component: str, share_of: Callable[[float], float]
) -> float:
    """By how much positions of lines speak for a cage that is off the model, in nats.

    Parameters
    ----------
    context, heldout : Context
        Of the records for training and of those held out, beside the model with the cage where it was.
    component : str
    share_of : callable
        Relative deviation of c (below 0: slower) that is stated, by the radial force on the bearing [N].

    Returns
    -------
    float
        0 where the records held out speak against it, or say nothing.
    """
    found = [deviations(each, component) for each in (context, heldout)]
    told = [[_speaks(one, share_of(one.force_n)) for one in side] for side in found]
    again = sum(told[1])
    sure = all(any(one.motion.sure for one in side) for side in found)
    return min(sum(told[0]) + again, _MOST_NATS if sure else REPEATED_NATS) if again > 0.0 else 0.0


def _speaks(one: Deviation, share: float) -> float:
    """Log likelihood of a stated deviation less that of none."""
    return 0.5 * ((one.share / one.std) ** 2 - ((one.share - share) / one.std) ** 2)
