"""The course of the speed over a signal, found frame by frame and then with longer and longer frames."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_smoothing_spline

from gearsim_dsp.angle.ridge import Frames, best_path, comb_evidence, line_heights
from gearsim_dsp.angle.tracked_orders import least_spacing, tracked_orders
from gearsim_io.nameplate import Machine

__all__ = [
    "Comb",
    "Course",
    "best_factor",
    "first_course",
    "line_score",
    "log_speed",
    "models",
    "zoomed_course",
]

_OUTSIDE = 0.7
_LEAST_FRAME_S = 0.2
_FRAME_TURNS = 5.0
_CHANGE_PER_S = 0.05
_TEMPER_DB = 4.0
_NEAR = 0.02
_ZOOM = 0.01
_TOP_DB = 45.0
_LINE_SHARE = 0.5
_MOST_CANDIDATES = 20_000
_MOST_STEPS = 40


@dataclass(frozen=True, slots=True, eq=False)
class Comb:
    """Orders looked for with their weights; `spacing` is the distance of neighbouring lines."""

    orders: NDArray[np.float64]
    weights: NDArray[np.float64]
    spacing: float

    @classmethod
    def of(cls, machine: Machine, top_order: float) -> Comb:
        """The lines of a machine up to an order."""
        orders, weights = tracked_orders(machine)
        inside = orders < top_order
        return cls(orders[inside], weights[inside], least_spacing(machine))

    @property
    def norm(self) -> float:
        """What the comb's sum scatters by in noise, over the scatter of one line."""
        return float(np.sqrt(np.sum(self.weights**2)))

    @property
    def top(self) -> float:
        """Highest order."""
        return float(self.orders[-1])


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """The speed at the centres of the frames.

    Parameters
    ----------
    at : ndarray, shape (frames,)
        In seconds (or turns).
    log_speed : ndarray, shape (frames,)
        Natural logarithm of the speed in Hz (or relative to the angle's).
    frame : float
        Length of a frame, in seconds (or turns).
    score, rival : float
        Evidence of the path, and of the best one that is 2 % or more away, in dB per frame.
    """

    at: NDArray[np.float64]
    log_speed: NDArray[np.float64]
    frame: float
    score: float
    rival: float


def first_course(
    signals: NDArray[np.float64],
    rate_hz: float,
    comb: Comb,
    limits_hz: tuple[float, float],
    expected_hz: tuple[float, float],
) -> Course:
    """The clearest course of several frame lengths.

    Parameters
    ----------
    signals : ndarray, shape (channels, n)
    rate_hz : float
    comb : Comb
    limits_hz : tuple of float
        Speeds to look at.
    expected_hz : tuple of float
        Speeds outside of it count 0.7 of their evidence.
    """
    low, high = limits_hz
    seconds = signals.shape[1] / rate_hz
    frame = min(max(_LEAST_FRAME_S, _FRAME_TURNS / math.sqrt(low * high)), seconds / 4)
    best: Course | None = None
    while frame <= seconds / 4 * (1 + 1e-9):
        frames = line_heights(signals, rate_hz, frame, frame / 4, min(comb.top * high, 0.45 * rate_hz))
        candidates = _candidates(low, high, frames, comb)
        evidence = comb_evidence(frames, candidates, comb.orders, comb.weights)
        outside = (candidates < expected_hz[0]) | (candidates > expected_hz[1])
        evidence[:, outside] *= _OUTSIDE
        course = _course(frames, evidence, candidates, frame, _CHANGE_PER_S, rivals=True)
        if best is None or course.score > best.score:
            best = course
        frame *= 2
    assert best is not None
    return best


def zoomed_course(signals: NDArray[np.float64], per_turn: int, comb: Comb, frame_turns: float) -> Course:
    """The course of the remaining error in a signal over coarse angles, within 1 %."""
    frames = line_heights(signals, float(per_turn), frame_turns, frame_turns / 4, comb.top * (1 + _ZOOM))
    candidates = _candidates(1 - _ZOOM, 1 + _ZOOM, frames, comb)
    evidence = comb_evidence(frames, candidates, comb.orders, comb.weights)
    return _course(frames, evidence, candidates, frame_turns, _ZOOM / frame_turns, rivals=False)


def line_score(signals: NDArray[np.float64], per_turn: int, comb: Comb) -> float:
    """How clearly the comb shows in the spectrum of the whole signal over angles, in dB."""
    turns = signals.shape[1] / per_turn
    frames = line_heights(signals, float(per_turn), turns, turns, comb.top * 1.01, _TOP_DB)
    return float(comb_evidence(frames, np.ones(1), comb.orders, comb.weights)[0, 0])


