"""Speed as the result of torques on a rigid rotation, solved ahead and laid down as polynomials.

    2 pi J dv/dt = takeover(t) (T_motor(t, v, inner) - ratio load(t) shape(v))

J is the inertia of everything that turns, at the reference shaft; v its speed in Hz. `takeover` rises
smoothly from 0 to 1 at the start: a torque that jumps is a blow that no rig gives.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.integrate import solve_ivp

from gearsim_sim.profile.curve import (
    Array,
    Constant,
    Curve,
    Laid,
    Stretch,
    chebyshev_steps,
    fitted_stretch,
    ramp_from,
    ramp_stretch,
)
from gearsim_sim.profile.laws import ControlledMotor, LoadShape, Motor

BLOCK_S = 1.0  # solved in one go
_RTOL, _ATOL_HZ = 1e-11, 1e-12
# A stretch is halved until it is this near to the solution, as a fraction of the speed scale.
_FIT = 1e-10
_SHORTEST_STEPS = 32
# The rest of the way is left out when speed and inner state change less than this in a second, per scale.
_STILL = 1e-9
_LAW_STEPS = 1 << 12


@dataclass(frozen=True, slots=True)
class LawLoad:
    """A load torque that depends on speed: rated(step) shape(speed(step)).

    The product is laid down as polynomials through six points of cells of 4096 steps: a speed that moves
    on a scale of 0.1 s is met within 1e-9.
    """

    speed_hz: Curve
    shape: LoadShape
    rated_nm: Curve

    def stretch(self, step: int) -> Stretch:
        """The stretch that covers `step`."""
        speed, rated = self.speed_hz.stretch(step), self.rated_nm.stretch(step)
        begin, end = max(speed.start, rated.start), min(speed.end, rated.end)
        if len(speed.coefficients) > 1:
            begin = max(begin, float(step // _LAW_STEPS * _LAW_STEPS))
            end = min(end, float((step // _LAW_STEPS + 1) * _LAW_STEPS))
        elif len(rated.coefficients) == 1:
            return Stretch(begin, end - begin, (rated.value(begin) * self.shape(speed.value(begin)),))
        points = chebyshev_steps(begin, end - begin)
        values = np.array([rated.value(at) * self.shape(speed.value(at)) for at in points])
        return fitted_stretch(begin, end - begin, values)

    def final_value(self) -> float:
        """Load at the final speed."""
        return self.rated_nm.final_value() * self.shape(self.speed_hz.final_value())

    def changed(self, step: int, speed_hz: Curve, load_nm: float | None, ramp_steps: float) -> LawLoad:
        """Along another speed, and with another rated value from a step on."""
        rated = self.rated_nm if load_nm is None else ramp_from(self.rated_nm, step, load_nm, ramp_steps)
        return LawLoad(speed_hz, self.shape, rated)


@dataclass(frozen=True, slots=True)
class Rotor:
    """The equation of motion."""

    motor: Motor
    shape: LoadShape
    rated_nm: Curve
    takeover: Curve
    inertia_kg_m2: float
    ratio: float
    step_s: float

    def surplus_nm(self, speed_hz: float, rated_nm: float) -> float:
        """What the motor can give beyond the load at a speed."""
        return self.motor.strongest_nm(speed_hz) - self.ratio * rated_nm * self.shape(speed_hz)

    def rates(self, time_s: float, state: Array) -> tuple[float, float]:
        """Change of speed [Hz/s] and of the motor's inner state."""
        step = time_s / self.step_s
        whole = math.floor(step)
        share = self.takeover.stretch(whole).value(step)
        speed, inner = float(state[0]), float(state[1])
        load = self.ratio * self.rated_nm.stretch(whole).value(step) * self.shape(speed)
        torque = self.motor.torque_nm(time_s, speed, inner)
        rate = share * (torque - load) / (2 * math.pi * self.inertia_kg_m2)
        return rate, share * self.motor.inner_rate(time_s, speed, inner)


