"""What motors give and loads take, as smooth functions of speed.

Sources of the shapes: a fan or a centrifugal pump takes a torque that grows with the square of its speed,
a viscous brake one that grows with the speed, a hoist or a displacement pump at constant pressure a
constant one (any text on electric drives, such as Leonhard, Control of Electrical Drives, 1.3).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from gearsim_sim.profile.curve import Curve

Array = NDArray[np.float64]
CREEP = 0.005  # speed below which a constant load is not yet there, over the rated speed


@dataclass(frozen=True, slots=True)
class LoadShape:
    """Load torque over its rated value: constant + linear (v / v_rated) + quadratic (v / v_rated)^2.

    The shares sum to one, so that the load is the rated one at `rated_speed_hz`. A load does not pull back a
    machine that stands: its constant share comes on as tanh(v / creep), within a crawl of the rated speed.
    """

    constant: float
    linear: float
    quadratic: float
    rated_speed_hz: float

    def __call__(self, speed_hz: float) -> float:
        """The factor at a speed."""
        x = speed_hz / self.rated_speed_hz
        return self.constant * math.tanh(x / CREEP) + x * (self.linear + x * self.quadratic)


class Motor(Protocol):
    """A motor whose torque follows from its speed and from an inner state (0 where it has none)."""

    def torque_nm(self, time_s: float, speed_hz: float, inner_nm: float) -> float:
        """Torque on the reference shaft."""
        ...

    def inner_rate(self, time_s: float, speed_hz: float, inner_nm: float) -> float:
        """Change of the inner state per second."""
        ...

    def strongest_nm(self, speed_hz: float) -> float:
        """The greatest torque it can give at a speed."""
        ...


@dataclass(frozen=True, slots=True)
class ConstantMotor:
    """The same torque at any speed."""

    level_nm: float

    def torque_nm(self, time_s: float, speed_hz: float, inner_nm: float) -> float:  # noqa: ARG002
        """The torque."""
        return self.level_nm

    def inner_rate(self, time_s: float, speed_hz: float, inner_nm: float) -> float:  # noqa: ARG002
        """No inner state."""
        return 0.0

    def strongest_nm(self, speed_hz: float) -> float:  # noqa: ARG002
        """The torque."""
        return self.level_nm


class CurveMotor:
    """Torque over speed through given points, without overshoot (Fritsch and Carlson); flat beyond them."""

    def __init__(self, speeds_hz: Array, torques_nm: Array) -> None:
        """At least two points of ascending speed."""
        self._low, self._high = float(speeds_hz[0]), float(speeds_hz[-1])
        self._curve = PchipInterpolator(speeds_hz, torques_nm)

    def torque_nm(self, time_s: float, speed_hz: float, inner_nm: float) -> float:  # noqa: ARG002
        """Torque at the speed."""
        return float(self._curve(min(max(speed_hz, self._low), self._high)))

    def inner_rate(self, time_s: float, speed_hz: float, inner_nm: float) -> float:  # noqa: ARG002
        """No inner state."""
        return 0.0

    def strongest_nm(self, speed_hz: float) -> float:
        """Torque at the speed."""
        return self.torque_nm(0.0, speed_hz, 0.0)


@dataclass(frozen=True, slots=True)
class ControlledMotor:
    """A PI speed controller in front of a motor of limited torque.

    With the error e = target - speed: asked torque a = gain e + inner, given torque T = limit tanh(a / limit)
    and inner' = (dT/da) gain e / integral_time. The factor dT/da stops the integral while the motor is at
    its limit (a smooth form of conditional integration against wind-up).
    """

    target_hz: Curve
    gain_nm_per_hz: float
    integral_time_s: float
    limit_nm: float
    step_s: float

    def _asked(self, time_s: float, speed_hz: float, inner_nm: float) -> tuple[float, float]:
        step = time_s / self.step_s
        error = self.target_hz.stretch(math.floor(step)).value(step) - speed_hz
        push = self.gain_nm_per_hz * error
        return push, push + inner_nm

    def torque_nm(self, time_s: float, speed_hz: float, inner_nm: float) -> float:
        """Torque that the motor gives."""
        return self.limit_nm * math.tanh(self._asked(time_s, speed_hz, inner_nm)[1] / self.limit_nm)

    def inner_rate(self, time_s: float, speed_hz: float, inner_nm: float) -> float:
        """Change of the controller's integral."""
        push, asked = self._asked(time_s, speed_hz, inner_nm)
        return push / self.integral_time_s * (1.0 - math.tanh(asked / self.limit_nm) ** 2)

    def strongest_nm(self, speed_hz: float) -> float:  # noqa: ARG002
        """The limit."""
        return self.limit_nm

    def inner_for(self, torque_nm: float) -> float:
        """The inner state that gives this torque without a control error."""
        ratio = min(max(torque_nm / self.limit_nm, -0.999999), 0.999999)
        return self.limit_nm * math.atanh(ratio)