def best_factor(signals: NDArray[np.float64], per_turn: int, comb: Comb) -> float:
    """By what factor, within 1 %, the speed is off the one at which the comb shows best."""
    turns = signals.shape[1] / per_turn
    frames = line_heights(signals, float(per_turn), turns, turns, comb.top * (1 + _ZOOM), _TOP_DB)
    candidates = _candidates(1 - _ZOOM, 1 + _ZOOM, frames, comb)
    evidence = comb_evidence(frames, candidates, comb.orders, comb.weights)[0]
    return float(candidates[int(np.argmax(evidence))])


def models(course: Course) -> Iterator[tuple[float, Course]]:
    """The course as a constant, a straight line, a parabola, and as it was found.

    Each with the share of the whole that stands behind an independent value of the speed.
    """
    count = course.at.size
    for degree in range(min(3, count - 1)):
        # The median line (iterated weights) does not follow frames that lost the comb.
        basis = np.vander((course.at - course.at.mean()) / max(np.ptp(course.at), 1e-12), degree + 1)
        weight = np.ones(count)
        for _ in range(8):
            root = np.sqrt(weight)[:, None]
            fit = np.linalg.lstsq(basis * root, course.log_speed * root[:, 0])[0]
            off = np.abs(course.log_speed - basis @ fit)
            weight = 1 / np.maximum(off, max(float(np.median(off)), 1e-9))
        yield 1 / (degree + 1), replace(course, log_speed=basis @ fit)
    if count >= 5:
        yield course.frame / (course.frame + float(np.ptp(course.at))), course


def log_speed(course: Course, at: NDArray[np.float64]) -> NDArray[np.float64]:
    """The course smoothed over two frames, carried on in straight lines beyond the outermost centres.

    A cubic smoothing spline of N points h apart passes 1 / (1 + lambda h w^4) of a wave of frequency w:
    half of one with a period of two frames.
    """
    if course.at.size < 5:
        return np.full(at.size, float(np.mean(course.log_speed)))
    hop = float(np.mean(np.diff(course.at)))
    spline = make_smoothing_spline(course.at, course.log_speed, lam=(course.frame / np.pi) ** 4 / hop)
    inside = np.clip(at, course.at[0], course.at[-1])
    slope = spline(inside, nu=1)
    return np.asarray(spline(inside) + (at - inside) * slope)


def _candidates(low: float, high: float, frames: Frames, comb: Comb) -> NDArray[np.float64]:
    """Speeds so close that the highest line moves by half a resolution from one to the next."""
    step = _LINE_SHARE * frames.resolution / (comb.top * math.sqrt(low * high))
    count = min(_MOST_CANDIDATES, max(3, math.ceil(math.log(high / low) / step) + 1))
    return np.geomspace(low, high, count)


def _course(
    frames: Frames,
    evidence: NDArray[np.float64],
    candidates: NDArray[np.float64],
    frame: float,
    change: float,
    *,
    rivals: bool,
) -> Course:
    step = math.log(candidates[-1] / candidates[0]) / (candidates.size - 1)
    hop = float(np.mean(np.diff(frames.centres))) if frames.centres.size > 1 else 1.0
    per_hop = change * hop / step  # candidates in a change of one standard deviation
    penalty = 0.5 * _TEMPER_DB / max(per_hop, 0.5) ** 2
    reach = int(min(_MOST_STEPS, max(1, math.ceil(3 * per_hop)), candidates.size - 1))
    path, score = best_path(evidence, penalty, reach)
    log_path = np.log(candidates[path]) + step * _vertex(evidence, path)
    rival = 0.0
    if rivals:
        width = max(1, math.ceil(_NEAR / step))
        other = evidence.copy()
        for row, place in enumerate(path):
            other[row, max(0, place - width) : place + width + 1] = -1e3
        rival = max(0.0, best_path(other, penalty, reach)[1])
    return Course(frames.centres, log_path, frame, score, rival)


def _vertex(evidence: NDArray[np.float64], path: NDArray[np.intp]) -> NDArray[np.float64]:
    """Where between candidates the evidence is highest, in candidates from the path."""
    place = np.clip(path, 1, evidence.shape[1] - 2)
    rows = np.arange(path.size)
    left, mid, right = (evidence[rows, place + k] for k in (-1, 0, 1))
    curve = 2 * mid - left - right
    shift = 0.5 * (right - left) / np.where(curve > 1e-9, curve, np.inf)
    return np.where(place == path, np.clip(shift, -0.5, 0.5), 0.0)