class TorqueSpeed:
    """The speed that a `Rotor` takes from a start on, as a curve.

    It is solved in blocks of 1 s counted from the start, each once and in order, so that its digits do
    not depend on what is asked. When it stands still, it is a constant from there on.
    """

    def __init__(
        self, rotor: Rotor, start_step: int, speed_hz: float, inner_nm: float, scale_hz: float
    ) -> None:
        """Start at a step with a speed and the motor's inner state; `scale_hz` sets what is exact."""
        self.rotor = rotor
        self.start_step = start_step
        self._scale = scale_hz
        self._first = speed_hz
        self._block = max(1, round(BLOCK_S / rotor.step_s))
        self._state = np.array([speed_hz, inner_nm])
        self._blocks: list[tuple[Stretch, ...]] = []
        self._inner: list[float] = [inner_nm]
        self._still = False

    def stretch(self, step: int) -> Stretch:
        """The stretch that covers `step`."""
        while not self._still and step >= self._end:
            self._solve_block()
        return Laid([one for block in self._near(step) for one in block], self._first, self._last).stretch(
            step
        )

    def _near(self, step: int) -> list[tuple[Stretch, ...]]:
        """The block of a step alone; before the start and after the end, the nearest."""
        if not self._blocks:
            return []
        number = min(max((step - self.start_step) // self._block, 0), len(self._blocks) - 1)
        return [self._blocks[number]]

    @property
    def _end(self) -> int:
        return self.start_step + len(self._blocks) * self._block

    @property
    def _last(self) -> float:
        return float(self._state[0])

    def final_value(self) -> float:
        """Where the speed comes to rest."""
        motor = self.rotor.motor
        if isinstance(motor, ControlledMotor):
            return motor.target_hz.final_value()
        return settles_at(self.rotor, self._first, self.rotor.rated_nm.final_value(), 10.0 * self._scale)

    def at_rest(self) -> float:
        """The same, solved up to there."""
        while not self._still:
            self._solve_block()
        return self._last

    def with_rated(self, step: int, rated_nm: Curve) -> TorqueSpeed:
        """From a step on under another load."""
        start = max(step, self.start_step)
        speed = self.stretch(start).value(float(start))
        rotor = replace(self.rotor, rated_nm=rated_nm)
        return TorqueSpeed(rotor, start, speed, self._inner_at(start), self._scale)

    def _inner_at(self, step: int) -> float:
        """The motor's inner state, solved again from the start of its block."""
        number = min((step - self.start_step) // self._block, len(self._inner) - 1)
        begin = self.start_step + number * self._block
        if step <= begin or number >= len(self._blocks):
            return self._inner[number]
        speed = self._blocks[number][0].coefficients[0]
        solution = self._solve(np.array([speed, self._inner[number]]), begin, step)
        return float(solution(step * self.rotor.step_s)[1])

    def _solve(self, state: Array, begin: int, end: int) -> Callable[[float], Array]:
        step_s = self.rotor.step_s
        result = solve_ivp(
            lambda t, y: np.array(self.rotor.rates(t, y)),
            (begin * step_s, end * step_s),
            state,
            method="DOP853",
            rtol=_RTOL,
            atol=_ATOL_HZ,
            dense_output=True,
        )
        if result.sol is None or not result.success:
            raise FloatingPointError(f"the torques cannot be integrated: {result.message}")
        return result.sol

    def _solve_block(self) -> None:
        begin, end = self._end, self._end + self._block
        solution = self._solve(self._state, begin, end)
        found = self._fit(solution, float(begin), float(end))
        state = solution(end * self.rotor.step_s)
        rates = self.rotor.rates(end * self.rotor.step_s, state)
        if self._is_still(end, rates):
            self._still = True
            slope = rates[0] * self.rotor.step_s
            value = float(state[0])
            found = (*found, ramp_stretch(float(end), float(self._block), value, value, slope))
        self._state = state
        self._blocks.append(found)
        self._inner.append(float(state[1]))

    def _is_still(self, step: int, rates: tuple[float, float]) -> bool:
        rotor = self.rotor
        known = (rotor.rated_nm, rotor.takeover, getattr(rotor.motor, "target_hz", Constant(0.0)))
        if any(len(curve.stretch(step).coefficients) > 1 for curve in known):
            return False
        torque = max(abs(rotor.rated_nm.stretch(step).value(float(step))), 1.0)
        return abs(rates[0]) < _STILL * self._scale and abs(rates[1]) < _STILL * torque

    def _fit(self, solution: Callable[[float], Array], begin: float, end: float) -> tuple[Stretch, ...]:
        """Polynomials of degree 6: value and slope at both ends, so that acceleration does not jump."""
        step_s, length = self.rotor.step_s, end - begin
        at = begin + length * _FIT_POINTS
        states = [solution(step * step_s) for step in at]
        slopes = [self.rotor.rates(at[i] * step_s, states[i])[0] * step_s * length for i in (0, -1)]
        values = np.array([state[0] for state in states])
        coefficients = _fit_matrix() @ np.concatenate([values, slopes])
        stretch = Stretch(begin, length, tuple(coefficients.tolist()))
        between = begin + length * np.array([0.12, 0.38, 0.62, 0.88])
        error = max(abs(stretch.value(step) - solution(step * step_s)[0]) for step in between)
        if error <= _FIT * self._scale or length < 2 * _SHORTEST_STEPS:
            return (stretch,)
        middle = begin + math.floor(length / 2)
        return self._fit(solution, begin, middle) + self._fit(solution, middle, end)


_FIT_POINTS = np.array([0.0, 0.25, 0.5, 0.75, 1.0])


@lru_cache(maxsize=1)
def _fit_matrix() -> Array:
    values = np.vander(_FIT_POINTS, 7, increasing=True)
    slopes = np.zeros((2, 7))
    slopes[:, 1:] = np.vander([0.0, 1.0], 6, increasing=True) * np.arange(1, 7)
    return np.asarray(np.linalg.inv(np.vstack([values, slopes])))


def settles_at(rotor: Rotor, from_hz: float, rated_nm: float, limit_hz: float) -> float:
    """The speed at which the motor's greatest torque just meets the load, from a speed on; `inf` if none.

    Searched upwards in 2000 parts of `limit_hz` where there is a surplus, downwards where there is none.
    """
    rising = rotor.surplus_nm(from_hz, rated_nm) > 0
    goal = limit_hz if rising else 0.0
    speeds = np.linspace(from_hz, goal, 2001)
    for low, high in itertools.pairwise(speeds):
        if (rotor.surplus_nm(float(high), rated_nm) > 0) != rising:
            return _bisected(rotor, float(low), float(high), rated_nm, rising)
    return math.inf if rising else 0.0


def _bisected(rotor: Rotor, low: float, high: float, rated_nm: float, rising: bool) -> float:
    for _ in range(60):
        middle = 0.5 * (low + high)
        if (rotor.surplus_nm(middle, rated_nm) > 0) == rising:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
