"""How strong an effect is in a record: its simulated answer is laid over the deviation of the record.

With the deviation D and the answer U of a guess (both complex lines of a turn, variance v), turned by the
angle phi, the amplitude is a = Re sum conj(U) D / v over sum |U|^2 / v, both taken square to what a turn of
the record as a whole would do, since the place of its mark is unknown; then the record is laid over the model
and a U. The drop is what the weighted squares lose by it. Turning a wheel against its mates by whole teeth,
or a run-out by any angle, turns lines around each multiple of the mesh by their distance m from it:
exp(-2 pi i m phi).
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_twin.causes.any_mark import at_any_mark
from gearsim_twin.causes.cause import Content
from gearsim_twin.causes.gear_model import Part, has_planets
from gearsim_twin.causes.turn_lines import Complex, Deviation, deviation, line_count, turn_lines
from gearsim_twin.simulated import Simulator
from gearsim_twin.view import View

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

Array = NDArray[np.float64]

__all__ = ["Match", "matches", "simulated_with"]

_TURNS = 4.2  # of a short simulation
_LEAST_S = 0.3
_SETTLING_S = 0.25  # how the machine starts is no part of an answer
_LEAST_DROP = 30.0  # of chi^2: with the few hundred angles and parts looked at, once in thousands by chance
_LEAST_SHARE = 0.05  # of all that deviates
_STANDS_OUT = 10.0
_LEAST_LINES = 2
_LEAST_OF_PLANETS = 0.01
_SHAPE = 0.25  # shapes of answers are right to about that part of what deviates
_ANGLES = 72
_AGAIN = 3
_ANEW, _FURTHER = 4, 2.5
# A size is that which was simulated within these factors: enough where answers grow in proportion, enough
# where they grow by a power that is guessed, and near enough for one to be compared with others.
_OTHER_LOG, _SAME_LOG, _NEAR_LOG = math.log(1.5), math.log(1.1), math.log(1.25)
_LONGEST_LOG, _SHORTEST_LOG = math.log(4.0), 0.05
_LAID = 2  # times that a record is laid over the model and what was found so far
_LEAST_SQUARE = 0.01
_MOST_KEPT = 48
_KEPT: WeakKeyDictionary[View, OrderedDict[tuple[str, float, float], Complex | None]] = WeakKeyDictionary()


@dataclass(frozen=True, slots=True)
class Match:
    """An effect in a record.

    Attributes
    ----------
    part : Part
    value : float
        Of the scaled parameter.
    angle_turns : float
        By how much its part stands ahead of where the guess has it, in turns of the part; 0 where no angle
        was looked for.
    drop : float
        Of the weighted squares.
    share : float
        Of all that deviates: of the squares, or with no line counting for much more than others, whichever
        is more.
    sign : float
        -1 where the effect is the opposite of the guess's.
    """

    part: Part
    value: float
    angle_turns: float
    drop: float
    share: float
    sign: float = 1.0


def matches(
    context: Context,
    parts: Sequence[Part],
    build: Callable[[Content, Part, float], Content],
    unit: float,
    bounds: tuple[float, float],
    *,
    angle: str = "none",
    power: float = 1.0,
    signed: bool = False,
    top: int | None = None,
    twins: bool = True,
    any_mark: bool = False,
) -> list[Match]:
    """Parts that may have an effect, the best first; empty where nothing speaks for any.

    Parameters
    ----------
    context : Context
    parts : sequence of Part
    build : callable
        (content, part, value) -> the content with the effect of that size, at angle zero or tooth 1.
    unit : float
        Size that is simulated first.
    bounds : (low, high)
        Of the size.
    angle : str
        "tooth", "any" or "none": how the effect may stand on its part.
    power : float
        The answer grows with the size to this power.
    signed : bool
        Whether the opposite effect exists.
    top : int, optional
        Lines of the turn, and on both sides of those of the mesh, of which at least two must deviate clearly;
        all by default.
    twins : bool
        Whether the effect is the same on a wheel and on its mate of as many teeth; then one is looked at.
        What wears or breaks from the root outwards is not: the one begins to bear where the other ends.
    any_mark : bool
        Whether the mark of the angle may stand anywhere against what stands still on the carrier.
    """
    effect = _Effect(build, bounds, angle, power, signed, top, any_mark)
    found = []
    for record in _records(context):
        once = _once(parts) if twins else parts
        first = [_match(context, record, part, effect, unit) for part in once]
        found += [match for match in first if match is not None and match.drop >= _LEAST_DROP / 2]
    found.sort(key=lambda match: -match.drop)
    again = [_anew(context, one, effect, unit) for one in found[:_AGAIN]]
    found = sorted(again, key=lambda match: -match.drop)
    return [match for match in found if match.drop >= _LEAST_DROP and match.share >= _LEAST_SHARE]


@dataclass(frozen=True, slots=True)
class _Effect:
    """What `matches` looks for."""

    build: Callable[[Content, Part, float], Content]
    bounds: tuple[float, float]
    angle: str
    power: float
    signed: bool
    top: int | None
    any_mark: bool = False


def _anew(context: Context, found: Match, effect: _Effect, unit: float) -> Match:
    """The same at the size that was found, and on from there, until it is the one that was simulated.

    Shapes of answers change with the size: teeth and balls part, elements reach the bottom. One that takes
    next to nothing of what deviates may do so because it is too weak for that.
    """
    tried = [(unit, found)]
    for _ in range(_ANEW):
        size = _next_size(tried, effect)
        match = size and _match(context, _records(context)[0], found.part, effect, size)
        if not match:
            break
        tried.append((size, match))
    # Of what was not simulated near its own size, nothing is known but that it is another.
    return min(tried, key=lambda one: (max(abs(_wanted(one)), _NEAR_LOG), -one[1].drop))[1]


def _wanted(one: tuple[float, Match]) -> float:
    """Log of the size that a simulated size asks for, over it."""
    return math.log(one[1].value / one[0])


def _next_size(tried: Sequence[tuple[float, Match]], effect: _Effect) -> float:
    """The size to be simulated next; 0 if the last one asks for none."""
    size, last = tried[-1]
    wanted = _wanted(tried[-1])
    small = [one for one in tried if _wanted(one) > 0]
    great = [one for one in tried if _wanted(one) <= 0]
    if abs(wanted) < (_OTHER_LOG if effect.power == 1.0 else _SAME_LOG):
        step = math.log(_FURTHER) if last.share < _LEAST_SHARE and len(small) == len(tried) else 0.0
    elif small and great:
        low, high = max(small, key=lambda one: one[0]), min(great, key=lambda one: one[0])
        part = _wanted(low) / (_wanted(low) - _wanted(high))
        step = math.log(low[0] / size) + min(max(part, 0.15), 0.85) * math.log(high[0] / low[0])
    else:
        step = min(max(wanted, -_LONGEST_LOG), _LONGEST_LOG)
    aim = min(max(size * math.exp(step), effect.bounds[0]), effect.bounds[1])
    return aim if abs(math.log(aim / size)) > _SHORTEST_LOG else 0.0


def _once(parts: Sequence[Part]) -> list[Part]:
    twins = [part for part in parts if part.twin]
    return [part for part in parts if not part.twin or part is twins[0]]


def _records(context: Context) -> list[int]:
    """The record with most turns: enough for a first guess; none where no angle is known."""
    numbers = [k for k, view in enumerate(context.views) if view.phase is not None]
    return sorted(numbers, key=lambda k: -context.views[k].turns)[:1]


def period(context: Context, record: int, part: Part) -> float:
    """Turns, per turn of the reference shaft, of what is averaged: the part, or the carrier that it is on."""
    whole = abs(part.turns - round(part.turns)) < 1e-9
    return 1.0 if has_planets(context.contents[record]) and whole and part.turns > 0 else part.turns


def _match(context: Context, record: int, part: Part, effect: _Effect, size: float) -> Match | None:
    """The effect of one size on one part, scaled."""
    turns = period(context, record, part)
    own = deviation(context, record, turns)
    if own is None or not _deviates(context, part, effect, own):
        return None
    content = effect.build(context.contents[record], part, size)
    with_it = _lines(context, record, turns, content)
    without = _lines(context, record, turns, context.contents[record])
    if with_it is None or without is None:
        return None
    if has_planets(content) and effect.angle != "none":
        match = _by_power(own, np.abs(with_it - without) ** 2, part)
    elif effect.any_mark:
        match = _at_any_mark(own, with_it - without, part, effect.signed)
    else:
        per_turn = part.turns / turns
        match = _by_angle(own, with_it - without, part, per_turn, effect.angle, effect.signed)
    if match is None:
        return None
    return replace(match, value=float(np.clip(size * match.value ** (1.0 / effect.power), *effect.bounds)))


def _deviates(context: Context, part: Part, effect: _Effect, own: Deviation) -> bool:
    """Whether there is anything to be explained; else nothing is simulated."""
    line = np.arange(own.values.shape[1])
    if effect.top is not None:
        mesh = max(2, round(part.teeth * part.turns / own.turns)) if part.teeth > 1 else line.size * 2
        beside = np.abs((line + mesh // 2) % mesh - mesh // 2)
        line = line[(line < effect.top) | ((beside > 0) & (beside < effect.top))]
    excess = own.excess[:, line]
    number = np.count_nonzero(excess > _STANDS_OUT)
    if has_planets(context.contents[own.record]) and effect.angle != "none":
        # Drawn errors of planets let some lines deviate.
        return bool(number >= max(_LEAST_LINES, round(_LEAST_OF_PLANETS * own.values.size)))
    # What comes once per turn is one line, and one channel may be all that is near.
    return bool(number >= min(_LEAST_LINES, excess.shape[0]) or np.any(excess > _LEAST_DROP))


def _by_angle(
    own: Deviation, answer: Complex, part: Part, per_turn: float, angle: str, signed: bool
) -> Match | None:
    """The answer at its best angle and size, the record laid anew over the model with it."""
    laid = own
    for _ in range(_LAID):
        found = _at_best_angle(laid, answer, part, per_turn, angle, signed)
        if found is None:
            return None
        amplitude, at, turned = found
        laid = own.beside(turned)
    left = _square(laid, laid.values - turned)
    total = _square(own, own.values)
    drop, share = total - left, max(1.0 - left / max(total, 1e-300), _share(own, laid, turned))
    return Match(part, abs(amplitude), at, drop, share, math.copysign(1.0, amplitude)) if drop > 0 else None


def _square(own: Deviation, values: Complex) -> float:
    """Weighted squares of some values."""
    weight = np.where(np.isfinite(own.variance), 1.0 / own.variance, 0.0)
    return float(np.sum(np.abs(values) ** 2 * weight))


def _at_best_angle(
    own: Deviation, answer: Complex, part: Part, per_turn: float, angle: str, signed: bool
) -> tuple[float, float, Complex] | None:
    """Size, angle in turns of the part, and the answer of that size at that angle.

    What a small turn of the record would do as well counts neither for nor against an answer: both are taken
    square to it.
    """
    weight = np.where(np.isfinite(own.variance), 1.0 / own.variance, 0.0)
    norm, tangent = _square(own, answer), own.turning
    if norm <= 0:
        return None
    angles, steps = _angles(part, per_turn, angle)
    mesh = max(1, round(part.teeth * per_turn)) if part.teeth > 1 else answer.shape[1] * 2
    k = np.arange(answer.shape[1])
    residue = (k + mesh // 2) % mesh - mesh // 2 if part.teeth > 1 else k
    first = int(residue.min())

    def over(values: Complex) -> Array:
        """Product of the turned answer with some values, at each angle."""
        product = np.sum(np.conj(answer) * values * weight, axis=0)
        folded = np.bincount(residue - first, product.real) + 1j * np.bincount(residue - first, product.imag)
        m = np.arange(first, first + folded.size)
        return np.asarray(np.real(np.exp(2j * np.pi * np.outer(angles, m)) @ folded))

    stiff = max(_square(own, tangent), 1e-300)
    astray = over(tangent)
    swing = float(np.sum(np.real(np.conj(tangent) * own.values) * weight))
    corr, square = over(own.values) - astray * swing / stiff, norm - astray**2 / stiff
    # An answer that is hardly more than a turn tells nothing.
    score = np.where(square > _LEAST_SQUARE * norm, corr / np.sqrt(np.maximum(square, 1e-300)), 0.0)
    at = int(np.argmax(np.abs(score) if signed else score))
    if score[at] == 0 or (score[at] < 0 and not signed):
        return None
    amplitude = float(corr[at] / square[at])
    return amplitude, float(steps[at]), amplitude * answer * np.exp(-2j * np.pi * residue * angles[at])


def _share(own: Deviation, laid: Deviation, answer: Complex) -> float:
    """What an answer takes of the lines that deviate, none counting for more than shapes are right to."""
    clear = (own.excess > _STANDS_OUT) | (np.abs(answer) ** 2 > _STANDS_OUT * own.variance)
    if not np.any(clear):
        clear = np.isfinite(own.variance)
    weight = clear / (own.variance + (_SHAPE * np.abs(own.values)) ** 2)
    total = float(np.sum(np.abs(own.values) ** 2 * weight))
    left = float(np.sum(np.abs(laid.values - answer) ** 2 * weight))
    return 1.0 - left / max(total, 1e-300)


def _angles(part: Part, per_turn: float, angle: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Angles in turns of what is averaged, and of the part."""
    count = {"tooth": part.teeth, "any": _ANGLES, "none": 1}[angle]
    steps = np.arange(count) / count
    return steps / per_turn, steps


