"""Slip: the cage and its elements lag behind pure rolling, and not quite evenly.

BPFO and FTF fall, BPFI rises by as many hertz as the BPFO falls (their sum is the shaft's speed times the
number of elements), the BSF falls by the same share as the cage. See `cage_motion`, and docs/twin_causes.md
for what can be told from other dimensions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gearsim_twin.causes.bearing_model import fault_of
from gearsim_twin.causes.cage_motion import (
    SLIP_OR_GEOMETRY,
    Deviation,
    cage_nats,
    deviations,
    movable,
    united_std,
)
from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_fault
from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.causes.spalls import has_bearings

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["CageSlip", "load_law"]

_KIND = "cage_slip"
_LEAST_SHARE, _MOST_SHARE = 3e-4, 0.06
_LEAST_Z = 3.0
_JITTER_RAD = 0.01
_PLAY_PER_JITTER = 0.5  # of each element in its pocket, as the simulator has it by default
_LEAST_FORCES = 1.5  # ratio of loads from which slip by load is asked for
_LEAST_GAIN = 2.0  # of chi-squared
_HALVING_N = np.geomspace(1.0, 1e6, 121)
_SPIN_DOUBT = 3.0  # standard deviations
_MOST_STARTS = 3


class CageSlip:
    """Slip of a cage with jitter."""

    name = "cage_slip"
    parameters: tuple[Parameter, ...] = (
        Parameter("slip", "1", LogNormal(0.006, 2.2, 1e-4, 0.1), step=5e-4),
        Parameter("jitter_rad", "rad", LogNormal(0.01, 2.0, 1e-3, 0.1)),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        ("bearing_geometry", SLIP_OR_GEOMETRY),
        ("shaft_speed_offset", "a line of the shaft or the BPFI: a speed moves BPFO and BPFI alike"),
    )

    def applies(self, context: Context) -> bool:
        """Wherever a bearing is modelled."""
        return has_bearings(context)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """Bearings whose lines say that the cage is slower than in the model, the surest first."""
        found = []
        for component in movable(context):
            if fault_of(context.contents[0], _KIND, component) is None:
                start = _start(component, deviations(context, component))
                if start is not None:
                    found.append(start)
        found.sort(key=lambda each: -each[0])
        return [start for _, start in found[:_MOST_STARTS]]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """The content with slip, as a share or by a law of the load."""
        slip, jitter = float(values["slip"]), float(values["jitter_rad"])
        play = _PLAY_PER_JITTER * jitter
        params = {"slip": slip, "jitter_rad": jitter, "pocket_play_rad": play}
        halving = float(values["halving_force_n"])
        if halving > 0:
            params["halving_force_n"] = halving
            params["slip"] = min(slip * (1.0 + float(values["force_n"]) / halving), 0.5)
        return with_fault(content, _KIND, str(values["component"]), params)

    def told_again(self, values: Values, context: Context, heldout: Context) -> float:
        """Nats by which positions of lines speak for it, in records for training and in those held out."""
        slip, halving, at_n = (float(values[key]) for key in ("slip", "halving_force_n", "force_n"))

        def share(force_n: float) -> float:
            return -slip * ((1.0 + at_n / halving) / (1.0 + force_n / halving) if halving > 0 else 1.0)

        return cage_nats(context, heldout, str(values["component"]), share)

    def signature(self, values: Values) -> str:
        """In plain words."""
        halving = float(values["halving_force_n"])
        load = f" under {float(values['force_n']):.3g} N, half of that {halving:.3g} N further on"
        return (
            f"BPFO and cage of {values['component']} {100 * float(values['slip']):.2g} % below pure rolling, "
            f"the BPFI above it by as many hertz as the BPFO is below, and lines that widen with their "
            f"number: the elements slip{load if halving > 0 else ''}"
        )


def _start(component: str, found: Sequence[Deviation]) -> tuple[float, dict[str, float | str]] | None:
    """How sure the slip is, and the start; None where the cage is not slow."""
    if not found or any(_spin_contradicts(one) for one in found):
        return None
    share = np.array([-one.share for one in found])
    std = np.array([one.std for one in found])
    force = np.array([one.force_n for one in found])
    weight = 1.0 / std**2
    mean = float(np.sum(weight * share) / np.sum(weight))
    z = mean * math.sqrt(float(np.sum(weight)))
    if not (_LEAST_SHARE < mean < _MOST_SHARE and z > _LEAST_Z):
        return None
    at_force = float(np.exp(np.mean(np.log(np.maximum(force, 1.0)))))
    halving, at_mean = load_law(force, share, std, at_force)
    start: dict[str, float | str] = {
        "component": component,
        "slip": min(max(at_mean, _LEAST_SHARE), _MOST_SHARE),
        "std:slip": united_std(share, std),
        "jitter_rad": _JITTER_RAD,
        "halving_force_n": halving if math.isfinite(halving) else 0.0,
        "force_n": at_force,
    }
    return z, start


def _spin_contradicts(one: Deviation) -> bool:
    """Whether the elements spin otherwise than slip allows, wherever they slide.

    Rolling on the outer race and sliding on the inner they lag as the cage does (the simulator's way);
    rolling on the inner race and sliding on the outer they are faster by c / (2 - c) of that.
    """
    motion = one.motion
    if not math.isfinite(motion.spin):
        return False
    off = motion.spin / one.spin - 1.0
    ends = (one.share, -one.share * motion.share / (2.0 - motion.share))
    beyond = max(min(ends) - off, off - max(ends), 0.0)
    return beyond > _SPIN_DOUBT * math.hypot(motion.spin_std / one.spin, one.std)


def load_law(
    force_n: np.ndarray, slip: np.ndarray, std: np.ndarray, at_force_n: float
) -> tuple[float, float]:
    """The force that halves the slip, and the slip at a force, by s = s_0 / (1 + F / F_1).

    Parameters
    ----------
    force_n, slip, std : ndarray, shape (n,)
        Radial force, slip, and the standard deviation of the slip in each record.
    at_force_n : float

    Returns
    -------
    tuple of float
        Infinite force, and the weighted mean, where the records do not tell that the load matters.
    """
    weight = 1.0 / std**2
    mean = float(np.sum(weight * slip) / np.sum(weight))
    if slip.size < 2 or np.max(force_n) < _LEAST_FORCES * max(float(np.min(force_n)), 1e-9):
        return math.inf, mean
    plain = float(np.sum(weight * (slip - mean) ** 2))
    best = (plain - _LEAST_GAIN, math.inf, mean)
    for halving in _HALVING_N:
        shape = 1.0 / (1.0 + force_n / halving)
        unloaded = float(np.sum(weight * shape * slip) / np.sum(weight * shape**2))
        misfit = float(np.sum(weight * (slip - unloaded * shape) ** 2))
        if misfit < best[0]:
            best = (misfit, float(halving), unloaded / (1.0 + at_force_n / float(halving)))
    return best[1], best[2]