def _at_any_mark(own: Deviation, answer: Complex, part: Part, signed: bool) -> Match | None:
    """The answer as a mark that stands anywhere would have it."""
    found = at_any_mark(own, answer, signed)
    if found is None or found.drop < _LEAST_DROP:
        return None
    share = max(found.drop / max(_square(own, own.values), 1e-300), _share(own, own, found.turned))
    sign = math.copysign(1.0, found.amplitude)
    return Match(part, abs(found.amplitude), 0.0, found.drop, share, sign)


def _by_power(own: Deviation, square: NDArray[np.float64], part: Part) -> Match | None:
    """Where drawn errors and turning sensors leave no phase: by the powers of the lines alone."""
    variance = own.variance**2 + (_SHAPE * own.power) ** 2
    weight = np.where(np.isfinite(variance), 1.0 / variance, 0.0)
    norm = float(np.sum(square**2 * weight))
    total = float(np.sum(own.power**2 * weight))
    corr = float(np.sum(square * own.power * weight))
    if norm <= 0 or corr <= 0:
        return None
    drop = corr**2 / norm
    return Match(part, math.sqrt(corr / norm), 0.0, drop, drop / max(total, 1e-300))


def _lines(context: Context, record: int, turns: float, content: Content) -> Complex | None:
    view = context.views[record]
    seconds = min(
        view.record.seconds, max(_LEAST_S, _TURNS / (min(turns, 1.0) * view.speed_hz)) + _SETTLING_S
    )
    kept = _KEPT.setdefault(view, OrderedDict())
    key = (repr(content), round(seconds, 6), round(turns, 9))
    if key not in kept:
        kept[key] = _simulated(context, record, turns, content, seconds)
    kept.move_to_end(key)
    while len(kept) > _MOST_KEPT:
        kept.popitem(last=False)
    return kept[key]


def _simulated(
    context: Context, record: int, turns: float, content: Content, seconds: float
) -> Complex | None:
    view = context.views[record]
    made = simulated_with(context, record, content, seconds)
    if made is None:
        return None
    first = min(round(_SETTLING_S * made.record.sample_rate_hz), made.record.sample_count // 4)
    made = made.part(first, made.record.sample_count)
    lines = turn_lines(made, turns, line_count(view, turns), view.record.channels)
    return None if lines is None else lines.values


def simulated_with(context: Context, record: int, content: Content, seconds: float) -> View | None:
    """A short record of a content; None where an effect of that size cannot be in this machine."""
    with Simulator(context.case, measured=context.views) as simulator:
        try:
            return simulator.views({record: content}, seconds)[0]
        except InputError:
            return None
